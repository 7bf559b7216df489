"""Shortest exact notation of numbers, and comparison of numbers up to rounding."""

import math
import re
from decimal import Decimal
from typing import Any, Final

RELATIVE_ROUNDING: Final = 1e-9
"""Maximum relative difference between numbers that count as equal; unit conversion rounds numbers by less."""

DECIMAL_COMMA: Final = re.compile(r"[-+]?\d*,\d*(?:[eE][-+]?\d+)?")


def short_number(number: float) -> str:
    """Return the shortest text that reads back as `number` (finite), e.g. 3, 0.0174, 1e6. Integers are
    written in full.
    """
    if isinstance(number, int):
        return str(number)
    plain = repr(number).removesuffix(".0")
    if 1e-4 <= abs(number) < 1e5 or number == 0:
        return plain
    digits, exponent = f"{Decimal(repr(number)).normalize():E}".split("E")
    return min(plain, f"{digits}e{int(exponent)}", key=len)


def are_equal(first: Any, second: Any) -> bool:
    """Whether two values are equal, numbers up to rounding."""
    if isinstance(first, float | int) and isinstance(second, float | int):
        return math.isclose(first, second, rel_tol=RELATIVE_ROUNDING)
    return bool(first == second)
