"""Attractors of a step map over a parameter, and their largest Lyapunov exponents.

The largest Lyapunov exponent is the mean logarithmic growth per step of a tangent vector. Its uncertainty, at least
1/steps, is the standard error of means over blocks of several correlation times. Walks with few blocks are continued.

Source: Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980).
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.bifurcations import eigenvector
from walkerlab.physics.orbits.families import Seed
from walkerlab.physics.orbits.step_map import Cycle, StepMap
from walkerlab.physics.solvers.system import Floats

MAX_PERIOD = 48  # steps; longer cycles count as aperiodic
REPEAT_DISTANCE = 1e-5  # points closer than this count as equal
# a walk converges to a cycle if points a period apart are closer than NEAR_REPEAT, and if the largest such distance in
# the last third of the walk is below MAX_APPROACH_RATIO times that in the first third
NEAR_REPEAT = 1e-3
MAX_APPROACH_RATIO = 0.8
GAIT_OFFSET = 1e-2  # offset from an unstable gait, as a fraction of the largest coordinate
MAX_BLOCKS = 64  # blocks per walk
MIN_BLOCKS = 10
BLOCK_LENGTH = 5.0  # length of a block, in correlation times
MAX_WALKS = 8  # maximum number of walks per exponent
# Largest difference between the means of a walk's halves, in standard errors of the whole walk's mean. The standard
# error of the difference is twice as large.
MAX_DRIFT = 4.0
SUBSTEPS = 8
LOSS_HALVINGS = 6
MAX_CLOSE_RETURNS = 4  # maximum number of seeds per period


@dataclass(frozen=True, eq=False)
class Attractor:
    value: float
    period: int  # steps after which the attractor repeats; 0 if it is aperiodic
    periods_s: Floats  # (steps,) durations of the attractor's steps
    angles: Floats  # (steps,) rad, as in `MappedStep`
    last: Floats  # (d,) last point of the walk on the attractor


@dataclass(frozen=True)
class Lyapunov:
    value: float
    exponent: float
    uncertainty: float


def may_diverge(exponents: Sequence[Lyapunov], value: float) -> bool:
    """Whether neighbouring walks may diverge at a parameter value: false if the nearest exponents are not positive."""
    below = [exponent for exponent in exponents if exponent.value <= value][-1:]
    above = [exponent for exponent in exponents if exponent.value >= value][:1]
    return not exponents or any(exponent.exponent > exponent.uncertainty for exponent in (*below, *above))


@dataclass(frozen=True, eq=False)
class AttractorBranch:
    """Attractors at successive values of the parameter, up to the value at which the walk fails."""

    found: tuple[Attractor, ...] = ()
    lost_at: float | None = None  # first value at which the walk failed; None if it never failed
    reason: str = ""  # outcome of the failed walk


def find_period(points: Floats) -> int:
    """Return the number of steps after which points (steps, d) repeat or converge to a cycle, or 0 if they never do."""
    for period in range(1, min(MAX_PERIOD, points.shape[0] // 2) + 1):
        apart = np.max(np.abs(points[period:] - points[:-period]), axis=1)
        third = apart.size // 3
        before, after = apart[: third + 1].max(), apart[apart.size - third - 1 :].max()
        if apart.max() < REPEAT_DISTANCE or (apart.max() < NEAR_REPEAT and after < MAX_APPROACH_RATIO * before):
            return period
    return 0


def settle(step_map: StepMap, z: Floats, value: float, transient: int, steps: int) -> Attractor | Outcome:
    """Return the attractor that a walk from z reaches, or its outcome if it fails within `transient + steps` steps."""
    walk = step_map.iterate(z, value, transient + steps, None)
    if walk.outcome is not Outcome.WALKED:
        return walk.outcome
    points = walk.points[transient:]
    return Attractor(value, find_period(points), walk.periods_s[transient:], walk.angles[transient:], points[-1])


def sweep_attractor(
    step_map: StepMap,
    z: Floats,
    values: Iterable[float],
    transient: int,
    steps: int,
    advance: Callable[[], None] = lambda: None,
) -> AttractorBranch:
    """Follow the attractor reached from z over successive values of the parameter until it is lost."""
    # Bisection locates the value at which the attractor is lost, so that it does not depend on the grid of values.
    attractors: list[Attractor] = []
    for value in values:
        settled = settle(step_map, z, float(value), transient, steps)
        if isinstance(settled, Outcome) and attractors:
            for between in np.linspace(attractors[-1].value, float(value), SUBSTEPS + 1)[1:]:
                settled = settle(step_map, z, float(between), transient, steps)
                if isinstance(settled, Outcome):
                    break
                z = settled.last
        advance()
        if isinstance(settled, Outcome):
            lost = float(value)
            for _ in range(LOSS_HALVINGS if attractors else 0):
                middle = 0.5 * (attractors[-1].value + lost)
                halfway = settle(step_map, attractors[-1].last, middle, transient, steps)
                if isinstance(halfway, Outcome):
                    lost = middle
                    settled = halfway
                else:
                    attractors.append(halfway)
            return AttractorBranch(tuple(attractors), lost, settled.label)
        attractors.append(settled)
        z = settled.last
    return AttractorBranch(tuple(attractors), None, "")


def leave_by_flip(step_map: StepMap, gait: Cycle, transient: int, steps: int) -> Attractor | Outcome:
    flipping = min(gait.multipliers, key=lambda multiplier: float(multiplier.real))
    aside = GAIT_OFFSET * np.max(np.abs(gait.z)) * eigenvector(gait.DP, flipping)
    return settle(step_map, gait.z + aside, gait.value, transient, steps)


def largest_exponent(step_map: StepMap, z: Floats, value: float, transient: int, steps: int) -> Lyapunov | None:
    """Return the largest Lyapunov exponent of the attractor reached from z, or None if the walk fails."""
    # Just beyond a flip, the tangent grows slowly, so a walk takes long to leave the unstable gait. A walk that repeats
    # while its tangent grows is therefore pushed off the gait, and a walk whose halves differ in mean growth is
    # continued.
    for _ in range(MAX_WALKS):
        # Any initial direction will do: the one that grows fastest soon dominates.
        walk = step_map.iterate(z, value, transient + steps, np.full(z.size, 1.0 / math.sqrt(z.size)))
        if walk.outcome is not Outcome.WALKED:
            return None
        # At a gait with a multiplier of zero a step may shrink the tangent to nothing.
        growth = np.log(np.maximum(walk.lengths[transient:], np.finfo(float).tiny))
        repeats = find_period(walk.points[transient:]) > 0
        blocks = MIN_BLOCKS if repeats else min(MAX_BLOCKS, independent_blocks(growth))
        exponent = float(growth.mean())
        error = standard_error(growth, max(MIN_BLOCKS, blocks))
        drift = abs(float(growth[: steps // 2].mean() - growth[steps // 2 :].mean()))
        if repeats and exponent <= 0.0 and drift < 1.0 / steps:
            break
        error = max(error, 1.0 / steps)
        if not repeats and drift < MAX_DRIFT * error and blocks >= MIN_BLOCKS:
            break
        steps *= 1 + (blocks < MIN_BLOCKS)
        z = (1.0 + GAIT_OFFSET * (repeats and exponent > 0.0)) * walk.points[-1]
    return Lyapunov(value, exponent, error)


def independent_blocks(series: Floats) -> int:
    """Count the blocks of BLOCK_LENGTH correlation times that fit into a series (n,)."""
    # Padding with zeros to twice the length keeps the transform from correlating the end of the series with its start.
    # The correlation time is the sum of the autocorrelation over all lags before the first non-positive value.
    off = series - series.mean()
    spectrum = np.abs(np.fft.rfft(off, 2 * off.size)) ** 2
    correlation = np.fft.irfft(spectrum)[: off.size]
    lags = int(np.argmax(correlation <= 0.0)) or off.size
    lasting = 2.0 * correlation[:lags].sum() / correlation[0] - 1.0
    return int(series.size / (BLOCK_LENGTH * lasting))


def standard_error(series: Floats, blocks: int) -> float:
    means = np.array([block.mean() for block in np.array_split(series, blocks)])
    return float(means.std(ddof=1)) / math.sqrt(blocks)


def feigenbaum_ratios(flips: list[float]) -> list[float]:
    """Return the ratios of successive distances between the flips of a cascade. They tend to 4.669."""
    gaps = np.diff(np.array(flips))
    return [float(gap / next_gap) for gap, next_gap in pairwise(gaps)]


def close_returns(step_map: StepMap, attractor: Attractor, periods: Iterable[int], steps: int) -> list[Seed]:
    """Walk on an attractor and return points that nearly repeat after one of `periods`, as seeds of unstable gaits."""
    walk = step_map.iterate(attractor.last, attractor.value, steps, None)
    points = walk.points
    seeds = []
    for period in periods:
        if points.shape[0] <= period:
            continue
        misses = np.linalg.norm(points[period:] - points[:-period], axis=1)
        for _ in range(MAX_CLOSE_RETURNS):
            nearest = int(np.argmin(misses))
            seeds.append(Seed(points[nearest], attractor.value, period))
            # The neighbours of this point on the orbit return nearly as closely, and would lead to the same gait.
            misses[max(0, nearest - 2 * period) : nearest + 2 * period] = np.inf
    return seeds


def settle_elsewhere(
    step_map: StepMap, attractor: Attractor, starts: int, spread: float, transient: int, generator: np.random.Generator
) -> list[Seed]:
    """Find other periodic gaits by letting walks from scattered starts near the attractor settle.

    spread  standard deviation of the starts' coordinates, as a fraction of the largest coordinate
    """
    seeds: list[Seed] = []
    periods = {attractor.period}
    scale = spread * float(np.max(np.abs(attractor.last)))
    for _ in range(starts):
        start = attractor.last + scale * generator.standard_normal(attractor.last.size)
        attained = settle(step_map, start, attractor.value, transient, 2 * MAX_PERIOD)
        if not isinstance(attained, Outcome) and attained.period and attained.period not in periods:
            periods.add(attained.period)
            seeds.append(Seed(attained.last, attractor.value, attained.period))
    return seeds
