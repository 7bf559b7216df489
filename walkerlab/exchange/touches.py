"""Find the heel strikes in recorded angles.

A foot strikes when it is ahead and its height over the other foot falls to zero. Noise repeats such crossings, so
neighbouring crossings of one leg count as one strike. It is timed by the zero of the height in a smooth fit of angles:
one polynomial before the strike and one after it, which meet at the strike, because only the rates jump. The scatter of
the angles around the fit gives the standard error of that time.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.exchange.rate_jumps import WINDOW, WINDOW_AHEAD, Array, squares_around, typical_interval

Height = Callable[[Array], Array]

DEGREES: Final = range(1, 7)
"""Degrees of polynomials to try. The samples decide which one is used."""
ALL_DEGREES: Final = (*DEGREES, DEGREES[-1] + 1)
"""`DEGREES` and the next degree, whose fit shows the bias of the highest one."""
MIN_SAMPLES: Final = 6
"""A fit uses at least this many samples on each side of a heel strike, if the step has as many."""
MAX_FIT_TIME: Final = 0.4  # longest time before and after a heel strike in a fit, as a fraction of the step period
MIN_CROSSING_INTERVAL: Final = 0.25  # crossings of one leg within this fraction of the step period are one heel strike
MIN_FALL_SPEED: Final = 0.25  # a crossing below this fraction of the median speed of falling feet is no heel strike
ITERATIONS: Final = 20
DEGREE_ITERATIONS: Final = 3  # number of iterations in which the degree is chosen again
MAX_CORRECTION: Final = 1e-3  # a heel strike is located once a correction is below this many standard errors
SIGNIFICANT_ERRORS: Final = 3.0  # a value within this many standard errors of zero counts as zero
STRIKE_DURATION_S: Final = 1e-4  # duration of a heel strike on compliant ground, which limits the resolution of any fit
PRECISE_S: Final = 2e-3  # largest standard error of a heel strike at the first sample
JUMP_WINDOW: Final = 0.15  # time before and after a heel strike in which rates may jump, as a fraction of the period
JUMP_SAMPLES: Final = 10  # fewest samples in that time
JUMP_DEGREE: Final = 4
# A jump counts if it is displaced by this many standard errors. They are many, because many instants are tried.
JUMP_ERRORS: Final = 4.5
MAX_JUMPS: Final = 20  # maximum number of heel strikes at which jumps are searched for
SHIFTS: Final = 61
SIDES: Final = 2
MIN_SIDE_RATIO: Final = 1 / 3  # fewest samples on a side of a fit, as a fraction of those on the other
MIN_SQUARES: Final = 1e-30  # rad^2, added to sums of squares because the logarithm of 0 does not exist


@dataclass(frozen=True)
class StrikeFit:
    """Polynomials through the angles of both legs before and after an instant, at which they meet."""

    angle: Array  # (2,) at the instant
    rates: dict[str, Array]  # (2,) before and after it, by `before` and `after`; absent if there are too few samples
    squares: float  # sum of the squared residuals
    freedoms: int  # number of values minus number of coefficients
    deviation: float  # standard error of either angle
    criterion: float  # Bayesian information criterion, corrected for few values; smaller is better

    @property
    def scatter(self) -> float:
        return float(np.sqrt(self.squares / self.freedoms))


@dataclass(frozen=True)
class Touch:
    """Heel strike: time and standard error (s), leg that strikes (0 or 1), and speed of the falling foot (m/s)."""

    time_s: float
    leg: int
    error_s: float
    fall_m_s: float
    fit: StrikeFit  # in s


Problem = tuple[Array, Array, float, Sequence[int]]
"""Times (samples,), angles (samples, 2), the instant at which the polynomials meet, and their degrees, rising."""
Fits = dict[int, StrikeFit]  # by degree


def find_touches(time: Array, angle: Array, height: Height) -> list[Touch]:
    """Find the heel strikes in the angles of both legs.

    time    (samples,) s, rising
    angle   (samples, 2) rad, from the vertical, positive with the foot ahead
    height  function from angles (samples, 2) to the height (samples,) of foot 0 over foot 1 (m, normal to the slope)
    """
    crossings = candidates(time, angle, height)
    # The period is not known yet, so at first all consecutive crossings of a leg count as one strike.
    period = typical_interval([crossing for crossing, *_ in merge_repeats(crossings, np.inf)], time)
    merged = merge_repeats(crossings, MIN_CROSSING_INTERVAL * period)
    located = fit_together([locate_touch(time, angle, height, crossing, leg, period) for crossing, leg, _ in merged])
    # A fit may move a crossing near the first sample to a time before the recording.
    touches = [touch for touch in located if touch is not None and touch.time_s >= time[0]]
    first = touch_at_start(time, angle, height, period)
    if first is not None:
        touches = [first, *(touch for touch in touches if touch.time_s > first.time_s + MIN_CROSSING_INTERVAL * period)]
    slowest = MIN_FALL_SPEED * float(np.median([touch.fall_m_s for touch in touches])) if touches else 0.0
    return [touch for touch in touches if touch.fall_m_s >= slowest]


def candidates(time: Array, angle: Array, height: Height) -> list[tuple[float, int, float]]:
    """Return the candidate heel strikes, where the front foot comes down to the level of the rear one: the time, the
    leg, and the sum of the foot's heights up to there. Noise can produce several candidates for one strike.
    """
    # A recording may end at a heel strike, so that the crossing comes just after it. So it is continued by half an
    # interval.
    before = int(np.searchsorted(time, time[-1] - 0.5 * float(np.median(np.diff(time))))) - 1
    time = np.append(time, 1.5 * time[-1] - 0.5 * time[before])
    angle = np.append(angle, 1.5 * angle[-1:] - 0.5 * angle[before : before + 1], axis=0)
    spread = angle[:, 0] - angle[:, 1]
    over = height(angle)
    # The feet are also level as the legs pass each other, where neither leg is far ahead.
    apart = WINDOW_AHEAD * np.abs(spread).max()
    sums = np.cumsum(over)
    crossings = []
    for i in np.flatnonzero((over[:-1] > 0.0) != (over[1:] > 0.0)):
        leg, ahead = (0, spread[i]) if over[i] > 0.0 else (1, -spread[i])
        if ahead > apart:
            share = over[i] / (over[i] - over[i + 1])
            instant = float(time[i] + share * (time[i + 1] - time[i]))
            crossings.append((instant, leg, float(-sums[i] if leg else sums[i])))
    return crossings


def merge_repeats(crossings: Sequence[tuple[float, int, float]], apart_s: float) -> list[tuple[float, int, float]]:
    """Keep only one of the consecutive crossings of a leg that are nearer to each other than `apart_s` (s).

    This is the one with the largest sum of heights: before it the foot was above the other one, after it below.
    """
    strikes: list[list[tuple[float, int, float]]] = []
    for crossing in crossings:
        if strikes and strikes[-1][-1][1] == crossing[1] and crossing[0] - strikes[-1][-1][0] < apart_s:
            strikes[-1].append(crossing)
        else:
            strikes.append([crossing])
    return [max(repeats, key=itemgetter(2)) for repeats in strikes]


def touch_at_start(time: Array, angle: Array, height: Height, period: float) -> Touch | None:
    """Return the heel strike with which a recording begins, or None if it begins at another instant.

    The first sample counts as a heel strike if the height fitted there is zero within three standard errors, and if the
    standard error is short when expressed as a time.
    """
    spread = angle[:, 0] - angle[:, 1]
    begin = float(time[0])
    if abs(spread[0]) <= WINDOW_AHEAD * np.abs(spread).max():
        return None
    rows = time - begin <= MAX_FIT_TIME * period
    t, y = time[rows] - begin, angle[rows]
    fits = fit_degrees([(t, y, 0.0, ALL_DEGREES)])[0]
    degree = best_degree(fits)
    # The best degree balances bias and scatter. One degree more keeps the bias within the standard error.
    fit = fits.get(degree + 1) or fits.get(degree)
    touch = touch_of(fit, height, begin, int(spread[0] < 0.0)) if fit else None
    off = abs(float(height(touch.fit.angle[None])[0])) / touch.fall_m_s if touch and touch.fall_m_s > 0.0 else np.inf
    if touch is None or touch.error_s >= PRECISE_S or off > SIGNIFICANT_ERRORS * touch.error_s:
        return None
    # A strike just before the recording looks like one at the first sample. The error includes the distance in the fit.
    return replace(touch, error_s=float(np.hypot(touch.error_s, off)))


def locate_touch(
    time: Array, angle: Array, height: Height, near: float, leg: int, period: float
) -> Generator[Problem, Fits, Touch | None]:
    """Locate the heel strike near a crossing by fits, which `fit_together` makes for all strikes at once.

    Returns None if there are too few samples, or the foot does not fall.
    """
    t, y = samples_near(time, angle, near, period)
    farthest = 0.5 * float(np.abs(t).max())
    at = 0.0
    correction = 0.0
    degree = DEGREES[0]
    touch = None
    for iteration in range(ITERATIONS):
        # The degree is chosen again, because the best one shows only once the polynomials meet near the strike.
        choosing = iteration < DEGREE_ITERATIONS
        fits = yield t, y, at, ALL_DEGREES if choosing else (degree, degree + 1)
        degree = best_degree(fits) if choosing else degree
        fit = fits.get(degree)
        if fit is None or len(fit.rates) < SIDES:
            # Use one degree more if the instant is at the end of the samples, where the bias is largest.
            fit = fits.get(degree + 1) or fit
        touch = touch_of(fit, height, near + at, leg) if fit else None
        if touch and touch.fall_m_s <= 0.0 and DEGREES[0] in fits:
            # Noise can bend a curve upwards at its end, but hardly a line.
            touch = touch_of(fits[DEGREES[0]], height, near + at, leg)
        if touch is None or touch.fall_m_s <= 0.0:
            return None
        over = float(height(touch.fit.angle[None])[0]) * (-1.0 if leg else 1.0)
        correction = float(np.clip(over / touch.fall_m_s, -farthest, farthest))
        if iteration >= DEGREE_ITERATIONS and abs(correction) < MAX_CORRECTION * touch.error_s:
            return touch_of(add_bias(touch.fit, fits.get(degree), fits.get(degree + 1)), height, near + at, leg)
        at += correction
    # If samples keep changing sides, the zero keeps moving. Its error is then the size of its moves.
    if touch is None or abs(correction) > max(touch.error_s, 0.5 * float(np.median(np.diff(t)))):
        return None
    return replace(touch, error_s=float(np.hypot(touch.error_s, correction)))


def fit_together(searches: Sequence[Generator[Problem, Fits, Touch | None]]) -> list[Touch | None]:
    """Run searches side by side, make the fits that they wait for together, and return the results of the searches."""
    results: list[Touch | None] = [None] * len(searches)
    problems = {index: next(search) for index, search in enumerate(searches)}
    while problems:
        fits = dict(zip(problems, fit_degrees(list(problems.values())), strict=True))
        problems = {}
        for index, answer in fits.items():
            try:
                problems[index] = searches[index].send(answer)
            except StopIteration as end:
                results[index] = end.value
    return results


def samples_near(time: Array, angle: Array, near: float, period: float) -> tuple[Array, Array]:
    """Return the samples around an instant (times from it, and angles), with more of the step if samples are sparse."""
    row = int(np.searchsorted(time, near))
    away = np.sort(np.abs(time[max(0, row - 2 * MIN_SAMPLES) : row + 2 * MIN_SAMPLES] - near))
    wanted = float(away[: 2 * MIN_SAMPLES][-1])
    rows = rows_within(time, near, max(WINDOW * period, min(wanted, MAX_FIT_TIME * period)))
    return time[rows] - near, angle[rows]


def rows_within(time: Array, instant: float, half: float) -> slice:
    """Return the samples within half a span of time before and after an instant."""
    return slice(int(np.searchsorted(time, instant - half)), int(np.searchsorted(time, instant + half, "right")))


def touch_of(fit: StrikeFit, height: Height, time: float, leg: int) -> Touch:
    """Return the heel strike of a leg at the time (s) of a fit."""
    # This is close to the best step for central differences in double precision.
    small = 1e-6 * np.eye(2)
    values = height(np.concatenate((fit.angle + small, fit.angle - small)))
    gradient = (values[:2] - values[2:]) / 2e-6
    slope = float(gradient @ next(iter(fit.rates.values())))
    error = np.hypot(fit.deviation * np.hypot(*gradient) / abs(slope), STRIKE_DURATION_S) if slope else np.inf
    # The height is that of foot 0 over foot 1, so it rises as foot 1 comes down.
    return Touch(time, leg, float(error), slope if leg else -slope, fit)


def best_degree(fits: Fits) -> int:
    """Return the degree with the best criterion."""
    return min((degree for degree in DEGREES if degree in fits), key=lambda d: fits[d].criterion, default=DEGREES[0])


def add_bias(fit: StrikeFit, narrow: StrikeFit | None, wide: StrikeFit | None) -> StrikeFit:
    """Return a fit whose error includes its bias: the change from the `narrow` fit to the `wide` one, one degree up."""
    change = float(np.linalg.norm(wide.angle - narrow.angle)) if narrow and wide else 0.0
    return replace(fit, deviation=float(np.hypot(fit.deviation, change / len(fit.rates))))


def fit_degrees(problems: Sequence[Problem]) -> list[Fits]:
    """For each degree, from low to high, fit one polynomial before and one after an instant, at which they meet.

    A side with too few samples for a degree, for example where a recording begins just before a strike, is not fitted,
    because it would force a low degree on the other side. A degree for which both sides have too few samples is absent.
    """
    fits: list[Fits] = [{} for _ in problems]
    alike: dict[tuple[tuple[str, ...], tuple[int, ...], int], list[tuple[int, Array, Array]]] = {}
    for index, (t, y, at, degrees) in enumerate(problems):
        split = int(np.searchsorted(t, at))
        counts = {"before": split, "after": t.size - split}
        by_sides: dict[tuple[str, ...], tuple[int, ...]] = {}
        for degree in degrees:
            fewest = max(degree + 1, MIN_SIDE_RATIO * max(counts.values()))
            names = tuple(name for name, count in counts.items() if count >= fewest)
            if sum(counts[name] for name in names) > 1 + degree * len(names):
                by_sides[names] = (*by_sides.get(names, ()), degree)
        for names, of_sides in by_sides.items():
            used = slice(0 if "before" in names else split, t.size if "after" in names else split)
            # Problems with similar numbers of samples are fitted together.
            key = names, of_sides, (used.stop - used.start).bit_length()
            alike.setdefault(key, []).append((index, t[used] - at, y[used]))
    for (names, of_sides, _), group in alike.items():
        indices, times, values = zip(*group, strict=True)
        for index, fit in zip(indices, fit_sides(times, values, names, of_sides), strict=True):
            fits[index] |= fit
    return fits


def fit_sides(
    times: Sequence[Array], values: Sequence[Array], sides: Sequence[str], degrees: Sequence[int]
) -> list[Fits]:
    """Fit polynomials of each degree, on these sides of the time 0, which meet there, to each of some problems.

    Columns are in the order of the degrees, so that one factorisation serves all of them.
    """
    sizes = np.array([each.size for each in times])
    filled = np.arange(sizes.max()) < sizes[:, None]
    # Problems with fewer samples are filled up with rows of zeros.
    t = np.zeros(filled.shape)
    y = np.zeros((*filled.shape, 2))
    t[filled] = np.concatenate(times)
    y[filled] = np.concatenate(values)
    # Powers of times in seconds would differ by many orders of magnitude.
    scale = np.array([np.ptp(each) for each in times])[:, None]
    parts = [np.where(t < 0.0 if side == "before" else t >= 0.0, t / scale, 0.0) for side in sides]
    powers = np.multiply.accumulate(np.stack([np.stack(parts, axis=-1)] * degrees[-1], axis=2), axis=2)
    basis = np.concatenate((filled[..., None], powers.reshape(*filled.shape, -1)), axis=2)
    orthonormal, triangle = np.linalg.qr(basis)
    inverse = np.linalg.inv(triangle)
    shares = orthonormal.mT @ y
    left = np.sum((y - orthonormal @ shares) ** 2, axis=(1, 2)) + MIN_SQUARES
    # Sums over the columns that a lower degree lacks, and over those that it has.
    missed = np.pad(np.cumsum(np.sum(shares**2, axis=2)[:, ::-1], axis=1)[:, ::-1], ((0, 0), (0, 1)))
    variances = np.cumsum(inverse[:, 0] ** 2, axis=1)
    fits: list[Fits] = [{} for _ in times]
    for degree in degrees:
        columns = 1 + degree * len(sides)
        coefficients = inverse[:, : 1 + len(sides), :columns] @ shares[:, :columns]
        squares = left + missed[:, columns]
        freedoms = 2 * (sizes - columns)
        # The standard deviation is that of Student's t, because few values determine the scatter only roughly.
        deviations = np.sqrt(squares / np.maximum(freedoms - 2, 1) * variances[:, columns - 1])
        penalties = 2 * columns * np.log(2 * sizes) * sizes / (sizes - columns)
        criteria = 2 * sizes * np.log(squares) + penalties
        rates = coefficients[:, 1:] / scale[..., None]
        rows = zip(*(each.tolist() for each in (squares, freedoms, deviations, criteria)), strict=True)
        for fit, angle, of_sides, row in zip(fits, coefficients[:, 0], rates, rows, strict=True):
            fit[degree] = StrikeFit(angle, dict(zip(sides, of_sides, strict=True)), *row)
    return fits


def angles_at_jumps(
    time: Array, angle: Array, touches: Sequence[Touch], period: float, errors: float = JUMP_ERRORS
) -> tuple[float, Array, NDArray[np.int64]] | None:
    """Find where rates jump near heel strikes. Return their delay (s), and angles (jumps, 2) and legs (jumps,) there.

    All strikes are shifted by the same time, the one that leaves the smallest residuals. Returns None unless the shift
    exceeds `errors` of its standard errors and PRECISE_S.

    period  step period (s)
    errors  number of standard errors
    """
    half = min(max(JUMP_WINDOW * period, JUMP_SAMPLES * float(np.median(np.diff(time)))), MAX_FIT_TIME * period)
    inside = [touch for touch in touches if time[0] + half <= touch.time_s <= time[-1] - half][:MAX_JUMPS]
    parts = [
        (time[rows] - touch.time_s, angle[rows]) for touch in inside for rows in [rows_within(time, touch.time_s, half)]
    ]

    shifts = np.linspace(-0.5, 0.5, SHIFTS) * half
    # A shift is tried only if it leaves enough samples on both sides of every strike.
    for t, _ in parts:
        after = np.searchsorted(t, shifts)
        fewer, more = np.sort((after, t.size - after), axis=0)
        shifts = shifts[fewer >= np.maximum(JUMP_DEGREE + 1, MIN_SIDE_RATIO * more)]
    # Without the unshifted strikes there is nothing to compare shifts with.
    if not parts or not np.any(shifts == 0.0):
        return None
    squares = np.sum(squares_around(parts, np.tile(shifts, (len(parts), 1)), JUMP_DEGREE), axis=0)
    index = int(np.argmin(squares))
    least = float(squares[index])

    def fits_at(shift: float) -> list[StrikeFit]:
        fits = (each.get(JUMP_DEGREE) for each in fit_degrees([(t, y, shift, [JUMP_DEGREE]) for t, y in parts]))
        return [fit for fit in fits if fit is not None and len(fit.rates) == SIDES]

    variance = least / sum(fit.freedoms for fit in fits_at(float(shifts[index])))
    # At an end of the range, the true minimum may lie beyond it, so it does not count either.
    if squares[shifts == 0.0][0] - least <= errors**2 * variance or not 0 < index < shifts.size - 1:
        return None
    # Find the minimum by a parabola through three trials.
    before, after = squares[[index - 1, index + 1]].tolist()
    best = float(shifts[index] + 0.5 * (before - after) / (before - 2.0 * least + after) * (shifts[1] - shifts[0]))
    fits = fits_at(best)
    if abs(best) <= PRECISE_S or len(fits) < len(parts):
        return None
    return best, np.array([fit.angle for fit in fits]), np.array([touch.leg for touch in inside])
