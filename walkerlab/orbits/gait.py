"""A periodic gait of a rigid walker, and what is to be known of it."""

from dataclasses import dataclass

import numpy as np

from walkerlab.hybrid.recorded_walk import take_walk
from walkerlab.mechanics.standing import Standing, swing_foot_motion
from walkerlab.orbits.similarity import Units
from walkerlab.orbits.small_slope import Vector
from walkerlab.orbits.step_map import on_section
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import State


@dataclass(frozen=True)
class Gait:
    """A fixed point of the step map, SI units."""

    state: State  # just after the heel strike
    period: float  # s
    step_length: float  # m
    multipliers: tuple[complex, ...]  # eigenvalues of the step map's derivative, largest first
    residual: float  # rad, largest component of P(x) - x, velocities times sqrt(L/g); from a step walked by itself
    energy: float  # J, time mean over the step, from the stance foot
    energy_drift: float  # J, between least and most of it
    min_normal_force: float  # N
    max_friction_ratio: float | None  # None if the ground pushes nowhere
    max_scuff_depth: float  # m
    trailing_foot_rises: bool  # after the heel strike
    knee_strike: float | None  # s; None for legs without knees
    found_by: tuple[str, ...] = ()  # the searches that led here

    @property
    def spectral_radius(self) -> float:
        """Largest magnitude of a multiplier."""
        return abs(self.multipliers[0])

    @property
    def stable(self) -> bool:
        """Whether small disturbances die out."""
        return self.spectral_radius < 1.0

    @property
    def objections(self) -> tuple[str, ...]:
        """What no ground can give, so that nobody walks this gait; else empty. An unstable gait is a gait."""
        found = []
        if self.min_normal_force < 0.0:
            found.append(f"the ground would have to pull with {-self.min_normal_force:.3g} N")
        if not self.trailing_foot_rises:
            found.append("the foot behind would have to leave through the ground")
        return tuple(found)


def measured(walker: Standing, units: Units, tolerances: Tolerances, z: Vector, DP: Vector) -> Gait | None:
    """The gait at section coordinates z (d,), after walking one step of it; None if that step does not end.

    walker  the unit walker, whose units are `units`
    DP      (d, d) derivative of the step map there
    """
    start = on_section(walker, z)
    step = take_walk(walker, tolerances, start, 1)
    if step.steps == 0:
        return None
    values = sorted((complex(value) for value in np.linalg.eigvals(DP)), key=lambda value: (-abs(value), -value.imag))
    rate, n = 1.0 / units.time, len(start) // 2
    return Gait(
        state=(*start[:n], *(omega * rate for omega in start[n:])),
        period=float(step.periods_s[0]) * units.time,
        step_length=float(step.lengths_m[0]) * units.length,
        multipliers=tuple(values),
        residual=max(abs(end - begin) for end, begin in zip(step.final_state, start, strict=True)),
        energy=step.mean_energy * units.energy,
        energy_drift=step.energy_drift * units.energy,
        min_normal_force=step.min_normal_force * units.force,
        max_friction_ratio=step.max_friction_ratio or None,
        max_scuff_depth=step.max_scuff_depth * units.length,
        trailing_foot_rises=bool(swing_foot_motion(walker, start)[2] >= 0.0),
        knee_strike=None if step.knee_strike_time_s is None else float(step.knee_strike_time_s[0]) * units.time,
    )
