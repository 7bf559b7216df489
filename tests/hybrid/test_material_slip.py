"""Slip is what a foot's material moves; what a ball rolls is no slip."""

import numpy as np
import pytest
from contact_walks import FIXED_POINT, scene_of, walked

from walkerlab.hybrid.contact_run import sampled_feet
from walkerlab.hybrid.outcome import Outcome

GLUE = ("contact.static_friction=100", "contact.dynamic_friction=100")
ROUND = ("walker.foot_radius_m=0.3", "contact.terrain=after-mid-swing")


def test_slip_is_the_integral_of_the_material_points_velocity():
    walk, scene = walked(interval=5e-6, steps=2, tolerance=1e-9), scene_of()
    feet = np.zeros((walk.samples.time_s.size, 2, 5))
    sampled_feet(scene.walker, walk.samples.states, walk.samples.carried, feet)
    stood = (feet[:, 1, 1] <= 0.0) & (walk.samples.time_s < walk.touch_time_s[0] + 0.05)
    last = int(np.flatnonzero(stood)[-1])
    slip = np.trapezoid(feet[: last + 1, 1, 4], walk.samples.time_s[: last + 1])
    rolled = -0.001 * (walk.samples.states[last, 3] - walk.samples.states[0, 3])
    # what a foot that moves at some 0.2 m/s covers from the last sample to its lift
    assert walk.slip_m[0] == pytest.approx(slip, abs=2e-6)
    assert walk.rolling_m[0] == pytest.approx(rolled, abs=2e-6)


def test_a_round_foot_on_ground_like_glue_rolls_and_walks():
    """It rolls by a quarter of its step, which is no slide."""
    walk = walked(*ROUND, *GLUE, steps=4, start=FIXED_POINT)
    assert walk.outcome is not Outcome.SLID
    assert walk.touch_time_s.size >= 1
    assert np.all(walk.rolling_m > 0.09)
    assert np.all(np.abs(walk.slip_m) < 1e-3 * walk.rolling_m)


def test_a_hinged_foot_neither_slips_nor_rolls():
    walk = walked("contact.stance=pinned", steps=1)
    assert walk.slip_m[0] == walk.rolling_m[0] == 0.0
