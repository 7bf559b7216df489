"""Find the heel strikes in recorded angles.

A foot strikes when it is ahead and its height above the other foot falls to zero. Noise can cause several such
crossings, so neighbouring crossings of one leg count as one strike. Its time is the zero of the height in a smooth fit
of the angles: one polynomial before the strike and one after it. They meet at the strike, because only the rates jump
there. The scatter of the angles around the fit gives the standard error of that time.

Measured from the slope's normal, the leg angles are opposite at heel strike. An error in slope or sensor offset makes
their sum non-zero where the rates jump: `sums_at_jumps` finds it.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from operator import itemgetter
from typing import Final

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

Array = NDArray[np.float64]
Height = Callable[[Array], Array]

DEGREES: Final = range(1, 7)
"""Degrees of polynomials that are tried. The samples decide which one is used."""
ALL_DEGREES: Final = (*DEGREES, DEGREES[-1] + 1)
"""`DEGREES` and the next degree, whose fit shows the bias of the highest one."""
MIN_SAMPLES: Final = 6
"""A fit uses at least this many samples on each side of a heel strike, if the step has as many."""
MAX_FIT_TIME: Final = 0.4  # a fit covers at most this fraction of the step period before and after a heel strike
MIN_CROSSING_INTERVAL: Final = 0.25  # crossings of one leg within this fraction of the step period are one heel strike
MIN_FALL_SPEED: Final = 0.25  # a crossing slower than this fraction of the median falling speed is not a heel strike
ITERATIONS: Final = 20
DEGREE_ITERATIONS: Final = 3  # number of iterations in which the degree is chosen again
MAX_CORRECTION: Final = 1e-3  # a heel strike is located once a correction is below this many standard errors
SIGNIFICANT_ERRORS: Final = 3.0  # a value within this many standard errors of zero counts as zero
# A heel strike on compliant ground takes this long, so no fit can time it more accurately.
STRIKE_DURATION_S: Final = 1e-4
PRECISE_S: Final = 2e-3  # largest standard error of a heel strike at the first sample
JUMP_WINDOW: Final = 0.15  # time before and after a heel strike in which rates may jump, as a fraction of the period
JUMP_SAMPLES: Final = 10  # minimum number of samples in that time
JUMP_DEGREE: Final = 4
# Jumps count as delayed if their common delay exceeds this many of its standard errors. The number is large, because
# many instants are tried.
JUMP_ERRORS: Final = 4.5
MAX_JUMPS: Final = 20  # maximum number of heel strikes at which jumps are searched for
SHIFTS: Final = 61
SIDES: Final = 2
MIN_SIDE_RATIO: Final = 1 / 3  # minimum number of samples on one side of a fit, as a fraction of those on the other
MIN_SQUARES: Final = 1e-30  # rad^2, added to sums of squares because the logarithm of 0 does not exist
NORMAL_QUARTILE: Final = 0.6745  # median absolute value of a normal variable with standard deviation 1
WINDOW_AHEAD: Final = 0.4
"""Smallest angle between the legs at a heel strike, as a fraction of the largest during the walk."""
WINDOW: Final = 0.1
"""Time before and after a heel strike in which angles are fitted, as a fraction of the step period."""
MAX_RUNS: Final = 20  # maximum number of stretches with one leg far ahead that are searched for jumps
WINDOW_SAMPLES: Final = 60  # windows with more samples are thinned to about this number
SAMPLES_ON_A_SIDE: Final = 4  # minimum number of samples for a fit, before and after an instant
DEGREE: Final = 3
MIN_SCATTER: Final = 1e-12  # lower limit of the residual sum of squares, as a fraction of the sum of squared angles
SUMS: Final = np.round(np.arange(-0.12, 0.121, 0.01), 2)  # trial values (rad) of the sum of leg angles
MOST_FOUND: Final = 4
RIDGE: Final = 1e-15  # relative term added to equations, because samples at nearly equal times would make them singular


@dataclass(frozen=True)
class StrikeFit:
    """Polynomials through the angles of both legs before and after an instant, at which they meet."""

    angle: Array  # (2,) angles at the instant
    # rates (2,) before and after the instant, under `before` and `after`; absent if there are too few samples
    rates: dict[str, Array]
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
"""Times (samples,), angles (samples, 2), the instant at which the polynomials meet, and their degrees in rising
order.
"""
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
    if (first := touch_at_start(time, angle, height, period)) is not None:
        touches = [first, *(touch for touch in touches if touch.time_s > first.time_s + MIN_CROSSING_INTERVAL * period)]
    slowest = MIN_FALL_SPEED * float(np.median([touch.fall_m_s for touch in touches])) if touches else 0.0
    return [touch for touch in touches if touch.fall_m_s >= slowest]


def candidates(time: Array, angle: Array, height: Height) -> list[tuple[float, int, float]]:
    """Return the candidate heel strikes, where the front foot comes down to the level of the rear one: the time, the
    leg, and the foot's heights summed over all samples up to that time. Noise can produce several candidates for one
    strike.
    """
    # If a recording ends at a heel strike, the crossing may come just after it, so continue it by half an interval.
    before = int(np.searchsorted(time, time[-1] - 0.5 * float(np.median(np.diff(time))))) - 1
    time = np.append(time, 1.5 * time[-1] - 0.5 * time[before])
    angle = np.append(angle, 1.5 * angle[-1:] - 0.5 * angle[before : before + 1], axis=0)
    spread = angle[:, 0] - angle[:, 1]
    over = height(angle)
    # The feet are also level as the legs pass each other, but then neither leg is far ahead.
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
    """Keep only one of the consecutive crossings of a leg that are less than `apart_s` (s) apart. It is the one with
    the largest sum of heights, because the foot is above the other foot before this crossing and below it afterwards.
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
    standard error corresponds to a short time.
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
    # A strike just before the recording looks like one at the first sample, so the error includes the time from the
    # fitted strike to the first sample.
    return replace(touch, error_s=float(np.hypot(touch.error_s, off)))


def locate_touch(
    time: Array, angle: Array, height: Height, near: float, leg: int, period: float
) -> Generator[Problem, Fits, Touch | None]:
    """Locate the heel strike near a crossing. `fit_together` makes the fits for all strikes at once.

    Returns None if there are too few samples, or if the foot does not fall.
    """
    t, y = samples_near(time, angle, near, period)
    farthest = 0.5 * float(np.abs(t).max())
    at = 0.0
    correction = 0.0
    degree = DEGREES[0]
    touch = None
    for iteration in range(ITERATIONS):
        # Choose the degree again in the first iterations, because the best one is not clear until the polynomials meet
        # near the strike.
        choosing = iteration < DEGREE_ITERATIONS
        fits = yield t, y, at, ALL_DEGREES if choosing else (degree, degree + 1)
        degree = best_degree(fits) if choosing else degree
        fit = fits.get(degree)
        if fit is None or len(fit.rates) < SIDES:
            # Use one degree more if the instant is at the end of the samples, where the bias is largest.
            fit = fits.get(degree + 1) or fit
        touch = touch_of(fit, height, near + at, leg) if fit else None
        if touch and touch.fall_m_s <= 0.0 and DEGREES[0] in fits:
            # Use a line, because noise can bend the end of a curve upwards.
            touch = touch_of(fits[DEGREES[0]], height, near + at, leg)
        if touch is None or touch.fall_m_s <= 0.0:
            return None
        over = float(height(touch.fit.angle[None])[0]) * (-1.0 if leg else 1.0)
        correction = float(np.clip(over / touch.fall_m_s, -farthest, farthest))
        if iteration >= DEGREE_ITERATIONS and abs(correction) < MAX_CORRECTION * touch.error_s:
            return touch_of(add_bias(touch.fit, fits.get(degree), fits.get(degree + 1)), height, near + at, leg)
        at += correction
    # If samples keep moving from one side of the strike to the other, the zero keeps moving. So add its last move to
    # the error.
    if touch is None or abs(correction) > max(touch.error_s, 0.5 * float(np.median(np.diff(t)))):
        return None
    return replace(touch, error_s=float(np.hypot(touch.error_s, correction)))


def fit_together(searches: Sequence[Generator[Problem, Fits, Touch | None]]) -> list[Touch | None]:
    """Run searches side by side, make the fits that they wait for in one batch, and return the results."""
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
    """Return the samples around an instant: their times relative to it, and their angles. Sparse samples cover more of
    the step.
    """
    row = int(np.searchsorted(time, near))
    away = np.sort(np.abs(time[max(0, row - 2 * MIN_SAMPLES) : row + 2 * MIN_SAMPLES] - near))
    wanted = float(away[: 2 * MIN_SAMPLES][-1])
    rows = rows_within(time, near, max(WINDOW * period, min(wanted, MAX_FIT_TIME * period)))
    return time[rows] - near, angle[rows]


def rows_within(time: Array, instant: float, half: float) -> slice:
    """Return the rows of the samples that are at most `half` (s) before or after an instant."""
    return slice(int(np.searchsorted(time, instant - half)), int(np.searchsorted(time, instant + half, "right")))


def touch_of(fit: StrikeFit, height: Height, time: float, leg: int) -> Touch:
    """Build the heel strike of a leg from a fit whose polynomials meet at `time` (s)."""
    # This is close to the best step for central differences in double precision.
    small = 1e-6 * np.eye(2)
    values = height(np.concatenate((fit.angle + small, fit.angle - small)))
    gradient = (values[:2] - values[2:]) / 2e-6
    slope = float(gradient @ next(iter(fit.rates.values())))
    error = np.hypot(fit.deviation * np.hypot(*gradient) / abs(slope), STRIKE_DURATION_S) if slope else np.inf
    # The height is that of foot 0 above foot 1, so it rises as foot 1 comes down.
    return Touch(time, leg, float(error), slope if leg else -slope, fit)


def best_degree(fits: Fits) -> int:
    """Return the degree whose fit has the lowest criterion."""
    return min((degree for degree in DEGREES if degree in fits), key=lambda d: fits[d].criterion, default=DEGREES[0])


def add_bias(fit: StrikeFit, narrow: StrikeFit | None, wide: StrikeFit | None) -> StrikeFit:
    """Add the bias of a fit to its error. The bias is the change from the `narrow` fit to the `wide` fit, which is one
    degree higher.
    """
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
    """Fit polynomials of each degree to each problem, on the given sides of time 0, where the two sides meet.

    Columns are in the order of the degrees, so that one factorisation serves all of them.
    """
    sizes = np.array([each.size for each in times])
    filled = np.arange(sizes.max()) < sizes[:, None]
    # Fill up problems that have fewer samples with rows of zeros.
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
    # sums over the columns that a lower degree lacks, and over those that it has
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
    """Find jumps of the rates near heel strikes. Return their delay (s), and the angles (jumps, 2) and legs (jumps,) at
    the jumps.

    The delay is the same for all strikes. It is the shift that leaves the smallest residuals. Returns None unless the
    shift is larger than PRECISE_S and than `errors` times its standard error.

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
    # A minimum at an end of the range does not count either, because the true one may lie beyond.
    if squares[shifts == 0.0][0] - least <= errors**2 * variance or not 0 < index < shifts.size - 1:
        return None
    # Find the minimum by a parabola through three trials.
    before, after = squares[[index - 1, index + 1]].tolist()
    best = float(shifts[index] + 0.5 * (before - after) / (before - 2.0 * least + after) * (shifts[1] - shifts[0]))
    fits = fits_at(best)
    if abs(best) <= PRECISE_S or len(fits) < len(parts):
        return None
    return best, np.array([fit.angle for fit in fits]), np.array([touch.leg for touch in inside])


# Sums of the leg angles where rates jump ------------------------------------------------------------------------------


def sums_at_jumps(time: Array, angle: Array, total: Callable[[Array], Array]) -> list[float]:
    """Return likely sums (rad) of the leg angles at heel strikes, beginning with the sum at which leg rates jump most
    clearly.

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
    # The two comparisons differ, so that of equal neighbours only the first is a peak.
    peaks = np.flatnonzero((evidence > padded[:-2]) & (evidence >= padded[2:]))
    return [float(SUMS[peak]) for peak in peaks[np.argsort(-evidence[peaks])][:MOST_FOUND]]


def evidence_for(time: Array, angle: Array, over: Array, runs: Sequence[tuple[int, int]], half: float) -> float:
    """Return the sum of squares that rate jumps explain in the angles, divided by the variance of the residuals.

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
    # Third differences hardly contain the smooth motion. Their variance is 20 times that of the noise.
    changes = np.abs(np.diff(angle, 3, axis=0))
    return float(np.median(changes)) / (NORMAL_QUARTILE * 20.0**0.5) if changes.size else 0.0


def typical_interval(instants: Sequence[float], time: Array) -> float:
    """Return the median interval (s) between instants of a recording, or its duration if there are fewer than two."""
    return float(np.median(np.diff(instants))) if len(instants) > 1 else float(time[-1] - time[0])


def squares_around(
    parts: Sequence[tuple[Array, Array]], instants: Array, degree: int, samples_per_degree: int = 1
) -> Array:
    """Fit one polynomial before and one after each instant, such that they meet there, and return the sums of squared
    residuals (parts, instants).

    parts               times (samples,), rising, and values (samples, legs) of each part of a recording
    instants            (parts, instants) rising along each row
    degree              highest degree of the polynomials
    samples_per_degree  number of samples that a side needs for each degree above 1
    """
    counts = np.array([np.searchsorted(t, row) for (t, _), row in zip(parts, instants, strict=True)])
    rest = np.array([[t.size] for t, _ in parts]) - counts
    degrees = np.minimum(degree, 1 + np.stack((counts, rest)) // samples_per_degree)
    before = squares_before(parts, instants, counts, degrees[0])
    # Fit after an instant by fitting before it in reversed time.
    mirrored = [(-t[::-1], y[::-1]) for t, y in parts]
    after = [
        values[:, ::-1] for values in squares_before(mirrored, -instants[:, ::-1], rest[:, ::-1], degrees[1, :, ::-1])
    ]
    # If both sides must meet, the sum of squared residuals grows by the squared gap between them, divided by the sum of
    # the variances of their values there.
    gaps = np.sum((before[1] - after[1]) ** 2, axis=2)
    return np.asarray(before[0] + after[0] + gaps / (before[2] + after[2]))


def squares_before(
    parts: Sequence[tuple[Array, Array]], instants: Array, counts: NDArray[np.int64], degrees: NDArray[np.int64]
) -> tuple[Array, Array, Array]:
    """Fit polynomials to the first `counts` samples of each part, for each instant.

    Returns the sums of squared residuals (parts, instants), the fitted values at the instants (parts, instants, legs),
    and the variance (parts, instants) of a fitted value for samples of unit variance.
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
    # A side without a fit can have any value at the instant. With an infinite variance, the gap adds no cost.
    return squares, values, np.where(fitted, explained[..., -1], np.inf)


def products_of(
    part: tuple[Array, Array], instants: Array, counts: NDArray[np.int64], degree: int
) -> tuple[list[Array], Array]:
    """Sum the products of polynomials and values over samples. Also return the polynomials at the instants.

    counts  (instants,) number of samples before the end of each sum, which begins where the previous one ended
    """
    end = int(counts.max())
    first, last = part[0][0], max(part[0][end - 1], instants.max())
    times = np.concatenate((part[0][:end], instants))
    # Use Chebyshev polynomials, because powers would make the normal equations too ill-conditioned.
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
