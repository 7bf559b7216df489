"""What separates the contact model from the rigid one: its contact led towards the rigid limit, knob by knob.

Stiffness k, damping c and stiction velocity v_s are the knobs. With k the penetration d_max of full damping shrinks as
the static penetration does, and with v_s the friction velocity v_d.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.comparison import (
    PHASES,
    Motion,
    between_impacts,
    difference_in_phase,
    difference_in_time,
    sampled_at_strikes,
)
from walkerlab.hybrid.contact_events import JudgedGround
from walkerlab.hybrid.contact_run import ContactWalkResult, walk_contact
from walkerlab.orbits.contact_gait import ContactGait, find_contact_gait
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import State

METHOD, BUDGET = "radau5", 50_000_000
GAIT_TOLERANCE, CHECK_TOLERANCE = 1e-10, 1e-11
WALK_TOLERANCE, WALK_CHECK = 1e-8, 1e-10  # of the walks that are timed, and of those that show their numerical error
ABSOLUTE = 0.01  # absolute tolerance in relative ones
REPEATS = 3
MAX_EVALUATIONS = 30  # of Newton's method


class ContactFactors(NamedTuple):
    """A contact: by which factors its numbers differ from the config's."""

    series: str
    rigidity: float  # how far the series has gone towards the limit
    stiffness: float
    damping: float
    stiction: float


ALL, ALL_POINT = "all", "all, point foot"
STICTION, STIFFNESS, DAMPING, NORMAL = "stiction velocity", "stiffness", "damping", "stiffness and damping"
HALF_DECADES = math.sqrt(10.0)


def series_of(name: str, every: int = 1) -> list[ContactFactors]:
    """The settings of a series, from the config's contact towards the limit; of these every first, second or so on."""
    steps = {ALL: 9, ALL_POINT: 9, STICTION: 15, STIFFNESS: 6, DAMPING: 6, NORMAL: 9}[name]
    ratio = 2.0 if name == STICTION else HALF_DECADES
    found = []
    for step in range(steps):
        factor = ratio**step
        stiffness = factor if name in (ALL, ALL_POINT, STIFFNESS, NORMAL) else 1.0
        damping = factor if name == DAMPING else math.sqrt(factor) if name in (ALL, ALL_POINT, NORMAL) else 1.0
        stiction = 1.0 / factor if name in (ALL, ALL_POINT, STICTION) else 1.0
        found.append(ContactFactors(name, factor, stiffness, damping, stiction))
    return found[::every]


def with_contact_of(walker: ContactWalker, setting: ContactFactors) -> ContactWalker:
    """The walker on another ground."""
    normal = walker.normal
    normal = normal._replace(
        stiffness=normal.stiffness * setting.stiffness,
        damping=normal.damping * setting.damping,
        full_damping_penetration=normal.full_damping_penetration * setting.stiffness ** (-1.0 / normal.exponent),
    )
    return walker._replace(normal=normal, friction=walker.friction.with_creep(setting.stiction))


@dataclass(frozen=True)
class Distance:
    """How far a setting's walk is from the rigid one's, and how well that is known.

    numerical_period  s, change of the period when the tolerance is ten times tighter
    angle, velocity   largest difference in phase over the walk, between impacts; raw at the same time
    numerical_time    s, change of the last touch's time with the tolerance a hundred times tighter
    wall_s            s, processor time of the walk, the least of several

    What is of walks is None where no walk is compared.
    """

    setting: ContactFactors
    period: float
    length: float
    slip: float
    period_error: float
    length_error: float
    numerical_period: float
    angle: float | None = None
    velocity: float | None = None
    raw_angle: float | None = None
    raw_velocity: float | None = None
    numerical_time: float | None = None
    evaluations: int | None = None
    wall_s: float | None = None


@dataclass(frozen=True)
class RigidGait:
    """What the distances are measured from."""

    period: float
    length: float
    motion: Motion  # of the walk from the rigid start


@dataclass(frozen=True)
class Limit:
    """A scene and its rigid counterpart."""

    ground: JudgedGround
    rigid: RigidGait
    steps: int
    sampling: float  # s
    every: int = 1  # of the settings of a series

    def series(
        self, name: str, walker: ContactWalker, gait: ContactGait, start: Callable[[ContactWalker], State] | None = None
    ) -> list[Distance]:
        """The distances along a series, each gait searched from the one before; ends where a gait is lost.

        start  the walk's start, if whole walks are to be compared too
        """
        found: list[Distance] = []
        for setting in series_of(name, self.every):
            changed = with_contact_of(walker, setting)
            near = self.gait(changed, gait, GAIT_TOLERANCE)
            if near is None:
                break
            gait = near
            check = self.gait(changed, gait, CHECK_TOLERANCE)
            distance = self.distance(setting, gait, check)
            found.append(distance if start is None else self.walked(distance, changed, start(changed)))
        return found

    def gait(self, walker: ContactWalker, near: ContactGait, tolerance: float) -> ContactGait | None:
        """The gait on this ground near another one's; None if it is not found."""
        how = settings(tolerance)
        found = find_contact_gait(walker, self.ground, how, near.z, near.step.length_m, most=MAX_EVALUATIONS)
        return found if isinstance(found, ContactGait) else None

    def distance(self, setting: ContactFactors, gait: ContactGait, check: ContactGait | None) -> Distance:
        """Of the gaits alone."""
        step = gait.step
        return Distance(
            setting,
            step.period_s,
            step.length_m,
            step.slip_m,
            step.period_s - self.rigid.period,
            step.length_m - self.rigid.length,
            abs(check.step.period_s - step.period_s) if check is not None else abs(step.period_s - self.rigid.period),
        )

    def walked(self, distance: Distance, walker: ContactWalker, start: State) -> Distance:
        """With the whole walk from the rigid start beside."""
        walk = self.walk(walker, start, WALK_TOLERANCE, self.sampling)
        check = self.walk(walker, start, WALK_CHECK, None)
        wall_s = min(self.timed(walker, start) for _ in range(REPEATS))
        steps = walk.touch_time_s.size
        if walk.samples is None or steps == 0 or steps != check.touch_time_s.size:
            return distance
        angle, velocity = motion_of_legs(walk.samples.states, walker)
        seen = Motion(walk.samples.time_s, angle, velocity, walk.touch_time_s, walk.knee_strikes_s)
        motion = sampled_at_strikes(seen)
        phases = np.linspace(0.0, 1.0, PHASES)
        aligned = difference_in_phase(motion, self.rigid.motion, phases)
        smooth = between_impacts(motion, self.rigid.motion, phases)
        _, raw = difference_in_time(motion, self.rigid.motion)
        return Distance(
            distance.setting,
            distance.period,
            distance.length,
            distance.slip,
            distance.period_error,
            distance.length_error,
            distance.numerical_period,
            angle=float(np.abs(aligned.angle[smooth]).max()),
            velocity=float(np.abs(aligned.velocity[smooth]).max()),
            raw_angle=float(raw.largest_angle.max()),
            raw_velocity=float(raw.largest_velocity.max()),
            numerical_time=float(abs(walk.touch_time_s[-1] - check.touch_time_s[-1])),
            evaluations=int(walk.work[0]),
            wall_s=wall_s,
        )

    def walk(self, walker: ContactWalker, start: State, tolerance: float, sampling: float | None) -> ContactWalkResult:
        """The walk from the rigid start."""
        return walk_contact(walker, self.ground, False, STANCE_FOOT, start, settings(tolerance), self.steps, sampling)

    def timed(self, walker: ContactWalker, start: State) -> float:
        """Processor time of the walk (s), which other programs do not lengthen."""
        begun = time.process_time()
        self.walk(walker, start, WALK_TOLERANCE, None)
        return time.process_time() - begun


def motion_of_legs(states: NDArray[np.float64], walker: ContactWalker) -> tuple[NDArray[np.float64], ...]:
    """Angles and angular velocities, each (samples, leg), of the legs in states; of legs with knees the thighs'."""
    upper, half = walker.legs[:, 0], states.shape[1] // 2
    return states[:, 2 + upper], states[:, half + 2 + upper]


def settings(tolerance: float) -> Tolerances:
    """The method at a relative tolerance."""
    return Tolerances(METHOD, tolerance, ABSOLUTE * tolerance, BUDGET)


def observed_orders(distances: list[Distance]) -> NDArray[np.float64]:
    """Order with which the period converges along a series, from each three settings in a row."""
    if len(distances) < 3:
        return np.zeros(0)
    periods = np.array([one.period for one in distances])
    ratio = distances[1].setting.rigidity / distances[0].setting.rigidity
    changes = np.abs(np.diff(periods))
    changes = np.maximum(changes, np.finfo(float).tiny)
    return np.log(changes[:-1] / changes[1:]) / math.log(ratio)


@dataclass(frozen=True)
class Extrapolation:
    """The limit of a series' periods, and how far the last two estimates differ (s)."""

    period: float
    uncertainty: float


def extrapolated(distances: list[Distance]) -> Extrapolation | None:
    """The limit by Aitken's method on the last settings that still tell; None if they do not converge.

    A change of the period below its numerical error tells nothing, and neither does what follows.
    """
    periods = np.array([one.period for one in distances])
    errors = np.array([one.numerical_period for one in distances])
    silent = np.flatnonzero(np.abs(np.diff(periods)) <= errors[1:])
    periods = periods[: silent[0] + 1] if silent.size else periods
    if periods.size < 4:
        return None
    estimates = [aitken(*periods[-4 + i : -1 + i if i == 0 else None]) for i in range(2)]
    if any(estimate is None for estimate in estimates):
        return None
    before, last = (float(estimate) for estimate in estimates if estimate is not None)
    return Extrapolation(last, abs(last - before))


def aitken(first: float, second: float, third: float) -> float | None:
    """Aitken's extrapolation of three numbers; None if their changes do not shrink."""
    one, two = second - first, third - second
    if one == 0.0 or not abs(two) < abs(one):
        return None
    return third + two * two / (one - two)
