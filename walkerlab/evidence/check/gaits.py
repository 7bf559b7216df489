"""Plain walkers of configs, their gaits, and the values that may be printed of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from walkerlab.config.check import Instant
from walkerlab.config.reads import RigidConfig
from walkerlab.config.second_leg import describe_second_leg
from walkerlab.config.walkers import CompassWalker, Kneed, StraightLegs
from walkerlab.evidence.check.conventions import Convention, state_at
from walkerlab.evidence.check.plain_walker import (
    EXACT,
    NO_PART,
    STANCE,
    STRAIGHT,
    SWING,
    Floats,
    LegPart,
    PlainStep,
    PlainWalker,
)
from walkerlab.evidence.check.printed import Item, match_multipliers

BEFORE: Instant = "before-strike"
NOTHING: Final[Mapping[str, Any]] = MappingProxyType({})
POWERS_OF_TIME = {"period_s": -1, "knee_strike_s": -1, "speed_m_s": 1}
"""Power of rates in which a quantity scales with the unit of time."""
SUMMED_OVER_STEPS = ("period_s", "step_length_m")
"""Quantities whose value for a stride is the sum of the values of its steps."""
# Near the optimum of central differences of steps with errors of `EXACT`: rad, and rad/s times sqrt(L/g).
DIFFERENCE = 1e-6
MAX_MOVES = 16
SMALLEST_MOVE = 1e-13
MAX_RESIDUAL = 1e-11  # residual of a gait, which rounding may leave
SLOW_RATIO = 0.1  # ratio of successive errors above which the derivative is computed again


def why_not_plain(config: RigidConfig) -> str:
    """Explain why the plain model does not describe a config's walker, or return '' if it does."""
    if describe_second_leg(config.walker):
        return "the plain model has two equal legs"
    if not isinstance(config.walker, CompassWalker | StraightLegs | Kneed):
        return "the plain model has no walkers of type parts"
    return ""


def plain_walker(config: RigidConfig, changed: Any = None) -> PlainWalker:
    """Build the plain model of a config's walker, or of a changed one on its slope."""
    walker = changed or config.walker
    assert isinstance(walker, CompassWalker | StraightLegs | Kneed), "why_not_plain allows no other"
    # the compass rolls on its ball feet in the contact model only
    radius = 0.0 if isinstance(walker, CompassWalker) else walker.foot_radius_m
    torso = walker.torso
    plain = PlainWalker(
        parts=(NO_PART, NO_PART),
        knee=0j,
        hip_mass=walker.hip_mass_kg,
        foot=getattr(walker, "foot_centre_ahead_m", 0.0) - 1j * (walker.leg_length_m - radius),
        radius=radius,
        gravity=config.gravity_m_s2,
        slope=config.slope_rad,
        torso=NO_PART if torso is None else LegPart(torso.mass_kg, 1j * torso.above_hip_m, torso.inertia_kg_m2),
        hip=(walker.hip.spring_N_m_per_rad, walker.hip.damping_N_m_s_per_rad, walker.hip.torque_N_m),
        push_off=config.push_off.impulse_N_s,
        signs={(STRAIGHT, STANCE, SWING): -1.0} if config.equations == "as-printed" else {},
    )
    if not isinstance(walker, Kneed):
        below = walker.mass_to_hip_m if isinstance(walker, CompassWalker) else walker.leg_mass_below_hip_m
        centre = getattr(walker, "leg_mass_ahead_m", 0.0) - 1j * below
        return replace(plain, parts=(LegPart(walker.leg_mass_kg, centre, walker.leg_inertia_kg_m2), NO_PART))
    thigh = walker.thigh
    shank = walker.shank
    upper = LegPart(thigh.mass_kg, thigh.mass_ahead_m - 1j * thigh.mass_below_hip_m, thigh.inertia_kg_m2)
    lower = LegPart(shank.mass_kg, shank.mass_ahead_m - 1j * shank.mass_below_knee_m, shank.inertia_kg_m2)
    free = walker.knee.at_heel_strike == "free"
    damping = walker.knee.damping_N_m_s_per_rad
    knee = -1j * thigh.length_m
    return replace(plain, parts=(upper, lower), knee=knee, free_at_strike=free, knee_damping=damping)


def scales(walker: PlainWalker, size: int) -> Floats:
    """Return the units (size,) of coordinates just after a heel strike: 1 for angles, sqrt(g/L) for rates."""
    return np.array([1.0, 1.0, *[1.0 / walker.pendulum_time] * (size - 2)])


def derivative(walker: PlainWalker, start: Floats, tolerance: float = EXACT) -> Floats | None:
    """Return the derivative of the step map at a start by central differences, or None where a step fails."""
    columns = []
    moves = DIFFERENCE * scales(walker, len(start))
    for k, move in enumerate(moves):
        ends = []
        for sign in (1.0, -1.0):
            moved = start.copy()
            moved[k] += sign * move
            ends.append(walker.step(moved, tolerance))
        if ends[0] is None or ends[1] is None:
            return None
        columns.append((ends[0].after - ends[1].after) / (2.0 * move))
    return np.array(columns).T


@dataclass(frozen=True, eq=False)
class CheckedStep:
    """One step of a walker: a gait, or a first guess at one."""

    walker: PlainWalker
    start: Floats  # coordinates just after the heel strike
    step: PlainStep

    @cached_property
    def derivative(self) -> Floats | None:
        return derivative(self.walker, self.start)

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the step map on its section, largest first. The one that is always zero is left out."""
        if self.derivative is None:
            return ()
        values = sorted(map(complex, np.linalg.eigvals(self.derivative).tolist()), key=abs, reverse=True)
        return tuple(values[:-1])

    def quantity(self, name: str) -> Any:
        """Return a value by name, or None if the plain model lacks it."""
        if name == "multipliers":
            return self.multipliers
        if name == "spectral_radius":
            return abs(self.multipliers[0]) if self.multipliers else None
        speed = self.step.length / self.step.period
        return {
            "period_s": self.step.period,
            "step_length_m": self.step.length,
            "speed_m_s": speed,
            "froude": speed / math.sqrt(self.walker.gravity * self.walker.leg_length),
            "knee_strike_s": self.step.knee_strike,
        }.get(name)

    def values(
        self, items: Sequence[Item], convention: Convention, measured: Mapping[str, Any] = NOTHING
    ) -> dict[str, complex | None]:
        """Return the right value of each printed number in the printed conventions, or None if the models lack it.

        measured  values of the compiled model by name, which replace those of the plain one
        """
        instants = {"state": convention.instant, "state_before": BEFORE}
        values: dict[str, complex | None] = {}
        known: dict[str, Any] = {}
        for name in {item.quantity for item in items}:
            if name in instants:
                state = self.state(instants[name], convention.origin == "vertical")
                known[name] = [] if state is None else convention.write(self.walker, state)
            else:
                known[name] = measured[name] if name in measured else self.quantity(name)
        for item in items:
            value = known[item.quantity]
            if isinstance(value, list | tuple):
                value = value[item.place] if item.place < len(value) else None
            if value is not None:
                value *= convention.rate_factor(self.walker) ** POWERS_OF_TIME.get(item.quantity, 0)
                value *= convention.steps if item.quantity in SUMMED_OVER_STEPS else 1
                value = complex(value ** (convention.steps if item.quantity == "spectral_radius" else 1))
            values[item.name] = value
        listed = [item for item in items if item.quantity == "multipliers"]
        return values | match_multipliers(listed, [value**convention.steps for value in known.get("multipliers", ())])

    @cache  # noqa: B019 - walks are few, and live as long as their check
    def state(self, instant: Instant, vertical: bool) -> Floats | None:
        return state_at(self.walker, self.start, self.step, instant, vertical)


def gait_near(walker: PlainWalker, start: Floats, A: Floats | None = None) -> CheckedStep | None:
    """Find the gait near a start by Newton's method, or return None if it is not found.

    A  derivative of the step map of a similar walker, with which the search begins
    """
    unit = scales(walker, len(start))
    best: CheckedStep | None = None
    x: Floats = np.array(start, float)
    last = math.inf
    is_own = False  # whether A is this walker's own derivative
    for _ in range(MAX_MOVES):
        step = walker.step(x)
        size = math.inf if step is None else float(np.abs((step.after - x) / unit).max())
        if step is not None and size < last:
            best = CheckedStep(walker, x, step)
            if size < SMALLEST_MOVE:
                return best
            slow = size > SLOW_RATIO * last
            last = size
        elif best is None or last < MAX_RESIDUAL:
            return best
        elif is_own:
            x = 0.5 * (x + best.start)
            continue
        else:
            slow = True
        if A is None or slow:
            A = derivative(walker, best.start, 1e-10)
            is_own = True
            if A is None:
                return None
        x = best.start - np.linalg.solve(A - np.eye(len(x)), best.step.after - best.start)
    return None
