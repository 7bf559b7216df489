"""Pipeline of stages on three floors: `plan` decides what to do, `run` does it, and `store` keeps the results."""
