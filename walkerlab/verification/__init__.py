"""Extreme cases, problems with known answers, and the measures they are judged by."""
