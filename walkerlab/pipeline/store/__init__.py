"""Keep: results as files with contents, keys, provenance and locks, in run folders."""
