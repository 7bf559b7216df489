"""Walks on compliant ground to measure methods by: the config's contact, and one near the rigid limit."""

from __future__ import annotations

from walkerlab.benchmarks.trials import ContactTrial
from walkerlab.config.reads import ContactConfig
from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_run import JudgedGround
from walkerlab.mechanics.standing import swing_foot
from walkerlab.scene.contact import ContactScene, contact_scene, start_state
from walkerlab.scene.rigid import rigid_walker

STIFFER, SLOWER = 100.0, 0.01  # the near-rigid contact: stiffness and damping times, creep velocities times


def contact_trial(config: ContactConfig, state: tuple[float, ...], length_m: float | None, steps: int) -> ContactTrial:
    """Steps with the config's own contact."""
    scene = scene_for(config, state, length_m)
    return trial_of(scene, scene.walker, state, steps, "contact")


def near_rigid_trial(
    config: ContactConfig, state: tuple[float, ...], length_m: float | None, steps: int
) -> ContactTrial:
    """Steps on stiffer ground that creeps less, where integrators have a harder life."""
    scene = scene_for(config, state, length_m)
    walker = scene.walker
    normal = walker.normal._replace(
        stiffness=STIFFER * walker.normal.stiffness, damping=STIFFER * walker.normal.damping
    )
    stiffer = walker._replace(normal=normal, friction=walker.friction.with_creep(SLOWER))
    return trial_of(scene, stiffer, state, steps, "contact-near-rigid")


def scene_for(config: ContactConfig, state: tuple[float, ...], length_m: float | None) -> ContactScene:
    """The config's scene on pads of the rigid step length, or of the start's own if there is no gait."""
    rigid = rigid_walker(config, config.equations)
    length = length_m or abs(swing_foot(rigid, state)[1])
    return contact_scene(config, length, own_pitch_m=length)


def trial_of(
    scene: ContactScene, walker: ContactWalker, state: tuple[float, ...], steps: int, name: str
) -> ContactTrial:
    """The trial of a walker in a scene."""
    ground = JudgedGround(scene.terrain, scene.frame)
    return ContactTrial(walker, ground, start_state(scene, state), STANCE_FOOT, steps, name)
