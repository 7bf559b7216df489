"""How a table shows rows of a result: each column's head beside what stands in its cells."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from walkerlab.labels import labels_of, with_unit
from walkerlab.report.blocks import Cell, Column

Row = Mapping[str, Any]
PREFIXES: Final = {"": 1.0, "m": 1e3, "µ": 1e6}


@dataclass(frozen=True)
class Shown:
    """A column of a table, and what a row has in it."""

    head: Column
    cell: Callable[[Row], str | Cell]


def head_of(row: type, name: str, words: str, prefix: str = "") -> Column:
    """The head of a column of numbers, in a multiple of the unit that a class of rows gives them."""
    return Column(with_unit(words, f"{prefix}{labels_of(row)[name].unit}"), numeric=True)


def shown(row: type, name: str, words: str, written: Callable[[float | None], str], prefix: str = "") -> Shown:
    """A column of numbers in a multiple of the unit that a class of rows gives them."""

    def cell(values: Row) -> str:
        value = values[name]
        return written(PREFIXES[prefix] * value if prefix and value is not None else value)

    return Shown(head_of(row, name, words, prefix), cell)


def lines(columns: Sequence[Shown], rows: Sequence[Row]) -> list[list[str | Cell]]:
    """The cells of rows."""
    return [[column.cell(row) for column in columns] for row in rows]


def heads(columns: Sequence[Shown]) -> tuple[Column, ...]:
    """The heads of columns."""
    return tuple(column.head for column in columns)
