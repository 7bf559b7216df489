"""Config: schema, loader with positions, layers, reference."""
