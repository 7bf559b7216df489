"""JSON values as aligned text for people."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from walkerlab.views.report.tables import in_lines, of_records

INDENT = "  "
COLUMNS = 100
"""Width of a paragraph, in characters."""
LONGEST_ROW, ENDS = 12, 4
"""Of more values in a row, so many are shown of either end."""


def described_summary(summary: Mapping[str, Any], indent: str = INDENT, short: bool = False) -> Iterator[str]:
    """One line a key; below it what is nested, rows of equal objects as a table.

    short  leave out the middle of long rows of numbers and of long tables
    """
    widest = max((len(key) for key in summary), default=0)
    for key, value in summary.items():
        if isinstance(value, Mapping) and value:
            yield f"{indent}{key}"
            yield from described_summary(value, indent + INDENT, short)
        elif isinstance(value, list) and value and all(isinstance(row, Mapping) for row in value):
            yield f"{indent}{key}"
            yield from (f"{indent}{INDENT}{line}" for line in table(value))
        else:
            yield f"{indent}{key:<{widest}}  {in_words(cut(value) if short else value)}"


def cut(value: Any) -> Any:
    """A value, or of a long row its ends and how many there are."""
    if not isinstance(value, list) or len(value) <= LONGEST_ROW:
        return value
    ends = [in_words(item) for item in (*value[:ENDS], *value[-ENDS:])]
    return [*ends[:ENDS], "…", *ends[ENDS:], f"({len(value)} of them; `walkerlab show` has all)"]


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Objects as rows of a table, their keys as its head; below it what has no room there."""
    cells = of_records(rows, in_words)
    long = [column.title for column in cells.columns if column.wide]
    return [*in_lines(cells), f"with --json also: {', '.join(long)}"] if long else in_lines(cells)


def paragraph(text: str) -> list[str]:
    """Prose in lines of equal length at most; no word is cut, however long."""
    return textwrap.wrap(text, COLUMNS, break_long_words=False, break_on_hyphens=False)


def in_words(value: Any) -> str:
    """A value on one line."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.10g}"
    if isinstance(value, list):
        return "  ".join(f"({in_words(item)})" if isinstance(item, list) else in_words(item) for item in value) or "-"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {in_words(item)}" for key, item in value.items()) or "-"
    return str(value)
