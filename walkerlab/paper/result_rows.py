"""Verdicts on what the paper gets out: section 5, Fig. 8 and Table 3."""

from __future__ import annotations

from collections.abc import Iterator

from walkerlab.paper.arithmetic import speed_difference
from walkerlab.paper.measured import Characteristics, LegErrors, Measured
from walkerlab.paper.printed import (
    ANGLE_ERROR,
    E_AVG,
    STEP_LENGTH,
    STRIDES,
    T_CYCLE,
    T_LEFT,
    T_RIGHT,
    TABLE_3,
    V_COM,
    VELOCITY_DIFFERENCE,
    VELOCITY_ERROR,
    Printed,
    ResultRow,
)
from walkerlab.paper.study import PaperStudy
from walkerlab.paper.verdict import Row, Verdict, agreement, regardless, weigh

STEPS_OF_A_STRIDE = 2
AROUND = 2.0  # 'around 1e-4' is up to twice that


def result_rows(measured: Measured, study: PaperStudy) -> Iterator[Row]:
    """All rows, in the paper's order."""
    yield strides_row(measured)
    yield error_row(ANGLE_ERROR, measured, study, "angle")
    yield error_row(VELOCITY_ERROR, measured, study, "velocity")
    yield step_length_row(measured)
    yield velocity_difference_row(measured)
    for entry in TABLE_3:
        yield matlab_row(entry, measured, study)
        yield adams_row(entry, measured)


def strides_row(measured: Measured) -> Row:
    """Five gait cycles."""
    contact, models = measured.contact, measured.models
    strides = {name: float(model.steps // STEPS_OF_A_STRIDE) for name, model in models.items()}
    done = contact.steps // STEPS_OF_A_STRIDE
    text = f"strides that the contact model completed: {done}; steps: {contact.steps} ({contact.outcome})."
    went_on = contact.outcome == "walked"
    if went_on and done < STRIDES.value:
        text += " The config asks for no more."
    otherwise = Verdict.EXPLAINED if went_on else Verdict.REFUTED
    verdict, evidence = weigh(done >= STRIDES.value, otherwise, measured.departures.contact, text)
    return Row(STRIDES, strides.get("as-printed"), strides.get("corrected"), float(done), verdict, evidence)


def error_row(entry: Printed, measured: Measured, study: PaperStudy, which: str) -> Row:
    """The largest error of Fig. 8; that it cannot be so small follows from Table 3 alone, whatever the config."""
    errors = measured.errors
    late = abs(T_LEFT.matlab.value - T_LEFT.adams.value)
    off = study.fastest * late if which == "angle" else study.largest_jump
    text = (
        f"Table 3's step periods differ by {1e3 * late:.0f} ms and more, which alone makes {off:.2g} {entry.unit} at "
        f"the same time. Measured here against the rigid model ({measured.equations} equations): "
    )
    said = [
        (errors.raw, "at the same time"),
        (errors.aligned, "at the same phase of each step"),
        (errors.between_impacts, "of that outside the impacts"),
        (errors.settled, "and on the last stride"),
    ]
    parts = [f"{words} {pair(found, which)}" for found, words in said if found is not None]
    text += f"{'; '.join(parts)} {entry.unit} (legs 1 and 2)." if parts else "nothing to compare."
    raw, aligned = largest(errors.raw, which), largest(errors.aligned, which)
    limit = AROUND * entry.value
    otherwise = Verdict.EXPLAINED if aligned is not None and aligned <= limit else Verdict.REFUTED
    verdict = Verdict.REPRODUCED if raw is not None and raw <= limit else otherwise
    text = regardless(measured.departures.contact, text)
    return Row(entry, None, None, raw if aligned is None else aligned, verdict, text)


def of_legs(errors: LegErrors, which: str) -> tuple[float, ...]:
    """Errors of the legs' angles or velocities."""
    return errors.angle if which == "angle" else errors.velocity


def largest(errors: LegErrors | None, which: str) -> float | None:
    """The larger leg's error."""
    return None if errors is None else max(of_legs(errors, which))


def pair(errors: LegErrors, which: str) -> str:
    """Both legs' errors in words."""
    return " and ".join(f"{value:.2g}" for value in of_legs(errors, which))


def step_length_row(measured: Measured) -> Row:
    """The step length of section 5."""
    lengths = {name: model.step_length for name, model in measured.models.items()}
    said = [f"{name} equations {length:.4f} m" for name, length in lengths.items()]
    contact = measured.contact.step_length
    if contact is not None:
        said.append(f"contact model {contact:.4f} m")
    text = "2 L sin((theta_2 - theta_1)/2): " + ("; ".join(said) or "no model has a step")
    found = [*lengths.values(), *([] if contact is None else [contact])]
    text += f", up to {max(found) / STEP_LENGTH.value:.1f} times the printed length." if found else "."
    agrees = any(agreement(STEP_LENGTH, length) for length in lengths.values())
    verdict, evidence = weigh(agrees, Verdict.REFUTED, measured.departures.rigid, text)
    return Row(STEP_LENGTH, lengths.get("as-printed"), lengths.get("corrected"), contact, verdict, evidence)


def velocity_difference_row(measured: Measured) -> Row:
    """The difference of the average velocities: ours in the columns, the paper's own arithmetic in words."""
    contact = measured.contact.table_3.v_com
    found: dict[str, float] = {}
    for name, model in measured.models.items():
        rigid = model.table_3.v_com
        if rigid and contact is not None:
            found[name] = 100.0 * abs(contact - rigid) / abs(rigid)
    sums = speed_difference(T_LEFT.matlab.value + T_RIGHT.matlab.value, T_LEFT.adams.value + T_RIGHT.adams.value)
    printed = speed_difference(T_CYCLE.matlab.value, T_CYCLE.adams.value)
    said = [f"the contact model is {off:.2f}% off the rigid one ({name} equations)" for name, off in found.items()]
    said.append(f"the paper's {printed:.1f}% takes its cycles; the sums of its own step periods give {sums:.1f}%")
    text = regardless(measured.departures.contact, "; ".join(said) + ".")
    agrees = bool(found) and max(found.values()) < VELOCITY_DIFFERENCE.value
    refuted = Verdict.REFUTED if sums >= VELOCITY_DIFFERENCE.value else Verdict.EXPLAINED
    verdict = Verdict.REPRODUCED if agrees else refuted
    return Row(VELOCITY_DIFFERENCE, found.get("as-printed"), found.get("corrected"), None, verdict, text)


def of_row(table: Characteristics, name: str) -> float | None:
    """The entry of a row of Table 3."""
    value: float | None = getattr(table, name)
    return value


def columns(entry: ResultRow, measured: Measured) -> tuple[dict[str, float], float | None]:
    """Ours for a row of Table 3: of each set of equations, and of the contact model."""
    found = {name: of_row(model.table_3, entry.name) for name, model in measured.models.items()}
    rigid = {name: value for name, value in found.items() if value is not None}
    return rigid, of_row(measured.contact.table_3, entry.name)


def rigid_in_words(entry: ResultRow, measured: Measured) -> str:
    """What the rigid model has for a row of Table 3; of the step periods both, as they have one cause."""
    names = ("t_left", "t_right") if entry in STEP_PERIODS else (entry.name,)
    said = [f"{name} equations {values(model.table_3, names)}" for name, model in measured.models.items()]
    return f"{'; '.join(said) or 'no gait'} ({entry.matlab.unit})"


def contact_in_words(entry: ResultRow, measured: Measured) -> str:
    """What the contact model has for a row of Table 3."""
    names = ("t_left", "t_right") if entry in STEP_PERIODS else (entry.name,)
    return f"contact model {values(measured.contact.table_3, names)} ({entry.adams.unit}, {measured.contact.outcome})"


def values(table: Characteristics, names: tuple[str, ...]) -> str:
    """Entries of Table 3 in words."""
    found = [of_row(table, name) for name in names]
    return " and ".join("none" if value is None else f"{value:.5g}" for value in found)


STEP_PERIODS = (T_LEFT, T_RIGHT)
REASONS = {
    T_LEFT: "x_p is a fixed point of one step, so all steps are equal",
    T_RIGHT: "x_p is a fixed point of one step, so all steps are equal",
    T_CYCLE: "sum of two equal steps",
    V_COM: "length of the stride over t_cycle; the paper divides its length of one step by the time of two",
    E_AVG: "time mean from the current stance foot",
}


def matlab_row(entry: ResultRow, measured: Measured, study: PaperStudy) -> Row:
    """A number of Table 3's MATLAB column against the rigid model."""
    rigid, contact = columns(entry, measured)
    text = f"{REASONS[entry]}: {rigid_in_words(entry, measured)}."
    otherwise = Verdict.REFUTED
    if entry is E_AVG:
        otherwise, more = energy_of_the_misprint(study)
        text += more
    agrees = any(agreement(entry.matlab, value) for value in rigid.values())
    verdict, evidence = weigh(agrees, otherwise, measured.departures.rigid, text)
    return Row(entry.matlab, rigid.get("as-printed"), rigid.get("corrected"), contact, verdict, evidence)


def energy_of_the_misprint(study: PaperStudy) -> tuple[Verdict, str]:
    """Whether the energy that the equations as printed do not keep explains the printed one."""
    model, means = study.as_printed, {"five": study.five_steps_energy, "ten": study.from_x_p.E_avg}
    taken = [steps for steps, mean in means.items() if agreement(E_AVG.matlab, mean)]
    text = (
        f" On the paper's slope the equations as printed do not keep it: on the gait it moves between "
        f"{model.energy_least:.3f} and {model.energy_most:.3f} J. From x_p with its printed digits its mean is "
        f"{means['five']:.3f} J over five steps and {means['ten']:.3f} J over ten; "
    )
    if taken:
        return Verdict.EXPLAINED, f"{text}Table 3 says '5 steps', its number is that of {' and '.join(taken)}."
    return Verdict.REFUTED, f"{text}neither is the printed number."


def adams_row(entry: ResultRow, measured: Measured) -> Row:
    """A number of Table 3's ADAMS column against the contact model."""
    rigid, contact = columns(entry, measured)
    text = f"{contact_in_words(entry, measured)}; {rigid_in_words(entry, measured)}."
    otherwise = Verdict.EXPLAINED if contact is None else Verdict.REFUTED
    if entry in (*STEP_PERIODS, T_CYCLE):
        total = T_LEFT.adams.value + T_RIGHT.adams.value
        text += f" The column contradicts itself: its step periods sum to {total:.2f}, not {T_CYCLE.adams.text} s."
    if entry is V_COM:
        text += f" The printed speed is {STEP_LENGTH.text} m, one step, over {T_CYCLE.adams.text} s, two steps."
    if entry is E_AVG:
        otherwise, more = contact_energy(entry.adams.value, measured)
        text += more
    agrees = bool(agreement(entry.adams, contact))
    verdict, evidence = weigh(agrees, otherwise, measured.departures.contact, text)
    return Row(entry.adams, rigid.get("as-printed"), rigid.get("corrected"), contact, verdict, evidence)


def contact_energy(value: float, measured: Measured) -> tuple[Verdict, str]:
    """How far the contact model's mean energy is from a printed one (J)."""
    contact, mean = measured.contact, measured.contact.table_3.E_avg
    if mean is None or contact.energy_least is None or contact.energy_most is None:
        return Verdict.EXPLAINED, " The contact model's energy was not stored."
    text = (
        f" The contact model's mean is {mean - value:+.3f} J off the printed one; its samples lie between "
        f"{contact.energy_least:.3f} and {contact.energy_most:.3f} J, which tells nothing about a mean."
    )
    return Verdict.REFUTED, text
