"""Contact walks on which methods are measured: one with the config's contact, and one near the rigid limit."""

from dataclasses import replace

from walkerlab.config.reads import ContactConfig
from walkerlab.evidence.benchmarks.trials import ContactTrial
from walkerlab.physics.solvers.system import State
from walkerlab.scene.contact import contact_scene, start_state

# near-rigid contact: factors on stiffness and damping, and on creep velocities
STIFFNESS_FACTOR = 100.0
CREEP_FACTOR = 0.01


def contact_trial(
    config: ContactConfig, state: State, length_m: float, steps: int, asymmetry: float = 0.0
) -> ContactTrial:
    """Set up the walk with the config's contact, on pads of length `length_m`. `asymmetry` as in `contact_scene`."""
    scene = contact_scene(config, length_m, length_m, asymmetry)
    return ContactTrial(scene.walker, scene.ground, start_state(scene, state), steps, "contact")


def stiff_ground_trial(config: ContactConfig, state: State, length_m: float, steps: int) -> ContactTrial:
    """Set up a walk that is harder to integrate: on much stiffer ground with less creep."""
    trial = contact_trial(config, state, length_m, steps)
    friction = trial.walker.friction.scale_creep(CREEP_FACTOR)
    normal = trial.walker.normal.stiffen(STIFFNESS_FACTOR, STIFFNESS_FACTOR, 1.0)
    return replace(trial, walker=trial.walker._replace(normal=normal, friction=friction), name="contact-near-rigid")
