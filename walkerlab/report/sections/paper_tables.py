"""Tables 1, 2 and 3 of the paper, each beside what is used or found here."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from walkerlab.report.blocks import PAPER, PageBlock, Section
from walkerlab.report.numbers import NONE, number
from walkerlab.report.results import Results
from walkerlab.report.symbols import in_signs
from walkerlab.report.tables import Column, Table, table

CAPTIONS = {
    "table1": "Table 1: parameters of the walker, in the paper and as used here",
    "table2": "Table 2: initial values, in the paper and here",
    "table3": "Table 3: characteristics of the walk, in the paper and here",
}
"""The tables in the summary of `compare`."""

HEADS = {
    "paper": "paper",
    "paper_matlab": "paper, MATLAB",
    "paper_adams": "paper, ADAMS",
    "as_printed": "as printed",
    "corrected": "corrected",
    "contact": "contact model",
    "used": "used here",
    "paper_percent": "paper, %",
    "percent_of_matlab": "% of MATLAB",
    "percent_of_adams": "% of ADAMS",
}
"""Heads of columns; one that is not among them is called by its name."""

NAMES = {
    "t_left": "left step period",
    "t_right": "right step period",
    "t_cycle": "one cycle period",
    "v_com": "average velocity",
    "E_avg": "average mechanical energy",
}
"""What the rows are called in words, where their symbol does not say it."""

UNIT = "unit"
Rows = Mapping[str, Mapping[str, Any]]


def section(results: Results) -> Section | None:
    """The tables that there are."""
    summary = results.summary("compare") or {}
    tables: list[PageBlock] = [
        paper_table(caption, summary[key]) for key, caption in CAPTIONS.items() if summary.get(key)
    ]
    return Section("tables", "The paper’s tables", tuple(tables), page=PAPER) if tables else None


def paper_table(caption: str, rows: Rows) -> Table:
    """One table; its rows are named by their symbol and unit, and columns without any value are left away."""
    found = dict.fromkeys(name for row in rows.values() for name, value in row.items() if value is not None)
    columns = [column_of(name, rows) for name in found if name != UNIT]
    named = [{"row": row_name(symbol, row), **row} for symbol, row in rows.items()]
    return table(caption, [Column("row", "row"), *columns], named)


def column_of(name: str, rows: Rows) -> Column:
    """The column of a name, of texts or of numbers."""
    texts = any(isinstance(row.get(name), str) for row in rows.values())
    digits = 3 if "percent" in name else 6
    return Column(HEADS.get(name, name.replace("_", " ")), name, partial(shown, digits=digits), numeric=not texts)


def row_name(symbol: str, row: Mapping[str, Any]) -> str:
    """A row's symbol, what it stands for, and its unit."""
    words = f"{NAMES[symbol]}, {symbol}" if symbol in NAMES else symbol
    unit = row.get(UNIT)
    return in_signs(f"{words} ({unit})" if unit not in (None, "", "1") else words)


def shown(value: Any, digits: int) -> str:
    """A cell of a table."""
    if value is None:
        return NONE
    return in_signs(value) if isinstance(value, str) else number(float(value), digits)
