"""The walkers and the ground under them, as scalar compilable functions."""
