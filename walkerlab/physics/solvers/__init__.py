"""Integrators, one method per file, and the location of events on their dense output."""
