"""One question over many configs: which points, computed where, and what became of each."""
