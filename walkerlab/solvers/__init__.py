"""Integrators: one method a file, one signature, one registry; events located on dense output."""
