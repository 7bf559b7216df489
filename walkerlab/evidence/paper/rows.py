"""The numbers of the paper with our verdicts, in the order of the paper, and its three tables next to our values."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from walkerlab.config.contact import MM_PER_M
from walkerlab.evidence.check.printed import Judged, Verdict
from walkerlab.evidence.paper import printed
from walkerlab.evidence.paper.measured import EQUATION_SETS, PAPER_CYCLES, Measured
from walkerlab.evidence.paper.printed import Printed, contradictions, percent_left_open, speed_difference
from walkerlab.evidence.paper.prose import prose
from walkerlab.evidence.paper.study import PaperStudy
from walkerlab.physics.hybrid.comparison import Quantity

WALKER_PARAMETERS = ("leg_length", "leg_mass", "hip_mass", "gravity")


VERDICTS = (
    Verdict.INPUT,
    Verdict.REPRODUCED,
    Verdict.EXPLAINED,  # for a measured reason, or because the scene is not the paper's
    Verdict.CONTRADICTED,  # overrides all other verdicts
    Verdict.NOT_REPRODUCED,  # includes values of ADAMS, which was not run
)
"""Verdicts on the paper's values."""
Scene = Literal["rigid", "contact", "any"]
"""Model that must have the paper's scene for a mismatch to count. With "any" a mismatch always counts, because the
verdict depends only on printed values.
"""


def count_verdicts(rows: Iterable[Judged]) -> dict[str, int]:
    """Count values by verdict. Until 0.3 is released, `refuted` is the sum of the last two counts."""
    verdicts = Counter(row.verdict for row in rows)
    return {
        **{verdict.value: verdicts[verdict] for verdict in VERDICTS},
        "refuted": verdicts[Verdict.CONTRADICTED] + verdicts[Verdict.NOT_REPRODUCED],
    }


def paper_rows(measured: Measured, study: PaperStudy) -> Iterator[Judged]:
    """Yield the rows of all numbers, in the order of the paper."""
    judge = Judge(measured, study)
    contact = measured.contact
    for entry, parameter in zip(printed.TABLE_1, WALKER_PARAMETERS, strict=True):
        yield judge.judge_input(entry, float(getattr(measured.walker, parameter)), "rigid")
    for coordinate, entry in enumerate(printed.X_P):
        yield judge.fixed_point(entry, coordinate)
    yield judge.eigenvalue()
    yield judge.judge_input(printed.LEG_INERTIA, measured.walker.leg_inertia, "rigid")
    yield judge.judge_input(printed.FOOT_RADIUS, contact.foot_radius * MM_PER_M, "contact")
    for entry, value in ((printed.STIFFNESS, contact.law.stiffness), (printed.DAMPING, contact.law.damping)):
        yield judge.judge_input(entry, value, "contact", prose("evidence.unitless", contact))
    yield judge.judge_input(printed.STATIC_FRICTION, contact.law.static_friction, "contact")
    yield judge.judge_input(printed.DYNAMIC_FRICTION, contact.law.dynamic_friction, "contact")
    yield judge.lost_balance()
    for coordinate, row in enumerate(printed.TABLE_2):
        yield judge.adams_start(row.adams, coordinate)
        yield judge.percent(row, coordinate)
    yield judge.strides()
    yield judge.error()
    yield judge.step_length()
    yield judge.velocity_difference()
    for result in printed.TABLE_3:
        yield from judge.table_3(result)


@dataclass(frozen=True)
class Judge:
    """Judges the paper's numbers by measurements on two scenes: the config's and the paper's."""

    measured: Measured
    study: PaperStudy

    def row(
        self,
        entry: Printed,
        rigid: Mapping[str, float],
        contact: float | None,
        verdict: Verdict,
        scene: Scene,
        evidence: str,
    ) -> Judged:
        """Build the row of a printed value.

        rigid    values of the rigid model, by set of equations
        contact  value of the contact model, or None if it has no such value
        verdict  verdict that holds unless other values of the paper contradict this one or the scene is not the paper's
        """
        departures = self.measured.departures
        differs = "; ".join(departures.rigid if scene == "rigid" else departures.contact)
        if (contradiction := contradictions().get(entry)) is not None:
            verdict = Verdict.CONTRADICTED
            scene = "any"
            evidence = f"{contradiction}. {evidence[:1].upper()}{evidence[1:]}"
        if differs and scene == "any":
            evidence += f" The verdict is about the paper's own numbers, not this scene ({differs})."
        elif differs and verdict not in (Verdict.INPUT, Verdict.REPRODUCED):
            verdict = Verdict.EXPLAINED
            evidence = f"Not the paper's scene ({differs}): {evidence}"
        values = {name.replace("-", "_"): rigid.get(name) for name in EQUATION_SETS}
        about = {"where": entry.where, "quantity": entry.quantity, "unit": entry.unit}
        return Judged(entry, about, {**values, "contact": contact}, verdict, evidence)

    def judge_input(self, entry: Printed, value: float, scene: Scene, evidence: str = "") -> Judged:
        """Judge a parameter of both models, or of the contact model alone."""
        rigid: dict[str, float] = dict.fromkeys(EQUATION_SETS, value) if scene == "rigid" else {}
        verdict = Verdict.INPUT if math.isclose(value, entry.value, rel_tol=1e-12) else Verdict.EXPLAINED
        return self.row(entry, rigid, value, verdict, scene, evidence or prose("evidence.input", value, entry.unit))

    def fixed_point(self, entry: Printed, coordinate: int) -> Judged:
        values = {name: model.state[coordinate] for name, model in self.measured.models.items()}
        text = prose("evidence.fixed_point", values, {name: entry.agreement(value) for name, value in values.items()})
        return self.row(entry, values, None, verdict_on(entry, values.values()), "rigid", text)

    def eigenvalue(self) -> Judged:
        radii = self.measured.spectral_radii
        verdict = verdict_on(printed.EIGENVALUES, [max(radii.values(), default=None)])
        return self.row(printed.EIGENVALUES, radii, None, verdict, "rigid", prose("evidence.eigenvalue", radii))

    def lost_balance(self) -> Judged:
        """Judge the paper's claim that the walker loses its balance from MATLAB's initial conditions."""
        steps, outcome = self.measured.contact.from_x_p
        right = None if self.measured.departures.rigid else self.measured.models.get("corrected")
        short = None if right is None else 100.0 * (1.0 - printed.X_P[3].value / right.state[3])
        text = prose("evidence.lost_balance", steps, 2 * PAPER_CYCLES, outcome, short)
        verdict = verdict_on(printed.LOST_BALANCE, [None if outcome == "walked" else steps])
        return self.row(printed.LOST_BALANCE, {}, float(steps), verdict, "contact", text)

    def percent(self, row: printed.StartRow, coordinate: int) -> Judged:
        """Judge a percentage of Table 2. This is only arithmetic, so the config does not matter."""
        entry = row.percent
        verdict = verdict_on(entry, [row.percent_of_matlab], Verdict.EXPLAINED)
        left_open = None if entry in contradictions() else percent_left_open(row)
        text = prose("evidence.percent", row, left_open, self.measured.contact, self.measured.raised[2:])
        return self.row(entry, {}, self.measured.raised[coordinate], verdict, "any", text)

    def adams_start(self, entry: Printed, coordinate: int) -> Judged:
        """Judge a coordinate of the ADAMS start. It is an input if the contact model starts from it."""
        contact = self.measured.contact
        value = None if contact.start is None else contact.start[coordinate]
        verdict = Verdict.INPUT if entry.fits(value) else Verdict.NOT_REPRODUCED
        text = prose("evidence.adams_start", self.study, coordinate < 2, contact, self.measured.raised[2:])
        return self.row(entry, {}, value, verdict, "contact", text)

    def strides(self) -> Judged:
        """Judge the number of gait cycles. It is an input, because the rigid model walks as many as requested."""
        entry = printed.CYCLES_WALKED
        contact = self.measured.contact
        rigid = {name: float(model.steps // 2) for name, model in self.measured.models.items()}
        completed = contact.steps // 2
        text = prose("evidence.strides", contact, completed, contact.outcome == "walked" and completed < entry.value)
        return self.row(entry, rigid, float(completed), Verdict.INPUT, "contact", text)

    def error(self) -> Judged:
        """Judge the largest error of Fig. 8, for angles and angular velocities together."""
        differences = self.measured.errors
        late = abs(printed.T_LEFT.matlab.value - printed.T_LEFT.adams.value)
        quantities: tuple[tuple[Quantity, float, str], ...] = (
            ("angle", self.study.fastest * late, "rad"),
            ("velocity", self.study.largest_jump, "rad/s"),
        )
        errors_by_quantity = [
            (f"{off:.2g} {unit}", unit, {way: difference.largest(quantity) for way, difference in differences.items()})
            for quantity, off, unit in quantities
        ]
        text = prose("evidence.error", late, self.measured.equations, errors_by_quantity)
        way = "aligned" if "aligned" in differences else "raw"
        largest = max((max(errors[way]) for _, _, errors in errors_by_quantity if way in errors), default=None)
        return self.row(printed.LARGEST_ERROR, {}, largest, Verdict.NOT_REPRODUCED, "any", text)

    def step_length(self) -> Judged:
        entry = printed.STEP_LENGTH
        contact = self.measured.contact.step_length
        lengths = {name: model.step_length for name, model in self.measured.models.items()}
        longest = max((*lengths.values(), *(() if contact is None else (contact,))), default=None)
        text = prose("evidence.step_length", lengths, contact, longest)
        return self.row(entry, lengths, contact, verdict_on(entry, lengths.values()), "rigid", text)

    def velocity_difference(self) -> Judged:
        """Judge the difference of the average velocities. The evidence repeats the arithmetic of the paper."""
        percentages = self.measured.speed_differences
        rows = printed.T_LEFT, printed.T_RIGHT, printed.T_CYCLE
        left, right, cycle = ((row.matlab.value, row.adams.value) for row in rows)
        by_cycle = speed_difference(*cycle)
        sums = speed_difference(left[0] + right[0], left[1] + right[1])
        text = prose("evidence.velocity_difference", percentages, by_cycle, sums)
        verdict = verdict_on(printed.VELOCITY_DIFFERENCE, [max(percentages.values(), default=None)])
        return self.row(printed.VELOCITY_DIFFERENCE, percentages, None, verdict, "contact", text)

    def table_3(self, row: printed.PrintedRow) -> Iterator[Judged]:
        """Judge a row of Table 3: the MATLAB value by the rigid model, the ADAMS value by the contact model."""
        measured = self.measured
        study = self.study
        values = {name: getattr(model.table_3, row.name) for name, model in measured.models.items()}
        rigid = {name: value for name, value in values.items() if value is not None}
        contact: float | None = getattr(measured.contact.table_3, row.name)
        # Both step periods are wrong for the same reason, so the evidence shows both.
        names = ("t_left", "t_right") if row in (printed.T_LEFT, printed.T_RIGHT) else (row.name,)
        means = {"five": study.five_steps_energy, "ten": study.from_x_p.E_avg} if row is printed.E_AVG else {}
        matching_means = [steps for steps, mean in means.items() if row.matlab.agreement(mean)]
        # With the misprint, energy is not conserved, so a mean over five or ten steps may explain the printed value.
        otherwise = Verdict.EXPLAINED if matching_means else Verdict.NOT_REPRODUCED
        verdict = verdict_on(row.matlab, rigid.values(), otherwise)
        text = prose("evidence.matlab", row, measured, names, study, matching_means)
        yield self.row(row.matlab, rigid, contact, verdict, "rigid", text)
        text = prose("evidence.adams", row, measured, names)
        yield self.row(row.adams, rigid, contact, verdict_on(row.adams, [contact]), "contact", text)


def verdict_on(entry: Printed, values: Iterable[float | None], otherwise: Verdict = Verdict.NOT_REPRODUCED) -> Verdict:
    """Return the verdict on a printed value. It is reproduced if one of `values` agrees with all of its digits."""
    return Verdict.REPRODUCED if any(map(entry.fits, values)) else otherwise


Table = dict[str, dict[str, Any]]
"""Rows by name, each with values by column. A value is None if the model has no such value."""

MIDDLE = "section 2: 'in the middle of the legs'"


def table_1(measured: Measured, study: PaperStudy) -> Table:
    """Return the parameters as printed, with their source, and as used here."""
    walker = measured.walker
    inertia = printed.LEG_INERTIA
    radius = printed.FOOT_RADIUS
    length, mass, hip, gravity = printed.TABLE_1
    rows = (
        ("L", "length of the legs", "m", length.value, walker.leg_length, length.where),
        ("m", "mass of a leg", "kg", mass.value, walker.leg_mass, mass.where),
        ("MH", "mass of the hip", "kg", hip.value, walker.hip_mass, hip.where),
        ("g", "gravity", "m/s^2", gravity.value, walker.gravity, gravity.where),
        ("a", "foot to mass of the leg", "m", 0.5 * length.value, walker.foot_to_mass, MIDDLE),
        ("J", "inertia of a leg", "kg m^2", inertia.value, walker.leg_inertia, inertia.where),
        ("r", "radius of the foot", "m", radius.value / MM_PER_M, measured.contact.foot_radius, radius.where),
        ("phi", "slope", "rad", study.slope, walker.slope, "not stated: from the angles of x_p"),
    )
    columns = ("quantity", "unit", "paper", "used", "where")
    return {symbol: dict(zip(columns, values, strict=True)) for symbol, *values in rows}


def table_2(measured: Measured) -> Table:
    """Return the initial values, and the difference between MATLAB and ADAMS as a percentage of each."""
    table = {}
    start = measured.contact.start
    for place, (coordinate, row) in enumerate(zip(printed.STATE_NAMES, printed.TABLE_2, strict=True)):
        states = {name: model.state[place] for name, model in measured.models.items()}
        table[coordinate] = {
            **number_columns(row, states, None if start is None else start[place]),
            "paper_percent": row.percent.value,
            "paper_percent_text": row.percent.text,
            "percent_of_matlab": row.percent_of_matlab,
            "percent_of_adams": row.percent_of_adams,
        }
    return table


def table_3(measured: Measured) -> Table:
    table = {}
    for row in printed.TABLE_3:
        rigid = {name: getattr(model.table_3, row.name) for name, model in measured.models.items()}
        table[row.name] = number_columns(row, rigid, getattr(measured.contact.table_3, row.name))
    return table


def number_columns(row: printed.PrintedRow, rigid: Mapping[str, float | None], contact: float | None) -> dict[str, Any]:
    """Return the columns of a row: both printed numbers, then the values of the rigid and the contact model.

    rigid  values of the rigid model, by set of equations
    """
    return {
        "unit": row.matlab.unit,
        "paper_matlab": row.matlab.value,
        "paper_matlab_text": row.matlab.text,
        "paper_adams": row.adams.value,
        "paper_adams_text": row.adams.text,
        "as_printed": rigid.get("as-printed"),
        "corrected": rigid.get("corrected"),
        "contact": contact,
    }
