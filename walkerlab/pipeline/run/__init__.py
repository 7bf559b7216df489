"""Carry out: run stages, here or in workers, and resume long work."""
