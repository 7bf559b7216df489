"""A pipeline whose points are quick, without an answer, wrong, or deadly."""
