"""Repairs that recorded leg angles need before the search for heel strikes.

They unwrap full turns, exchange swapped legs, drop outliers, correct signs, and keep one direction of walking.

Each repair is listed in the doubts of the walk, with samples and times.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby, pairwise
from operator import itemgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import HIP_OF_LINES, SAMPLE, RecordedWalk, select_rows
from walkerlab.exchange.marker_lines import MAD_TO_DEVIATION, MAX_NAMED, spell_samples, swap_doubt, swapped_rows
from walkerlab.exchange.touches import (
    SIGNIFICANT_ERRORS,
    WINDOW_AHEAD,
    Array,
    apart_runs,
    noise_of,
    squares_around,
    typical_interval,
)

UPRIGHT_RAD: Final = math.pi / 4  # largest credible median of a leg angle from the vertical
MIN_PASSING_SAMPLES: Final = 3  # the legs must take at least this many sample intervals to pass each other
NOISY_RATIO: Final = 0.02  # ratio of noise to amplitude above which times of single steps are wrong by several per cent
MIN_VARIANCE: Final = 1e-30  # rad^2; added to variances, because they may be zero
# highest degree of the polynomial through a step; with it, the error is 0.1 mrad for straight legs
HIGHEST_DEGREE: Final = 7
SAMPLES_PER_DEGREE: Final = 3  # a step needs this many samples for each degree of its polynomial above 1
FAR_PERCENT: Final = 80  # legs are far apart if the angle between them is above this percentile
# search for a strike within this time before and after the first guess, as a fraction of a step
SEARCH_RANGE: Final = 0.3
MARGIN: Final = 0.2  # the fit of a strike keeps this distance from the neighbouring strikes, as a fraction of a step
MAX_FIT_TIME: Final = 1.3  # a fit extends at most this long before and after a strike, as a fraction of a step
# a leg has jumped if its motion between two samples is above this multiple of the percentile FAR_PERCENT of motions
MAX_MOTION: Final = 6.0
# a leg counts as far ahead only if it stays there for this fraction of a typical time ahead (percentile FAR_PERCENT)
MIN_TIME_AHEAD: Final = 0.25
MAX_STRETCH: Final = 0.3  # a leg that is off its curve for longer than this fraction of a step has jumped
# A stretch this close to an end of the fitted span, as a fraction of a step, is left to the fits of other strikes.
BORDER: Final = 0.1
LASTING_BORDER: Final = 0.15  # the same for lasting jumps
LENGTH_TRIALS: Final = 16  # number of lengths that are tried first for a stretch
FIRST_TRIALS: Final = 25  # number of instants tried for a strike
NEXT_TRIALS: Final = (9,)  # numbers of instants that are then tried around the best one
STANDARD_ERRORS: Final = 7.0
# A stretch must explain at least this many times the sum of squares that the best one near a typical strike explains.
MIN_EXPLAINED_RATIO: Final = 6.0
TYPICAL_PERCENT: Final = 30
MAX_GAP: Final = 0.25  # widest gap between two samples, as a fraction of a step
MIN_STRIKE_SAMPLES: Final = 12  # minimum number of samples in the two steps around a strike
MAX_SCATTER: Final = 0.1  # largest scatter of the angles, as a fraction of the angle between the legs
# If a stretch explains more than this fraction of the detection limit, search for it and the strike time together.
JOINT_SEARCH_FRACTION: Final = 0.5
MIN_OFFSET: Final = 0.008  # smallest offset that counts, as a fraction of the angle between the legs
MAX_STRETCHES: Final = 30  # maximum number of stretches in the steps around a strike
# A stretch is tested only if the part of it that polynomials cannot fit has at least this squared norm (in samples).
MIN_NORM: Final = 0.12


@dataclass(frozen=True)
class Way:
    """Stretch of a walk in one direction."""

    forwards: bool  # whether angles are positive with the foot ahead
    passings: list[tuple[int, int]]  # first and last sample of each time the legs pass each other


def mend_angles(walk: RecordedWalk, source: str) -> RecordedWalk:
    """Return the walk with mended leg angles: continuous, measured from the vertical, and positive with the foot ahead.

    source  name of the recording, for messages

    Raises ConfigError for angles that are not those of two legs near the vertical.
    """
    # Full turns, reversed signs and swapped legs would look like samples off their curves, so repair them first.
    mended = drop_off_course(swap_back(keep_one_way(unwrap(walk, source))))
    upright = {name: mended.quantities[name] - walk.tilt_rad for name in ("angle 1", "angle 2")}
    return replace(mended, quantities={**mended.quantities, **upright})


def read_leg_angles(walk: RecordedWalk) -> Array:
    """Return the angles of both legs (samples, 2) from the vertical (rad)."""
    angle = walk.both_legs("angle")
    assert angle is not None, "a walk has the angles of both legs"
    return angle


def add_doubt(walk: RecordedWalk, doubt: str) -> RecordedWalk:
    return replace(walk, doubts=(*walk.doubts, doubt))


def unwrap(walk: RecordedWalk, source: str) -> RecordedWalk:
    """Remove jumps by full turns. Angles from the upward vertical are turned by half a turn.

    Raises ConfigError for angles in another unit, and for a leg that is not near the vertical.
    """
    for name in ("angle 1", "angle 2"):
        raw = walk.quantities[name]
        if (largest := float(np.percentile(np.abs(raw), FAR_PERCENT))) > 2.0 * math.pi:
            raise ConfigError(
                f"{source}: {name} from the vertical reaches {largest:.3g} rad, more than a full turn.",
                "State the unit of angles, e.g. --units angle=deg, or remove outliers.",
            )
        angle = np.unwrap(raw)
        middle = float(np.median(angle))
        half_turns = round(middle / math.pi)
        angle -= half_turns * math.pi
        if abs(middle - half_turns * math.pi) > UPRIGHT_RAD:
            raise ConfigError(
                f"{source}: {name} is about {math.degrees(middle):.0f} degrees from the vertical.",
                "Angles must be measured from the vertical, positive with the foot ahead and in the right unit "
                f'(--units). For angles from the horizontal: --columns "{name}={walk.sources.get(name, name)}+90deg".',
            )
        walk = replace(walk, quantities={**walk.quantities, name: angle})
        if half_turns % 2:
            doubt = f"{name.capitalize()} is measured from the upward vertical, so 180 degrees are subtracted."
            walk = add_doubt(walk, doubt)
    return walk


def swap_back(walk: RecordedWalk) -> RecordedWalk:
    """Swap the legs back where their angles have been exchanged."""
    angle = read_leg_angles(walk)
    swapped = swapped_rows(walk.time_s, angle[:, :1] - angle[:, 1:])
    if not swapped.any():
        return walk
    quantities = dict(walk.quantities)
    for first in [name for name in quantities if name.endswith(" 1")]:
        second = f"{first[:-1]}2"
        if second in quantities:
            pair = quantities[first], quantities[second]
            quantities[first], quantities[second] = np.where(swapped, pair[::-1], pair)
    return add_doubt(replace(walk, quantities=quantities), swap_doubt(walk.time_s, walk.quantities[SAMPLE], swapped))


def drop_off_course(walk: RecordedWalk) -> RecordedWalk:
    """Remove samples at which a leg leaves its course, and cut the walk where an angle jumps and does not return."""
    stretches = find_stretches(walk.time_s, read_leg_angles(walk))
    off = np.zeros((walk.time_s.size, 2), bool)
    numbers = walk.quantities[SAMPLE]
    for stretch in stretches:
        if not stretch.lasts:
            off[stretch.first : stretch.end, stretch.leg] = True
    for leg in np.flatnonzero(off.any(axis=0)).tolist():
        places = spell_samples(walk.time_s, numbers, off[:, leg])
        walk = add_doubt(walk, f"Angle {leg + 1} is off its course at {places}, which is left out.")
    rows = np.asarray(~off.any(axis=1))
    if jumps := [stretch for stretch in stretches if stretch.lasts]:
        cuts = sorted({0, walk.time_s.size, *(jump.first for jump in jumps)})
        begin, end = max(pairwise(cuts), key=lambda part: part[1] - part[0])
        spelled = ", ".join(
            f"angle {jump.leg + 1} jumps by {jump.offset_rad:.3g} rad from sample {numbers[jump.first - 1]:.0f} to "
            f"{numbers[jump.first]:.0f} (time {walk.time_s[jump.first]:.6g} s)"
            for jump in jumps[:MAX_NAMED]
        )
        doubt = (
            f"As if a sensor had slipped, there is a lasting jump: {spelled}. Only the longest part without one is "
            f"kept, from time {walk.time_s[begin]:.6g} to {walk.time_s[end - 1]:.6g} s."
        )
        walk = add_doubt(walk, doubt)
        rows[:begin] = rows[end:] = False
    return select_rows(walk, rows)


def keep_one_way(walk: RecordedWalk) -> RecordedWalk:
    """Make angles positive with the foot ahead, and keep the longest stretch walked in one direction.

    This direction is that of the faster foot as the legs pass each other: relative to the hip, the swing foot moves
    forwards faster than the stance foot moves backwards.
    """
    angle = read_leg_angles(walk)
    swing = angle - np.mean(angle, axis=0)
    second = -1.0 if "angle 1" not in walk.lines and float(swing[:, 0] @ swing[:, 1]) > 0.0 else 1.0
    directed = bool(walk.walks and walk.lines)
    ways = [way for way in find_ways(walk.time_s, angle * [1.0, second]) if way.forwards or not directed]
    if not ways:
        return walk
    longest = max(range(len(ways)), key=lambda index: len(ways[index].passings))
    first = 1.0 if ways[longest].forwards else -1.0
    signs = {"angle 1": first, "velocity 1": first, "angle 2": first * second, "velocity 2": first * second}
    signs |= dict.fromkeys(walk.lines, first)
    walk = replace(walk, quantities={name: signs.get(name, 1.0) * values for name, values in walk.quantities.items()})
    if reversed_names := [name for name in ("angle 1", "angle 2") if signs[name] < 0.0 and name not in walk.lines]:
        walk = add_doubt(walk, f"Heel strikes are found with the sign of {' and '.join(reversed_names)} reversed.")
    turns = [find_turn(walk, before, after) for before, after in pairwise(ways)]
    if not turns:
        return walk
    begin = [0, *turns][longest]
    end = [*turns, walk.time_s.size - 1][longest]
    spelled = ", ".join(f"{walk.time_s[turn]:.6g} s" for turn in turns)
    kept = f"the longest stretch in one direction, from {walk.time_s[begin]:.6g} to {walk.time_s[end]:.6g} s, is kept"
    rows = np.arange(walk.time_s.size)
    walk = add_doubt(walk, f"The walk turns round at time {spelled}: {kept}.")
    return select_rows(walk, (begin <= rows) & (rows <= end))


def find_ways(time: Array, angle: Array) -> list[Way]:
    """Divide a walk into stretches in one direction. If the legs pass each other the other way only once, this does not
    begin a new stretch.
    """
    spread = angle[:, 0] - angle[:, 1]
    total = angle.sum(axis=1)
    runs = apart_runs(np.abs(spread) > WINDOW_AHEAD * np.percentile(np.abs(spread), FAR_PERCENT), spread > 0.0)
    trends = [
        (last, first, trend(time[last : first + 1], total[last : first + 1]))
        for (_, last), (first, _) in pairwise(runs)
        if spread[last] * spread[first] < 0.0 and first - last >= MIN_PASSING_SAMPLES
    ]
    passings = [(last, first, errors > 0.0) for last, first, errors in trends if abs(errors) > SIGNIFICANT_ERRORS]
    alike = [list(group) for _, group in groupby(passings, itemgetter(2))]
    lasting = [passing for group in alike if len(group) > 1 for passing in group] or passings
    return [Way(way, [(a, b) for a, b, _ in group]) for way, group in groupby(lasting, itemgetter(2))]


def trend(time: Array, values: Array) -> float:
    """Fit a line to values, and return its slope divided by the standard error of the slope."""
    share = (time - np.mean(time)) / np.ptp(time)
    slope = float(share @ values) / float(share @ share)
    residuals = values - np.mean(values) - slope * share
    return slope / math.sqrt(float(residuals @ residuals) / (time.size - 2) / float(share @ share) + MIN_VARIANCE)


def find_turn(walk: RecordedWalk, before: Way, after: Way) -> int:
    """Return the sample between two stretches at which the hip turns round, or the middle sample if the hip was not
    recorded.
    """
    begin = before.passings[-1][1]
    end = after.passings[0][0]
    if (hip := walk.quantities.get(HIP_OF_LINES)) is None:
        return (begin + end) // 2
    return begin + int(np.argmax(hip[begin : end + 1] * (1.0 if before.forwards else -1.0)))


def describe_doubts(walk: RecordedWalk) -> Iterator[str]:
    """Yield a sentence for each reason to doubt the steps: odd angles, noise, and unused columns or samples."""
    yield from walk.doubts
    angles = read_leg_angles(walk)
    noise = noise_of(angles)
    amplitude = math.sqrt(max(2.0 * float(np.var(angles, axis=0).max()) - 2.0 * noise**2, 0.0))
    if noise > NOISY_RATIO * amplitude:
        yield (
            f"The angles scatter by {noise:.2g} rad from sample to sample, with an amplitude of {amplitude:.2g} rad: "
            "heel strikes are uncertain, and with them periods and lengths of single steps."
        )
    for name, reason in walk.left_out.items():
        yield f"Not used: {name}: {reason.removesuffix('.')}."


# Smooth curves through the angles -------------------------------------------------------------------------------------

# Within a step each angle is smooth, and at a heel strike only the rates jump. So polynomials through the step before
# and the step after a strike, which meet there, describe the angles of both legs. A stretch of samples is off its
# curve if a constant added to it explains much more of the residuals than scatter does, and more than in typical
# steps. The strike is located again for every stretch, because a wrong sample near a strike shifts its time.


@dataclass(frozen=True)
class Stretch:
    """Successive samples of a leg that lie on a smooth curve once a constant is subtracted."""

    leg: int
    first: int
    end: int  # first sample after the stretch
    offset_rad: float
    explained: float  # sum of squared residuals (rad^2) that the offset explains
    lasts: bool  # whether the angle never returns to its curve


@dataclass(frozen=True, eq=False)
class Strike:
    """Samples of the steps before and after a heel strike, and the time span in which the strike can lie."""

    time: Array
    angle: Array
    rows: NDArray[np.int64]  # indices of the samples in the recording
    span_s: tuple[float, float]
    smooth_instant: float  # instant of the strike (s), if the samples before and after it are on smooth curves
    step_s: float
    at_ends: tuple[bool, bool]  # whether the recording begins with these samples, and whether it ends with them

    def fit(self, at: float) -> tuple[Array, Array]:
        """Fit polynomials that meet at an instant. Return their orthonormal basis (samples, columns) and the
        residuals.
        """
        t = self.time - at
        columns = [np.ones((t.size, 1))]
        for side in (t < 0.0, t >= 0.0):
            degree = min(HIGHEST_DEGREE, 1 + int(np.sum(side)) // SAMPLES_PER_DEGREE)
            t_side = np.where(side, t / self.step_s, 0.0)
            # Repeated products are ten times faster than powers.
            columns.append(np.multiply.accumulate(np.broadcast_to(t_side[:, None], (t_side.size, degree)), axis=1))
        basis = np.linalg.qr(np.concatenate(columns, axis=1))[0]
        return basis, self.angle - basis @ (basis.T @ self.angle)

    @cached_property
    def smooth_fit(self) -> tuple[Array, Array]:
        """Basis and residuals of the fit of smooth curves."""
        return self.fit(self.smooth_instant)

    def scatter(self) -> Array:
        """Return the residuals of the smooth fit. They are scaled up, because the fit follows part of the scatter."""
        basis, residuals = self.smooth_fit
        free = 1.0 - np.sum(basis**2, axis=1)
        clear = free > MIN_NORM
        return np.asarray(residuals[clear] / np.sqrt(free[clear])[:, None])

    def best_with_strike(self) -> tuple[Stretch, float]:
        """Return the stretch with the smallest sum of squared residuals over all strike times, and that sum (rad^2)."""

        def left(at: float) -> float:
            parts = self.fit(at)
            return float(np.sum(parts[1] ** 2)) - self.best_stretch(parts).explained

        spans = np.array([self.span_s])
        at = float(find_instants(spans, np.vectorize(left, [float]), 2 * FIRST_TRIALS, *NEXT_TRIALS)[0])
        return self.best_stretch(self.fit(at)), left(at)

    def best_stretch(self, parts: tuple[Array, Array]) -> Stretch:
        """Return the stretch that explains the largest part of the residuals of a fit (basis and residuals)."""
        sums = [np.concatenate((np.zeros((1, part.shape[1])), np.cumsum(part, axis=0))) for part in parts]
        longest = max(1, int(np.searchsorted(self.time, self.time[0] + MAX_STRETCH * self.step_s)))
        lengths = np.unique(np.geomspace(1, longest, LENGTH_TRIALS).astype(int))
        low, high = self.inner_samples(BORDER)
        # To save time, try long stretches only at widely spaced positions. The best one is refined below.
        short = np.concatenate([first_and_end(np.arange(low, high, max(1, n // 8)), n) for n in lengths.tolist()])
        inner = np.arange(*self.inner_samples(LASTING_BORDER, whole=False))
        lasting = first_and_end(inner, self.time.size - inner)
        first, end, leg = best_span(sums, np.concatenate((short[short[:, 1] <= high], lasting)))
        lasts = bool(np.any((lasting == (first, end)).all(axis=1)))
        if not lasts:
            # Try all spans whose ends are near those of the best one.
            near = np.arange(-1 - (end - first) // 4, 2 + (end - first) // 4)
            around = np.stack(np.meshgrid(first + near, end + near), axis=2).reshape(-1, 2)
            fits = (around[:, 0] >= low) & (around[:, 1] <= high) & (around[:, 1] > around[:, 0])
            first, end, leg = best_span(sums, around[fits])
        norm, share = parts_of(sums, np.array([(first, end)]))
        offset = float(share[0, leg] / norm[0])
        return Stretch(leg, first, end, offset, offset * float(share[0, leg]), lasts)

    def inner_samples(self, part: float, whole: bool = True) -> tuple[int, int]:
        """Return the range (first, end) of the samples farther than the fraction `part` of a step from both ends. Other
        fits cover the rest.

        whole  whether to include the samples up to an end that is also an end of the recording
        """
        away_s = part * self.step_s
        first, end = np.searchsorted(self.time, (self.time[0] + away_s, self.time[-1] - away_s))
        return 0 if whole and self.at_ends[0] else int(first), self.time.size if whole and self.at_ends[1] else int(end)


def find_instants(spans: Array, costs_at: Callable[[Array], Array], *counts: int) -> Array:
    """Return the instant (s) with the smallest cost in each span.

    spans     (spans, 2) s, where to search
    costs_at  function that returns the costs of instants (spans, trials)
    counts    number of trials in each round. Later rounds search a smaller interval around the best trial
    """
    begin, end = spans.T
    each = np.arange(len(spans))
    for count in counts:
        trials = np.linspace(begin, end, count, axis=1)
        costs = costs_at(trials)
        # The next interval and the final parabola need a trial on each side of the best one.
        best = np.clip(np.argmin(costs, axis=1), 1, count - 2)
        begin, middle, end = (trials[each, best + k] for k in (-1, 0, 1))
    # Take the vertex of the parabola through the best trials.
    left, least, right = (costs[each, best + k] for k in (-1, 0, 1))
    bend = left - 2.0 * least + right
    move = 0.5 * (left - right) / np.where(bend > 0.0, bend, np.inf)
    return np.asarray(middle + np.clip(move, -1.0, 1.0) * (end - middle))


def first_and_end(first: NDArray[np.int64], length: int | NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the spans (spans, 2) that begin at the samples `first` and have the given length."""
    return np.stack((first, first + length), axis=1)


def parts_of(sums: Sequence[Array], spans: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return, for each span (first, end), the squared norm of the part of a unit offset that a fit does not follow, and
    the sums of the residuals.

    sums  cumulative sums of the fit's orthonormal basis and of its residuals
    """
    first, end = spans.T
    inside, share = (part.take(end, axis=0) - part.take(first, axis=0) for part in sums)
    return end - first - np.vecdot(inside, inside), share


def best_span(sums: Sequence[Array], spans: NDArray[np.int64]) -> tuple[int, int, int]:
    """Return the first sample, the end and the leg of the span that explains more of the residuals than any other."""
    norm, share = parts_of(sums, spans)
    # In some spans, polynomials can follow a constant almost completely. Dividing by the rest would magnify rounding.
    explained = np.where(norm > MIN_NORM, 1.0 / np.maximum(norm, MIN_NORM), 0.0)[:, None] * share**2
    best, leg = np.unravel_index(int(np.argmax(explained)), explained.shape)
    return int(spans[best, 0]), int(spans[best, 1]), int(leg)


def find_stretches(time: Array, angle: Array) -> list[Stretch]:
    """Find the stretches of samples of the recording in which a leg is off its smooth curve.

    time   (samples,) s, rising
    angle  (samples, 2) rad, from the vertical
    """
    far = float(np.percentile(np.abs(angle[:, 0] - angle[:, 1]), FAR_PERCENT))
    if noise_of(angle) > MAX_SCATTER * far:
        return []
    found = find_leaps(time, angle, MAX_STRETCH * course_of(time, angle).step_s)
    course = course_of(time, angle, found)
    strikes = course.strikes(range(len(course.spans)))
    sampled = bool(strikes) and min(strike.time.size for strike in strikes) >= MIN_STRIKE_SAMPLES
    # Polynomials through sparse samples would also follow errors.
    if not sampled or np.max(np.diff(time)) > MAX_GAP * course.step_s:
        return found
    residuals = np.concatenate([strike.scatter().ravel() for strike in strikes])
    scatter = MAD_TO_DEVIATION * float(np.median(np.abs(residuals)))
    worst = [strike.best_stretch(strike.smooth_fit).explained for strike in strikes]
    limit = max((STANDARD_ERRORS * scatter) ** 2, MIN_EXPLAINED_RATIO * float(np.percentile(worst, TYPICAL_PERCENT)))
    # A false strike in one step makes the neighbouring steps look wrong as well.
    for index in np.argsort(worst)[::-1].tolist():
        if worst[index] > JOINT_SEARCH_FRACTION * limit:
            new = stretches_near(course, index, limit, MIN_OFFSET * far)
            found = found + new
            course = course.remove_stretches(new)
    return found


def find_leaps(time: Array, angle: Array, longest_s: float) -> list[Stretch]:
    """Find the stretches that begin and end with a jump faster than a leg can move."""
    moved = np.diff(angle, axis=0)
    fastest = MAX_MOTION * float(np.percentile(np.abs(moved), FAR_PERCENT))
    found = []
    for leg in (0, 1):
        jumps = np.flatnonzero(np.abs(moved[:, leg]) > fastest).tolist()
        while len(jumps) > 1:
            first, back = jumps[:2]
            returns = moved[first, leg] * moved[back, leg] < 0.0 and time[back] - time[first] < longest_s
            if returns:
                found.append(Stretch(leg, first + 1, back + 1, float(moved[first, leg]), 0.0, lasts=False))
            # If the second jump does not undo the first, drop only the first, because the second may begin another
            # stretch.
            jumps = jumps[2 if returns else 1 :]
    return found


def stretches_near(course: Course, index: int, limit: float, smallest: float) -> list[Stretch]:
    """Return those stretches in the steps around a strike whose offsets explain more than a limit (rad^2)."""

    def worst(others: Sequence[Stretch]) -> Stretch | None:
        """Return the stretch that explains most if `others` are removed, or None if it explains less than the limit."""
        strike = course.remove_stretches(others).strikes([index])[0]
        if strike.best_stretch(strike.smooth_fit).explained <= JOINT_SEARCH_FRACTION * limit:
            return None
        stretch, left = strike.best_with_strike()
        explains = float(np.sum(strike.smooth_fit[1] ** 2)) - left > limit
        if not explains or abs(stretch.offset_rad) < smallest:
            return None
        return replace(stretch, first=int(strike.rows[stretch.first]), end=int(strike.rows[stretch.end - 1]) + 1)

    found: list[Stretch] = []
    while len(found) < MAX_STRETCHES and (stretch := worst(found)):
        found.append(stretch)
    # Each stretch was found without the later ones. With them, it may no longer be needed.
    for stretch in found[:-1]:
        others = [other for other in found if other is not stretch]
        found = found if worst(others) else others
    return found


@dataclass(frozen=True, eq=False)
class Course:
    """Samples of a recording, and the time span (s) of each stretch in which one leg is far ahead of the other."""

    time: Array
    angle: Array
    rows: NDArray[np.int64]  # indices of the samples in the recording
    spans: list[tuple[float, float]]
    step_s: float
    # These are not arguments of `__init__`, so that `replace` drops them. Guesses that were made with wrong samples
    # must not remain once these are removed.
    guesses: dict[int, float] = field(default_factory=dict, init=False)

    def remove_stretches(self, stretches: Sequence[Stretch]) -> Course:
        """Drop the samples of stretches that end. For those that last, subtract the offset from all later samples."""
        angle = self.angle.copy()
        kept = np.ones(self.rows.size, bool)
        for stretch in stretches:
            if stretch.lasts:
                angle[self.rows >= stretch.first, stretch.leg] -= stretch.offset_rad
            else:
                kept &= (self.rows < stretch.first) | (self.rows >= stretch.end)
        return replace(self, time=self.time[kept], angle=angle[kept], rows=self.rows[kept])

    def strikes(self, indices: Sequence[int]) -> list[Strike]:
        """Return the samples around the heel strikes in the spans with these indices."""
        self.guess(indices)
        ends = [self.ends_around(index) for index in indices]
        slices = [self.slice_of(first, last) for first, last, _ in ends]
        spans = [span for *_, span in ends]
        instants = self.smooth_instants(slices, spans, FIRST_TRIALS, *NEXT_TRIALS)
        return [
            Strike(
                self.time[near], self.angle[near], self.rows[near], span, at, self.step_s,
                (near.start == 0, near.stop == self.time.size),
            )
            for near, span, at in zip(slices, spans, instants, strict=True)
        ]  # fmt: skip

    def ends_around(self, index: int) -> tuple[float, float, tuple[float, float]]:
        """Return the beginning and end (s) of the steps around a strike, and the span of time in which to search for
        it.
        """
        begin, end = self.spans[index]
        at = self.guesses[index]
        farthest = MAX_FIT_TIME * self.step_s
        first = max(self.guesses[index - 1] + MARGIN * self.step_s, at - farthest) if index else float(self.time[0])
        following = index + 1 < len(self.spans)
        last = min(self.guesses[index + 1] - MARGIN * self.step_s, at + farthest) if following else float(self.time[-1])
        return first, last, (max(begin, at - SEARCH_RANGE * self.step_s), min(end, at + SEARCH_RANGE * self.step_s))

    def guess(self, indices: Iterable[int]) -> None:
        """Add first guesses of the times at which rates jump, for the spans with these indices and their neighbours."""
        nearby = {near for index in indices for near in (index - 1, index, index + 1)}
        new = sorted(nearby.intersection(range(len(self.spans))) - self.guesses.keys())
        spans = [self.spans[index] for index in new]
        half = 0.5 * self.step_s
        slices = [self.slice_of(begin - half, end + half) for begin, end in spans]
        self.guesses.update(zip(new, self.smooth_instants(slices, spans, FIRST_TRIALS), strict=True))

    def smooth_instants(
        self, slices: Sequence[slice], spans: Sequence[tuple[float, float]], *counts: int
    ) -> list[float]:
        """Return the instants (s) of strikes, if the samples before and after them are on smooth curves."""
        parts = [(self.time[near], self.angle[near]) for near in slices]

        def costs_at(instants: Array) -> Array:
            return squares_around(parts, instants, HIGHEST_DEGREE, SAMPLES_PER_DEGREE)

        return find_instants(np.array(spans), costs_at, *counts).tolist() if parts else []

    def slice_of(self, first_s: float, last_s: float) -> slice:
        return slice(int(np.searchsorted(self.time, first_s)), int(np.searchsorted(self.time, last_s, "right")))


def course_of(time: Array, angle: Array, stretches: Sequence[Stretch] = ()) -> Course:
    """Build the course of a recording after removing `stretches`. Each span in which one leg is far ahead contains a
    heel strike, where the rates jump.
    """
    course = Course(time, angle, np.arange(time.size), [], 0.0).remove_stretches(stretches)
    time = course.time
    spread = course.angle[:, 0] - course.angle[:, 1]
    far = WINDOW_AHEAD * float(np.percentile(np.abs(spread), FAR_PERCENT))
    apart = apart_runs(np.abs(spread) > far, spread > 0.0)
    durations = [time[last] - time[first] for first, last in apart] or [0.0]
    shortest = MIN_TIME_AHEAD * float(np.percentile(durations, FAR_PERCENT))
    runs: list[tuple[int, int]] = []
    for first, last in apart:
        # Outliers make brief runs, and can divide one run into two.
        if time[last] - time[first] >= shortest or first == 0 or last == time.size - 1:
            goes_on = bool(runs) and spread[first] * spread[runs[-1][0]] > 0.0
            runs[len(runs) - goes_on :] = [(runs[-1][0] if goes_on else first, last)]
    spans = [(float(time[first]), float(time[last])) for first, last in runs]
    return replace(course, spans=spans, step_s=typical_interval([0.5 * (begin + end) for begin, end in spans], time))
