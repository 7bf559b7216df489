"""The paper's numbers, each with its verdict: what it puts in and starts from, then what it gets out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum

from walkerlab.paper import printed
from walkerlab.paper.arithmetic import MM, percent_of, speed_difference
from walkerlab.paper.measured import CYCLES, Measured
from walkerlab.paper.printed import Printed
from walkerlab.paper.prose import prose
from walkerlab.paper.study import PaperStudy

STEPS_OF_A_STRIDE = 2
AROUND = 2.0  # 'around 1e-4' is up to twice that
WALKER_PARAMETERS = ("leg_length", "leg_mass", "hip_mass", "gravity")


class NumberVerdict(StrEnum):
    """How a printed number fares."""

    REPRODUCED = "reproduced"  # it comes out to the printed digits
    EXPLAINED = "explained"  # it does not, or not by itself, and what was measured says why
    REFUTED = "refuted"  # it contradicts what was measured, or the paper's own numbers


@dataclass(frozen=True)
class JudgedNumber:
    """A printed number beside the measured ones, in the unit it is printed in; None where a model has none."""

    printed: Printed
    as_printed: float | None
    corrected: float | None
    contact: float | None
    verdict: NumberVerdict
    evidence: str

    @property
    def summary(self) -> dict[str, str | float | None]:
        """As commands print it."""
        about = {name: getattr(self.printed, name) for name in ("where", "quantity", "unit")}
        models = {name: getattr(self, name) for name in ("as_printed", "corrected", "contact")}
        return {
            **about,
            "printed": self.printed.text,
            **models,
            "verdict": self.verdict.value,
            "evidence": self.evidence,
        }


def judged(
    entry: Printed, rigid: Mapping[str, float], contact: float | None, found: tuple[NumberVerdict, str]
) -> JudgedNumber:
    """A printed number beside those of the rigid model, by set of equations, and of the contact model."""
    return JudgedNumber(entry, rigid.get("as-printed"), rigid.get("corrected"), contact, *found)


def weigh(
    agrees: bool, otherwise: NumberVerdict, departures: tuple[str, ...], evidence: str
) -> tuple[NumberVerdict, str]:
    """The verdict and its evidence.

    agrees      the number came out
    otherwise   what is said if it did not, of the paper's own scene
    departures  in what the scene is not the paper's: a mismatch refutes nothing then
    """
    if agrees:
        return NumberVerdict.REPRODUCED, evidence
    if departures:
        return NumberVerdict.EXPLAINED, f"Not the paper's scene ({'; '.join(departures)}). {evidence}"
    return otherwise, evidence


def regardless(departures: tuple[str, ...], evidence: str) -> str:
    """The evidence of a verdict that follows from the paper's own numbers, which another scene does not change."""
    if not departures:
        return evidence
    return f"{evidence} The verdict is about the paper's own numbers, not about this scene ({'; '.join(departures)})."


REPRODUCED, EXPLAINED, REFUTED = NumberVerdict


def paper_rows(measured: Measured, study: PaperStudy) -> Iterator[JudgedNumber]:
    """All rows, in the paper's order."""
    contact = measured.contact
    for entry, parameter in zip(printed.TABLE_1, WALKER_PARAMETERS, strict=True):
        yield input_of_both(entry, float(getattr(measured.walker, parameter)), measured.departures.rigid)
    for coordinate in range(len(printed.COORDINATES)):
        yield fixed_point_row(printed.X_P[coordinate], coordinate, measured)
    yield eigenvalue_row(measured)
    yield input_of_both(printed.LEG_INERTIA, measured.walker.leg_inertia, measured.departures.rigid)
    yield input_of_contact(printed.FOOT_RADIUS, contact.foot_radius * MM, measured)
    yield unitless_row(printed.STIFFNESS, contact.law.stiffness, measured)
    yield unitless_row(printed.DAMPING, contact.law.damping, measured)
    yield input_of_contact(printed.STATIC_FRICTION, contact.law.static_friction, measured)
    yield input_of_contact(printed.DYNAMIC_FRICTION, contact.law.dynamic_friction, measured)
    yield lost_balance_row(measured)
    for entry, table_row in zip(printed.RAISED, printed.TABLE_2[2:], strict=True):
        yield raised_row(entry, table_row, measured)
    for coordinate, table_row in enumerate(printed.TABLE_2):
        yield fixed_point_row(table_row.matlab, coordinate, measured)
        yield adams_start_row(table_row.adams, coordinate, measured, study)
        yield percent_row(table_row, coordinate, measured)
    yield strides_row(measured)
    yield error_row(printed.ANGLE_ERROR, measured, study, "angle")
    yield error_row(printed.VELOCITY_ERROR, measured, study, "velocity")
    yield step_length_row(measured)
    yield velocity_difference_row(measured)
    for result in printed.TABLE_3:
        yield matlab_row(result, measured, study)
        yield adams_row(result, measured)


def input_of_both(entry: Printed, value: float, departures: tuple[str, ...]) -> JudgedNumber:
    """A parameter of both models."""
    text = prose("evidence.input", value, entry.unit)
    verdict, evidence = weigh(value == entry.value, EXPLAINED, departures, text)
    return JudgedNumber(entry, value, value, value, verdict, evidence)


def input_of_contact(entry: Printed, value: float, measured: Measured) -> JudgedNumber:
    """A parameter of the contact model alone."""
    agrees = abs(value - entry.value) <= 1e-12 * abs(entry.value)
    text = prose("evidence.input", value, entry.unit)
    return judged(entry, {}, value, weigh(agrees, EXPLAINED, measured.departures.contact, text))


def fixed_point_row(entry: Printed, coordinate: int, measured: Measured) -> JudgedNumber:
    """A coordinate of x_p."""
    values = {name: model.state[coordinate] for name, model in measured.models.items()}
    found = {name: entry.agreement(value) for name, value in values.items()}
    text = prose("evidence.fixed_point", values, found)
    return judged(entry, values, None, weigh(any(found.values()), REFUTED, measured.departures.rigid, text))


def eigenvalue_row(measured: Measured) -> JudgedNumber:
    """Whether the gait is stable."""
    radii = measured.spectral_radii
    stable = bool(radii) and all(radius < printed.EIGENVALUES.value for radius in radii.values())
    text = prose("evidence.eigenvalue", radii)
    return judged(printed.EIGENVALUES, radii, None, weigh(stable, REFUTED, measured.departures.rigid, text))


def unitless_row(entry: Printed, value: float, measured: Measured) -> JudgedNumber:
    """Stiffness or damping, which are printed without a unit."""
    text = prose("evidence.unitless", measured.contact)
    return judged(entry, {}, value, weigh(False, EXPLAINED, measured.departures.contact, text))


def lost_balance_row(measured: Measured) -> JudgedNumber:
    """The failure from MATLAB's initial conditions."""
    steps, outcome = measured.contact.from_x_p
    right = None if measured.departures.rigid else measured.corrected
    short = None if right is None else 100.0 * (1.0 - printed.X_P[3].value / right.state[3])
    text = prose("evidence.lost_balance", steps, 2 * CYCLES, outcome, short)
    agrees = outcome != "walked" and steps == printed.LOST_BALANCE.value
    return judged(printed.LOST_BALANCE, {}, float(steps), weigh(agrees, REFUTED, measured.departures.contact, text))


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


def raised_row(entry: Printed, table_row: printed.StartRow, measured: Measured) -> JudgedNumber:
    """An increase of a velocity that section 4 claims: arithmetic, whatever the config."""
    agrees = bool(entry.agreement(percent_of(table_row).of_matlab))
    verdict = REPRODUCED if agrees else REFUTED
    text = prose("evidence.raised", measured.contact, velocities_raised(measured))
    text = regardless(measured.departures.contact, text)
    return judged(entry, {}, raised_percent(measured, printed.TABLE_2.index(table_row)), (verdict, text))


def percent_row(table_row: printed.StartRow, coordinate: int, measured: Measured) -> JudgedNumber:
    """A percentage of Table 2: arithmetic, whatever the config."""
    entry, percent = table_row.percent, percent_of(table_row)
    agrees = bool(entry.agreement(percent.of_matlab))
    otherwise = EXPLAINED if entry.agreement(percent.of_adams) else REFUTED
    verdict = REPRODUCED if agrees else otherwise
    text = regardless(measured.departures.contact, prose("evidence.percent", percent, verdict))
    return judged(entry, {}, raised_percent(measured, coordinate), (verdict, text))


def adams_start_row(entry: Printed, coordinate: int, measured: Measured, study: PaperStudy) -> JudgedNumber:
    """A coordinate of the ADAMS start: what it is, whatever the config, and what ours was."""
    start = measured.contact.start
    value = None if start is None else start[coordinate]
    is_angle = coordinate < 2
    text = prose("evidence.adams_start", study, is_angle, measured.contact, velocities_raised(measured))
    otherwise = EXPLAINED if is_angle or study.adams.starts_a_gait else REFUTED
    verdict = REPRODUCED if entry.agreement(value) else otherwise
    return judged(entry, {}, value, (verdict, regardless(measured.departures.contact, text)))


def strides_row(measured: Measured) -> JudgedNumber:
    """Five gait cycles."""
    contact, models = measured.contact, measured.models
    strides = {name: float(model.steps // STEPS_OF_A_STRIDE) for name, model in models.items()}
    done = contact.steps // STEPS_OF_A_STRIDE
    went_on = contact.outcome == "walked"
    text = prose("evidence.strides", contact, done, went_on and done < printed.STRIDES.value)
    otherwise = EXPLAINED if went_on else REFUTED
    return judged(
        printed.STRIDES,
        strides,
        float(done),
        weigh(done >= printed.STRIDES.value, otherwise, measured.departures.contact, text),
    )


def error_row(entry: Printed, measured: Measured, study: PaperStudy, which: str) -> JudgedNumber:
    """The largest error of Fig. 8; that it cannot be so small follows from Table 3 alone, whatever the config."""
    errors = measured.errors
    late = abs(printed.T_LEFT.matlab.value - printed.T_LEFT.adams.value)
    off = study.fastest * late if which == "angle" else study.largest_jump
    ways = {
        "raw": "at the same time",
        "aligned": "at the same phase of each step",
        "between_impacts": "of that outside the impacts",
        "settled": "and on the last stride",
    }
    found = {words: getattr(errors[way], which) for way, words in ways.items() if way in errors}
    text = prose("evidence.error", entry, late, off, measured.equations, found)
    raw, aligned = (max(getattr(errors[way], which)) if way in errors else None for way in ("raw", "aligned"))
    limit = AROUND * entry.value
    otherwise = EXPLAINED if aligned is not None and aligned <= limit else REFUTED
    verdict = REPRODUCED if raw is not None and raw <= limit else otherwise
    text = regardless(measured.departures.contact, text)
    return judged(entry, {}, raw if aligned is None else aligned, (verdict, text))


def step_length_row(measured: Measured) -> JudgedNumber:
    """The step length of section 5."""
    lengths = {name: model.step_length for name, model in measured.models.items()}
    contact = measured.contact.step_length
    found = [*lengths.values(), *([] if contact is None else [contact])]
    text = prose("evidence.step_length", lengths, contact, max(found, default=None))
    agrees = any(printed.STEP_LENGTH.agreement(length) for length in lengths.values())
    return judged(printed.STEP_LENGTH, lengths, contact, weigh(agrees, REFUTED, measured.departures.rigid, text))


def velocity_difference_row(measured: Measured) -> JudgedNumber:
    """The difference of the average velocities: ours in the columns, the paper's own arithmetic in words."""
    contact = measured.contact.table_3.v_com
    found: dict[str, float] = {}
    for name, model in measured.models.items():
        rigid = model.table_3.v_com
        if rigid and contact is not None:
            found[name] = 100.0 * abs(contact - rigid) / abs(rigid)
    sums = speed_difference(
        printed.T_LEFT.matlab.value + printed.T_RIGHT.matlab.value,
        printed.T_LEFT.adams.value + printed.T_RIGHT.adams.value,
    )
    by_cycle = speed_difference(printed.T_CYCLE.matlab.value, printed.T_CYCLE.adams.value)
    text = regardless(measured.departures.contact, prose("evidence.velocity_difference", found, by_cycle, sums))
    agrees = bool(found) and max(found.values()) < printed.VELOCITY_DIFFERENCE.value
    refuted = REFUTED if sums >= printed.VELOCITY_DIFFERENCE.value else EXPLAINED
    verdict = REPRODUCED if agrees else refuted
    return judged(printed.VELOCITY_DIFFERENCE, found, None, (verdict, text))


def columns(entry: printed.ResultRow, measured: Measured) -> tuple[dict[str, float], float | None]:
    """Ours for a row of Table 3: of each set of equations, and of the contact model."""
    found = {name: getattr(model.table_3, entry.name) for name, model in measured.models.items()}
    rigid = {name: value for name, value in found.items() if value is not None}
    return rigid, getattr(measured.contact.table_3, entry.name)


def names_of(entry: printed.ResultRow) -> tuple[str, ...]:
    """The entries that a row's evidence has; of the step periods both, as they have one cause."""
    return ("t_left", "t_right") if entry in (printed.T_LEFT, printed.T_RIGHT) else (entry.name,)


def matlab_row(entry: printed.ResultRow, measured: Measured, study: PaperStudy) -> JudgedNumber:
    """A number of Table 3's MATLAB column against the rigid model."""
    rigid, contact = columns(entry, measured)
    means = {"five": study.five_steps_energy, "ten": study.from_x_p.E_avg} if entry is printed.E_AVG else {}
    taken = [steps for steps, mean in means.items() if printed.E_AVG.matlab.agreement(mean)]
    # an energy that is the mean over another number of steps is explained by the misprint, which does not keep it
    otherwise = EXPLAINED if taken else REFUTED
    text = prose("evidence.matlab", entry, measured, names_of(entry), study, taken)
    agrees = any(entry.matlab.agreement(value) for value in rigid.values())
    return judged(entry.matlab, rigid, contact, weigh(agrees, otherwise, measured.departures.rigid, text))


def adams_row(entry: printed.ResultRow, measured: Measured) -> JudgedNumber:
    """A number of Table 3's ADAMS column against the contact model."""
    rigid, contact = columns(entry, measured)
    text = prose("evidence.adams", entry, measured, names_of(entry))
    otherwise = EXPLAINED if contact is None else REFUTED
    agrees = bool(entry.adams.agreement(contact))
    return judged(entry.adams, rigid, contact, weigh(agrees, otherwise, measured.departures.contact, text))
