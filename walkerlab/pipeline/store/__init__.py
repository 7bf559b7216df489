"""Results as files: contents, keys, provenance and locks."""
