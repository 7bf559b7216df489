"""Figures drawn from stored results, one file per subject. Only this package uses matplotlib."""
