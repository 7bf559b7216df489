"""Checks of printed gaits: each printed value beside the right one, and an explanation where they differ."""
