"""Comparison of printed numbers with the right ones: how many digits agree, and the verdict."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, Final

from walkerlab.config.check import Digits, PrintedValue, agreement, parse_printed
from walkerlab.labels import axis_label

UNEXPLAINED = "different, unexplained"
# A value counts as reproduced if at least this many of its digits agree, and at least half of them.
FEWEST_DIGITS = 3
OWN_ERROR: Final = {"multipliers": 2e-10, "spectral_radius": 2e-10}
"""Numerical errors of the correct values of these quantities. For all others it is `EXACT_ERROR`."""
EXACT_ERROR = 2e-12  # numerical error of the correct values, absolute below 1 and relative above
MORE_DIGITS: Final = 2  # a correct value is shown with this many more digits than printed
MOST_DECIMALS: Final = 12


class Verdict(StrEnum):
    """Verdict on a printed number. Some apply only to the study of the paper."""

    INPUT = "input"  # only in the study: used as given
    REPRODUCED = "reproduced"
    EXPLAINED = "explained"
    CONTRADICTED = "contradicted"  # only in the study: other values of the paper contradict it
    DIFFERENT = "different"
    NOT_REPRODUCED = "not-reproduced"  # only in the study: differs without an explanation, or cannot be compared
    NOT_COMPARABLE = "not-comparable"


class PrintedNumber:
    """A printed number, with its digits."""

    quantity: str
    text: str  # as printed

    @cached_property
    def printed(self) -> PrintedValue:
        value = parse_printed(self.text.rstrip("% "))
        assert value is not None, "the config has refused values that cannot be read"
        return value

    @property
    def digits(self) -> Digits:
        """The number or its real part, without bounds."""
        return self.printed.real

    @property
    def value(self) -> float:
        return self.digits.value

    @property
    def count(self) -> int:
        """Number of printed digits."""
        return min(part.count for part in (self.digits, self.printed.imaginary) if part is not None)

    @property
    def last_digit(self) -> float:
        """Unit of the last digit, or half the width of finite bounds."""
        low, high = self.printed.bounds or (0.0, math.inf)
        return max(0.5 * (high - low), self.digits.unit) if math.isfinite(high - low) else self.digits.unit

    def agreeing(self, right: complex) -> int:
        """Count the printed digits that agree with the correct value, which may be rounded or truncated."""
        error = OWN_ERROR.get(self.quantity, EXACT_ERROR) * max(1.0, abs(right))
        if self.printed.bounds is not None:
            low, high = self.printed.bounds
            return self.count if low - error <= right.real <= high + error else 0
        agreeing = equal_digits(self.digits, right.real, error)
        if self.printed.imaginary is not None:
            imaginary = abs(right.imag) if self.printed.both_signs else right.imag
            return min(agreeing, equal_digits(self.printed.imaginary, imaginary, error))
        return 0 if abs(right.imag) > 0.5 * self.digits.unit + error else agreeing

    def fits(self, right: complex | None) -> bool:
        """Whether a value agrees with every printed digit."""
        return right is not None and self.agreeing(right) == self.count

    def miss(self, right: complex | None) -> float:
        """Return the distance of a value from the printed one, in units of the last printed digit.

        If bounds are printed, it is the distance from them, in the units of `last_digit`.
        """
        if right is None:
            return math.inf
        if self.printed.bounds is not None:
            low, high = self.printed.bounds
            return max(0.0, low - right.real, right.real - high) / self.last_digit
        if self.printed.both_signs:
            right = complex(right.real, abs(right.imag))
        return abs(right - self.printed.value) / self.last_digit

    def write(self, right: complex) -> str:
        """Format the correct value with `MORE_DIGITS` more digits than the printed one."""
        decimals = min(max(round(-math.log10(self.digits.unit)) + MORE_DIGITS, 0), MOST_DECIMALS)
        text = f"{right.real:.{decimals}f}"
        if self.printed.imaginary is None and not right.imag:
            return text
        sign = "±" if self.printed.both_signs else "+" if right.imag >= 0.0 else "-"
        return f"{text} {sign} {abs(right.imag):.{decimals}f}i"


@dataclass(frozen=True)
class Item(PrintedNumber):
    """A printed number of a gait: a value, or one component of a list."""

    name: str  # such as period_s, state.stance_angle or multipliers.1
    quantity: str  # the name without the part after the dot
    place: int  # index in the list of this quantity, or 0 for a single value
    text: str


def equal_digits(printed: Digits, right: float, error: float = 0.0) -> int:
    """Return how many digits of a printed number agree with the right one, which has a numerical error of `error`."""
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
    if quantity.startswith("state"):
        return f"{part}{quantity.removeprefix('state')}".replace("_", " ")
    return f"{axis_label(quantity).removesuffix('s')} {part}" if part else axis_label(quantity)


@dataclass(frozen=True)
class Judged:
    """A printed number, what it was compared with, and the verdict."""

    number: PrintedNumber
    about: Mapping[str, Any]  # JSON values that say what the number is
    values: Mapping[str, Any]  # JSON values with which it was compared
    verdict: Verdict
    evidence: str

    @property
    def row(self) -> dict[str, Any]:
        """Row of a table, with JSON values."""
        verdict = {"verdict": self.verdict.value, "evidence": self.evidence}
        return {**self.about, "printed": self.number.text, **self.values, **verdict}


def judge(item: Item, right: complex | None, reason: str = "") -> Judged:
    """Compare a printed number with the right one. If `right` is None, `reason` explains why."""
    agreeing = 0 if right is None else item.agreeing(right)
    miss = item.miss(right)
    all_digits = agreeing == item.count
    enough = all_digits or (agreeing >= FEWEST_DIGITS and 2 * agreeing >= item.count)
    verdict = Verdict.REPRODUCED if enough else Verdict.DIFFERENT
    value: Any = None
    if right is None:
        verdict = Verdict.NOT_COMPARABLE
        evidence = reason
    else:
        value = [right.real, right.imag] if item.printed.imaginary or right.imag else right.real
        if item.printed.bounds is not None:
            outside = f"outside what is printed by {format_units(miss)} times its tolerance"
            evidence = "within what is printed" if all_digits else outside
        else:
            off = f"{agreeing or 'none'} of {item.count} digits; off by {format_units(miss)} units of the last one"
            evidence = "all digits" if all_digits else off
    values = {
        "right": value,
        "right_text": "" if right is None else item.write(right),
        "digits": agreeing,
        "of_digits": item.count,
        "difference_in_units": None if right is None else miss,
    }
    return Judged(item, {"name": item.name}, values, verdict, evidence)


def format_units(number: float) -> str:
    return f"{number:.2g}" if number < 99.5 or number >= 1e6 else f"{number:.0f}"


def items_of(printed: Mapping[str, Any], names: Mapping[str, Sequence[str]]) -> list[Item]:
    """List the printed numbers.

    printed  texts by quantity, each a single text or a list
    names    names of the components of a list, by quantity. Other components are numbered
    """
    items = []
    for quantity, texts in printed.items():
        if isinstance(texts, str):
            items.append(Item(quantity, quantity, 0, texts))
            continue
        for place, text in enumerate(texts or ()):
            component = names[quantity][place] if names.get(quantity) else place + 1
            items.append(Item(f"{quantity}.{component}", quantity, place, text))
    return items


def match_multipliers(items: Sequence[Item], right: Sequence[complex]) -> dict[str, complex | None]:
    """Return the right multiplier nearest to each printed one, using each right multiplier once."""
    left = list(right)
    matches = dict[str, complex | None]()
    for item in items:
        value = item.printed.value
        nearest = min(left, key=lambda one: abs(one - value), default=None)
        matches[item.name] = nearest
        for used in () if nearest is None else (nearest, nearest.conjugate())[: 1 + item.printed.both_signs]:
            if used in left:
                left.remove(used)
    return matches
