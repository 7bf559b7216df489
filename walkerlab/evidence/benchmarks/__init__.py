"""Benchmarks of integration methods and of other engines."""
