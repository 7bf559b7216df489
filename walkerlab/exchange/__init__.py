"""Exchange with other programs: export of models (ADAMS, MuJoCo), import of recorded walks."""
