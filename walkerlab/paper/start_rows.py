"""Verdicts on what the paper puts in, and on the gait it starts from: sections 2 to 4, eq. 11, Tables 1 and 2."""

from __future__ import annotations

from collections.abc import Iterator

from walkerlab.paper.arithmetic import MM, percent_of
from walkerlab.paper.judged import JudgedNumber, Verdict, agreement, judged, regardless, weigh
from walkerlab.paper.measured import CYCLES, Measured
from walkerlab.paper.printed import (
    COORDINATES,
    DAMPING,
    DYNAMIC_FRICTION,
    EIGENVALUES,
    FOOT_RADIUS,
    LEG_INERTIA,
    LOST_BALANCE,
    RAISED,
    STATIC_FRICTION,
    STIFFNESS,
    TABLE_1,
    TABLE_2,
    X_P,
    Printed,
    StartRow,
)
from walkerlab.paper.prose import prose
from walkerlab.paper.study import PaperStudy

WALKER_PARAMETERS = ("leg_length", "leg_mass", "hip_mass", "gravity")


def start_rows(measured: Measured, study: PaperStudy) -> Iterator[JudgedNumber]:
    """All rows, in the paper's order."""
    for entry, parameter in zip(TABLE_1, WALKER_PARAMETERS, strict=True):
        yield input_of_both(entry, float(getattr(measured.walker, parameter)), measured.departures.rigid)
    for coordinate in range(len(COORDINATES)):
        yield fixed_point_row(X_P[coordinate], coordinate, measured)
    yield eigenvalue_row(measured)
    yield input_of_both(LEG_INERTIA, measured.walker.leg_inertia, measured.departures.rigid)
    yield input_of_contact(FOOT_RADIUS, measured.contact.foot_radius * MM, measured)
    yield unitless_row(STIFFNESS, measured.contact.law.stiffness, measured)
    yield unitless_row(DAMPING, measured.contact.law.damping, measured)
    yield input_of_contact(STATIC_FRICTION, measured.contact.law.static_friction, measured)
    yield input_of_contact(DYNAMIC_FRICTION, measured.contact.law.dynamic_friction, measured)
    yield lost_balance_row(measured)
    for entry, table_row in zip(RAISED, TABLE_2[2:], strict=True):
        yield raised_row(entry, table_row, measured)
    for coordinate, table_row in enumerate(TABLE_2):
        yield fixed_point_row(table_row.matlab, coordinate, measured)
        yield adams_start_row(table_row.adams, coordinate, measured, study)
        yield percent_row(table_row, coordinate, measured)


def input_of_both(entry: Printed, value: float, departures: tuple[str, ...]) -> JudgedNumber:
    """A parameter of both models."""
    text = prose("evidence.input", value, entry.unit)
    verdict, evidence = weigh(value == entry.value, Verdict.EXPLAINED, departures, text)
    return JudgedNumber(entry, value, value, value, verdict, evidence)


def input_of_contact(entry: Printed, value: float, measured: Measured) -> JudgedNumber:
    """A parameter of the contact model alone."""
    agrees = abs(value - entry.value) <= 1e-12 * abs(entry.value)
    text = prose("evidence.input", value, entry.unit)
    return judged(entry, {}, value, weigh(agrees, Verdict.EXPLAINED, measured.departures.contact, text))


def fixed_point_row(entry: Printed, coordinate: int, measured: Measured) -> JudgedNumber:
    """A coordinate of x_p."""
    values = {name: model.state[coordinate] for name, model in measured.models.items()}
    found = {name: agreement(entry, value) for name, value in values.items()}
    text = prose("evidence.fixed_point", values, found)
    return judged(entry, values, None, weigh(any(found.values()), Verdict.REFUTED, measured.departures.rigid, text))


def eigenvalue_row(measured: Measured) -> JudgedNumber:
    """Whether the gait is stable."""
    radii = measured.spectral_radii
    stable = bool(radii) and all(radius < EIGENVALUES.value for radius in radii.values())
    text = prose("evidence.eigenvalue", radii)
    return judged(EIGENVALUES, radii, None, weigh(stable, Verdict.REFUTED, measured.departures.rigid, text))


def unitless_row(entry: Printed, value: float, measured: Measured) -> JudgedNumber:
    """Stiffness or damping, which are printed without a unit."""
    text = prose("evidence.unitless", measured.contact)
    return judged(entry, {}, value, weigh(False, Verdict.EXPLAINED, measured.departures.contact, text))


def lost_balance_row(measured: Measured) -> JudgedNumber:
    """The failure from MATLAB's initial conditions."""
    steps, outcome = measured.contact.from_x_p
    right = None if measured.departures.rigid else measured.corrected
    short = None if right is None else 100.0 * (1.0 - X_P[3].value / right.state[3])
    text = prose("evidence.lost_balance", steps, 2 * CYCLES, outcome, short)
    agrees = outcome != "walked" and steps == LOST_BALANCE.value
    return judged(LOST_BALANCE, {}, float(steps), weigh(agrees, Verdict.REFUTED, measured.departures.contact, text))


def raised_percent(measured: Measured, coordinate: int) -> float | None:
    """How much larger in magnitude the contact model's start is than the rigid gait (%)."""
    gait = measured.models.get(measured.equations)
    start = measured.contact.start
    if gait is None or start is None or gait.state[coordinate] == 0.0:
        return None
    return 100.0 * (start[coordinate] / gait.state[coordinate] - 1.0)


def velocities_raised(measured: Measured) -> list[float | None]:
    """The same of both velocities."""
    return [raised_percent(measured, coordinate) for coordinate in (2, 3)]


def raised_row(entry: Printed, table_row: StartRow, measured: Measured) -> JudgedNumber:
    """An increase of a velocity that section 4 claims: arithmetic, whatever the config."""
    agrees = bool(agreement(entry, percent_of(table_row).of_matlab))
    verdict = Verdict.REPRODUCED if agrees else Verdict.REFUTED
    text = prose("evidence.raised", measured.contact, velocities_raised(measured))
    text = regardless(measured.departures.contact, text)
    return judged(entry, {}, raised_percent(measured, TABLE_2.index(table_row)), (verdict, text))


def percent_row(table_row: StartRow, coordinate: int, measured: Measured) -> JudgedNumber:
    """A percentage of Table 2: arithmetic, whatever the config."""
    entry, percent = table_row.percent, percent_of(table_row)
    agrees = bool(agreement(entry, percent.of_matlab))
    otherwise = Verdict.EXPLAINED if agreement(entry, percent.of_adams) else Verdict.REFUTED
    verdict = Verdict.REPRODUCED if agrees else otherwise
    text = regardless(measured.departures.contact, prose("evidence.percent", percent, verdict))
    return judged(entry, {}, raised_percent(measured, coordinate), (verdict, text))


def adams_start_row(entry: Printed, coordinate: int, measured: Measured, study: PaperStudy) -> JudgedNumber:
    """A coordinate of the ADAMS start: what it is, whatever the config, and what ours was."""
    start = measured.contact.start
    value = None if start is None else start[coordinate]
    is_angle = coordinate < 2
    text = prose("evidence.adams_start", study, is_angle, measured.contact, velocities_raised(measured))
    otherwise = Verdict.EXPLAINED if is_angle or study.adams.starts_a_gait else Verdict.REFUTED
    verdict = Verdict.REPRODUCED if agreement(entry, value) else otherwise
    return judged(entry, {}, value, (verdict, regardless(measured.departures.contact, text)))
