"""Angles of lines between markers in the plane of the walk.

The walk is taken to be along the horizontal line on which the legs move most relative to each other. Which way it goes
along this line shows only when the legs pass each other (see `leg_angles`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.errors import ConfigError
from walkerlab.exchange.touches import Array, apart_runs

Line = tuple[Array, Array]
"""Positions (samples, axes) of the upper and the lower marker (m)."""

MAX_NAMED: Final = 3  # a message lists at most this many stretches of samples
MIN_JUMP: Final = 8.0  # smallest change of length that counts as a jump, in standard deviations of all changes
MIN_RELATIVE_JUMP: Final = 0.01  # smallest change that counts as a jump, as a fraction of the length
NEIGHBOURS: Final = 5  # a change is compared with the median of this many changes around it
MAX_VALUE: Final = 1e50  # values above this count as gaps, because their squares overflow
MIN_FROZEN: Final = 3  # minimum number of missing samples for which a marker counts as frozen
# a leap covers the motion of at most this many normal samples for each frozen sample before it
MAX_LEAP: Final = 1.5
LENGTH_PARTS: Final = 5  # number of parts of a walk in which leg lengths are compared
MAX_SLOW_CHANGE: Final = 0.02  # largest relative change of a leg's length along a walk
MAX_HIP_MOTION: Final = 0.02  # largest motion of two hip markers relative to each other, as a fraction of a leg
MAD_TO_DEVIATION: Final = 1.4826  # standard deviation over median absolute deviation in a normal distribution
PLANE_FITS: Final = 3
# The motion is running if the correlation of hip height with the distance between the feet is above this. In walking
# it is near -1.
RUNNING_CORRELATION: Final = 0.5
FEWEST_SWINGS: Final = 3
FEWEST_FOR_SWAPS: Final = 4
FAST_PERCENT: Final = 80  # motions between samples above this percentile count as fast
# Swapping two points back must lower the squared unevenness by at least this fraction of the squared fast motion.
MIN_EXCHANGE_GAIN: Final = 0.2
# It must also lower the squared unevenness by at least this multiple of its median.
MIN_SCATTER_RATIO: Final = 40.0


@dataclass(frozen=True, eq=False)
class WalkPlane:
    """Directions of a walk in the axes of its recording: unit vectors (axes,)."""

    up: Array
    ahead: Array

    def angle(self, line: Line) -> Array:
        """Return the angles (samples,) of a line from the vertical (rad), positive if the lower end is ahead."""
        across = line[1] - line[0]
        return np.asarray(np.arctan2(across @ self.ahead, np.abs(across @ self.up)))


def spell_rows(rows: NDArray[np.bool_]) -> str:
    """Describe the samples that `rows` (samples,) marks, by their numbers counted from 1."""
    return spell_samples(None, np.arange(1.0, rows.size + 1.0), rows)


def spell_samples(time: Array | None, numbers: Array, rows: NDArray[np.bool_]) -> str:
    """Describe the samples that `rows` (samples,) marks, by their numbers in the file and, if given, their times."""
    runs = apart_runs(rows, rows)
    places = []
    for first, last in runs[:MAX_NAMED]:
        alone = first == last
        place = f"sample {numbers[first]:.0f}" if alone else f"samples {numbers[first]:.0f} to {numbers[last]:.0f}"
        if time is not None:
            place += f" (time {time[first]:.6g}{'' if alone else f' to {time[last]:.6g}'} s)"
        places.append(place)
    return ", ".join(places) + (f" and {len(runs) - MAX_NAMED} more places" if len(runs) > MAX_NAMED else "")


def swapped_rows(time: Array, apart: Array) -> NDArray[np.bool_]:
    """Find the samples (samples,) at which two points are exchanged. They are at most half of all samples.

    Exchanges are chosen so that both points move as evenly as possible from sample to sample. An exchange counts only
    if it makes the motion more even than fast motion or scatter could explain.

    apart  (samples, axes) difference of the two points
    """
    if len(apart) < FEWEST_FOR_SWAPS or not apart.any():
        return np.zeros(len(apart), bool)
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]

    def uneven(before: Array, between: Array, after: Array) -> Array:
        away = between - (1.0 - share) * before - share * after
        return np.asarray(np.vecdot(away, away))

    before = apart[:-2]
    between = apart[1:-1]
    after = apart[2:]
    costs = [[uneven(first * before, between, last * after) for last in (1.0, -1.0)] for first in (1.0, -1.0)]
    fast = float(np.percentile(np.sum(np.diff(apart, axis=0) ** 2, axis=1), FAST_PERCENT))
    least = max(MIN_EXCHANGE_GAIN * fast, MIN_SCATTER_RATIO * float(np.median(costs[0][0])))
    # Exchanges in n consecutive samples change the unevenness of these samples only, and cost n - 1 times `least`. If
    # no stretch of samples could gain that much, there are no exchanges, and the slow search below is not needed.
    gains = np.pad(costs[0][0] - np.min(costs, axis=(0, 1)), 1)
    sums = np.append(0.0, np.cumsum(gains - least))
    if np.all(sums[2:] - np.minimum.accumulate(sums)[:-2] <= -least):
        return np.zeros(len(apart), bool)
    # Dynamic programming: lowest cost up to each interval between samples, without and with an exchange in it.
    stays = 0.0
    changes = least
    ways = list[tuple[bool, bool]]()
    for (no_no, no_yes), (yes_no, yes_yes) in np.array(costs).transpose(2, 0, 1).tolist():
        ways.append((changes + yes_no < stays + no_no, changes + yes_yes < stays + no_yes))
        stays, changes = min(stays + no_no, changes + yes_no), min(stays + no_yes, changes + yes_yes) + least
    exchanges = [changes < stays]
    for way in reversed(ways):
        exchanges.append(way[exchanges[-1]])
    swapped = np.append(0, np.cumsum(exchanges[::-1])) % 2 == 1
    swapped = swapped if np.mean(swapped) <= 0.5 else ~swapped
    mended = np.where(swapped[:, None], -apart, apart)
    rough = np.pad(uneven(mended[:-2], mended[1:-1], mended[2:]) > least, 1)
    for first, last in apart_runs(swapped, swapped):
        # If one of the two points has an outlier here, the points were not exchanged.
        if rough[max(first - 1, 0) : first + 1].any() or rough[last : last + 2].any():
            swapped[first : last + 1] = False
    return np.asarray(swapped)


def swap_lines_back(lines: Mapping[str, Line], numbers: Array, time: Array) -> tuple[dict[str, Line], list[str]]:
    """Undo exchanges between the markers of the two legs. Return the lines, and doubts about exchanged pairs."""
    mended = dict(lines)
    doubts = list[str]()
    for first, second in ((name, f"{name[:-1]}2") for name in lines if name.endswith(" 1")):
        if second not in lines:
            continue
        (top, bottom), (other_top, other_bottom) = mended[first], mended[second]
        rows = [swapped_rows(time, top - other_top), swapped_rows(time, bottom - other_bottom)]
        tops = rows[0][:, None]
        bottoms = rows[1][:, None]
        mended[first] = np.where(tops, other_top, top), np.where(bottoms, other_bottom, bottom)
        mended[second] = np.where(tops, top, other_top), np.where(bottoms, bottom, other_bottom)
        if (swapped := rows[0] | rows[1]).any():
            doubts.append(swap_doubt(time, numbers, swapped))
    return mended, doubts


def swap_doubt(time: Array, numbers: Array, swapped: NDArray[np.bool_]) -> str:
    return f"The legs are swapped at {spell_samples(time, numbers, swapped)}, and are swapped back there."


def legs_among(lines: Mapping[str, Line]) -> list[Line]:
    """Return the lines of the legs, or the first line if no leg is among them."""
    return [lines[name] for name in ("angle 1", "angle 2") if name in lines] or [next(iter(lines.values()))]


def find_plane(lines: Mapping[str, Line], walks: str) -> WalkPlane:
    """Find the plane of a walk from the lines between its markers.

    lines  line of each quantity, by name
    walks  direction in the view of the recording: left, right, away or towards. If empty, the direction in which the
           legs move most relative to each other is used, with the sign of the upper marker's drift
    """
    legs = legs_among(lines)
    upright = np.mean([np.mean(top - bottom, axis=0) for top, bottom in legs], axis=0)
    vertical = np.arange(upright.size) == np.argmax(np.abs(upright))
    up = vertical * np.sign(upright)
    if walks:
        return WalkPlane(up, stated_direction(walks, up))
    against = [bottom - top for top, bottom in legs]
    # One recorded leg may stand for both.
    two = len(legs) > 1 and not np.array_equal(against[0], against[1], equal_nan=True)
    motion = against[0] - (against[1] if two else 0.0)
    motion = (motion - np.mean(motion, axis=0)) * ~vertical
    for _ in range(PLANE_FITS):
        # The small term prefers horizontal directions even if the legs do not move.
        ahead, sideways = np.linalg.svd(motion.T @ motion + np.diag(1e-12 * ~vertical))[0].T[:2]
        # A marker that jumps sideways would otherwise turn the plane.
        off = np.abs(motion @ sideways - np.median(motion @ sideways))
        limit = MIN_JUMP * MAD_TO_DEVIATION * np.median(off) + MIN_RELATIVE_JUMP * np.ptp(motion @ ahead)
        motion = motion[off <= limit]
    drift = float((legs[0][0][-1] - legs[0][0][0]) @ ahead)
    return WalkPlane(up, ahead if drift > 0.0 else -ahead)


def stated_direction(walks: str, up: Array) -> Array:
    """Return the direction (axes,) of a walk that goes left, right, away or towards in the recording's view.

    Right is the first horizontal axis. Away is the horizontal direction that makes right, away and up a right-handed
    system.
    """
    upwards = np.append(up, 0.0)[:3]
    right = np.eye(3)[int(upwards[0] != 0.0)]
    away = np.cross(upwards, right)
    direction = {"right": right, "left": -right, "away": away, "towards": -away}[walks]
    if np.any(direction[up.size :]):
        raise ConfigError(f"walks: {walks}, but the markers have no depth coordinate.", "Use left or right.")
    return np.asarray(direction[: up.size])


def replace_unseen(
    columns: Mapping[str, Array], pairs: Sequence[tuple[str, str]]
) -> tuple[dict[str, Array], dict[str, str]]:
    """Mark the coordinates of unseen markers as gaps. Also return the reasons, by column.

    Programs write zeros, or some other value, for all coordinates of a marker that they did not see. A foot may also
    stand at the origin, so equal coordinates are a gap only if they give the line an unusual length.

    pairs  columns of both ends for each coordinate
    """
    ends = list(zip(*pairs, strict=True))
    places = [np.clip([columns[name] for name in names], -MAX_VALUE, MAX_VALUE) for names in ends]
    length = np.linalg.norm(places[1] - places[0], axis=0)
    seen = length[np.isfinite(length)]
    gaps = dict(columns)
    unseen = dict[str, str]()
    if not seen.size:
        return gaps, unseen
    usual = float(np.median(seen))
    allowed = max(MIN_JUMP * MAD_TO_DEVIATION * float(np.median(np.abs(seen - usual))), MIN_RELATIVE_JUMP * usual)
    for names, place in zip(ends, places, strict=True):
        alike = np.ptp(place, axis=0) == 0.0
        for first, last in apart_runs(alike, alike):
            alike[first : last + 1] = np.any(np.abs(length[first : last + 1] - usual) > allowed)
        if alike.any():
            value = ", ".join(f"{each:g}" for each in place[:, np.argmax(alike)])
            unseen |= dict.fromkeys(names, f"({value}) is taken for 'not seen'")
            gaps |= {name: np.where(alike, np.nan, gaps[name]) for name in names}
    return gaps, unseen


def frozen_rows(places: Array) -> NDArray[np.bool_]:
    """Find the samples (samples,) at which a frozen marker repeats its position (samples, axes) before it leaps.

    Software that fills gaps repeats the last position seen. The number of missing samples follows from the
    speed after the leap, because a foot may have stood still before the gap.
    """
    places = np.clip(places, -MAX_VALUE, MAX_VALUE)
    change = np.linalg.norm(np.diff(places, axis=0, append=places[-1:]), axis=1)
    still = np.append(False, change[:-1] == 0.0)
    frozen = np.zeros(len(places), bool)
    for first, last in apart_runs(still, still):
        pace = float(np.max(change[last + 1 : last + 3], initial=0.0))
        missing = change[last] / pace - 1.0 if pace > 0.0 else 0.0
        if MIN_FROZEN <= missing <= MAX_LEAP * (last - first + 1):
            frozen[max(first, last + 1 - round(MAX_LEAP * missing)) : last + 1] = True
    return frozen


def body_gaps(lines: Mapping[str, Line], numbers: Array, time: Array) -> tuple[NDArray[np.bool_], list[str]]:
    """Find the samples at which a marker freezes, or at which the length of a line jumps and returns. Also return
    doubts.

    Legs are rigid and knees bend smoothly, so the length of a line never really jumps.
    """
    off = np.zeros(time.size, bool)
    doubts = []
    for name, (top, bottom) in lines.items():
        if (frozen := frozen_rows(top) | frozen_rows(bottom)).any():
            places = spell_samples(time, numbers, frozen)
            doubts.append(f"A marker of {name} stands still at {places}, which is left out.")
            off |= frozen
        length = np.linalg.norm(top - bottom, axis=1)
        if length.size <= NEIGHBOURS:
            continue
        change = np.diff(length)
        around = np.lib.stride_tricks.sliding_window_view(np.pad(change, NEIGHBOURS // 2, "edge"), NEIGHBOURS)
        sudden = change - np.median(around, axis=1)
        usual = float(np.median(np.abs(sudden)))
        limit = max(MIN_JUMP * MAD_TO_DEVIATION * usual, MIN_RELATIVE_JUMP * float(np.median(length)))
        jumps = np.flatnonzero(np.abs(sudden) > limit).tolist()
        brief = np.zeros(length.size, bool)
        lasting = np.zeros(length.size, bool)
        while jumps:
            first = jumps.pop(0)
            # Two jumps in opposite directions mean that the length changed briefly.
            if jumps and sudden[first] * sudden[jumps[0]] < 0.0:
                brief[first + 1 : jumps.pop(0) + 1] = True
            else:
                lasting[first + 1] = True
        if brief.any():
            doubts.append(f"The length of {name} is off at {spell_samples(time, numbers, brief)}, which is left out.")
        if lasting.any():
            places = spell_samples(time, numbers, lasting)
            doubts.append(f"The length of {name} jumps at {places}, and does not return.")
        off |= brief
    return off, doubts


def body_doubts(lines: Mapping[str, Line], plane: WalkPlane) -> list[str]:
    """Describe lines whose length changes slowly, and lines that do not meet at one hip."""
    doubts = []
    lengths = list[float]()
    for name, (top, bottom) in lines.items():
        length = np.linalg.norm(top - bottom, axis=1)
        parts = [float(np.median(part)) for part in np.array_split(length, min(LENGTH_PARTS, length.size))]
        scatter = MAD_TO_DEVIATION * float(np.median(np.abs(length - np.median(length))))
        lengths.append(float(np.median(length)))
        spread = max(parts) - min(parts)
        if spread > max(MAX_SLOW_CHANGE * lengths[-1], scatter):
            doubts.append(
                f"The length of {name} changes by {spread / lengths[-1]:.1%} along the walk: a marker moves on the "
                "leg, or the camera does not look square to the walk."
            )
    tops = [top @ np.stack([plane.ahead, plane.up], axis=1) for top, _ in lines.values()]
    apart = [np.std(tops[0] - top, axis=0).max() for top in tops[1:]]
    if apart and max(apart) > MAX_HIP_MOTION * lengths[0]:
        doubts.append(
            f"The upper ends of {' and '.join(lines)} move against each other by {max(apart) / lengths[0]:.1%} of a "
            "leg (r.m.s.), but a walker's legs meet at one hip: use one marker for both."
        )
    return doubts


def refuse_running(lines: Mapping[str, Line], plane: WalkPlane, source: str) -> None:
    """Raise ConfigError if the hip is lowest as the legs pass each other, as in running."""
    legs = legs_among(lines)
    if len(legs) < 2:
        return
    spread = (legs[0][1] - legs[1][1]) @ plane.ahead
    hip = np.mean([top @ plane.up for top, _ in legs], axis=0)
    if np.count_nonzero(np.diff(np.sign(spread - np.mean(spread)))) < FEWEST_SWINGS or not np.ptp(hip):
        return
    # On a slope the hip also sinks steadily, so remove the trend.
    trend = np.polynomial.Polynomial.fit(np.arange(hip.size), hip, 1)
    if float(np.corrcoef(hip - trend(np.arange(hip.size)), np.abs(spread))[0, 1]) > RUNNING_CORRELATION:
        raise ConfigError(
            f"{source}: the hip is lowest as the legs pass each other: this is running, not walking.",
            "The search for heel strikes assumes that one foot is always on the ground. Cut out the walking part.",
        )
