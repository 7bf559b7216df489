"""Step map of a walker from section to section, as a function of one parameter, and its gaits, for either model.

`rigid_map.RigidMap` is the rigid model, `contact_map.ContactMap` a walker on compliant ground. A period-n gait is a
fixed point of n steps, `walk_steps`, whose derivative is the product of the steps' derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.newton import Effort, Evaluated, NotConverged, newton
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats

Walker = TypeVar("Walker")
PARAMETER_STEP = 1e-3  # relative step of the parameter in difference formulas
CACHE_SIZE = 4096  # walkers cached per step map
# offsets and weights of second-order formulas for a first derivative
CENTRAL_2ND: tuple[tuple[int, float], ...] = ((-1, -0.5), (1, 0.5))
FORWARD_2ND: tuple[tuple[int, float], ...] = ((0, -1.5), (1, 2.0), (2, -0.5))
identity = lru_cache(np.eye)  # The matrices are shared, so never write to them.
no_values = partial(np.zeros, 0)
NO_TIMES = np.zeros(0)
VARIATION = 1e-6  # difference step of section coordinates, and of heights (m)
INSTANT_S = 1e-6  # s, time step of the finite differences that give the rates of samples


@dataclass(frozen=True)
class Monitor:
    """A quantity whose limit the model assumes but does not enforce."""

    name: str
    unit: str
    meaning: str
    limit: float | None = None


@dataclass(frozen=True)
class MappedStep:
    outcome: Outcome | None
    z: Floats  # (d,) section coordinates at the end
    DP: Floats  # (d, d) derivative with respect to the start, if requested
    period_s: float
    length_m: float  # distance walked
    angle: float  # rad, angle of the stance leg just after the step's heel strike
    strike_s: float  # time of that heel strike, from the start of the step


@dataclass(frozen=True)
class Iterates:
    outcome: Outcome
    points: Floats  # (steps, d) section coordinates after each step
    lengths: Floats  # (steps,) factor by which each step stretches the tangent; empty without a tangent
    periods_s: Floats  # (steps,) durations
    angles: Floats  # (steps,) rad, as in `MappedStep`


@dataclass(frozen=True)
class DisturbedWalk:
    """A walk that starts on the section, over uneven ground or after a push."""

    outcome: Outcome  # WALKED if every step was completed
    durations_s: Floats  # (steps,) times between heel strikes
    lengths_m: Floats  # (steps,) distances walked
    angles_rad: Floats  # (steps,) angle of the stance leg from the vertical, just after each heel strike
    z: Floats  # (d,) last point on the section


@dataclass(frozen=True, eq=False)
class VariedWalk:
    """Derivatives of a walk from the section with respect to changes of its start and of the heights, one per column.

    The times of the samples stay fixed.
    """

    durations_s: Floats  # (steps, columns)
    lengths_m: Floats  # (steps, columns)
    angles_rad: Floats  # (steps, columns), as in `DisturbedWalk`
    rates: Floats  # (times, 2) angular velocities of the legs (rad/s), ordered as in `StepMap.sample_legs`
    samples_rad: Floats  # (times, columns, 2) derivatives of the legs' angles, in the same order


class Stepper(Protocol):
    def step(self, z: Floats, p: float, derived: bool = True, swing: int = 0) -> MappedStep:
        """Take a step from z (d,) at parameter p, with its derivative. The outcome is None if p gives no valid walker.

        swing  number of steps taken before, which matters if the legs differ: leg 1 swings in even steps
        """


class StepMap(Stepper, Protocol):
    """Step of a walker from section to section, with the derivatives and limits that continuation needs."""

    # all coordinates of the section are of order one
    monitors: tuple[Monitor, ...]  # quantities that `watch` measures
    scale: float  # size of a typical change of the parameter
    tolerances: Tolerances  # solver settings of a step
    probe: float  # size of a disturbance with a linear response, in units of the walker
    stride: int = 1  # number of steps after which the map repeats: 2 for legs that differ
    disturbs_after: int = 0  # number of heel strikes from a section to the first step disturbed by heights or pushes

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        """Return the worst value (monitors,) of each monitored quantity over `steps` steps from z."""

    def take_disturbed_walk(
        self, z: Floats, p: float, heights_m: Floats, push_N_s: float = 0.0, swing: int = 0
    ) -> DisturbedWalk:
        """Walk from z (d,) over uneven ground, after a push at the hip along the slope.

        heights_m  (steps + 1,) heights of the footholds, starting with the current one
        swing      as in `Stepper.step`
        """

    def rest_on_ground(self, z: Floats, p: float) -> Floats:  # noqa: ARG002
        """Return z (d,) with the stance foot at rest on the ground."""
        # A foot stands in compliant ground at a depth that depends on the parameters. At another depth it would bounce.
        return z

    def sample_legs(self, z: Floats, p: float, heights_m: Floats, times_s: Floats) -> Floats:
        """Sample the angles (times, 2) of both legs in a disturbed walk. Column 0 is the leg that swings first.

        times_s  increasing times from the first heel strike on, all before the last heel strike
        """

    def differentiate_walk(
        self,
        z: Floats,
        p: float,
        heights_m: Floats,
        along: Floats,
        times_s: Floats = NO_TIMES,
        kicked: bool = False,  # noqa: ARG002
    ) -> VariedWalk | None:
        """Differentiate a disturbed walk and its samples in the direction of each column of `along`.

        along   (d + steps + 1, columns), changes of z and of the heights (m)
        kicked  whether to append columns for sudden changes of the rates at the heel strikes between steps: one column
                for each rate that is free at the strike

        This default takes difference quotients and ignores `kicked`. Returns None if the walk, or a slightly changed
        one, ends early.
        """
        columns = [differentiate_along(self, z, p, heights_m, column, times_s) for column in along.T]
        if not columns or any(column is None for column in columns):
            return None
        rates = np.zeros((0, 2))
        if times_s.size:
            later = self.sample_legs(z, p, heights_m, times_s)
            earlier = self.sample_legs(z, p, heights_m, times_s - INSTANT_S)
            rates = (later - earlier) / INSTANT_S
        durations, lengths, angles, samples = (np.stack(parts, axis=1) for parts in zip(*columns, strict=True))
        return VariedWalk(durations, lengths, angles, rates, samples)

    def cost_of_transport(self, z: Floats, p: float) -> float | None:
        """Return the work of a stride from z (d,) divided by (weight times distance), or None if a step fails."""

    def leg_and_pendulum(self, p: float) -> tuple[float, float]:
        """Return leg length (m) and pendulum time (s) of the walker at p."""

    def replace_tolerances(self, tolerances: Tolerances) -> StepMap: ...

    def iterate(self, z: Floats, p: float, steps: int, tangent: Floats | None) -> Iterates:
        """Walk up to `steps` steps from z (d,). If there is a tangent (d,), multiply it by each step's derivative."""
        completed = list[MappedStep]()
        lengths = list[float]()
        outcome = Outcome.WALKED
        for swing in range(steps):
            step = self.step(z, p, tangent is not None, swing)
            outcome = Outcome.REJECTED if step.outcome is None else step.outcome
            if outcome is not Outcome.WALKED:
                break
            z = step.z
            completed.append(step)
            if tangent is not None:
                image = step.DP @ tangent
                lengths.append(float(np.linalg.norm(image)))
                tangent = image / lengths[-1]
        waits = [0.0, *(step.period_s - step.strike_s for step in completed)]
        return Iterates(
            outcome,
            np.array([step.z for step in completed]).reshape(-1, z.size),
            np.array(lengths),
            np.array([wait + step.strike_s for wait, step in zip(waits, completed, strict=False)]),
            np.array([step.angle for step in completed]),
        )


def differentiate_by_parameter(step_map: StepMap, z: Floats, p: float, swing: int = 0) -> tuple[Outcome | None, Floats]:
    """Return the outcome of steps from z (d,) at values near p, and the derivative (d,) of a step with respect to p."""
    # Only predictors and Newton's method use this second-order difference, so it does not affect any result.
    # Near zero, h is relative to p, because a parameter such as a mass must not become negative.
    h = PARAMETER_STEP * (min(step_map.scale, abs(p)) if p != 0.0 else step_map.scale)
    for formula in (CENTRAL_2ND, FORWARD_2ND, tuple((-offset, -weight) for offset, weight in FORWARD_2ND)):
        steps = [step_map.step(z, p + offset * h, False, swing) for offset, _ in formula]
        outcomes = [step.outcome for step in steps]
        # If a value gives no valid walker or start, try the next formula, which is one-sided.
        if None in outcomes or Outcome.REJECTED in outcomes:
            continue
        outcome = next((outcome for outcome in outcomes if outcome is not Outcome.WALKED), Outcome.WALKED)
        weighted = (weight / h * step.z for step, (_, weight) in zip(steps, formula, strict=True))
        return outcome, sum(weighted, 0.0 * steps[0].z)
    return None, 0.0 * z


def differentiate_along(
    step_map: StepMap, z: Floats, p: float, heights_m: Floats, along: Floats, times_s: Floats
) -> tuple[Floats, ...] | None:
    """Return the directional derivatives of step quantities (steps,) and samples (times, 2) of a disturbed walk.

    along  (d + steps + 1,) changes of z and of the heights (m)

    Returns None if a walk fails.
    """
    ends = []
    h = VARIATION / np.abs(along).max()
    for offset, weight in CENTRAL_2ND:
        moved = z + offset * h * along[: z.size]
        heights = heights_m + offset * h * along[z.size :]
        walk = step_map.take_disturbed_walk(moved, p, heights)
        if walk.outcome is not Outcome.WALKED:
            return None
        samples = step_map.sample_legs(moved, p, heights, times_s) if times_s.size else np.zeros((0, 2))
        parts = (walk.durations_s, walk.lengths_m, walk.angles_rad, samples)
        ends.append([weight / h * part for part in parts])
    return tuple(first + second for first, second in zip(*ends, strict=True))


def valid(walker: Walker | None) -> Walker:
    assert walker is not None, "p must give a valid walker"
    return walker


def failed_step(outcome: Outcome | None, d: int) -> MappedStep:
    return MappedStep(outcome, np.zeros(d), np.eye(d), period_s=0.0, length_m=0.0, angle=0.0, strike_s=0.0)


@dataclass(frozen=True, eq=False)
class Cycle:
    """Consecutive steps. The steps of a gait return to its start."""

    outcome: Outcome | None  # outcome of the last step
    value: float  # value of the parameter
    z: Floats  # (d,) start
    steps: tuple[MappedStep, ...]  # completed steps
    DP: Floats  # (d, d) derivative of the end with respect to z
    Dp: Floats = field(default_factory=no_values)  # (d,) derivative of the end with respect to p, if requested
    # (monitors,) worst values over the steps; empty for gaits that are not on a branch
    monitors: Floats = field(default_factory=no_values)

    def mismatch(self) -> Evaluated[Cycle]:
        """Return P^n(z) - z, which is zero for a gait, with its derivative with respect to z."""
        off = self.steps[-1].z - self.z if self.outcome is Outcome.WALKED else self.z
        return Evaluated(self.outcome, off, self.DP - identity(self.z.size), self)

    @property
    def residual(self) -> float:
        return self.mismatch().residual

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        return multipliers_of(self.DP)

    @property
    def stable(self) -> bool:
        return bool(abs(self.multipliers[0]) < 1.0)

    @property
    def step(self) -> MappedStep:
        (step,) = self.steps
        return step

    @property
    def period_s(self) -> float:
        return math.fsum(step.period_s for step in self.steps)

    @property
    def periods_s(self) -> Floats:
        """Durations (n,) of a gait's steps from heel strike to heel strike, independent of the section."""
        waits = [step.period_s - step.strike_s for step in self.steps]
        # A gait repeats, so the last step precedes the first one.
        return np.array([waits[k - 1] + step.strike_s for k, step in enumerate(self.steps)])

    @property
    def lengths_m(self) -> Floats:
        return np.array([step.length_m for step in self.steps])

    @property
    def angles(self) -> Floats:
        """Angles (n,) of the stance leg just after each heel strike (rad)."""
        return np.array([step.angle for step in self.steps])


def walk_steps(step_map: Stepper, z: Floats, p: float, n: int, derived: bool = True, first: int = 0) -> Cycle:
    """Take n steps from z (d,) at parameter p, and compute their derivative if `derived`.

    first  argument `swing` of the first step; it grows by one each step
    """
    steps: list[MappedStep] = []
    position = z
    DP = identity(z.size)
    for swing in range(first, first + n):
        step = step_map.step(position, p, derived, swing)
        if step.outcome is not Outcome.WALKED:
            return Cycle(step.outcome, p, z, tuple(steps), DP)
        position = step.z
        DP = step.DP @ DP if steps and derived else step.DP
        steps.append(step)
    return Cycle(Outcome.WALKED, p, z, tuple(steps), DP)


def add_parameter_derivative(step_map: StepMap, cycle: Cycle) -> Cycle:
    """Return the cycle with its derivative `Dp`, or with the outcome of a step that fails at a nearby value."""
    position = cycle.z
    Dp = 0.0 * cycle.z
    for swing, step in enumerate(cycle.steps):
        outcome, by_parameter = differentiate_by_parameter(step_map, position, cycle.value, swing)
        if outcome is not Outcome.WALKED:
            return replace(cycle, outcome=outcome, Dp=Dp)
        position = step.z
        Dp = step.DP @ Dp + by_parameter
    return replace(cycle, Dp=Dp)


def gait_near(step_map: Stepper, z: Floats, p: float, effort: Effort, n: int = 1) -> Cycle | NotConverged:
    """Solve for the gait of n steps near z (d,) at p by Newton's method."""
    solved = newton(lambda z: walk_steps(step_map, z, p, n).mismatch(), z, effort)
    return solved if isinstance(solved, NotConverged) else solved.evaluated.data


def multipliers_of(DP: Floats) -> NDArray[np.complex128]:
    """Return the eigenvalues in order of decreasing magnitude.

    In a complex pair, the one with the positive imaginary part comes first.
    """
    return sort_multipliers(np.linalg.eigvals(DP).astype(np.complex128))


def sort_multipliers(values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Sort multipliers into the order in which `multipliers_of` returns them."""
    order: Sequence[int] = sorted(range(values.size), key=lambda i: (-abs(values[i]), -values[i].imag))
    return np.asarray(values[list(order)])
