"""Equilibrium of a walker on one foot on compliant ground."""

import math
from typing import NamedTuple


class RestingFoot(NamedTuple):
    """Foot that carries a walker's whole weight."""

    depth: float  # m, the static penetration
    damping_ratio: float  # c / (2 sqrt(m dF/dd)) at that depth, with full damping c and the total mass m


def resting_foot(weight: float, mass: float, stiffness: float, exponent: float, damping: float) -> RestingFoot:
    """Compute the state of a resting foot that carries a weight, for the force F = k d^e + c d'. SI units.

    weight  N, component normal to the ground
    mass    kg, total mass of the walker
    """
    depth = (weight / stiffness) ** (1.0 / exponent)
    slope = stiffness * exponent * depth ** (exponent - 1.0)
    return RestingFoot(depth, damping / (2.0 * math.sqrt(slope * mass)))
