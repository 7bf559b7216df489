"""Which starts walk: how much of the window, to which attractors, and how near to the gait walks fail."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.report.blocks import Block, Cell, Column, Paragraph, Section, table
from walkerlab.report.numbers import listed, number, whole
from walkerlab.report.results import Results


def section(results: Results) -> Section | None:
    """What the basin came to; None if it was not asked for."""
    summary = results.summary("basin")
    if summary is None:
        return None
    blocks: list[Block] = [shares(summary)]
    if summary["attractors"]:
        blocks.append(attractors(summary))
    return Section("basin", "Basins of attraction", tuple(blocks))


def shares(summary: Mapping[str, Any]) -> Paragraph:
    """How much walks, which hangs on the window, and what does not."""
    window = listed(
        f"{name} from {number(low, 4)} to {number(high, 4)}" for name, (low, high) in summary["window"].items()
    )
    ends = listed(f"{many:,} {name}" for name, many in summary["outcomes"].items())
    text = (
        f"Starts just after heel strike, {window}, the other coordinates the gait’s, in the {summary['model']} model: "
        f"{number(100.0 * summary['share_walking'], 3)} % of the window walk, "
        f"{number(100.0 * summary['share_walking_gaussian'], 3)} % weighted by a normal distribution around its "
        f"middle. Cells by outcome: {ends}."
    )
    if "margin" in summary:
        text += (
            f" The nearest cell that fails is {number(summary['margin'], 3)} away from the gait (rad and sqrt(g/L)), "
            "whatever the window."
        )
    return Paragraph(text)


def attractors(summary: Mapping[str, Any]) -> Block:
    """What walks settle on."""
    columns = [
        Column("period (steps)", numeric=True),
        Column("cells", numeric=True),
        Column("steps to reach it, median", numeric=True),
    ]
    rows: list[list[str | Cell]] = [
        [whole(row["period"]), whole(row["cells"]), number(row.get("median_steps_to_settle"), 3)]
        for row in summary["attractors"]
    ]
    note = f"{whole(summary['unsettled_cells'])} cells walk {whole(summary['steps_wanted'])} steps without settling."
    return table("Attractors", columns, rows, note=note)
