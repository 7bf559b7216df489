"""Which starts walk: how much of the window, to which attractors, and how near to the gait walks fail."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.report.blocks import PageBlock, Paragraph, Section
from walkerlab.report.numbers import number, whole
from walkerlab.report.results import Results
from walkerlab.report.tables import Column, Table, table
from walkerlab.report.words import words

COLUMNS = (
    Column("period (steps)", "period", whole, numeric=True),
    Column("cells", "cells", whole, numeric=True),
    Column("steps to reach it, median", "median_steps_to_settle", lambda steps: number(steps, 3), numeric=True),
)


def section(results: Results) -> Section | None:
    """What the basin came to; None if it was not asked for."""
    summary = results.summary("basin")
    if summary is None:
        return None
    blocks: list[PageBlock] = [shares(summary)]
    if summary["attractors"]:
        blocks.append(attractors(summary))
    return Section("basin", "Basins of attraction", tuple(blocks))


def shares(summary: Mapping[str, Any]) -> Paragraph:
    """The share of starts that walk, which depends on the window, and what does not depend on it."""
    window = [f"{name} from {number(low, 4)} to {number(high, 4)}" for name, (low, high) in summary["window"].items()]
    ends = [f"{many:,} {name}" for name, many in summary["outcomes"].items()]
    return Paragraph(words("basin.shares", summary, window, ends))


def attractors(summary: Mapping[str, Any]) -> Table:
    """What walks settle on."""
    return table("Attractors", COLUMNS, summary["attractors"], note=words("basin.unsettled", summary))
