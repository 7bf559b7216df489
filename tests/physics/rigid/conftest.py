"""Examples are the same in every run, and none is hurried: the first ones may have to compile."""

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True, database=None)
settings.load_profile("repeatable")
