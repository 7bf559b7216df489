"""The periodic gait: fixed point and multipliers under both sets of equations, and all gaits found."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.views.report.blocks import Paragraph, Section
from walkerlab.views.report.gaits import COMPASS_STATE, SETS, gait_table, state_at, symbol
from walkerlab.views.report.numbers import fixed
from walkerlab.views.report.outcomes import legs_differ
from walkerlab.views.report.results import Results, stage_section
from walkerlab.views.report.tables import Column, Table, measured, table
from walkerlab.views.report.words import words


@stage_section("fixedpoint")
def section(results: Results, summary: Mapping[str, Any]) -> Section | None:
    names = summary.get("state_names", COMPASS_STATE)
    set_names = SETS if results.claims else (summary["equations"],)
    sets = summary.get("equation_sets", {summary.get("equations"): summary})
    selected = {name: sets[name] for name in set_names if name in sets}
    gaits = {name: gait for name, gait in selected.items() if gait.get("state")}
    every = {name: gait["gaits"] for name, gait in selected.items() if gait.get("gaits")}
    blocks = (
        Paragraph(words("gait.disturbances", summary)),
        gait_table(gaits, names, note=words("gait.equations") if len(gaits) > 1 else "") if gaits else None,
        every_gait(every, names) if any(len(gait) > 1 for gait in every.values()) else None,
    )
    return Section.of("gait", "The gait", blocks, words("gait.finding", summary))


def every_gait(sets: Mapping[str, Sequence[Mapping[str, Any]]], names: Sequence[str]) -> Table:
    """Tabulate all gaits by set of equations. A remark marks the chosen one or says why a gait is unphysical."""
    four = partial(fixed, decimals=4)
    five = partial(fixed, decimals=5)
    columns = (
        Column("gait", "gait", numeric=True),
        measured("T", "period_s", five),
        measured("S", "step_length_m", five),
        *(Column(symbol(name), partial(state_at, place), four, numeric=True) for place, name in enumerate(names)),
        Column("spectral radius", "spectral_radius", four, numeric=True),
        Column("stable", "stable"),
        Column("remark", lambda gait: "chosen" if gait["chosen"] else gait["objection"]),
    )
    alone = list(sets) == ["corrected"]
    numbered = {name: [{**gait, "gait": place} for place, gait in enumerate(found, 1)] for name, found in sets.items()}
    gaits = {"" if alone else SETS[name]: found for name, found in numbered.items()}
    differ = any(legs_differ(gait) for found in sets.values() for gait in found)
    return table(f"All {'gaits of one stride' if differ else 'one-step gaits'} found", columns, gaits)
