"""Checks of printed gaits: compare each printed value with the right one, and explain differences."""
