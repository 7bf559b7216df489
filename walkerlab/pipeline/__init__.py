"""Pipeline of stages in three layers: `plan` decides what to do, `run` does it, and `store` keeps the results."""
