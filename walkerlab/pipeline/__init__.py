"""Pipeline of stages: their order, the keys of their results, and the code that runs them."""
