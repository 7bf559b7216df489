"""Where the paper errs: printed, right, and how that was measured."""

from __future__ import annotations

from walkerlab.report.blocks import Column, Section, table
from walkerlab.report.results import Results
from walkerlab.report.symbols import in_signs

COLUMNS = {
    "where": "where",
    "printed": "printed",
    "right": "right",
    "evidence": "evidence",
    "measured": "measured here",
}
"""Variables of the stored errata, and their heads."""


def section(results: Results) -> Section | None:
    """The errata, each with what it was measured by."""
    group = results.group("compare", "errata")
    if group is None:
        return None
    kept = {name: head for name, head in COLUMNS.items() if name in group.variables}
    columns = [Column(head, wide=index > 0) for index, head in enumerate(kept.values())]
    rows = [[in_signs(str(text)) for text in row] for row in zip(*(group[name].tolist() for name in kept), strict=True)]
    found = table("What is printed, and what is right", columns, rows, wordy=True)
    return Section("errata", "Errata of the paper", (found,))
