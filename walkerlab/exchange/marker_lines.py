"""Angles of lines between markers in the plane of the walk.

The walk goes along the horizontal line on which the legs move most against each other. Which way along it the feet go
ahead shows only as the legs pass each other, see `leg_angles`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.errors import ConfigError
from walkerlab.exchange.rate_jumps import Array, apart_runs

Line = tuple[Array, Array]
"""Places (samples, axes) of the upper and the lower marker (m)."""

NAMED: Final = 3  # number of stretches of samples that a doubt lists
JUMP: Final = 8.0  # change of a line's length between samples that is a jump, in standard deviations of all changes
SMALLEST_JUMP: Final = 0.01  # the same, as a fraction of the length
NEIGHBOURS: Final = 5  # number of changes whose median a jump differs from
NORMAL: Final = 1.4826  # standard deviation of a normal distribution, over its median absolute deviation
RUNNING: Final = 0.5  # correlation of the hip's height with the distance of the feet; near -1 in walking
FEWEST_SWINGS: Final = 3


@dataclass(frozen=True, eq=False)
class WalkPlane:
    """Directions of a walk in the axes of its recording: unit vectors (axes,)."""

    up: Array
    ahead: Array

    def angle(self, line: Line) -> Array:
        """Return the angles (samples,) of a line from the vertical (rad), positive if the lower end is ahead."""
        across = line[1] - line[0]
        return np.asarray(np.arctan2(across @ self.ahead, np.abs(across @ self.up)))


def spell_samples(time: Array, numbers: Array, rows: NDArray[np.bool_]) -> str:
    """Return in words the samples at `rows` (samples,), by their numbers in the file."""
    runs = apart_runs(rows, rows)
    places = [
        f"sample {numbers[first]:.0f} (time {time[first]:.6g} s)"
        if first == last
        else f"samples {numbers[first]:.0f} to {numbers[last]:.0f} (time {time[first]:.6g} to {time[last]:.6g} s)"
        for first, last in runs[:NAMED]
    ]
    return ", ".join(places) + (f" and {len(runs) - NAMED} more places" if len(runs) > NAMED else "")


def legs_among(lines: Mapping[str, Line]) -> list[Line]:
    """Return the lines of the legs, or the first line if no leg is among them."""
    return [lines[name] for name in ("angle 1", "angle 2") if name in lines] or [next(iter(lines.values()))]


def find_plane(lines: Mapping[str, Line], walks: str) -> WalkPlane:
    """Find the plane of a walk from the lines between its markers, by quantity.

    walks  left, right, away or towards, as the recording sees the walk; '' for the line on which the legs move most
           against each other, with the drift of the upper marker
    """
    legs = legs_among(lines)
    upright = np.mean([np.mean(top - bottom, axis=0) for top, bottom in legs], axis=0)
    vertical = np.arange(upright.size) == np.argmax(np.abs(upright))
    up = vertical * np.sign(upright)
    if walks:
        return WalkPlane(up, stated_direction(walks, up))
    against = [bottom - top for top, bottom in legs]
    two = len(legs) > 1 and not np.array_equal(against[0], against[1], equal_nan=True)  # one leg may stand for both
    motion = against[0] - (against[1] if two else 0.0)
    motion = (motion - np.mean(motion, axis=0)) * ~vertical
    ahead = np.linalg.svd(motion.T @ motion + np.diag(1e-12 * ~vertical))[0][:, 0]
    drift = float((legs[0][0][-1] - legs[0][0][0]) @ ahead)
    return WalkPlane(up, ahead if drift > 0.0 else -ahead)


def stated_direction(walks: str, up: Array) -> Array:
    """Return the direction (axes,) of a walk that goes left, right, away or towards in the recording's view.

    Right is the first horizontal axis. Away is across it and upwards, so that the three are right-handed.
    """
    upwards = np.append(up, 0.0)[:3]
    right = np.eye(3)[int(upwards[0] != 0.0)]
    away = np.cross(upwards, right)
    direction = {"right": right, "left": -right, "away": away, "towards": -away}[walks]
    if np.any(direction[up.size :]):
        raise ConfigError(f"walks: {walks}, but the markers have no depth.", "State left or right.")
    return np.asarray(direction[: up.size])


def unseen_as_gaps(columns: Mapping[str, Array], pairs: Sequence[tuple[str, str]]) -> dict[str, Array]:
    """Return columns with gaps where an end of a line lies at the origin and the line's length is not the usual one.

    Programs write zeros for a marker that they did not see, but a foot may well stand at the origin.

    pairs  columns of both ends for each coordinate
    """
    ends = list(zip(*pairs, strict=True))
    places = [np.stack([columns[name] for name in names], axis=1) for names in ends]
    length = np.linalg.norm(places[1] - places[0], axis=1)
    seen = length[np.isfinite(length)]
    if not seen.size:
        return dict(columns)
    usual = float(np.median(seen))
    allowed = max(JUMP * NORMAL * float(np.median(np.abs(seen - usual))), SMALLEST_JUMP * usual)
    gaps = dict(columns)
    for names, place in zip(ends, places, strict=True):
        zeros = np.all(place == 0.0, axis=1)
        for first, last in apart_runs(zeros, zeros):
            if np.any(np.abs(length[first : last + 1] - usual) > allowed):
                for name in names:
                    gaps[name] = np.concatenate(
                        (gaps[name][:first], np.full(last + 1 - first, np.nan), gaps[name][last + 1 :])
                    )
    return gaps


def length_doubts(lines: Mapping[str, Line], numbers: Array, time: Array) -> list[str]:
    """Name the samples at which the length of a leg jumps, because legs are rigid and knees bend smoothly."""
    doubts = []
    for name, (top, bottom) in lines.items():
        length = np.linalg.norm(top - bottom, axis=1)
        if length.size <= NEIGHBOURS:
            continue
        change = np.diff(length)
        around = np.lib.stride_tricks.sliding_window_view(np.pad(change, NEIGHBOURS // 2, "edge"), NEIGHBOURS)
        sudden = np.abs(change - np.median(around, axis=1))
        jumps = sudden > max(JUMP * NORMAL * float(np.median(sudden)), SMALLEST_JUMP * float(np.median(length)))
        if jumps.any():
            doubts.append(f"The length of {name} jumps at {spell_samples(time, numbers, np.append(False, jumps))}.")
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
    trend = np.polynomial.Polynomial.fit(np.arange(hip.size), hip, 1)
    if float(np.corrcoef(hip - trend(np.arange(hip.size)), np.abs(spread))[0, 1]) > RUNNING:
        raise ConfigError(
            f"{source}: the hip is lowest as the legs pass each other: this is running, not walking.",
            "Heel strikes are sought with one foot always on the ground. Cut the recording to its walking part.",
        )
