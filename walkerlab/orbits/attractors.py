"""Where walks settle: the attractor of a step map over a parameter, and how fast neighbours on it part.

The largest Lyapunov exponent is the mean growth of a tangent vector led along by the step map's exact derivative, per
step. Its uncertainty is the standard error of the means of blocks, each several times as long as correlations last; a
walk with too few of these is walked again, twice as long. It is at least one over the walk's steps, which cannot tell
slower growth from none.

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
    """Where walks settle at a value of the parameter.

    period     steps after which it repeats itself; 0 if it does not
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
    """Largest Lyapunov exponent, per step, with its standard error."""

    value: float
    exponent: float
    uncertainty: float


def may_part(exponents: Sequence[Lyapunov], value: float) -> bool:
    """Whether neighbours may part at a value: not if the exponents measured around it, in order, say that they meet."""
    below = [one for one in exponents if one.value <= value][-1:]
    above = [one for one in exponents if one.value >= value][:1]
    return not exponents or any(one.exponent > one.uncertainty for one in (*below, *above))


@dataclass(frozen=True, eq=False)
class AttractorBranch:
    """The attractor over values of the parameter, up to where it is lost.

    lost_at, reason  the first value at which the walk did not go on, and how it ended; None if it always did
    """

    found: tuple[Attractor, ...] = ()
    lost_at: float | None = None
    reason: str = ""


def period_of(points: Floats) -> int:
    """After how many steps points (steps, d) repeat themselves, or come closer and closer to it; 0 if they do not."""
    for period in range(1, min(LONGEST_PERIOD, points.shape[0] // 2) + 1):
        apart = np.max(np.abs(points[period:] - points[:-period]), axis=1)
        third = apart.size // 3
        before, after = apart[: third + 1].max(), apart[apart.size - third - 1 :].max()
        if apart.max() < REPEATS or (apart.max() < NEARLY and after < CLOSER * before):
            return period
    return 0


def settled(step_map: StepMap, z: Floats, value: float, transient: int, kept: int) -> Attractor | Outcome:
    """Where a walk from z settles; the outcome if it does not go on for `transient + kept` steps."""
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
    """The attractor that contains z at the first value, followed from value to value.

    Where a walk from one value's attractor does not settle at the next, it is led there in smaller steps; where it is
    lost on the way, that is narrowed down by halving, so that it does not hang on the values.
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
    """Where walks settle that leave an unstable gait along the direction in which every step changes sides."""
    flipping = min(gait.multipliers.real)
    aside = ASIDE * np.max(np.abs(gait.z)) * eigenvector(gait.DP, flipping)
    return settled(step_map, gait.z + aside, gait.value, transient, kept)


def largest_exponent(step_map: StepMap, z: Floats, value: float, transient: int, steps: int) -> Lyapunov | None:
    """The largest Lyapunov exponent of the attractor that a walk from z comes to; None if the walk ends.

    transient  steps that turn the tangent into the direction of fastest growth
    steps      that are averaged over

    Just beyond a flip walks leave the gait that has become unstable as slowly as their tangents grow there. A walk that
    repeats itself while its tangent grows is pushed off that gait, and one whose halves differ is walked on.
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
    """How many blocks a series (n,) has that are several times as long as its correlations last.

    These last for the sum of the autocorrelation over all lags, up to the first one at which it is not positive.
    """
    off = series - series.mean()
    spectrum = np.abs(np.fft.rfft(off, 2 * off.size)) ** 2
    correlation = np.fft.irfft(spectrum)[: off.size]
    lags = int(np.argmax(correlation <= 0.0)) or off.size
    lasting = 2.0 * correlation[:lags].sum() / correlation[0] - 1.0
    return int(series.size / (LENGTH_OF_BLOCKS * lasting))


def standard_error(series: Floats, blocks: int) -> float:
    """Standard error of the mean of a series, by the means of so many blocks of it."""
    means = np.array([block.mean() for block in np.array_split(series, blocks)])
    return float(means.std(ddof=1)) / math.sqrt(blocks)


def feigenbaum_ratios(flips: list[float]) -> list[float]:
    """Ratios of successive distances between the flips of a cascade; they tend to 4.669."""
    gaps = np.diff(np.array(flips))
    return [float(one / other) for one, other in pairwise(gaps)]


def close_returns(step_map: StepMap, attractor: Attractor, periods: Iterable[int], steps: int) -> list[Seed]:
    """Points of an attractor that nearly return after so many steps: near unstable gaits of as many, a few each.

    steps  that are walked to look for them
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
    """Periodic gaits that walks from starts scattered about an attractor settle on, other than itself.

    starts  walks
    spread  standard deviation of the starts' coordinates, as a share of the largest
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
