"""The paper's numbers, tables and errata as groups of an artifact.

Where a model has no value there is none: a model's column has a dimension of its own, whose coordinate says which rows
its numbers stand in. Beside it a column of texts has all the rows.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from walkerlab.store.columns import numbered
from walkerlab.store.content import Group, Variable

ROW = "row"
MODELS = {
    "as_printed": "rigid model, equations as printed",
    "corrected": "rigid model, corrected equations",
    "contact": "contact model",
}
MEANINGS = {
    **MODELS,
    "quantity": "what it is",
    "unit": "unit of the row's numbers",
    "where": "where the paper has it",
    "paper": "as the paper has it",
    "used": "as used here",
    "paper_matlab": "the paper's MATLAB model",
    "paper_adams": "the paper's MSC ADAMS model",
    "paper_percent": "difference rate as printed",
    "percent_of_matlab": "difference in percent of the MATLAB value",
    "percent_of_adams": "difference in percent of the ADAMS value",
    "printed": "as printed",
    "verdict": "reproduced, explained or refuted",
    "evidence": "why",
}
"""Columns of the tables."""
BY_ROW = "see the column of units"


def texts(values: Iterable[str], long_name: str) -> Variable:
    """A column of texts."""
    return Variable(np.array(list(values), dtype=object), (ROW,), "", long_name)


def numbers(name: str, values: Sequence[float | None], long_name: str) -> dict[str, Variable]:
    """A model's column, which may have gaps, and its texts."""
    rows = [row for row, value in enumerate(values) if value is not None]
    as_text = ["" if value is None else f"{value:.10g}" for value in values]
    column = {f"{name}_text": texts(as_text, f"{long_name}, as text")}
    if rows:
        dim = f"{name}_{ROW}"
        given = np.array([value for value in values if value is not None], dtype=float)
        column[dim] = Variable(np.array(rows), (dim,), "1", f"rows with a number: {long_name}")
        column[name] = Variable(given, (dim,), BY_ROW, long_name)
    return column


def table_group(table: Mapping[str, Mapping[str, Any]]) -> Group:
    """One of the paper's tables."""
    group = numbers_group(list(table.values()))
    return Group({**group.variables, "name": texts(table, "symbol of the row")})


def numbers_group(rows: Sequence[Mapping[str, Any]]) -> Group:
    """Numbers of the paper beside those of the models, as the command prints them."""
    variables = numbered(len(rows), ROW, "row")
    for name in rows[0]:
        values = [row[name] for row in rows]
        if name in MODELS:
            variables |= numbers(name, values, MEANINGS[name])
        elif isinstance(values[0], str):
            variables[name] = texts(values, MEANINGS[name])
        else:
            variables[name] = Variable(np.array(values, dtype=float), (ROW,), BY_ROW, MEANINGS[name])
    return Group(variables)
