"""Evidence that the results are right: the reproduced study, verification cases and benchmarks."""
