"""Equilibrium of a walker on one foot on compliant ground."""

import math
from typing import NamedTuple


class RestingFoot(NamedTuple):
    """Foot that carries a walker's whole weight."""

    depth: float  # m, the static penetration
    damping_ratio: float  # c / (2 sqrt(dF/dd m)) there, with damping fully developed and the total mass m


def resting_foot(weight: float, mass: float, stiffness: float, exponent: float, damping: float) -> RestingFoot:
    """Compute the state of a foot at rest on ground with the normal force F = k d^e + c d'.

    weight     normal to the ground, N
    mass       kg
    stiffness  k, N/m^e
    exponent   e
    damping    c, N s/m
    """
    depth = (weight / stiffness) ** (1.0 / exponent)
    slope = stiffness * exponent * depth ** (exponent - 1.0)
    return RestingFoot(depth, damping / (2.0 * math.sqrt(slope * mass)))
