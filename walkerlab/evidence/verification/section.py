"""Report section on extreme cases, problems with known answers and ordinary methods."""

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.evidence.verification.verdict import BUDGET_USED
from walkerlab.outcome import outcome_of
from walkerlab.views.report import blocks as page
from walkerlab.views.report.numbers import format_integer, number
from walkerlab.views.report.tables import Cell, Column, Table, Tone, grouped, measured, table
from walkerlab.views.report.words import words

VERDICT_TONES: Mapping[str, Tone] = {"fine": "good", "wrong silently": "bad", "diverges": "bad", "gives up": "fair"}

Row = Mapping[str, Any]
Rows = Sequence[Row]


@page.stage_section("stability")
def section(results: page.Results, summary: Row) -> page.Section | None:
    """Build the section, or return None if the stage did not run."""
    cases = summary["cases"]
    unanswered = [{**row, "why": row["second_tried"]} for row in cases if row["second_tried"]]
    unmeasured = [
        {**row, "why": f"{measure['measure']}: {measure['why']}"} for row in cases for measure in row["not_measured"]
    ]
    note = words("stability.cases", group_by_reason(unanswered), group_by_reason(unmeasured))
    planes = results.summary("stability-maps")
    not_covered = tuple(page.Statement(f"{what}:", why) for what, why in words.terms("stability.not_covered").items())
    blocks: tuple[page.PageBlock, ...] = (
        *(page.Paragraph(failure, "bad") for failure in failures(summary)),
        page.Paragraph(words("stability.judgement")),
        table("Extreme cases", CASE_COLUMNS, grouped(cases, "family"), wordy=True, note=note),
        table("Problems with known answers, run through the contact code", KNOWN_COLUMNS, summary["known"], wordy=True),
        page.Paragraph("Not covered:"),
        page.Statements(not_covered),
        ordinary_table(summary),
        page.Paragraph(words("stability.maps", planes) if planes else words("stability.how_to_map")),
        *(page.Gallery((picture,)) for picture in results.pictures if picture.name.startswith("stability")),
    )
    return page.Section.create("stability", "Stiff and extreme cases", blocks, finding(summary), page.CASES)


def finding(summary: Row) -> str:
    """State how many cases ended as expected, and how many of these were meant to end without an answer."""
    return words("stability.finding", summary, len([row for row in summary["cases"] if row["ok"] and gave_up(row)]))


def gave_up(row: Row) -> bool:
    outcome = outcome_of(row["outcome"])
    return outcome is not None and not outcome.answered


def outcome_cell(row: Row) -> Cell:
    """Return the table cell with the outcome of a case. It is green only if an answer was expected and found."""
    return Cell(row["outcome"], ("fair" if gave_up(row) else "good") if row["ok"] else "bad")


def failures(summary: Row) -> list[str]:
    failed = [words("stability.failed_case", row) for row in summary["cases"] if not row["ok"]]
    return failed + [words("stability.failed_problem", row) for row in summary["known"] if not row["ok"]]


def worst_measure(row: Row) -> float | None:
    """Return the largest ratio of a measure to its limit, not counting the use of the budget."""
    measures = [measure for measure in row["measures"] if measure["limit"] > 0.0 and measure["measure"] != BUDGET_USED]
    return max((measure["value"] / measure["limit"] for measure in measures), default=None)


CASE_COLUMNS = (
    Column("case", "name"),
    Column("ended as", outcome_cell),
    Column("steps", "steps", format_integer, numeric=True),
    Column("other method", "second_method", lambda name: name or "none"),
    Column("worst measure / limit", worst_measure, partial(number, digits=2), numeric=True),
    Column("right-hand sides", "rhs_evaluations", format_integer, numeric=True),
    measured("time", "wall_s", partial(number, digits=3), prefix="m"),
    Column("why expected", "reason", wide=True),
)


def group_by_reason(cases: Rows) -> str:
    return "; ".join(f"{why} ({', '.join(row['name'] for row in rows)})" for why, rows in grouped(cases, "why").items())


def family_table(cases: Rows) -> Table:
    counts = Counter((case["family"], case["outcome"]) for case in cases)
    return table("", [Column("family"), Column("outcome"), Column("cases")], [(*key, n) for key, n in counts.items()])


KNOWN_COLUMNS = (
    Column("problem", "name"),
    Column("quantity", "quantity"),
    Column("contact code", "value", partial(number, digits=7), numeric=True),
    Column("reference", "reference", partial(number, digits=7), numeric=True),
    Column("relative error", lambda row: Cell(number(row["error"], 2), "good" if row["ok"] else "bad"), numeric=True),
    Column("reference method", "source", wide=True),
)


def ordinary_table(summary: Row) -> Table:
    """Build the table of ordinary methods: one row per case, one column per method."""
    methods = [
        Column(method.removeprefix("SciPy ").removeprefix("semi-implicit "), method, ordinary_cell)
        for method in grouped(summary["ordinary"], "method")
    ]
    tried = grouped(summary["ordinary"], "case").items()
    records = [{"case": case, **{row["method"]: row for row in rows}} for case, rows in tried]
    note = words("stability.ordinary", summary)
    return table("Ordinary methods", [Column("case", "case"), *methods], records, note=note)


def ordinary_cell(row: Row | None) -> Cell:
    if row is None:
        return Cell("")
    error = f" {number(row['error'], 2)}," if "error" in row else ""
    return Cell(f"{row['verdict']}:{error} {number(1e3 * row['wall_s'], 2)} ms", VERDICT_TONES[row["verdict"]])


def answer(summary: Row) -> list[str | Table]:
    """Report how many cases ended as expected, and which of them did not."""
    return [finding(summary), family_table(summary["cases"]), *failures(summary)]
