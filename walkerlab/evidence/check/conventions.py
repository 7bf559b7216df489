"""Conventions of printed states: their angles, the origin of angles, the order, the instant and the units."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product, starmap
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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
from walkerlab.evidence.check.printed import Item

BODIES: Final = {"swing": SWING, "stance": STANCE, "shank": SHANK}
DEFAULT_ORDERS: Final = {2: ("stance",), 4: ("swing", "stance"), 6: ("swing", "stance", "shank")}
GRAVITIES: Final = (1.0, 9.8, 9.81, 10.0)
SCALED: Final = "sqrt(L/g)"
RAD_IN_DEG: Final = math.degrees(1.0)
FEET_DIGITS = 5.0  # largest distance of the feet from the slope, in units of the last digit
CHOICES: Final[Mapping[str, tuple[str, Mapping[Any, str]]]] = {
    "origin": ("angles are measured from {}", {"vertical": "the vertical", "slope-normal": "the slope’s normal"}),
    "second": ("the second angle is {}", {
        "absolute": "absolute", "relative": "relative, swing leg minus stance leg",
        "stance-minus-swing": "relative, stance leg minus swing leg",
    }),
    "unit": ("angles are in {}", {"rad": "radians", "deg": "degrees"}),
    "positive": ("positive angles turn {}", {turn: turn for turn in ("counter-clockwise", "clockwise")}),
    "order": ("the order is {}", {
        order: ", ".join(order) for count in (1, 2, 3) for order in permutations(BODIES, count)
    }),
    "layout": ("{}", {
        "angles-first": "the rates follow all angles", "interleaved": "each rate follows its angle",
    }),
    "instant": ("the state is that {}", {
        "after-strike": "just after the heel strike", "before-strike": "just before the heel strike",
        "mid-stance": "in mid-stance",
    }),
    "steps": ("period, length and multipliers are those of {}", {1: "a step", 2: "a stride, which has two steps"}),
    "time": ("{}", {
        "": "time is in seconds", SCALED: "time is in units of sqrt(L/g)",
        **{f"{gravity:g}": f"gravity is {gravity:g} m/s²" for gravity in GRAVITIES},
    }),
}  # fmt: skip
"""Conventions: for each, a sentence about it, and the words for its values."""


@dataclass(frozen=True)
class Convention:
    """Conventions that determine the meaning of a printed state and of printed times. `CHOICES` has their values."""

    origin: str
    second: str
    unit: str
    positive: str
    order: tuple[str, ...]
    layout: str
    instant: Instant
    steps: int = 1  # steps that a printed period, length or multiplier belongs to
    time: str = ""  # unit of time, or the gravity that was used; empty for the config's

    def rows(self, bodies: int) -> Floats:
        """Return the matrix (printed angles, bodies) from absolute angles to printed ones, without their origin."""
        K = np.eye(bodies)[[BODIES[body] for body in self.order]]
        second = (1.0, -1.0) if self.second == "relative" else (-1.0, 1.0)
        for row, body in enumerate(self.order):
            if row and self.second != "absolute":
                K[row, :2] = (-1.0, 0.0) if body == "shank" else second
        return K * (1.0 if self.positive == "counter-clockwise" else -1.0) * (RAD_IN_DEG if self.unit == "deg" else 1.0)

    def arrange(self, pairs: NDArray[Any]) -> list[Any]:
        """Return angles and rates, or their names (2, bodies), in the order in which they are printed."""
        return list((pairs.T if self.layout == "interleaved" else pairs).ravel().tolist())

    @property
    def names(self) -> list[str]:
        """Names of the numbers of a printed state."""
        return self.arrange(np.array([[f"{body}_{kind}" for body in self.order] for kind in ("angle", "rate")]))

    def write(self, walker: PlainWalker, state: Floats) -> list[float]:
        """Return the printed numbers of a state: absolute angles from the slope's normal, then rates, of all bodies."""
        angles, rates = np.reshape(state, (2, -1))
        K = self.rows(len(angles))
        tilt = walker.slope if self.origin == "vertical" else 0.0
        return self.arrange(np.stack((K @ (angles - tilt), K @ rates * self.rate_factor(walker))))

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
        state[:n] = tilt + np.linalg.solve(square, [*table[0], *(known[free] - tilt)])
        state[n:] = np.linalg.solve(square, [*table[1] / self.rate_factor(walker), *known[n:][free]])
        if SWING in free and self.instant == "after-strike":
            state[SWING] = -2.0 * walker.lean - state[STANCE]
        if SHANK in free and n > SHANK:
            state[SHANK], state[n + SHANK] = state[SWING], state[n + SWING]
        return state

    def rate_factor(self, walker: PlainWalker) -> float:
        """Return the factor on rates, and on the inverse of times, due to the unit of time."""
        if self.time == SCALED:
            return walker.pendulum_time
        return math.sqrt(float(self.time) / walker.gravity) if self.time else 1.0

    def differences(self, other: Convention) -> list[str]:
        """Describe each difference of this convention from another."""
        values = {name: getattr(self, name) for name in CHOICES}
        changes = {name: value for name, value in values.items() if value != getattr(other, name)}
        return [CHOICES[name][0].format(CHOICES[name][1][value]) for name, value in changes.items()]


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


def put_feet_on_slope(convention: Convention, walker: PlainWalker, items: Sequence[Item]) -> Convention:
    """Return a printed state's convention, with the sign of its relative angle such that both feet are on the slope."""
    if convention.second != "relative" or len(convention.order) < 2 or convention.instant == "mid-stance":
        return convention

    def miss(reading: Convention) -> float:
        known = np.zeros(6 if walker.kneed else 4)
        return abs(walker.feet_apart(reading.read(walker, [item.value for item in items], known)))

    opposite = replace(convention, second="stance-minus-swing")
    near = FEET_DIGITS * max(item.last_digit for item in items) / (RAD_IN_DEG if convention.unit == "deg" else 1.0)
    return opposite if miss(opposite) <= near < miss(convention) else convention


def alternatives(convention: Convention) -> list[Convention]:
    """Return all other conventions, those with the fewest differences first."""
    possible: dict[str, Collection[Any]] = {name: words for name, (_, words) in CHOICES.items()}
    if len(convention.order) > 1:
        possible["order"] = [*permutations(convention.order)]
    else:
        single = [("stance",), ("swing",)] if convention.order != ("shank",) else [convention.order]
        possible |= {"order": single, "second": [convention.second], "layout": [convention.layout]}
    found = starmap(Convention, product(*possible.values()))
    return sorted(found, key=lambda other: len(other.differences(convention)))[1:]


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
