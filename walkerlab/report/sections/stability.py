"""How extreme cases end, what known problems come to, and what ordinary methods make of the same scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Any

from walkerlab.report.blocks import (
    CASES,
    Block,
    Cell,
    Column,
    Gallery,
    Paragraph,
    Section,
    Table,
    Tone,
    body,
    table,
)
from walkerlab.report.numbers import count, listed, number, whole
from walkerlab.report.results import Results
from walkerlab.report.shown import Shown, heads, lines
from walkerlab.verification.verdict import BUDGET_USED

VERDICTS: Mapping[str, Tone] = {"fine": "good", "wrong silently": "bad", "diverges": "bad", "gives up": "fair"}

Rows = Sequence[Mapping[str, Any]]


def section(results: Results) -> Section | None:
    """The stability table; None if the stage did not run."""
    summary = results.summary("stability")
    if summary is None:
        return None
    cases, known = summary["cases"], summary["known"]
    blocks: list[Block] = [*failures(cases, known), judgement(), case_table(cases), known_table(known)]
    if summary["ordinary"]:
        blocks.append(ordinary_table(summary))
    blocks.append(maps(results))
    blocks += [Gallery((picture,)) for picture in results.pictures if picture.name.startswith("stability")]
    total = summary["passed"] + summary["failed"]
    finding = f"{summary['passed']} of {count(total, 'extreme case')} and known problems came out right."
    return Section("stability", "Stiff and extreme cases", tuple(blocks), finding, CASES)


def failures(cases: Rows, known: Rows) -> list[Block]:
    """What is not as it should be, and why; in red."""
    found: list[Block] = [
        Paragraph(f"{row['name']} ({row['family']}): {row['note']}. Expected: {row['reason']}.", "bad")
        for row in cases
        if not row["ok"]
    ]
    found += [
        Paragraph(
            f"{row['name']}: {row['quantity']} is {number(row['value'])}, by another route {number(row['reference'])}; "
            f"the error of {number(row['error'], 2)} is above {number(row['limit'], 2)}.",
            "bad",
        )
        for row in known
        if not row["ok"]
    ]
    return found


def judgement() -> Paragraph:
    """How cases are judged."""
    judged = (
        "A case passes if it ends as expected, within its budget of right-hand sides, with finite numbers, its energy "
        "balanced, nothing won back from friction or damping, momentum kept at rigid heel strikes and elsewhere given "
        "by ground and gravity, and the same times at a tolerance ten times tighter and by another method; walkers of "
        "other sizes also agree with a twin of ordinary size."
    )
    return Paragraph(judged)


def maps(results: Results) -> Paragraph:
    """What the maps came to, or how to make them."""
    summary = results.summary("stability-maps")
    if summary is None:
        return Paragraph(
            "`walkerlab stability --full` maps whole planes too: stiffness and stiction velocity by the default "
            "method, stiffness and step size by a game engine’s. It takes minutes, and goes on where it is interrupted."
        )
    ends = listed(f"{many} {name}" for name, many in summary["outcomes"].items())
    fixed = listed(f"{many} {name}" for name, many in summary["fixed_step"].items())
    return Paragraph(
        f"Two of the figures map whole planes. Over stiffness and stiction velocity the default method’s walks ended: "
        f"{ends}; {summary['ends_otherwise_sharper']} end otherwise at a tolerance ten times tighter, the others "
        f"differ by {number(summary['median_error'], 2)} in the median and {number(summary['largest_error'], 2)} at "
        f"most. Over stiffness and step size a game engine’s method was: {fixed}."
    )


def worst_measure(row: Mapping[str, Any]) -> str:
    """The largest of a case's measures but its use of the budget, each over its limit."""
    judged = [one for one in row["measures"] if one["limit"] > 0.0 and one["measure"] != BUDGET_USED]
    return number(max((one["value"] / one["limit"] for one in judged), default=None), 2)


CASE_COLUMNS = (
    Shown(Column("case"), itemgetter("name")),
    Shown(Column("ended as"), lambda row: Cell(row["outcome"], "good" if row["ok"] else "bad")),
    Shown(Column("steps", numeric=True), lambda row: whole(row["steps"])),
    Shown(Column("other method"), lambda row: row["second_method"] or "none"),
    Shown(Column("worst measure over its limit", numeric=True), worst_measure),
    Shown(Column("right-hand sides", numeric=True), lambda row: whole(row["rhs_evaluations"])),
    Shown(Column("time (ms)", numeric=True), lambda row: number(1e3 * row["wall_s"], 3)),
    Shown(Column("why that is to be expected", wide=True), itemgetter("reason")),
)


def case_table(cases: Rows) -> Table:
    """Every case, by family."""
    families = dict.fromkeys(str(row["family"]) for row in cases)
    bodies = tuple(
        body(lines(CASE_COLUMNS, [row for row in cases if row["family"] == family]), family) for family in families
    )
    note = (
        "Other method: that gives the same times, as far as tolerances promise. Worst measure: the largest of all "
        "measures of a case but its use of the budget, each divided by the most that is allowed."
        f"{without_answer(cases)}{not_measured(cases)}"
    )
    return Table("Extreme cases", heads(CASE_COLUMNS), bodies, wordy=True, note=note)


def without_answer(cases: Rows) -> str:
    """Which other methods gave no answer, or why none was asked: each reason once, with its cases."""
    reasons = [(str(row["second_tried"]), row) for row in cases if row["second_tried"]]
    said = by_reason(reasons)
    return f" Other methods that gave no answer, or why none was asked: {said}." if said else ""


def not_measured(cases: Rows) -> str:
    """Which measures could not be taken: each with its reason once, and its cases."""
    missed = [(f"{one['measure']}: {one['why']}", row) for row in cases for one in row["not_measured"]]
    said = by_reason(missed)
    return f" Not measured: {said}." if said else ""


def by_reason(reasons: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    """Each reason once, with the cases that it holds for."""
    names: dict[str, list[str]] = {}
    for reason, row in reasons:
        names.setdefault(reason, []).append(str(row["name"]))
    return "; ".join(f"{reason} ({', '.join(cases)})" for reason, cases in names.items())


KNOWN_COLUMNS = (
    Shown(Column("problem"), itemgetter("name")),
    Shown(Column("quantity"), itemgetter("quantity")),
    Shown(Column("by the contact code", numeric=True), lambda row: number(row["value"], 7)),
    Shown(Column("reference", numeric=True), lambda row: number(row["reference"], 7)),
    Shown(
        Column("relative error", numeric=True),
        lambda row: Cell(number(row["error"], 2), "good" if row["ok"] else "bad"),
    ),
    Shown(Column("the reference’s route", wide=True), itemgetter("source")),
)


def known_table(known: Rows) -> Table:
    """Every known problem."""
    caption = "Problems with known answers, run through the contact code"
    return table(caption, heads(KNOWN_COLUMNS), lines(KNOWN_COLUMNS, known), wordy=True)


def ordinary_table(summary: Mapping[str, Any]) -> Table:
    """What ordinary methods do with the cases: one row a case, one column a method."""
    rows: Rows = summary["ordinary"]
    methods = dict.fromkeys(str(row["method"]) for row in rows)
    names = dict.fromkeys(str(row["case"]) for row in rows)
    found = {(row["case"], row["method"]): row for row in rows}
    columns = [Column("case"), *(Column(shortened(method)) for method in methods)]
    body_rows: list[list[str | Cell]] = [
        [name, *(ordinary_cell(found.get((name, method))) for method in methods)] for name in names
    ]
    note = (
        "The contact scene as one differential equation without events, the rigid one as a script with an event "
        f"function (libraries only), at most {summary['ordinary_cap']} evaluations, to the end of two steps or where "
        "the walk ends before. RK45, LSODA and Radau are SciPy’s with nothing but the name given; Euler is "
        "semi-implicit, with a fixed step, as in game engines. In each cell the error of the state there (leg lengths, "
        "radians, pendulum times) and the run time. "
        f"Fine: below {number(summary['ordinary_fine'])}; wrong silently: above, and the method says nothing; "
        "diverges: further than ten legs off, or out of all numbers; gives up: fails or uses up its evaluations."
    )
    return table("What an ordinary choice of method does", columns, body_rows, note=note)


def shortened(method: str) -> str:
    """A method's name as a column's head."""
    return method.removeprefix("SciPy ").removeprefix("semi-implicit ")


def ordinary_cell(row: Mapping[str, Any] | None) -> Cell:
    """A method's verdict with error and run time."""
    if row is None:
        return Cell("")
    error = f" {number(row['error'], 2)}," if "error" in row else ""
    return Cell(f"{row['verdict']}:{error} {number(1e3 * row['wall_s'], 2)} ms", VERDICTS[row["verdict"]])
