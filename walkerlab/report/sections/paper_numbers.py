"""Every number that the paper prints, beside what is computed here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from walkerlab.report.blocks import PAPER, PageBlock, Paragraph, Section, Statement, Statements
from walkerlab.report.numbers import count, listed, number
from walkerlab.report.results import Results
from walkerlab.report.symbols import in_signs
from walkerlab.report.tables import Cell, Column, Table, Tone, table

TONES: dict[str, Tone] = {"reproduced": "good", "explained": "fair", "refuted": "bad"}
"""The verdicts, and how each is set."""

MODELS = {"as_printed": "as printed", "corrected": "corrected", "contact": "contact model"}
"""What a number of the paper is compared with."""


MEANINGS = {
    "reproduced": "They come out to the printed digits; parameters that are used as printed are among them.",
    "explained": "They do not come out, or not by themselves, and what was measured says why.",
    "refuted": "They contradict what was measured, or the paper’s own numbers.",
}
"""What a verdict says."""


def section(results: Results) -> Section | None:
    """All the paper's numbers with their verdicts."""
    rows = paper_numbers(results)
    if not rows:
        return None
    verdicts = Counter(str(row["verdict"]) for row in rows)
    counts = listed(f"{verdicts[name]} {name}" for name in TONES if verdicts[name])
    finding = f"Of {count(len(rows), 'number')} that the paper prints: {counts}."
    told = [Statement(f"{name.capitalize()}:", MEANINGS[name], tone=TONES[name]) for name in MEANINGS]
    blocks: tuple[PageBlock, ...] = (*departures(results), Statements(tuple(told), "lines"), numbers_table(rows))
    return Section("paper-numbers", "The paper’s numbers", blocks, finding, PAPER)


def numbers_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The paper's numbers by where they stand, beside those of the models that have any."""
    places: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        places.setdefault(str(row["where"]), []).append(row)
    models = [key for key in MODELS if any(row.get(key) is not None for row in rows)]
    columns = (
        Column("quantity", lambda row: in_signs(f"{row['quantity']}{unit_of(row)}")),
        Column("printed", "printed", in_signs, numeric=True),
        *(Column(MODELS[key], key, number, numeric=True) for key in models),
        Column("verdict", "verdict", lambda verdict: Cell(verdict, TONES.get(verdict, "plain"))),
        Column("evidence", "evidence", in_signs, wide=True),
    )
    caption = "What the paper prints, and what its equations give"
    return table(caption, columns, places, wordy=True, by="where")


def departures(results: Results) -> tuple[Paragraph, ...]:
    """How the scene differs from the paper's; nothing if it does not."""
    if not results.departures:
        return ()
    differs = in_signs("; ".join(str(departure) for departure in results.departures))
    said = f"This scene is not the paper’s: {differs}. What does not come out here is not refuted by that."
    return (Paragraph(said, "fair"),)


def paper_numbers(results: Results) -> Sequence[Mapping[str, Any]]:
    """The rows that `compare` made; none without it."""
    rows: Sequence[Mapping[str, Any]] = (results.summary("compare") or {}).get("paper_numbers", ())
    return rows


def unit_of(row: Mapping[str, Any]) -> str:
    """The unit of a number in brackets; empty for a pure number."""
    unit = str(row.get("unit") or "")
    if unit == "not given":
        return " (unit not given)"
    return f" ({unit})" if unit not in ("", "1") else ""
