"""Sweeps compute one stage for many configs. Here are their points, the engines that compute them, and their
results."""
