"""What `tune` finds, and what of it is stored and printed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from walkerlab.config.reads import ContactConfig
from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_run import ContactSamples, ContactWalkResult, by_channel
from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.recorded_walk import RigidWalkResult
from walkerlab.labels import Label
from walkerlab.orbits.contact_gait import ContactGait, GaitAnswer
from walkerlab.orbits.contact_map import angled_bodies, turning_bodies
from walkerlab.orbits.rigid_limit import motion_of_legs
from walkerlab.orbits.scaled_starts import Adjustment, Margin, StartMap, StartTrial
from walkerlab.paper.adams_start import AdamsWalk
from walkerlab.paper.printed import TABLE_2, StartRow
from walkerlab.scene.contact import ContactScene
from walkerlab.scene.endings import Pads, endings
from walkerlab.solvers.system import State
from walkerlab.stages.simulate import leg_variables
from walkerlab.stages.walk_columns import TIME, legs, of_steps, over_time
from walkerlab.store.columns import numbered, real_and_imaginary, rows_group
from walkerlab.store.content import Group, Variable

WIDER = "Search further: tune.swing_factors, tune.stance_factors, tune.cells; or choose another contact."
SWING, STANCE = "swing_factor", "stance_factor"


@dataclass(frozen=True)
class Procedure:
    """The paper's procedure, step by step.

    hinged    the paper's walk whose first step has a revolute joint at its stance foot, from the rigid state; None for
              another walker than a compass
    released  the walk without it
    adjusted  the walk from the adjusted start; the released one if no adjustment is needed; None if there is none
    """

    rigid_state: State
    rigid: RigidWalkResult
    hinged: ContactWalkResult | None
    released: ContactWalkResult
    adjusted: ContactWalkResult | None


@dataclass(frozen=True)
class TuneFindings:
    """All that the stage found."""

    scene: ContactScene
    gait: GaitAnswer
    procedure: Procedure
    as_it_stands: StartTrial
    adjustment: Adjustment | None
    margins: list[Margin]
    contact_map: StartMap
    rigid_map: StartMap
    paper: AdamsWalk | None  # None for another walker than the paper's compass
    steps: int  # asked for
    names: tuple[str, ...]  # of the rigid start's numbers
    errors: Mapping[str, dict[str, Any]]  # what is told of the procedure's walks beside themselves, by name
    adjusted_state: State | None
    gait_factors: tuple[float, float] | None  # where the gait lies on the map, from the adjusted walk's end


def summary(found: TuneFindings, config: ContactConfig) -> dict[str, Any]:
    """What the command prints."""
    procedure = found.procedure
    return {
        "table2": table_2(found),
        "gait": gait_summary(found),
        "adjustment": adjustment_summary(found),
        **({} if found.paper is None else {"paper_start": papers_start(found.paper)}),
        "procedure": {
            **({} if procedure.hinged is None else {"hinged": walk_summary(procedure.hinged) | found.errors["hinged"]}),
            "released": walk_summary(procedure.released) | found.errors["released"],
            "adjusted": procedure.adjusted and walk_summary(procedure.adjusted) | found.errors["adjusted"],
        },
        "map": map_summary(found, config),
        "slope_rad": found.scene.walker.slope,
        "pitch_m": found.scene.pitch_m,
    }


def papers_start(start: AdamsWalk) -> dict[str, Any]:
    """What becomes of the paper's own start."""
    return {
        "outcome": start.walk.outcome.label,
        "reason": start.reason,
        "steps": int(start.walk.touch_time_s.size),
        "state": list(start.rigid.state),
        "energy_J": start.rigid.energy,
        "weight_N": start.rigid.weight,
        "normal_force_N": start.rigid.normal_force,
        "pull_from_s": start.rigid.pull_from,
        "airborne_from_s": start.airborne_from,
        "end_time_s": start.walk.end_time_s,
    }


def table_2(found: TuneFindings) -> dict[str, dict[str, Any]]:
    """The start before and after the adjustment, of the paper's compass beside the paper's two, each on either base."""
    n = len(found.names) // 2
    papers = [printed_start(row) for row in TABLE_2] if found.paper is not None else [{}] * (2 * n)
    adjusted = found.adjusted_state or (None,) * (2 * n)
    rows = {}
    for k, (name, printed, value, ours) in enumerate(
        zip(found.names, papers, found.procedure.rigid_state, adjusted, strict=True)
    ):
        rows[name] = {
            "unit": "rad" if k < n else "rad/s",
            **printed,
            "ours_rigid": value,
            "ours_adjusted": ours,
            "ours_percent_of_rigid": None if ours is None else percent(ours, value, value),
            "ours_percent_of_adjusted": None if ours is None else percent(ours, value, ours),
        }
    return rows


def printed_start(row: StartRow) -> dict[str, Any]:
    """A row of the paper's Table 2, with percentages on either base."""
    matlab, adams = row.matlab.value, row.adams.value
    return {
        "paper_matlab": matlab,
        "paper_adams": adams,
        "paper_percent": row.percent.value,
        "paper_percent_of_matlab": percent(adams, matlab, matlab),
        "paper_percent_of_adams": percent(adams, matlab, adams),
    }


def percent(value: float, other: float, base: float) -> float | None:
    """How much larger in magnitude a value is than the other, in percent of a base; None for a base of zero."""
    return 100.0 * (abs(value) - abs(other)) / abs(base) if base else None


def gait_summary(found: TuneFindings) -> dict[str, Any]:
    """The contact model's own gait, or why there is none."""
    gait = found.gait.gait
    said = {"found": gait is not None, "reason": found.gait.reason, "advice": found.gait.advice}
    if gait is None:
        return said
    step = gait.step
    return {
        **said,
        "state": gait.z.tolist(),
        "state_is": [f"{text} ({unit})" for text, unit in section_coordinates(found.scene)],
        "section": "the swing foot passes the stance foot: no foot is touching or lifting there",
        "period_s": step.period_s,
        "step_length_m": step.length_m,
        "multipliers": [[float(value.real), float(value.imag)] for value in gait.multipliers],
        "spectral_radius": float(abs(gait.multipliers[0])),
        "stable": gait.stable,
        "slip_m": step.slip_m,
        "residual": gait.residual,
        "lost_J": by_channel(found.scene.walker, step.dissipated_J),
        "height_lost_J": step.height_lost_J,
        "balance_J": float(step.dissipated_J.sum() - step.height_lost_J),
    }


def section_coordinates(scene: ContactScene) -> list[tuple[str, str]]:
    """What the numbers of a gait on its section are, and their units."""
    walker, names = scene.walker, [body.name for body in scene.assembly.bodies]

    def of(quantity: str, bodies: tuple[int, ...]) -> list[str]:
        return [f"{quantity} of the {role_of(walker, body)} {names[body].rstrip(' 0123456789')}" for body in bodies]

    return [
        ("height of the centre of mass over the slope", "m"),
        *((text, "rad") for text in of("angle", angled_bodies(walker, STANCE_FOOT))),
        ("velocity of the centre of mass along the slope", "m/s"),
        ("velocity of the centre of mass normal to the slope", "m/s"),
        *((text, "rad/s") for text in of("angular velocity", turning_bodies(walker, STANCE_FOOT))),
    ]


def role_of(walker: ContactWalker, body: int) -> str:
    """Whether a body of a leg swings or stands."""
    return "stance" if body in walker.legs[STANCE_FOOT] else "swing"


def adjustment_summary(found: TuneFindings) -> dict[str, Any]:
    """The smallest change that walks, whether any is needed, and the margins around it."""
    needed = not found.as_it_stands.walks
    change = found.adjustment
    said: dict[str, Any] = {"needed": needed, "found": change is not None}
    if change is None:
        said["reason"] = f"none of {found.contact_map.outcome.size} starts walked {found.steps} steps" + (
            " and settled on the gait" if found.gait.gait is not None else ""
        )
        said["advice"] = found.gait.advice or WIDER
        return said
    return {
        **said,
        "scale_dtheta1": change.swing,
        "scale_dtheta2": change.stance,
        "distance": change.distance,
        "walked_steps": change.trial.steps,
        "margins": {margin.name: margin_summary(margin) for margin in found.margins},
    }


def margin_summary(margin: Margin) -> dict[str, Any]:
    """How far one may go one way, and what happens beyond."""
    beyond = None if margin.fails is None else Outcome(margin.fails.outcome)
    return {
        "factor": margin.factor,
        "percent": 100.0 * (margin.factor - 1.0),
        "beyond": None if beyond is None else "not settled" if beyond is Outcome.WALKED else beyond.label,
        "steps_beyond": None if margin.fails is None else margin.fails.steps,
    }


def walk_summary(walk: ContactWalkResult) -> dict[str, Any]:
    """How one walk went."""
    return {
        "outcome": walk.outcome.label,
        "advice": walk.advice,
        "steps": int(walk.touch_time_s.size),
        "step_periods_s": walk.periods_s.tolist(),
        "step_lengths_m": walk.lengths_m.tolist(),
        "end_time_s": walk.end_time_s,
    }


def map_summary(found: TuneFindings, config: ContactConfig) -> dict[str, Any]:
    """How many cells end how, in both models, and what the ground has to do with the contact model's ends."""
    pitch, ends = found.scene.pitch_m, counted(found.contact_map)
    laid = "" if config.contact is None else str(config.contact.pad_pitch)
    return {
        "cells": int(found.contact_map.outcome.size),
        "walks_share": found.contact_map.share(),
        "contact": ends,
        "rigid": counted(found.rigid_map),
        "endings": endings(ends, config, contact=True, pads=Pads((pitch, pitch), laid=laid)),
    }


def counted(cells: StartMap) -> dict[str, int]:
    """Cells by outcome."""
    numbers, counts = np.unique(cells.outcome, return_counts=True)
    return {Outcome(int(number)).label: int(count) for number, count in zip(numbers, counts, strict=True)}


def groups(found: TuneFindings) -> dict[str, Group]:
    """The datasets of the artifact."""
    procedure = found.procedure
    stored: dict[str, Group | None] = {
        "map": map_group(found),
        "margins": margins_group(found.margins) if found.margins else None,
        "gait": gait_group(found.gait.gait, found.scene) if found.gait.gait is not None else None,
        "rigid_start": rigid_group(procedure.rigid),
        "paper_start": None if found.paper is None else paper_group(found.paper, found.scene.walker),
    }
    walks = {"released": procedure.released, "hinged": procedure.hinged, "adjusted": procedure.adjusted}
    stored |= {name: walk_group(walk, found.scene.walker) for name, walk in walks.items() if walk is not None}
    return {name: group for name, group in stored.items() if group is not None}


def map_group(found: TuneFindings) -> Group:
    """Outcome and steps of both models over the two factors."""
    cells, rigid = found.contact_map, found.rigid_map
    dims = (STANCE, SWING)
    change: Adjustment | None = found.adjustment
    attrs: dict[str, Any] = {
        "outcomes": ", ".join(f"{outcome.value} {outcome.label}" for outcome in Outcome),
        "steps_wanted": found.steps,
    }
    if change is not None:
        attrs |= {"adjusted_swing_factor": change.swing, "adjusted_stance_factor": change.stance}
    if found.gait_factors is not None:
        attrs |= dict(zip(("gait_swing_factor", "gait_stance_factor"), found.gait_factors, strict=True))
    return Group(
        {
            SWING: Variable(cells.swing, (SWING,), "1", "factor on the swing leg's initial angular velocity"),
            STANCE: Variable(cells.stance, (STANCE,), "1", "factor on the stance leg's initial angular velocity"),
            "outcome": Variable(cells.outcome, dims, "1", "how the contact model's walk ended, see attribute outcomes"),
            "steps": Variable(cells.steps, dims, "1", "steps that the contact model walked"),
            "settled": Variable(
                cells.settled, dims, "1", "1 if the last step is the contact gait's within two percent"
            ),
            "rigid_outcome": Variable(rigid.outcome, dims, "1", "how the rigid model's walk ended"),
            "rigid_steps": Variable(rigid.steps, dims, "1", "steps that the rigid model walked"),
        },
        attrs,
    )


def margins_group(margins: list[Margin]) -> Group:
    """How far the start may be scaled."""
    labels = {"name": Label("", "what is scaled"), "factor": Label("1", "the last that walks")}
    return rows_group(margins, labels, "margin", "number")


def gait_group(gait: ContactGait, scene: ContactScene) -> Group:
    """The contact gait on its section."""
    pairs = ("coordinate", "along")
    coordinates = section_coordinates(scene)
    names = np.array([f"{text} ({unit})" for text, unit in coordinates], dtype=object)
    units = ", ".join(unit for _, unit in coordinates)
    return Group(
        {
            "coordinate": Variable(names, ("coordinate",), "", "coordinate"),
            "state": Variable(gait.z, ("coordinate",), units, "gait on the section"),
            "derivative": Variable(gait.step.DP, pairs, "per unit of the coordinate", "derivative of the step map"),
            **numbered(gait.z.size, "multiplier", "number"),
            **real_and_imaginary("multiplier", gait.multipliers, ("multiplier",), "multiplier"),
        }
    )


def walk_group(walk: ContactWalkResult, walker: ContactWalker) -> Group | None:
    """Angles and velocities of a walk of the contact model; None if nothing was sampled."""
    if walk.samples is None or walk.samples.time_s.size == 0:
        return None
    return Group({**legs_in_time(walk.samples, walker), **of_steps(walk.touch_time_s)})


def rigid_group(walk: RigidWalkResult) -> Group | None:
    """The same of the rigid model from its start."""
    samples = walk.samples
    if samples is None or samples.time_s.size == 0:
        return None
    in_time = {**legs(), **over_time(time=samples.time_s), **leg_variables(samples, 1 - samples.step % 2)}
    return Group({**in_time, **of_steps(walk.touch_time_s)})


def legs_in_time(samples: ContactSamples, walker: ContactWalker) -> dict[str, Variable]:
    """Angles and velocities of the legs."""
    angle, velocity = motion_of_legs(samples.states, walker)
    return {**legs(), **over_time(time=samples.time_s, angle=angle, velocity=velocity)}


def paper_group(paper: AdamsWalk, walker: ContactWalker) -> Group:
    """The paper's ADAMS start in the contact model."""
    samples = paper.walk.samples
    return Group(
        {
            **({} if samples is None else legs_in_time(samples, walker)),
            **over_time(normal_force_N=paper.normal),
            "mechanical_J": Variable(paper.mechanical, (TIME,), "J", "kinetic and potential energy"),
        }
    )
