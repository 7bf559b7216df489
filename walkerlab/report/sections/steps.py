"""Every step of both models, side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from walkerlab.report.blocks import Column, Section, table
from walkerlab.report.numbers import NONE, fixed, listed, span
from walkerlab.report.outcomes import CONTACT, MODELS, RIGID
from walkerlab.report.results import Results

FIRST, LAST = 20, 4
"""Of a longer walk so many steps are listed from its beginning and its end."""


@dataclass(frozen=True)
class Series:
    """A number of each step: its head, where it is, and how it is printed."""

    head: str
    stage: str
    key: str
    printed: Callable[[float], str]


SERIES = (
    Series("rigid T (s)", RIGID, "step_periods_s", lambda value: fixed(value, 5)),
    Series("contact T (s)", CONTACT, "step_periods_s", lambda value: fixed(value, 5)),
    Series("rigid S (m)", RIGID, "step_lengths_m", lambda value: fixed(value, 5)),
    Series("contact S (m)", CONTACT, "step_lengths_m", lambda value: fixed(value, 5)),
    Series("slip of the stance foot (mm)", CONTACT, "slips_m", lambda value: fixed(1e3 * value, 3)),
)


def section(results: Results) -> Section | None:
    """The steps that were taken; None if there are none."""
    series = [one for one in SERIES if (results.summary(one.stage) or {}).get(one.key)]
    if not series:
        return None
    columns = [Column("step", numeric=True), *(Column(one.head, numeric=True) for one in series)]
    values = [values_of(results.summary(one.stage) or {}, one.key) for one in series]
    steps = max(len(one) for one in values)
    shown = list(range(steps)) if steps <= FIRST + LAST else [*range(FIRST), *range(steps - LAST, steps)]
    pairs = list(zip(values, series, strict=True))
    rows = [[str(step + 1), *(at(found, step, one.printed) for found, one in pairs)] for step in shown]
    left_away = "" if len(shown) == steps else f"Steps {FIRST + 1} to {steps - LAST} are in the artifacts. "
    note = left_away + "T: from one heel strike or touch to the next; S: along the slope, from foothold to foothold."
    steps_table = table("Periods and lengths of the steps", columns, rows, note=note)
    return Section("steps", "Step by step", (steps_table,), finding(results))


def finding(results: Results) -> str:
    """How long the steps of each model take."""
    periods = {stage: (results.summary(stage) or {}).get("step_periods_s") for stage in (RIGID, CONTACT)}
    told = [f"{span(found, 's')} in the {MODELS[stage].lower()}" for stage, found in periods.items() if found]
    return f"Steps take {listed(told)}."


def values_of(summary: Mapping[str, Any], key: str) -> Sequence[float]:
    """A number of each step."""
    found: Sequence[float] = summary[key]
    return found


def at(values: Sequence[float], step: int, printed: Callable[[float], str]) -> str:
    """The number of a step, a dash beyond the last."""
    return printed(values[step]) if step < len(values) else NONE
