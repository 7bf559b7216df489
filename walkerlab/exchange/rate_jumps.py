"""Find the sum of the leg angles at heel strike from the jumps in their rates.

Measured from the slope's normal, the leg angles are opposite at heel strike, where their rates jump. An error in slope
or sensor offset makes the measured sum at these jumps non-zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

Array = NDArray[np.float64]

NORMAL_QUARTILE: Final = 0.6745  # median absolute value of a normal variable with standard deviation 1
WINDOW_AHEAD: Final = 0.4
"""Smallest angle between the legs at a heel strike, as a fraction of the largest during the walk."""
WINDOW: Final = 0.1
"""Time before and after a heel strike in which angles are fitted, as a fraction of the step period."""
MAX_RUNS: Final = 20  # maximum number of stretches with one leg far ahead that are searched for jumps
WINDOW_SAMPLES: Final = 60  # windows with more samples are thinned towards this number
SAMPLES_ON_A_SIDE: Final = 4  # minimum number of samples for a fit, before and after an instant
DEGREE: Final = 3
MIN_SCATTER: Final = 1e-12  # lower limit of the squared scatter, as a fraction of the sum of squared angles
SUMS: Final = np.round(np.arange(-0.12, 0.121, 0.01), 2)  # rad, trial values of the sum
MOST_FOUND: Final = 4
RIDGE: Final = 1e-15  # relative; without it, samples at nearly equal times would make equations singular


def sums_at_jumps(time: Array, angle: Array, total: Callable[[Array], Array]) -> list[float]:
    """Return likely sums (rad) of the leg angles at heel strikes, where the leg rates jump. Clearest jumps come first.

    time   (samples,) s
    angle  (samples, 2) rad, from the vertical
    total  function from angles (samples, 2), from the vertical, to their sum (samples,), from the slope's normal
    """
    spread = angle[:, 0] - angle[:, 1]
    sums = total(angle)
    runs = apart_runs(np.abs(spread) > WINDOW_AHEAD * np.abs(spread).max(), spread > 0.0)
    half = WINDOW * typical_interval([0.5 * (time[first] + time[last]) for first, last in runs], time)
    evidence = np.array([evidence_for(time, angle, sums - tried, runs[:MAX_RUNS], half) for tried in SUMS])
    padded = np.concatenate(([0.0], evidence, [0.0]))
    # The comparisons differ, so that only the first of equal neighbours is a peak.
    peaks = np.flatnonzero((evidence > padded[:-2]) & (evidence >= padded[2:]))
    return [float(SUMS[peak]) for peak in peaks[np.argsort(-evidence[peaks])][:MOST_FOUND]]


def evidence_for(time: Array, angle: Array, over: Array, runs: Sequence[tuple[int, int]], half: float) -> float:
    """Return the squared scatter of the angles that rate jumps explain, over the variance that remains.

    over  (samples,) rad, sum of the angles minus the sum to try
    runs  pairs of first and last samples; a jump is fitted in each, at the last instant at which `over` falls through 0
    """
    jumps = []
    for first, last in runs:
        falls = first + np.flatnonzero((over[first:last] > 0.0) & (over[first + 1 : last + 1] <= 0.0))
        if not falls.size:
            continue
        row = int(falls[-1])
        share = over[row] / (over[row] - over[row + 1])
        jumps.append(jump_at(time, angle, float(time[row] + share * (time[row + 1] - time[row])), half))
    fitted = [jump for jump in jumps if jump is not None]
    if not fitted:
        return 0.0
    reductions, scatters, freedoms = (np.array(column) for column in zip(*fitted, strict=True))
    return float(reductions.sum() * freedoms.sum() / scatters.sum())


def apart_runs(apart: NDArray[np.bool_], first_ahead: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and last sample of each stretch in which one leg stays far ahead of the other."""
    kind = np.where(apart, np.where(first_ahead, 1, -1), 0)
    bounds = np.flatnonzero(np.diff(kind)) + 1
    edges = zip((0, *bounds.tolist()), (*bounds.tolist(), kind.size), strict=True)
    return [(begin, end - 1) for begin, end in edges if kind[begin]]


def noise_of(angle: Array) -> float:
    """Return the standard deviation (rad) of the scatter of angles (samples, 2) from sample to sample."""
    # In third differences the smooth motion hardly shows. Their variance is 20 times that of the noise.
    return (
        float(np.median(np.abs(np.diff(angle, 3, axis=0)))) / (NORMAL_QUARTILE * 20.0**0.5) if len(angle) > 3 else 0.0
    )


def typical_interval(instants: Sequence[float], time: Array) -> float:
    """Return the median interval (s) between instants of a recording, or its duration if there are fewer than two."""
    return float(np.median(np.diff(instants))) if len(instants) > 1 else float(time[-1] - time[0])


def squares_around(
    parts: Sequence[tuple[Array, Array]], instants: Array, degree: int, samples_per_degree: int = 1
) -> Array:
    """Return the squared residuals (parts, instants) of polynomials before and after each instant that meet there.

    parts               times (samples,), rising, and values (samples, legs) of each part of a recording
    instants            (parts, instants) rising along each row
    degree              highest degree of the polynomials
    samples_per_degree  number of samples of a side that it needs for each degree above 1
    """
    counts = np.array([np.searchsorted(t, row) for (t, _), row in zip(parts, instants, strict=True)])
    rest = np.array([[t.size] for t, _ in parts]) - counts
    degrees = np.minimum(degree, 1 + np.stack((counts, rest)) // samples_per_degree)
    before = squares_before(parts, instants, counts, degrees[0])
    # The fit after an instant is a fit before it with time reversed.
    mirrored = [(-t[::-1], y[::-1]) for t, y in parts]
    after = [
        values[:, ::-1] for values in squares_before(mirrored, -instants[:, ::-1], rest[:, ::-1], degrees[1, :, ::-1])
    ]
    # Making both sides meet adds their squared gap over the sum of the variances of both values.
    gaps = np.sum((before[1] - after[1]) ** 2, axis=2)
    return np.asarray(before[0] + after[0] + gaps / (before[2] + after[2]))


def squares_before(
    parts: Sequence[tuple[Array, Array]], instants: Array, counts: NDArray[np.int64], degrees: NDArray[np.int64]
) -> tuple[Array, Array, Array]:
    """Fit polynomials to the first `counts` samples of each part, for each instant.

    Returns the squared residuals (parts, instants), values at the instants (parts, instants, legs), and the variance
    (parts, instants) of such a value if that of the samples is 1.
    """
    degree = int(degrees.max())
    each = zip(parts, instants, counts, strict=True)
    products, bases = zip(*(products_of(part, row, ends, degree) for part, row, ends in each), strict=True)
    # All instants of a part share these sums, so each one costs only the solution of a few equations.
    moments = np.cumsum(products, axis=1)
    at = np.array(bases)
    used = (np.arange(degree + 1) <= degrees[..., None]) & (counts[..., None] > 1)
    square = moments[..., : degree + 1, : degree + 1] * (used[..., :, None] & used[..., None, :])
    # Each unused coefficient gets an equation that makes it zero, since otherwise the matrix would be singular.
    square += np.eye(degree + 1) * (~used + RIDGE * counts[..., None])[..., None]
    right = np.concatenate((moments[..., : degree + 1, degree + 1 :], at[..., None]), axis=-1) * used[..., None]
    solution = np.linalg.solve(square, right)
    explained = np.sum(right * solution, axis=-2)
    total = np.trace(moments[..., degree + 1 :, degree + 1 :], axis1=-2, axis2=-1)
    fitted = counts > 1
    squares = np.where(fitted, np.maximum(total - np.sum(explained[..., :-1], axis=-1), 0.0), 0.0)
    values = np.sum(right[..., -1:] * solution[..., :-1], axis=-2)
    # A side without a fit can have any value at the instant. With an infinite variance its gap costs nothing.
    return squares, values, np.where(fitted, explained[..., -1], np.inf)


def products_of(
    part: tuple[Array, Array], instants: Array, counts: NDArray[np.int64], degree: int
) -> tuple[list[Array], Array]:
    """Return the products of polynomials and values, summed between samples, and the polynomials at the instants.

    counts  (instants,) samples up to which each sum extends, from the one before
    """
    end = int(counts.max())
    first, last = part[0][0], max(part[0][end - 1], instants.max())
    times = np.concatenate((part[0][:end], instants))
    # Chebyshev polynomials, because powers would make the normal equations too ill-conditioned.
    basis = chebvander(2.0 * (times - first) / (last - first or 1.0) - 1.0, degree)
    columns = np.concatenate((basis[:end], part[1][:end]), axis=1)
    return [columns[a:b].T @ columns[a:b] for a, b in pairwise([0, *counts.tolist()])], basis[end:]


def jump_at(time: Array, angle: Array, instant: float, half: float) -> tuple[float, float, int] | None:
    """Fit a rate jump at an instant. Return the explained and residual sums of squares, and the degrees of freedom.

    Returns None if there are too few samples before or after the instant.
    """
    first, last = np.searchsorted(time, (instant - half, instant + half))
    rows = slice(int(first), int(last), max(1, int(last - first) // WINDOW_SAMPLES))
    t, y = (time[rows] - instant) / half, angle[rows]
    if np.count_nonzero(t < 0.0) < SAMPLES_ON_A_SIDE or np.count_nonzero(t > 0.0) < SAMPLES_ON_A_SIDE:
        return None
    # The kink comes last, so that its orthonormal column is the part that the cubic cannot follow.
    basis = np.linalg.qr(np.column_stack((t[:, None] ** np.arange(DEGREE + 1), np.maximum(t, 0.0))))[0]
    shares = basis.T @ y
    residual = float((y**2).sum() - (shares**2).sum())
    return float((shares[-1] ** 2).sum()), max(residual, MIN_SCATTER * float((y**2).sum())), y.size - shares.size
