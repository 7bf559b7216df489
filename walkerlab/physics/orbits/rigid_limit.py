"""Convergence of the contact model to the rigid one as parameters of its contact approach the rigid limit.

The parameters are stiffness k, damping c and stiction velocity v_s. The full-damping penetration d_max shrinks with the
static penetration as k grows, and the friction velocity v_d with v_s. If all three vary, push-offs are shortened, too.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import ContactWalker, changed_forms
from walkerlab.physics.hybrid import comparison
from walkerlab.physics.hybrid.comparison import Motion
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, walk_contact
from walkerlab.physics.hybrid.contact_state import JudgedGround
from walkerlab.physics.orbits.contact_gait import CONTACT_EFFORT, scale_laws
from walkerlab.physics.orbits.contact_map import AdaptivePads, contact_step
from walkerlab.physics.orbits.step_map import Cycle, gait_near
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, State

METHOD = "radau5"
LIMIT_BUDGET = 50_000_000
GAIT_TOLERANCE = 1e-10
CHECK_TOLERANCE = 1e-11
# tolerances of timed walks, and of the walks that measure their numerical error
WALK_TOLERANCE = 1e-8
WALK_CHECK = 1e-10
ABSOLUTE_FACTOR = 0.01  # ratio of absolute to relative tolerance
TIMED_WALKS = 3
SERIES_EFFORT = CONTACT_EFFORT._replace(max_evaluations=30)
# Duration of a push-off divided by sqrt(d / g), where d is the static penetration. Such a short push-off ends while
# the other foot is still landing.
PUSH_OFF_FACTOR = 0.1


class ContactFactors(NamedTuple):
    series: str
    rigidity: float  # 1 for the config's contact, rising towards the limit
    stiffness_factor: float
    damping_factor: float
    stiction_velocity_factor: float


ALL_SERIES = "all"
ALL_POINT_SERIES = "all, point foot"
STICTION_SERIES = "stiction velocity"
STIFFNESS_SERIES = "stiffness"
DAMPING_SERIES = "damping"
NORMAL_SERIES = "stiffness and damping"
HALF_DECADES = math.sqrt(10.0)
# Number of settings, ratio of successive rigidities, and the powers of rigidity by which stiffness, damping and
# stiction velocity are multiplied.
SERIES_SETTINGS = {
    ALL_SERIES: (9, HALF_DECADES, (1.0, 0.5, -1.0)),
    ALL_POINT_SERIES: (9, HALF_DECADES, (1.0, 0.5, -1.0)),
    STICTION_SERIES: (15, 2.0, (0.0, 0.0, -1.0)),
    STIFFNESS_SERIES: (6, HALF_DECADES, (1.0, 0.0, 0.0)),
    DAMPING_SERIES: (6, HALF_DECADES, (0.0, 1.0, 0.0)),
    NORMAL_SERIES: (9, HALF_DECADES, (1.0, 0.5, 0.0)),
}


def series_settings(name: str, every: int = 1) -> list[ContactFactors]:
    """Return every n-th contact setting of a series (n is `every`), from that of the config to the most rigid one."""
    count, ratio, powers = SERIES_SETTINGS[name]
    rigidities = [ratio**step for step in range(0, count, every)]
    return [ContactFactors(name, rigidity, *(rigidity**power for power in powers)) for rigidity in rigidities]


def apply_setting(walker: ContactWalker, setting: ContactFactors) -> ContactWalker:
    """Return the walker on the ground of a setting, with a shorter push-off if the series varies all parameters."""
    # A push-off that is not shortened lifts the leading foot again, however rigid the ground, and the series then tends
    # to another limit.
    changed = scale_laws(walker, *setting[2:])
    if setting.series not in (ALL_SERIES, ALL_POINT_SERIES) or setting.rigidity == 1.0:
        return changed
    static = walker.normal.resting_foot(walker.mass * walker.gravity, walker.mass).depth
    # The duration is inversely proportional to the square root of the stiffness, but never longer than the config's.
    brief = PUSH_OFF_FACTOR * math.sqrt(static / (walker.gravity * setting.stiffness_factor))
    return changed_forms(changed, push_off_duration=min(brief, float(walker.whole.push_off_duration)))


@dataclass(frozen=True)
class Distance:
    """How far gait and walk at one contact setting are from the rigid ones, with numerical errors."""

    # `angle_error_rad` and the fields after it describe the walk. They are None if no walk is compared.

    setting: ContactFactors
    period_s: float
    step_length_m: float
    slip_m: float
    period_error_s: float  # difference from the rigid gait
    length_error_m: float  # difference from the rigid gait
    numerical_period_s: float  # change of the period when the tolerance is ten times tighter
    angle_error_rad: float | None = None  # maximum difference outside the impacts, at equal phase
    velocity_error_rad_s: float | None = None  # maximum difference outside the impacts, at equal phase
    raw_angle_error_rad: float | None = None  # maximum difference at equal time
    raw_velocity_error_rad_s: float | None = None  # maximum difference at equal time
    # change of the last touchdown's time when the tolerance is a hundred times tighter
    numerical_time_s: float | None = None
    rhs_evaluations: int | None = None
    wall_s: float | None = None  # processor time of the walk, minimum of several


@dataclass(frozen=True)
class Limit:
    """Ground of a series of contact settings, and the rigid gait and walk that they are compared with."""

    ground: JudgedGround
    period_s: float
    length_m: float
    motion: Motion
    steps: int  # steps of the walk
    sampling: float  # s between samples
    every: int = 1  # use every n-th setting of a series

    def series(
        self, name: str, walker: ContactWalker, gait: Cycle, start: Callable[[ContactWalker], State] | None = None
    ) -> list[Distance]:
        """Return the distances along a series until a gait is lost. With a `start`, compare walks as well."""
        # Each gait is Newton's first guess for the next one.
        distances: list[Distance] = []
        for setting in series_settings(name, self.every):
            changed = apply_setting(walker, setting)
            near = self.gait(changed, gait, GAIT_TOLERANCE)
            if near is None:
                break
            gait = near
            step = contact_step(near)
            check = self.gait(changed, near, CHECK_TOLERANCE)
            off = step.period_s - self.period_s
            # Without a check, the whole difference from the rigid gait counts as numerical error.
            distance = Distance(
                setting,
                step.period_s,
                step.length_m,
                step.slip_m,
                off,
                step.length_m - self.length_m,
                abs(off if check is None else check.period_s - step.period_s),
            )
            distances.append(distance if start is None else self.compare_walk(distance, changed, start(changed)))
        return distances

    def gait(self, walker: ContactWalker, near: Cycle, tolerance: float) -> Cycle | None:
        """Solve for the gait of this walker near the gait of another setting, or return None if it fails."""
        pads = AdaptivePads(lambda _: walker, self.ground, solver_settings(tolerance), near.step.length_m)
        solution = gait_near(pads, near.z, 0.0, SERIES_EFFORT)
        return solution if isinstance(solution, Cycle) else None

    def compare_walk(self, distance: Distance, walker: ContactWalker, start: State) -> Distance:
        def walk(tolerance: float, sampling: float | None) -> ContactWalkResult:
            solver = solver_settings(tolerance)
            return walk_contact(walker, self.ground, False, STANCE_FOOT, start, solver, self.steps, sampling)

        sampled = walk(WALK_TOLERANCE, self.sampling)
        check = walk(WALK_CHECK, None)
        times = []
        for _ in range(TIMED_WALKS):
            started = time.process_time()
            walk(WALK_TOLERANCE, None)
            times.append(time.process_time() - started)
        steps = sampled.touch_time_s.size
        if sampled.samples is None or steps == 0 or steps != check.touch_time_s.size:
            return distance
        legs = leg_motion(sampled.samples.states, walker)
        recorded = Motion(sampled.samples.time_s, *legs, sampled.touch_time_s, sampled.knee_strikes_s)
        motion = comparison.add_strike_samples(recorded)
        phases = np.linspace(0.0, 1.0, comparison.PHASES)
        aligned = comparison.difference_in_phase(motion, self.motion, phases)
        smooth = comparison.smooth_phases(motion, self.motion, phases)
        _, raw = comparison.difference_in_time(motion, self.motion)
        return replace(
            distance,
            angle_error_rad=float(np.abs(aligned.angle[smooth]).max()),
            velocity_error_rad_s=float(np.abs(aligned.velocity[smooth]).max()),
            raw_angle_error_rad=max(raw.largest("angle")),
            raw_velocity_error_rad_s=max(raw.largest("velocity")),
            numerical_time_s=float(abs(sampled.touch_time_s[-1] - check.touch_time_s[-1])),
            rhs_evaluations=int(sampled.work[0]),
            wall_s=min(times),
        )


def leg_motion(states: Floats, walker: ContactWalker) -> tuple[Floats, Floats]:
    """Return angles (rad) and angular velocities (rad/s) of the legs, (samples, 2) each.

    For a kneed leg they are those of its thigh.
    """
    upper = walker.legs[:, 0]
    half = states.shape[1] // 2
    return states[:, 2 + upper], states[:, half + 2 + upper]


def solver_settings(tolerance: float) -> Tolerances:
    return Tolerances(METHOD, tolerance, ABSOLUTE_FACTOR * tolerance, LIMIT_BUDGET)


def observed_orders(distances: list[Distance]) -> list[float]:
    """Return the observed orders of convergence of the period, each from three successive settings."""
    if len(distances) < 3:
        return []
    ratio = distances[1].setting.rigidity / distances[0].setting.rigidity
    changes = np.abs(np.diff([distance.period_s for distance in distances]))
    changes = np.maximum(changes, np.finfo(float).tiny)
    orders: list[float] = (np.log(changes[:-1] / changes[1:]) / math.log(ratio)).tolist()
    return orders


@dataclass(frozen=True)
class Extrapolation:
    """Extrapolated limit of the period (s), and the difference between the last two estimates (s)."""

    period: float
    uncertainty: float


def extrapolate(distances: list[Distance]) -> Extrapolation | None:
    """Extrapolate the period by Aitken's method from the last resolved settings.

    Returns None if the periods do not converge.
    """
    # Once the period changes by less than its numerical error, all further changes are only noise.
    periods = np.array([distance.period_s for distance in distances])
    errors = np.array([distance.numerical_period_s for distance in distances])
    unresolved = np.flatnonzero(np.abs(np.diff(periods)) <= errors[1:])
    periods = periods[: unresolved[0] + 1] if unresolved.size else periods
    if periods.size < 4:
        return None
    changes = np.diff(periods[-4:])
    if changes[0] == 0.0 or (np.abs(changes[1:]) >= np.abs(changes[:-1])).any():
        return None
    before, last = periods[-2:] + changes[1:] ** 2 / (changes[:-1] - changes[1:])
    return Extrapolation(float(last), float(abs(last - before)))
