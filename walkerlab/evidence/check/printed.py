"""Comparison of printed values with right ones: the number of digits that agree, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from walkerlab.config.check import Digits, PrintedValue, agreement, parse_printed
from walkerlab.labels import axis_label

REPRODUCED = "reproduced"
DIFFERENT = "different"
NOT_COMPARABLE = "not-comparable"
EXPLAINED = "explained"
UNEXPLAINED = "different, unexplained"
# At least this many digits must agree, and at least half of them, where the last ones may differ.
FEWEST_DIGITS = 3
OWN_ERROR: Final = {"multipliers": 2e-10, "spectral_radius": 2e-10}
"""Numerical error of right values (relative to 1 or to the value) by quantity; of all others `EXACT_ERROR`."""
EXACT_ERROR = 2e-12


@dataclass(frozen=True)
class Item:
    """One printed number, or one component of a printed list."""

    name: str  # such as period_s, state.stance_angle or multipliers.1
    quantity: str  # name without its component
    place: int  # index of the component
    printed: PrintedValue

    def own_error(self, right: complex) -> float:
        return OWN_ERROR.get(self.quantity, EXACT_ERROR) * max(1.0, abs(right))

    @property
    def digits(self) -> int:
        """Number of printed digits."""
        parts = [self.printed.real, *([self.printed.imaginary] if self.printed.imaginary else [])]
        return min(part.count for part in parts)

    @property
    def unit(self) -> float:
        """Unit of the last digit, or half the width of finite bounds."""
        bounds = self.printed.bounds
        if bounds is not None and math.isfinite(bounds[1] - bounds[0]):
            return max(0.5 * (bounds[1] - bounds[0]), self.printed.real.unit)
        return self.printed.real.unit

    def agreement(self, right: complex) -> int:
        """Count the printed digits that agree with the right value, rounded or truncated."""
        error = self.own_error(right)
        if self.printed.bounds is not None:
            low, high = self.printed.bounds
            return self.digits if low - error <= right.real <= high + error else 0
        agreeing = equal_digits(self.printed.real, right.real, error)
        if self.printed.imaginary is not None:
            imaginary = abs(right.imag) if self.printed.both_signs else right.imag
            return min(agreeing, equal_digits(self.printed.imaginary, imaginary, error))
        return min(agreeing, 0 if abs(right.imag) > 0.5 * self.printed.real.unit + error else self.digits)

    def fits(self, right: complex | None) -> bool:
        """Whether a value agrees with every printed digit."""
        return right is not None and self.agreement(right) == self.digits

    def miss(self, right: complex | None) -> float:
        """Return the distance of a value from the printed one in units of its last digit, or of half its bounds."""
        if right is None:
            return math.inf
        bounds = self.printed.bounds
        if bounds is not None:
            return max(0.0, bounds[0] - right.real, right.real - bounds[1]) / self.unit
        if self.printed.both_signs:
            right = complex(right.real, abs(right.imag))
        return abs(right - self.printed.value) / self.unit


def equal_digits(printed: Digits, right: float, error: float = 0.0) -> int:
    """Return how many digits of a printed number agree with the right one, within the error of the right one."""
    if agreement(printed, right, error):
        return printed.count
    difference = abs(right - printed.value)
    agreeing = printed.count - 1
    while agreeing > 0 and difference > 0.5 * printed.unit * 10.0 ** (printed.count - agreeing):
        agreeing -= 1
    return agreeing


def spell_name(name: str) -> str:
    """Spell the name of a printed number, such as 'stance rate' or 'step period 1', without its unit."""
    quantity, _, part = name.partition(".")
    if quantity == "state":
        return part.replace("_", " ")
    if quantity == "state_before":
        return f"{part.replace('_', ' ')} before"
    return f"{axis_label(quantity).removesuffix('s')} {part}" if part else axis_label(quantity)


class Judgement(NamedTuple):
    """Verdict on one printed value."""

    verdict: str
    digits: int
    evidence: str


def judge(item: Item, right: complex | None, reason: str = "") -> Judgement:
    """Compare a printed value with the right one. If `right` is None, `reason` explains why."""
    if right is None:
        return Judgement(NOT_COMPARABLE, 0, reason)
    agreeing = item.agreement(right)
    total = item.digits
    units = format_units(item.miss(right))
    if item.printed.bounds is not None:
        if agreeing == total:
            return Judgement(REPRODUCED, agreeing, "within what is printed")
        return Judgement(DIFFERENT, agreeing, f"outside what is printed by {units} times its tolerance")
    if agreeing == total:
        return Judgement(REPRODUCED, agreeing, "all digits")
    enough = agreeing >= FEWEST_DIGITS and 2 * agreeing >= total
    off = f"{agreeing or 'none'} of {total} digits; off by {units} units of the last one"
    return Judgement(REPRODUCED if enough else DIFFERENT, agreeing, off)


def format_units(number: float) -> str:
    return f"{number:.2g}" if number < 99.5 or number >= 1e6 else f"{number:.0f}"


def items_of(printed: Mapping[str, Any], names: Mapping[str, Sequence[str]]) -> list[Item]:
    """List the printed numbers. `names` has those of the components of lists, by quantity."""
    items = []
    for quantity, texts in printed.items():
        if texts is None:
            continue
        known = names.get(quantity, ())
        for place, text in enumerate([texts] if isinstance(texts, str) else texts):
            value = parse_printed(text)
            assert value is not None, "the config has refused values that cannot be read"
            suffix = "" if isinstance(texts, str) else f".{known[place] if place < len(known) else place + 1}"
            items.append(Item(f"{quantity}{suffix}", quantity, place, value))
    return items


def match_multipliers(items: Sequence[Item], right: Sequence[complex]) -> dict[str, complex | None]:
    """Return the right multiplier nearest to each printed one, using each right multiplier once."""
    left = list(right)
    matches = dict[str, complex | None]()
    for item in items:
        if not left:
            matches[item.name] = None
            continue
        value = item.printed.value
        nearest = min(left, key=lambda one: abs(one - value))
        left.remove(nearest)
        if item.printed.both_signs and nearest.conjugate() in left:
            left.remove(nearest.conjugate())
        matches[item.name] = nearest
    return matches
