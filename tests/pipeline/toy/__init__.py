"""A small pipeline of real stages, for tests of the runner and the command line: a stone is dropped down a slope."""
