"""Extreme cases, each judged by measures that the walk itself does not use."""
