"""Build minimal models from a config, and list what they omit and why."""
