"""The paper's three tables beside what was measured."""

from collections.abc import Mapping
from typing import Any, Final

from walkerlab.paper import printed
from walkerlab.paper.arithmetic import MM
from walkerlab.paper.measured import Measured
from walkerlab.paper.study import PaperStudy

Table = dict[str, dict[str, Any]]
"""Rows by name, each with its columns; None where a model has no such value."""

MIDDLE: Final = "section 2: 'in the middle of the legs'"


def table_1(measured: Measured, study: PaperStudy) -> Table:
    """The parameters: as printed (`paper`), where, and as used."""
    walker, inertia, radius = measured.walker, printed.LEG_INERTIA, printed.FOOT_RADIUS
    length, mass, hip, gravity = printed.TABLE_1
    rows = (
        ("L", "length of the legs", "m", length.value, walker.leg_length, length.where),
        ("m", "mass of a leg", "kg", mass.value, walker.leg_mass, mass.where),
        ("MH", "mass of the hip", "kg", hip.value, walker.hip_mass, hip.where),
        ("g", "gravity", "m/s^2", gravity.value, walker.gravity, gravity.where),
        ("a", "foot to mass of the leg", "m", 0.5 * length.value, walker.foot_to_mass, MIDDLE),
        ("J", "inertia of a leg", "kg m^2", inertia.value, walker.leg_inertia, inertia.where),
        ("r", "radius of the foot", "m", radius.value / MM, measured.contact.foot_radius, radius.where),
        ("phi", "slope", "rad", study.slope, walker.slope, "not stated: from the angles of x_p"),
    )
    return {
        symbol: {"quantity": quantity, "unit": unit, "paper": paper, "used": used, "where": where}
        for symbol, quantity, unit, paper, used, where in rows
    }


def table_2(measured: Measured) -> Table:
    """The initial values, and the percentages on both bases."""
    table, start = {}, measured.contact.start
    for place, (coordinate, row) in enumerate(zip(printed.COORDINATES, printed.TABLE_2, strict=True)):
        states = {name: model.state[place] for name, model in measured.models.items()}
        table[coordinate] = {
            **beside(row, states, None if start is None else start[place]),
            "paper_percent": row.percent.value,
            "percent_of_matlab": row.percent_of_matlab,
            "percent_of_adams": row.percent_of_adams,
        }
    return table


def table_3(measured: Measured) -> Table:
    """The characteristics of both models."""
    table = {}
    for row in printed.TABLE_3:
        rigid = {name: getattr(model.table_3, row.name) for name, model in measured.models.items()}
        table[row.name] = beside(row, rigid, getattr(measured.contact.table_3, row.name))
    return table


def beside(row: printed.PrintedRow, rigid: Mapping[str, float | None], contact: float | None) -> dict[str, Any]:
    """Both printed numbers of a row beside those of the rigid model, by set of equations, and of the contact model."""
    return {
        "unit": row.matlab.unit,
        "paper_matlab": row.matlab.value,
        "paper_adams": row.adams.value,
        "as_printed": rigid.get("as-printed"),
        "corrected": rigid.get("corrected"),
        "contact": contact,
    }
