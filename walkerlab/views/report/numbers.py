"""Numbers as the report prints them."""

import math
from collections.abc import Iterable

from walkerlab.views.report.symbols import SUPERSCRIPTS

MINUS = "−"
NONE = "–"
SPACE = "\u00a0"
"""Between a number and what belongs to it: no line ends there."""
LEAST_LENGTH_M = 1e-9
"""Walkers are centimetres to metres tall, and walks are right to some 1e-10 of that: less is no length."""
PLAIN_FROM, PLAIN_BELOW = 1e-4, 1e6
"""Magnitudes that are written without a power of ten."""
MAX_DECIMALS, USUAL_DECIMALS = 6, 4
"""Of the periods (s) and lengths (m) of steps: at most, and where their error is unknown."""


def number(value: float | None, digits: int = 5) -> str:
    """A number with `digits` significant digits, trailing zeros dropped; a dash for none."""
    if value is None or not math.isfinite(value):
        return NONE
    if value != 0 and not PLAIN_FROM <= abs(value) < PLAIN_BELOW:
        return power_of_ten(value, min(digits, 3))
    text = f"{value:.{digits}g}"
    return f"{value:.0f}".replace("-", MINUS) if "e" in text else text.replace("-", MINUS)


def fixed(value: float | None, decimals: int) -> str:
    """A number with so many decimals, for columns; a dash for none."""
    if value is None or not math.isfinite(value):
        return NONE
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0 else text.replace("-", MINUS)


def decimals_left(error: float | None) -> int:
    """Decimals of a number that its error, if it is known, leaves: it is at most half a unit of the last one."""
    if error is None:
        return USUAL_DECIMALS
    return max(0, min(MAX_DECIMALS, math.floor(-math.log10(2.0 * error)))) if error else MAX_DECIMALS


def power_of_ten(value: float, digits: int = 3) -> str:
    """A number as in 1.2 × 10⁻⁹ or 10⁻⁹."""
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    ten = f"10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    return ten if mantissa == "1" else f"{mantissa}{SPACE}×{SPACE}{ten}".replace("-", MINUS, 1)


def quantity(value: float | None, unit: str, digits: int = 5) -> str:
    """A number with its unit, as in 0.70365 s, on one line."""
    text = number(value, digits)
    return text if text == NONE or unit in ("", "1") else f"{text}{SPACE}{unit}"


def told_apart(value_m: float) -> float:
    """A length (m); zero if it is below rounding and the solver's tolerance."""
    return value_m if abs(value_m) >= LEAST_LENGTH_M else 0.0


def length(value_m: float | None, digits: int = 4) -> str:
    """A length in the unit in which it is easiest read: m, mm or µm; 0 m below `LEAST_LENGTH_M`."""
    if value_m is None or not math.isfinite(value_m):
        return NONE
    value_m = told_apart(value_m)
    magnitude = abs(value_m)
    if magnitude >= 0.1 or magnitude == 0:
        return quantity(value_m, "m", digits)
    if magnitude >= 1e-4:
        return quantity(1e3 * value_m, "mm", digits)
    return quantity(1e6 * value_m, "µm", digits)


def whole(value: int | None) -> str:
    """An integer with its thousands set apart, as in 27,087; a dash for none."""
    return NONE if value is None else f"{value:,}"


def span(values: Iterable[float], unit: str, digits: int = 5) -> str:
    """Equal numbers as one, others as 'least to largest', with their unit."""
    ordered = sorted(values)
    if not ordered:
        return NONE
    least, largest = number(ordered[0], digits), number(ordered[-1], digits)
    spoken = least if least == largest else f"{least} to {largest}"
    return f"{spoken}{SPACE}{unit}" if unit else spoken


def count(how_many: int, what: str, several: str = "") -> str:
    """A number of things, as in '1 step' or '10 steps'."""
    return f"{how_many} {what if how_many == 1 else several or what + 's'}"
