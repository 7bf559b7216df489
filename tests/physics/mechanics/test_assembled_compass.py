"""Compare the compass assembled from its parts with Appendix A of the paper and with the rigid model."""

import math

import numpy as np
import pytest
from compass_parts import CompassParts, compass_assembly
from hypothesis import given, settings
from hypothesis import strategies as st
from printed_compass import released_mass_matrix
from system_rates import rate_of
from tree_equations import mass_matrix_and_bias

from walkerlab.physics.ground.compliant import contact_walker
from walkerlab.physics.ground.friction import Frictionless
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.ground.walker import place_on_ground
from walkerlab.physics.mechanics.parts import Anchor

ROUNDING = 1e-12  # a few dozen rounding errors of the size of the largest entry
STANCE = 1  # index of the stance leg: leg 1 swings, leg 2 stands
LAW = Impact(1e5, 1.5, 1e3, 1e-4)

angle = st.floats(-3.0, 3.0)
rate = st.floats(-10.0, 10.0)
states = st.tuples(angle, angle, rate, rate)


@st.composite
def compasses(draw):
    length = draw(st.floats(0.1, 10.0))
    return CompassParts(
        leg_length_m=length,
        foot_to_mass_m=length * draw(st.floats(0.05, 0.95)),
        leg_mass_kg=draw(st.floats(0.1, 50.0)),
        hip_mass_kg=draw(st.floats(0.1, 50.0)),
        leg_inertia_kg_m2=0.0,
        foot_radius_m=0.0,
    )


def point_of_stance_foot(parts):
    return Anchor("leg 2", (0.0, -parts.leg_length_m))


def printed_released(parts, theta_1, theta_2, w_1, w_2, g):
    """Return the terms of (A.8) to (A.40), with the sign of (A.29) corrected."""
    L, a, m, M_H = parts.leg_length_m, parts.foot_to_mass_m, parts.leg_mass_kg, parts.hip_mass_kg
    b, K = L - a, L * m + a * m + L * M_H
    s_1, c_1, s_2, c_2 = math.sin(theta_1), math.cos(theta_1), math.sin(theta_2), math.cos(theta_2)
    D = released_mass_matrix(L, a, m, M_H, theta_1, theta_2)
    sin_12 = math.sin(theta_1 - theta_2)
    C = np.array(
        [
            [0.0, -m * L * b * w_2 * sin_12, 0.0, 0.0],
            [+m * L * b * w_1 * sin_12, 0.0, 0.0, 0.0],  # The paper prints a minus here.
            [-b * w_1 * m * s_1, w_2 * s_2 * K, 0.0, 0.0],
            [b * w_1 * m * c_1, -w_2 * c_2 * K, 0.0, 0.0],
        ]
    )
    G = np.array([b * g * m * s_1, -g * s_2 * K, 0.0, g * (M_H + 2 * m)])
    return D, C @ np.array([w_1, w_2, 0.0, 0.0]), G


def printed_swing(parts, theta_1, theta_2, w_1, w_2, g):
    """Return the terms of (A.4) to (A.6), with the sign of C_21 in (A.5) corrected."""
    L, a, m, M_H = parts.leg_length_m, parts.foot_to_mass_m, parts.leg_mass_kg, parts.hip_mass_kg
    b, d = L - a, theta_2 - theta_1
    coupling = -m * L * b * math.cos(d)
    D = np.array([[m * b**2, coupling], [coupling, M_H * L**2 + m * (L**2 + a**2)]])
    C = np.array([[0.0, m * L * b * w_2 * math.sin(d)], [-m * L * b * w_1 * math.sin(d), 0.0]])
    G = np.array([m * g * b * math.sin(theta_1), -(M_H * L + m * (a + L)) * g * math.sin(theta_2)])
    return D, C @ np.array([w_1, w_2]), G


def walker_of(parts, slope, g):
    return contact_walker(compass_assembly(parts), LAW, Frictionless(), g, slope)


def close(found, expected, scale=None):
    largest = float(np.abs(expected).max()) if scale is None else scale
    assert np.abs(np.asarray(found) - np.asarray(expected)).max() <= ROUNDING * max(largest, 1e-300)


@given(parts=compasses(), state=states, g=st.floats(0.1, 30.0))
def test_assembled_compass_equals_appendix_a(parts, state, g):
    found = mass_matrix_and_bias(compass_assembly(parts), point_of_stance_foot(parts), state[:2], state[2:], g)
    D, bias, G = printed_released(parts, *state, g)
    close(found.mass_matrix, D)
    close(found.bias, bias, scale=np.abs(D).max() * max(state[2] ** 2, state[3] ** 2))
    close(found.weight, G)


@given(parts=compasses(), state=states)
def test_pinned_compass_equals_the_swing_phase_of_appendix_a(parts, state):
    g = 9.81
    pinned = place_on_ground(walker_of(parts, 0.0, g), (False, False), pinned=True)
    D, bias, G = printed_swing(parts, *state, g)
    found = np.array(rate_of(pinned, state)[2:])
    # The residual of D ddq + C dq + G = 0 does not depend on the condition of the matrix.
    size = np.abs(D).max() * np.abs(found).max() + np.abs(bias).max() + np.abs(G).max()
    close(D @ found, -bias - G, scale=10.0 * size)


@given(parts=compasses(), state=states, slope=st.floats(-0.5, 0.5))
def test_slope_only_rotates_the_frame(parts, state, slope):
    """Angles are absolute, so the slope does not enter the swing phase, and enters the floating base only through its
    axes.
    """
    level, tilted = walker_of(parts, 0.0, 9.81), walker_of(parts, slope, 9.81)
    pinned = [rate_of(place_on_ground(w, (False, False), pinned=True), state) for w in (level, tilted)]
    close(pinned[1], pinned[0], scale=1e3 * (1.0 + np.abs(pinned[0]).max()))
    falling = rate_of(place_on_ground(tilted, (False, False)), (0.3, 9.0, *state[:2], 0.1, 0.2, *state[2:]))
    close(np.hypot(falling[4], falling[5]), 9.81)
    assert math.isclose(math.atan2(falling[4], -falling[5]), slope, abs_tol=1e-12)


@pytest.mark.parametrize("inertia", [0.0, 0.3])
@settings(max_examples=50)
@given(state=states)
def test_free_tree_accelerates_the_same_for_any_root_point(state, inertia):
    """The integrated equations eliminate the centre of mass. The full matrices about the foot do not."""
    parts = CompassParts(1.0, 0.4, 5.0, 10.0, inertia, 0.0)
    assembly = compass_assembly(parts)
    full = mass_matrix_and_bias(assembly, point_of_stance_foot(parts), state[:2], state[2:], 9.81)
    about_foot = np.linalg.solve(full.mass_matrix, -full.bias - full.weight)[:2]
    central = mass_matrix_and_bias(assembly, None, state[:2], state[2:], 9.81)
    about_centre = np.linalg.solve(central.mass_matrix, -central.bias - central.weight)
    walker = walker_of(parts, 0.0, 9.81)
    integrated = rate_of(place_on_ground(walker, (True, True)), (0.0, 50.0, *state[:2], 0.0, 0.0, *state[2:]))
    size = 1e2 * (1.0 + np.abs(about_foot).max())
    close(about_foot, about_centre[:2], scale=size)
    close(about_centre[2:], [0.0, -9.81])
    close(integrated[6:], about_centre[:2], scale=size)


@given(state=states, along=st.floats(-1e3, 1e3), depth=st.floats(0.0, 1e-3))
def test_equations_do_not_change_with_the_position_along_the_slope(state, along, depth):
    parts = CompassParts(1.0, 0.5, 5.0, 10.0, 0.1, 0.001)
    system = place_on_ground(walker_of(parts, 0.02, 9.81), (True, True))
    height = 0.9 - depth
    here, there = (rate_of(system, (x, height, *state[:2], 0.3, -0.1, *state[2:])) for x in (0.0, along))
    assert here == there


@given(state=states, turn=angle)
def test_without_gravity_the_equations_do_not_change_under_rotation(state, turn):
    parts = CompassParts(1.0, 0.5, 5.0, 10.0, 0.1, 0.001)
    turned = (state[0] + turn, state[1] + turn)
    one, other = (
        mass_matrix_and_bias(compass_assembly(parts), None, angles, state[2:], 0.0) for angles in (state[:2], turned)
    )
    size = 1.0 + state[2] ** 2 + state[3] ** 2
    close(one.mass_matrix, other.mass_matrix, scale=1e2)
    close(one.bias, other.bias, scale=1e2 * size)
