"""Check that slip is the motion of the foot's material at the contact, so that rolling does not count."""

from functools import partial

import kneed_walks
import numpy as np
import pytest
from contact_walks import FIXED_POINT, scene_of, walked

from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.contact_result import sample_feet

GLUE = ("contact.static_friction=100", "contact.dynamic_friction=100")
ROUND = ("walker.foot_radius_m=0.3", "contact.terrain=after-mid-swing")


def test_slip_is_the_integral_of_the_material_velocity():
    walk, scene = walked(interval=5e-6, steps=2, tolerance=1e-9), scene_of()
    feet = sample_feet(scene.walker, walk.samples)
    stood = (feet[:, 1, 1] <= 0.0) & (walk.samples.time_s < walk.touch_time_s[0] + 0.05)
    last = int(np.flatnonzero(stood)[-1])
    slip = np.trapezoid(feet[: last + 1, 1, 4], walk.samples.time_s[: last + 1])
    rolled = -0.001 * (walk.samples.states[last, 3] - walk.samples.states[0, 3])
    # distance that a foot at about 0.2 m/s covers from the last sample to its lift
    assert walk.slip_m[0] == pytest.approx(slip, abs=2e-6)
    assert walk.rolling_m[0] == pytest.approx(rolled, abs=2e-6)


def test_round_foot_on_sticky_ground_rolls_and_walks():
    """It rolls by a quarter of its step, which must not count as a slide."""
    walk = walked(*ROUND, *GLUE, steps=4, start=FIXED_POINT)
    assert walk.outcome is not Outcome.SLID
    assert walk.touch_time_s.size >= 1
    assert np.all(walk.rolling_m > 0.09)
    assert np.all(np.abs(walk.slip_m) < 1e-3 * walk.rolling_m)


def test_pinned_foot_slips_and_rolls_only_after_its_release():
    """Without the pin, the same foot slips and rolls by half a millimetre."""
    walk = walked("contact.stance=pinned", steps=1)
    assert 0.0 < abs(walk.slip_m[0]) < 1e-6
    assert abs(walk.rolling_m[0]) < 1e-6


@pytest.mark.parametrize("walked_of", [walked, partial(walked, "contact.stance=pinned"), kneed_walks.walked],
                         ids=["compass", "pinned", "kneed"])  # fmt: skip
@pytest.mark.parametrize("steps", [1, 2])
def test_slip_of_the_last_step_is_the_same_in_a_longer_walk(walked_of, steps):
    short, longer = walked_of(steps=steps), walked_of(steps=3)
    np.testing.assert_allclose(short.slip_m, longer.slip_m[:steps], rtol=1e-9)
    np.testing.assert_allclose(short.rolling_m, longer.rolling_m[:steps], rtol=1e-9)


def test_walk_ends_at_its_last_touch_even_if_the_foot_lifts_later():
    short, longer = walked(steps=2), walked(steps=3)
    assert short.end_time_s == short.touch_time_s[-1] == longer.touch_time_s[1]
    assert short.work[0] < longer.work[0]


@pytest.mark.parametrize(("steps", "outcome"), [(1, Outcome.WALKED), (2, Outcome.BUDGET_EXHAUSTED)])
def test_slip_of_a_step_is_missing_until_its_foot_lifts(steps, outcome):
    until_touch = int(walked(steps=1).work[0])
    walk = walked(steps=steps, budget=until_touch + 10)
    assert walk.outcome is outcome
    assert walk.touch_time_s.size == 1
    assert walk.slip_m.size == walk.rolling_m.size == 0
