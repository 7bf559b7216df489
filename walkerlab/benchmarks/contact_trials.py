"""Walks on compliant ground to measure methods by: the config's contact, and one near the rigid limit."""

from dataclasses import replace

from walkerlab.benchmarks.trials import ContactTrial
from walkerlab.config.reads import ContactConfig
from walkerlab.mechanics.standing import swing_foot
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.scene.rigid import rigid_walker

STIFFER, SLOWER = 100.0, 0.01  # the near-rigid contact: stiffness and damping times, creep velocities times


def contact_trial(config: ContactConfig, state: tuple[float, ...], length_m: float | None, steps: int) -> ContactTrial:
    """Steps with the config's own contact, on pads of the rigid step length, or of the start's own without a gait."""
    length = length_m or abs(swing_foot(rigid_walker(config, config.equations), state)[1])
    scene = contact_scene(config, length, own_pitch_m=length)
    return ContactTrial(scene.walker, scene.ground, start_state(scene, state), steps, "contact")


def near_rigid_trial(
    config: ContactConfig, state: tuple[float, ...], length_m: float | None, steps: int
) -> ContactTrial:
    """Steps on stiffer ground that creeps less, where integrators have a harder life."""
    trial = contact_trial(config, state, length_m, steps)
    law, friction = trial.walker.normal, trial.walker.friction.with_creep(SLOWER)
    normal = law._replace(stiffness=STIFFER * law.stiffness, damping=STIFFER * law.damping)
    return replace(trial, walker=trial.walker._replace(normal=normal, friction=friction), name="contact-near-rigid")
