"""A walk of the rigid model from its fixed point or from a given start."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from walkerlab.config.reads import SimulateConfig
from walkerlab.hybrid.recorded_walk import RigidWalkResult, Samples
from walkerlab.hybrid.rigid_measures import energies, places, reactions
from walkerlab.mechanics.standing import STANCE, energy_at_touch
from walkerlab.pipeline.progress import Progress
from walkerlab.scene.left_out import of_rigid_walk
from walkerlab.scene.rigid import RigidScene, rigid_scene
from walkerlab.solvers.registry import ENDLESS, Tolerances
from walkerlab.stages.walk import (
    COORDINATE,
    content_of_walk,
    legs,
    numbers_of,
    of_body,
    over_time,
    pace_of,
    rigid_start,
    steps_of,
)
from walkerlab.store.content import Content, Group, Variable


def run(config: SimulateConfig, inputs: Mapping[str, Content], progress: Progress, again: bool = True) -> Content:
    """Walk `config.strides` strides, and again for the numerical error; raises NoAnswer if the integrator gives none.

    again  whether the second walk, which takes about as long as two, is wanted
    """
    scene, settings = rigid_scene(config, config.ground, config.outputs), config.solver.rigid
    tolerances = Tolerances(settings.method, settings.rtol, settings.atol, ENDLESS)
    (length, start), steps = rigid_start(config, inputs), 2 * config.strides
    of_gait = length if "fixedpoint" in inputs else None

    def walk(tolerances: Tolerances, sampled: bool) -> RigidWalkResult:
        progress.start("simulate" if sampled else "simulate: numerical error", steps)
        return scene.walk(start, steps, tolerances, sampled, progress.advance, of_gait)

    of_scene, of_config = partial(groups, scene), partial(summary, config)
    return content_of_walk("simulate", walk, tolerances, of_scene, of_config, progress, again)


def summary(config: SimulateConfig, walk: RigidWalkResult) -> dict[str, Any]:
    """What the command prints."""
    return {
        **numbers_of(walk),
        **pace_of(config, walk),
        "start_state": list(walk.start),
        "final_state": list(walk.final_state),
        "energy_drift_J": walk.energy_drift,
        "energy_balance_residual_J": walk.energy_balance_residual,
        "lost_in_strikes_J": walk.lost_in_strikes,
        "mean_energy_J": walk.mean_energy,
        "min_normal_force_N": walk.min_normal_force,
        "max_friction_ratio": walk.max_friction_ratio or None,
        "max_scuff_depth_m": walk.max_scuff_depth,
        "objections": list(walk.objections),
        "equations": config.equations,
        "slope_rad": config.slope_rad,
        "left_out": list(of_rigid_walk(config)),
    }


def groups(scene: RigidScene, walk: RigidWalkResult) -> dict[str, Group]:
    """The datasets of the artifact."""
    stored = {}
    if walk.steps:
        set_down = np.append(walk.start[STANCE], walk.after[:-1, STANCE])
        rolling = scene.walker.radius * (set_down - walk.before[:, STANCE])
        columns = steps_of(walk, rolling_m=rolling, state_before=walk.before, state_after=walk.after)
        names = Variable(np.array(scene.names), (COORDINATE,), "", "coordinate of the state")
        stored["steps"] = Group({**columns, COORDINATE: names})
    if walk.samples is not None and walk.samples.time_s.size:
        stored["trajectory"] = trajectory_group(scene, walk, walk.samples)
    return stored


def trajectory_group(scene: RigidScene, walk: RigidWalkResult, samples: Samples) -> Group:
    """Samples of the walk, both sides of each heel strike among them: what `outputs` asks for."""
    stance = stance_leg(samples)
    variables = {**over_time(time=samples.time_s, stance_leg=stance + 1, step=samples.step), **legs()}
    if "states" in scene.outputs:
        variables |= leg_variables(samples)
        variables |= body_variables(scene, samples, stance)
        variables |= place_variables(scene, walk, samples, stance)
    if "energies" in scene.outputs:
        kinetic, potential = energies(scene.walker, samples.state).T
        touched = np.append(walk.start[STANCE], walk.after[:, STANCE])
        potential -= energy_at_touch(scene.walker, touched)[samples.step]
        variables |= over_time(kinetic_J=kinetic, potential_J=potential, mechanical_J=kinetic + potential)
    if "forces" in scene.outputs:
        friction, normal = (
            of_legs(np.column_stack((np.zeros_like(force), force)), stance)
            for force in reactions(scene.walker, samples.state, samples.bent).T
        )
        variables |= over_time(normal_force_N=normal, friction_force_N=friction)
    return Group(variables)


def stance_leg(samples: Samples) -> Any:
    """The leg that stands (samples,): leg 0 swings in even steps, leg 1 in odd ones."""
    return 1 - samples.step % 2


def leg_variables(samples: Samples) -> dict[str, Variable]:
    """Angles and velocities of the legs themselves, which change roles at every heel strike."""
    n, stance = samples.state.shape[1] // 2, stance_leg(samples)
    by_leg = {"angle": of_legs(samples.state[:, :2], stance), "velocity": of_legs(samples.state[:, n : n + 2], stance)}
    return over_time(**by_leg)


def of_legs(by_role: Any, stance: Any) -> Any:
    """Numbers (samples, 2) of swing and stance leg as those of leg 0 and leg 1."""
    return np.take_along_axis(by_role, np.where(stance[:, None] == 1, [[0, 1]], [[1, 0]]), axis=1)


def body_variables(scene: RigidScene, samples: Samples, stance: Any) -> dict[str, Variable]:
    """Angles and velocities of the bodies below and above the legs: shanks, a torso."""
    n = samples.state.shape[1] // 2
    found: dict[str, Variable] = {}
    for k, name in enumerate(scene.names[2:n], 2):
        angle, rate = samples.state[:, k], samples.state[:, n + k]
        if name.startswith("theta_1_"):  # the stance leg's is in line with it
            angle = of_legs(np.column_stack((angle, samples.state[:, 1])), stance)
            rate = of_legs(np.column_stack((rate, samples.state[:, n + 1])), stance)
        found |= of_body(name.split("_")[-1], angle, rate)
    return found


def place_variables(scene: RigidScene, walk: RigidWalkResult, samples: Samples, stance: Any) -> dict[str, Variable]:
    """Where hip, knees and feet are, along the slope from the first foothold and over it."""
    at = places(scene.walker, scene.knee_m, walk, samples)
    points = {"foot": np.stack((at.swing_foot, at.contact), axis=1)} | ({} if at.knees is None else {"knee": at.knees})
    found = over_time(hip_along_m=at.hip[:, 0], hip_height_m=at.hip[:, 1])
    for name, point in points.items():
        along, height = (of_legs(point[:, :, axis], stance) for axis in range(2))
        found |= over_time(**{f"{name}_along_m": along, f"{name}_height_m": height})
    return found
