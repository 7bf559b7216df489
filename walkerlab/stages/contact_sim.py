"""The contact model: an assembled walker on compliant ground, walked from the rigid model's start state."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.reads import ContactConfig, ContactSimConfig, SceneConfig
from walkerlab.errors import NoAnswer
from walkerlab.ground.compliant import hinge_of
from walkerlab.ground.terrain import Terrain
from walkerlab.hybrid.contact_run import (
    ContactSamples,
    ContactWalkResult,
    by_channel,
    sampled_energies,
    sampled_feet,
)
from walkerlab.mechanics.rigid import places_of
from walkerlab.mechanics.walkers import TORSO
from walkerlab.scene.contact import (
    ContactScene,
    contact_gait,
    contact_scene,
    scene_measures,
    start_state,
    wants_own_pitch,
)
from walkerlab.scene.left_out import of_contact_walk
from walkerlab.solvers.registry import Tolerances
from walkerlab.stages.progress import Progress
from walkerlab.stages.walk import content_of_walk
from walkerlab.stages.walk_columns import TIME, legs, numbers_of, of_body, over_time, steps_of
from walkerlab.store.content import Content, Group, Variable

BUDGET_PER_STEP = 1_000_000  # right-hand sides
SAMPLES_PER_PENDULUM_TIME = 200
RESOLVED = 0.1  # of the stiction velocity: a tolerance that still tells slips apart
HALF_ANGLE = 0.2  # rad, between the legs of a walker whose walk is only to be compiled
SCUFFED = (
    "A straight swing leg cannot pass the stance leg on a plane: its foot scuffs. Give it room with "
    "contact.terrain: after-mid-swing, or checkerboard."
)
Floats = NDArray[np.float64]


def run(config: ContactSimConfig, inputs: Mapping[str, Content], progress: Progress, again: bool = True) -> Content:
    """Walk `config.strides` strides, and again for the numerical error; raises NoAnswer if the solver gives none.

    again  whether the second walk, which takes about as long as two or three, is wanted
    """
    rigid_step, rigid_state = rigid_start(config, inputs)
    scene = contact_scene(config, rigid_step, own_pitch(config, rigid_step, rigid_state))
    settings = config.solver.contact
    start, steps = start_state(scene, rigid_state), 2 * config.strides
    tolerances = Tolerances(settings.method, settings.rtol, settings.atol, steps * BUDGET_PER_STEP)
    interval = scene.frame.pendulum_time / SAMPLES_PER_PENDULUM_TIME if config.outputs else None
    tell_unresolved_slip(settings.atol, scene, progress)

    def walk(tolerances: Tolerances, sampled: bool) -> ContactWalkResult:
        progress.start("contact-sim" if sampled else "contact-sim: numerical error", 1)
        taken = scene.walk(start, steps, tolerances, interval if sampled else None)
        progress.advance()
        return taken

    stored, said = partial(groups, config, scene), partial(summary, config, scene)
    return content_of_walk("contact-sim", walk, tolerances, stored, said, progress, again)


def compile_kernels(config: ContactSimConfig) -> None:
    """Have everything compiled that `run` calls, by a walk that may evaluate next to nothing."""
    scene = contact_scene(config, config.walker.leg_length_m * 2.0 * float(np.sin(HALF_ANGLE)))
    y = start_state(scene, standing(scene))
    settings = config.solver.contact
    tolerances = Tolerances(settings.method, settings.rtol, settings.atol, 1)
    interval = scene.frame.pendulum_time if config.outputs else None
    groups(config, scene, scene.walk(y, 1, tolerances, interval))


def standing(scene: ContactScene) -> tuple[float, ...]:
    """A rigid state with the legs straight and apart, at rest."""
    places = places_of(scene.assembly).names
    angles = [HALF_ANGLE if name == "2" else -HALF_ANGLE if name.startswith("1") else 0.0 for name in places]
    return (*angles, *(0.0 for _ in places))


def tell_unresolved_slip(atol: float, scene: ContactScene, progress: Progress) -> None:
    """Say so if the tolerance on velocities (m/s) leaves friction to chance."""
    rising = scene.walker.friction.rising_until
    if atol > RESOLVED * rising:
        progress.note(
            f"contact-sim: solver.contact.atol, {atol:g} m/s, is not small against contact.stiction_velocity, up to "
            f"which friction rises, {rising:g} m/s: friction, and how the walk ends, may be chance; lower atol"
        )


def rigid_start(config: SceneConfig, inputs: Mapping[str, Content]) -> tuple[float, tuple[float, ...]]:
    """Step length (m) that pads and steps are measured by, and the rigid start state."""
    given = config.start if config.start != "fixed-point" else None
    if "fixedpoint" in inputs:
        gait = inputs["fixedpoint"].summary
        state = given if given is not None else gait["state"]
        return float(gait["step_length_m"]), tuple(float(x) for x in state)
    if given is None:
        raise ValueError("neither a start state nor a fixed point")
    state = tuple(float(x) for x in given)
    return 2.0 * config.walker.leg_length_m * float(np.sin(0.5 * abs(state[1] - state[0]))), state


def own_pitch(config: ContactConfig, rigid_step: float, rigid_state: tuple[float, ...]) -> float | None:
    """Step length (m) of the contact gait, if the pads are laid for it; raises NoAnswer if there is no such gait."""
    contact = config.contact
    if contact is None or not wants_own_pitch(contact):
        return None
    answer = contact_gait(config, rigid_step, rigid_state)
    if answer.gait is None:
        raise NoAnswer(f"contact-sim: no contact gait to lay the pads for: {answer.reason}", answer.advice)
    return answer.gait.step.length_m


def summary(config: ContactSimConfig, scene: ContactScene, result: ContactWalkResult) -> dict[str, Any]:
    """What the command prints."""
    return {
        **numbers_of(result),
        "advice": advice(config, scene, result),
        "max_penetration_m": result.max_penetration_m,
        "slip_per_step_m": mean_of(result.slip_m),
        "slips_m": result.slip_m.tolist(),
        "rolling_per_step_m": mean_of(result.rolling_m),
        "rolling_m": result.rolling_m.tolist(),
        "energy_balance_residual_J": result.energy_balance_residual_J,
        "dissipated_J": by_channel(scene.walker, result.dissipated_J),
        **strikes_until_0_3(result),
        "jacobians": result.work.jacobians,
        "slope_rad": scene.walker.slope,
        **scene_measures(scene),
        "left_out": list(of_contact_walk(config)),
    }


def advice(config: ContactConfig, scene: ContactScene, result: ContactWalkResult) -> str:
    """What the outcome means and what to try next; straight legs on a plane have a reason of their own to end."""
    on_plane = config.contact is not None and config.contact.terrain == "plane"
    if on_plane and result.outcome.stumbled and not scene.walker.kneed:
        return SCUFFED
    return result.advice


def mean_of(values: Floats) -> float | None:
    """The mean of a number of each step; None of no step."""
    return float(np.mean(values)) if values.size else None


def strikes_until_0_3(result: ContactWalkResult) -> dict[str, Any]:
    """The older name of the knees' strikes, -1 where a knee did not lock."""
    times = result.knee_strike_time_s
    return {} if times is None or times.size == 0 else {"knee_strikes_s": np.nan_to_num(times, nan=-1.0).tolist()}


def groups(config: ContactSimConfig, scene: ContactScene, result: ContactWalkResult) -> dict[str, Group]:
    """The datasets of the artifact."""
    stored: dict[str, Group] = {}
    if result.steps:
        stored["steps"] = Group(steps_of(result, slip_m=result.slip_m, rolling_m=result.rolling_m))
    if scene.terrain.has_pads:
        stored["terrain"] = pads_group(scene.terrain, result)
    if result.samples is not None:
        stored["trajectory"] = trajectory_group(config, scene, result.samples)
    return stored


def pads_group(terrain: Terrain, result: ContactWalkResult) -> Group:
    """The pads from behind the start to ahead of the end."""
    pitch = terrain.stride_measure
    last = int(np.ceil(result.end_state[0] / pitch)) + 2
    numbers = range(-2, last + 1)
    centres = np.array([number * pitch for number in numbers])
    legs = np.array([1 if number % 2 == 0 else 0 for number in numbers])
    return Group(
        {
            "pad": Variable(np.arange(centres.size), ("pad",), "1", "pad number"),
            "left_m": Variable(centres - 0.5 * pitch, ("pad",), "m", "where the pad begins, along the slope"),
            "right_m": Variable(centres + 0.5 * pitch, ("pad",), "m", "where the pad ends, along the slope"),
            "leg": Variable(legs, ("pad",), "1", "leg whose lane the pad lies in"),
        }
    )


def trajectory_group(config: ContactSimConfig, scene: ContactScene, samples: ContactSamples) -> Group:
    """Samples of the walk: what `outputs` asks for."""
    variables = {**over_time(time=samples.time_s, stance_leg=samples.stance), **legs()}
    feet = np.zeros((samples.time_s.size, 2, 5))
    sampled_feet(scene.walker, samples.states, samples.has_ground, feet)
    if "states" in config.outputs:
        variables |= state_variables(scene, samples, feet)
    if "energies" in config.outputs:
        variables |= energy_variables(scene, samples, feet)
    if "forces" in config.outputs:
        depth = np.where(samples.has_ground > 0, np.maximum(0.0, -feet[:, :, 1]), 0.0)
        variables |= over_time(
            normal_force_N=feet[:, :, 2],
            friction_force_N=feet[:, :, 3],
            penetration_m=depth,
            slip_velocity_m_s=feet[:, :, 4],
        )
    return Group(variables)


def state_variables(scene: ContactScene, samples: ContactSamples, feet: Any) -> dict[str, Variable]:
    """Angles and velocities of the legs, and where hip and feet are."""
    y, whole = samples.states, scene.walker.whole
    n = int(whole.bodies)
    upper = [leg[0] for leg in scene.walker.legs]
    tilted = y[:, 2 : 2 + n] + scene.walker.slope
    hip_x, hip_y = whole.hip_x[:n], whole.hip_y[:n]
    along = y[:, 0] + np.cos(tilted) @ hip_x - np.sin(tilted) @ hip_y
    height = y[:, 1] + np.sin(tilted) @ hip_x + np.cos(tilted) @ hip_y
    of_legs = over_time(
        angle=y[:, 2 : 2 + n][:, upper],
        velocity=y[:, 4 + n :][:, upper],
        hip_along_m=along,
        hip_height_m=height,
        foot_along_m=feet[:, :, 0],
        foot_height_m=feet[:, :, 1],
    )
    return of_legs | knee_variables(scene, y, along, height) | torso_variables(scene, y)


def knee_variables(scene: ContactScene, y: Floats, hip_along: Floats, hip_height: Floats) -> dict[str, Variable]:
    """Angles and velocities of the shanks, and where the knees are; nothing for straight legs."""
    if not scene.walker.kneed:
        return {}
    names = [body.name for body in scene.assembly.bodies]
    n, thighs, shanks = len(names), scene.walker.whole.thighs.tolist(), scene.walker.whole.shanks.tolist()
    along, height = np.zeros((y.shape[0], 2)), np.zeros((y.shape[0], 2))
    for leg, (thigh, shank) in enumerate(zip(thighs, shanks, strict=True)):
        hip = hinge_of(scene.assembly, names[thigh], names[thighs[1 - leg]])
        knee = hinge_of(scene.assembly, names[thigh], names[shank])
        ahead, up = knee[0] - hip[0], knee[1] - hip[1]
        s, c = np.sin(y[:, 2 + thigh] + scene.walker.slope), np.cos(y[:, 2 + thigh] + scene.walker.slope)
        along[:, leg], height[:, leg] = hip_along + c * ahead - s * up, hip_height + s * ahead + c * up
    angle, velocity = y[:, 2 : 2 + n][:, shanks], y[:, 4 + n :][:, shanks]
    return of_body("shank", angle, velocity) | over_time(knee_along_m=along, knee_height_m=height)


def torso_variables(scene: ContactScene, y: Floats) -> dict[str, Variable]:
    """Angle and velocity of the torso, if there is one."""
    names = [body.name for body in scene.assembly.bodies]
    if TORSO not in names:
        return {}
    n, torso = len(names), names.index(TORSO)
    return of_body(TORSO, y[:, 2 + torso], y[:, 4 + n + torso])


def energy_variables(scene: ContactScene, samples: ContactSamples, feet: Any) -> dict[str, Variable]:
    """Energies as the paper plots them, from the current stance foot, and the energy balance from a fixed origin."""
    energies = np.zeros((samples.time_s.size, 3))
    sampled_energies(scene.walker, samples.states, samples.has_ground, samples.knees, energies)
    walker = scene.walker
    row = np.arange(samples.time_s.size)
    foot_along, foot_height = feet[row, samples.stance, 0], feet[row, samples.stance, 1]
    of_foot = walker.mass * (walker.gravity_down * foot_height - walker.gravity_along * foot_along)
    potential = energies[:, 1] - of_foot
    lost = samples.dissipated_J
    residual = energies[:, 2] + lost.sum(axis=1) - energies[:1, 2]
    plotted = over_time(kinetic_J=energies[:, 0], potential_J=potential, mechanical_J=energies[:, 0] + potential)
    rows = (
        ("book_mechanical_J", energies[:, 2], "kinetic, potential from a fixed origin, and elastic energy"),
        ("dissipated_damping_J", lost[:, 0], "dissipated in normal direction so far"),
        ("dissipated_friction_J", lost[:, 1], "dissipated in friction so far"),
        ("lost_at_edges_J", lost[:, 2], "elastic energy lost at pads' edges so far"),
        ("residual_J", residual, "book energy plus what was lost, less the start's"),
    )
    return plotted | {name: Variable(values, (TIME,), "J", text) for name, values, text in rows}
