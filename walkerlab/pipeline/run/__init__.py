"""Second layer of the pipeline: run stages, in this process or in workers, and resume long work."""
