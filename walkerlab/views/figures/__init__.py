"""Figures drawn from stored results, one file per subject; only this package uses matplotlib."""
