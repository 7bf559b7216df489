"""Divide a recorded walk into steps: heel strikes, lengths, and each leg's angle and velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import RecordedWalk
from walkerlab.exchange.rate_jumps import AHEAD, Array
from walkerlab.exchange.touches import Touch, find_touches
from walkerlab.physics.mechanics.rigid_model import (
    STANCE,
    STRAIGHT,
    SWING,
    RigidModel,
    apply_couplings,
    feet_on_slope,
    step_lengths,
)

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

# rad, limit of the sum of the leg angles from the normal in a recording that starts on two feet
TWO_FEET_TOLERANCE: Final = 0.03
SHORTEST: Final = 0.25  # fraction of the mean step period; an earlier first heel strike counts as the start
SPLINE_DEGREE: Final = 5
INTERVALS: Final = 24  # largest number of knot intervals of the spline through a step
MOST_SAMPLES: Final = 250  # largest number of samples kept within a step
LONGEST_GAP: Final = 1 / 8  # longest gap between two samples, as a fraction of the step's duration
PLAUSIBLE: Final = (1e-6, 1e6)
"""Shortest and longest plausible step, in s or m; values outside are damaged or in another unit."""
SIDE: Final = 1e-10  # time from the last sample of a step to the heel strike, as a fraction of the walk's duration


@dataclass(frozen=True, eq=False)
class RecordedSteps:
    """Recorded walk from its first heel strike on; column 0 is the leg that swings first."""

    time_s: Array  # (samples,) s, from that heel strike; every later heel strike has a sample on each side
    step: NDArray[np.int64]  # (samples,) index of the step
    angle_rad: Array  # (samples, 2)
    velocity_rad_s: Array  # (samples, 2)
    touch_time_s: Array  # (steps,) ends of the steps
    length_m: Array  # (steps,)
    scatter_rad: float  # scatter of the angles around heel strikes
    swapped: bool  # whether the recording's second leg swings first
    origin_s: float  # the recording's time at the first heel strike


def divide_into_steps(walk: RecordedWalk, model: RigidModel, source: str, touch_sum_rad: float = 0.0) -> RecordedSteps:
    """Find the steps of a recorded walk.

    source         name of the recording, for messages
    touch_sum_rad  sum of the leg angles from the slope's normal at heel strike; not 0 if slope or sensors have an error

    Raises ConfigError for implausible values, a gap within a step, or a recording without a complete step.
    """
    angle = walk.both_legs("angle")
    assert angle is not None, "a walk has the angles of both legs"

    largest = float(np.abs(angle).max())
    if largest > math.pi:
        raise ConfigError(
            f"{source}: an angle from the vertical reaches {largest:.3g} rad, more than half a turn.",
            "State the unit of angles, e.g. --units angle=deg, or remove outliers.",
        )

    def total(angles: Array) -> Array:
        return np.asarray(feet_on_slope(model, angles[:, 0], angles[:, 1]))

    def height(angles: Array) -> Array:
        """Height (m) of leg 0's foot over leg 1's, normal to the slope, for straight legs of equal length."""
        half = 0.5 * (total(angles) - touch_sum_rad)
        return np.asarray(2.0 * model.leg_length * np.sin(half) * np.sin(0.5 * (angles[:, 0] - angles[:, 1])))

    touches = find_touches(walk.time_s, angle, height)
    if touches and not starts_on_two_feet(angle, float(total(angle[:1])[0]) - touch_sum_rad):
        origin, ends = touches[0].time_s, touches[1:]
    else:
        origin = float(walk.time_s[0])
        mean_step = (touches[-1].time_s - origin) / len(touches) if touches else 0.0
        ends = [touch for touch in touches if touch.time_s > origin + SHORTEST * mean_step]
    if not ends:
        raise ConfigError(
            f"{source} holds no complete step; heel strikes found: {len(touches)}; the largest angle is "
            f"{largest:.3g} rad.",
            "Angles must be from the vertical, positive with the foot ahead (--columns), in the right unit (--units), "
            "without outliers, and over at least one whole step.",
        )
    refuse_duration((ends[-1].time_s - origin) / len(ends), source)
    refuse_gaps(walk.time_s, [origin, *(touch.time_s for touch in ends)], source)
    return divided(walk, angle, model, origin, ends, swapped=ends[0].leg == 1)


def is_plausible(size: float) -> bool:
    """Return whether a step can have this duration (s) or length (m)."""
    return PLAUSIBLE[0] <= size <= PLAUSIBLE[1]


def refuse_duration(step_s: float, source: str) -> None:
    if not is_plausible(step_s):
        raise ConfigError(
            f"{source}: steps of {step_s:.3g} s are implausible.",
            "State the unit of time, e.g. --units time=ms.",
        )


def refuse_gaps(time: Array, touches: list[float], source: str) -> None:
    """Raise ConfigError for a step whose samples are too far apart to determine its heel strikes and velocities."""
    for number, (begin, end) in enumerate(pairwise(touches), 1):
        first, last = longest_gap(time, begin, end)
        if last - first > LONGEST_GAP * (end - begin):
            raise ConfigError(
                f"{source}: step {number} has no sample from time {first:.6g} to {last:.6g} s, "
                f"{(last - first) / (end - begin):.0%} of its duration.",
                f"Record at least {1 / LONGEST_GAP:.0f} samples per step, or cut the recording to a part without gaps.",
            )


def longest_gap(time: Array, begin: float, end: float) -> tuple[float, float]:
    """Return the two neighbouring sample times (s) farthest apart, from just before `begin` to just after `end`."""
    first, last = np.searchsorted(time, begin, "right") - 1, np.searchsorted(time, end)
    instants = time[first : last + 1]
    place = int(np.argmax(np.diff(instants)))
    return float(instants[place]), float(instants[place + 1])


def starts_on_two_feet(angle: Array, total: float) -> bool:
    spread = np.abs(angle[:, 0] - angle[:, 1])
    return bool(abs(total) < TWO_FEET_TOLERANCE and spread[0] > AHEAD * spread.max())


def divided(
    walk: RecordedWalk, angle: Array, model: RigidModel, origin: float, ends: list[Touch], swapped: bool
) -> RecordedSteps:
    times = np.array([touch.time_s for touch in ends]) - origin
    order = [1, 0] if swapped else [0, 1]
    velocity = walk.both_legs("velocity")
    columns = angle[:, order] if velocity is None else np.column_stack((angle[:, order], velocity[:, order]))
    time, side = walk.time_s - origin, SIDE * float(times[-1])
    last = float(time[-1])
    spans = list(zip((0.0, *times), (*(times - side), last), strict=True))
    if not is_recorded_beyond(time, times):
        spans.pop()
    pieces = [samples_within(time, columns, *span) for span in spans]
    step = np.repeat(np.arange(len(pieces)), [piece[0].size for piece in pieces])
    times_s, angles, velocities = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    lengths = lengths_of(model, angles, step, len(times))
    scatter = float(np.median([touch.scatter_rad for touch in ends]))
    return RecordedSteps(times_s, step, angles, velocities, times, lengths, scatter, swapped, origin)


def is_recorded_beyond(time: Array, touches: Array) -> bool:
    """Return whether enough of the step after the last heel strike is recorded."""
    if np.count_nonzero(time >= touches[-1]) <= SPLINE_DEGREE:
        return False
    first, last = longest_gap(time, float(touches[-1]), float(time[-1]))
    return last - first <= LONGEST_GAP * float(np.diff(touches, prepend=0.0)[-1])


def samples_within(time: Array, columns: Array, begin: float, end: float) -> tuple[Array, Array, Array]:
    """Return times (s), angles (rad) and velocities (rad/s) of a step, with samples at its ends.

    columns  (samples, 4) angles and velocities, or (samples, 2) angles, from which a spline gives the velocities
    """
    near = (time >= begin) & (time <= end)
    spline = spline_through(time[near], columns[near])
    inside = np.flatnonzero((time > begin) & (time < end))
    inside = inside[:: max(1, math.ceil(inside.size / MOST_SAMPLES))]
    grid = np.concatenate(([begin], time[inside], [end]))
    values = spline(grid)
    values[1:-1] = columns[inside]
    velocities = spline.derivative()(grid)[:, :2] if columns.shape[1] == 2 else values[:, 2:]
    return grid, values[:, :2], velocities


def spline_through(time: Array, columns: Array) -> BSpline:
    """Fit a spline with evenly spaced knots, with fewer knots if there are few samples."""
    # Imported here, because checking whether a result is up to date needs no fit.
    from scipy.interpolate import make_lsq_spline

    degree = min(SPLINE_DEGREE, time.size - 1)
    intervals = max(1, min(INTERVALS, time.size // (2 * SPLINE_DEGREE)))
    inner = np.linspace(time[0], time[-1], intervals + 1)[1:-1]
    knots = np.concatenate(([time[0]] * (degree + 1), inner, [time[-1]] * (degree + 1)))
    return make_lsq_spline(time, columns, knots, degree)


def lengths_of(model: RigidModel, angle: Array, step: NDArray[np.int64], count: int) -> Array:
    """Return the step lengths (m) from the leg angles at the beginning and end of each step."""
    n = len(model.arm_x)
    states = np.zeros((2, count, 2 * n))
    for number in range(count):
        rows = np.flatnonzero(step == number)
        swing, stance = (0, 1) if number % 2 == 0 else (1, 0)
        for place, row in enumerate((rows[0], rows[-1])):
            bodies = np.zeros(n)
            bodies[SWING], bodies[STANCE] = angle[row, swing], angle[row, stance]
            states[place, number, :n] = apply_couplings(model, STRAIGHT, bodies)
    return step_lengths(model, *states)
