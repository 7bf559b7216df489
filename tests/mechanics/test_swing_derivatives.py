"""Derivatives of the swing phase against differences, and the symmetries that its equations have."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walkerlab.mechanics.rigid_compass import AS_PRINTED, CORRECTED, RigidWalker, accelerations
from walkerlab.mechanics.rigid_swing import SwingVariation, acceleration_gradients, swing_jacobian
from walkerlab.mechanics.trigonometry import sine_cosine
from walkerlab.solvers.system import blank, derivative

PAPER = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, 0.0174, CORRECTED)
angles, rates = st.floats(-1.2, 1.2), st.floats(-3.0, 3.0)
states = st.tuples(angles, angles, rates, rates)
signs = st.sampled_from([CORRECTED, AS_PRINTED])
STEP = 1e-5
# truncation STEP^2 and rounding eps/STEP of central differences, with the size of third derivatives
DIFFERENCE_ERROR = 1e-7


def central_difference(f, state, j):
    ahead, behind = np.array(state), np.array(state)
    ahead[j] += STEP
    behind[j] -= STEP
    return (np.array(f(ahead)) - np.array(f(behind))) / (2 * STEP)


@given(states, signs, st.floats(0.0, 0.5))
def test_gradients_are_the_slopes_of_the_accelerations(state, sign, inertia):
    walker = PAPER._replace(c21_sign=sign, leg_inertia=inertia)
    gradients = np.array(acceleration_gradients(walker, *state))
    for j in range(4):
        slopes = central_difference(lambda y: accelerations(walker, *y), state, j)
        assert gradients[:, j] == pytest.approx(slopes, rel=1e-7, abs=DIFFERENCE_ERROR * np.abs(gradients).max())


@given(states)
def test_jacobian_is_the_slope_of_the_right_hand_side(state):
    J = np.empty((4, 4))
    swing_jacobian(PAPER, 0.0, state, J)
    for j in range(4):
        slopes = central_difference(lambda y: derivative(PAPER, 0.0, tuple(y)), state, j)
        assert J[:, j] == pytest.approx(slopes, rel=1e-7, abs=DIFFERENCE_ERROR * np.abs(J).max())


@given(states, st.lists(st.floats(-2.0, 2.0), min_size=12, max_size=12))
def test_variational_equations_are_the_jacobian_times_the_directions(state, directions):
    system = SwingVariation(PAPER)
    rate = derivative(system, 0.0, (*state, *directions))
    assert len(rate) == len(blank(system))
    J = np.empty((4, 4))
    swing_jacobian(PAPER, 0.0, state, J)
    assert rate[:4] == derivative(PAPER, 0.0, state)
    expected = J @ np.array(directions).reshape(4, 3)
    assert np.array(rate[4:]).reshape(4, 3) == pytest.approx(expected, rel=1e-12, abs=1e-11)


@given(states, signs)
def test_mirrored_walker_accelerates_as_its_mirror_image(state, sign):
    walker = PAPER._replace(c21_sign=sign)
    mirrored = accelerations(walker, *(-value for value in state))
    assert mirrored == tuple(-alpha for alpha in accelerations(walker, *state))


@given(states, signs, st.floats(0.2, 5.0), st.floats(0.2, 5.0), st.floats(0.2, 5.0))
def test_scaled_walker_moves_alike_in_its_own_time(state, sign, length, mass, gravity):
    walker = PAPER._replace(c21_sign=sign, leg_inertia=0.1)
    scaled = RigidWalker(
        length * walker.leg_length,
        length * walker.foot_to_mass,
        mass * walker.leg_mass,
        mass * walker.hip_mass,
        mass * length**2 * walker.leg_inertia,
        gravity * walker.gravity,
        walker.slope,
        sign,
    )
    rate = np.sqrt(gravity / length)
    moved = accelerations(scaled, state[0], state[1], rate * state[2], rate * state[3])
    expected = rate**2 * np.array(accelerations(walker, *state))
    assert np.array(moved) == pytest.approx(expected, rel=1e-10, abs=1e-10 * np.abs(expected).max())


@given(st.floats(-20.0, 20.0))
def test_sine_and_cosine_are_exact_to_the_last_place(x):
    sine, cosine = sine_cosine(x)
    assert abs(sine - np.sin(x)) <= np.spacing(abs(np.sin(x)))
    assert abs(cosine - np.cos(x)) <= np.spacing(abs(np.cos(x)))
