"""Format tables for LaTeX: aligned decimals, the same number of digits throughout a column, headers and captions with
symbols."""

import math
import re
import textwrap
from collections.abc import Callable, Sequence
from typing import Any, Final

from walkerlab.views.report.numbers import DOT, LETTERS, SUBSCRIPTS, SUPERSCRIPTS
from walkerlab.views.report.tables import Table, flatten

COLUMN_DIGITS: Final = 5
"""Significant digits of the largest number in a column or, if the numbers differ too much in size, of each number."""
MAX_PLAIN: Final = 1e6
"""Numbers of at least this magnitude are written with a power of ten."""
EMPTY_CELL: Final = "--"
PACKAGES: Final = r"% \usepackage{booktabs, graphicx, siunitx}"
WITHOUT_GRAPHICX: Final = r"\providecommand{\resizebox}[3]{#3}"
SHRINK: Final = r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{%"
"""Start of a box that is at most as wide as the text around it."""
MIN_HEAD: Final = 10
"""Number of characters of a column heading that always fit on one line."""
MAX_UNWRAPPED: Final = 28
"""A column of text is wrapped if one of its cells has more characters than this."""
WRAPPED: Final = r">{\raggedright\arraybackslash}p{11em}"
TYPE_SIZES: Final = {"": 1.0, r"\small": 0.9, r"\footnotesize": 0.8, r"\scriptsize": 0.7}
CHARACTER_PT: Final = 5.0
"""Width of a digit in 10 pt type."""
COLUMN_WIDTHS: Final = {1: 252.0, 2: 516.0}
"""Width (pt) of one and of two columns of a journal."""
TITLE: Final = re.compile(r"(?P<words>.*\S)\s+(?P<unit>\([^()]*\))")
"""Pattern of column titles with a unit."""
DECIMAL = re.compile(r"(-?)(\d+)(?:\.(\d+))?(?:e(-?)(\d+))?")
"""Pattern of numbers in siunitx columns: sign, digits before and after the point, sign and digits of the exponent."""
ESCAPED_POWER = re.compile(r"\\\^\{\}(-?\d+)")
"""Pattern of powers in escaped text."""
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
SCRIPT = re.compile(r"[\^_]\{([^{}]*)\}")
SCRIPTS = re.compile(r"([\^_])\{[^{}]*\}(?:\1\{[^{}]*\})+")
"""Pattern of several superscripts or subscripts in a row, which LaTeX rejects."""
SIGNS = re.compile("|".join(map(re.escape, IN_MATHS)))
"""Characters that LaTeX can set only in maths."""
TEX = str.maketrans({letter: f"\\{letter}" for letter in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\^{}"})


def as_tex(content: Table, columns: int = 1) -> bytes:
    """Format a table for booktabs and siunitx, leaving out columns of sentences. A table with a caption becomes a
    float.

    columns  journal columns that the table spans, which determine the size of its type
    """
    titles, rows = flatten(content)
    data = [[row[index].datum for row in rows] for index in range(len(titles))]
    layouts, cells = zip(*map(format_column, data), strict=True)
    heads = head_rows(titles, layouts, cells)
    head, body = ([" & ".join(line) + r" \\" for line in zip(*block, strict=True)] for block in (heads, cells))
    size = type_size([[*above, *below] for above, below in zip(heads, cells, strict=True)], columns)
    begin = [f"{size}\\setlength{{\\tabcolsep}}{{3pt}}", SHRINK, rf"\begin{{tabular}}{{{''.join(layouts)}}}"]
    text = [*begin, r"\toprule", *head, r"\midrule", *body, r"\bottomrule", r"\end{tabular}}"]
    sentences = (text if text.endswith((".", "?")) else f"{text}." for text in (content.caption, content.note) if text)
    if caption := " ".join(sentences):
        kind = "table*" if columns > 1 else "table"
        text = [rf"\begin{{{kind}}}", r"\centering", rf"\caption{{{escape_tex(caption)}}}", *text, rf"\end{{{kind}}}"]
    return "\n".join([PACKAGES, WITHOUT_GRAPHICX, *text, ""]).encode()


def type_size(cells: Sequence[Sequence[str]], columns: int) -> str:
    """Choose the largest type in which the cells of a table probably fit into this number of journal columns."""
    characters = (min(max(map(len, column)), MAX_UNWRAPPED) for column in cells)
    width = sum(CHARACTER_PT * count + 6.0 for count in characters)
    fitting = (size for size, scale in TYPE_SIZES.items() if scale * width <= COLUMN_WIDTHS[columns])
    return next(fitting, list(TYPE_SIZES)[-1])


def head_rows(titles: Sequence[str], layouts: Sequence[str], cells: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the header lines of each column. Words are wrapped to the column, and a unit has a line of its own."""
    parts = [TITLE.fullmatch(title) for title in titles]
    has_units = any(part and part["unit"] for part in parts)
    heads = []
    for part, title, column in zip(parts, titles, cells, strict=True):
        widest = max(map(len, column), default=0)
        words = textwrap.wrap(part["words"] if part else title, max(MIN_HEAD, widest), break_long_words=False)
        heads.append([*words, *([part["unit"] if part else ""] if has_units else [])])
    height = max(map(len, heads))
    filled = ([""] * (height - len(head)) + head for head in heads)
    return [
        [f"{{{escape_tex(line)}}}" if layout.startswith("S") and line else escape_tex(line) for line in head]
        for head, layout in zip(filled, layouts, strict=True)
    ]


def format_column(data: Sequence[Any]) -> tuple[str, list[str]]:
    """Return the layout and the cells of a column. Numbers form a siunitx column, aligned at the decimal point."""
    numbers = [value for value in data if is_number(value)]
    written = column_format(numbers)
    cells = [written(value) if is_number(value) else escape_tex(value) for value in data]
    decimals = [cell for cell in cells if DECIMAL.fullmatch(cell)]
    # Texts that look like numbers, such as printed values, count as numbers if most of the column does.
    if not numbers and 2 * len(decimals) <= len(cells) - cells.count(EMPTY_CELL):
        longest, longest_word = (max(map(len, texts), default=0) for texts in (cells, " ".join(cells).split()))
        return WRAPPED if longest_word <= MAX_UNWRAPPED < longest else "l", cells
    aligned = [cell if DECIMAL.fullmatch(cell) else f"{{{cell}}}" for cell in cells]
    return f"S[table-format={room_for(decimals)}]", aligned


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def column_format(numbers: Sequence[float]) -> Callable[[float], str]:
    """Choose the format of a column's numbers: integers, or the same number of decimals or of significant digits."""
    if all(isinstance(value, int) for value in numbers):
        return str
    sizes = [abs(value) for value in numbers if value != 0.0 and math.isfinite(value)] or [1.0]
    decimals = max(0, COLUMN_DIGITS - 1 - math.floor(math.log10(max(sizes))))
    # Use the same number of decimals only if the smallest number loses at most one digit by it.
    if min(sizes) >= 10.0 ** (COLUMN_DIGITS - 2 - decimals) and max(sizes) < MAX_PLAIN:
        return lambda value: f"{value:z.{decimals}f}"
    return lambda value: "0" if value == 0.0 else format_digits(value)


def format_digits(value: float) -> str:
    mantissa, _, exponent = f"{value:#.{COLUMN_DIGITS}g}".partition("e")
    return mantissa.removesuffix(".") + (f"e{int(exponent)}" if exponent else "")


def room_for(cells: Sequence[str]) -> str:
    """Return the table-format of siunitx: how many digits stand before and after the point, and in the exponent."""
    parts = [part.groups(default="") for cell in cells if (part := DECIMAL.fullmatch(cell))]
    sign, before, behind, below, power = (max(len(groups[index]) for groups in parts) for index in range(5))
    return f"{'-' * sign}{before}.{behind}" + (f"e{'-' * below}{power}" if power else "")


def escape_tex(value: Any) -> str:
    """Convert a text to LaTeX: set symbols and powers in maths mode, and escape special characters. None becomes a
    dash."""
    if value is None:
        return EMPTY_CELL
    text = SIGNS.sub(lambda match: IN_MATHS[match[0]], ESCAPED_POWER.sub(r"$^{\1}$", str(value).translate(TEX)))
    # The `$$` between two formulas that touch is removed, because it would begin a displayed formula.
    return SCRIPTS.sub(join_scripts, SYMBOL.sub(symbol_in_tex, text).replace("$$", ""))


def join_scripts(match: re.Match[str]) -> str:
    """Join superscripts (or subscripts) that follow one another into one."""
    return f"{match[1]}{{{''.join(SCRIPT.findall(match[0]))}}}"


def symbol_in_tex(match: re.Match[str]) -> str:
    """Typeset a symbol with its subscript, such as t_left or dtheta_1, in maths."""
    rate, letter, below = match.groups()
    letter = rf"\{letter}" if letter in LETTERS else letter
    below = below if len(below) == 1 else rf"\mathrm{{{below}}}"
    letter = rf"\dot{{{letter}}}" if rate else letter
    return rf"${letter}_{below}$"
