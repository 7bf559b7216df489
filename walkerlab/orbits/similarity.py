"""Similar walkers: every compass walker is one of unit leg length, total mass and gravity, measured in its own units.

Gaits are sought for the unit walker, so that starting ranges, tolerances and thresholds mean the same for all.
"""

import math
from typing import NamedTuple

from walkerlab.mechanics.rigid_compass import RigidWalker


class Units(NamedTuple):
    """What one unit of the unit walker measures in SI."""

    length: float  # m
    mass: float  # kg
    time: float  # s, sqrt(L / g)

    @property
    def energy(self) -> float:
        """Unit of energy, J."""
        return self.mass * (self.length / self.time) ** 2

    @property
    def force(self) -> float:
        """Unit of force, N."""
        return self.mass * self.length / self.time**2


def unit_walker(walker: RigidWalker) -> tuple[RigidWalker, Units]:
    """The walker similar to `walker` with L = g = 1 and a total mass of 1, and its units."""
    length = walker.leg_length
    mass = walker.hip_mass + 2.0 * walker.leg_mass
    unit = RigidWalker(
        leg_length=1.0,
        foot_to_mass=walker.foot_to_mass / length,
        leg_mass=walker.leg_mass / mass,
        hip_mass=walker.hip_mass / mass,
        leg_inertia=walker.leg_inertia / (mass * length * length),
        gravity=1.0,
        slope=walker.slope,
        c21_sign=walker.c21_sign,
    )
    return unit, Units(length, mass, math.sqrt(length / walker.gravity))
