"""What the rigid model assumes, and how far its own walk bears that out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.report.blocks import Section
from walkerlab.report.numbers import length, number, power_of_ten, quantity
from walkerlab.report.results import Results
from walkerlab.report.tables import Cell, Column, table

HOLDS, FAILS, NOTED = Cell("holds", "good"), Cell("does not hold", "bad"), Cell("ignored", "fair")
ROUNDING = 1e-6
"""Relative drift of an energy that counts as constant, and depth, in leg lengths, that is no scuffing."""


def section(results: Results) -> Section | None:
    """The paper's assumptions, checked along the rigid walk."""
    summary = results.summary("simulate")
    if summary is None:
        return None
    rows = [row for row in (pull(summary), grip(results, summary), scuff(results, summary), energy(summary)) if row]
    if not rows:
        return None
    columns = [Column("assumption"), Column("measured", wide=True), Column("value", numeric=True), Column("verdict")]
    where = " (sections 3.1 and 3.2)" if results.of_the_paper else ""
    caption = f"What the rigid model assumes{where}, and what its walk says"
    return Section("assumptions", "Assumptions, checked", (table(caption, columns, rows, wordy=True),), finding(rows))


def finding(rows: list[list[str | Cell]]) -> str:
    """How many assumptions hold, and which do not."""
    holding = sum(row[-1] is HOLDS for row in rows)
    others = "; ".join(f"{row[0]}: {said(row[-1])} ({row[-2]})" for row in rows if row[-1] is not HOLDS)
    return f"{holding} of {len(rows)} hold along the rigid walk. {others}{'.' if others else ''}".strip()


def said(cell: str | Cell) -> str:
    """A cell's text."""
    return cell.text if isinstance(cell, Cell) else cell


def pull(summary: Mapping[str, Any]) -> list[str | Cell] | None:
    """The ground never pulls."""
    least = summary.get("min_normal_force_N")
    if least is None:
        return None
    measured = "smallest normal force of the ground on the stance foot"
    return ["The ground reaction stays upward", measured, quantity(least, "N", 4), HOLDS if least > 0 else FAILS]


def grip(results: Results, summary: Mapping[str, Any]) -> list[str | Cell] | None:
    """Friction is enough."""
    ratio = summary.get("max_friction_ratio")
    if ratio is None:
        return None
    contact = results.config.contact
    measured = "largest ratio of tangential to normal force: the friction coefficient it takes not to slip"
    if contact is None or contact.friction == "none":
        return ["The stance foot does not slip", measured, number(ratio, 4), Cell("needs friction", "fair")]
    enough = ratio <= contact.static_friction
    return ["The stance foot does not slip", measured, number(ratio, 4), HOLDS if enough else FAILS]


def scuff(results: Results, summary: Mapping[str, Any]) -> list[str | Cell] | None:
    """Scuffing is not considered."""
    depth = summary.get("max_scuff_depth_m")
    if depth is None:
        return None
    measured = "deepest that the swing foot passes below the ground in mid-swing"
    seen = depth > ROUNDING * results.config.walker.leg_length_m
    return ["Scuffing is not considered", measured, length(depth if seen else 0.0, 3), NOTED if seen else HOLDS]


def energy(summary: Mapping[str, Any]) -> list[str | Cell] | None:
    """The equations keep the energy within a swing."""
    drift = summary.get("energy_drift_J")
    if drift is None:
        return None
    scale = abs(summary.get("mean_energy_J") or 1.0)
    measured = "largest change of the mechanical energy within a swing, from its start"
    verdict = HOLDS if drift <= ROUNDING * scale else FAILS
    return ["No energy is lost or won while a leg swings", measured, f"{small(drift)} J", verdict]


def small(value: float) -> str:
    """A number that may be of the order of rounding."""
    return number(value, 3) if value >= 1e-3 or value == 0 else power_of_ten(value, 2)
