"""The contact model on its ground: how it stands, walks, slips and loses energy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.report.blocks import Paragraph, Section
from walkerlab.report.numbers import count, length, number, power_of_ten, span, whole
from walkerlab.report.outcomes import CONTACT, tone
from walkerlab.report.results import Results
from walkerlab.report.sections.models import CHANNELS
from walkerlab.report.tables import Cell, Column, table
from walkerlab.report.words import words

Row = list[str | Cell]


def section(results: Results) -> Section | None:
    """The numbers of the contact walk."""
    summary = results.summary(CONTACT)
    if summary is None:
        return None
    rows: list[Row] = [
        ["outcome", Cell(summary["outcome"], tone(summary["outcome"])), "how the walk ended"],
        *standing(summary),
        *slipping(summary),
        *energies(summary),
        *cost(summary),
    ]
    columns = [Column("quantity"), Column("value", numeric=True), Column("meaning", wide=True)]
    numbers = table("The contact model's walk", columns, rows, wordy=True)
    blocks = (Paragraph(ground_in_words(results, summary)), numbers)
    return Section("contact", "The contact walk", blocks, finding(results, summary))


def finding(results: Results, summary: Mapping[str, Any]) -> str:
    """How far it walked and slipped, and how well its energy balances."""
    asked = 2 * results.config.strides
    residual, slip = residual_in_words(summary["energy_balance_residual_J"]), summary.get("slip_per_step_m")
    slips = "" if slip is None else f"the stance foot slips {length(slip)} a step, and "
    return f"{summary['steps']} of {asked} steps; {slips}the energy balances to {residual} J."


def ground_in_words(results: Results, summary: Mapping[str, Any]) -> str:
    """What the walker walks on."""
    contact = results.config.contact
    if contact is None:
        return ""
    return words("contact_walk.ground", contact, contact.in_si(), summary)


def standing(summary: Mapping[str, Any]) -> list[Row]:
    """Penetration and damping."""
    ratio = summary.get("damping_ratio")
    rows: list[Row] = [["largest penetration", length(summary.get("max_penetration_m")), "of either foot"]]
    if summary.get("static_penetration_m") is not None:
        rows.append(["static penetration", length(summary["static_penetration_m"]), "the whole weight on one foot"])
    if ratio is not None:
        meaning = "over-damped: a foot does not bounce" if ratio >= 1 else "under-damped: a foot bounces"
        rows.append(["damping ratio", number(ratio, 3), f"about that rest, of the whole mass; {meaning}"])
    return rows


def slipping(summary: Mapping[str, Any]) -> list[Row]:
    """Slip of the stance foot."""
    mean = length(summary.get("slip_per_step_m"))
    rows: list[Row] = [["slip a step", mean, "net, downhill positive, mean over the steps"]]
    if summary.get("slips_m"):
        slips = [1e3 * slip for slip in summary["slips_m"]]
        rows.append(
            ["slip, step by step", span(slips, "mm", 3), "of the stance foot's material, from its touch to its lift"]
        )
    if summary.get("rolling_per_step_m"):
        rows.append(["rolling a step", length(summary["rolling_per_step_m"]), "of the round foot: rolling, not slip"])
    return rows


def energies(summary: Mapping[str, Any]) -> list[Row]:
    """Where the energy went, and whether it balances."""
    residual = summary["energy_balance_residual_J"]
    rows: list[Row] = [
        ["energy balance residual", f"{residual_in_words(residual)} J", "largest, of mechanical and dissipated energy"]
    ]
    for key, value in (summary.get("dissipated_J") or {}).items():
        rows.append([f"energy lost {CHANNELS.get(key, key)}", f"{residual_in_words(value)} J", "over the whole walk"])
    return rows


def residual_in_words(value: float) -> str:
    """A number that may be of the order of rounding."""
    return number(value, 4) if abs(value) >= 1e-3 or value == 0 else power_of_ten(value, 2)


def cost(summary: Mapping[str, Any]) -> list[Row]:
    """What the solver did for it."""
    evaluations = summary.get("rhs_evaluations")
    if evaluations is None:
        return []
    accepted, rejected = summary.get("accepted_steps"), summary.get("rejected_steps")
    steps = "" if accepted is None else f"; {count(accepted, 'solver step')} accepted, {rejected} rejected"
    return [["work", whole(evaluations), f"right-hand sides{steps}"]]
