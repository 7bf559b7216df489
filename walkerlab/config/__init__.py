"""Config schema, a loader that keeps track of positions, the layers of a config, and the reference of its keys."""
