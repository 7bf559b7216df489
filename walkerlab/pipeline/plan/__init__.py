"""First layer of the pipeline: find the requested config and folder, the stages needed, and the results to reuse."""
