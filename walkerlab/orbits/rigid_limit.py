"""Convergence of the contact model to the rigid one as parameters of its contact approach the rigid limit.

The parameters are stiffness k, damping c and stiction velocity v_s. The penetration d_max of full damping shrinks with
the static penetration as k grows, and the friction velocity v_d with v_s. A push-off is shortened if all three vary.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from walkerlab.ground.terrain import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker, changed_forms
from walkerlab.hybrid.comparison import (
    PHASES,
    Motion,
    between_impacts,
    difference_in_phase,
    difference_in_time,
    sampled_at_strikes,
)
from walkerlab.hybrid.contact_events import JudgedGround
from walkerlab.hybrid.contact_result import ContactWalkResult, walk_contact
from walkerlab.orbits.contact_gait import EFFORT, with_scaled_laws
from walkerlab.orbits.contact_map import OwnPads, step_of
from walkerlab.orbits.step_map import Cycle, gait_near
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import Floats, State

METHOD, BUDGET = "radau5", 50_000_000
GAIT_TOLERANCE, CHECK_TOLERANCE = 1e-10, 1e-11
WALK_TOLERANCE, WALK_CHECK = 1e-8, 1e-10  # of the walks that are timed, and of those that show their numerical error
ABSOLUTE = 0.01  # absolute tolerance in relative ones
REPEATS = 3
SEARCH = EFFORT._replace(most=30)
BRIEF = 0.1  # of sqrt(d / g), d the static penetration: a push-off as short is over while the other foot still lands


class ContactFactors(NamedTuple):
    """Factors on the contact parameters of the config."""

    series: str
    rigidity: float  # how far the series has gone towards the limit
    stiffness: float
    damping: float
    stiction: float


ALL, ALL_POINT = "all", "all, point foot"
STICTION, STIFFNESS, DAMPING, NORMAL = "stiction velocity", "stiffness", "damping", "stiffness and damping"
HALF_DECADES = math.sqrt(10.0)
SERIES = {
    ALL: (9, HALF_DECADES, (1.0, 0.5, -1.0)),
    ALL_POINT: (9, HALF_DECADES, (1.0, 0.5, -1.0)),
    STICTION: (15, 2.0, (0.0, 0.0, -1.0)),
    STIFFNESS: (6, HALF_DECADES, (1.0, 0.0, 0.0)),
    DAMPING: (6, HALF_DECADES, (0.0, 1.0, 0.0)),
    NORMAL: (9, HALF_DECADES, (1.0, 0.5, 0.0)),
}
"""Settings of a series, by how much each is more rigid than the last, and powers of that in the three factors."""


def series_of(name: str, every: int = 1) -> list[ContactFactors]:
    """Return contact settings from the config's towards the rigid limit, every `every`-th of them."""
    count, ratio, powers = SERIES[name]
    rigidities = [ratio**step for step in range(0, count, every)]
    return [ContactFactors(name, rigidity, *(rigidity**power for power in powers)) for rigidity in rigidities]


def with_setting(walker: ContactWalker, setting: ContactFactors) -> ContactWalker:
    """Return the walker on the ground of a setting, with a brief push-off in series towards the rigid limit.

    A longer push-off lifts the leading foot again, however rigid the ground, and leads to another limit.
    """
    changed, law = with_scaled_laws(walker, *setting[2:]), walker.normal
    if setting.series not in (ALL, ALL_POINT) or setting.rigidity == 1.0:
        return changed
    static = (walker.mass * walker.gravity / law.stiffness) ** (1.0 / law.exponent)
    brief = BRIEF * math.sqrt(static / (walker.gravity * setting.stiffness))
    return changed_forms(changed, push_off_duration=min(brief, float(walker.whole.push_off_duration)))


@dataclass(frozen=True)
class Distance:
    """Differences of a setting's gait and walk from the rigid ones, with their numerical errors.

    numerical_period  s, change of the period at a ten times tighter tolerance
    angle, velocity   largest difference in phase over the walk, between impacts; `raw_`: at equal times
    numerical_time    s, change of the last touch-down's time at a hundred times tighter tolerance
    wall_s            s, processor time of the walk, minimum of several

    Quantities of the walk are None where no walk is compared.
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
class Limit:
    """Ground and rigid reference of a series: the rigid gait and the walk from the rigid start.

    steps     of that walk
    sampling  s
    every     take every n-th setting of a series
    """

    ground: JudgedGround
    period_s: float
    length_m: float
    motion: Motion
    steps: int
    sampling: float
    every: int = 1

    def series(
        self, name: str, walker: ContactWalker, gait: Cycle, start: Callable[[ContactWalker], State] | None = None
    ) -> list[Distance]:
        """Return the distances along a series, until a gait is lost; each gait is solved for from the one before.

        start  start of the walk for a walker, to compare whole walks as well
        """
        found: list[Distance] = []
        for setting in series_of(name, self.every):
            changed = with_setting(walker, setting)
            near = self.gait(changed, gait, GAIT_TOLERANCE)
            if near is None:
                break
            gait, step, check = near, step_of(near), self.gait(changed, near, CHECK_TOLERANCE)
            off = step.period_s - self.period_s
            distance = Distance(
                setting,
                step.period_s,
                step.length_m,
                step.slip_m,
                off,
                step.length_m - self.length_m,
                abs(off if check is None else check.period_s - step.period_s),
            )
            found.append(distance if start is None else self.walked(distance, changed, start(changed)))
        return found

    def gait(self, walker: ContactWalker, near: Cycle, tolerance: float) -> Cycle | None:
        """Solve for the gait on this ground near that of another setting; None if it fails."""
        pads = OwnPads(lambda _: walker, self.ground, settings(tolerance), near.step.length_m)
        found = gait_near(pads, near.z, 0.0, SEARCH)
        return found if isinstance(found, Cycle) else None

    def walked(self, distance: Distance, walker: ContactWalker, start: State) -> Distance:
        """Add the comparison of the whole walk from the rigid start."""

        def walk(tolerance: float, sampling: float | None) -> ContactWalkResult:
            how = settings(tolerance)
            return walk_contact(walker, self.ground, False, STANCE_FOOT, start, how, self.steps, sampling)

        sampled, check = walk(WALK_TOLERANCE, self.sampling), walk(WALK_CHECK, None)
        times = []
        for _ in range(REPEATS):
            begun = time.process_time()
            walk(WALK_TOLERANCE, None)
            times.append(time.process_time() - begun)
        steps = sampled.touch_time_s.size
        if sampled.samples is None or steps == 0 or steps != check.touch_time_s.size:
            return distance
        legs = motion_of_legs(sampled.samples.states, walker)
        motion = sampled_at_strikes(Motion(sampled.samples.time_s, *legs, sampled.touch_time_s, sampled.knee_strikes_s))
        phases = np.linspace(0.0, 1.0, PHASES)
        aligned = difference_in_phase(motion, self.motion, phases)
        smooth = between_impacts(motion, self.motion, phases)
        _, raw = difference_in_time(motion, self.motion)
        return replace(
            distance,
            angle=float(np.abs(aligned.angle[smooth]).max()),
            velocity=float(np.abs(aligned.velocity[smooth]).max()),
            raw_angle=max(raw.largest("angle")),
            raw_velocity=max(raw.largest("velocity")),
            numerical_time=float(abs(sampled.touch_time_s[-1] - check.touch_time_s[-1])),
            evaluations=int(sampled.work[0]),
            wall_s=min(times),
        )


def motion_of_legs(states: Floats, walker: ContactWalker) -> tuple[Floats, Floats]:
    """Return angles and angular velocities (samples, leg) of the legs; for kneed legs, of the thighs."""
    upper, half = walker.legs[:, 0], states.shape[1] // 2
    return states[:, 2 + upper], states[:, half + 2 + upper]


def settings(tolerance: float) -> Tolerances:
    """Return solver settings for a relative tolerance."""
    return Tolerances(METHOD, tolerance, ABSOLUTE * tolerance, BUDGET)


def observed_orders(distances: list[Distance]) -> list[float]:
    """Return the order of convergence of the period from each three successive settings."""
    if len(distances) < 3:
        return []
    ratio = distances[1].setting.rigidity / distances[0].setting.rigidity
    changes = np.abs(np.diff([one.period for one in distances]))
    changes = np.maximum(changes, np.finfo(float).tiny)
    orders: list[float] = (np.log(changes[:-1] / changes[1:]) / math.log(ratio)).tolist()
    return orders


@dataclass(frozen=True)
class Extrapolation:
    """Extrapolated limit of the period, and the difference between the last two estimates (s)."""

    period: float
    uncertainty: float


def extrapolated(distances: list[Distance]) -> Extrapolation | None:
    """Extrapolate the period by Aitken's method from the last resolved settings; None if they do not converge.

    Settings from the first change of the period below its numerical error on are ignored.
    """
    periods = np.array([one.period for one in distances])
    errors = np.array([one.numerical_period for one in distances])
    silent = np.flatnonzero(np.abs(np.diff(periods)) <= errors[1:])
    periods = periods[: silent[0] + 1] if silent.size else periods
    if periods.size < 4:
        return None
    changes = np.diff(periods[-4:])
    if changes[0] == 0.0 or (np.abs(changes[1:]) >= np.abs(changes[:-1])).any():
        return None
    before, last = periods[-2:] + changes[1:] ** 2 / (changes[:-1] - changes[1:])
    return Extrapolation(float(last), float(abs(last - before)))
