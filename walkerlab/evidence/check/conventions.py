"""Conventions of printed states: their angles, the origin of angles, the order, the instant and the units."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product, starmap
from typing import Any, Final, get_args

import numpy as np

from walkerlab.config.check import Check, Instant
from walkerlab.errors import ConfigError
from walkerlab.evidence.check.plain_walker import (
    BENT,
    EXACT,
    SHANK,
    STANCE,
    SWING,
    Floats,
    PlainStep,
    PlainWalker,
)

BODIES: Final = {"swing": SWING, "stance": STANCE, "shank": SHANK}
DEFAULT_ORDERS: Final = {2: ("stance",), 4: ("swing", "stance"), 6: ("swing", "stance", "shank")}
GRAVITIES: Final = (1.0, 9.8, 9.81, 10.0)
SCALED: Final = "sqrt(L/g)"
FEET_DIGITS = 5.0  # largest distance of the feet from the slope, in units of the last digit


@dataclass(frozen=True)
class Convention:
    """Conventions that determine the meaning of a printed state and of printed times."""

    origin: str  # vertical or slope-normal
    second: str  # absolute, relative or stance-minus-swing
    unit: str  # rad or deg
    positive: str  # counter-clockwise or clockwise
    order: tuple[str, ...]  # bodies
    layout: str  # angles-first or interleaved
    instant: Instant
    time: str = ""  # sqrt(L/g), or the gravity that was used; empty for the config's
    steps: int = 1  # steps that a printed period, length or multiplier belongs to

    def rows(self, bodies: int) -> Floats:
        """Return the matrix (printed angles, bodies) from absolute angles to printed ones of the same origin."""
        sign = (1.0 if self.positive == "counter-clockwise" else -1.0) * (
            math.degrees(1.0) if self.unit == "deg" else 1.0
        )
        K = np.zeros((len(self.order), bodies))
        for row, body in enumerate(self.order):
            K[row, BODIES[body]] = sign
            if self.second == "absolute" or row == 0:
                continue
            if body == "shank":
                K[row, SWING] = -sign
            else:
                K[row, SWING], K[row, STANCE] = sign, -sign
                K[row] *= -1.0 if self.second == "stance-minus-swing" else 1.0
        return K

    def write(self, walker: PlainWalker, state: Floats) -> list[float]:
        """Return the printed numbers of a state: absolute angles from the slope's normal, then rates, of all bodies."""
        n = len(state) // 2
        K = self.rows(n)
        angles = K @ (state[:n] - (walker.slope if self.origin == "vertical" else 0.0))
        rates = K @ state[n:] * self.rate_factor(walker)
        pairs = np.stack((angles, rates))
        return list((pairs.T if self.layout == "interleaved" else pairs).ravel().tolist())

    def read(self, walker: PlainWalker, numbers: Sequence[float], known: Floats) -> Floats:
        """Return the state that printed numbers describe. Bodies that are not printed move as in the state `known`."""
        n = len(known) // 2
        count = len(self.order)
        table = np.reshape(numbers, (count, 2)).T if self.layout == "interleaved" else np.reshape(numbers, (2, count))
        K = self.rows(n)
        tilt = walker.slope if self.origin == "vertical" else 0.0
        free = [body for body in range(n) if not K[:, body].any()]
        square = np.vstack((K, np.eye(n)[free]))
        state = known.copy()
        state[:n] = tilt + np.linalg.solve(square, [*table[0], *(known[body] - tilt for body in free)])
        state[n:] = np.linalg.solve(square, [*table[1] / self.rate_factor(walker), *(known[n + body] for body in free)])
        if SWING in free and self.instant == "after-strike":
            state[SWING] = -2.0 * walker.lean - state[STANCE]
        if SHANK in free and n > SHANK:
            state[SHANK], state[n + SHANK] = state[SWING], state[n + SWING]
        return state

    def rate_factor(self, walker: PlainWalker) -> float:
        """Return the factor on rates, and on the inverse of times, due to the unit of time."""
        if not self.time:
            return 1.0
        if self.time == SCALED:
            return walker.pendulum_time
        return math.sqrt(float(self.time) / walker.gravity)

    def differences(self, other: Convention) -> Iterator[str]:
        """Describe each difference of this convention from another."""
        if self.origin != other.origin:
            yield f"angles are measured from {'the vertical' if self.origin == 'vertical' else 'the slope’s normal'}"
        if self.second != other.second:
            yield SECOND_WORDS[self.second]
        if self.unit != other.unit:
            yield f"angles are in {'degrees' if self.unit == 'deg' else 'radians'}"
        if self.positive != other.positive:
            yield f"positive angles turn {self.positive}"
        if self.order != other.order:
            yield f"the order is {', '.join(self.order)}"
        if self.layout != other.layout:
            rates = "each rate follows its angle" if self.layout == "interleaved" else "the rates follow all angles"
            yield rates
        if self.instant != other.instant:
            yield f"the state is that {INSTANT_WORDS[self.instant]}"
        if self.steps != other.steps:
            yield "period, length and multipliers are those of a stride, which has two steps"
        if self.time != other.time:
            yield "time is in units of sqrt(L/g)" if self.time == SCALED else f"gravity is {self.time} m/s²"


SECOND_WORDS: Final = {
    "absolute": "the second angle is absolute",
    "relative": "the second angle is relative, swing leg minus stance leg",
    "stance-minus-swing": "the second angle is relative, stance leg minus swing leg",
}
INSTANT_WORDS: Final = {
    "after-strike": "just after the heel strike",
    "before-strike": "just before the heel strike",
    "mid-stance": "in mid-stance",
}


def stated(check: Check, count: int, bodies: int, name: str = "state") -> Convention:
    """Return the convention that a config states for a printed state of `count` numbers.

    Raises ConfigError if they do not fit.
    """
    angles = check.angles
    instant = "before-strike" if name == "state_before" else check.instant
    order = angles.order or DEFAULT_ORDERS.get(count)
    fits = order is not None and 2 * len(order) == count
    if order is None or not fits or any(BODIES[body] >= bodies for body in order):
        possible = "swing, stance" + (", shank" if bodies > SHANK else "")
        raise ConfigError(
            f"check: {name} has {count} values, which do not fit an order of {', '.join(order or ['unknown bodies'])}.",
            f"Give an angle and a rate for each body of check.angles.order; this walker has {possible}.",
            ("check", "angles") if angles.order else ("check", "printed", name),
        )
    return Convention(angles.origin, angles.second, angles.unit, angles.positive, order, angles.layout, instant)


def put_feet_on_slope(convention: Convention, walker: PlainWalker, numbers: Sequence[float], unit: float) -> Convention:
    """Return the convention with the sign of the relative angle chosen such that both feet are on the slope.

    unit  unit of the angles' last digit
    """
    if convention.second != "relative" or len(convention.order) < 2 or convention.instant == "mid-stance":
        return convention

    def miss(reading: Convention) -> float:
        known = np.zeros(6 if walker.kneed else 4)
        return abs(walker.feet_apart(reading.read(walker, numbers, known)))

    opposite = replace(convention, second="stance-minus-swing")
    near = FEET_DIGITS * unit * (math.radians(1.0) if convention.unit == "deg" else 1.0)
    return opposite if miss(opposite) <= near < miss(convention) else convention


def alternatives(convention: Convention) -> Iterator[Convention]:
    """Yield all other conventions, those with the fewest differences first."""
    orders = list(permutations(convention.order)) if len(convention.order) > 1 else [convention.order]
    if convention.order in (("stance",), ("swing",)):
        orders = [("stance",), ("swing",)]
    seconds = tuple(SECOND_WORDS) if len(convention.order) > 1 else (convention.second,)
    layouts = ("angles-first", "interleaved") if len(convention.order) > 1 else (convention.layout,)
    choices: tuple[Sequence[Any], ...] = (
        ("vertical", "slope-normal"), seconds, ("rad", "deg"), ("counter-clockwise", "clockwise"), orders, layouts,
        get_args(Instant), ("", SCALED, *(f"{gravity:g}" for gravity in GRAVITIES)), (1, 2),
    )  # fmt: skip
    found = starmap(Convention, product(*choices))
    yield from sorted(found, key=lambda other: len(list(other.differences(convention))))[1:]


def coordinates_of(walker: PlainWalker, state: Floats) -> Floats:
    """Return the coordinates just after a heel strike from the state of all bodies."""
    n = len(state) // 2
    return np.concatenate((state[:2], state[n : n + 2 + int(walker.kneed and walker.free_at_strike)]))


def state_at(walker: PlainWalker, start: Floats, step: PlainStep, instant: Instant, vertical: bool) -> Floats | None:
    """Return the state of all bodies at an instant of a step, or None if the step has no such instant.

    vertical  whether mid-stance is where the stance leg is vertical; otherwise it is normal to the slope
    """
    if instant == "after-strike":
        return walker.full_state(start)
    if instant == "before-strike":
        return walker.full_state(step.before)
    upright = walker.slope if vertical else 0.0

    def lean(state: Floats) -> float:
        return float(state[STANCE]) - upright

    for piece in step.pieces:
        if piece.start[STANCE] > upright >= piece.end[STANCE]:
            middle = walker.swing(piece.phase, piece.start, lean, lambda _: True, EXACT)
            if middle is not None:
                return middle.end if middle.phase == BENT else walker.full_state(middle.end)
    return None


def start_from(walker: PlainWalker, state: Floats, instant: Instant) -> Floats | None:
    """Return the coordinates just after the heel strike that a state leads to, or None if it leads to none."""
    if instant == "after-strike":
        return coordinates_of(walker, state)
    n = len(state) // 2
    if instant == "before-strike":
        return walker.after_strike(np.concatenate((state[:2], state[n : n + 2])))
    landed = walker.land(state)
    return None if landed is None else walker.after_strike(landed[-1].end)
