"""Kneed walkers on plane compliant ground for tests: Hsu Chen's walker, with the paper's contact scaled by mass."""

import functools

import numpy as np
from contact_walks import settings

from walkerlab.config.contact import Contact
from walkerlab.physics.ground.compliant import KneeRules, contact_walker
from walkerlab.physics.hybrid.contact_state import Frame, JudgedGround
from walkerlab.scene.contact import TERRAINS, ContactScene, ground_laws, start_state
from walkerlab.scene.parts import Arc, Limb, kneed_legs

THIGH, SHANK, HIP_MASS = Limb(0.5, 0.5, 0.325), Limb(0.5, 0.05, 0.125), 0.5
MASS, PAPER_MASS, GRAVITY, SLOPE = 1.6, 20.0, 9.81, 0.0504
# rigid gait just after heel strike, recomputed: half the angle between the legs, and the rates
HALF, STANCE_RATE, SWING_RATE = 0.2385854603, -1.1095873312, -0.0571481063
PERIOD, STEP = 0.564328, 2.0 * np.sin(HALF)
ANGLES = (-HALF - SLOPE, HALF - SLOPE) * 2  # thighs, then shanks
RATES = (SWING_RATE, STANCE_RATE) * 2
# in the order of the rigid model: swing thigh, straight stance leg, swing shank
RIGID_ANGLES, RIGID_RATES = (*ANGLES[:2], ANGLES[0]), (*RATES[:2], RATES[0])


def scene_of(rules=None, radius=0.0, shank=SHANK, slope=SLOPE, scale=1.0, **contact):
    """Return the walker on plane ground. `scale` multiplies every length, with the same gravity."""
    limbs = [Limb(scale * x.length_m, x.mass_kg, scale * x.mass_below_m) for x in (THIGH, shank)]
    law = {
        "units": "si", "stiffness": 1e5 * 1000.0**2.2 * MASS / PAPER_MASS / scale**2.2,
        "damping": 9e4 * MASS / PAPER_MASS / scale**0.5, "full_damping_penetration": 1e-4 * scale,
        "stiction_velocity": 0.1 * scale**0.5, "friction_velocity": 1.0 * scale**0.5, "terrain": "plane",
    }  # fmt: skip
    ground, parts = Contact(**(law | contact)), kneed_legs(*limbs, HIP_MASS, Arc(scale * radius))
    walker = contact_walker(parts, *ground_laws(ground), GRAVITY, slope, rules)
    frame = Frame(scale, np.sqrt(scale / GRAVITY), locate_switching=True)
    laid = JudgedGround(TERRAINS[ground.terrain](scale * STEP, 0.0), frame)
    return ContactScene(walker, laid, False, scale * STEP, parts)


@functools.cache
def walked(steps=3, rules=None, interval=None, tolerance=1e-8, scale=1.0, **changes):
    """Simulate a walk that starts in the rigid gait."""
    scene = scene_of(rules, scale=scale, **changes)
    start = start_state(scene, (*RIGID_ANGLES, *(rate / scale**0.5 for rate in RIGID_RATES)))
    return scene.walk(start, steps, settings(tolerance), interval)


AT_TOUCH = KneeRules(release_at_touch=True)
