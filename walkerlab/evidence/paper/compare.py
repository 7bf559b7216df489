"""Stage `compare`: compare both models with each other and, for the paper's walker, with every number in the paper."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from walkerlab.config.reads import CompareConfig, ContactConfig
from walkerlab.evidence.paper.appendix_a import compass
from walkerlab.evidence.paper.law import is_own_walker
from walkerlab.evidence.paper.measured import (
    EQUATION_SETS,
    PAPER_CYCLES,
    Characteristics,
    ContactMeasurements,
    EnergyRecord,
    Errors,
    Measured,
    RigidMeasurements,
    characteristics,
    departures,
    mean_over_last_steps,
    measure_rigid_model,
)
from walkerlab.evidence.paper.printed import fixed_point_as_printed
from walkerlab.evidence.paper.rows import VERDICTS, count_verdicts, paper_rows, table_1, table_2, table_3
from walkerlab.evidence.paper.study import Erratum, errata, study_the_paper
from walkerlab.labels import labels_of
from walkerlab.physics.ground.walker import changed_forms
from walkerlab.physics.hybrid import comparison
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, losses_by_channel
from walkerlab.physics.hybrid.recorded_walk import as_state, take_walk
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import State
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.walk import (
    LEG,
    STEP,
    TIME,
    last_step,
    leg_labels,
    mean_step,
    summarise_walk,
    variables_over_time,
)
from walkerlab.pipeline.store.content import Content, Group, Variable, numbered, rows_group
from walkerlab.scene.contact import GAIT_TOLERANCES, ContactScene, contact_scene, require_contact, start_state
from walkerlab.scene.omissions import omission
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import add_drives, have_different_legs

STEPS_PER_STRIDE = 2
ALIGNMENTS = ("raw", "aligned", "between_impacts", "settled")
QUANTITY_KEYS: dict[str, comparison.Quantity] = {"max_angle_error_rad": "angle", "max_velocity_error_rad_s": "velocity"}
PHASE = "phase"


def stored_variable(walk: Content, group: str, name: str) -> comparison.Array | None:
    variables = walk.groups.get(group, Group({}))
    return variables[name] if name in variables.variables else None


def times_of_steps(walk: Content, name: str) -> comparison.Array:
    """Return the times (s) of the steps of a walk. The array is empty if they were not stored."""
    times = stored_variable(walk, "steps", name)
    return np.zeros(0) if times is None else times


def motion_of(walk: Content) -> comparison.Motion | None:
    """Return the motion of the legs in a stored walk.

    Return None if states were not stored or the walk ended immediately.
    """
    angle = stored_variable(walk, "trajectory", "angle")
    if angle is None or len(angle) < 2:
        return None
    trajectory = walk["trajectory"]
    strikes = times_of_steps(walk, "knee_strike_time_s")
    touches = times_of_steps(walk, "touch_time_s")
    # If a knee did not lock, its time is NaN. The comparison drops it, because NaN is not above 0.
    motion = comparison.Motion(trajectory["time"], angle, trajectory["velocity"], touches, strikes[strikes > 0.0])
    return comparison.add_strike_samples(motion)


@dataclass(frozen=True)
class Comparison:
    """Difference between the walks of both models."""

    errors: Errors  # differences by alignment, without alignments that cannot be compared
    orbit: list[float] | None = None  # distance between the two orbits, by leg, or None if no stride was completed
    groups: Mapping[str, Group] = field(default_factory=dict)
    left_out: tuple[dict[str, str], ...] = ()  # omitted comparisons, with reasons

    @property
    def summary(self) -> dict[str, Any]:
        """Largest errors of both legs by alignment, or None for an alignment that could not be compared."""
        errors: dict[str, Any] = {}
        for name, quantity in QUANTITY_KEYS.items():
            per_leg = {way: self.errors[way].largest(quantity) if way in self.errors else None for way in ALIGNMENTS}
            errors[name] = {way: max(both) if both else None for way, both in per_leg.items()} | {"per_leg": per_leg}
        orbit = None if self.orbit is None else max(self.orbit)
        return {**errors, "orbit_distance": orbit, "orbit_distance_per_leg": self.orbit}


def compare_motion(
    rigid: comparison.Motion | None, contact: comparison.Motion | None, meaning: str = "contact less rigid model"
) -> Comparison:
    """Compare two walks at equal times, at equal phases and as orbits. `meaning` describes the difference in words."""
    if rigid is None or contact is None:
        why = "states of both walks are not available: outputs omits them, or a walk ended immediately"
        return Comparison({}, left_out=({"what": "differences of the walks", "why": why},))
    steps = min(rigid.steps, contact.steps)
    orbit = None
    time, raw = comparison.difference_in_time(contact, rigid)
    errors = {"raw": raw}
    in_time = differences("raw", raw, (TIME, LEG), f"{meaning}, at the same time")
    groups = {"errors": Group({**variables_over_time(time=time), **leg_labels(), **in_time})}
    missing = ("differences in phase and between the orbits", "step")
    if steps:
        missing = ("differences of the last stride and between the orbits", "stride")
        phases = np.linspace(0.0, 1.0, comparison.PHASES)
        aligned = comparison.difference_in_phase(contact, rigid, phases)
        smooth = comparison.smooth_phases(contact, rigid, phases)
        errors |= {"aligned": aligned, "between_impacts": select(aligned, smooth)}
        coordinates = {
            **numbered(len(aligned.angle), STEP, "step number"),
            PHASE: Variable(phases, (PHASE,), "1", "time within the step as a fraction of its period"),
            **leg_labels(),
        }
        in_phase = differences("aligned", aligned, (STEP, PHASE, LEG), f"{meaning}, at the same phase")
        groups["aligned"] = Group({**coordinates, **in_phase}, {"impact_phase": comparison.IMPACT_PHASE})
        if steps >= STEPS_PER_STRIDE:
            last = slice(-STEPS_PER_STRIDE, None)
            errors["settled"] = select(select(aligned, last), smooth[last])
            text = "Hausdorff distance of the last stride's orbits, angle and velocity in units of the rigid orbit's "
            distances = Variable(comparison.orbit_distances(contact, rigid), (LEG,), "1", f"{text}ranges")
            groups["orbit"] = Group({**leg_labels(), "orbit_distance": distances})
            orbit = distances.values.tolist()
    what, needed = missing
    lacking = {"what": what, "why": f"no {needed} was completed by both models"}
    return Comparison(errors, orbit, groups, () if steps >= STEPS_PER_STRIDE else (lacking,))


def select(difference: comparison.WalkDifference, where: Any) -> comparison.WalkDifference:
    return comparison.WalkDifference(difference.angle[where], difference.velocity[where])


def differences(
    way: str, difference: comparison.WalkDifference, dims: tuple[str, ...], meaning: str
) -> dict[str, Variable]:
    """Return differences of angles and velocities as variables to store.

    way  name of the alignment, as in `ALIGNMENTS`
    """
    return {
        f"{way}_angle_error_rad": Variable(difference.angle, dims, "rad", f"angle, {meaning}"),
        f"{way}_velocity_error_rad_s": Variable(difference.velocity, dims, "rad/s", f"velocity, {meaning}"),
    }


MODELS = {"rigid": "simulate", "contact": "contact-sim"}


def compare_recorded(inputs: Mapping[str, Content]) -> tuple[dict[str, Group], dict[str, Any]]:
    """Compare the recorded walk with both models. Return groups and summary, which are empty without a recording."""
    if (recorded := inputs.get("recorded-walk")) is None:
        return {}, {}
    motion = motion_of(recorded)
    compared: dict[str, Comparison] = {
        model: compare_motion(motion_of(inputs[stage]), motion, f"recorded walk less {model} model")
        for model, stage in MODELS.items()
    }
    groups = {
        f"recorded/{model}/{name}": group for model, each in compared.items() for name, group in each.groups.items()
    }
    walks = {**{model: inputs[stage] for model, stage in MODELS.items()}, "recorded": recorded}
    summary = {
        "name": recorded.summary["name"],
        "doubts": recorded.summary["doubts"],
        "steps": {model: last_step(walk.summary) for model, walk in walks.items()},
        "table3": {model: asdict(characteristics_of(walk)) for model, walk in walks.items()},
        "differences": {model: each.summary for model, each in compared.items()},
    }
    return groups, {"recorded": summary}


def characteristics_of(walk: Content) -> Characteristics:
    """Return the quantities of Table 3 for a stored walk. The mean energy is None if energies were not stored."""
    periods, lengths = (np.array(walk.summary[key]) for key in ("step_periods_s", "step_lengths_m"))
    energy = stored_energy(walk)
    return characteristics(periods, lengths, None if energy is None else energy.mean)


def stored_energy(walk: Content) -> EnergyRecord | None:
    """Return the energy of a stored walk over its last steps, or None if energies were not stored."""
    if (joules := stored_variable(walk, "trajectory", "mechanical_J")) is None:
        return None
    return mean_over_last_steps(walk["trajectory"]["time"], joules, times_of_steps(walk, "touch_time_s"))


RELEASES = {"compression": False, "touch": True}
"""Values of the key `release`, and whether each of them releases the knee when the leading foot first touches."""
CONTACT_STEPS = 20  # enough to settle on another gait, or to fall
RIGID_STEPS = 200
RIGID_TOLERANCES = Tolerances("dop853", 1e-8, 1e-10, 2_000_000)
CONTACT_TOLERANCES = Tolerances("radau5", 1e-8, 1e-10, 2_000_000)
LOCK_OMISSION = omission(
    "ideal against compliant lock",
    "a walk has one lock; try the other by `walkerlab contact-sim --set walker.knee.lock=compliant`",
    "compiling the contact walk a second time",
)


def compare_releases(config: ContactConfig, state: State, pitch_m: float) -> dict[str, Any] | None:
    """Simulate up to 20 steps from a gait for each moment at which the trailing knee may be released.

    Each walk is compared with the corresponding rigid model: its knee is locked during the impact if it is released
    during compression, and free if it is released at first touch.

    state    gait of the rigid model
    pitch_m  pitch of the pads

    Returns None for walkers without knees, with a push-off or with legs that differ.
    """
    scene = contact_scene(config, pitch_m, pitch_m)
    if not scene.walker.kneed or config.push_off.impulse_N_s != 0.0 or have_different_legs(config):
        return None
    releases = {}
    for name, at_touch in RELEASES.items():
        released = replace(scene, walker=changed_forms(scene.walker, release_at_touch=at_touch))
        walk = released.walk(start_state(scene, state), CONTACT_STEPS, CONTACT_TOLERANCES)
        parts = assembly_of(config.walker, rigid=True)
        model = rigid_on_slope(parts, config.gravity_m_s2, config.slope_rad, not at_touch)
        rigid = take_walk(add_drives(model, config), RIGID_TOLERANCES, state, RIGID_STEPS)
        last = {"period_s": float(rigid.periods_s[-1]), "length_m": float(rigid.lengths_m[-1])} if rigid.steps else {}
        of_rigid = {"outcome": rigid.outcome.label, "steps": rigid.steps, "of": RIGID_STEPS, **last}
        releases[name] = {**walk_report(scene, walk), "rigid": of_rigid}
    return releases


def walk_report(scene: ContactScene, walk: ContactWalkResult) -> dict[str, Any]:
    """Summarise a walk: its outcome, its last step, and the energy dissipated per step by channel."""
    steps = walk.steps
    lost = losses_by_channel(scene.walker, walk.dissipated_J)
    return {
        "outcome": walk.outcome.label,
        "steps": steps,
        "of": CONTACT_STEPS,
        "knee_strike_s": None,
        **last_step(summarise_walk(walk)),
        "dissipated_J_per_step": {name: joules / steps for name, joules in lost.items()} if steps else None,
    }


START_TOLERANCE = 1e-6  # rad and rad/s, distance from the fixed point above which a start counts as moved
PAPER_OMISSION = {
    "what": "the paper's numbers, tables and errata",
    "why": "they apply only to the paper's walker on even ground",
}
ROW = "row"
MODEL_NAMES = {
    "as_printed": "rigid model, equations as printed",
    "corrected": "rigid model, corrected equations",
    "contact": "contact model",
}
COLUMN_NAMES = {
    **MODEL_NAMES,
    "quantity": "quantity",
    "unit": "unit of the row's values",
    "where": "location in the paper",
    "paper": "in the paper",
    "used": "value used here",
    "paper_matlab": "the paper's MATLAB model",
    "paper_adams": "the paper's MSC ADAMS model",
    "paper_percent": "difference rate as printed",
    "paper_matlab_text": "the paper's MATLAB model, as text",
    "paper_adams_text": "the paper's MSC ADAMS model, as text",
    "paper_percent_text": "difference rate, as text",
    "percent_of_matlab": "difference in percent of the MATLAB value",
    "percent_of_adams": "difference in percent of the ADAMS value",
    "printed": "as printed",
    "verdict": ", ".join(VERDICTS),
    "evidence": "evidence",
}
"""Long names of the columns, for the tables of the paper and for the table of all its numbers."""


def run(config: CompareConfig, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Compare the walks of both models and, if walker and ground are the paper's, both models with the paper."""
    papers = is_own_walker(config) and config.ground.even
    progress.start("compare", 3 if papers else 2)
    motion = compare_motion(motion_of(inputs["simulate"]), motion_of(inputs["contact-sim"]))
    walks = {"rigid": inputs["simulate"].summary, "contact": inputs["contact-sim"].summary}
    errors = {model: walk["numerical_error"] for model, walk in walks.items() if "numerical_error" in walk}
    shared = motion.summary | ({"numerical_error": errors} if errors else {})
    progress.advance()
    if papers:
        groups, summary = compare_with_paper(config, inputs, motion, progress)
    else:
        groups = {}
        summary = summarise_models(config, inputs)
    progress.advance()
    recorded_groups, recorded = compare_recorded(inputs)
    for symbol, row in summary.get("table3", {}).items() if recorded else ():
        row["recorded"] = recorded["recorded"]["table3"]["recorded"][symbol]
    summary |= shared | recorded | {"left_out": [*summary.pop("left_out"), *motion.left_out]}
    return Content({**groups, **motion.groups, **recorded_groups}, summary)


def compare_with_paper(
    config: CompareConfig, inputs: Mapping[str, Content], motion: Comparison, progress: Progress
) -> tuple[dict[str, Group], dict[str, Any]]:
    """Compare both models with the numbers and tables of the paper, list its errata, and return groups and summary."""
    study = study_the_paper()
    progress.advance()
    measured = measure(config, inputs, motion)
    judged_rows = tuple(paper_rows(measured, study))
    paper_errata = errata(study)
    rows = [each.row for each in judged_rows]
    tables = {"table1": table_1(measured, study), "table2": table_2(measured), "table3": table_3(measured)}
    groups = {name: numbers_group(list(table.values()), table) for name, table in tables.items()}
    groups |= {"paper_numbers": numbers_group(rows), "errata": rows_group(paper_errata, labels_of(Erratum))}
    return groups, {
        "paper_numbers": rows,
        "verdicts": count_verdicts(judged_rows),
        **tables,
        "errata": [vars(erratum) for erratum in paper_errata],
        "departures": list(measured.departures.contact),
        "left_out": list_omissions(inputs, measured),
    }


def summarise_models(config: CompareConfig, inputs: Mapping[str, Content]) -> dict[str, Any]:
    """Summarise the walks of both models and, for kneed walkers, the walks with each moment of knee release."""
    gait, rigid, contact = (inputs[name].summary for name in ("fixedpoint", "simulate", "contact-sim"))
    releases = compare_releases(config, as_state(gait["state"]), float(contact["pitch_m"]))
    step_of = mean_step if have_different_legs(config) else last_step
    return {
        "steps": {
            "rigid": step_of(rigid),
            "contact": {**step_of(contact), "slip_m": contact["slip_per_step_m"]},
            "gait": {
                "period_s": gait.get("period_s"),
                "length_m": gait.get("step_length_m"),
                **({"knee_strike_s": gait["knee_strike_s"]} if "knee_strike_s" in gait else {}),
            },
        },
        "outcomes": {"rigid": rigid["outcome"], "contact": contact["outcome"]},
        "dissipated_J": contact["dissipated_J"],
        "departures": list(departures(config, start_moved=False).contact),
        **({} if releases is None else {"releases": releases}),
        "left_out": [PAPER_OMISSION, *([] if releases is None else [LOCK_OMISSION])],
    }


def measure(config: CompareConfig, inputs: Mapping[str, Content], motion: Comparison) -> Measured:
    """Compute the values to compare with the numbers in the paper."""
    sets = inputs["fixedpoint"].summary["equation_sets"]
    gaits = {name: sets[name] for name in EQUATION_SETS if "state" in sets.get(name, {})}
    models: dict[str, RigidMeasurements] = {
        name: measure_rigid_model(compass(config, name), as_state(gait["state"])) for name, gait in gaits.items()
    }
    contact = measure_contact_model(config, inputs["contact-sim"])
    model = models.get(config.equations)
    start_moved = contact.start is not None and (
        model is None or bool(np.abs(np.subtract(contact.start, model.state)).max() > START_TOLERANCE)
    )
    return Measured(
        walker=compass(config, config.equations),
        equations=config.equations,
        models=models,
        spectral_radii={name: float(gait["spectral_radius"]) for name, gait in gaits.items()},
        contact=contact,
        errors=motion.errors,
        departures=departures(config, start_moved),
    )


def measure_contact_model(config: CompareConfig, walk: Content) -> ContactMeasurements:
    """Measure the values of the contact model that correspond to the ADAMS numbers of the paper."""
    pitch = float(walk.summary["pitch_m"])
    lengths = np.array(walk.summary["step_lengths_m"])
    stride = STEPS_PER_STRIDE * (lengths.size // STEPS_PER_STRIDE)
    angle = stored_variable(walk, "trajectory", "angle")
    # Start from the printed x_p, but with the swing angle that puts both feet on the slope of the config.
    _, theta_2, omega_1, omega_2 = fixed_point_as_printed()
    scene = contact_scene(config, pitch, pitch)
    start = start_state(scene, (-2.0 * config.slope_rad - theta_2, theta_2, omega_1, omega_2))
    from_x_p = scene.walk(start, 2 * PAPER_CYCLES, GAIT_TOLERANCES)
    return ContactMeasurements(
        law=require_contact(config),
        foot_radius=config.walker.foot_radius_m,
        summary=walk.summary,
        # Leg 0 swings first, as in the rigid model's state.
        start=None if angle is None else as_state([*angle[0], *walk["trajectory"]["velocity"][0]]),
        table_3=characteristics_of(walk),
        step_length=float(lengths[stride - STEPS_PER_STRIDE : stride].mean()) if stride else None,
        energy=stored_energy(walk),
        from_x_p=(from_x_p.steps, from_x_p.outcome.label),
    )


def list_omissions(inputs: Mapping[str, Content], measured: Measured) -> list[dict[str, str]]:
    """List the comparisons with the paper that could not be made, with reasons."""
    sets = inputs["fixedpoint"].summary["equation_sets"]
    missing = [
        {"what": f"columns of the {name} equations", "why": str(sets.get(name, {}).get("reason", "no gait was found"))}
        for name in EQUATION_SETS
        if name not in measured.models
    ]
    contact = measured.contact
    if contact.table_3.t_cycle is None:
        why = f"a stride takes two steps, but the walk ended after {contact.steps} ({contact.outcome})"
        missing.append({"what": "a stride of the contact model in Table 3", "why": why})
    if contact.table_3.E_avg is None:
        why = "no step was completed" if contact.steps == 0 else "outputs omits energies"
        missing.append({"what": "energy of the contact model", "why": why})
    return missing


def numbers_group(rows: Sequence[Mapping[str, Any]], names: Sequence[str] | Mapping[str, Any] = ()) -> Group:
    """Build a group with the numbers of the paper and of the models.

    Text columns have every row. A model's column holds only its values, with their row indices as its coordinate.

    names  symbols of the rows, if they have any
    """
    unit = "see the column of units"
    variables = numbered(len(rows), ROW, "row")
    if names:
        variables["name"] = texts(list(names), "symbol of the row")
    for name in rows[0]:
        values = [row[name] for row in rows]
        meaning = COLUMN_NAMES[name]
        if name in MODEL_NAMES:
            variables[f"{name}_text"] = texts(["" if x is None else f"{x:.10g}" for x in values], f"{meaning}, as text")
            if rows_with_value := [row for row, value in enumerate(values) if value is not None]:
                dim = f"{name}_{ROW}"
                text = f"indices of the rows that have a value: {meaning}"
                variables[dim] = Variable(np.array(rows_with_value), (dim,), "1", text)
                numbers = np.array([values[row] for row in rows_with_value], float)
                variables[name] = Variable(numbers, (dim,), unit, meaning)
        elif isinstance(values[0], str):
            variables[name] = texts(values, meaning)
        else:
            variables[name] = Variable(np.array(values, dtype=float), (ROW,), unit, meaning)
    return Group(variables)


def texts(values: Sequence[str], long_name: str) -> Variable:
    return Variable(np.array(values, dtype=object), (ROW,), "", long_name)
