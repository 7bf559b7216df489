"""Compute a free fall."""

import math


def fall_time(height: float, gravity: float) -> float:
    return math.sqrt(2 * height / gravity)
