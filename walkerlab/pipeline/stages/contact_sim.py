"""Simulate a walk of the contact model, an assembled walker on compliant ground, from the rigid model's start state."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from walkerlab.config.reads import ContactSimConfig
from walkerlab.physics.energy_channels import SAMPLED
from walkerlab.physics.ground.terrain import STANCE_FOOT, Terrain
from walkerlab.physics.hybrid.contact_record import ContactSamples
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, losses_by_channel, sample_energies, sample_feet
from walkerlab.physics.mechanics.parts import hinge_point
from walkerlab.physics.solvers import registry, system
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages import walk
from walkerlab.pipeline.store.content import Content, Group, Variable, numbered
from walkerlab.scene import contact, omissions, rigid
from walkerlab.scene.parts import TORSO

MAX_TOLERANCE_RATIO = 0.1  # above this ratio of tolerance to stiction velocity, slips are not resolved
SCUFFED = (
    "A straight swing leg cannot pass the stance leg on a plane: its foot scuffs. Give it room with "
    "contact.terrain: after-mid-swing, or checkerboard."
)


def run(config: ContactSimConfig, inputs: Mapping[str, Content], progress: Progress, again: bool = True) -> Content:
    """Simulate `config.strides` strides.

    again  whether to measure the numerical error by a second walk, which takes about twice as long as the first

    Raises NoAnswer if the solver fails.
    """
    rigid_step, rigid_state = walk.rigid_start(config, inputs)
    scene = contact.scene_on_pads(config, rigid_step, rigid_state, asymmetry=walk.step_asymmetry(config, inputs))
    start = contact.start_state(scene, rigid_state)
    steps = 2 * config.strides
    tolerances = contact.tolerances_of(config, steps)
    interval = scene.ground.frame.pendulum_time / contact.SAMPLES_PER_PENDULUM_TIME if config.outputs else None
    heights = rigid.foothold_heights(config.ground, steps + 1)
    warn_of_unresolved_slip(tolerances.atol, scene, progress)

    def simulate(tolerances: registry.Tolerances, sampled: bool) -> ContactWalkResult:
        progress.start("contact-sim" if sampled else "contact-sim: numerical error", 1)
        result = scene.walk(start, steps, tolerances, interval if sampled else None, heights)
        progress.advance()
        return result

    stored = partial(groups, config, scene)
    summarise = partial(summary, config, scene)
    return walk.content_of_walk("contact-sim", simulate, tolerances, stored, summarise, progress, again)


def warn_of_unresolved_slip(atol: float, scene: contact.ContactScene, progress: Progress) -> None:
    """Warn if the tolerance on velocities (m/s) is too coarse for the friction law."""
    rising = scene.walker.friction.rising_until
    if atol > MAX_TOLERANCE_RATIO * rising:
        progress.note(
            f"contact-sim: lower solver.contact.atol ({atol:g} m/s). It is large relative to contact.stiction_velocity "
            f"({rising:g} m/s), so errors of the solver may decide the friction, and with it the outcome"
        )


def add_stance_time(numbers: Mapping[str, Any], result: ContactWalkResult) -> dict[str, Any]:
    """Return the asymmetry of the last stride (leg 2 minus leg 1), including that of the times from touch to lift."""
    # Leg 2 is the stance leg in the first step of a stride. The last stance foot may not have lifted yet.
    count = result.steps - result.steps % walk.STRIDE
    if not count or result.stance_s.size < count:
        return {}
    second, first = result.stance_s[count - walk.STRIDE : count].tolist()
    return {"asymmetry": {**numbers["asymmetry"], "stance_time": walk.asymmetry_of(first, second)}}


def summary(config: ContactSimConfig, scene: contact.ContactScene, result: ContactWalkResult) -> dict[str, Any]:
    scuffed = contact.require_contact(config).terrain == "plane" and result.outcome.stumbled and not scene.walker.kneed
    strikes = result.knee_strike_time_s
    numbers = walk.summarise_walk(result)
    return {
        **numbers,
        **add_stance_time(numbers, result),
        **walk.measure_pace(config, result),
        "advice": SCUFFED if scuffed else result.advice,
        "max_penetration_m": result.max_penetration_m,
        "slip_per_step_m": mean_of(result.slip_m),
        "slips_m": result.slip_m.tolist(),
        "rolling_per_step_m": mean_of(result.rolling_m),
        "rolling_m": result.rolling_m.tolist(),
        "energy_balance_residual_J": result.energy_balance_residual_J,
        "dissipated_J": losses_by_channel(scene.walker, result.dissipated_J),
        # Until version 0.3, the knee strike times are also stored under their old key, with -1 for a knee that did not
        # lock.
        **(
            {} if strikes is None or not strikes.size else {"knee_strikes_s": np.nan_to_num(strikes, nan=-1.0).tolist()}
        ),
        "jacobians": result.work.jacobians,
        "slope_rad": scene.walker.slope,
        **contact.scene_measures(scene),
        "left_out": list(omissions.contact_walk_omissions(config)),
    }


def mean_of(values: system.Floats) -> float | None:
    """Return the mean over steps, or None if no step was completed."""
    return float(np.mean(values)) if values.size else None


def groups(config: ContactSimConfig, scene: contact.ContactScene, result: ContactWalkResult) -> dict[str, Group]:
    stored: dict[str, Group] = {}
    if result.steps:
        stored["steps"] = Group(walk.steps_of(result, slip_m=result.slip_m, rolling_m=result.rolling_m))
    if scene.ground.terrain.has_pads:
        stored["terrain"] = pads_group(scene.ground.terrain, result.end_state[0])
    if result.samples is not None:
        stored["trajectory"] = trajectory_group(config, scene, result, result.samples)
    return stored


def pads_group(terrain: Terrain, end: float) -> Group:
    """Build the group of pads, from behind the start of the walk to beyond its end."""
    pitch = terrain.pitch
    numbers = np.arange(-2, int(np.ceil(end / pitch)) + 3)
    centres = numbers * pitch + np.where(numbers % 2, terrain.lanes[0] + pitch, 0.0)
    left = Variable(centres - 0.5 * pitch, ("pad",), "m", "start of the pad along the slope")
    right = Variable(centres + 0.5 * pitch, ("pad",), "m", "end of the pad along the slope")
    leg = Variable(2 - numbers % 2, ("pad",), "1", "leg whose lane the pad lies in")
    return Group({**numbered(numbers.size, "pad", "pad number"), "left_m": left, "right_m": right, "leg": leg})


def trajectory_group(
    config: ContactSimConfig, scene: contact.ContactScene, result: ContactWalkResult, samples: ContactSamples
) -> Group:
    """Build the group of the sampled quantities that the config's `outputs` select."""
    variables = {**walk.variables_over_time(time=samples.time_s, stance_leg=samples.stance + 1), **walk.leg_labels()}
    feet = sample_feet(scene.walker, samples)
    if "states" in config.outputs:
        variables |= state_variables(scene, samples.states)
        variables |= walk.variables_over_time(foot_along_m=feet[:, :, 0], foot_height_m=feet[:, :, 1] + samples.level)
    if "energies" in config.outputs:
        footholds = np.append(feet[:1, STANCE_FOOT, 0], result.touch_along_m)
        step = np.searchsorted(result.touch_time_s, samples.time_s, side="right")
        variables |= energy_variables(scene, samples, footholds[step], result.ground_m[step])
    if "forces" in config.outputs:
        depth = np.where(samples.has_ground > 0, np.maximum(0.0, -feet[:, :, 1]), 0.0)
        variables |= walk.variables_over_time(
            normal_force_N=feet[:, :, 2],
            friction_force_N=feet[:, :, 3],
            penetration_m=depth,
            slip_velocity_m_s=feet[:, :, 4],
        )
    return Group(variables)


def state_variables(scene: contact.ContactScene, y: system.Floats) -> dict[str, Variable]:
    """Return the motion of legs, shanks and torso, and the positions of hip and knees."""
    walker = scene.walker
    layout = scene.walker.whole
    names = [body.name for body in scene.assembly.bodies]
    n = len(names)
    angle = y[:, 2 : 2 + n]
    velocity = y[:, 4 + n :]
    tilted = y[:, 2 : 2 + n] + walker.slope
    s, c = np.sin(tilted), np.cos(tilted)
    upper = [leg[0] for leg in walker.legs]
    along = y[:, 0] + c @ layout.hip_x[:n] - s @ layout.hip_y[:n]
    height = y[:, 1] + s @ layout.hip_x[:n] + c @ layout.hip_y[:n]
    of_legs = {"angle": angle[:, upper], "velocity": velocity[:, upper]}
    variables = walk.variables_over_time(**of_legs, hip_along_m=along, hip_height_m=height)
    if walker.kneed:
        shanks, thighs = layout.knees.T.tolist()
        variables |= walk.rotation_variables("shank", angle[:, shanks], velocity[:, shanks])
        knees = np.zeros((2, len(y), 2))
        for leg, (thigh, shank) in enumerate(zip(thighs, shanks, strict=True)):
            hip = hinge_point(scene.assembly, names[thigh], names[thighs[1 - leg]])
            knee = hinge_point(scene.assembly, names[thigh], names[shank])
            ahead = knee[0] - hip[0]
            up = knee[1] - hip[1]
            knees[0, :, leg] = along + c[:, thigh] * ahead - s[:, thigh] * up
            knees[1, :, leg] = height + s[:, thigh] * ahead + c[:, thigh] * up
        variables |= walk.variables_over_time(knee_along_m=knees[0], knee_height_m=knees[1])
    if TORSO in names:
        variables |= walk.rotation_variables(TORSO, angle[:, names.index(TORSO)], velocity[:, names.index(TORSO)])
    return variables


def energy_variables(
    scene: contact.ContactScene, samples: ContactSamples, foothold: system.Floats, up: system.Floats
) -> dict[str, Variable]:
    """Return energies relative to the current foothold, as in the paper, and the energy balance from a fixed origin.

    foothold, up  (samples,) m, position of the stance foothold along the slope, and its height above the slope
    """
    kinetic, potential, total = sample_energies(scene.walker, samples).T
    driven = samples.driven_J.T
    losses = samples.dissipated_J
    walker = scene.walker
    at_foothold = walker.mass * (walker.gravity_down * up - walker.gravity_along * foothold)
    return walk.variables_over_time(
        kinetic_J=kinetic,
        potential_J=potential - at_foothold,
        mechanical_J=total - at_foothold,
        total_energy_J=total,
        **{loss.variable: losses[:, place] for place, loss in SAMPLED.items()},
        **({"push_off_J": driven[0], "hip_J": driven[1]} if driven.any() else {}),
        residual_J=total + losses.sum(axis=1) - driven.sum(axis=0) - total[:1],
    )
