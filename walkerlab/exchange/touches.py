"""Find the heel strikes in recorded angles.

A foot strikes when it is ahead and its height over the other foot falls to zero. Noise repeats such crossings, so
consecutive crossings of one leg count as one strike. Its time is the zero of the height in a smooth fit of the angles:
one polynomial before the strike and one after it, which meet at the strike, because only the rates jump.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Final

import numpy as np

from walkerlab.exchange.rate_jumps import AHEAD, WINDOW, Array, typical_interval

Height = Callable[[Array], Array]

TOUCH_DEGREE: Final = 3
FEWEST: Final = 6
"""Fewest samples before a heel strike that a fit needs."""
ITERATIONS: Final = 8


@dataclass(frozen=True)
class Touch:
    """Heel strike: time (s), leg that strikes (0 or 1), and scatter of the angles around it (rad)."""

    time_s: float
    leg: int
    scatter_rad: float


def find_touches(time: Array, angle: Array, height: Height) -> list[Touch]:
    """Find the heel strikes in the angles of both legs.

    time    (samples,) s, rising
    angle   (samples, 2) rad, from the vertical, positive with the foot ahead
    height  function from angles (samples, 2) to the height (samples,) of leg 0's foot over leg 1's (m, normal to slope)
    """
    crossings = merge_repeats(candidates(time, angle, height))
    period = typical_interval([crossing for crossing, _ in crossings], time)
    return [locate_touch(time, angle, height, crossing, leg, period) for crossing, leg in crossings]


def candidates(time: Array, angle: Array, height: Height) -> list[tuple[float, int]]:
    """Return times at which the foot ahead falls to the other's level, and its leg; noise may repeat a heel strike."""
    # A recording may end with a heel strike, so its last two samples are continued by half an interval.
    time = np.append(time, 1.5 * time[-1] - 0.5 * time[-2])
    angle = np.append(angle, 1.5 * angle[-1:] - 0.5 * angle[-2:-1], axis=0)
    spread, over = angle[:, 0] - angle[:, 1], height(angle)
    apart = AHEAD * np.abs(spread).max()
    crossings = []
    for i in np.flatnonzero((over[:-1] > 0.0) != (over[1:] > 0.0)):
        leg, ahead = (0, spread[i]) if over[i] > 0.0 else (1, -spread[i])
        if ahead > apart:
            share = over[i] / (over[i] - over[i + 1])
            crossings.append((float(time[i] + share * (time[i + 1] - time[i])), leg))
    return crossings


def merge_repeats(crossings: list[tuple[float, int]]) -> list[tuple[float, int]]:
    """Average the consecutive crossings of a leg, which belong to one heel strike."""
    strikes = [(leg, [time for time, _ in repeats]) for leg, repeats in groupby(crossings, itemgetter(1))]
    return [(float(np.mean(times)), leg) for leg, times in strikes]


def locate_touch(time: Array, angle: Array, height: Height, near: float, leg: int, period: float) -> Touch:
    """Locate the heel strike near a crossing by a fit of the angles; with too few samples, return the crossing."""
    half = WINDOW * period
    inside = np.abs(time - near) <= half
    t, y, touch, scatter = (time[inside] - near) / half, angle[inside], 0.0, 0.0
    if np.count_nonzero(t <= 0.0) < FEWEST:
        return Touch(near, leg, 0.0)
    for _ in range(ITERATIONS):
        at_touch, rate, scatter = fit_around(t, y, touch)
        over = height(np.array([at_touch, at_touch + 1e-6 * rate, at_touch - 1e-6 * rate]))
        slope = (over[1] - over[2]) / 2e-6
        correction = float(np.clip(-over[0] / slope, -0.5, 0.5)) if slope else 0.0
        touch += correction
        if abs(correction) < 1e-9:
            break
    return Touch(near + touch * half, leg, scatter)


def fit_around(t: Array, y: Array, touch: float) -> tuple[Array, Array, float]:
    """Fit polynomials that meet at a heel strike; return the angles at it, the rates before it, and the scatter."""
    before, after = np.minimum(t - touch, 0.0), np.maximum(t - touch, 0.0)
    sides = [
        side[:, None] ** np.arange(1, TOUCH_DEGREE + 1)
        for side in (before, after)
        if np.count_nonzero(side) >= TOUCH_DEGREE
    ]
    basis = np.concatenate([np.ones((t.size, 1)), *sides], axis=1)
    coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
    freedoms = max(1, y.size - coefficients.size)
    return coefficients[0], coefficients[1], float(np.sqrt(np.sum((y - basis @ coefficients) ** 2) / freedoms))
