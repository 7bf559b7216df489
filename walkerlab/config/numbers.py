"""Numbers as short texts that read back as the same number."""

from __future__ import annotations

from decimal import Decimal


def short(number: float) -> str:
    """The shortest of the texts that read back as `number`, e.g. 3, 0.0174, 1e6.

    number  finite; an int is printed in full
    """
    if isinstance(number, int):
        return str(number)
    plain = repr(number).removesuffix(".0")
    if 1e-4 <= abs(number) < 1e5 or number == 0:
        return plain
    digits, exponent = f"{Decimal(repr(number)).normalize():E}".split("E")
    return min(plain, f"{digits}e{int(exponent)}", key=len)
