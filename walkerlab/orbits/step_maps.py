"""What families of gaits are followed on: a step map with exact derivative over one parameter, whatever the walker.

`StepMap` is all that continuation, bifurcations and attractors know of a model. `RigidMap` is the rigid model;
`contact_map.ContactMap` is a walker on compliant ground. A period-n gait is a fixed point of n steps in a row,
`walk_steps`, whose derivative is the product of the steps' own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.recorded_walk import take_walk
from walkerlab.hybrid.rigid_observer import Unobserved
from walkerlab.hybrid.rigid_walk import EVENTS, walk
from walkerlab.mechanics.standing import SWING, Standing, swing_foot
from walkerlab.orbits.parameter_step import step_with_parameter, walk_with_tangent
from walkerlab.orbits.similarity import Units, unit_walker
from walkerlab.orbits.step_map import Shooting, new_shooting, on_section, variation_size
from walkerlab.solvers.dop853 import new_dop853
from walkerlab.solvers.registry import ENDLESS, Tolerances, finder_for
from walkerlab.solvers.stepping import clear_counts

Floats = NDArray[np.float64]
W = TypeVar("W")

RTOL, ATOL, BUDGET = 1e-13, 1e-13, 20_000
TOLERANCES = Tolerances("dop853", RTOL, ATOL, ENDLESS)
QUICK_RTOL, QUICK_ATOL = 1e-9, 1e-11  # of long walks
SPREAD = 1e-3  # of the parameter, between the points of the difference formula
REMEMBERED = 4096  # walkers built so far
CENTRAL: tuple[tuple[int, float], ...] = ((-1, -0.5), (1, 0.5))
FORWARD: tuple[tuple[int, float], ...] = ((0, -1.5), (1, 2.0), (2, -0.5))
"""Offsets and weights of formulas of second order for a first derivative."""


@dataclass(frozen=True)
class Monitor:
    """Something that a model assumes and does not enforce; `limit` is where the assumption fails."""

    name: str
    unit: str
    meaning: str
    limit: float | None = None


@dataclass(frozen=True)
class MappedStep:
    """One step from section to section.

    z         (d,) where it led
    DP        (d, d) its derivative with respect to where it began
    Dp        (d,) its derivative with respect to the parameter
    period_s, length_m  its duration and the distance walked
    angle     rad, stance leg just after the step's heel strike
    strike_s  when that is, from the section on
    """

    outcome: Outcome
    z: Floats
    DP: Floats
    Dp: Floats
    period_s: float
    length_m: float
    angle: float
    strike_s: float


@dataclass(frozen=True)
class Iterates:
    """A walk on the section with a tangent beside it.

    points   (steps, d) where each step led
    lengths  (steps,) by how much the tangent grew in each; empty without one
    periods_s  (steps,)
    angles   (steps,) rad, as in `MappedStep`
    """

    outcome: Outcome
    points: Floats
    lengths: Floats
    periods_s: Floats
    angles: Floats


class StepMap(Protocol):
    """A walker's step from section to section, over one parameter."""

    @property
    def names(self) -> tuple[str, ...]:
        """The section's coordinates, all of magnitude one."""

    @property
    def monitors(self) -> tuple[Monitor, ...]:
        """What `watch` measures."""

    def step(self, z: Floats, p: float) -> MappedStep:
        """One step from z (d,) at the parameter's value p; `outcome` REJECTED where p makes no walker."""

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        """(monitors,) the worst of each over some steps."""

    @property
    def tolerances(self) -> Tolerances:
        """Of its steps."""

    def timed(self, z: Floats, p: float, steps: int, tolerances: Tolerances) -> tuple[Floats, Floats] | None:
        """Durations (steps,) in s and lengths (steps,) in m of a gait's steps, integrated otherwise; None: it fell."""

    def iterate(self, z: Floats, p: float, steps: int, tangent: Floats | None) -> Iterates:
        """Walk `steps` steps, with a tangent (d,) beside if one is given; fewer if the walk ends."""


def difference_formula(build: Callable[[float], W | None], p: float, scale: float) -> tuple[list[W], Floats] | None:
    """Walkers at parameter values near p and their weights in a second-order formula for a derivative.

    Central; one-sided where the parameter ends; None without room.
    """
    h = SPREAD * scale
    backward = tuple((-offset, -weight) for offset, weight in FORWARD)
    for formula in (CENTRAL, FORWARD, backward):
        walkers = [build(p + offset * h) for offset, _ in formula]
        built = [walker for walker in walkers if walker is not None]
        if len(built) == len(walkers):
            return built, np.array([weight / h for _, weight in formula])
    return None


SECTION_NAMES = ("theta_2", "dtheta_1", "dtheta_2", "dtheta_1_shank")


class RigidMap:
    """The rigid model: its coordinates just after the heel strike, of the similar walker of unit size.

    The derivative along the section is exact (`step_map`); that along the parameter is a central difference of exact
    steps, which only steers predictors and Newton's method and enters no result.
    """

    monitors = (
        Monitor("min_normal_force_N", "N", "least normal force on the stance foot", 0.0),
        Monitor("max_friction_ratio", "1", "largest ratio of tangential to normal force"),
        Monitor("max_scuff_depth_m", "m", "depth of the swing foot below the slope"),
    )
    tolerances = TOLERANCES

    def __init__(self, walker_at: Callable[[float], Standing | None], scale: float, like: Standing) -> None:
        """A family of walkers.

        like       one of them
        walker_at  the walker at a value of the parameter; None where it makes no walker
        scale      magnitude of changes of the parameter that matter; the difference formula reaches a little of it
        """
        self._unit_at = lru_cache(REMEMBERED)(lambda p: _similar(walker_at(p)))
        self._near = lru_cache(REMEMBERED)(self._formula)
        self._scale = scale
        n, varied = len(like.blank), variation_size(like)
        self._section, self._places = len(like.picked), list(like.picked)
        self.names = SECTION_NAMES[: self._section]
        walking = new_dop853(n, RTOL, ATOL, BUDGET)
        self._finder = finder_for(walking, EVENTS)
        self._with_variation = new_dop853(varied, RTOL, ATOL, BUDGET)
        self._quick = new_dop853(n, QUICK_RTOL, QUICK_ATOL, ENDLESS)
        self._quick_variation = new_dop853(varied, QUICK_RTOL, QUICK_ATOL, ENDLESS)
        self._shooting: Shooting | None = None
        self._Dp = np.zeros(self._section)

    def _formula(self, p: float) -> tuple[tuple[Standing, ...], Floats] | None:
        scale = min(self._scale, abs(p)) if p != 0.0 else self._scale
        found = difference_formula(self._unit_at, p, scale)
        return None if found is None else (tuple(walker for walker, _ in found[0]), found[1])

    def similar(self, p: float) -> tuple[Standing, Units] | None:
        """The unit walker at a value of the parameter, and its units."""
        return self._unit_at(p)

    def _shooting_of(self, walker: Standing) -> Shooting:
        if self._shooting is None:
            self._shooting = new_shooting(walker, self._with_variation, self._finder)
        return self._shooting._replace(walker=walker)

    def step(self, z: Floats, p: float) -> MappedStep:
        """One step with all derivatives."""
        unit, near = self._unit_at(p), self._near(p)
        if unit is None or near is None:
            return no_step(Outcome.REJECTED, self._section)
        walker, units = unit
        shooting = self._shooting_of(walker)
        start = np.array(z, float)
        status, period = step_with_parameter(shooting, near[0], near[1], start, self._Dp)
        if status != Outcome.WALKED:
            return no_step(Outcome(status), self._section)
        ahead = shooting.z_next.copy()
        after = on_section(walker, ahead)
        rolled = -walker.radius * (after[SWING] - start[0])  # the foot behind is the one that stood
        length = rolled - swing_foot(walker, after)[1]
        return MappedStep(
            Outcome.WALKED,
            ahead,
            shooting.DP.copy(),
            self._Dp.copy(),
            period * units.time,
            float(length) * units.length,
            float(ahead[0]),
            period * units.time,
        )

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        """Least normal force, largest friction ratio, deepest scuff."""
        unit = self._unit_at(p)
        assert unit is not None, "what is watched was walked"
        walker, units = unit
        taken = take_walk(walker, TOLERANCES, on_section(walker, z), steps)
        return np.array(
            [
                taken.min_normal_force * units.force,
                taken.max_friction_ratio,
                taken.max_scuff_depth * units.length,
            ]
        )

    def timed(self, z: Floats, p: float, steps: int, tolerances: Tolerances) -> tuple[Floats, Floats] | None:
        """Durations (steps,) in s and lengths (steps,) in m of a gait's steps, integrated otherwise."""
        unit = self._unit_at(p)
        assert unit is not None, "a gait was walked"
        walker, units = unit
        taken = take_walk(walker, tolerances, on_section(walker, z), steps)
        return None if taken.steps < steps else (taken.periods_s * units.time, taken.lengths_m * units.length)

    def iterate(self, z: Floats, p: float, steps: int, tangent: Floats | None) -> Iterates:
        """A walk, in one go; of ordinary accuracy, since errors grow on a chaotic attractor whatever they are."""
        unit = self._unit_at(p)
        if unit is None:
            return Iterates(Outcome.REJECTED, np.zeros((0, self._section)), np.zeros(0), np.zeros(0), np.zeros(0))
        walker, units = unit
        if tangent is None:
            start = np.array(on_section(walker, z))
            strikes, knees = np.zeros(steps), np.zeros(steps)
            before, after = np.zeros((steps, len(start))), np.zeros((steps, len(start)))
            status, taken = walk(walker, self._quick, self._finder, Unobserved(), start, strikes, before, after, knees)
            clear_counts(self._quick)
            points, periods = after[:taken, self._places], np.diff(strikes[:taken], prepend=0.0)
            return Iterates(Outcome(status), points, np.zeros(0), periods * units.time, points[:, 0])
        points, lengths, periods = np.zeros((steps, self._section)), np.zeros(steps), np.zeros(steps)
        quick = self._shooting_of(walker)._replace(method=self._quick_variation)
        status, taken = walk_with_tangent(quick, np.array(z, float), np.array(tangent), points, lengths, periods)
        points = points[:taken]
        return Iterates(Outcome(status), points, lengths[:taken], periods[:taken] * units.time, points[:, 0])


def _similar(walker: Standing | None) -> tuple[Standing, Units] | None:
    return None if walker is None else unit_walker(walker)


def no_step(outcome: Outcome, d: int) -> MappedStep:
    """A step that did not come to its end."""
    return MappedStep(outcome, np.zeros(d), np.eye(d), np.zeros(d), 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class IteratedMap:
    """Some steps in a row.

    outcome  of the last step
    steps    those that were taken
    z        (d,) where they led
    DP, Dp   derivatives of all steps together
    """

    outcome: Outcome
    steps: tuple[MappedStep, ...]
    z: Floats
    DP: Floats
    Dp: Floats

    @property
    def period_s(self) -> float:
        """Duration of the steps."""
        return math.fsum(step.period_s for step in self.steps)


def walk_steps(step_map: StepMap, z: Floats, p: float, n: int) -> IteratedMap:
    """n steps from z (d,) at p, by the chain rule."""
    steps: list[MappedStep] = []
    DP, Dp = np.eye(z.size), np.zeros(z.size)
    outcome = Outcome.WALKED
    for _ in range(n):
        step = step_map.step(z, p)
        outcome = step.outcome
        if outcome is not Outcome.WALKED:
            break
        DP, Dp = step.DP @ DP, step.DP @ Dp + step.Dp
        z = step.z
        steps.append(step)
    return IteratedMap(outcome, tuple(steps), z, DP, Dp)


def multipliers_of(DP: Floats) -> NDArray[np.complex128]:
    """Eigenvalues, largest first; of a pair the one with positive imaginary part first."""
    values = np.linalg.eigvals(DP).astype(np.complex128)
    order: Sequence[int] = sorted(range(values.size), key=lambda i: (-abs(values[i]), -values[i].imag))
    return np.asarray(values[list(order)])
