"""The walks: the numbers of the contact one, the assumptions of the rigid one, and every step of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

from walkerlab.report.blocks import PageBlock, Paragraph, Section
from walkerlab.report.numbers import (
    NONE,
    count,
    decimals_left,
    fixed,
    length,
    listed,
    number,
    power_of_ten,
    quantity,
    span,
    whole,
)
from walkerlab.report.outcomes import CONTACT, MODELS, RIGID, tone
from walkerlab.report.results import Results
from walkerlab.report.sections.models import CHANNELS
from walkerlab.report.tables import Cell, Column, table
from walkerlab.report.words import words

Row = list[str | Cell]


def contact(results: Results) -> Section | None:
    """The contact model on its ground: how it stands, walks, slips and loses energy."""
    summary = results.summary(CONTACT)
    if summary is None:
        return None
    columns = [Column("quantity"), Column("value", numeric=True), Column("meaning", wide=True)]
    numbers = table("The contact model's walk", columns, contact_rows(summary), wordy=True)
    ground = results.config.contact
    said = "" if ground is None else words("walks.ground", ground, ground.in_si(), summary)
    slip = summary.get("slip_per_step_m")
    slips = "" if slip is None else f"the stance foot slips {length(slip)} a step, and "
    found = (
        f"{summary['steps']} of {2 * results.config.strides} steps; {slips}the energy balances to "
        f"{joules(summary['energy_balance_residual_J'])}."
    )
    return Section("contact", "The contact walk", (Paragraph(said), numbers), found)


def contact_rows(summary: Mapping[str, Any]) -> list[Row]:
    """The numbers of the contact walk, each with what it means; those that it has."""
    ratio, depth = summary.get("damping_ratio"), summary.get("static_penetration_m")
    slips, rolling = summary.get("slips_m"), summary.get("rolling_per_step_m")
    evaluations, accepted = summary.get("rhs_evaluations"), summary.get("accepted_steps")
    bounce = "under-damped: a foot bounces" if ratio is None or ratio < 1 else "over-damped: a foot does not bounce"
    in_mm = None if not slips else span([1e3 * slip for slip in slips], "mm", 3)
    steps = (
        "" if accepted is None else f"; {count(accepted, 'solver step')} accepted, {summary['rejected_steps']} rejected"
    )
    rows: list[tuple[str, str | Cell | None, str]] = [
        ("outcome", Cell(summary["outcome"], tone(summary["outcome"])), "how the walk ended"),
        ("largest penetration", length(summary.get("max_penetration_m")), "of either foot"),
        ("static penetration", None if depth is None else length(depth), "the whole weight on one foot"),
        ("damping ratio", None if ratio is None else number(ratio, 3), f"about that rest, of the whole mass; {bounce}"),
        ("slip a step", length(summary.get("slip_per_step_m")), "net, downhill positive, mean over the steps"),
        ("slip, step by step", in_mm, "of the stance foot's material, from its touch to its lift"),
        ("rolling a step", length(rolling) if rolling else None, "of the round foot: rolling, not slip"),
        (
            "energy balance residual",
            joules(summary["energy_balance_residual_J"]),
            "largest, of mechanical and dissipated energy",
        ),
        *(
            (f"energy lost {CHANNELS.get(key, key)}", joules(value), "over the whole walk")
            for key, value in (summary.get("dissipated_J") or {}).items()
        ),
        ("work", None if evaluations is None else whole(evaluations), f"right-hand sides{steps}"),
    ]
    return [[title, value, meaning] for title, value, meaning in rows if value is not None]


def joules(value: float) -> str:
    """An energy that may be of the order of rounding."""
    return f"{number(value, 4) if abs(value) >= 1e-3 or value == 0 else power_of_ten(value, 2)} J"


HOLDS, FAILS, NOTED = Cell("holds", "good"), Cell("does not hold", "bad"), Cell("ignored", "fair")
ROUNDING = 1e-6
"""Relative drift of an energy that counts as constant, and depth, in leg lengths, that is no scuffing."""


def assumptions(results: Results) -> Section | None:
    """What the rigid model assumes, and how far its own walk bears that out."""
    summary = results.summary(RIGID)
    rows = [] if summary is None else judged_assumptions(results, summary)
    if not rows:
        return None
    columns = [Column("assumption"), Column("measured", wide=True), Column("value", numeric=True), Column("verdict")]
    where = " (sections 3.1 and 3.2)" if results.of_the_paper else ""
    caption = f"What the rigid model assumes{where}, and what its walk says"
    holding = sum(verdict is HOLDS for *_, verdict in rows)
    others = "; ".join(f"{said}: {verdict.text} ({value})" for said, _, value, verdict in rows if verdict is not HOLDS)
    found = f"{holding} of {len(rows)} hold along the rigid walk. {others}{'.' if others else ''}".strip()
    return Section("assumptions", "Assumptions, checked", (table(caption, columns, rows, wordy=True),), found)


def judged_assumptions(results: Results, summary: Mapping[str, Any]) -> list[tuple[str, str, str, Cell]]:
    """Each assumption that the walk has a number for: what is assumed and measured, the value, and the verdict."""
    rows = []
    if (least := summary.get("min_normal_force_N")) is not None:
        measured = "smallest normal force of the ground on the stance foot"
        rows.append(
            ("The ground reaction stays upward", measured, quantity(least, "N", 4), HOLDS if least > 0 else FAILS)
        )
    if (ratio := summary.get("max_friction_ratio")) is not None:
        ground = results.config.contact
        measured = "largest ratio of tangential to normal force: the friction coefficient it takes not to slip"
        verdict = Cell("needs friction", "fair")
        if ground is not None and ground.has_friction:
            verdict = HOLDS if ratio <= ground.static_friction else FAILS
        rows.append(("The stance foot does not slip", measured, number(ratio, 4), verdict))
    if (depth := summary.get("max_scuff_depth_m")) is not None:
        measured = "deepest that the swing foot passes below the ground in mid-swing"
        seen = depth > ROUNDING * results.config.walker.leg_length_m
        value, verdict = length(depth if seen else 0.0, 3), NOTED if seen else HOLDS
        rows.append(("Scuffing is not considered", measured, value, verdict))
    if (drift := summary.get("energy_drift_J")) is not None:
        measured = "largest change of the mechanical energy within a swing, from its start"
        verdict = HOLDS if drift <= ROUNDING * abs(summary.get("mean_energy_J") or 1.0) else FAILS
        value = f"{number(drift, 3) if drift >= 1e-3 or drift == 0 else power_of_ten(drift, 2)} J"
        rows.append(("Energy is conserved while a leg swings", measured, value, verdict))
    return rows


FIRST, LAST = 20, 4
"""Of a longer walk so many steps are listed from its beginning and its end."""


SERIES = {
    (RIGID, "step_periods_s"): "rigid T (s)",
    (CONTACT, "step_periods_s"): "contact T (s)",
    (RIGID, "step_lengths_m"): "rigid S (m)",
    (CONTACT, "step_lengths_m"): "contact S (m)",
    (CONTACT, "slips_m"): "slip of the stance foot (mm)",
}
"""Numbers of each step: stage and key under which they are, and title of their column."""


def steps(results: Results) -> Section | None:
    """The steps that were taken; None if there are none."""
    series = {shown: found for shown in SERIES if (found := numbers_of(results, *shown))}
    if not series:
        return None
    columns = [Column("step", numeric=True), *(Column(SERIES[shown], numeric=True) for shown in series)]
    written = [
        [of_step(value, key, results.summary(stage) or {}) for value in found] for (stage, key), found in series.items()
    ]
    taken = list(zip_longest(*written, fillvalue=NONE))
    numbered = [(number, *step) for number, step in enumerate(taken, 1)]
    shown = numbered if len(taken) <= FIRST + LAST else [*numbered[:FIRST], *numbered[-LAST:]]
    left_away = "" if len(shown) == len(taken) else f"Steps {FIRST + 1} to {len(taken) - LAST} are in the artifacts. "
    note = left_away + "T: from one heel strike or touch to the next; S: along the slope, from foothold to foothold."
    steps_table = table("Periods and lengths of the steps", columns, shown, note=note)
    periods = {stage: numbers_of(results, stage, "step_periods_s") for stage in (RIGID, CONTACT)}
    told = [f"{span(found, 's')} in the {MODELS[stage].lower()}" for stage, found in periods.items() if found]
    error = errors(results)
    blocks: tuple[PageBlock, ...] = (steps_table, *((Paragraph(error),) if error else ()))
    return Section("steps", "Step by step", blocks, f"Steps take {listed(told)}.")


USUAL = "a hundred times tighter tolerances"
"""What the second walk has, unless `by` says otherwise."""
NUMBERS_OF_STEPS = {"step_periods_s": "step_period_s", "step_lengths_m": "step_length_m"}
"""Numbers of each step, and under which key of `numerical_error` their error is."""
OF_ERROR = {
    "step_period_s": ("in a period", "s"),
    "step_length_m": ("in a length", "m"),
    "end_time_s": ("at the end", "s"),
}
"""What `numerical_error` is of, in words, and its unit."""


def of_step(value: float | None, key: str, summary: Mapping[str, Any]) -> str:
    """A number of a step with the decimals that its numerical error leaves; a slip in mm."""
    if key not in NUMBERS_OF_STEPS:
        return fixed(None if value is None else 1e3 * value, 3)
    return fixed(value, decimals_left((summary.get("numerical_error") or {}).get(NUMBERS_OF_STEPS[key])))


def error_in_words(error: Mapping[str, Any]) -> str:
    """How far the numbers of a walk are off, and how that is known."""
    if "reason" in error:
        return f"unknown: {error['reason']}"
    off = listed(f"{quantity(error[key], unit, 1)} {what}" for key, (what, unit) in OF_ERROR.items() if key in error)
    return f"{off}, by a second walk with {error.get('by', USUAL)}"


def error_of_sample(error: Mapping[str, Any], what: str) -> str:
    """The largest numerical error of some of many walks, in a sentence; what: of which they are a sample."""
    known = {key: error[key] for key in (*OF_ERROR, "by") if key in error}
    again = f"{error['walked_again']} of {error['of']:,} {what} were walked again"
    otherwise = f", of which {error['ended_otherwise']} ended otherwise" if error["ended_otherwise"] else ""
    if known.keys() & OF_ERROR.keys():
        return f"Largest numerical error: {error_in_words(known)}; {again}{otherwise}."
    if error["ended_otherwise"] == error["walked_again"]:
        return f"Numerical errors are unknown; {again}{otherwise}."
    return f"{again} with {known.get('by', USUAL)}{otherwise or ', and ended alike'}."


def errors(results: Results) -> str:
    """A sentence on the numerical error of each walk that has one."""
    found = {stage: (results.summary(stage) or {}).get("numerical_error") for stage in (RIGID, CONTACT)}
    told = [f"{error_in_words(error)} ({MODELS[stage].lower()})" for stage, error in found.items() if error]
    return f"Numerical error: {'; '.join(told)}." if told else ""


def numbers_of(results: Results, stage: str, key: str) -> Sequence[float]:
    """A number of each step of a walk; none without the walk."""
    found: Sequence[float] = (results.summary(stage) or {}).get(key) or []
    return found
