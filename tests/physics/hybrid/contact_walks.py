"""Walks on compliant ground for tests, with config keys changed as by --set, or with another start."""

import functools

from walkerlab.config.loader import load
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import contact_scene, start_state

# the corrected rigid gait at 1 deg
FIXED_POINT = (-0.2044455, 0.1695390, -0.6057394, -0.8617140)
RIGID_STEP, RIGID_PERIOD = 0.3718088, 0.7036485
ONE_DEGREE = "slope_deg=1"
TOLERANCE = 1e-7
PLENTY = 10_000_000


def faster(factor, start=FIXED_POINT):
    """Return the start with both velocities multiplied by a factor."""
    return (*start[:2], factor * start[2], factor * start[3])


@functools.cache
def scene_of(*sets, step=RIGID_STEP):
    own_slope = any(setting.startswith("slope_") for setting in sets)
    return contact_scene(load(None, sets if own_slope else (ONE_DEGREE, *sets)).config, step)


def settings(tolerance=TOLERANCE, method="radau5", budget=PLENTY):
    return Tolerances(method, tolerance, 1e-2 * tolerance, budget)


@functools.cache
def walked(*sets, start=FIXED_POINT, steps=10, step=RIGID_STEP, interval=None, **method):
    """Simulate a walk in the paper's scene at 1 deg, with the settings `sets`."""
    scene = scene_of(*sets, step=step)
    return scene.walk(start_state(scene, start), steps, settings(**method), interval)
