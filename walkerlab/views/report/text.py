"""Formats JSON values as aligned text."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from walkerlab.views.report.tables import record_table, table_lines

INDENT = "  "
PARAGRAPH_WIDTH = 100
"""Line width of a paragraph (characters)."""
LONGEST_ROW = 12
ENDS = 4
"""Length of the longest row shown in full, and number of values shown at each end of a longer row."""


def describe_summary(summary: Mapping[str, Any], indent: str = INDENT, short: bool = False) -> Iterator[str]:
    """Yield a line per key, nested values below it, and a table for a list of objects. `short` shortens long rows."""
    widest = max((len(key) for key in summary), default=0)
    for key, value in summary.items():
        if isinstance(value, Mapping) and value:
            yield f"{indent}{key}"
            yield from describe_summary(value, indent + INDENT, short)
        elif isinstance(value, list) and value and all(isinstance(row, Mapping) for row in value):
            yield f"{indent}{key}"
            yield from (f"{indent}{INDENT}{line}" for line in table(value))
        else:
            yield f"{indent}{key:<{widest}}  {format_value(cut(value) if short else value)}"


def cut(value: Any) -> Any:
    """Leave out the middle of a long row, and return other values unchanged."""
    if not isinstance(value, list) or len(value) <= LONGEST_ROW:
        return value
    ends = [format_value(item) for item in (*value[:ENDS], *value[-ENDS:])]
    return [*ends[:ENDS], "…", *ends[ENDS:], f"({len(value)} values; `walkerlab show` lists all)"]


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Tabulate objects with their keys as headers, and name the keys whose columns are too wide."""
    cells = record_table(rows, format_value)
    long = [column.title for column in cells.columns if column.wide]
    return [*table_lines(cells), f"with --json also: {', '.join(long)}"] if long else table_lines(cells)


def paragraph(text: str) -> list[str]:
    """Wrap prose without breaking words."""
    return textwrap.wrap(text, PARAGRAPH_WIDTH, break_long_words=False, break_on_hyphens=False)


def format_value(value: Any) -> str:
    """Format a value on one line."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.10g}"
    if isinstance(value, list):
        return (
            "  ".join(f"({format_value(item)})" if isinstance(item, list) else format_value(item) for item in value)
            or "-"
        )
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {format_value(item)}" for key, item in value.items()) or "-"
    return str(value)
