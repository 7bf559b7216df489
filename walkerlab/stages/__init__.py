"""The pipeline: what the stages are, in which order they run, and one module for each."""
