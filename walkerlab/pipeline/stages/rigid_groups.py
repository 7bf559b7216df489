"""Build the groups in which a rigid walk is stored: its steps, and samples over time."""

from typing import Any

import numpy as np

from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult, Samples
from walkerlab.physics.hybrid.rigid_measures import Places, energies, footholds_of, places, reactions
from walkerlab.physics.mechanics.rigid_model import STANCE, compute_in_turns, energy_at_touch
from walkerlab.pipeline.stages.walk import COORDINATE, leg_labels, rotation_variables, steps_of, variables_over_time
from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.scene.rigid import RigidScene


def groups(scene: RigidScene, walk: RigidWalkResult) -> dict[str, Group]:
    """Return the groups of a walk by name, without empty ones."""
    stored = {}
    if walk.steps:
        set_down = np.append(walk.start[STANCE], walk.after[:-1, STANCE])
        turned = set_down - walk.before[:, STANCE]
        # While its leg turns back by an angle, the stance foot rolls by that angle times its radius.
        rolling = compute_in_turns(scene.walker, np.arange(walk.steps), lambda leg, angle: leg.radius * angle, turned)
        columns = steps_of(walk, rolling_m=rolling, state_before=walk.before, state_after=walk.after)
        names = Variable(np.array(scene.names), (COORDINATE,), "", "coordinate of the state")
        stored["steps"] = Group({**columns, COORDINATE: names})
    if walk.samples is not None and walk.samples.time_s.size:
        stored["trajectory"] = trajectory_group(scene, walk, walk.samples)
    return stored


def trajectory_group(scene: RigidScene, walk: RigidWalkResult, samples: Samples) -> Group:
    """Build the group of the sampled quantities that `outputs` select, with a sample just before and just after each
    heel strike.
    """
    stance = stance_leg(samples)
    variables = {**variables_over_time(time=samples.time_s, stance_leg=stance + 1, step=samples.step), **leg_labels()}
    if "states" in scene.outputs:
        variables |= leg_variables(samples)
        variables |= body_variables(scene, samples, stance)
        n = len(scene.names) // 2
        positions = places(scene.walker, scene.knees_m, footholds_of(walk), samples.state[:, :n], samples.step)
        variables |= place_variables(positions, stance)
    if "energies" in scene.outputs:
        kinetic, potential = compute_in_turns(scene.walker, samples.step, energies, samples.state).T
        touched = np.append(walk.start[STANCE], walk.after[:, STANCE])
        potential -= compute_in_turns(scene.walker, np.arange(touched.size), energy_at_touch, touched)[samples.step]
        variables |= variables_over_time(kinetic_J=kinetic, potential_J=potential, mechanical_J=kinetic + potential)
    if "forces" in scene.outputs:
        friction, normal = (
            reorder_by_leg(np.column_stack((np.zeros_like(force), force)), stance)
            for force in compute_in_turns(scene.walker, samples.step, reactions, samples.state, samples.bent).T
        )
        variables |= variables_over_time(normal_force_N=normal, friction_force_N=friction)
    return Group(variables)


def stance_leg(samples: Samples) -> Any:
    """Return the index of the stance leg (samples,): leg 0 swings in even steps, leg 1 in odd ones."""
    return 1 - samples.step % 2


def leg_variables(samples: Samples) -> dict[str, Variable]:
    """Return angles and velocities by leg. The legs change roles at each heel strike."""
    n = samples.state.shape[1] // 2
    stance = stance_leg(samples)
    angle = samples.state[:, :2]
    velocity = samples.state[:, n : n + 2]
    return variables_over_time(angle=reorder_by_leg(angle, stance), velocity=reorder_by_leg(velocity, stance))


def reorder_by_leg(by_role: Any, stance: Any) -> Any:
    """Reorder values (samples, 2) from swing and stance leg to leg 0 and leg 1."""
    return np.take_along_axis(by_role, np.where(stance[:, None] == 1, [[0, 1]], [[1, 0]]), axis=1)


def body_variables(scene: RigidScene, samples: Samples, stance: Any) -> dict[str, Variable]:
    """Return angles and velocities of shanks and torso."""
    n = samples.state.shape[1] // 2
    variables: dict[str, Variable] = {}
    for k, name in enumerate(scene.names[2:n], 2):
        angle = samples.state[:, k]
        rate = samples.state[:, n + k]
        if name.startswith("theta_1_"):  # the stance leg's shank is in line with its thigh
            angle = reorder_by_leg(np.column_stack((angle, samples.state[:, 1])), stance)
            rate = reorder_by_leg(np.column_stack((rate, samples.state[:, n + 1])), stance)
        variables |= rotation_variables(name.split("_")[-1], angle, rate)
    return variables


def place_variables(positions: Places, stance: Any) -> dict[str, Variable]:
    """Return positions of hip, knees and feet, along the slope from the first foothold and above the slope."""
    points = {"foot": np.stack((positions.swing_foot, positions.contact), axis=1)}
    points |= {} if positions.knees is None else {"knee": positions.knees}
    variables = variables_over_time(hip_along_m=positions.hip[:, 0], hip_height_m=positions.hip[:, 1])
    for name, point in points.items():
        along, height = (reorder_by_leg(point[:, :, axis], stance) for axis in range(2))
        variables |= variables_over_time(**{f"{name}_along_m": along, f"{name}_height_m": height})
    return variables
