"""Build minimal models from a config, and list the omissions with their reasons."""
