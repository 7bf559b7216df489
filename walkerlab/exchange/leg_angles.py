"""Repairs of recorded leg angles before the search for heel strikes.

They unwrap full turns, exchange swapped legs, drop outliers, correct signs, and keep one direction of walking.

Each repair is listed in the doubts of the walk, with samples and times.
"""

import math
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from operator import itemgetter
from typing import Final

import numpy as np

from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import HIP_OF_LINES, SAMPLE, RecordedWalk, select_rows
from walkerlab.exchange.marker_lines import MAX_NAMED, spell_samples, swap_doubt, swapped_rows
from walkerlab.exchange.rate_jumps import WINDOW_AHEAD, Array, apart_runs
from walkerlab.exchange.smooth_course import FAR_PERCENT, find_stretches
from walkerlab.exchange.touches import SIGNIFICANT_ERRORS

UPRIGHT_RAD: Final = math.pi / 4  # largest credible median of a leg's angle from the vertical
MIN_PASSING_SAMPLES: Final = 3  # a passing of the legs takes at least this many sample intervals
MIN_VARIANCE: Final = 1e-30  # rad^2, added to a variance that may be zero


@dataclass(frozen=True)
class Way:
    """Stretch of a walk in one direction."""

    forwards: bool  # whether angles are positive with the foot ahead
    passings: list[tuple[int, int]]  # first and last sample of each passing of the legs


def mend_angles(walk: RecordedWalk, source: str) -> RecordedWalk:
    """Return the walk with continuous leg angles from the vertical, positive with the foot ahead, in one direction.

    source  name of the recording, for messages

    Raises ConfigError for angles that are not those of two legs near the vertical.
    """
    # Full turns, reversed signs and swapped legs would look like samples off the course, so they are mended first.
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
    """Undo jumps by full turns. Subtract half a turn from angles that are measured from the upward vertical.

    Raises ConfigError for angles in another unit, and for a leg that is not near the vertical.
    """
    for name in ("angle 1", "angle 2"):
        raw = walk.quantities[name]
        if (largest := float(np.percentile(np.abs(raw), FAR_PERCENT))) > 2.0 * math.pi:
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
                "Angles must be from the vertical, positive with the foot ahead, in the right unit (--units). For "
                f'angles from the horizontal: --columns "{name}={walk.sources.get(name, name)}+90deg".',
            )
        walk = replace(walk, quantities={**walk.quantities, name: angle})
        if half_turns % 2:
            walk = add_doubt(
                walk, f"{name.capitalize()} is measured from the upward vertical, so 180 degrees are subtracted."
            )
    return walk


def swap_back(walk: RecordedWalk) -> RecordedWalk:
    """Swap the legs back where their angles are exchanged from one sample to the next."""
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
        kept = f"from time {walk.time_s[begin]:.6g} to {walk.time_s[end - 1]:.6g} s"
        doubt = (
            f"As if a sensor had slipped, there is a lasting jump: {spelled}. Only the longest part without one is "
            f"kept, {kept}."
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
    kept = f"the longest stretch one way, from time {walk.time_s[begin]:.6g} to {walk.time_s[end]:.6g} s, is kept"
    rows = np.arange(walk.time_s.size)
    return select_rows(
        add_doubt(walk, f"The walk turns round at time {spelled}: {kept}."), (begin <= rows) & (rows <= end)
    )


def find_ways(time: Array, angle: Array) -> list[Way]:
    """Divide a walk into stretches in one direction. A single passing of the legs the other way does not count."""
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
    """Return the sample between two stretches at which the hip turns round, or the middle sample without markers."""
    begin = before.passings[-1][1]
    end = after.passings[0][0]
    hip = walk.quantities.get(HIP_OF_LINES)
    if hip is None:
        return (begin + end) // 2
    return begin + int(np.argmax(hip[begin : end + 1] * (1.0 if before.forwards else -1.0)))
