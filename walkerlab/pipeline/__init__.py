"""The pipeline: what the stages are, in which order they run, what determines a result, and who computes it."""
