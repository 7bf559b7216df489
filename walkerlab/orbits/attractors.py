"""Attractors of a step map over a parameter, and their largest Lyapunov exponents.

The largest Lyapunov exponent is the mean logarithmic growth per step of a tangent vector under the step map's exact
derivative. Its uncertainty is the standard error of block means, each block several correlation times long; a walk with
too few blocks is repeated at twice the length. The uncertainty is at least 1/steps: slower growth cannot be resolved.

Source: Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980).
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from walkerlab.orbits.bifurcations import eigenvector
from walkerlab.orbits.families import Seed
from walkerlab.orbits.step_map import Cycle, StepMap
from walkerlab.outcome import Outcome
from walkerlab.solvers.system import Floats

LONGEST_PERIOD = 48  # steps; a gait of more steps is told as aperiodic
REPEATS = 1e-5  # distance of points that are called the same
NEARLY, CLOSER = 1e-3, 0.8  # distance of points that still come closer, and how much so from first to last third
ASIDE = 1e-2  # of a start from the unstable gait that it is to leave, as a share of the largest coordinate
BLOCKS, LEAST_BLOCKS, LENGTH_OF_BLOCKS = 64, 10, 5.0  # of a walk at most, at least; in times that correlations last
MAX_WALKS = 8  # for an exponent
DRIFT = 4.0  # of halves of a walk, in standard errors of the whole: two of their own
SMALLER_STEPS = 8
LOSS_HALVINGS = 6
CANDIDATES = 4  # near returns that are tried, of one number of steps


@dataclass(frozen=True, eq=False)
class Attractor:
    """The attractor of a walk at a value of the parameter.

    period     steps after which it repeats; 0 if aperiodic
    periods_s, angles  (kept,) of the steps on it
    last       (d,) a point on it
    """

    value: float
    period: int
    periods_s: Floats
    angles: Floats
    last: Floats


@dataclass(frozen=True)
class Lyapunov:
    """Largest Lyapunov exponent per step, with its standard error."""

    value: float
    exponent: float
    uncertainty: float


def may_part(exponents: Sequence[Lyapunov], value: float) -> bool:
    """Whether neighbours may diverge at a value: false if the nearest measured exponents are not positive."""
    below = [one for one in exponents if one.value <= value][-1:]
    above = [one for one in exponents if one.value >= value][:1]
    return not exponents or any(one.exponent > one.uncertainty for one in (*below, *above))


@dataclass(frozen=True, eq=False)
class AttractorBranch:
    """Attractors at successive values of the parameter, until the walk fails.

    lost_at, reason  first value at which the walk failed, and its outcome; None if it never did
    """

    found: tuple[Attractor, ...] = ()
    lost_at: float | None = None
    reason: str = ""


def period_of(points: Floats) -> int:
    """Return after how many steps points (steps, d) repeat or converge to a cycle; 0 if they do neither."""
    for period in range(1, min(LONGEST_PERIOD, points.shape[0] // 2) + 1):
        apart = np.max(np.abs(points[period:] - points[:-period]), axis=1)
        third = apart.size // 3
        before, after = apart[: third + 1].max(), apart[apart.size - third - 1 :].max()
        if apart.max() < REPEATS or (apart.max() < NEARLY and after < CLOSER * before):
            return period
    return 0


def settled(step_map: StepMap, z: Floats, value: float, transient: int, kept: int) -> Attractor | Outcome:
    """Return the attractor of a walk from z, or the outcome if it fails within `transient + kept` steps."""
    walk = step_map.iterate(z, value, transient + kept, None)
    if walk.outcome is not Outcome.WALKED:
        return walk.outcome
    points = walk.points[transient:]
    return Attractor(value, period_of(points), walk.periods_s[transient:], walk.angles[transient:], points[-1])


def swept(
    step_map: StepMap,
    z: Floats,
    values: Iterable[float],
    transient: int,
    kept: int,
    advance: Callable[[], None] = lambda: None,
) -> AttractorBranch:
    """Follow the attractor that contains z at the first value from value to value.

    If a walk from one attractor does not settle at the next value, smaller steps are tried. The value at which the
    attractor is lost is narrowed by halving, so that it does not depend on the grid of values.
    """
    found: list[Attractor] = []
    for value in values:
        here = settled(step_map, z, float(value), transient, kept)
        if isinstance(here, Outcome) and found:
            for between in np.linspace(found[-1].value, float(value), SMALLER_STEPS + 1)[1:]:
                here = settled(step_map, z, float(between), transient, kept)
                if isinstance(here, Outcome):
                    break
                z = here.last
        advance()
        if isinstance(here, Outcome):
            lost = float(value)
            for _ in range(LOSS_HALVINGS if found else 0):
                middle = 0.5 * (found[-1].value + lost)
                there = settled(step_map, found[-1].last, middle, transient, kept)
                if isinstance(there, Outcome):
                    lost, here = middle, there
                else:
                    found.append(there)
            return AttractorBranch(tuple(found), lost, here.label)
        found.append(here)
        z = here.last
    return AttractorBranch(tuple(found), None, "")


def left_by_flip(step_map: StepMap, gait: Cycle, transient: int, kept: int) -> Attractor | Outcome:
    """Return the attractor of a walk that leaves an unstable gait along its flip direction."""
    flipping = min(gait.multipliers.real)
    aside = ASIDE * np.max(np.abs(gait.z)) * eigenvector(gait.DP, flipping)
    return settled(step_map, gait.z + aside, gait.value, transient, kept)


def largest_exponent(step_map: StepMap, z: Floats, value: float, transient: int, steps: int) -> Lyapunov | None:
    """Return the largest Lyapunov exponent of the attractor of a walk from z; None if the walk fails.

    transient  steps that turn the tangent into the direction of fastest growth
    steps      to average over

    Just beyond a flip a walk leaves the unstable gait as slowly as its tangent grows. A walk that repeats while its
    tangent grows is therefore pushed off the gait, and one whose halves differ is continued.
    """
    for _ in range(MAX_WALKS):
        walk = step_map.iterate(z, value, transient + steps, np.full(z.size, 1.0 / math.sqrt(z.size)))
        if walk.outcome is not Outcome.WALKED:
            return None
        growth = np.log(np.maximum(walk.lengths[transient:], np.finfo(float).tiny))
        repeats = period_of(walk.points[transient:]) > 0
        blocks = LEAST_BLOCKS if repeats else min(BLOCKS, independent_blocks(growth))
        exponent, error = float(growth.mean()), standard_error(growth, max(LEAST_BLOCKS, blocks))
        drift = abs(float(growth[: steps // 2].mean() - growth[steps // 2 :].mean()))
        if repeats and exponent <= 0.0 and drift < 1.0 / steps:
            break
        error = max(error, 1.0 / steps)
        if not repeats and drift < DRIFT * error and blocks >= LEAST_BLOCKS:
            break
        steps *= 1 + (blocks < LEAST_BLOCKS)
        z = (1.0 + ASIDE * (repeats and exponent > 0.0)) * walk.points[-1]
    return Lyapunov(value, exponent, error)


def independent_blocks(series: Floats) -> int:
    """Return how many blocks of several correlation times a series (n,) holds.

    The correlation time sums the autocorrelation over all lags before the first that is not positive.
    """
    off = series - series.mean()
    spectrum = np.abs(np.fft.rfft(off, 2 * off.size)) ** 2
    correlation = np.fft.irfft(spectrum)[: off.size]
    lags = int(np.argmax(correlation <= 0.0)) or off.size
    lasting = 2.0 * correlation[:lags].sum() / correlation[0] - 1.0
    return int(series.size / (LENGTH_OF_BLOCKS * lasting))


def standard_error(series: Floats, blocks: int) -> float:
    """Return the standard error of a series' mean, from the means of its blocks."""
    means = np.array([block.mean() for block in np.array_split(series, blocks)])
    return float(means.std(ddof=1)) / math.sqrt(blocks)


def feigenbaum_ratios(flips: list[float]) -> list[float]:
    """Return ratios of successive distances between the flips of a cascade; they tend to 4.669."""
    gaps = np.diff(np.array(flips))
    return [float(one / other) for one, other in pairwise(gaps)]


def close_returns(step_map: StepMap, attractor: Attractor, periods: Iterable[int], steps: int) -> list[Seed]:
    """Return points of an attractor that nearly repeat after given periods, as seeds of unstable gaits.

    steps  length of the walk to search
    """
    walk = step_map.iterate(attractor.last, attractor.value, steps, None)
    points, found = walk.points, []
    for period in periods:
        if points.shape[0] <= period:
            continue
        misses = np.linalg.norm(points[period:] - points[:-period], axis=1)
        for _ in range(CANDIDATES):
            nearest = int(np.argmin(misses))
            found.append(Seed(points[nearest], attractor.value, period))
            misses[max(0, nearest - 2 * period) : nearest + 2 * period] = np.inf
    return found


def settled_elsewhere(
    step_map: StepMap, attractor: Attractor, starts: int, spread: float, transient: int, generator: np.random.Generator
) -> list[Seed]:
    """Return other periodic gaits that walks from scattered starts near an attractor settle on.

    starts  number of walks
    spread  standard deviation of the starts' coordinates, as a share of the largest coordinate
    """
    found: list[Seed] = []
    periods = {attractor.period}
    scale = spread * float(np.max(np.abs(attractor.last)))
    for _ in range(starts):
        start = attractor.last + scale * generator.standard_normal(attractor.last.size)
        here = settled(step_map, start, attractor.value, transient, 2 * LONGEST_PERIOD)
        if not isinstance(here, Outcome) and here.period and here.period not in periods:
            periods.add(here.period)
            found.append(Seed(here.last, attractor.value, here.period))
    return found
