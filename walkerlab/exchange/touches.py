"""Find the heel strikes in recorded angles.

A foot strikes when it is ahead and its height over the other foot falls to zero. Noise repeats such crossings, so
neighbouring crossings of one leg count as one strike. Its time is the zero of the height in a smooth fit of the angles:
one polynomial before the strike and one after it, which meet at the strike, because only the rates jump. The scatter of
the angles around the fit gives the standard error of that time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.exchange.rate_jumps import WINDOW, WINDOW_AHEAD, Array, typical_interval

Height = Callable[[Array], Array]

DEGREES: Final = range(1, 7)
"""Degrees of the polynomials; the samples decide between them."""
MIN_SAMPLES: Final = 6
"""A fit uses at least this many samples on each side of a heel strike, if the step has as many."""
MAX_FIT_TIME: Final = 0.4  # longest time before and after a heel strike in a fit, as a fraction of the step period
SHORTEST: Final = 0.25  # fraction of the step period; nearer crossings of one leg are one heel strike
SLOWEST: Final = 0.25  # fraction of the median speed of falling feet; a slower crossing is no heel strike
ITERATIONS: Final = 20
DEGREE_ITERATIONS: Final = 3  # number of iterations in which the degree is chosen again
LOCATED: Final = 1e-3  # correction at which a heel strike is located, in standard errors
ERRORS: Final = 3.0  # standard errors within which a value is zero
LASTING_S: Final = 1e-4  # duration of a heel strike on compliant ground, which limits the resolution of any fit
PRECISE_S: Final = 2e-3  # largest standard error of a heel strike at the first sample
JUMP_WINDOW: Final = 0.15  # time before and after a heel strike in which rates may jump, as a fraction of the period
JUMP_SAMPLES: Final = 10  # fewest samples in that time
JUMP_DEGREE: Final = 4
JUMP_ERRORS: Final = (
    4.5  # standard errors by which a jump must be displaced to count; many, because many instants are tried
)
MOST_JUMPS: Final = 20  # maximum number of heel strikes at which jumps are searched for
SHIFTS: Final = 61
SIDES: Final = 2
LOPSIDED: Final = 1 / 3  # fewest samples on a side of a fit, as a fraction of those on the other
SMALLEST: Final = 1e-30  # rad^2, added to sums of squares, of which logarithms are taken


@dataclass(frozen=True)
class Fit:
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
    """Heel strike: time and its standard error (s), leg that strikes (0 or 1), speed of the foot's fall (m/s)."""

    time_s: float
    leg: int
    error_s: float
    fall_m_s: float
    fit: Fit  # in s


def find_touches(time: Array, angle: Array, height: Height) -> list[Touch]:
    """Find the heel strikes in the angles of both legs.

    time    (samples,) s, rising
    angle   (samples, 2) rad, from the vertical, positive with the foot ahead
    height  function from angles (samples, 2) to the height (samples,) of leg 0's foot over leg 1's (m, normal to slope)
    """
    crossings = candidates(time, angle, height)
    period = typical_interval([crossing for crossing, _ in merge_repeats(crossings, np.inf)], time)
    merged = merge_repeats(crossings, SHORTEST * period)
    located = [locate_touch(time, angle, height, crossing, leg, period) for crossing, leg in merged]
    touches = [touch for touch in located if touch is not None and touch.time_s >= time[0]]
    first = touch_at_start(time, angle, height, period)
    if first is not None:
        touches = [first, *(touch for touch in touches if touch.time_s > first.time_s + SHORTEST * period)]
    slowest = SLOWEST * float(np.median([touch.fall_m_s for touch in touches])) if touches else 0.0
    return [touch for touch in touches if touch.fall_m_s >= slowest]


def candidates(time: Array, angle: Array, height: Height) -> list[tuple[float, int]]:
    """Return the time and leg of each candidate heel strike, where the front foot comes down to the level of the rear
    one. Noise can produce several candidates for one strike.
    """
    # A recording may end with a heel strike, so its last two samples are continued by half an interval.
    time = np.append(time, 1.5 * time[-1] - 0.5 * time[-2])
    angle = np.append(angle, 1.5 * angle[-1:] - 0.5 * angle[-2:-1], axis=0)
    spread = angle[:, 0] - angle[:, 1]
    over = height(angle)
    apart = WINDOW_AHEAD * np.abs(spread).max()
    crossings = []
    for i in np.flatnonzero((over[:-1] > 0.0) != (over[1:] > 0.0)):
        leg, ahead = (0, spread[i]) if over[i] > 0.0 else (1, -spread[i])
        if ahead > apart:
            share = over[i] / (over[i] - over[i + 1])
            crossings.append((float(time[i] + share * (time[i + 1] - time[i])), leg))
    return crossings


def merge_repeats(crossings: Sequence[tuple[float, int]], apart_s: float) -> list[tuple[float, int]]:
    """Average consecutive crossings of a leg that are nearer to each other than `apart_s` (s)."""
    strikes: list[tuple[int, list[float]]] = []
    for time, leg in crossings:
        if strikes and strikes[-1][0] == leg and time - strikes[-1][1][-1] < apart_s:
            strikes[-1][1].append(time)
        else:
            strikes.append((leg, [time]))
    return [(float(np.mean(times)), leg) for leg, times in strikes]


def touch_at_start(time: Array, angle: Array, height: Height, period: float) -> Touch | None:
    """Return the heel strike with which a recording begins, or None if it begins at another instant.

    The first sample counts as a heel strike if the height fitted there is zero within three of its standard errors, and
    if these are short when expressed as a time.
    """
    spread = angle[:, 0] - angle[:, 1]
    begin = float(time[0])
    if abs(spread[0]) <= WINDOW_AHEAD * np.abs(spread).max():
        return None
    rows = time - begin <= MAX_FIT_TIME * period
    t, y = time[rows] - begin, angle[rows]
    degree = best_degree(t, y, 0.0)
    # The best degree balances bias and scatter. One degree more keeps the bias within the standard error.
    fit = fit_of_degree(t, y, 0.0, degree + 1) or fit_of_degree(t, y, 0.0, degree)
    touch = touch_of(fit, height, begin, int(spread[0] < 0.0)) if fit else None
    off = abs(float(height(touch.fit.angle[None])[0])) / touch.fall_m_s if touch and touch.fall_m_s > 0.0 else np.inf
    return touch if touch and touch.error_s < PRECISE_S and off <= ERRORS * touch.error_s else None


def locate_touch(time: Array, angle: Array, height: Height, near: float, leg: int, period: float) -> Touch | None:
    """Locate the heel strike near a crossing by a fit, or return None if there are too few samples, or the foot does
    not fall.
    """
    t, y = samples_near(time, angle, near, period)
    farthest = 0.5 * float(np.abs(t).max())
    at = 0.0
    correction = 0.0
    degree = DEGREES[0]
    touch = None
    for iteration in range(ITERATIONS):
        # The best degree shows only once the polynomials meet near the strike.
        degree = best_degree(t, y, at) if iteration < DEGREE_ITERATIONS else degree
        fit = fit_at(t, y, at, degree)
        touch = touch_of(fit, height, near + at, leg) if fit else None
        if touch is None or touch.fall_m_s <= 0.0:
            return None
        over = float(height(touch.fit.angle[None])[0]) * (-1.0 if leg else 1.0)
        correction = float(np.clip(over / touch.fall_m_s, -farthest, farthest))
        if iteration >= DEGREE_ITERATIONS and abs(correction) < LOCATED * touch.error_s:
            return touch_of(add_bias(touch.fit, t, y, at, degree), height, near + at, leg)
        at += correction
    # Samples that change sides keep moving the zero; it is then as uncertain as it moves.
    if touch is None or abs(correction) > max(touch.error_s, 0.5 * float(np.median(np.diff(t)))):
        return None
    return replace(touch, error_s=float(np.hypot(touch.error_s, correction)))


def samples_near(time: Array, angle: Array, near: float, period: float) -> tuple[Array, Array]:
    """Return the samples around an instant (times from it, and angles), with more of the step if samples are sparse."""
    place = int(np.searchsorted(time, near))
    away = np.sort(np.abs(time[max(0, place - 2 * MIN_SAMPLES) : place + 2 * MIN_SAMPLES] - near))
    wanted = float(away[: 2 * MIN_SAMPLES][-1])
    rows = rows_within(time, near, max(WINDOW * period, min(wanted, MAX_FIT_TIME * period)))
    return time[rows] - near, angle[rows]


def rows_within(time: Array, instant: float, half: float) -> slice:
    """Return the samples within half a span of time before and after an instant."""
    return slice(int(np.searchsorted(time, instant - half)), int(np.searchsorted(time, instant + half, "right")))


def touch_of(fit: Fit, height: Height, time: float, leg: int) -> Touch:
    """Return the heel strike of a leg at the time (s) of a fit."""
    small = 1e-6 * np.eye(2)
    values = height(np.concatenate((fit.angle + small, fit.angle - small)))
    gradient = (values[:2] - values[2:]) / 2e-6
    slope = float(gradient @ next(iter(fit.rates.values())))
    error = np.hypot(fit.deviation * np.hypot(*gradient) / abs(slope), LASTING_S) if slope else np.inf
    return Touch(time, leg, float(error), slope if leg else -slope, fit)


def best_degree(t: Array, y: Array, at: float) -> int:
    """Return the degree of the polynomials that describe the samples best."""
    fits = {degree: fit for degree in DEGREES if (fit := fit_of_degree(t, y, at, degree)) is not None}
    return min(fits, key=lambda degree: fits[degree].criterion, default=DEGREES[0])


def fit_at(t: Array, y: Array, at: float, degree: int) -> Fit | None:
    """Fit polynomials of a degree, or of one more on a single side, where an instant is at the end of the samples."""
    fit = fit_of_degree(t, y, at, degree)
    return fit if fit and len(fit.rates) == SIDES else fit_of_degree(t, y, at, degree + 1) or fit


def add_bias(fit: Fit, t: Array, y: Array, at: float, degree: int) -> Fit:
    """Return a fit whose error includes the change due to one more degree, since the best one balances bias and
    scatter.
    """
    narrow, wide = (fit_of_degree(t, y, at, each) for each in (degree, degree + 1))
    change = float(np.linalg.norm(wide.angle - narrow.angle)) if narrow and wide else 0.0
    return replace(fit, deviation=float(np.hypot(fit.deviation, change / len(fit.rates))))


def fit_of_degree(t: Array, y: Array, at: float, degree: int) -> Fit | None:
    """Fit polynomials before and after an instant that meet there, or return None if both sides have too few samples.

    A side with too few samples, for example where a recording begins just before a strike, is not fitted, because
    it would force a low degree on the other side.
    """
    both = {"before": t < at, "after": t >= at}
    fewest = max(degree + 1, LOPSIDED * max(int(np.sum(side)) for side in both.values()))
    sides = {name: side for name, side in both.items() if np.sum(side) >= fewest}
    if not sides:
        return None
    used = np.any(list(sides.values()), axis=0)
    scale = float(np.ptp(t))
    powers = ((t - at) / scale)[:, None] ** np.arange(1, degree + 1)
    basis = np.concatenate([np.ones((t.size, 1)), *(side[:, None] * powers for side in sides.values())], axis=1)[used]
    count, columns = basis.shape
    if count <= columns:
        return None
    orthonormal, triangle = np.linalg.qr(basis)
    inverse = np.linalg.inv(triangle)
    coefficients = inverse @ (orthonormal.T @ y[used])
    squares = float(np.sum((y[used] - basis @ coefficients) ** 2)) + SMALLEST
    freedoms = 2 * (count - columns)
    rates = {name: coefficients[1 + k * degree] / scale for k, name in enumerate(sides)}
    deviation = float(np.sqrt(squares / freedoms) * np.linalg.norm(inverse[0]))
    criterion = 2 * count * float(np.log(squares)) + 2 * columns * float(np.log(2 * count)) * count / (count - columns)
    return Fit(coefficients[0], rates, squares, freedoms, deviation, criterion)


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
    inside = [touch for touch in touches if time[0] + half <= touch.time_s <= time[-1] - half][:MOST_JUMPS]
    near = [(touch.time_s, rows_within(time, touch.time_s, half)) for touch in inside]

    def fits_at(shift: float) -> list[Fit]:
        fits = (fit_of_degree(time[rows] - instant, angle[rows], shift, JUMP_DEGREE) for instant, rows in near)
        return [fit for fit in fits if fit is not None and len(fit.rates) == SIDES]

    trials = {shift: fits_at(shift) for shift in (np.linspace(-0.5, 0.5, SHIFTS) * half).tolist()}
    squares = {shift: sum(fit.squares for fit in fits) for shift, fits in trials.items() if len(fits) == len(inside)}
    shifts = list(squares)
    if not inside or 0.0 not in squares:
        return None
    index = min(range(len(shifts)), key=lambda k: squares[shifts[k]])
    best = shifts[index]
    least = squares[shifts[index]]
    variance = least / sum(fit.freedoms for fit in trials[best])
    if squares[0.0] - least <= errors**2 * variance or not 0 < index < len(shifts) - 1:
        return None
    # the smallest residuals between three trials, by a parabola
    before, after = squares[shifts[index - 1]], squares[shifts[index + 1]]
    best += 0.5 * (before - after) / (before - 2.0 * least + after) * (shifts[index + 1] - best)
    fits = fits_at(best)
    if abs(best) <= PRECISE_S or len(fits) < len(inside):
        return None
    return best, np.array([fit.angle for fit in fits]), np.array([touch.leg for touch in inside])
