"""The page of the paper: every number that it prints beside what is computed here, its tables, and its errata."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.report.blocks import PAPER, PageBlock, Paragraph, Section, Statement, Statements
from walkerlab.report.numbers import NONE, count, listed, number
from walkerlab.report.results import Results
from walkerlab.report.symbols import in_signs
from walkerlab.report.tables import Cell, Column, Table, Tone, grouped, table

Row = Mapping[str, Any]

TONES: dict[str, Tone] = {"reproduced": "good", "explained": "fair", "refuted": "bad"}
"""The verdicts, and how each is set."""

BESIDE = {"as_printed": "as printed", "corrected": "corrected", "contact": "contact model"}
"""What a number of the paper is compared with."""


MEANINGS = {
    "reproduced": "They come out to the printed digits; parameters that are used as printed are among them.",
    "explained": "They do not come out, or not by themselves, and what was measured says why.",
    "refuted": "They contradict what was measured, or the paper’s own numbers.",
}
"""What a verdict says."""


def numbers(results: Results) -> Section | None:
    """All the paper's numbers with their verdicts."""
    rows = paper_numbers(results)
    if not rows:
        return None
    verdicts = Counter(str(row["verdict"]) for row in rows)
    counts = listed(f"{verdicts[name]} {name}" for name in TONES if verdicts[name])
    finding = f"Of {count(len(rows), 'number')} that the paper prints: {counts}."
    told = [Statement(f"{name.capitalize()}:", MEANINGS[name], tone=TONES[name]) for name in MEANINGS]
    blocks: tuple[PageBlock, ...] = (Statements(tuple(told), "lines"), numbers_table(rows))
    if results.departures:
        differs = in_signs("; ".join(results.departures))
        said = f"This scene is not the paper’s: {differs}. What does not come out here is not refuted by that."
        blocks = (Paragraph(said, "fair"), *blocks)
    return Section("paper-numbers", "The paper’s numbers", blocks, finding, PAPER)


def numbers_table(rows: Sequence[Row]) -> Table:
    """The paper's numbers by where they stand, beside those of the models that have any."""
    models = [key for key in BESIDE if any(row.get(key) is not None for row in rows)]
    columns = (
        Column("quantity", lambda row: in_signs(f"{row['quantity']}{unit_of(row)}")),
        Column("printed", "printed", in_signs, numeric=True),
        *(Column(BESIDE[key], key, number, numeric=True) for key in models),
        Column("verdict", "verdict", lambda verdict: Cell(verdict, TONES.get(verdict, "plain"))),
        Column("evidence", "evidence", in_signs, wide=True),
    )
    caption = "What the paper prints, and what its equations give"
    return table(caption, columns, grouped(rows, "where"), wordy=True, by="where")


def paper_numbers(results: Results) -> Sequence[Row]:
    """The rows that `compare` made; none without it."""
    rows: Sequence[Row] = results.summary("compare").get("paper_numbers", ())
    return rows


def unit_of(row: Row) -> str:
    """The unit of a number in brackets; empty for a pure number."""
    unit = str(row.get("unit") or "")
    if unit == "not given":
        return " (unit not given)"
    return f" ({unit})" if unit not in ("", "1") else ""


CAPTIONS = {
    "table1": "Table 1: parameters of the walker, in the paper and as used here",
    "table2": "Table 2: initial values, in the paper and here",
    "table3": "Table 3: characteristics of the walk, in the paper and here",
}
"""The tables in the summary of `compare`."""

NOTES = {
    "table3": "Ours are of the last completed stride, whose first step is the left one; the energy is the time mean "
    "over the rigid gaits' ten steps and over the contact model's last five."
}
"""What to know when reading them: whose periods these are, and over which time a mean is."""

HEADS = {
    "paper": "paper",
    "paper_matlab": "paper, MATLAB",
    "paper_adams": "paper, ADAMS",
    **BESIDE,
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


def tables(results: Results) -> Section | None:
    """The tables that there are."""
    summary = results.summary("compare")
    shown: list[PageBlock] = [
        paper_table(caption, summary[key], NOTES.get(key, "")) for key, caption in CAPTIONS.items() if summary.get(key)
    ]
    return Section("tables", "The paper’s tables", tuple(shown), page=PAPER) if shown else None


def paper_table(caption: str, rows: Mapping[str, Row], note: str) -> Table:
    """One table; its rows are named by their symbol and unit, and columns without any value are left away."""
    found = dict.fromkeys(name for row in rows.values() for name, value in row.items() if value is not None)
    columns = [column_of(name, rows) for name in found if name != UNIT]
    named = [{"row": row_name(symbol, row), **row} for symbol, row in rows.items()]
    return table(caption, [Column("row", "row"), *columns], named, note=note)


def column_of(name: str, rows: Mapping[str, Row]) -> Column:
    """The column of a name, of texts or of numbers."""
    texts = any(isinstance(row.get(name), str) for row in rows.values())
    digits = 3 if "percent" in name else 6
    return Column(HEADS.get(name, name.replace("_", " ")), name, partial(value_of, digits=digits), numeric=not texts)


def row_name(symbol: str, row: Row) -> str:
    """A row's symbol, what it stands for, and its unit."""
    words = f"{NAMES[symbol]}, {symbol}" if symbol in NAMES else symbol
    unit = row.get(UNIT)
    return in_signs(f"{words} ({unit})" if unit not in (None, "", "1") else words)


def value_of(value: Any, digits: int) -> str:
    """A cell of a table."""
    if value is None:
        return NONE
    return in_signs(value) if isinstance(value, str) else number(float(value), digits)


PARTS = {"where": "where", "printed": "printed", "right": "right", "evidence": "evidence", "measured": "measured here"}
"""Variables of the stored errata, and their heads."""
ERRATUM_COLUMNS = [Column(head, name, in_signs, wide=name != "where") for name, head in PARTS.items()]


def errors(results: Results) -> Section | None:
    """The errata, each with what it was measured by."""
    rows = errata(results)
    if not rows:
        return None
    found = table("What is printed, and what is right", ERRATUM_COLUMNS, rows, wordy=True)
    finding = f"{count(len(rows), 'error')} and gaps of the paper, each with its evidence."
    return Section("errata", "Errata of the paper", (found,), finding, PAPER)


def errata(results: Results) -> Sequence[Row]:
    """The errata that `compare` found, by the names of their parts; none without it."""
    found: Sequence[Row] = results.summary("compare").get("errata", ())
    return found
