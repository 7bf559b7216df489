"""First layer of the pipeline: find the config and folder of a request, the stages it needs, and results to reuse."""
