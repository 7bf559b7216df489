"""The pipeline: its stages, their order, the keys of their results, and how they are run."""
