"""Ground contact as ADAMS computes it: normal force, friction, terrain, and the walker on it."""
