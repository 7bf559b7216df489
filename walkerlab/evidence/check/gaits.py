"""Gaits of plain walkers, and their values in the conventions in which they are printed.

A convention says how to read a printed state: its instant, the order and origin of the angles, and the units.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import permutations, product, starmap
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.check import Check, Instant
from walkerlab.errors import ConfigError
from walkerlab.evidence.check import plain_walker as plain
from walkerlab.evidence.check.plain_walker import BENT, EXACT, SHANK, STANCE, SWING, Floats, PlainStep, PlainWalker
from walkerlab.evidence.check.printed import Item, match_multipliers

BODIES: Final = {"swing": SWING, "stance": STANCE, "shank": SHANK}
DEFAULT_ORDERS: Final = {2: ("stance",), 4: ("swing", "stance"), 6: ("swing", "stance", "shank")}
GRAVITIES: Final = (1.0, 9.8, 9.81, 10.0)
SCALED: Final = "sqrt(L/g)"
RAD_IN_DEG: Final = math.degrees(1.0)
# The feet count as standing on the slope if they are within this distance of it, in units of the last digit.
FEET_DIGITS = 5.0
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
"""Choices that make up a convention. Each has a clause with a gap and, for each value, the words that fill the gap."""
BEFORE: Instant = "before-strike"
Values = dict[str, complex | None]
"""Values of printed numbers by name, or None for a number that the gait does not have."""
POWERS_OF_TIME = {"period_s": -1, "knee_strike_s": -1, "speed_m_s": 1}
"""Exponent of 1/s in the unit of a quantity."""
SUMMED_OVER_STEPS = ("period_s", "step_length_m")
"""Quantities whose value for a stride is the sum of the values of its steps."""
# Displacement (rad, and rad/s times sqrt(L/g)) for central differences: near the optimum for errors of `EXACT`.
DIFFERENCE = 1e-6
MAX_MOVES = 16  # iterations of Newton's method
SMALLEST_MOVE = 1e-13  # a gait that moves by less over a step is accepted at once
MAX_RESIDUAL = 1e-11  # a gait may have this residual if rounding prevents further progress
SLOW_RATIO = 0.1  # if the error shrinks by less than this factor, the derivative is computed again


@dataclass(frozen=True)
class Convention:
    """How a printed state and printed times are to be read. `CHOICES` describes the fields and their values."""

    origin: str
    second: str
    unit: str
    positive: str
    order: tuple[str, ...]
    layout: str
    instant: Instant
    steps: int = 1  # number of steps to which a printed period, length or multiplier refers
    time: str = ""  # unit of time, or gravity that was used. Empty for seconds and the config's gravity

    def rows(self, bodies: int) -> Floats:
        """Return the matrix (printed angles, bodies) that converts the absolute angles of all bodies into printed ones.

        Both are measured from the same origin.
        """
        K = np.eye(bodies)[[BODIES[body] for body in self.order]]
        second = (1.0, -1.0) if self.second == "relative" else (-1.0, 1.0)
        for row, body in enumerate(self.order):
            if row and self.second != "absolute":
                K[row, :2] = (-1.0, 0.0) if body == "shank" else second
        return K * (1.0 if self.positive == "counter-clockwise" else -1.0) * (RAD_IN_DEG if self.unit == "deg" else 1.0)

    def arrange(self, pairs: NDArray[Any]) -> list[Any]:
        """Return angles and rates (2, bodies), or their names, as a list in the printed order."""
        return list((pairs.T if self.layout == "interleaved" else pairs).ravel().tolist())

    @property
    def names(self) -> list[str]:
        """Names of the components of a printed state, in the printed order."""
        return self.arrange(np.array([[f"{body}_{kind}" for body in self.order] for kind in ("angle", "rate")]))

    def write(self, walker: PlainWalker, state: Floats) -> list[float]:
        """Return the numbers that would be printed for a state.

        state  absolute angles of all bodies from the slope's normal, then their rates
        """
        angles, rates = np.reshape(state, (2, -1))
        K = self.rows(len(angles))
        tilt = walker.slope if self.origin == "vertical" else 0.0
        return self.arrange(np.stack((K @ (angles - tilt), K @ rates * self.rate_factor(walker))))

    def read(self, walker: PlainWalker, numbers: Sequence[float], known: Floats) -> Floats:
        """Return the state that printed numbers describe. Bodies without printed numbers move as in `known`."""
        n = len(known) // 2
        count = len(self.order)
        table = np.reshape(numbers, (count, 2)).T if self.layout == "interleaved" else np.reshape(numbers, (2, count))
        K = self.rows(n)
        tilt = walker.slope if self.origin == "vertical" else 0.0
        # Bodies without printed numbers keep their known motion. This makes the system square.
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

    def stands(self, walker: PlainWalker, items: Sequence[Item]) -> bool:
        """Whether both feet of a printed state are on the slope, within its digits. It is False in mid-stance."""
        state = self.read(walker, [item.value for item in items], np.zeros(6 if walker.kneed else 4))
        near = FEET_DIGITS * max(item.last_digit for item in items) / (RAD_IN_DEG if self.unit == "deg" else 1.0)
        return self.instant != "mid-stance" and abs(walker.feet_apart(state)) <= near

    def rate_factor(self, walker: PlainWalker) -> float:
        """Return the factor by which the unit of time multiplies rates and divides times."""
        if self.time == SCALED:
            return walker.pendulum_time
        return math.sqrt(float(self.time) / walker.gravity) if self.time else 1.0

    def differences(self, other: Convention) -> list[str]:
        """Describe each choice of this convention that differs from `other`."""
        values = {name: getattr(self, name) for name in CHOICES}
        changes = {name: value for name, value in values.items() if value != getattr(other, name)}
        return [CHOICES[name][0].format(CHOICES[name][1][value]) for name, value in changes.items()]


def stated(check: Check, count: int, bodies: int, name: str = "state") -> Convention:
    """Return the convention that a config states for a printed state of `count` numbers.

    bodies  number of bodies of the walker
    name    key of the state

    Raises ConfigError if the numbers do not fit the order of the bodies.
    """
    angles = check.angles
    instant = "before-strike" if name == "state_before" else check.instant
    order = angles.order or DEFAULT_ORDERS.get(count)
    fits = order is not None and 2 * len(order) == count
    if order is None or not fits or any(BODIES[body] >= bodies for body in order):
        possible = "swing, stance" + (", shank" if bodies > SHANK else "")
        raise ConfigError(
            f"check: {name} has {count} values, which do not fit the bodies {', '.join(order or ['(unknown)'])}.",
            f"Give an angle and a rate for each body of check.angles.order; this walker has {possible}.",
            ("check", "angles") if angles.order else ("check", "printed", name),
        )
    return Convention(angles.origin, angles.second, angles.unit, angles.positive, order, angles.layout, instant)


def put_feet_on_slope(convention: Convention, walker: PlainWalker, items: Sequence[Item]) -> Convention:
    """Return the convention, with the sign of a relative angle that puts both feet of the printed state on the slope.

    Return it unchanged if the angle is not relative, or if neither sign puts them there.
    """
    if convention.second != "relative" or len(convention.order) < 2 or convention.stands(walker, items):
        return convention
    opposite = replace(convention, second="stance-minus-swing")
    return opposite if opposite.stands(walker, items) else convention


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


def derivative(walker: PlainWalker, start: Floats, tolerance: float = EXACT) -> Floats | None:
    """Return the derivative of the step map at a start by central differences, or None if a step fails."""
    columns = []
    for move in np.diag(DIFFERENCE * plain.scales(walker, len(start))):
        first, second = (plain.take_step(walker, moved, tolerance) for moved in (start + move, start - move))
        if first is None or second is None:
            return None
        columns.append((first.after - second.after) / (2.0 * move.sum()))
    return np.array(columns).T


@dataclass(frozen=True, eq=False)
class CheckedStep:
    """A step that is a gait of the walker, or a first guess of one."""

    walker: PlainWalker
    start: Floats  # coordinates just after the heel strike
    step: PlainStep

    @cached_property
    def derivative(self) -> Floats | None:
        return derivative(self.walker, self.start)

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the step map, largest first, without the one that is always zero."""
        if self.derivative is None:
            return ()
        # Just after a strike both feet are on the slope, so one combination of the coordinates never changes. Its
        # multiplier is zero.
        values = sorted(map(complex, np.linalg.eigvals(self.derivative).tolist()), key=abs, reverse=True)
        return tuple(values[:-1])

    def quantity(self, name: str) -> Any:
        """Return a value of the gait by name, or None if the plain model does not compute it."""
        if name == "multipliers":
            return self.multipliers
        if name == "spectral_radius":
            return abs(self.multipliers[0]) if self.multipliers else None
        speed = self.step.length / self.step.period
        return {
            "period_s": self.step.period,
            "step_length_m": self.step.length,
            "speed_m_s": speed,
            "froude": speed / math.sqrt(self.walker.gravity * self.walker.leg_length),
            "knee_strike_s": self.step.knee_strike,
        }.get(name)

    def values(
        self, items: Sequence[Item], convention: Convention, measured: Mapping[str, Any] | None = None
    ) -> Values:
        """Return the correct value of each printed number in the given convention, or None if no model computes it.

        measured  values of the compiled model by name, which replace those of the plain one
        """
        instants = {"state": convention.instant, "state_before": BEFORE}
        values: Values = {}
        known: dict[str, Any] = {}
        for name in {item.quantity for item in items}:
            if name in instants:
                state = self.state(instants[name], convention.origin == "vertical")
                known[name] = [] if state is None else convention.write(self.walker, state)
            else:
                known[name] = measured[name] if measured and name in measured else self.quantity(name)
        for item in items:
            value = known[item.quantity]
            if isinstance(value, list | tuple):
                value = value[item.place] if item.place < len(value) else None
            if value is not None:
                value *= convention.rate_factor(self.walker) ** POWERS_OF_TIME.get(item.quantity, 0)
                value *= convention.steps if item.quantity in SUMMED_OVER_STEPS else 1
                value = complex(value ** (convention.steps if item.quantity == "spectral_radius" else 1))
            values[item.name] = value
        listed = [item for item in items if item.quantity == "multipliers"]
        return values | match_multipliers(listed, [value**convention.steps for value in known.get("multipliers", ())])

    @cache  # noqa: B019 - walks are few, and live as long as their check
    def state(self, instant: Instant, vertical: bool) -> Floats | None:
        """Return the state of all bodies at an instant of the step, or None if the step has no such instant.

        vertical  whether the stance leg is vertical in mid-stance. If not, it is normal to the slope
        """
        if instant != "mid-stance":
            return plain.full_state(self.walker, self.start if instant == "after-strike" else self.step.before)
        upright = self.walker.slope if vertical else 0.0

        def lean(state: Floats) -> float:
            return float(state[STANCE]) - upright

        for piece in self.step.pieces:
            # The stance leg falls forwards, so its angle decreases.
            if piece.start[STANCE] > upright >= piece.end[STANCE]:
                middle = plain.swing_until(self.walker, piece.phase, piece.start, lean, lambda _: True, EXACT)
                if middle is not None:
                    return middle.end if middle.phase == BENT else plain.full_state(self.walker, middle.end)
        return None


def gait_near(walker: PlainWalker, start: Floats, A: Floats | None = None) -> CheckedStep | None:
    """Find the gait near a start by Newton's method, or return None if it is not found.

    A  derivative of the step map of a similar walker, used until the search slows down
    """
    unit = plain.scales(walker, len(start))
    best: CheckedStep | None = None
    x: Floats = np.array(start, float)
    last = math.inf
    is_own = False  # whether A is this walker's own derivative
    for _ in range(MAX_MOVES):
        step = plain.take_step(walker, x)
        size = math.inf if step is None else float(np.abs((step.after - x) / unit).max())
        if step is not None and size < last:
            best = CheckedStep(walker, x, step)
            if size < SMALLEST_MOVE:
                return best
            slow = size > SLOW_RATIO * last
            last = size
        # A search this close to its goal has succeeded: only rounding keeps it from coming closer.
        elif best is None or last < MAX_RESIDUAL:
            return best
        elif is_own:
            # The move was too long, even with the right derivative.
            x = 0.5 * (x + best.start)
            continue
        else:
            slow = True
        if A is None or slow:
            A = derivative(walker, best.start, 1e-10)
            is_own = True
            if A is None:
                return None
        x = best.start - np.linalg.solve(A - np.eye(len(x)), best.step.after - best.start)
    return None
