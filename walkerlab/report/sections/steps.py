"""Every step of both models, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import zip_longest

from walkerlab.report.blocks import Section
from walkerlab.report.numbers import fixed, listed, span
from walkerlab.report.outcomes import CONTACT, MODELS, RIGID
from walkerlab.report.results import Results
from walkerlab.report.tables import Column, table

FIRST, LAST = 20, 4
"""Of a longer walk so many steps are listed from its beginning and its end."""


def in_mm(length_m: float | None) -> str:
    """A length in mm; a dash beyond the last step."""
    return fixed(None if length_m is None else 1e3 * length_m, 3)


SERIES = {
    (RIGID, "step_periods_s"): Column("rigid T (s)", written=partial(fixed, decimals=5), numeric=True),
    (CONTACT, "step_periods_s"): Column("contact T (s)", written=partial(fixed, decimals=5), numeric=True),
    (RIGID, "step_lengths_m"): Column("rigid S (m)", written=partial(fixed, decimals=5), numeric=True),
    (CONTACT, "step_lengths_m"): Column("contact S (m)", written=partial(fixed, decimals=5), numeric=True),
    (CONTACT, "slips_m"): Column("slip of the stance foot (mm)", written=in_mm, numeric=True),
}
"""Numbers of each step: stage and key under which they are, and the column that shows them."""


def section(results: Results) -> Section | None:
    """The steps that were taken; None if there are none."""
    series = {column: found for (stage, key), column in SERIES.items() if (found := numbers_of(results, stage, key))}
    if not series:
        return None
    columns = [Column("step", numeric=True), *series]
    steps = list(zip_longest(*series.values()))
    numbered = [(number, *step) for number, step in enumerate(steps, 1)]
    shown = numbered if len(steps) <= FIRST + LAST else [*numbered[:FIRST], *numbered[-LAST:]]
    left_away = "" if len(shown) == len(steps) else f"Steps {FIRST + 1} to {len(steps) - LAST} are in the artifacts. "
    note = left_away + "T: from one heel strike or touch to the next; S: along the slope, from foothold to foothold."
    steps_table = table("Periods and lengths of the steps", columns, shown, note=note)
    return Section("steps", "Step by step", (steps_table,), finding(results))


def finding(results: Results) -> str:
    """How long the steps of each model take."""
    periods = {stage: (results.summary(stage) or {}).get("step_periods_s") for stage in (RIGID, CONTACT)}
    told = [f"{span(found, 's')} in the {MODELS[stage].lower()}" for stage, found in periods.items() if found]
    return f"Steps take {listed(told)}."


def numbers_of(results: Results, stage: str, key: str) -> Sequence[float]:
    """A number of each step of a walk; none without the walk."""
    found: Sequence[float] = (results.summary(stage) or {}).get(key) or []
    return found
