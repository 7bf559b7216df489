"""Check that a walker pinned at the stance foot moves as in the rigid swing of legs that end at the centres of the
balls.
"""

import math

import ground_walkers as ground
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from system_rates import gradient_of, rate_of

from walkerlab.evidence.paper.appendix_a import CORRECTED, RigidWalker, accelerations
from walkerlab.physics.ground.walker import feet_motion, floating_state, place_on_ground

states = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
radii = st.floats(0.0, 0.2)
inertias = st.floats(0.0, 1.0)


def pinned(radius=0.001, inertia=0.0, foot=1, has_ground=False):
    walker = ground.compass(radius=radius, inertia=inertia, pinned_foot=foot)
    return place_on_ground(walker, (has_ground, has_ground), pinned=True)


@given(state=states, radius=radii, inertia=inertias)
def test_pinned_walker_swings_like_a_rigid_one_with_legs_shorter_by_the_foot_radius(state, radius, inertia):
    """The hinge is the centre of the ball, which is L - r from the hip and a - r from the mass of the leg."""
    rigid = RigidWalker(1.0 - radius, 0.5 - radius, 5.0, 10.0, inertia, ground.GRAVITY, ground.SLOPE, CORRECTED)
    found = rate_of(pinned(radius, inertia), state)
    expected = (*state[2:], *accelerations(rigid, *state))
    np.testing.assert_allclose(found, expected, atol=1e-11 * (1.0 + np.abs(expected).max()))


@given(state=states)
def test_pinning_the_other_foot_swaps_the_roles_of_the_legs(state):
    t_1, t_2, w_1, w_2 = state
    one = rate_of(pinned(), state)
    other = rate_of(pinned(foot=0), (t_2, t_1, w_2, w_1))
    np.testing.assert_allclose((other[3], other[2]), one[2:], atol=1e-11 * (1.0 + np.abs(one).max()))


@given(state=states, inertia=inertias)
def test_derivatives_of_the_pinned_walker_equal_finite_differences(state, inertia):
    check_jacobian(pinned(inertia=inertia), state)


def check_jacobian(system, state):
    J = gradient_of(system, state)
    columns = []
    for j in range(4):
        move = 1e-6 * np.eye(4)[j]
        below, above = (np.array(rate_of(system, np.array(state) + s * move)) for s in (-1, 1))
        columns.append((above - below) / 2e-6)
    expected = np.array(columns).T
    assert np.abs(J - expected).max() < 1e-7 * (1.0 + np.abs(expected).max())


@given(
    angle=st.floats(0.15, 0.4),
    depth=st.floats(1e-3, 8e-3),
    swing=st.sampled_from([-3.0, -0.4, 0.5, 2.0]),
    stance=st.sampled_from([-2.0, -0.3, 1.0]),
    foot=st.sampled_from([0, 1]),
)
def test_derivatives_of_a_pinned_stance_are_correct_with_the_other_foot_in_the_ground(
    angle, depth, swing, stance, foot
):
    system = pinned(radius=0.01, inertia=0.1, foot=foot, has_ground=True)
    # The legs end at the centres of the balls. The swing foot is as deep in the ground as its centre is below the
    # hinge.
    other = -math.acos(math.cos(angle) + depth / 0.99)
    legs = np.array([[other, angle], [swing, stance]])[:, :: 1 if foot == 1 else -1]
    legs[0] -= system.form.slope
    state = tuple(legs.ravel().tolist())
    without = np.array(rate_of(system._replace(has_ground=np.zeros(2, np.int8)), state))
    # The ground lets go of a foot that rises fast.
    assume(np.abs(np.array(rate_of(system, state)) - without).max() > 1.0)
    check_jacobian(system, state)


@given(state=states, radius=radii)
def test_hinge_stays_fixed_and_the_foot_just_touches(state, radius):
    walker = ground.compass(radius=radius)
    full = floating_state(walker.forms[1, 0], state, 8)
    motion = feet_motion(walker.whole, full)[1]
    assert motion.along == pytest.approx(0.0, abs=1e-12)
    assert motion.height == pytest.approx(0.0, abs=1e-12)
    assert motion.vertical_velocity == pytest.approx(0.0, abs=1e-12)
    assert motion.slip == pytest.approx(radius * state[3], abs=1e-12)  # The ball turns about the hinge.
    assert (full[2:4], full[6:]) == (state[:2], state[2:])


@given(state=states)
def test_velocities_of_the_floating_state_are_the_rates_of_its_positions(state):
    form = pinned().form
    h = 1e-6
    moved = [tuple(np.array(state) + np.array([s * h * state[2], s * h * state[3], 0.0, 0.0])) for s in (-1, 1)]
    below, above = (np.array(floating_state(form, y, 8)) for y in moved)
    np.testing.assert_allclose((above - below)[:2] / (2 * h), floating_state(form, state, 8)[4:6], atol=1e-8)


def test_pinned_walker_has_only_two_angles():
    form = pinned().form
    assert (form.places, form.bodies) == (0, 2)
