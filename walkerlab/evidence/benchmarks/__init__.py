"""Benchmarks of methods and engines: walks, references and ladders of tolerances."""
