"""Format numbers and symbols for the report."""

import math
import re
from collections.abc import Iterable

LETTERS = {"theta": "θ", "omega": "ω", "phi": "φ", "mu": "μ", "lambda": "λ"}
SUBSCRIPTS = str.maketrans("0123456789+-aehijklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉₊₋ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ")
SUPERSCRIPTS = str.maketrans("0123456789+-en", "⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ᵉⁿ")
DOT = "\u0307"

POWER = re.compile(r"(?<![\w.])(?<!\w-)(\d+(?:\.\d+)?)e([-+]?)0*(\d+)\b")
"""Pattern of numbers in exponent notation, such as 1.1e-09, except at the end of a name such as k-1e8."""


CARET = re.compile(r"(?<=\d)\^(-?\d+)\b")
"""Pattern of powers as users type them, such as 10^-4."""


def to_superscript(match: re.Match[str]) -> str:
    return match[1].translate(SUPERSCRIPTS)


def power(match: re.Match[str]) -> str:
    """Format a power of ten as 10⁻⁴, or 1.1 × 10⁻⁹."""
    ten = f"10{f'{match[2]}{match[3]}'.strip('+').translate(SUPERSCRIPTS)}"
    return ten if match[1] == "1" else f"{match[1]} × {ten}"


RULES = (
    (
        re.compile(r"\bd(theta|omega|phi)_(\d)\b"),
        lambda match: f"{LETTERS[match[1]]}{DOT}{match[2].translate(SUBSCRIPTS)}",
    ),
    (
        re.compile(r"\b(theta|omega|phi|mu|lambda)(?:_(\d))?\b"),
        lambda match: LETTERS[match[1]] + (match[2] or "").translate(SUBSCRIPTS),
    ),
    (re.compile(r"\b([A-Za-z])_(\d+|[ape])\b"), lambda match: match[1] + match[2].translate(SUBSCRIPTS)),
    (re.compile(r"\^(-?\d+|[en])\b"), lambda match: match[1].translate(SUPERSCRIPTS)),
    (POWER, power),
    (re.compile(r"\+-"), lambda _: "±"),
    (re.compile(r"(?<![\w)\]-])-(?=[\w.(])|(?<= )-(?= )"), lambda _: "−"),
)
"""Patterns and their replacements, which are applied in this order."""


def typeset(text: str) -> str:
    """Replace spelled-out symbols by signs: 'dtheta_1 = -0.60 rad/s^2' becomes 'θ̇₁ = −0.60 rad/s²'."""
    for pattern, sign in RULES:
        text = pattern.sub(sign, text)
    return text


MINUS = "−"
NONE = "–"
SPACE = "\u00a0"
"""No-break space between a number and its unit."""
MIN_LENGTH_M = 1e-9
"""Length below which a length counts as zero. Walkers are centimetres to metres tall, and walks are accurate to
1e-10 of the height."""
PLAIN_FROM = 1e-4
PLAIN_BELOW = 1e6
"""Range of magnitudes that are written without a power of ten."""
MAX_DECIMALS = 6
"""Maximum number of decimals of step periods (s) and lengths (m)."""
DEFAULT_DECIMALS = 4
"""Number of decimals of step periods (s) and lengths (m) whose error is unknown."""


def number(value: float | None, digits: int = 5) -> str:
    """Format a number with `digits` significant digits, without trailing zeros, or a dash for None."""
    if value is None or not math.isfinite(value):
        return NONE
    if value != 0 and not PLAIN_FROM <= abs(value) < PLAIN_BELOW:
        return power_of_ten(value, min(digits, 3))
    text = f"{value:.{digits}g}"
    return f"{value:.0f}".replace("-", MINUS) if "e" in text else text.replace("-", MINUS)


def fixed(value: float | None, decimals: int) -> str:
    """Format a number with a fixed number of decimals, for columns, or a dash for None."""
    if value is None or not math.isfinite(value):
        return NONE
    text = f"{value:.{decimals}f}"
    # A small negative number would be written as -0.00.
    return text.removeprefix("-") if float(text) == 0 else text.replace("-", MINUS)


def decimals_left(error: float | None) -> int:
    """Return the largest number of decimals such that the error is at most half a unit of the last one."""
    if error is None:
        return DEFAULT_DECIMALS
    return max(0, min(MAX_DECIMALS, math.floor(-math.log10(2.0 * error)))) if error else MAX_DECIMALS


def power_of_ten(value: float, digits: int = 3) -> str:
    """Format a number as in 1.2 × 10⁻⁹ or 10⁻⁹."""
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    ten = f"10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    return ten if mantissa == "1" else f"{mantissa}{SPACE}×{SPACE}{ten}".replace("-", MINUS, 1)


def quantity(value: float | None, unit: str, digits: int = 5) -> str:
    """Format a value with its unit, as in 0.70365 s, so that no line breaks between the two."""
    text = number(value, digits)
    return text if text == NONE or unit in ("", "1") else f"{text}{SPACE}{unit}"


def drop_rounding(value_m: float) -> float:
    """Return a length (m), or zero if it may be nothing but rounding or the error of the solver."""
    return value_m if abs(value_m) >= MIN_LENGTH_M else 0.0


def length(value_m: float | None, digits: int = 4) -> str:
    """Format a length in m, mm or µm, depending on its size, and as 0 m below `MIN_LENGTH_M`."""
    if value_m is None or not math.isfinite(value_m):
        return NONE
    value_m = drop_rounding(value_m)
    magnitude = abs(value_m)
    if magnitude >= 0.1 or magnitude == 0:
        return quantity(value_m, "m", digits)
    return quantity(1e3 * value_m, "mm", digits) if magnitude >= 1e-4 else quantity(1e6 * value_m, "µm", digits)


def format_integer(value: int | None) -> str:
    """Format an integer with thousands separators, as in 27,087, or a dash for None."""
    return NONE if value is None else f"{value:,}"


def span(values: Iterable[float], unit: str, digits: int = 5) -> str:
    """Format a range as 'minimum to maximum' with its unit, or as one value if the ends are equal."""
    ordered = sorted(values)
    if not ordered:
        return NONE
    least = number(ordered[0], digits)
    largest = number(ordered[-1], digits)
    text = least if least == largest else f"{least} to {largest}"
    return f"{text}{SPACE}{unit}" if unit else text


def count(how_many: int, what: str, several: str = "") -> str:
    """Format a count, as in '1 step' or '10 steps'."""
    return f"{how_many} {what if how_many == 1 else several or what + 's'}"
