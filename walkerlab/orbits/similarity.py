"""Similar walkers: every walker is one of unit leg length, total mass and gravity, measured in its own units.

Gaits are sought for the unit walker, so that starting ranges, tolerances and thresholds mean the same for all.
"""

import math
from typing import NamedTuple

from walkerlab.mechanics.standing import Standing, on_slope
from walkerlab.mechanics.tree import Tree
from walkerlab.mechanics.tuples import Vector


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


def unit_walker(walker: Standing) -> tuple[Standing, Units]:
    """The walker similar to `walker` with L = g = 1 and a total mass of 1, and its units."""
    length, mass = walker.leg_length, walker.tree.mass
    inertia, moment = 1.0 / (mass * length * length), 1.0 / (mass * length)

    def unit_tree(tree: Tree) -> Tree:
        A, B = scaled(tree.cosine, inertia), scaled(tree.sine, inertia)
        return Tree(1.0, A, B, scaled(tree.arm_x, moment), scaled(tree.arm_y, moment))

    unit = walker._replace(
        tree=unit_tree(walker.tree),
        centrifugal=unit_tree(walker.centrifugal),
        radius=walker.radius / length,
        foot_x=scaled(walker.foot_x, 1.0 / length),
        foot_y=scaled(walker.foot_y, 1.0 / length),
        hip_x=walker.hip_x / length,
        hip_y=walker.hip_y / length,
        leg_length=1.0,
        gravity=1.0,
    )
    return on_slope(unit, walker.slope), Units(length, mass, math.sqrt(length / walker.gravity))


def scaled(vector: Vector, by: float) -> Vector:
    """A vector times a number."""
    return tuple(by * value for value in vector)
