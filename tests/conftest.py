"""What all tests share: property tests draw the same examples everywhere, and a slow machine is no failure."""

from hypothesis import settings

settings.register_profile("walkerlab", deadline=None, derandomize=True, database=None)
settings.load_profile("walkerlab")
