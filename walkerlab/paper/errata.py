"""The errata of the paper, each with its evidence and what was measured for it; see `study` for the measuring."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from walkerlab.labels import Label
from walkerlab.paper.arithmetic import (
    MM,
    PercentOf,
    percent_of,
    printed_speed,
    readings_of_fig_4b,
    speed_difference,
)
from walkerlab.paper.printed import (
    DAMPING,
    E_AVG,
    EQUATION_NUMBERS,
    STEP_LENGTH,
    STIFFNESS,
    T_CYCLE,
    T_LEFT,
    T_RIGHT,
    TABLE_2,
    V_COM,
    X_P,
)
from walkerlab.paper.study import PaperStudy
from walkerlab.paper.verdict import agreement
from walkerlab.solvers.system import State


@dataclass(frozen=True)
class Erratum:
    """An error of the paper."""

    where: Annotated[str, Label("", "where the paper errs")]
    printed: Annotated[str, Label("", "as printed")]
    right: Annotated[str, Label("", "as it should be")]
    evidence: Annotated[str, Label("", "by which argument")]
    measured: Annotated[str, Label("", "numbers of that argument, from this run")]


def errata(study: PaperStudy) -> tuple[Erratum, ...]:
    """All of them, in the order of the paper's sections within each theme."""
    return (*of_the_equations(study), *of_the_fixed_point(study), *of_the_adams_start(study), *of_the_results(study))


def listed(state: State | None) -> str:
    """A state in words."""
    return "none found" if state is None else ", ".join(f"{value:.6f}" for value in state)


def of_the_equations(study: PaperStudy) -> Iterator[Erratum]:
    """Misprints of the model."""
    printed, right, impact, order = study.as_printed, study.corrected, study.impact, study.ordering
    yield Erratum(
        "A.5 row 2, A.29",
        "C_21 = + m L b dtheta_1 sin(theta_2 - theta_1)",
        "C_21 = - m L b dtheta_1 sin(theta_2 - theta_1)",
        "Lagrange's equations of A.1 to A.3; nothing does work in a swing, so its energy is constant",
        f"energy changes in a swing by {printed.energy_drift:.4f} J as printed, {right.energy_drift:.1e} J corrected",
    )
    yield Erratum(
        "A.55 row 2",
        "y + L (cos theta_1 - cos(-theta_2))",
        "y + L (cos theta_2 - cos theta_1)",
        "geometry: both feet of x_p are on the slope, and the new stance foot rests after the impact (eq. 7)",
        f"as printed the swing foot of x_p is {abs(impact.height) * MM:.2f} mm off the slope and the new stance foot "
        f"moves at {impact.foothold_speed:.3f} m/s; fixed point with both misprints {listed(impact.fixed_point)}, "
        f"with that of A.5 alone {listed(printed.state)}",
    )
    first, second = X_P[0], X_P[1]
    yield Erratum(
        "eq. 9-2",
        "theta_1 = -theta_2",
        "theta_1 + theta_2 = -2 phi",
        "the angles are from the vertical, not from the slope's normal",
        f"x_p itself sums to {first.value + second.value:.4f} rad, not to zero",
    )
    yield Erratum(
        "eq. 5 against A.7 to A.24",
        "q_e = (x, y, q)",
        "q_e = (q, x, y)",
        "the kinetic energy of a moving state, from its masses and from D_e",
        f"masses {order.of_masses:.4f} J; D_e with (q, x, y) {order.angles_first:.4f} J, with (x, y, q) "
        f"{order.foot_first:.4f} J",
    )
    gaps = [number for number in range(1, EQUATION_NUMBERS[-1]) if number not in EQUATION_NUMBERS]
    yield Erratum(
        "Appendix A",
        f"A.{gaps[0] - 1} is followed by A.{gaps[-1] + 1}",
        f"A.{gaps[0]} to A.{gaps[-1]}",
        "the numbers of the equations; the energies that section 3.1 announces are not among them either",
        f"{len(gaps)} numbers without an equation",
    )


def of_the_fixed_point(study: PaperStudy) -> Iterator[Erratum]:
    """The slope, and the gait that the paper walks."""
    yield Erratum(
        "slope",
        "not stated in the text",
        f"{study.slope:.4f} rad",
        "both feet of x_p stand on it: theta_1 + theta_2 = -2 phi",
        f"{study.slope:.4f} +- {study.slope_rounding:.5f} rad, that is {math.degrees(study.slope):.3f} degrees",
    )
    digits = [agreement(entry, x) or "missed" for entry, x in zip(X_P, study.as_printed.state, strict=True)]
    yield Erratum(
        "eq. 11, x_p",
        ", ".join(entry.text for entry in X_P),
        listed(study.corrected.state),
        "the fixed point with the sign of A.5 as printed and the right impact map: the paper's code had the sign error",
        f"as printed {listed(study.as_printed.state)} (x_p's digits {', '.join(digits)}), "
        f"T = {study.as_printed.table_3.t_left:.6f} s; "
        f"corrected {listed(study.corrected.state)}, T = {study.corrected.table_3.t_left:.6f} s",
    )
    from_x_p, printed = study.from_x_p, study.as_printed
    yield Erratum(
        "Table 3, energy",
        f"{E_AVG.matlab.text} J",
        f"{study.corrected.table_3.E_avg:.3f} J",
        "time mean from the stance foot; constant within a swing only with the right sign in A.5",
        f"as printed {printed.table_3.E_avg:.3f} J, moving between {printed.energy_least:.3f} and "
        f"{printed.energy_most:.3f} J; {from_x_p.E_avg:.3f} J over five gait cycles from x_p with its printed digits",
    )


def of_the_adams_start(study: PaperStudy) -> Iterator[Erratum]:
    """Table 2 and Fig. 4b."""
    rows = [(row, percent_of(row)) for row in TABLE_2]
    yield Erratum(
        "Table 2, percentages",
        ", ".join(row.percent.text for row in TABLE_2),
        "of the MATLAB value: " + ", ".join(f"{percent.of_matlab:+.2f}%" for _, percent in rows),
        "arithmetic on the two columns",
        "; ".join(percentages_of(row.percent.quantity, percent) for row, percent in rows),
    )
    factors = [row.adams.value / row.matlab.value for row in TABLE_2[2:]]
    yield Erratum(
        "sections 4 and 6, increase of the velocities",
        "by 41% and 74%; 'slightly higher'",
        f"by {100 * (factors[0] - 1):.0f}% and {100 * (factors[1] - 1):.0f}%",
        "an increase is counted from where it starts; Table 2 divides by where it ends",
        f"the velocities of Table 2 are {factors[0]:.2f} and {factors[1]:.2f} times MATLAB's",
    )
    adams = study.adams
    yield Erratum(
        "Table 2, slope of the ADAMS start",
        "the slope of x_p is implied",
        f"{adams.slope:.5f} rad",
        "its angles sum to -2 phi as those of x_p do",
        f"{adams.angles_in_words}; those of x_p {study.slope:.5f} +- {study.slope_rounding:.5f} rad",
    )
    yield Erratum(
        "Table 2, ADAMS start",
        ", ".join(row.adams.text for row in TABLE_2[2:]) + " rad/s start a gait",
        "not the start of a gait",
        "energy, and the sign of the ground's reaction in the rigid model",
        adams.velocities_in_words,
    )
    yield Erratum(
        "section 4, Fig. 4b",
        f"stiffness {STIFFNESS.text}, damping {DAMPING.text}, without units",
        "N/mm^e and N s/mm",
        "the units of ADAMS dialogs; read as SI the contact is all but undamped",
        readings_of_fig_4b(),
    )


def percentages_of(name: str, percent: PercentOf) -> str:
    """Both readings of a percentage in words."""
    return f"{name.split(',')[0]} {percent.of_matlab:+.2f}% of MATLAB's, {percent.of_adams:+.2f}% of ADAMS's value"


def of_the_results(study: PaperStudy) -> Iterator[Erratum]:
    """Fig. 8 and Table 3."""
    printed, right = study.as_printed, study.corrected
    late = [abs(row.matlab.value - row.adams.value) for row in (T_LEFT, T_RIGHT)]
    yield Erratum(
        "Fig. 8",
        "largest error about 1e-4",
        f"above {study.fastest * min(late):.2g} rad at the same time",
        "Table 3's own step periods differ; a leg that arrives late is off by its velocity times the delay",
        f"the periods differ by {1e3 * late[0]:.0f} and {1e3 * late[1]:.0f} ms; at up to {study.fastest:.2f} rad/s "
        f"this is {study.fastest * late[0]:.3f} and {study.fastest * late[1]:.3f} rad, and {study.largest_jump:.2f} "
        "rad/s while one model has had its heel strike and the other has not",
    )
    yield Erratum(
        "Table 3, step periods",
        f"{T_LEFT.matlab.text} and {T_RIGHT.matlab.text} s",
        f"twice {right.table_3.t_left:.4f} s",
        "x_p is a fixed point of one step, so all steps are equal",
        f"{printed.table_3.t_left:.4f} and {printed.table_3.t_right:.4f} s as printed, "
        f"{right.table_3.t_left:.4f} and {right.table_3.t_right:.4f} s corrected",
    )
    total = T_LEFT.adams.value + T_RIGHT.adams.value
    yield Erratum(
        "Table 3, cycle of MSC ADAMS",
        f"{T_LEFT.adams.text} + {T_RIGHT.adams.text} = {T_CYCLE.adams.text} s",
        f"{total:.2f} s",
        "arithmetic",
        f"the sum is {total:.2f} s; MATLAB's column does add up, to {T_LEFT.matlab.value + T_RIGHT.matlab.value:.2f} s",
    )
    yield Erratum(
        "Table 3, velocity, and the step length of section 5",
        f"{V_COM.matlab.text} m/s, {STEP_LENGTH.text} m",
        f"{right.table_3.v_com:.3f} m/s, {right.step_length:.4f} m",
        "a step is 2 L sin((theta_2 - theta_1)/2); one step was also divided by the time of two",
        f"x_p steps {printed.step_length:.4f} m as printed ({right.step_length:.4f} m corrected), "
        f"{printed.step_length / STEP_LENGTH.value:.1f} times the printed length; v_com {printed.table_3.v_com:.3f} "
        f"({right.table_3.v_com:.3f}) m/s; {STEP_LENGTH.text} m in {T_CYCLE.matlab.text} s is "
        f"{printed_speed(T_CYCLE.matlab.value):.4f} m/s",
    )
    own = speed_difference(T_LEFT.matlab.value + T_RIGHT.matlab.value, total)
    as_divided = speed_difference(T_CYCLE.matlab.value, T_CYCLE.adams.value)
    yield Erratum(
        "section 5, difference of the velocities",
        "less than 1%",
        f"{own:.1f}%",
        "the printed step length over the sums of the printed step periods",
        f"{as_divided:.1f}% with the printed cycles, {own:.1f}% with the sums",
    )
