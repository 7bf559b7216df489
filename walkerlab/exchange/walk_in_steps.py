"""Divide a recorded walk into steps, with heel strikes, step lengths, and angle and velocity of each leg."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebfit, chebval
from numpy.typing import NDArray

from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import HIP_OF_LINES, RecordedWalk
from walkerlab.exchange.leg_angles import FAR_PERCENT, HIGHEST_DEGREE, SAMPLES_PER_DEGREE, read_leg_angles
from walkerlab.exchange.marker_lines import MAX_NAMED
from walkerlab.exchange.touches import (
    SIGNIFICANT_ERRORS,
    Array,
    Height,
    Touch,
    angles_at_jumps,
    find_touches,
    noise_of,
    sums_at_jumps,
    typical_interval,
)
from walkerlab.physics.hybrid.rigid_measures import energies
from walkerlab.physics.mechanics.rigid_model import (
    STANCE,
    STRAIGHT,
    SWING,
    RigidModel,
    apply_couplings,
    compute_in_turns,
    step_lengths,
)

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

# An angle is taken for a shank's if its farthest backward swing is at least this many times the one at heel strikes.
SHANK_SWING_RATIO: Final = 1.4
MAX_SPREAD_RAD: Final = math.radians(100.0)  # largest credible angle between the legs at a heel strike
SPLINE_DEGREE: Final = 5
INTERVALS: Final = 24  # largest number of knot intervals of the spline through a step
MAX_STEP_SAMPLES: Final = 250  # largest number of samples kept within a step
MAX_GAP: Final = 1 / 8  # longest gap between two samples, as a fraction of the step's duration
PLAUSIBLE: Final = (1e-6, 1e6)
"""Range of plausible durations (s) or lengths (m) of a step. Values outside it are damaged or in another unit."""
MIN_SPREAD_RAD: Final = 0.02  # if the angle between the legs at heel strikes is smaller, its unit is doubtful
MIN_STEP: Final = 0.25  # shortest credible step, as a fraction of half a period of the hanging leg
MAX_SCATTER: Final = 0.2  # maximum scatter of the angles relative to the angle between the legs when they are far apart
MIN_ALTERNATING_STRIKES: Final = 2  # minimum number of heel strikes of each leg to judge whether lengths alternate
MIN_ALTERNATION: Final = 0.004  # smallest difference of alternating lengths, as a fraction of their sum
SIDE_ERRORS: Final = 6.0  # like JUMP_ERRORS, but for the strikes of one leg only, which are half of all strikes
SEARCH_OFFSET_RAD: Final = 0.03  # the search for the tilt begins this far from the likely sum of angles
MAX_BELT_DIFFERENCE: Final = 0.03
"""Report a doubt if the distance walked on a belt and the one from the leg angles differ by more than this fraction."""
# report a doubt about the clock if the legs would swing faster or slower than recorded by more than this ratio
MAX_CLOCK_RATIO: Final = 1.15
NOISE_IN_CLOCK: Final = 7.0  # MAX_CLOCK_RATIO grows by this multiple of the relative scatter of the angles
TURN_RAD: Final = 1e-3  # rotation of the walker for the difference quotient of its potential energy
LEGS_ALONE: Final = 2  # number of bodies of a walker without torso and knees
PHASES: Final = 21
# recorded values can show an error only if their spacing is at most this fraction of it
MAX_SPACING: Final = 0.2
MAX_ERROR_SCATTER: Final = 0.25  # an error is constant if its scatter over a step is below this fraction of its mean
MIN_DISTANCE_M: Final = 1e-30  # m, replaces smaller distances before we divide by them
# time from the last sample of a step to the heel strike, as a fraction of the duration of the walk
STRIKE_MARGIN: Final = 1e-10


@dataclass(frozen=True, eq=False)
class RecordedSteps:
    """Recorded walk from its first heel strike on. In arrays (samples, 2), column 0 belongs to the leg that swings
    first.
    """

    time_s: Array  # (samples,) s, from the first heel strike; every later heel strike has a sample on each side
    step: NDArray[np.int64]  # (samples,) index of the step
    angle_rad: Array  # (samples, 2)
    velocity_rad_s: Array  # (samples, 2)
    touch_time_s: Array  # (steps,) s, ends of the steps
    touch_error_s: Array  # (steps + 1,) standard errors of the heel strikes (s), including the first one
    length_m: Array  # (steps,)
    scatter_rad: float  # scatter of the angles around heel strikes
    swapped: bool  # whether the recording's second leg swings first
    origin_s: float  # time of the first heel strike in the recording
    doubts: tuple[str, ...]  # oddities of the heel strikes


def divide_into_steps(walk: RecordedWalk, model: RigidModel, source: str, touch_sum_rad: float = 0.0) -> RecordedSteps:
    """Find the steps of a recorded walk.

    source         name of the recording, for messages
    touch_sum_rad  sum of the leg angles from the slope's normal at heel strike (rad), which is not 0 if slope or
    sensors have an error

    Raises ConfigError for implausible values, a gap within a step, or a recording without a complete step.
    """
    angle = read_leg_angles(walk)
    refuse_noise(angle, source)

    def height(angles: Array) -> Array:
        """Height (m) of leg 0's foot above leg 1's, normal to the slope, for straight legs."""
        return np.asarray(hips_apart(model, angles - 0.5 * touch_sum_rad).real + rise_of_soles(model))

    touches = find_touches(walk.time_s, angle, height)
    refuse_gaps(walk, [touch.time_s for touch in touches], source)
    touches, doubts = longest_walk(touches)
    if model.legs_differ and len(touches) > 1 and touches[1].leg == 1:
        touches = touches[1:]  # Leg 1 must swing first, as in computed walks.
    if len(touches) < 2:
        raise ConfigError(
            f"{source} holds no complete step: {len(touches)} heel strikes were found, and the largest angle is "
            f"{float(np.abs(angle).max()):.3g} rad.",
            "Angles must be measured from the vertical, positive with the foot ahead (--columns) and in the right unit "
            "(--units). They must cover at least one whole step. The slope must be that of the ground (slope_deg).",
        )
    step_s = (touches[-1].time_s - touches[0].time_s) / (len(touches) - 1)
    refuse_duration(step_s, source)
    refuse_short_steps(step_s, model, source)
    refuse_spread(walk, touches, source)
    offsets = offset_doubts(walk.time_s, angle, touches, model, touch_sum_rad, height)
    doubts += [*unit_doubts(touches), *knee_doubts(walk, touches, model), *offsets]
    steps = build_steps(walk, model, touches, tuple(doubts))
    refuse_lengths(steps, source)
    # Energy jumps at heel strikes, so if their times are uncertain, nothing can be said about the clock.
    return scale_to_belt(walk, steps if offsets else add_clock_doubt(steps, model))


def hips_apart(model: RigidModel, angles: Array) -> NDArray[np.complex128]:
    """Put the foot centres of both legs at one point, and return the vectors (samples,) from the hip above leg 0 to the
    hip above leg 1 (m). The real part is normal to the slope, and the imaginary part along it.

    angles  (samples, 2) of straight legs, from the vertical
    """
    levers = [
        (each.hip_y - 1j * each.hip_x) * np.exp(1j * (angles[:, leg] + model.slope))
        for leg, each in enumerate((model.exchanged, model))
    ]
    return np.asarray(levers[1] - levers[0])


def rise_of_soles(model: RigidModel) -> float:
    """Return the foot radius of leg 1 minus that of leg 0 (m). In the model with exchanged legs, leg 0 is the stance
    leg.
    """
    return float(model.radius - model.exchanged.radius)


def sum_over_level(model: RigidModel, angles: Array) -> Array:
    """Return how far the sums (samples,) of straight legs' angles exceed the sum with both feet on the slope (rad).

    For legs that are alike, these are the sums of the angles from the slope's normal.
    """
    apart = hips_apart(model, angles)
    direction = np.angle(apart)
    level = np.arccos(np.clip(-rise_of_soles(model) / np.maximum(np.abs(apart), MIN_DISTANCE_M), -1.0, 1.0))
    return np.asarray(2.0 * (direction - np.sign(direction) * level))


def correct_tilt(walk: RecordedWalk, model: RigidModel) -> RecordedWalk:
    """Subtract the tilt of the camera, which is the angle by which the recording's vertical leans forward.

    The tilt follows from the angles at heel strikes, where the leg rates jump and both feet are on the floor.
    """
    angle = read_leg_angles(walk)
    total = partial(sum_over_level, model)
    sum_rad = next(iter(sums_at_jumps(walk.time_s, angle, total)), 0.0)

    def height(angles: Array) -> Array:
        # Begin the search away from the likely sum. Otherwise the shift found from the jumps of the rates could be
        # smaller than its error. It would then be treated as zero, and the rough sum would remain.
        return np.asarray((total(angles) - sum_rad - SEARCH_OFFSET_RAD) * (angles[:, 0] - angles[:, 1]))

    touches = find_touches(walk.time_s, angle, height)
    period = typical_interval([touch.time_s for touch in touches], walk.time_s)
    jumps = angles_at_jumps(walk.time_s, angle, touches, period)
    tilt = 0.5 * (float(np.mean(total(jumps[1]))) if jumps else sum_rad)
    upright = {name: walk.quantities[name] - tilt for name in ("angle 1", "angle 2")}
    doubt = f"The camera's tilt is {math.degrees(tilt):.2f} degrees, found where the rates of the legs jump."
    return replace(walk, quantities={**walk.quantities, **upright}, doubts=(*walk.doubts, doubt))


def scale_to_belt(walk: RecordedWalk, steps: RecordedSteps) -> RecordedSteps:
    """Scale the step lengths so that they add up to the distance over a treadmill's belt, if there is one."""
    if not walk.belt_m_s:
        return steps
    way = walk.belt_m_s * float(steps.touch_time_s[-1])
    if walk.hip_is_in_m:
        ends = steps.origin_s + np.array([0.0, steps.touch_time_s[-1]])
        # The walker may drift along the treadmill, which adds to the distance.
        way += float(np.diff(np.interp(ends, walk.time_s, walk.quantities[HIP_OF_LINES]))[0])
    share = way / float(steps.length_m.sum())
    doubts = steps.doubts
    if abs(share - 1.0) > MAX_BELT_DIFFERENCE:
        doubts += (
            f"The distance over the belt is {share:.3g} times the one that follows from the leg angles: the speed of "
            "the belt, the length of the leg or the unit of time may be wrong.",
        )
    return replace(steps, length_m=share * steps.length_m, doubts=doubts)


def add_clock_doubt(steps: RecordedSteps, model: RigidModel) -> RecordedSteps:
    """Add a doubt if the legs swing as if the clock were wrong, as in a film that is played at another speed.

    Energy is constant within a step of straight legs that nothing drives. If the clock runs fast by a factor r, the
    measured kinetic energy is too small by r^2. So the ratio of the changes of kinetic and potential energy gives r.
    The tilt of the recording, which turns gravity, is fitted as well.
    """
    if model.kneed or not model.passive or len(model.arm_x) > LEGS_ALONE:
        return steps
    first = model.exchanged if steps.swapped else model
    order = np.where(steps.step[:, None] % 2 == 0, [0, 1], [1, 0])
    angles, rates = (np.take_along_axis(each, order, axis=1) for each in smooth_motion(steps))
    energy, ahead, behind = (
        compute_in_turns(first, steps.step, energies, np.concatenate((angles + turn, rates), axis=1))
        for turn in (0.0, TURN_RAD, -TURN_RAD)
    )
    turning = (ahead[:, 1] - behind[:, 1]) / (2.0 * TURN_RAD)
    columns = np.column_stack((energy, turning))
    # Heel strikes lose energy, so only changes within a step count.
    sizes = np.bincount(steps.step)
    means = np.add.reduceat(columns, np.cumsum(sizes) - sizes) / sizes[:, None]
    columns -= means[steps.step]
    # The two coefficients are the components of gravity in tilted axes, so together they give the magnitude of gravity.
    gravity = math.hypot(*np.linalg.lstsq(columns[:, 1:], columns[:, 0])[0].tolist())
    rate = gravity**-0.5 if gravity else 1.0
    far = MAX_CLOCK_RATIO + NOISE_IN_CLOCK * steps.scatter_rad / float(np.std(angles))
    if 1.0 / far < rate < far:
        return steps
    doubt = (
        f"The legs of this walker would swing {rate:.2g} times as fast as those in the recording. The frame rate "
        "(--fps), the unit of time or the walker may be wrong."
    )
    return replace(steps, doubts=(*steps.doubts, doubt))


def smooth_motion(steps: RecordedSteps) -> tuple[Array, Array]:
    """Fit a polynomial to each step, and return the angles (rad) and rates (rad/s) of both legs, (samples, 2) each.

    Rates of a spline contain more noise, which would make kinetic energies too large.
    """
    angles = np.empty_like(steps.angle_rad)
    rates = np.empty_like(steps.angle_rad)
    for rows in np.split(np.arange(steps.step.size), np.flatnonzero(np.diff(steps.step)) + 1):
        time = steps.time_s[rows]
        half = 0.5 * float(np.ptp(time))
        t = (time - time[0]) / half - 1.0
        course = chebfit(t, steps.angle_rad[rows], min(HIGHEST_DEGREE, 1 + rows.size // SAMPLES_PER_DEGREE))
        angles[rows] = chebval(t, course).T
        rates[rows] = chebval(t, chebder(course)).T / half
    return angles, rates


def longest_walk(touches: list[Touch]) -> tuple[list[Touch], list[str]]:
    """Return the longest sequence of heel strikes of alternate legs. Also return doubts if others are dropped."""
    walks: list[list[Touch]] = [[]]
    breaks = []
    for touch in touches:
        if walks[-1] and walks[-1][-1].leg == touch.leg:
            breaks.append(f"leg {touch.leg + 1} at time {walks[-1][-1].time_s:.6g} and {touch.time_s:.6g} s")
            walks.append([])
        walks[-1].append(touch)
    longest = max(walks, key=len)
    if not breaks or len(longest) < 2:
        return longest, []
    kept = f"only the steps from time {longest[0].time_s:.6g} to {longest[-1].time_s:.6g} s are kept"
    return longest, [f"The same leg strikes twice in a row ({', '.join(breaks[:MAX_NAMED])}), so that {kept}."]


def knee_doubts(walk: RecordedWalk, touches: list[Touch], model: RigidModel) -> Iterator[str]:
    """Yield a doubt for each leg of a kneed walker whose recorded angle may not be the thigh's."""
    for leg, name in enumerate(("angle 1", "angle 2")):
        if not (model, model.exchanged)[leg].kneed:
            continue
        # A percentile is safer than the minimum, which may be an outlier.
        farthest = float(np.percentile(walk.quantities[name], 1)) + model.slope
        thigh = "for a kneed walker it must be the angle of the thigh, from hip to knee"
        if name in walk.lines:
            yield f"{name.capitalize()} is that of the line {walk.sources[name]}; {thigh}."
        elif farthest < SHANK_SWING_RATIO * (min(float(touch.fit.angle[leg]) for touch in touches) + model.slope):
            yield f"{name.capitalize()} swings far behind the leg, as a shank does; {thigh}."


def refuse_spread(walk: RecordedWalk, touches: list[Touch], source: str) -> None:
    """Raise ConfigError if the legs are too far apart at a heel strike and nothing states the unit of their angles."""
    apart, time = max((abs(float(np.diff(touch.fit.angle)[0])), touch.time_s) for touch in touches)
    if apart > MAX_SPREAD_RAD and not walk.unit_is_stated:
        raise ConfigError(
            f"{source}: the legs are {math.degrees(apart):.0f} degrees apart at time {time:.6g} s.",
            "State the unit of angles: --units angle=deg, or --units angle=rad if the legs really are that far apart.",
        )


@dataclass(frozen=True)
class Mismatch:
    """Disagreement between the two signs of a heel strike: level feet, and a jump of the leg rates."""

    shift_s: float  # largest delay of a jump of the rates; 0 if it is within its standard error
    sum_rad: float  # mean sum of the angles where rates jump, minus the sum for level feet
    lengths_m: list[float]  # mean step length of each leg, if lengths alternate
    limps: bool  # whether periods alternate
    between_rad: float | None  # constant by which angle 1 exceeds angle 2, or None if the difference is not constant


def mismatch(time: Array, angle: Array, touches: list[Touch], model: RigidModel, touch_sum_rad: float) -> Mismatch:
    period = typical_interval([touch.time_s for touch in touches], time)
    sides = [[touch for touch in touches if touch.leg == leg] for leg in (0, 1)]
    all_jumps = angles_at_jumps(time, angle, touches, period)
    jumps = [all_jumps, *(angles_at_jumps(time, angle, side, period, SIDE_ERRORS) for side in sides)]
    shift = max((jump[0] for jump in jumps if jump), key=abs, default=0.0)
    sums = np.mean(sum_over_level(model, all_jumps[1])) - touch_sum_rad if all_jumps else 0.0
    spreads = [np.array([abs(touch.fit.angle[0] - touch.fit.angle[1]) for touch in side]) for side in sides]
    periods = np.diff([touch.time_s for touch in touches])
    lengths = [2.0 * model.leg_length * math.sin(0.5 * float(np.mean(each))) for each in spreads if each.size]
    return Mismatch(
        shift,
        float(sums),
        lengths if alternates(spreads[0], spreads[1]) else [],
        alternates(periods[::2], periods[1::2]),
        offset_between(time, angle, touches),
    )


def alternates(first: Array, second: Array) -> bool:
    """Whether the means of two samples differ clearly, like those of odd and even steps in a limp."""
    if min(first.size, second.size) < MIN_ALTERNATING_STRIKES:
        return False
    error = math.hypot(*(float(np.std(each)) / math.sqrt(each.size - 1) for each in (first, second)))
    means = float(np.mean(first)), float(np.mean(second))
    return abs(means[0] - means[1]) > max(SIGNIFICANT_ERRORS * error, MIN_ALTERNATION * sum(means))


def offset_between(time: Array, angle: Array, touches: list[Touch]) -> float | None:
    """Return the constant (rad) by which angle 1 exceeds angle 2 in all phases of their steps, or None if there is
    none.
    """
    phases = np.linspace(0.0, 1.0, PHASES)
    courses: list[list[Array]] = [[], []]
    for begin, end in pairwise(touches):
        at = begin.time_s + phases * (end.time_s - begin.time_s)
        courses[end.leg].append(np.array([np.interp(at, time, angle[:, leg]) for leg in (end.leg, 1 - end.leg)]))
    if not courses[0] or not courses[1]:
        return None
    swing, stance = (np.mean(courses[0], axis=0)[k] - np.mean(courses[1], axis=0)[k] for k in (0, 1))
    # The stance leg is the other leg, so the constant has the opposite sign for it.
    differences = np.array([swing, -stance])
    constant = float(np.mean(differences))
    return constant if float(np.std(differences)) < MAX_ERROR_SCATTER * abs(constant) else None


def offset_doubts(
    time: Array, angle: Array, touches: list[Touch], model: RigidModel, touch_sum_rad: float, height: Height
) -> list[str]:
    """Describe alternating steps and rates that jump while the feet are not level. Also name the likely error.

    A constant error of the angles is the cause if both disappear once it is subtracted.
    """
    before = mismatch(time, angle, touches, model, touch_sum_rad)
    alternate = bool(before.lengths_m) and before.between_rad is not None
    if not before.shift_s and not alternate:
        return []
    between = before.between_rad or 0.0 if alternate else 0.0
    errors = 0.5 * (before.sum_rad + np.array([between, -between]))
    right = find_touches(time, angle - errors, height)
    after = mismatch(time, angle - errors, right, model, touch_sum_rad) if len(right) > 1 else before
    degrees = np.degrees(errors)
    digit = float(np.diff(np.unique(np.round(angle, 9))).min())
    if after.shift_s or after.lengths_m or after.limps or digit > MAX_SPACING * float(np.abs(errors).max()):
        cause = "no constant error of the angles explains it, so a wrong gain, a tilt or coarse digits may be the cause"
    elif alternate:
        cause = " and ".join(f"angle {leg} is {error:.2f} degrees too large" for leg, error in enumerate(degrees, 1))
    else:
        cause = f"a tilt explains it, with both angles {degrees[0]:.2f} degrees too large"
    if not before.shift_s:
        spelled = " and ".join(f"{length:.3g} m of leg {leg}" for leg, length in enumerate(before.lengths_m, 1))
        return [f"Step lengths alternate, {spelled}; {cause}."]
    moment = f"{1e3 * abs(before.shift_s):.0f} ms {'after' if before.shift_s > 0.0 else 'before'} the feet are level"
    return [f"Heel strikes are uncertain: the rates of the legs jump {moment}; {cause}."]


def is_plausible(size: float) -> bool:
    """Whether a step can have this duration (s) or length (m)."""
    return PLAUSIBLE[0] <= size <= PLAUSIBLE[1]


def refuse_noise(angle: Array, source: str) -> None:
    """Raise ConfigError if scatter hides the heel strikes."""
    noise = noise_of(angle)
    apart = float(np.percentile(np.abs(angle[:, 0] - angle[:, 1]), FAR_PERCENT))
    if noise > MAX_SCATTER * apart:
        raise ConfigError(
            f"{source}: the angles scatter by {noise:.2g} rad from sample to sample, but the legs are only {apart:.2g} "
            "rad apart, so any heel strikes found would be noise.",
            "Smooth the angles, or record them with less noise.",
        )


def unit_doubts(touches: list[Touch]) -> Iterator[str]:
    """Yield a doubt about the unit of the angles if the legs are very close to each other at heel strikes."""
    apart = float(np.median([abs(touch.fit.angle[0] - touch.fit.angle[1]) for touch in touches]))
    if apart < MIN_SPREAD_RAD:
        yield (
            f"The legs are only {math.degrees(apart):.2g} degrees apart at heel strikes. The file may state "
            "the wrong unit of angles."
        )


def refuse_short_steps(step_s: float, model: RigidModel, source: str) -> None:
    """Raise ConfigError for steps that are far shorter than a leg takes to swing forwards."""
    gravity = math.hypot(model.gravity_along, model.gravity_down)
    weight = gravity * math.hypot(model.arm_x[SWING], model.arm_y[SWING])
    # With a spring at the hip, a leg may swing much faster than a hanging pendulum, so there is no limit.
    swing_s = math.pi * math.sqrt(model.A[SWING, SWING] / weight) if weight and not model.sprung else 0.0
    if step_s < MIN_STEP * swing_s:
        raise ConfigError(
            f"{source}: steps of {step_s:.3g} s are not credible, because a leg of this walker swings forwards in "
            f"{swing_s:.3g} s: the heel strikes are noise, or the walker or the unit of time is wrong.",
            "Smooth the angles, record less noise, or correct the walker or the unit of time, e.g. --units time=ms.",
        )


def refuse_duration(step_s: float, source: str) -> None:
    if not is_plausible(step_s):
        raise ConfigError(
            f"{source}: steps of {step_s:.3g} s are implausible.",
            "State the unit of time, e.g. --units time=ms.",
        )


def refuse_lengths(steps: RecordedSteps, source: str) -> None:
    """Raise ConfigError for a step that does not go forwards."""
    for number, (length, time) in enumerate(zip(steps.length_m.tolist(), steps.touch_time_s.tolist(), strict=True), 1):
        if not is_plausible(length):
            raise ConfigError(
                f"{source}: step {number}, up to time {steps.origin_s + time:.6g} s, would be {length:.3g} m long.",
                "Check that the angles there are measured from the vertical, positive with the foot ahead (--columns).",
            )


def refuse_gaps(walk: RecordedWalk, touches: list[float], source: str) -> None:
    """Raise ConfigError for a step whose samples are too far apart to determine its heel strikes and velocities."""
    for number, (begin, end) in enumerate(pairwise(touches), 1):
        first, last = longest_gap(walk.time_s, begin, end)
        if last - first > MAX_GAP * (end - begin):
            raise ConfigError(
                f"{source}: step {number} has no samples from {first:.6g} to {last:.6g} s, which is "
                f"{(last - first) / (end - begin):.0%} of its duration.{f' {walk.gaps}.' if walk.gaps else ''}",
                f"Record at least {1 / MAX_GAP:.0f} samples per step, or read a part without gaps (--from-s, --to-s).",
            )


def longest_gap(time: Array, begin: float, end: float) -> tuple[float, float]:
    """Return the two neighbouring sample times (s) that are farthest apart between `begin` and `end`. The last sample
    up to `begin` and the first one from `end` on are included.
    """
    first, last = np.searchsorted(time, begin, "right") - 1, np.searchsorted(time, end)
    instants = time[first : last + 1]
    widest = int(np.argmax(np.diff(instants)))
    return float(instants[widest]), float(instants[widest + 1])


def build_steps(walk: RecordedWalk, model: RigidModel, touches: list[Touch], doubts: tuple[str, ...]) -> RecordedSteps:
    origin = touches[0].time_s
    swapped = touches[1].leg == 1
    times = np.array([touch.time_s for touch in touches[1:]]) - origin
    order = [1, 0] if swapped else [0, 1]
    angle = read_leg_angles(walk)
    velocity = walk.both_legs("velocity")
    columns = angle[:, order] if velocity is None else np.column_stack((angle[:, order], velocity[:, order]))
    time = walk.time_s - origin
    # The sample at a strike begins the next step, so the last sample of a step lies just before it.
    margin = STRIKE_MARGIN * float(times[-1])
    spans = list(zip((0.0, *times), (*(times - margin), float(time[-1])), strict=True))
    if not is_recorded_beyond(time, times):
        spans.pop()
    pieces = [samples_within(time, columns, *span) for span in spans]
    # At the ends of a step, the fits of the heel strikes are more accurate than the spline.
    for number, (_, angles, velocities) in enumerate(pieces):
        for row, touch, side in zip((0, -1), touches[number : number + 2], ("after", "before"), strict=False):
            angles[row] = touch.fit.angle[order]
            if velocity is None and side in touch.fit.rates:
                velocities[row] = touch.fit.rates[side][order]
    step = np.repeat(np.arange(len(pieces)), [piece[0].size for piece in pieces])
    times_s, angles_rad, velocities_rad_s = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    lengths = lengths_from_angles(model.exchanged if swapped else model, angles_rad, step, len(times))
    scatter = float(np.median([touch.fit.scatter for touch in touches[1:]]))
    errors = np.array([touch.error_s for touch in touches])
    return RecordedSteps(
        times_s, step, angles_rad, velocities_rad_s, times, errors, lengths, scatter, swapped, origin, doubts
    )


def is_recorded_beyond(time: Array, touches: Array) -> bool:
    """Whether enough of the step after the last heel strike is recorded."""
    if np.count_nonzero(time >= touches[-1]) <= SPLINE_DEGREE:
        return False
    first, last = longest_gap(time, float(touches[-1]), float(time[-1]))
    return last - first <= MAX_GAP * float(np.diff(touches, prepend=0.0)[-1])


def samples_within(time: Array, columns: Array, begin: float, end: float) -> tuple[Array, Array, Array]:
    """Return times (s), angles (rad) and velocities (rad/s) of a step, with samples at its ends.

    columns  (samples, 4) angles and velocities, or (samples, 2) angles, from which a spline gives the velocities
    """
    first, after = np.searchsorted(time, begin), np.searchsorted(time, end, "right")
    spline = spline_through(time[first:after], columns[first:after])
    inside = np.arange(np.searchsorted(time, begin, "right"), np.searchsorted(time, end))
    inside = inside[:: max(1, math.ceil(inside.size / MAX_STEP_SAMPLES))]
    grid = np.concatenate(([begin], time[inside], [end]))
    values = spline(grid)
    # The spline is used only for the ends and for velocities. All other values stay as recorded.
    values[1:-1] = columns[inside]
    velocities = spline.derivative()(grid)[:, :2] if columns.shape[1] == 2 else values[:, 2:]
    return grid, values[:, :2], velocities


def spline_through(time: Array, columns: Array) -> BSpline:
    """Fit a spline with evenly spaced knots, and with fewer of them if there are few samples."""
    # Imported here, because it is not needed to check whether a result is up to date.
    from scipy.interpolate import make_lsq_spline

    degree = min(SPLINE_DEGREE, time.size - 1)
    intervals = max(1, min(INTERVALS, time.size // (2 * SPLINE_DEGREE)))
    inner = np.linspace(time[0], time[-1], intervals + 1)[1:-1]
    knots = np.concatenate(([time[0]] * (degree + 1), inner, [time[-1]] * (degree + 1)))
    return make_lsq_spline(time, columns, knots, degree)


def lengths_from_angles(model: RigidModel, angle: Array, step: NDArray[np.int64], count: int) -> Array:
    """Return the step lengths (m) from the leg angles at the beginning and end of each step.

    model  rigid model whose swing leg is that of the first step
    """
    n = len(model.arm_x)
    states = np.zeros((2, count, 2 * n))
    for number in range(count):
        rows = np.flatnonzero(step == number)
        swing, stance = (0, 1) if number % 2 == 0 else (1, 0)
        for end, row in enumerate((rows[0], rows[-1])):
            bodies = np.zeros(n)
            bodies[SWING], bodies[STANCE] = angle[row, swing], angle[row, stance]
            states[end, number, :n] = apply_couplings(model, STRAIGHT, bodies)
    return compute_in_turns(model, np.arange(count), step_lengths, *states)
