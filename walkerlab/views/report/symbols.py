"""Converts formulas in plain letters, as stored in results, to mathematical symbols."""

import re

LETTERS = {"theta": "θ", "omega": "ω", "phi": "φ", "mu": "μ", "lambda": "λ"}
SUBSCRIPTS = str.maketrans("0123456789+-aehijklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉₊₋ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ")
SUPERSCRIPTS = str.maketrans("0123456789+-en", "⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ᵉⁿ")
DOT = "\u0307"

POWER = re.compile(r"(?<![\w.])(?<!\w-)(\d+(?:\.\d+)?)e([-+]?)0*(\d+)\b")
"""A number in exponent notation such as 1.1e-09, but not the end of a name such as k-1e8."""


CARET = re.compile(r"(?<=\d)\^(-?\d+)\b")
"""A typed power, such as 10^-4."""


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
"""Patterns and replacements, applied in this order."""


def typeset(text: str) -> str:
    """Convert plain letters to signs: 'dtheta_1 = -0.60 rad/s^2' becomes 'θ̇₁ = −0.60 rad/s²'."""
    for pattern, sign in RULES:
        text = pattern.sub(sign, text)
    return text
