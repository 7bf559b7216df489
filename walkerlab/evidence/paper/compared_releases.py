"""Contact walks from the same gait that differ only in the moment of the trailing knee's release.

Each is compared with the corresponding rigid model, where a knee released during compression is rigid in the impact,
and a knee released at first touch is free.
"""

from dataclasses import replace
from typing import Any

from walkerlab.config.reads import ContactConfig
from walkerlab.physics.ground.walker import changed_forms
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, losses_by_channel
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import State
from walkerlab.pipeline.stages.walk import last_step, summarise_walk
from walkerlab.scene.contact import ContactScene, contact_scene, start_state
from walkerlab.scene.omissions import omission
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import add_drives, have_different_legs

RELEASES = {"compression": False, "touch": True}
"""Values of the config's `release`, and whether each releases the knee at the leading foot's first touch."""
CONTACT_STEPS = 20  # enough to settle on another gait, or to fall
RIGID_STEPS = 200
RIGID_TOLERANCES = Tolerances("dop853", 1e-8, 1e-10, 2_000_000)
CONTACT_TOLERANCES = Tolerances("radau5", 1e-8, 1e-10, 2_000_000)
LOCK_OMISSION = omission(
    "ideal against compliant lock",
    "a walk has one lock; try the other by `walkerlab contact-sim --set walker.knee.lock=compliant`",
    "compiling the contact walk a second time",
)


def compare_releases(config: ContactConfig, state: State, pitch_m: float) -> dict[str, Any] | None:
    """Simulate up to 20 steps from a gait with each knee release.

    Returns None for walkers without knees, with a push-off or with legs that differ.
    """
    scene = contact_scene(config, pitch_m, pitch_m)
    if not scene.walker.kneed or config.push_off.impulse_N_s != 0.0 or have_different_legs(config):
        return None
    releases = {}
    for name, at_touch in RELEASES.items():
        released = replace(scene, walker=changed_forms(scene.walker, release_at_touch=at_touch))
        walk = released.walk(start_state(scene, state), CONTACT_STEPS, CONTACT_TOLERANCES)
        model = rigid_on_slope(
            assembly_of(config.walker, rigid=True), config.gravity_m_s2, config.slope_rad, not at_touch
        )
        rigid = take_walk(add_drives(model, config), RIGID_TOLERANCES, state, RIGID_STEPS)
        last = {"period_s": float(rigid.periods_s[-1]), "length_m": float(rigid.lengths_m[-1])} if rigid.steps else {}
        of_rigid = {"outcome": rigid.outcome.label, "steps": rigid.steps, "of": RIGID_STEPS, **last}
        releases[name] = {**walk_report(scene, walk), "rigid": of_rigid}
    return releases


def walk_report(scene: ContactScene, walk: ContactWalkResult) -> dict[str, Any]:
    """Summarise a walk: outcome, last step, knee strike, and dissipation per step by channel."""
    steps = walk.steps
    lost = losses_by_channel(scene.walker, walk.dissipated_J)
    return {
        "outcome": walk.outcome.label,
        "steps": steps,
        "of": CONTACT_STEPS,
        "knee_strike_s": None,
        **last_step(summarise_walk(walk)),
        "dissipated_J_per_step": {name: joules / steps for name, joules in lost.items()} if steps else None,
    }
