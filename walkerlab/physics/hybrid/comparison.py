"""Differences between two walks: at equal times, at equal phases of each step, and as orbits in the phase plane.

A frequency error of one percent makes the difference at equal times grow without bound, however similar the gaits. The
other two differences do not depend on the frequency.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

Array = NDArray[np.float64]
Quantity = Literal["angle", "velocity"]

LEG_COUNT = 2
JUMP = 1e-9  # fraction of a walk's duration; samples closer than this are the two sides of a strike
PHASES = 401  # samples per step
IMPACT_PHASE = 0.02  # phase at which a compliant impact is over
POINT_SPACING = 5e-3  # spacing of the points of an orbit, relative to its range
BLOCK_POINTS = 256  # points per block, which limits the memory


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the legs over time, in SI units."""

    time: Array  # (samples,) strictly rising
    angle: Array  # (samples, leg)
    velocity: Array  # (samples, leg)
    # (steps,) times of the heel strikes or touches that end the steps; the first step begins at time[0]
    step_ends: Array
    # (strikes,) times at which a knee locks and velocities jump; empty without knees
    knee_strikes: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def steps(self) -> int:
        return int(self.step_ends.size)

    @cached_property
    def _first_samples(self) -> NDArray[np.int64]:
        """Indices of the first samples of smooth pieces: the start, and the sample after each jump of velocities."""
        close = np.diff(self.time) < JUMP * (self.time[-1] - self.time[0])
        return np.concatenate(([0], np.flatnonzero(close) + 1))

    @cached_property
    def _pieces(self) -> list[tuple[CubicHermiteSpline, PchipInterpolator]]:
        """Interpolants of each smooth piece: Hermite splines of the angles, monotone splines of the velocities."""
        # Monotone splines do not overshoot at an impact.
        ends = (*self._first_samples[1:], self.time.size)
        pieces = []
        for first, end in zip(self._first_samples, ends, strict=True):
            # A single sample cannot be interpolated, so it is joined with the one before it.
            span = slice(first, end) if end - first > 1 else slice(max(first - 1, 0), first + 1)
            time = self.time[span]
            velocity = self.velocity[span]
            pieces.append((CubicHermiteSpline(time, self.angle[span], velocity), PchipInterpolator(time, velocity)))
        return pieces

    def values_at(self, times: Array) -> tuple[Array, Array]:
        """Compute angles and velocities (times, leg) at times (s). At a heel strike, return those just after it."""
        angle = np.empty((times.size, LEG_COUNT))
        velocity = np.empty((times.size, LEG_COUNT))
        piece_of = np.searchsorted(self.time[self._first_samples], times, side="right") - 1
        for index in np.unique(piece_of):
            inside = piece_of == index
            angle_piece, velocity_piece = self._pieces[index]
            angle[inside], velocity[inside] = angle_piece(times[inside]), velocity_piece(times[inside])
        return angle, velocity

    def last_before(self, end: float) -> float:
        """Return the time (s) of the last sample before a jump at `end`, or `end` itself if there is no jump."""
        index = int(np.searchsorted(self.time, end))
        if index < self.time.size and self.time[index] == end and index in self._first_samples[1:]:
            return float(self.time[index - 1])
        return end

    def values_during(self, step: int, phases: Array) -> tuple[Array, Array]:
        """Compute angles and velocities (phases, leg) of a step. Phase 0 is after an impact, 1 before the next one."""
        start, end = self.span(step)
        return self.values_at(np.minimum(start + phases * (end - start), self.last_before(end)))

    def span(self, step: int) -> tuple[float, float]:
        """Return the start and end of a step (s)."""
        return float(self.time[0] if step == 0 else self.step_ends[step - 1]), float(self.step_ends[step])

    def knee_phases(self, step: int) -> Array:
        """Return the phases (strikes,) of a step at which a knee locks."""
        start, end = self.span(step)
        inside = self.knee_strikes[(self.knee_strikes > start) & (self.knee_strikes < end)]
        return (inside - start) / (end - start)

    def last_stride(self) -> Motion:
        """Cut out the last two completed steps, with the impacts before them.

        Raises ValueError if there are fewer.
        """
        if self.steps < 2:
            raise ValueError("no stride was completed")
        start = self.time[0] if self.steps == 2 else self.last_before(self.step_ends[-3])
        end = self.last_before(self.step_ends[-1])
        inside = self.time[(self.time > start) & (self.time < end)]
        time = np.concatenate(([start], inside, [end]))
        angle, velocity = self.values_at(time)
        return replace(self, time=time, angle=angle, velocity=velocity, step_ends=self.step_ends[-2:])


def add_strike_samples(motion: Motion) -> Motion:
    """Add missing samples, by extrapolation, at the end of every step and on both sides of every knee strike."""
    # A compliant impact or an ideal lock is shorter than the sampling interval: interpolation across it would smear the
    # jump.
    side = 0.5 * JUMP * (motion.time[-1] - motion.time[0])
    added = [
        (end, slice(index - 3, index))
        for end in motion.step_ends
        if end not in motion.time and (index := np.searchsorted(motion.time, end)) >= 3
    ]
    for strike in motion.knee_strikes:
        index = np.searchsorted(motion.time, strike)
        # Extrapolation from both sides needs three samples on each.
        if 3 <= index <= motion.time.size - 3 and strike not in motion.time:
            added += [(strike - side, slice(index - 3, index)), (strike, slice(index, index + 3))]
    strikes = np.concatenate((motion.step_ends, motion.knee_strikes))
    added = [(t, near) for t, near in added if not jumps_among(motion.time[near], t, strikes, 2.0 * side)]
    if not added:
        return motion
    rows = [extrapolate(motion, near, t) for t, near in added]
    time = np.concatenate((motion.time, [t for t, _ in added]))
    order = np.argsort(time)
    angle = np.concatenate((motion.angle, [row[0] for row in rows]))
    velocity = np.concatenate((motion.velocity, [row[1] for row in rows]))
    return replace(motion, time=time[order], angle=angle[order], velocity=velocity[order])


def jumps_among(times: Array, time: float, strikes: Array, close: float) -> bool:
    """Whether a strike occurs between any of `times` and `time`. Strikes within `close` (s) of `time` do not count."""
    between = (strikes > min(times[0], time)) & (strikes < max(times[-1], time)) & (np.abs(strikes - time) > close)
    return bool(between.any())


def extrapolate(motion: Motion, samples: slice, time: float) -> tuple[Array, Array]:
    """Extrapolate angles and velocities (leg,) to `time` (s) with a parabola through three samples."""
    times = motion.time[samples]
    weights = [np.prod([(time - other) / (node - other) for other in times if other != node]) for node in times]
    return np.asarray(weights @ motion.angle[samples]), np.asarray(weights @ motion.velocity[samples])


@dataclass(frozen=True, eq=False)
class WalkDifference:
    """Difference of two walks over time, or over steps and phases. The last axis is the leg."""

    angle: Array
    velocity: Array

    def largest(self, of: Quantity) -> list[float]:
        """Return the largest absolute difference (leg,) in angle (rad) or velocity (rad/s)."""
        largest: list[float] = np.abs(getattr(self, of)).reshape(-1, LEG_COUNT).max(axis=0).tolist()
        return largest


def difference_in_time(walk: Motion, reference: Motion) -> tuple[Array, WalkDifference]:
    """Return all sample times (s) at which both walks are under way, and `walk` minus `reference` at these times."""
    time = np.union1d(walk.time, reference.time)
    time = time[(time >= max(walk.time[0], reference.time[0])) & (time <= min(walk.time[-1], reference.time[-1]))]
    angle, velocity = walk.values_at(time)
    reference_angle, reference_velocity = reference.values_at(time)
    return time, WalkDifference(angle - reference_angle, velocity - reference_velocity)


def difference_in_phase(walk: Motion, reference: Motion, phases: Array) -> WalkDifference:
    """Compute `walk` minus `reference` (step, phase, leg) in the steps that both completed.

    Raises ValueError if either took no step.
    """
    steps = min(walk.steps, reference.steps)
    if steps == 0:
        raise ValueError("no step was completed by both")
    pairs = [(walk.values_during(step, phases), reference.values_during(step, phases)) for step in range(steps)]
    angle = np.stack([ours[0] - theirs[0] for ours, theirs in pairs])
    velocity = np.stack([ours[1] - theirs[1] for ours, theirs in pairs])
    return WalkDifference(angle, velocity)


def smooth_phases(walk: Motion, reference: Motion, phases: Array) -> NDArray[np.bool_]:
    """Mark the phases (step, phase) at which both walks are smooth.

    These are all phases after the impact, except those between the times at which the two walks reach the same knee
    strike.
    """
    # Between the two knee strikes the velocities differ by the whole jump, however similar the walks are.
    clear = np.tile(phases >= IMPACT_PHASE, (min(walk.steps, reference.steps), 1))
    for step, row in enumerate(clear):
        strikes = walk.knee_phases(step)
        others = reference.knee_phases(step)
        if strikes.size == others.size:
            for pair in zip(strikes, others, strict=True):
                # `row` is a view, so this also changes `clear`.
                row &= (phases < min(pair)) | (phases > max(pair))
    return clear


def orbit_distances(walk: Motion, reference: Motion) -> Array:
    """Compute the symmetric Hausdorff distance (leg,) between the orbits of the last strides in the phase plane.

    Each axis is scaled by the reference orbit's range. Raises ValueError if either walk completed no stride.
    """
    stride = walk.last_stride()
    reference_stride = reference.last_stride()
    distances = np.empty(LEG_COUNT)
    for leg in range(LEG_COUNT):
        orbit = phase_plane(stride, leg)
        reference_orbit = phase_plane(reference_stride, leg)
        scale = np.ptp(reference_orbit, axis=0)
        distances[leg] = hausdorff(orbit / scale, reference_orbit / scale)
    return distances


def phase_plane(motion: Motion, leg: int) -> Array:
    return np.column_stack((motion.angle[:, leg], motion.velocity[:, leg]))


def hausdorff(curve: Array, reference: Array) -> float:
    """Compute the largest distance from a point on either polyline (points, 2) to the other polyline."""
    return max(farthest_distance(refine(curve), reference), farthest_distance(refine(reference), curve))


def refine(curve: Array) -> Array:
    """Insert points into a polyline (points, 2) so that neighbours are at most POINT_SPACING apart."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))))
    points = np.union1d(along, np.linspace(0.0, along[-1], int(along[-1] / POINT_SPACING) + 2))
    return np.column_stack([np.interp(points, along, axis) for axis in curve.T])


def farthest_distance(points: Array, polyline: Array) -> float:
    """Compute the largest distance from one of the points (n, 2) to the polyline (m, 2)."""
    # x and y are kept in separate arrays: a sum over an axis of length two is several times slower.
    (start_x, start_y), (edge_x, edge_y) = polyline[:-1].T, np.diff(polyline, axis=0).T
    # A repeated point makes an edge of length zero.
    length_squared = np.maximum(edge_x**2 + edge_y**2, np.finfo(float).tiny)
    largest = 0.0
    for first in range(0, len(points), BLOCK_POINTS):
        x, y = points[first : first + BLOCK_POINTS].T[:, :, None]
        away_x = x - start_x
        away_y = y - start_y
        fraction = np.clip((away_x * edge_x + away_y * edge_y) / length_squared, 0.0, 1.0)
        squared = (away_x - fraction * edge_x) ** 2 + (away_y - fraction * edge_y) ** 2
        largest = max(largest, float(np.sqrt(squared.min(axis=1).max())))
    return largest
