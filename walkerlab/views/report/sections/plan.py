"""Measurements that would determine parameters."""

from collections.abc import Mapping
from typing import Any

from walkerlab.labels import axis_label
from walkerlab.views.report.blocks import Paragraph, Section
from walkerlab.views.report.numbers import format_integer, number
from walkerlab.views.report.results import Results, stage_section
from walkerlab.views.report.sections.identification import UNITS_IN_WORDS
from walkerlab.views.report.tables import Column, Table, table
from walkerlab.views.report.words import words


@stage_section("plan", "measurements")
def section(_results: Results, summary: Mapping[str, Any]) -> Section | None:
    first, *rest = findings(summary)
    return Section.of("plan", "Measurements to make", (Paragraph(" ".join(rest)), *tables(summary)), first)


def findings(summary: Mapping[str, Any]) -> list[str]:
    """Return the answer in sentences: the simplest measurement, the steps for each target error, the assumptions."""
    return words.parts("plan.findings", summary, [goal for goal in goals(summary) if goal])


def goals(summary: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each target error, with the fewest steps that reach it."""
    rows = summary["measurements"]
    return [
        goal(rows, place, summary["max_steps"]) for place, entry in enumerate(rows[0]["errors"]) if "wanted" in entry
    ]


def goal(rows: list[Mapping[str, Any]], place: int, most: int) -> str:
    entry = rows[0]["errors"][place]
    unit = UNITS_IN_WORDS.get(entry["unit"], f" {entry['unit']}")
    wanted = f"{axis_label(entry['key'])} to ± {number(entry['wanted'])}{unit}"
    reached = [row for row in rows if row["errors"][place]["steps_needed"]]
    if not reached:
        return f"The {wanted}: {format_integer(most)} steps do not suffice."
    best = min(reached, key=lambda row: row["errors"][place]["steps_needed"])
    needed = best["errors"][place]["steps_needed"]
    steps = "1 step" if needed == 1 else f"{format_integer(needed)} steps"
    return f"The {wanted}: {steps} of {best['measurement']}, {best['start']}."


def tables(summary: Mapping[str, Any]) -> list[Table]:
    entries = summary["measurements"][0]["errors"]
    columns = [Column("measurement", "measurement"), Column("start", "start")]
    for place, entry in enumerate(entries):
        columns.append(Column(f"± {axis_label(entry['key'])} ({entry['unit']})", error_of(place), numeric=True))
        if "wanted" in entry:
            columns.append(Column(f"steps for ± {number(entry['wanted'])}", steps_of(place), numeric=True))
    return [table(f"Standard errors after {summary['steps']} steps", columns, summary["measurements"])]


def error_of(place: int) -> Any:
    def text(row: Mapping[str, Any]) -> str:
        error = row["errors"][place]["standard_error"]
        return "open" if error is None else number(error, 2)

    return text


def steps_of(place: int) -> Any:
    def text(row: Mapping[str, Any]) -> str:
        needed = row["errors"][place]["steps_needed"]
        return "" if needed is None else format_integer(needed)

    return text
