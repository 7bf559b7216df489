"""Where the paper errs: printed, right, and how that was measured."""

from __future__ import annotations

from walkerlab.report.blocks import PAPER, Section
from walkerlab.report.numbers import count
from walkerlab.report.results import Results
from walkerlab.report.symbols import in_signs
from walkerlab.report.tables import Column, table

HEADS = {
    "where": "where",
    "printed": "printed",
    "right": "right",
    "evidence": "evidence",
    "measured": "measured here",
}
"""Variables of the stored errata, and their heads."""
COLUMNS = [Column(head, name, in_signs, wide=name != "where") for name, head in HEADS.items()]


def section(results: Results) -> Section | None:
    """The errata, each with what it was measured by."""
    rows = errata(results)
    if not rows:
        return None
    found = table("What is printed, and what is right", COLUMNS, rows, wordy=True)
    finding = f"{count(len(rows), 'place')} where the paper does not say what is right."
    return Section("errata", "Errata of the paper", (found,), finding, PAPER)


def errata(results: Results) -> list[dict[str, str]]:
    """The errata that `compare` found, by the names of their parts; none without it."""
    group = results.group("compare", "errata")
    if group is None:
        return []
    return [dict(zip(HEADS, row, strict=True)) for row in zip(*(group[name].tolist() for name in HEADS), strict=True)]
