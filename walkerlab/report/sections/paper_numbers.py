"""Every number that the paper prints, beside what is computed here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from walkerlab.report.blocks import PAPER, Cell, Column, Finding, Findings, Paragraph, Section, Table, Tone, body
from walkerlab.report.numbers import NONE, count, listed, number
from walkerlab.report.results import Results
from walkerlab.report.symbols import in_signs

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
    places: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        places.setdefault(str(row["where"]), []).append(row)
    models = {key: head for key, head in MODELS.items() if any(row.get(key) is not None for row in rows)}
    columns = (
        Column("quantity"),
        Column("printed", numeric=True),
        *(Column(head, numeric=True) for head in models.values()),
        Column("verdict"),
        Column("evidence", wide=True),
    )
    bodies = tuple(body([row_of(row, tuple(models)) for row in found], where) for where, found in places.items())
    numbers = Table("What the paper prints, and what its equations give", columns, bodies, wordy=True)
    verdicts = Counter(str(row["verdict"]) for row in rows)
    counts = listed(f"{verdicts[name]} {name}" for name in TONES if verdicts[name])
    finding = f"Of {count(len(rows), 'number')} that the paper prints: {counts}."
    told = Findings(
        tuple(Finding(f"{name.capitalize()}:", MEANINGS[name], tone=TONES[name]) for name in MEANINGS), "lines"
    )
    return Section("paper-numbers", "The paper’s numbers", (*departures(results), told, numbers), finding, PAPER)


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


def row_of(row: Mapping[str, Any], models: Sequence[str]) -> list[str | Cell]:
    """A number of the paper as a row."""
    quantity = in_signs(f"{row['quantity']}{unit_of(row)}")
    verdict = str(row["verdict"])
    values = [shown(row, key) for key in ("printed", *models)]
    return [quantity, *values, Cell(verdict, TONES.get(verdict, "plain")), in_signs(str(row["evidence"]))]


def unit_of(row: Mapping[str, Any]) -> str:
    """The unit of a number in brackets; empty for a pure number."""
    unit = str(row.get("unit") or "")
    if unit == "not given":
        return " (unit not given)"
    return f" ({unit})" if unit not in ("", "1") else ""


def shown(row: Mapping[str, Any], key: str) -> str:
    """A value of a row: as its text says, or as a number."""
    value = row.get(f"{key}_text", row.get(key))
    if value is None or value == "":
        return NONE
    return in_signs(value) if isinstance(value, str) else number(float(value), 5)
