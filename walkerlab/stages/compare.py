"""Both models compared with each other and, if the walker is the paper's, with every number that it prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from walkerlab.config.reads import ContactConfig
from walkerlab.config.schema import Equations
from walkerlab.config.walkers import is_the_papers
from walkerlab.hybrid.comparison import Array, Motion, sampled_at_strikes
from walkerlab.hybrid.contact_run import ContactWalkResult
from walkerlab.hybrid.recorded_walk import as_state
from walkerlab.labels import labels_of
from walkerlab.paper.departures import departures
from walkerlab.paper.errata import Erratum, errata
from walkerlab.paper.measured import (
    CYCLES,
    ContactModel,
    EnergyRecord,
    Measured,
    RigidModel,
    characteristics,
    over_last_steps,
    rigid_model,
)
from walkerlab.paper.printed import fixed_point_as_printed
from walkerlab.paper.rows import NumberVerdict, paper_rows
from walkerlab.paper.study import study_the_paper
from walkerlab.paper.tables import table_1, table_2, table_3
from walkerlab.scene.contact import GAIT, contact_scene, start_state
from walkerlab.scene.rigid import compass
from walkerlab.solvers.system import State
from walkerlab.stages.compared_motion import Comparison, compare_motion
from walkerlab.stages.compared_releases import LEFT_OUT, KneedStart, compare_releases
from walkerlab.stages.compared_tables import numbers_group, table_group
from walkerlab.stages.progress import Progress
from walkerlab.store.columns import rows_group
from walkerlab.store.content import Content, Group

STEPS_OF_A_STRIDE = 2
SAMPLES_OF_A_MOTION = 2
MOVED = 1e-6  # rad and rad/s: a start this far from the fixed point is another one
EQUATION_SETS: tuple[Equations, ...] = ("as-printed", "corrected")


def run(config: ContactConfig, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Compare the walks of both models and, if the walker is the paper's, hold both against the paper."""
    if not is_the_papers(config.walker):
        return models_compared(config, inputs, progress)
    progress.start("compare", 3)
    study = study_the_paper()
    progress.advance()
    motion = compare_motion(motion_of(inputs["simulate"]), motion_of(inputs["contact-sim"]))
    progress.advance()
    measured = measure(config, inputs, motion)
    rows = tuple(paper_rows(measured, study))
    progress.advance()
    found = errata(study)
    tables = {"table1": table_1(measured, study), "table2": table_2(measured), "table3": table_3(measured)}
    groups = {name: table_group(table) for name, table in tables.items()}
    numbers, stored = [row.summary for row in rows], rows_group(found, labels_of(Erratum))
    return Content(
        {"paper_numbers": numbers_group(numbers), "errata": stored, **groups, **motion.groups},
        {
            "paper_numbers": numbers,
            "verdicts": {verdict.value: [row.verdict for row in rows].count(verdict) for verdict in NumberVerdict},
            **tables,
            **motion.summary,
            "errata": [vars(erratum) for erratum in found],
            "departures": list(measured.departures.contact),
            **errors_of(inputs),
            "left_out": left_out(inputs, measured, motion),
        },
    )


def models_compared(config: ContactConfig, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """The walks of both models against each other alone, and of a walker with knees both instants of their release."""
    progress.start("compare", 2)
    motion = compare_motion(motion_of(inputs["simulate"]), motion_of(inputs["contact-sim"]))
    gait, rigid, contact = (inputs[name].summary for name in ("fixedpoint", "simulate", "contact-sim"))
    progress.advance()
    releases = compare_releases(config, KneedStart(as_state(gait["state"]), float(contact["pitch_m"])))
    summary = {
        "steps": {
            "rigid": last_step(rigid),
            "contact": {**last_step(contact), "slip_m": contact["slip_per_step_m"]},
            "gait": {
                "period_s": gait.get("period_s"),
                "length_m": gait.get("step_length_m"),
                **({"knee_strike_s": gait["knee_strike_s"]} if "knee_strike_s" in gait else {}),
            },
        },
        "outcomes": {"rigid": rigid["outcome"], "contact": contact["outcome"]},
        **errors_of(inputs),
        "dissipated_J": contact["dissipated_J"],
        "departures": list(departures(config, start_moved=False).contact),
        **({} if releases is None else {"releases": releases}),
    }
    left_out = [NOT_THE_PAPERS, *motion.left_out, *(() if releases is None else LEFT_OUT)]
    progress.advance()
    return Content(dict(motion.groups), {**summary, **motion.summary, "left_out": left_out})


def errors_of(inputs: Mapping[str, Content]) -> dict[str, Any]:
    """The numerical errors of the walks that are compared, by model, of those that have one."""
    walks = {"rigid": inputs["simulate"].summary, "contact": inputs["contact-sim"].summary}
    found = {model: walk["numerical_error"] for model, walk in walks.items() if "numerical_error" in walk}
    return {"numerical_error": found} if found else {}


NOT_THE_PAPERS = {"what": "the paper's numbers, tables and errata", "why": "they are of the paper's own walker"}


def last_step(walk: Mapping[str, Any]) -> dict[str, Any]:
    """Period (s) and length (m) of a walk's last step and how long into it a knee locked (s); None if it took none."""
    periods, lengths, strikes = walk["step_periods_s"], walk["step_lengths_m"], walk.get("knee_strike_times_s")
    step = {"period_s": periods[-1] if periods else None, "length_m": lengths[-1] if lengths else None}
    if not strikes:
        return step
    begun = walk["touch_times_s"][-2] if len(strikes) > 1 else 0.0
    return {**step, "knee_strike_s": None if strikes[-1] is None else strikes[-1] - begun}


def motion_of(walk: Content) -> Motion | None:
    """The legs of a stored walk in time; None if states were not stored, or the walk ended at once."""
    trajectory = walk.groups.get("trajectory")
    if trajectory is None or "angle" not in trajectory.variables or trajectory["time"].size < SAMPLES_OF_A_MOTION:
        return None
    strikes = times_of_steps(walk, "knee_strike_time_s")
    motion = Motion(
        trajectory["time"],
        trajectory["angle"],
        trajectory["velocity"],
        times_of_steps(walk, "touch_time_s"),
        strikes[strikes > 0.0],
    )
    return sampled_at_strikes(motion)


def times_of_steps(walk: Content, name: str) -> Array:
    """Times (s) that a stored walk has of its steps; none of a walk without a step, and of what the walker has not."""
    steps = walk.groups.get("steps", Group({}))
    return steps[name] if name in steps.variables else np.zeros(0)


def measure(config: ContactConfig, inputs: Mapping[str, Content], motion: Comparison) -> Measured:
    """Everything that the paper's numbers are held against."""
    sets = inputs["fixedpoint"].summary["equation_sets"]
    found = {name: sets[name] for name in EQUATION_SETS if "state" in sets.get(name, {})}
    models: dict[str, RigidModel] = {
        name: rigid_model(compass(config, name), as_state(gait["state"])) for name, gait in found.items()
    }
    contact = contact_model(config, inputs["contact-sim"])
    return Measured(
        walker=compass(config, config.equations),
        equations=config.equations,
        models=models,
        spectral_radii={name: float(gait["spectral_radius"]) for name, gait in found.items()},
        contact=contact,
        errors=motion.errors,
        departures=departures(config, start_moved(models.get(config.equations), contact.start)),
    )


def start_moved(model: RigidModel | None, start: State | None) -> bool:
    """Whether a walk is known to have started elsewhere than at the gait's fixed point."""
    if start is None:
        return False
    return model is None or max(abs(x - y) for x, y in zip(start, model.state, strict=True)) > MOVED


def contact_model(config: ContactConfig, walk: Content) -> ContactModel:
    """What is held against the paper's ADAMS model."""
    contact = config.contact
    if contact is None:
        raise ValueError("compare needs a contact block")
    summary = walk.summary
    periods, lengths = np.array(summary["step_periods_s"]), np.array(summary["step_lengths_m"])
    stride = STEPS_OF_A_STRIDE * (lengths.size // STEPS_OF_A_STRIDE)
    energy = energy_of(walk)
    from_x_p = walk_from_x_p(config, float(summary["pitch_m"]))
    return ContactModel(
        law=contact,
        foot_radius=config.walker.foot_radius_m,
        summary=summary,
        start=start_of(walk),
        table_3=characteristics(periods, lengths, None if energy is None else energy.mean),
        step_length=float(lengths[stride - STEPS_OF_A_STRIDE : stride].mean()) if stride else None,
        energy=energy,
        from_x_p=(int(from_x_p.touch_time_s.size), from_x_p.outcome.label),
    )


def walk_from_x_p(config: ContactConfig, pitch_m: float) -> ContactWalkResult:
    """The contact model's walk from x_p with its printed digits, both feet on the config's slope."""
    _, theta_2, omega_1, omega_2 = fixed_point_as_printed()
    scene = contact_scene(config, pitch_m, pitch_m)
    start = start_state(scene, (-2.0 * config.slope_rad - theta_2, theta_2, omega_1, omega_2))
    return scene.walk(start, 2 * CYCLES, GAIT)


def energy_of(walk: Content) -> EnergyRecord | None:
    """The energy of a stored walk over its last five steps; None if there is none."""
    trajectory = walk.groups.get("trajectory")
    if trajectory is None or "mechanical_J" not in trajectory.variables:
        return None
    return over_last_steps(trajectory["time"], trajectory["mechanical_J"], times_of_steps(walk, "touch_time_s"))


def start_of(walk: Content) -> State | None:
    """The rigid state that a stored walk starts from: leg 0 swings first."""
    trajectory = walk.groups.get("trajectory")
    if trajectory is None or "angle" not in trajectory.variables:
        return None
    return as_state([*trajectory["angle"][0], *trajectory["velocity"][0]])


def left_out(inputs: Mapping[str, Content], measured: Measured, motion: Comparison) -> list[dict[str, str]]:
    """What could not be compared, and why."""
    sets = inputs["fixedpoint"].summary["equation_sets"]
    missing = [
        {"what": f"columns of the {name} equations", "why": str(sets.get(name, {}).get("reason", "no gait was found"))}
        for name in EQUATION_SETS
        if name not in measured.models
    ]
    contact = measured.contact
    if contact.table_3.t_cycle is None:
        why = f"the walk ended after {contact.steps} of the two steps it takes ({contact.outcome})"
        missing.append({"what": "a stride of the contact model in Table 3", "why": why})
    if contact.table_3.E_avg is None:
        why = "no step was completed" if contact.steps == 0 else "outputs does not ask for energies"
        missing.append({"what": "energy of the contact model", "why": why})
    return [*missing, *motion.left_out]
