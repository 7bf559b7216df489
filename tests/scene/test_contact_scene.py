"""Tests of the scene that is built from a config with a contact block, and of its start."""

import functools
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import typeof

from walkerlab.config.loader import load
from walkerlab.physics.ground.friction import Coulomb, Frictionless
from walkerlab.physics.ground.terrain import after_mid_swing, checkerboard
from walkerlab.physics.ground.walker import feet_motion
from walkerlab.physics.hybrid.contact_crossings import hip_height
from walkerlab.scene.contact import contact_scene, scene_measures, start_state
from walkerlab.scene.omissions import contact_walk_omissions
from walkerlab.scene.rigid import rigid_walker

STEP = 0.3714


@functools.cache
def scene_of(*sets):
    return contact_scene(load(None, sets).config, STEP)


@pytest.mark.parametrize("radius", [0.0, 0.001, 0.1])
@given(theta_2=st.floats(0.05, 0.4), w_1=st.floats(-3.0, 3.0), w_2=st.floats(-3.0, 3.0))
def test_walk_starts_with_the_stance_foot_touching_and_rolling(radius, theta_2, w_1, w_2):
    scene = scene_of(f"walker.foot_radius_m={radius}")
    rigid = (-2 * 0.0174 - theta_2, theta_2, w_1, w_2)
    start = start_state(scene, rigid)
    swing, stance = feet_motion(scene.walker.whole, start)
    np.testing.assert_allclose((stance.along, stance.height), 0.0, atol=1e-14)
    np.testing.assert_allclose((stance.slip, stance.vertical_velocity), 0.0, atol=1e-13)
    assert (start[2:4], start[6:]) == (rigid[:2], rigid[2:])
    # Both legs have one length and their balls are on the slope, so they are symmetric and the other ball touches as
    # well.
    assert swing.height == pytest.approx(0.0, abs=1e-14)
    apart = 2 * (1.0 - radius) * math.sin(theta_2 + 0.0174)
    assert stance.along - swing.along == pytest.approx(apart, abs=1e-13)
    tilted = np.array(start[2:4]) + scene.walker.slope
    assert hip_height(scene.walker.whole, np.sin(tilted), np.cos(tilted), start) == pytest.approx(
        radius + (1.0 - radius) * math.cos(theta_2 + 0.0174), abs=1e-13
    )


def test_point_foot_starts_like_the_pinned_foot():
    """A foot without radius turns about the hinge when it rolls."""
    rigid = (-0.2042, 0.1694, -0.6, -0.86)
    free, pinned = (
        start_state(scene_of("walker.foot_radius_m=0", f"contact.stance={stance}"), rigid)
        for stance in ("free", "pinned")
    )
    assert free == pinned


def test_adams_units_of_the_paper_are_converted_to_si():
    walker = scene_of().walker
    assert walker.normal == pytest.approx((1e5 * 1000**2.2, 2.2, 90e3, 1e-4))
    assert walker.friction == pytest.approx((0.9, 0.7, 0.1, 1.0))
    assert isinstance(walker.friction, Coulomb)


def test_static_penetration_is_computed_for_the_whole_weight_on_one_foot():
    """It is 0.059 mm, and the contact is over-damped. Compare both with values computed in N and mm."""
    scene = scene_of()
    depth_mm = (20.0 * 9.81 / 1e5) ** (1 / 2.2)
    measures = scene_measures(scene)
    assert measures["static_penetration_m"] == pytest.approx(depth_mm / 1000.0)
    assert depth_mm == pytest.approx(0.059, abs=5e-4)
    stiffness_N_per_m = 2.2 * 1e5 * depth_mm**1.2 * 1000.0
    assert measures["damping_ratio"] == pytest.approx(90e3 / (2 * math.sqrt(stiffness_N_per_m * 20.0)))
    assert measures["damping_ratio"] > 1.0


def test_frictionless_scene_uses_a_frictionless_law():
    config = load(None, ("contact.friction=none",)).config
    scene = contact_scene(config, STEP)
    assert isinstance(scene.walker.friction, Frictionless)
    assert any("friction" in row["why"] for row in contact_walk_omissions(config))


def test_pad_pitch_follows_the_config():
    config = load(None, ()).config
    assert contact_scene(config, STEP).ground.terrain == checkerboard(STEP, (-STEP, 0.0))
    assert scene_of("contact.pad_pitch=0.36").pitch_m == 0.36
    own = load(None, ("contact.pad_pitch=own",)).config
    assert contact_scene(own, STEP, 0.3608).pitch_m == 0.3608
    with pytest.raises(ValueError, match="own"):
        contact_scene(own, STEP)
    assert scene_of("contact.terrain=after-mid-swing").ground.terrain == after_mid_swing(STEP)


def test_pinned_first_step_has_two_degrees_of_freedom():
    assert not scene_of().pinned
    scene = scene_of("contact.stance=pinned")
    pinned = scene.walker.forms[1, 0]
    assert scene.pinned
    assert (pinned.places, pinned.bodies) == (0, 2)


@pytest.mark.parametrize("terrain", ["checkerboard", "after-mid-swing", "plane"])
@pytest.mark.parametrize("heights", ["[]", "[0.001]"])
def test_scene_sent_to_another_process_uses_the_same_compiled_code(terrain, heights):
    scene = scene_of(f"contact.terrain={terrain}", f"ground.heights_m={heights}")
    sent = pickle.loads(pickle.dumps(scene))
    assert typeof(sent.ground) == typeof(scene.ground)
    assert typeof(sent.walker) == typeof(scene.walker)


def test_rigid_walker_sent_to_another_process_uses_the_same_compiled_code():
    config = load(None).config
    walker = rigid_walker(config, config.equations)
    sent = pickle.loads(pickle.dumps(walker))
    assert typeof(np.asarray(sent)) == typeof(np.asarray(walker))
    assert sent == walker
    assert not np.asarray(sent).flags.writeable
