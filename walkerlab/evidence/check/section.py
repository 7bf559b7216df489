"""Answer and report section of a check."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from walkerlab.evidence.check.printed import DIFFERENT, EXPLAINED, NOT_COMPARABLE, REPRODUCED, UNEXPLAINED
from walkerlab.labels import join_words
from walkerlab.views.report.blocks import PageBlock, Paragraph, Section, stage_section
from walkerlab.views.report.numbers import count, number
from walkerlab.views.report.tables import Cell, Column, Table, Tone, table

Row = Mapping[str, Any]
TONES: Mapping[str, Tone] = {REPRODUCED: "good", DIFFERENT: "bad", NOT_COMPARABLE: "plain"}
MANY_UNITS = 1e5
COLUMNS = (
    Column("value", lambda row: spell_name(row["name"])),
    Column("printed", "printed", numeric=True),
    Column("right", "right_text", numeric=True),
    Column("digits that agree", lambda row: f"{row['digits']} of {row['of_digits']}" if row["right_text"] else ""),
    Column("verdict", lambda row: Cell(row["verdict"], TONES[row["verdict"]])),
)


def spell_name(name: str) -> str:
    """Spell the name of a printed number, such as 'stance rate' or 'period_s'."""
    quantity, _, part = name.partition(".")
    if quantity == "state":
        return part.replace("_", " ")
    if quantity == "state_before":
        return f"{part.replace('_', ' ')} before"
    return f"{quantity} {part}" if part else quantity


def answer(summary: Row) -> list[str | Table]:
    """Return the verdict, the table of values, and remarks on the printed numbers."""
    return [headline(summary), table("", COLUMNS, summary["values"]), *remarks(summary)]


@stage_section("check")
def section(_results: Any, summary: Row) -> Section | None:
    """Build the section of the page."""
    evidence = Column("evidence", "evidence", wide=True)
    caption = "Printed and right values"
    rows = table(caption, (*COLUMNS, evidence), summary["values"], note=source_of(summary["source"]))
    blocks: tuple[PageBlock, ...] = (rows, *(Paragraph(text) for text in remarks(summary)))
    return Section.create("check", "The printed gait", blocks, headline(summary))


def source_of(source: Row) -> str:
    parts = [str(source[key]) for key in ("authors", "title", "year", "where") if source.get(key)]
    return f"Source: {', '.join(parts)}." if parts else ""


def headline(summary: Row) -> str:
    """Return a sentence that states whether the printed gait is right and, if known, why not."""
    rows: Sequence[Row] = summary["values"]
    wrong = [row for row in rows if row["verdict"] == DIFFERENT]
    explanations = summary["explanations"]
    finding = summary["finding"]
    if finding == NOT_COMPARABLE:
        return f"Nothing can be compared: {summary.get('reason') or 'the file prints no values'}."
    if finding == REPRODUCED:
        compared = [row for row in rows if row["verdict"] == REPRODUCED]
        short = [row for row in compared if row["digits"] < row["of_digits"]]
        if not short:
            return f"Right: {count(len(compared), 'printed value')} reproduced to the last digit."
        some = f"{len(short)} of {count(len(compared), 'printed value')}"
        return f"Reproduced, but not to the last digit: {some} agree in fewer digits than are printed."
    if finding == EXPLAINED and len(explanations) == 1:
        return f"Explained: {follow(explanations[0], rows)} if {explanations[0]['what']}."
    if finding == EXPLAINED:
        return f"Explained, but by more than one cause: each of {len(explanations)} fits the printed digits."
    assert finding == UNEXPLAINED
    if len(rows) == 1:
        return "Different, unexplained: the printed value differs, and one value does not tell why."
    what = f"{len(wrong)} of {len(rows)} printed values differ"
    if len(explanations) == 1:
        return f"Different, partly explained: {follow(explanations[0], rows)} if {explanations[0]['what']}."
    if explanations:
        return f"Different, partly explained: {what}, and no cause found reproduces more than some of them."
    return f"Different, unexplained: {what}, and no known convention, mistake or misprint reproduces them all."


def follow(explanation: Row, rows: Sequence[Row]) -> str:
    """Describe the printed values that an explanation reproduces."""
    names = explanation["reproduces"]
    if len(names) == len(rows):
        return f"all {count(len(names), 'printed value')} follow to the last digit"
    others = join_words([spell_name(row["name"]) for row in rows if row["name"] not in names])
    return f"{len(names)} of {count(len(rows), 'printed value')} follow to the last digit (not {others})"


def remarks(summary: Row) -> Iterator[str]:
    """Yield sentences about explanations, periodicity, momenta, the nearest gait and the two routes."""
    rows = summary["values"]
    explanations = summary["explanations"]
    if len(explanations) > 1:
        for place, each in enumerate(explanations, 1):
            yield f"{place}. {each['kind'].capitalize()}: {follow(each, rows)} if {each['what']}."
    if summary["undecided"]:
        yield summary["undecided"]
    if near := summary["closest"]:
        yield (
            f"Closest comes a {near['kind']}: if {near['what']}, the largest difference falls from "
            f"{number(near['without_in_units'], 2)} to {number(near['miss_in_units'], 2)} units of a last digit."
        )
    yield from state_remarks(summary)
    if gait := summary["nearest_gait"]:
        stable = "stable" if gait["stable"] else "unstable"
        names = dict(zip(gait["state_names"], gait["state"], strict=True))
        state = ", ".join(f"{name} {number(value, 9)}" for name, value in names.items())
        yield (
            f"The right gait nearest to it is {stable}: steps of {number(gait['step_length_m'], 9)} m in "
            f"{number(gait['period_s'], 9)} s, with {state} just after the heel strike (absolute, from the vertical)."
        )
    if routes := summary["routes"]:
        agree = "agree on it to" if routes["agree"] else "DISAGREE on it by"
        yield f"Two independent models {agree} {number(max(routes['difference'], 1e-15), 1)}."


def state_remarks(summary: Row) -> Iterator[str]:
    """Yield sentences on whether a printed state is periodic and its heel strike conserves angular momentum."""
    periodic = summary["periodic"]
    if periodic and periodic["is_periodic"]:
        yield "The printed state is periodic within its digits."
    elif periodic and periodic["residual"] is None:
        yield "From the printed state, the walker does not complete a step."
    elif periodic:
        nearer = periodic["distance_after_a_step"] < periodic["distance_from_gait"]
        moves = "nearer to" if nearer else "away from"
        units = periodic["in_units_of_last_digit"]
        last = f", {number(units, 2)} units of its last digit" if units < MANY_UNITS else ""
        yield (
            f"The printed state is not periodic: one right step changes it by {number(periodic['residual'], 2)} "
            f"({periodic['unit']}){last}, {moves} the right gait."
        )
        changes = [f"{each['key']} = {number(each['value'], 6)}" for each in periodic.get("periodic_with", ())]
        if changes:
            yield f"It would be periodic with {' or '.join(changes)}."
    broken = [each for each in summary["momenta"] if not each["conserved"]]
    if broken:
        listed = join_words([f"{each['about']} ({number(each['residual'], 3)} {each['unit']})" for each in broken])
        kept = [each["about"] for each in summary["momenta"] if each["conserved"]]
        fine = f"; that of {join_words(kept)} is conserved" if kept else ""
        before = broken[0]["before"]
        yield f"Over the heel strike before it ({before}), angular momentum changes: {listed}{fine}."
