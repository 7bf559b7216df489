"""Sweeps of one stage over many configs: the points, the engines that compute them, and their results."""
