"""Passive-dynamic walking as a reproducible experiment; see README.md."""

__version__ = "0.1.0"
