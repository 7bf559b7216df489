"""Exchange with other programs: models out (ADAMS, MuJoCo), recorded walks in."""
