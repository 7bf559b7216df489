"""Ground contact as ADAMS computes it: normal force, friction, terrain."""
