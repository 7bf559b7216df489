"""Stage `compare`: compare both models with each other and, for the paper's walker, with every number in the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from walkerlab.config.reads import CompareConfig
from walkerlab.evidence.paper.compared_releases import LOCK_OMISSION, compare_releases
from walkerlab.evidence.paper.departures import departures
from walkerlab.evidence.paper.differences import (
    STEPS_PER_STRIDE,
    Comparison,
    compare_motion,
    motion_of,
    stored_variable,
)
from walkerlab.evidence.paper.errata import Erratum, errata
from walkerlab.evidence.paper.law import is_own_walker
from walkerlab.evidence.paper.measured import (
    EQUATION_SETS,
    PAPER_CYCLES,
    ContactMeasurements,
    Measured,
    RigidMeasurements,
    measure_rigid_model,
)
from walkerlab.evidence.paper.printed import fixed_point_as_printed
from walkerlab.evidence.paper.recorded import characteristics_of, compare_recorded, stored_energy
from walkerlab.evidence.paper.rows import VERDICTS, count_verdicts, paper_rows, table_1, table_2, table_3
from walkerlab.evidence.paper.study import study_the_paper
from walkerlab.evidence.paper.walker import compass
from walkerlab.labels import labels_of
from walkerlab.physics.hybrid.recorded_walk import as_state
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.walk import last_step, mean_step
from walkerlab.pipeline.store.content import Content, Group, Variable, numbered, rows_group
from walkerlab.scene.contact import GAIT_TOLERANCES, contact_scene, require_contact, start_state
from walkerlab.scene.rigid import have_different_legs

START_TOLERANCE = 1e-6  # rad and rad/s; a start farther than this from the fixed point counts as moved
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
"""Long names of the columns in the paper's numbers and tables."""


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
    omissions = [*summary.pop("left_out"), *motion.left_out]
    return Content(
        {**groups, **motion.groups, **recorded_groups}, {**summary, **shared, **recorded, "left_out": omissions}
    )


def compare_with_paper(
    config: CompareConfig, inputs: Mapping[str, Content], motion: Comparison, progress: Progress
) -> tuple[dict[str, Group], dict[str, Any]]:
    """Compare both models with the paper's numbers, tables and errata, and return groups and summary."""
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
    """Summarise the walks of both models and, for kneed walkers, the walks with each knee release."""
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
    """Make the measurements that are compared with the paper's numbers."""
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
    """Measure the contact model's counterparts of the paper's ADAMS numbers."""
    summary = walk.summary
    pitch = float(walk.summary["pitch_m"])
    lengths = np.array(summary["step_lengths_m"])
    stride = STEPS_PER_STRIDE * (lengths.size // STEPS_PER_STRIDE)
    angle = stored_variable(walk, "trajectory", "angle")
    # walk from the printed x_p, with the swing angle that puts both feet on the config's slope
    _, theta_2, omega_1, omega_2 = fixed_point_as_printed()
    scene = contact_scene(config, pitch, pitch)
    start = start_state(scene, (-2.0 * config.slope_rad - theta_2, theta_2, omega_1, omega_2))
    from_x_p = scene.walk(start, 2 * PAPER_CYCLES, GAIT_TOLERANCES)
    return ContactMeasurements(
        law=require_contact(config),
        foot_radius=config.walker.foot_radius_m,
        summary=summary,
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

    The column of a model has only the rows with a value, which its coordinate lists. Text columns have all rows.

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
            rows_with_value = [row for row, value in enumerate(values) if value is not None]
            if rows_with_value:
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
