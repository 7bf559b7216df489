"""Mend recorded leg angles before heel strikes are sought: full turns, swapped legs, outliers, signs and the way back.

Each change is stated in the walk's doubts, with the samples and times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from operator import itemgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import HIP_OF_LINES, SAMPLE, RecordedWalk
from walkerlab.exchange.marker_lines import spell_samples
from walkerlab.exchange.rate_jumps import AHEAD, Array, apart_runs
from walkerlab.exchange.touches import ERRORS

FASTEST: Final = 6.0  # fastest credible motion between two samples, as a multiple of fast motions' speed
FAST_PERCENT: Final = 80  # percentage of the motions between samples that are slower than fast ones
UPRIGHT_RAD: Final = math.pi / 4  # largest median of a leg's angle from the vertical
FEWEST_PASSING: Final = 3  # fewest sample intervals of a passing of the legs
TINY: Final = 1e-30  # rad^2, added to a variance that may be zero


@dataclass(frozen=True)
class Way:
    """Stretch of a walk in one direction."""

    forwards: bool  # whether angles are positive with the foot ahead
    passings: list[tuple[int, int]]  # first and last sample of each passing of the legs


def mend_angles(walk: RecordedWalk, source: str) -> RecordedWalk:
    """Return a walk whose leg angles are continuous, positive with the foot ahead, and go one way.

    source  name of the recording, for messages

    Raises ConfigError for angles that are not those of two legs near the vertical.
    """
    return without_outliers(swap_back(keep_one_way(unwrap(walk, source))))


def legs(walk: RecordedWalk) -> Array:
    """Return the angles of both legs (samples, 2) from the vertical (rad)."""
    angle = walk.both_legs("angle")
    assert angle is not None, "a walk has the angles of both legs"
    return angle


def doubting(walk: RecordedWalk, doubt: str) -> RecordedWalk:
    return replace(walk, doubts=(*walk.doubts, doubt))


def only_rows(walk: RecordedWalk, rows: NDArray[np.bool_]) -> RecordedWalk:
    """Return the samples of a walk at `rows` (samples,)."""
    kept = {name: values[rows] for name, values in walk.quantities.items()}
    return replace(walk, time_s=walk.time_s[rows], quantities=kept)


def unwrap(walk: RecordedWalk, source: str) -> RecordedWalk:
    """Undo jumps by full turns, and take half a turn off angles that are measured from the upward vertical.

    Raises ConfigError for angles in another unit, and for a leg that is not near the vertical.
    """
    for name in ("angle 1", "angle 2"):
        raw = walk.quantities[name]
        if (largest := float(np.percentile(np.abs(raw), FAST_PERCENT))) > 2.0 * math.pi:
            raise ConfigError(
                f"{source}: {name} from the vertical reaches {largest:.3g} rad, more than a turn.",
                "State the unit of angles, e.g. --units angle=deg, or remove outliers.",
            )
        angle = np.unwrap(raw)
        middle = float(np.median(angle))
        half_turns = round(middle / math.pi)
        angle -= half_turns * math.pi
        if abs(middle - half_turns * math.pi) > UPRIGHT_RAD:
            raise ConfigError(
                f"{source}: {name} lies around {math.degrees(middle):.0f} degrees from the vertical.",
                "Angles must be from the vertical, positive with the foot ahead (--columns), in the right unit "
                "(--units).",
            )
        walk = replace(walk, quantities={**walk.quantities, name: angle})
        if half_turns % 2:
            walk = doubting(
                walk, f"{name.capitalize()} is measured from the upward vertical, so 180 degrees are taken off."
            )
    return walk


@dataclass(frozen=True)
class Reach:
    """Largest credible motion of a leg between two samples: speed (rad/s), and what noise allows (rad)."""

    speed_rad_s: float
    noise_rad: float

    def within(self, interval: Array) -> Array:
        """Return the largest credible motion (rad) in an interval (s)."""
        return np.maximum(self.speed_rad_s * interval, self.noise_rad)


def credible_reach(walk: RecordedWalk) -> Reach:
    moved = np.abs(np.diff(legs(walk), axis=0))
    speeds = moved / np.diff(walk.time_s)[:, None]
    fast = (float(np.percentile(values, FAST_PERCENT)) for values in (speeds, moved))
    return Reach(*(FASTEST * value for value in fast))


def swap_back(walk: RecordedWalk) -> RecordedWalk:
    """Swap the legs back where their angles change places from one sample to the next."""
    angle, credible = legs(walk), credible_reach(walk).within(np.diff(walk.time_s))
    straight, exchanged = (np.abs(after - angle[:-1]).sum(axis=1) for after in (angle[1:], angle[1:, ::-1]))
    changes = (straight - exchanged > credible) & (exchanged < credible)
    swapped = np.append(0, np.cumsum(changes)) % 2 == 1
    if not swapped.any():
        return walk
    swapped = swapped if np.mean(swapped) <= 0.5 else ~swapped
    quantities = dict(walk.quantities)
    for first in [name for name in quantities if name.endswith(" 1")]:
        second = f"{first[:-1]}2"
        if second in quantities:
            pair = quantities[first], quantities[second]
            quantities[first], quantities[second] = np.where(swapped, pair[::-1], pair)
    places = spell_samples(walk.time_s, walk.quantities[SAMPLE], swapped)
    doubt = f"The legs are swapped at {places}, and are swapped back there."
    return doubting(replace(walk, quantities=quantities), doubt)


def without_outliers(walk: RecordedWalk) -> RecordedWalk:
    """Leave out samples in which a leg is where it cannot have moved."""
    reach, left_out = credible_reach(walk), np.zeros(walk.time_s.size, bool)
    for name in ("angle 1", "angle 2"):
        outliers = unreachable(walk.time_s, walk.quantities[name], reach)
        if outliers.any():
            places = spell_samples(walk.time_s, walk.quantities[SAMPLE], outliers)
            walk = doubting(walk, f"{name.capitalize()} is off its course at {places}, which is left out.")
        left_out |= outliers
    return only_rows(walk, ~left_out)


def unreachable(time: Array, angle: Array, reach: Reach) -> NDArray[np.bool_]:
    """Return which samples (samples,) cannot be reached from the nearest sample that can."""
    outliers = np.zeros(time.size, bool)
    jumps = np.abs(np.diff(angle)) > reach.within(np.diff(time))
    calm = np.flatnonzero(~jumps[1:] & ~jumps[:-1])
    if not jumps.any() or not calm.size:
        return outliers
    start, instants, values = int(calm[0]) + 1, time.tolist(), angle.tolist()
    for order in (range(start, time.size), range(start, -1, -1)):
        last = start
        for row in order:
            farthest = max(reach.speed_rad_s * abs(instants[row] - instants[last]), reach.noise_rad)
            if abs(values[row] - values[last]) <= farthest:
                last = row
            else:
                outliers[row] = True
    return outliers


def keep_one_way(walk: RecordedWalk) -> RecordedWalk:
    """Make angles positive with the foot ahead, and keep the longest stretch of a walk there and back.

    The legs of a walk swing against each other. As they pass, the swing foot moves faster against the hip than the foot
    on the ground, and forwards.
    """
    angle = legs(walk)
    swing = angle - np.mean(angle, axis=0)
    second = -1.0 if "angle 1" not in walk.lines and float(swing[:, 0] @ swing[:, 1]) > 0.0 else 1.0
    ways = [way for way in find_ways(walk.time_s, angle * [1.0, second]) if way.forwards or not walk.walks]
    if not ways:
        return walk
    place = max(range(len(ways)), key=lambda place: len(ways[place].passings))
    first = 1.0 if ways[place].forwards else -1.0
    signs = {"angle 1": first, "velocity 1": first, "angle 2": first * second, "velocity 2": first * second}
    signs |= dict.fromkeys(walk.lines, first)
    walk = replace(walk, quantities={name: signs.get(name, 1.0) * values for name, values in walk.quantities.items()})
    if reversed_names := [name for name in ("angle 1", "angle 2") if signs[name] < 0.0 and name not in walk.lines]:
        walk = doubting(walk, f"Heel strikes are found with the sign of {' and '.join(reversed_names)} reversed.")
    turns = [find_turn(walk, before, after) for before, after in pairwise(ways)]
    if not turns:
        return walk
    begin, end = [0, *turns][place], [*turns, walk.time_s.size - 1][place]
    spelled = ", ".join(f"{walk.time_s[turn]:.6g} s" for turn in turns)
    kept = f"the longest stretch one way, from time {walk.time_s[begin]:.6g} to {walk.time_s[end]:.6g} s, is kept"
    rows = np.arange(walk.time_s.size)
    return only_rows(
        doubting(walk, f"The walk turns round at time {spelled}: {kept}."), (begin <= rows) & (rows <= end)
    )


def find_ways(time: Array, angle: Array) -> list[Way]:
    """Return the stretches of a walk in one direction; a single passing of the legs the other way does not count."""
    spread, total = angle[:, 0] - angle[:, 1], angle.sum(axis=1)
    runs = apart_runs(np.abs(spread) > AHEAD * np.percentile(np.abs(spread), FAST_PERCENT), spread > 0.0)
    trends = [
        (last, first, trend(time[last : first + 1], total[last : first + 1]))
        for (_, last), (first, _) in pairwise(runs)
        if spread[last] * spread[first] < 0.0 and first - last >= FEWEST_PASSING
    ]
    passings = [(last, first, errors > 0.0) for last, first, errors in trends if abs(errors) > ERRORS]
    alike = [list(group) for _, group in groupby(passings, itemgetter(2))]
    lasting = [passing for group in alike if len(group) > 1 for passing in group] or passings
    return [Way(way, [(a, b) for a, b, _ in group]) for way, group in groupby(lasting, itemgetter(2))]


def trend(time: Array, values: Array) -> float:
    """Return the slope of a line through values, in its standard errors."""
    share = (time - np.mean(time)) / np.ptp(time)
    slope = float(share @ values) / float(share @ share)
    left = values - np.mean(values) - slope * share
    return slope / math.sqrt(float(left @ left) / (time.size - 2) / float(share @ share) + TINY)


def find_turn(walk: RecordedWalk, before: Way, after: Way) -> int:
    """Return the sample between two stretches at which the hip turns round; without markers, the one in the middle."""
    begin, end = before.passings[-1][1], after.passings[0][0]
    hip = walk.quantities.get(HIP_OF_LINES)
    if hip is None:
        return (begin + end) // 2
    return begin + int(np.argmax(hip[begin : end + 1] * (1.0 if before.forwards else -1.0)))
