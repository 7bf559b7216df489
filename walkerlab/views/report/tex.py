"""Tables for LaTeX: aligned decimals, equal digits per column, headers and captions with symbols."""

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, Final

from walkerlab.views.report.symbols import DOT, LETTERS, SUBSCRIPTS, SUPERSCRIPTS
from walkerlab.views.report.tables import Table, flat

COLUMN_DIGITS: Final = 5
"""Significant digits of a column's largest number or, if its numbers differ too much, of each number."""
MAX_PLAIN: Final = 1e6
"""Magnitude from which numbers are written with a power of ten."""
EMPTY_CELL: Final = "--"
PACKAGES: Final = r"% \usepackage{booktabs, siunitx}"
DECIMAL = re.compile(r"(-?)(\d+)(?:\.(\d+))?(?:e(-?)(\d+))?")
"""A number in a siunitx column: sign, digits before and after the point, sign and digits of the exponent."""
ESCAPED_POWER = re.compile(r"\\\^\{\}(-?\d+)")
"""A power in escaped text."""
SYMBOL = re.compile(rf"\b(d?)({'|'.join(LETTERS)}|[A-Za-z])\\_([A-Za-z0-9]+)\b(?!\\_)")
r"""A spelled-out symbol with a subscript in escaped text, such as dtheta\_1."""
IN_MATHS = {
    **{f"{sign}{DOT}": rf"$\dot{{\{name}}}$" for name, sign in LETTERS.items()},
    **{sign: rf"$\{name}$" for name, sign in LETTERS.items()},
    **{chr(low): f"$_{{{chr(plain)}}}$" for plain, low in SUBSCRIPTS.items()},
    **{chr(high): f"$^{{{chr(plain)}}}$" for plain, high in SUPERSCRIPTS.items()},
    **{"−": "$-$", "×": r"$\times$", "±": r"$\pm$", "≤": r"$\le$", "≥": r"$\ge$", "Δ": r"$\Delta$", "°": r"$^\circ$"},
    **{"√": r"$\sqrt{}$", "≈": r"$\approx$", "µ": r"$\mu$", "…": r"\ldots{}"},
}
SIGNS = re.compile("|".join(map(re.escape, IN_MATHS)))
"""Characters that LaTeX can set only in maths."""
TEX = str.maketrans({letter: f"\\{letter}" for letter in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\^{}"})


def as_tex(content: Table) -> bytes:
    """Format a table for booktabs and siunitx, as a float if it has a caption; columns of sentences are left out."""
    heads, rows = flat(content)
    columns = [in_column(head, [row[place].datum for row in rows]) for place, head in enumerate(heads)]
    head, *lines = [" & ".join(line) + r" \\" for line in zip(*(cells for _, cells in columns), strict=True)]
    layout = "".join(layout for layout, _ in columns)
    body = [rf"\begin{{tabular}}{{{layout}}}", r"\toprule", head, r"\midrule", *lines, r"\bottomrule", r"\end{tabular}"]
    sentences = (text if text.endswith((".", "?")) else f"{text}." for text in (content.caption, content.note) if text)
    if caption := " ".join(sentences):
        body = [r"\begin{table}", r"\centering", rf"\caption{{{in_tex(caption)}}}", *body, r"\end{table}"]
    return "\n".join([PACKAGES, *body, ""]).encode()


def in_column(head: str, data: Sequence[Any]) -> tuple[str, list[str]]:
    """Return layout and cells of a column; a numeric column is a siunitx column, aligned at the decimal point."""
    numbers = [value for value in data if is_number(value)]
    written = column_format(numbers)
    cells = [written(value) if is_number(value) else in_tex(value) for value in data]
    decimals = [cell for cell in cells if DECIMAL.fullmatch(cell)]
    # text that looks like numbers, such as printed values, makes the column numeric if it is most of the column
    if not numbers and 2 * len(decimals) <= len(cells) - cells.count(EMPTY_CELL):
        return "l", [in_tex(head), *cells]
    aligned = [cell if DECIMAL.fullmatch(cell) else f"{{{cell}}}" for cell in cells]
    return f"S[table-format={room_for(decimals)}]", [f"{{{in_tex(head)}}}", *aligned]


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def column_format(numbers: Sequence[float]) -> Callable[[float], str]:
    """Choose the format of a column's numbers: integers, equal decimals, or equal significant digits."""
    if all(isinstance(value, int) for value in numbers):
        return str
    sizes = [abs(value) for value in numbers if value != 0.0 and math.isfinite(value)] or [1.0]
    decimals = max(0, COLUMN_DIGITS - 1 - math.floor(math.log10(max(sizes))))
    # equal decimals if the smallest number loses at most one digit
    if min(sizes) >= 10.0 ** (COLUMN_DIGITS - 2 - decimals) and max(sizes) < MAX_PLAIN:
        return lambda value: f"{value:z.{decimals}f}"
    return lambda value: "0" if value == 0.0 else with_digits(value)


def with_digits(value: float) -> str:
    mantissa, _, exponent = f"{value:#.{COLUMN_DIGITS}g}".partition("e")
    return mantissa.removesuffix(".") + (f"e{int(exponent)}" if exponent else "")


def room_for(cells: Sequence[str]) -> str:
    """Return siunitx's table-format: digits before and after the decimal point, and of the exponent."""
    parts = [part.groups(default="") for cell in cells if (part := DECIMAL.fullmatch(cell))]
    sign, before, behind, below, power = (max(len(groups[place]) for groups in parts) for place in range(5))
    return f"{'-' * sign}{before}.{behind}" + (f"e{'-' * below}{power}" if power else "")


def in_tex(value: Any) -> str:
    """Convert a text to LaTeX: symbols and powers in maths, special characters escaped; a dash for None."""
    if value is None:
        return EMPTY_CELL
    text = SIGNS.sub(lambda match: IN_MATHS[match[0]], ESCAPED_POWER.sub(r"$^{\1}$", str(value).translate(TEX)))
    return SYMBOL.sub(symbol_in_tex, text).replace("$$", "")


def symbol_in_tex(match: re.Match[str]) -> str:
    """Typeset a symbol with its subscript, such as t_left or dtheta_1, in maths."""
    rate, letter, below = match.groups()
    letter = rf"\{letter}" if letter in LETTERS else letter
    below = below if len(below) == 1 else rf"\mathrm{{{below}}}"
    letter = rf"\dot{{{letter}}}" if rate else letter
    return rf"${letter}_{below}$"
