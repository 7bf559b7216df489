"""Decide: which config and folder are asked for, which stages they need, and which results are up to date."""
