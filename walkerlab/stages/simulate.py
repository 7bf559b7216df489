"""A walk of the rigid model from its fixed point or from a given start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.hybrid.recorded_walk import RecordedWalk, Samples, as_state, take_walk
from walkerlab.hybrid.rigid_measures import energies, reactions
from walkerlab.scene.left_out import of_rigid_walk
from walkerlab.scene.rigid import COORDINATES, RigidScene, rigid_scene
from walkerlab.solvers.system import State
from walkerlab.stages.progress import Progress
from walkerlab.stages.thinning import thinned
from walkerlab.store.content import Content, Group, Variable

STEP, TIME, LEG = "step", "time", "leg"


def run(config: Config, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Walk `config.strides` strides; raises NoAnswer if the integrator gives none."""
    scene = rigid_scene(config)
    steps = 2 * config.strides
    progress.start("simulate", steps)
    walk = take_walk(scene.walker, scene.method, start_state(config, inputs), steps, scene.sampled, progress.advance)
    if walk.samples is not None:
        walk = replace(walk, samples=thinned(walk.samples, walk.samples.time, walk.heel_strikes, progress))
    content = Content(groups(scene, walk), summary(config, walk))
    if not walk.outcome.answered:
        raise NoAnswer(f"simulate: {walk.outcome.label} after {walk.steps} steps", walk.outcome.advice, content)
    return content


def start_state(config: Config, inputs: Mapping[str, Content]) -> State:
    """The config's start, or the fixed point."""
    given = inputs["fixedpoint"].summary["state"] if config.start == "fixed-point" else config.start
    return as_state(given)


def summary(config: Config, walk: RecordedWalk) -> dict[str, Any]:
    """What the command prints."""
    return {
        "outcome": walk.outcome.label,
        "advice": walk.outcome.advice,
        "steps": walk.steps,
        "step_periods_s": walk.periods.tolist(),
        "step_lengths_m": walk.lengths.tolist(),
        "start_state": list(walk.start),
        "final_state": list(walk.final_state),
        "energy_drift_J": walk.energy_drift,
        "mean_energy_J": walk.mean_energy,
        "min_normal_force_N": walk.min_normal_force,
        "max_friction_ratio": walk.max_friction_ratio,
        "max_scuff_depth_m": walk.max_scuff_depth,
        "rhs_evaluations": walk.work.rhs_evaluations,
        "accepted_steps": walk.work.accepted,
        "rejected_steps": walk.work.rejected,
        "equations": config.equations,
        "slope_rad": config.slope_rad,
        "left_out": list(of_rigid_walk(config)),
    }


def groups(scene: RigidScene, walk: RecordedWalk) -> dict[str, Group]:
    """The datasets of the artifact."""
    stored = {}
    if walk.steps:
        stored["steps"] = steps_group(walk)
    if walk.samples is not None and walk.samples.time.size:
        stored["trajectory"] = trajectory_group(scene, walk.samples)
    return stored


def steps_group(walk: RecordedWalk) -> Group:
    """One row a step."""
    states = (STEP, "coordinate")
    return Group(
        {
            STEP: Variable(np.arange(walk.steps), (STEP,), "1", "step number"),
            "coordinate": Variable(np.array(COORDINATES), ("coordinate",), "", "coordinate of the state"),
            "period_s": Variable(walk.periods, (STEP,), "s", "time from heel strike to heel strike"),
            "length_m": Variable(walk.lengths, (STEP,), "m", "distance between the feet at heel strike"),
            "heel_strike_time_s": Variable(walk.heel_strikes, (STEP,), "s", "time of the heel strike at the end"),
            "state_before": Variable(walk.before, states, "rad, rad/s", "state just before that heel strike"),
            "state_after": Variable(walk.after, states, "rad, rad/s", "state just after it, roles changed"),
        }
    )


def trajectory_group(scene: RigidScene, samples: Samples) -> Group:
    """Samples of the walk, both sides of each heel strike among them: what `outputs` asks for."""
    # leg 0 swings in even steps, leg 1 in odd ones
    stance = 1 - samples.step % 2
    variables = {
        TIME: Variable(samples.time, (TIME,), "s", "time"),
        STEP: Variable(samples.step, (TIME,), "1", "step number"),
        "stance_leg": Variable(stance, (TIME,), "1", "leg that stands"),
    }
    if scene.states:
        variables |= leg_variables(samples, stance)
    if scene.energies:
        variables |= energy_variables(energies(scene.walker, samples.state))
    if scene.forces:
        force = reactions(scene.walker, samples.state)
        variables |= {
            "tangential_force_N": Variable(force[:, 0], (TIME,), "N", "force of the ground along the slope, downhill"),
            "normal_force_N": Variable(force[:, 1], (TIME,), "N", "force of the ground normal to the slope"),
        }
    return Group(variables)


def leg_variables(samples: Samples, stance: Any) -> dict[str, Variable]:
    """Angles and velocities of the legs themselves, which change roles at every heel strike."""
    as_leg = np.where(stance[:, None] == 1, [[0, 1]], [[1, 0]])
    angle = np.take_along_axis(samples.state[:, :2], as_leg, axis=1)
    velocity = np.take_along_axis(samples.state[:, 2:], as_leg, axis=1)
    return {
        LEG: Variable(np.arange(2), (LEG,), "1", "leg: 0 swings first, 1 stands first"),
        "angle": Variable(angle, (TIME, LEG), "rad", "angle of the leg from the vertical"),
        "velocity": Variable(velocity, (TIME, LEG), "rad/s", "angular velocity of the leg"),
    }


def energy_variables(parts: Any) -> dict[str, Variable]:
    """Energies as the paper plots them, from the current stance foot."""
    rows = (
        ("kinetic_J", parts[:, 0], "kinetic energy"),
        ("potential_J", parts[:, 1], "potential energy from the current stance foot"),
        ("mechanical_J", parts[:, 0] + parts[:, 1], "kinetic and potential energy from the current stance foot"),
    )
    return {name: Variable(values, (TIME,), "J", text) for name, values, text in rows}
