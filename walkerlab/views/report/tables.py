"""Tables for pages, terminal and CSV, each declared once by its columns and records, and summaries as text."""

import re
import textwrap
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final, Literal

from walkerlab.labels import add_unit, labels_of, unit_by_name
from walkerlab.pipeline.store.files import csv_text
from walkerlab.views.report.numbers import NONE, number

Tone = Literal["plain", "good", "fair", "bad", "given"]
PREFIXES: Final = {"": 1.0, "m": 1e3, "µ": 1e6}
LONGEST_CELL: Final = 100
"""If a cell has more characters than this, its column is treated as text."""
BARE = re.compile(r"[-−+\d.e ×⁰¹²³⁴⁵⁶⁷⁸⁹⁻\xa0\u2009\u202f]+|-?(inf|nan)")
"""Pattern of numbers without unit or words."""


@dataclass(frozen=True)
class Cell:
    """A cell of a table."""

    text: str
    tone: Tone | None = None  # if given, the text is shown as a badge of this tone
    value: Any = None  # value that the text shows, or None

    @property
    def datum(self) -> Any:
        """Content of the cell in an exported table: the value that the text shows if there is one, otherwise the text.

        None if the text is empty.
        """
        if isinstance(self.value, int | float) and BARE.fullmatch(self.text):
            return self.value
        plain = self.value if isinstance(self.value, str) else self.text
        return None if plain in ("", NONE) else plain


def format_plain(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return NONE if value is None else str(value)


@dataclass(frozen=True)
class Column:
    """Declares how to show one value of each record, in a column or, with `side_by_side`, in a row."""

    title: str  # header, with the unit
    # key of a record's value (`a/b` for nested records), or a function of the record; None if records are rows of cells
    of: str | Callable[[Any], Any] | None = None
    # formats a value as text or as a cell with a tone; values that are already cells are not changed
    written: Callable[[Any], str | Cell] = format_plain
    numeric: bool = False  # whether to align as numbers
    wide: bool = False  # whether cells hold sentences; a terminal does not show such columns

    def value(self, record: Any, place: int = 0) -> Any:
        if self.of is None:
            return record[place]
        if not isinstance(self.of, str):
            return self.of(record)
        *within, key = self.of.split("/")
        for name in within:
            record = record.get(name) or {}
        return record.get(key)

    def cell(self, record: Any, place: int = 0) -> Cell:
        value = self.value(record, place)
        written = value if isinstance(value, Cell) else self.written(value)
        return written if isinstance(written, Cell) else Cell(written, value=value)


def measured(
    words: str, key: str, written: Callable[[Any], str | Cell] = number, *, labels: type | None = None, prefix: str = ""
) -> Column:
    """Return a column of numbers in a unit with a `prefix`, such as m for milli. The unit comes from `labels` or the
    key's suffix."""
    unit = unit_by_name(key) if labels is None else labels_of(labels)[key].unit

    def scaled(record: Mapping[str, Any]) -> Any:
        value = record.get(key)
        return None if value is None else PREFIXES[prefix] * value

    return Column(add_unit(words, f"{prefix}{unit}"), scaled if prefix else key, written, numeric=True)


@dataclass(frozen=True)
class Table:
    """A table. The first cell of each row is its header."""

    caption: str
    columns: tuple[Column, ...]
    groups: Mapping[str, Sequence[Sequence[Cell]]]  # rows by group title; the title may be empty
    wordy: bool = False  # whether cells hold sentences; on a narrow screen each row then becomes a card
    note: str = ""  # text below the table
    by: str = ""  # header of the column with the titles of groups, if tables are flat

    def __bool__(self) -> bool:
        return any(self.groups.values())


def table(
    caption: str,
    columns: Sequence[Column],
    records: Sequence[Any] | Mapping[str, Sequence[Any]],
    *,
    wordy: bool = False,
    note: str = "",
    by: str = "",
) -> Table:
    """Build a table with a row for each record. If `records` is a mapping, its keys are titles of groups.

    Raises ValueError for rows of the wrong length.
    """
    groups = records if isinstance(records, Mapping) else {"": records}
    for record in chain.from_iterable(groups.values()):
        if isinstance(record, list | tuple) and len(record) != len(columns):
            raise ValueError(f"expected {len(columns)} cells: {record!r}")
    rows = {
        title: [[column.cell(record, index) for index, column in enumerate(columns)] for record in members]
        for title, members in groups.items()
    }
    return Table(caption, tuple(columns), rows, wordy, note, by)


def grouped(records: Iterable[Mapping[str, Any]], *keys: str) -> dict[str, list[Mapping[str, Any]]]:
    """Group records by their values of some keys, in the order in which groups first appear."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for record in records:
        groups.setdefault(" ".join(str(record[key]) for key in keys), []).append(record)
    return groups


def side_by_side(
    caption: str,
    lines: Sequence[Column],
    records: Mapping[str, Any],
    *,
    head: str = "quantity",
    numeric: bool = True,
    note: str = "",
) -> Table:
    """Build a table with a column for each record and a row for each entry of `lines`. Rows without a value are left
    out."""
    rows = []
    for line in lines:
        cells = {title: line.cell(record) for title, record in records.items() if line.value(record) is not None}
        if cells:
            rows.append([line.title, *(cells.get(title, Cell("")) for title in records)])
    return table(caption, [Column(head), *(Column(title, numeric=numeric) for title in records)], rows, note=note)


def record_table(rows: Sequence[Mapping[str, Any]], written: Callable[[Any], str] = str) -> Table:
    """Build a table of all keys of the records. Cells of missing keys are empty."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    cells = [
        [Cell("" if (value := row.get(name)) is None else written(value), value=value) for name in names]
        for row in rows
    ]
    lengths = [max(len(row[index].text) for row in cells) for index in range(len(names))]
    room = any(length <= LONGEST_CELL for length in lengths)
    columns = [Column(name, wide=room and length > LONGEST_CELL) for name, length in zip(names, lengths, strict=True)]
    return table("", columns, cells)


def flatten(content: Table, wide: bool = False) -> tuple[list[str], list[list[Cell]]]:
    """Return the header and the rows. If there are group titles, they form the first column. `wide` includes columns
    of sentences."""
    places = [place for place, column in enumerate(content.columns) if wide or not column.wide]
    titled = any(content.groups)
    heads = [*([content.by] if titled else []), *(content.columns[place].title for place in places)]
    rows = [
        [*([Cell(title, value=title)] if titled else []), *(row[place] for place in places)]
        for title, members in content.groups.items()
        for row in members
    ]
    return heads, rows


def table_lines(content: Table) -> list[str]:
    heads, rows = flatten(content)
    texts = [[cell.text for cell in row] for row in rows]
    return aligned([heads, *texts] if texts and any(heads) else texts)


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(width(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
    return [
        "  ".join(cell + " " * (wide - width(cell)) for cell, wide in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def width(text: str) -> int:
    """Return the width of a text on a terminal, where combining characters take no space."""
    return sum(not unicodedata.combining(letter) for letter in text)


def as_csv(content: Table) -> bytes:
    heads, rows = flatten(content, wide=True)
    return csv_text(heads, ([cell.datum for cell in row] for row in rows))


INDENT = "  "
PARAGRAPH_WIDTH = 100
"""Line width of a paragraph (characters)."""
LONGEST_ROW = 12
"""A row with at most this many values is shown in full."""
ENDS = 4
"""Number of values shown at each end of a longer row."""


def describe_summary(summary: Mapping[str, Any], indent: str = INDENT, short: bool = False) -> Iterator[str]:
    """Yield a line for each key, then nested values or, for a list of objects, a table. `short` shortens long rows."""
    widest = max((len(key) for key in summary), default=0)
    for key, value in summary.items():
        if isinstance(value, Mapping) and value:
            yield f"{indent}{key}"
            yield from describe_summary(value, indent + INDENT, short)
        elif isinstance(value, list) and value and all(isinstance(row, Mapping) for row in value):
            yield f"{indent}{key}"
            yield from (f"{indent}{INDENT}{line}" for line in record_lines(value))
        else:
            yield f"{indent}{key:<{widest}}  {format_value(cut(value) if short else value)}"


def cut(value: Any) -> Any:
    """Replace the middle of a long row by a note, and return any other value unchanged."""
    if not isinstance(value, list) or len(value) <= LONGEST_ROW:
        return value
    ends = [format_value(item) for item in (*value[:ENDS], *value[-ENDS:])]
    return [*ends[:ENDS], "…", *ends[ENDS:], f"({len(value)} values; `walkerlab show` lists all)"]


def record_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Tabulate objects, with keys as headers, and name the keys that are left out because their columns are too
    wide."""
    cells = record_table(rows, format_value)
    long = [column.title for column in cells.columns if column.wide]
    return [*table_lines(cells), f"with --json also: {', '.join(long)}"] if long else table_lines(cells)


def paragraph(text: str) -> list[str]:
    """Wrap prose without breaking words."""
    return textwrap.wrap(text, PARAGRAPH_WIDTH, break_long_words=False, break_on_hyphens=False)


def lay_out(blocks: Iterable[str | Table]) -> list[str]:
    """Return the lines of paragraphs and tables, with an empty line before and after each table."""
    lines: list[str] = []
    after_table = False
    for block in blocks:
        is_table = isinstance(block, Table)
        block_lines = table_lines(block) if isinstance(block, Table) else paragraph(block)
        if block_lines:
            lines += [""] if lines and (is_table or after_table) else []
            lines += block_lines
            after_table = is_table
    return lines


def format_value(value: Any) -> str:
    """Format a value on one line."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.10g}"
    if isinstance(value, list):
        items = (f"({format_value(item)})" if isinstance(item, list) else format_value(item) for item in value)
        return "  ".join(items) or "-"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {format_value(item)}" for key, item in value.items()) or "-"
    return str(value)
