"""Answer and report section of a check."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from walkerlab.evidence.check.printed import Verdict, format_units, spell_name
from walkerlab.labels import add_unit, join_words, unit_by_name
from walkerlab.views.report.blocks import PageBlock, Paragraph, Section, stage_section
from walkerlab.views.report.numbers import count, number
from walkerlab.views.report.tables import Cell, Column, Table, Tone, table

Row = Mapping[str, Any]
TONES: Mapping[str, Tone] = {
    Verdict.INPUT: "given", Verdict.REPRODUCED: "good", Verdict.EXPLAINED: "fair", Verdict.CONTRADICTED: "bad",
    Verdict.DIFFERENT: "bad", Verdict.NOT_REPRODUCED: "plain", Verdict.NOT_COMPARABLE: "plain",
}  # fmt: skip
"""Appearance of each verdict on a printed value, in the order in which verdicts are listed."""
MANY_UNITS = 1e5  # differences above this, in units of the last digit, are not shown
LONGEST_LIST = 2  # a state with more values than this is one item of a list that has them all
COLUMNS = (
    Column("value", lambda row: add_unit(spell_name(row["name"]), unit_by_name(row["name"]))),
    Column("printed", "printed", numeric=True),
    Column("right", "right_text", numeric=True),
    Column("digits that agree", lambda row: agreeing_digits(row) if row["right_text"] else ""),
    Column("verdict", lambda row: Cell(verdict_of(row), TONES[row["verdict"]])),
)


def is_partly_reproduced(row: Row) -> bool:
    """Whether a value counts as reproduced although its last digits differ."""
    return bool(row["verdict"] == Verdict.REPRODUCED and row["digits"] < row["of_digits"])


def agreeing_digits(row: Row) -> str:
    if row["printed"].startswith(("<", ">")):
        return ""
    off = f", off by {format_units(row['difference_in_units'])} units" if is_partly_reproduced(row) else ""
    return f"{row['digits']} of {row['of_digits']}{off}"


def verdict_of(row: Row) -> str:
    return f"{Verdict.REPRODUCED} to {row['digits']} digits" if is_partly_reproduced(row) else row["verdict"]


def answer(summary: Row) -> list[str | Table]:
    """Return the verdict, the table of values, and remarks on the printed numbers."""
    return [headline(summary), table("", COLUMNS, summary["values"]), *remarks(summary)]


@stage_section("check")
def section(_results: Any, summary: Row) -> Section | None:
    """Build the section of the page."""
    evidence = Column("evidence", "evidence", wide=True)
    rows = table("Printed and right values", (*COLUMNS, evidence), summary["values"], note=source_of(summary["source"]))
    blocks: tuple[PageBlock, ...] = (rows, *(Paragraph(text) for text in remarks(summary)))
    return Section.create("check", "The printed gait", blocks, headline(summary))


def source_of(source: Row) -> str:
    year = f" ({source['year']})" if source.get("year") else ""
    parts = [source.get("authors"), f"{source.get('title') or ''}{year}".strip(), source.get("where")]
    return f"Source: {', '.join(filter(None, parts))}." if any(parts) else ""


def headline(summary: Row) -> str:
    """Return a sentence that states whether the printed gait is right and, if known, why not."""
    rows: Sequence[Row] = summary["values"]
    explanations = summary["explanations"]
    finding = summary["finding"]
    cause = follow(explanations[0], rows) if len(explanations) == 1 else ""
    verdicts = [row["verdict"] for row in rows]
    if finding == Verdict.NOT_COMPARABLE:
        return f"Nothing can be compared: {summary.get('reason') or 'the file prints no values'}."
    if finding == Verdict.REPRODUCED:
        compared = count(verdicts.count(Verdict.REPRODUCED), "printed value")
        short = sum(map(is_partly_reproduced, rows))
        if not short:
            return f"Right: {compared} reproduced to the last digit."
        verb = "agrees" if short == 1 else "agree"
        return f"Reproduced, but not to the last digit: {short} of {compared} {verb} in fewer digits than are printed."
    if finding == Verdict.EXPLAINED:
        many = f"Explained, but by more than one cause: each of {len(explanations)} fits the printed digits."
        return f"Explained: {cause}." if cause else many
    if len(rows) == 1:
        return "Different, unexplained: the printed value differs, and one value is too little to find the cause."
    if cause:
        return f"Different, partly explained: {cause}."
    what = f"{verdicts.count(Verdict.DIFFERENT)} of {len(rows)} printed values differ"
    if explanations:
        return f"Different, partly explained: {what}, and no cause found reproduces more than some of them."
    return f"Different, unexplained: {what}, and no known convention, mistake or misprint reproduces them all."


def follow(explanation: Row, rows: Sequence[Row]) -> str:
    """Write a sentence on the printed values that follow from an explanation, and those that do not."""
    names = explanation["reproduces"]
    cause = f"to the last digit if {explanation['what']}"
    if len(names) == len(rows):
        return f"all {count(len(names), 'printed value')} follow {cause}"
    others = [row["name"] for row in rows if row["name"] not in names]
    verbs = ("follows" if len(names) == 1 else "follow", "does" if len(others) == 1 else "do")
    return f"{enumerate_names(names, rows)} {verbs[0]} {cause}; {enumerate_names(others, rows)} {verbs[1]} not"


def enumerate_names(names: Sequence[str], rows: Sequence[Row]) -> str:
    """List the names of printed values in words. A long state is one item of the list if all its values are in it.

    rows  rows of all printed values
    """
    state = [row["name"] for row in rows if row["name"].startswith("state.")]
    whole = len(state) > LONGEST_LIST and set(state).issubset(names)
    words = [spell_name(name) for name in names if not (whole and name in state)]
    articles = [word if word[-1].isdigit() else f"the {word}" for word in words]
    return join_words([*([f"the {len(state)} angles and rates"] if whole else []), *articles])


def remarks(summary: Row) -> Iterator[str]:
    """Yield sentences about explanations, periodicity, momenta, the nearest gait and the agreement of both models."""
    rows = summary["values"]
    explanations = summary["explanations"]
    if len(explanations) > 1:
        for place, each in enumerate(explanations, 1):
            yield f"{place}. {each['kind'].capitalize()}: {follow(each, rows)}."
    if summary["undecided"]:
        yield summary["undecided"]
    if near := summary["closest"]:
        yield (
            f"A {near['kind']} comes nearest: if {near['what']}, the largest difference falls from "
            f"{number(near['without_in_units'], 2)} to {number(near['miss_in_units'], 2)} units of the last digit."
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
        moves = "nearer to" if periodic["distance_after_a_step"] < periodic["distance_from_gait"] else "farther from"
        units = periodic["in_units_of_last_digit"]
        last = f", {number(units, 2)} units of its last digit" if units < MANY_UNITS else ""
        yield (
            "The printed state is not periodic. After one exact step it has changed by "
            f"{number(periodic['residual'], 2)} ({periodic['unit']}){last}, and is {moves} the right gait."
        )
        changes = [f"{each['key']} = {number(each['value'], 6)}" for each in periodic.get("periodic_with", ())]
        if changes:
            yield f"It would be periodic with {' or '.join(changes)}."
    if broken := [each for each in summary["momenta"] if not each["conserved"]]:
        changes = [f"that of {each['about']} by {number(each['residual'], 3)} {each['unit']}" for each in broken]
        kept = [each["about"] for each in summary["momenta"] if each["conserved"]]
        fine = f" That of {join_words(kept)} is conserved." if kept else ""
        yield (
            f"The heel strike before this state ({broken[0]['before']}) changes the angular momentum of "
            f"{join_words(changes).removeprefix('that of ')}.{fine}"
        )
