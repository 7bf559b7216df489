"""Verdicts on what the paper puts in, and on the gait it starts from: sections 2 to 4, eq. 11, Tables 1 and 2."""

from __future__ import annotations

from collections.abc import Iterator

from walkerlab.paper.arithmetic import MM, percent_of, readings_of_fig_4b
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
from walkerlab.paper.study import PaperStudy
from walkerlab.paper.verdict import Row, Verdict, agreement, regardless, weigh

WALKER_PARAMETERS = ("leg_length", "leg_mass", "hip_mass", "gravity")
HOW = {
    "rounded": "the printed digits",
    "cut off": "the printed digits if cut off, not rounded",
    "": "not the printed digits",
}


def start_rows(measured: Measured, study: PaperStudy) -> Iterator[Row]:
    """All rows, in the paper's order."""
    for entry, parameter in zip(TABLE_1, WALKER_PARAMETERS, strict=True):
        yield input_of_both(entry, float(getattr(measured.walker, parameter)), measured.departures.rigid)
    for coordinate in range(len(COORDINATES)):
        yield fixed_point_row(X_P[coordinate], coordinate, measured)
    yield eigenvalue_row(measured)
    yield input_of_both(LEG_INERTIA, measured.walker.leg_inertia, measured.departures.rigid)
    yield input_of_contact(FOOT_RADIUS, measured.contact.foot_radius * MM, measured)
    yield unitless_row(STIFFNESS, measured.contact.stiffness, measured)
    yield unitless_row(DAMPING, measured.contact.damping, measured)
    yield input_of_contact(STATIC_FRICTION, measured.contact.static_friction, measured)
    yield input_of_contact(DYNAMIC_FRICTION, measured.contact.dynamic_friction, measured)
    yield lost_balance_row(measured)
    for entry, table_row in zip(RAISED, TABLE_2[2:], strict=True):
        yield raised_row(entry, table_row, measured)
    for coordinate, table_row in enumerate(TABLE_2):
        yield fixed_point_row(table_row.matlab, coordinate, measured)
        yield adams_start_row(table_row.adams, coordinate, measured, study)
        yield percent_row(table_row, coordinate, measured)


def input_of_both(entry: Printed, value: float, departures: tuple[str, ...]) -> Row:
    """A parameter of both models."""
    verdict, evidence = weigh(
        value == entry.value, Verdict.EXPLAINED, departures, f"an input: {value:g} {entry.unit} is used"
    )
    return Row(entry, value, value, value, verdict, evidence)


def input_of_contact(entry: Printed, value: float, measured: Measured) -> Row:
    """A parameter of the contact model alone."""
    agrees = abs(value - entry.value) <= 1e-12 * abs(entry.value)
    text = f"an input: {value:g} {entry.unit} is used".replace(" 1 is", " is")
    verdict, evidence = weigh(agrees, Verdict.EXPLAINED, measured.departures.contact, text)
    return Row(entry, None, None, value, verdict, evidence)


def fixed_point_row(entry: Printed, coordinate: int, measured: Measured) -> Row:
    """A coordinate of x_p."""
    values = {name: model.state[coordinate] for name, model in measured.models.items()}
    found = {name: agreement(entry, value) for name, value in values.items()}
    said = [f"{name} equations: {values[name]:.6f}, {HOW[found[name]]}" for name in values]
    text = "fixed point of the step map. " + ("; ".join(said) if said else "Neither set of equations has a gait here")
    verdict, evidence = weigh(any(found.values()), Verdict.REFUTED, measured.departures.rigid, text + ".")
    return Row(entry, values.get("as-printed"), values.get("corrected"), None, verdict, evidence)


def eigenvalue_row(measured: Measured) -> Row:
    """Whether the gait is stable."""
    radii = measured.spectral_radii
    text = "; ".join(f"{name} equations: largest multiplier {radius:.4f}" for name, radius in radii.items())
    stable = bool(radii) and all(radius < EIGENVALUES.value for radius in radii.values())
    verdict, evidence = weigh(stable, Verdict.REFUTED, measured.departures.rigid, text or "no gait was found")
    return Row(EIGENVALUES, radii.get("as-printed"), radii.get("corrected"), None, verdict, evidence)


def unitless_row(entry: Printed, value: float, measured: Measured) -> Row:
    """Stiffness or damping, which are printed without a unit."""
    contact = measured.contact
    text = (
        f"no unit is printed: {readings_of_fig_4b()}. Used here: {contact.stiffness:g} and {contact.damping:g} "
        f"({contact.units} units): {contact.static_penetration * MM:.3g} mm with {contact.damping_ratio:.3g}; "
        f"{walked(measured)}."
    )
    verdict, evidence = weigh(False, Verdict.EXPLAINED, measured.departures.contact, text)
    return Row(entry, None, None, value, verdict, evidence)


def walked(measured: Measured) -> str:
    """How far the contact model walked."""
    contact = measured.contact
    return f"the contact model took {contact.steps} step{'' if contact.steps == 1 else 's'} ({contact.outcome})"


def lost_balance_row(measured: Measured) -> Row:
    """The failure from MATLAB's initial conditions."""
    steps, outcome = measured.contact.x_p_steps, measured.contact.x_p_outcome
    text = f"from x_p with its printed digits the contact model takes {steps} of {2 * CYCLES} steps ({outcome})."
    right = measured.corrected
    if right is not None and not measured.departures.rigid:
        short = 100.0 * (1.0 - X_P[3].value / right.state[3])
        text += f" Its {X_P[3].text} rad/s are {short:.1f}% slower than the gait of the right equations."
    agrees = outcome != "walked" and steps == LOST_BALANCE.value
    verdict, evidence = weigh(agrees, Verdict.REFUTED, measured.departures.contact, text)
    return Row(LOST_BALANCE, None, None, float(steps), verdict, evidence)


def started(measured: Measured) -> str:
    """From where the contact model walked."""
    raised = [raised_percent(measured, coordinate) for coordinate in (2, 3)]
    if raised[0] is None or raised[1] is None:
        return "from a start that was not stored"
    if max(abs(raised[0]), abs(raised[1])) < 1e-6:
        return "from the rigid model's fixed point without any increase of its velocities"
    return f"from velocities {raised[0]:+.2f}% and {raised[1]:+.2f}% off the rigid model's fixed point"


def raised_percent(measured: Measured, coordinate: int) -> float | None:
    """How much larger in magnitude the contact model's start is than the rigid gait (%)."""
    gait = measured.models.get(measured.equations)
    start = measured.contact.start
    if gait is None or start is None or gait.state[coordinate] == 0.0:
        return None
    return 100.0 * (start[coordinate] / gait.state[coordinate] - 1.0)


def raised_row(entry: Printed, table_row: StartRow, measured: Measured) -> Row:
    """An increase of a velocity that section 4 claims: arithmetic, whatever the config."""
    said = [
        f"{row.matlab.text} raised by {claim.text} is {row.matlab.value * (1.0 + claim.value / 100.0):.3f} and not "
        f"{row.adams.text}, which is {percent_of(row).of_matlab:+.0f}%"
        for claim, row in zip(RAISED, TABLE_2[2:], strict=True)
    ]
    text = f"{'; '.join(said)}. Ours: {walked(measured)}, {started(measured)}."
    agrees = bool(agreement(entry, percent_of(table_row).of_matlab))
    verdict = Verdict.REPRODUCED if agrees else Verdict.REFUTED
    text = regardless(measured.departures.contact, text)
    return Row(entry, None, None, raised_percent(measured, TABLE_2.index(table_row)), verdict, text)


def percent_row(table_row: StartRow, coordinate: int, measured: Measured) -> Row:
    """A percentage of Table 2: arithmetic, whatever the config."""
    entry, percent = table_row.percent, percent_of(table_row)
    text = f"{percent.of_matlab:+.3g}% of the MATLAB value, {percent.of_adams:+.3g}% of the ADAMS value"
    if agreement(entry, percent.of_matlab):
        verdict = Verdict.REPRODUCED
    elif agreement(entry, percent.of_adams):
        verdict, text = Verdict.EXPLAINED, text + ": divided by the value after the change instead of before"
    else:
        verdict, text = Verdict.REFUTED, text + ": neither is the printed percentage"
    text = regardless(measured.departures.contact, text + ".")
    return Row(entry, None, None, raised_percent(measured, coordinate), verdict, text)


def adams_start_row(entry: Printed, coordinate: int, measured: Measured, study: PaperStudy) -> Row:
    """A coordinate of the ADAMS start: what it is, whatever the config, and what ours was."""
    start = measured.contact.start
    value = None if start is None else start[coordinate]
    is_angle = coordinate < 2
    x_p = f"those of x_p on {study.slope:.5f} +- {study.slope_rounding:.5f} rad"
    text = f"{study.adams.angles_in_words}, {x_p}" if is_angle else study.adams.velocities_in_words
    text += f". Ours: {walked(measured)}, {started(measured)}."
    otherwise = Verdict.EXPLAINED if is_angle or study.adams.starts_a_gait else Verdict.REFUTED
    verdict = Verdict.REPRODUCED if agreement(entry, value) else otherwise
    return Row(entry, None, None, value, verdict, regardless(measured.departures.contact, text))
