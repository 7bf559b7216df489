"""Similarity: every walker has unit leg length, mass and gravity when measured in its own units.

Searches use the unit walker, so that starting ranges, tolerances and thresholds suit all walkers.
"""

import math
from typing import NamedTuple

import numpy as np

from walkerlab.physics.mechanics.hinges import HIP_ROW, hinge_law
from walkerlab.physics.mechanics.rigid_model import RigidModel, change_slope, pair, replace_fields

# fields of a model that are lengths and depend on its legs
LENGTHS = ("radius", "swing_radius", "foot_x", "foot_y", "hip_x", "hip_y", "swing_hip_x", "swing_hip_y")


class Units(NamedTuple):
    length: float  # m
    mass: float  # kg
    time: float  # s, sqrt(L / g)

    @property
    def energy(self) -> float:
        return self.mass * (self.length / self.time) ** 2

    @property
    def force(self) -> float:
        return self.mass * self.length / self.time**2

    @property
    def impulse(self) -> float:
        return self.mass * self.length / self.time

    def natural_unit(self, unit: str) -> float:
        """Return the walker's natural unit, in SI, for a quantity with the config's `unit`, such as 'N m'.

        Raises KeyError for an unknown unit.
        """
        basic = {"": 1.0, "1": 1.0, "m": self.length, "kg": self.mass, "s": self.time}
        derived = {"kg m^2": self.mass * self.length**2, "N s": self.impulse, "N m": self.energy}
        return (basic | derived | {"N m/rad": self.energy, "N m s/rad": self.energy * self.time})[unit]


def unit_walker(walker: RigidModel) -> tuple[RigidModel, Units]:
    """Return the similar walker with L = g = 1 and a total mass of 1, and its units."""
    length = float(walker.leg_length)
    mass = float(walker.mass)
    if length == mass == walker.gravity == 1.0:
        return walker, Units(1.0, 1.0, 1.0)
    units = Units(length, mass, math.sqrt(length / walker.gravity))
    inertia = 1.0 / (mass * length * length)
    moment = 1.0 / (mass * length)
    scales = {
        **dict.fromkeys(("A", "B", "unpaired"), inertia),
        **dict.fromkeys(("arm_x", "arm_y"), moment),
        "laws": 1.0 / np.array(hinge_law(walker, HIP_ROW).units(units.energy, units.time)),
        "push_off": 1.0 / units.impulse,
        **dict.fromkeys(LENGTHS, 1.0 / length),
    }

    def similar(model: RigidModel) -> RigidModel:
        units = dict.fromkeys(("mass", "leg_length", "gravity"), 1.0)
        scaled = {name: scale * model[name] for name, scale in scales.items()}
        # The components of gravity follow from the new g.
        return change_slope(replace_fields(model, units | scaled), model.slope)

    unit = similar(walker)
    return unit if walker.paired_with is None else pair(unit, similar(walker.paired_with)), units
