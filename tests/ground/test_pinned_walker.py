"""The walker hinged at its stance foot: the rigid swing on a leg that ends at the ball's centre."""

import math

import ground_walkers as ground
import numpy as np
import pytest
from compass_parts import compass_assembly
from hypothesis import assume, given
from hypothesis import strategies as st

from walkerlab.ground.compliant import pinned_walker
from walkerlab.ground.pinned import floating_state
from walkerlab.ground.walker import foot_motion
from walkerlab.mechanics.tree import sines_cosines
from walkerlab.paper.appendix_a import CORRECTED, RigidWalker, accelerations
from walkerlab.solvers.in_tuples import blank, derivative, jacobian

states = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
radii = st.floats(0.0, 0.2)
inertias = st.floats(0.0, 1.0)


def hinged(radius=0.001, inertia=0.0, foot=1, slope=ground.SLOPE, along=0.0):
    walker = ground.compass(radius=radius, inertia=inertia, slope=slope)
    return pinned_walker(compass_assembly(ground.parts(radius, inertia)), walker, foot, along)


@given(state=states, radius=radii, inertia=inertias)
def test_hinged_walker_is_the_rigid_swing_with_a_leg_shorter_by_the_radius(state, radius, inertia):
    """The hinge is the centre of the ball: L - r from the hip, a - r from the leg's mass."""
    rigid = RigidWalker(1.0 - radius, 0.5 - radius, 5.0, 10.0, inertia, ground.GRAVITY, ground.SLOPE, CORRECTED)
    found = derivative(hinged(radius, inertia), 0.0, state)
    expected = (*state[2:], *accelerations(rigid, *state))
    np.testing.assert_allclose(found, expected, atol=1e-11 * (1.0 + np.abs(expected).max()))


@given(state=states)
def test_hinged_on_the_other_foot_the_legs_change_roles(state):
    t_1, t_2, w_1, w_2 = state
    one = derivative(hinged(), 0.0, state)
    other = derivative(hinged(foot=0), 0.0, (t_2, t_1, w_2, w_1))
    np.testing.assert_allclose((other[3], other[2]), one[2:], atol=1e-11 * (1.0 + np.abs(one).max()))


@given(state=states, inertia=inertias)
def test_derivatives_of_the_hinged_walker_are_those_of_differences(state, inertia):
    check_jacobian(hinged(inertia=inertia), state)


def check_jacobian(system, state):
    J = np.zeros((4, 4))
    jacobian(system, 0.0, state, J)
    columns = []
    for j in range(4):
        move = 1e-6 * np.eye(4)[j]
        below, above = (np.array(derivative(system, 0.0, tuple(np.array(state) + s * move))) for s in (-1, 1))
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
def test_derivatives_hold_with_the_other_foot_in_the_ground(angle, depth, swing, stance, foot):
    system = hinged(radius=0.01, inertia=0.1, foot=foot)._replace(has_ground=True)
    # legs that end at the balls' centres: by as much as the swing leg reaches further down
    other = -math.acos(math.cos(angle) + depth / 0.99)
    legs = np.array([[other, angle], [swing, stance]])[:, :: 1 if foot == 1 else -1]
    legs[0] -= system.walker.slope
    state = tuple(legs.ravel().tolist())
    without = np.array(derivative(system._replace(has_ground=False), 0.0, state))
    # a foot that rises fast is let go
    assume(np.abs(np.array(derivative(system, 0.0, state)) - without).max() > 1.0)
    check_jacobian(system, state)


@given(state=states, along=st.floats(-10.0, 10.0), radius=radii)
def test_the_hinge_stays_where_it_is_and_the_ball_just_touches(state, along, radius):
    system = hinged(radius=radius, along=along)
    full = floating_state(system, state)
    s, c = sines_cosines(system.walker.tree, full, 2, system.walker.slope)
    motion = foot_motion(system.walker, system.walker.feet[1], s, c, full)
    assert motion.along == pytest.approx(along, abs=1e-12)
    assert motion.height == pytest.approx(0.0, abs=1e-12)
    assert motion.vertical_velocity == pytest.approx(0.0, abs=1e-12)
    assert motion.slip == pytest.approx(radius * state[3], abs=1e-12)  # the ball turns over the hinge
    assert (full[2:4], full[6:]) == (state[:2], state[2:])


@given(state=states)
def test_velocities_of_the_floating_state_are_those_of_its_positions(state):
    system = hinged()
    h = 1e-6
    moved = [tuple(np.array(state) + np.array([s * h * state[2], s * h * state[3], 0.0, 0.0])) for s in (-1, 1)]
    below, above = (np.array(floating_state(system, y)) for y in moved)
    np.testing.assert_allclose((above - below)[:2] / (2 * h), floating_state(system, state)[4:6], atol=1e-8)


def test_the_hinged_walker_has_two_angles_only():
    assert blank(hinged()) == (0.0,) * 4
