"""Third layer of the pipeline: results as files in run folders, with contents, keys, provenance and locks."""
