"""Step maps of both models, their periodic gaits, and how gaits change with parameters."""
