"""Compare the heel strike with the paper's own 6 x 6 system and with the laws of mechanics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from printed_compass import feet_on_slope, kinetic_energy, released_mass_matrix, swing_foot_height

from walkerlab.evidence.paper.appendix_a import CORRECTED, RigidWalker, impact, step_length

walkers = st.builds(
    lambda L, fraction, m, M_H, g, slope: RigidWalker(L, fraction * L, m, M_H, 0.0, g, slope, CORRECTED),
    st.floats(0.2, 5.0),
    st.floats(0.05, 0.95),
    st.floats(0.5, 20.0),
    st.floats(0.0, 50.0),
    st.floats(1.0, 20.0),
    st.floats(0.0, 0.3),
)
half_angles, rates = st.floats(0.01, 0.6), st.floats(-3.0, 3.0)
PAPER = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, 0.0174, CORRECTED)


def at_heel_strike(walker, half_angle):
    """Return the angles with both feet on the slope and the swing leg ahead."""
    return half_angle - walker.slope, -half_angle - walker.slope


def printed_system(walker, theta_1, theta_2, w_1, w_2, foot_row_2):
    """Solve (A.57) for (dq_e+, F), with D_e from (A.9) to (A.24) and E from (A.56)."""
    L, a, m, M_H = walker.leg_length, walker.foot_to_mass, walker.leg_mass, walker.hip_mass
    D_e = released_mass_matrix(L, a, m, M_H, theta_1, theta_2)
    E = np.array([[L * math.cos(theta_1), -L * math.cos(theta_2), 1.0, 0.0], foot_row_2])
    system = np.block([[D_e, -E.T], [E, np.zeros((2, 2))]])
    right = np.concatenate((D_e @ [w_1, w_2, 0.0, 0.0], [0.0, 0.0]))
    return np.linalg.solve(system, right)


@given(walkers, half_angles, rates, rates)
def test_impact_solves_the_system_of_the_paper_at_the_actual_foot_position(walker, half_angle, w_1, w_2):
    theta_1, theta_2 = at_heel_strike(walker, half_angle)
    L = walker.leg_length
    height_row = [L * math.sin(theta_1), -L * math.sin(theta_2), 0.0, 1.0]
    solved = printed_system(walker, theta_1, theta_2, w_1, w_2, height_row)
    after = impact(walker, theta_1, theta_2, w_1, w_2)
    # The legs change roles: the leg that was swinging is now the stance leg.
    assert after[:2] == (theta_2, theta_1)
    assert (after[3], after[2]) == pytest.approx(solved[:2], rel=1e-9, abs=1e-9)


def test_printed_foot_height_would_change_the_impact():
    theta_1, theta_2 = at_heel_strike(PAPER, 0.2)
    printed_row = [-math.sin(theta_1), math.sin(theta_2), 0.0, 1.0]
    solved = printed_system(PAPER, theta_1, theta_2, 0.5, -1.0, printed_row)
    after = impact(PAPER, theta_1, theta_2, 0.5, -1.0)
    assert abs(after[3] - solved[0]) > 0.01


def cross(one, other):
    return one[0] * other[1] - one[1] * other[0]


class Motion:
    """Point masses and their velocities, from angles and angular velocities."""

    def __init__(self, walker, theta_1, theta_2, w_1, w_2):
        L, a = walker.leg_length, walker.foot_to_mass

        def along(angle, length):
            return length * np.array([-math.sin(angle), math.cos(angle)])

        def turning(angle, rate, length):
            return length * rate * np.array([-math.cos(angle), -math.sin(angle)])

        hip, hip_rate = along(theta_2, L), turning(theta_2, w_2, L)
        self.swing_foot = hip - along(theta_1, L)
        self.hip = hip
        self.swing_mass = (walker.leg_mass, hip - along(theta_1, L - a), hip_rate - turning(theta_1, w_1, L - a))
        self.stance_mass = (walker.leg_mass, along(theta_2, a), turning(theta_2, w_2, a))
        self.hip_mass = (walker.hip_mass, hip, hip_rate)

    def angular_momentum(self, pivot, masses):
        return sum(m * cross(p - pivot, v) for m, p, v in masses)


@given(walkers, half_angles, rates, rates)
def test_angular_momentum_about_the_new_foothold_is_conserved(walker, half_angle, w_1, w_2):
    theta_1, theta_2 = at_heel_strike(walker, half_angle)
    before = Motion(walker, theta_1, theta_2, w_1, w_2)
    after = Motion(walker, *impact(walker, theta_1, theta_2, w_1, w_2))
    old = before.angular_momentum(before.swing_foot, (before.swing_mass, before.stance_mass, before.hip_mass))
    new = after.angular_momentum(np.zeros(2), (after.swing_mass, after.stance_mass, after.hip_mass))
    scale = (walker.hip_mass + 2 * walker.leg_mass) * walker.leg_length**2 * 3.0
    assert new == pytest.approx(old, rel=1e-9, abs=1e-9 * scale)


@given(walkers, half_angles, rates, rates)
def test_angular_momentum_of_the_trailing_leg_about_the_hip_is_conserved(walker, half_angle, w_1, w_2):
    theta_1, theta_2 = at_heel_strike(walker, half_angle)
    before = Motion(walker, theta_1, theta_2, w_1, w_2)
    after = Motion(walker, *impact(walker, theta_1, theta_2, w_1, w_2))
    old = before.angular_momentum(before.hip, (before.stance_mass,))
    new = after.angular_momentum(after.hip, (after.swing_mass,))
    assert new == pytest.approx(old, rel=1e-9, abs=1e-9 * walker.leg_mass * walker.leg_length**2 * 3.0)


@given(walkers, half_angles, rates, rates)
def test_impact_never_gains_energy(walker, half_angle, w_1, w_2):
    before = (*at_heel_strike(walker, half_angle), w_1, w_2)
    lost = kinetic_energy(walker, *before) - kinetic_energy(walker, *impact(walker, *before))
    assert lost >= -1e-12 * kinetic_energy(walker, *before)


@given(walkers, rates)
def test_impact_of_a_foot_at_rest_changes_nothing(walker, rate):
    # The legs are together and turn at the same rate, so both feet are at rest at the same point.
    together = (-walker.slope, -walker.slope, rate, rate)
    after = impact(walker, *together)
    assert after == pytest.approx(together, rel=1e-9, abs=1e-9)


@given(walkers, half_angles, rates, rates)
def test_impact_of_the_mirrored_state_is_mirrored(walker, half_angle, w_1, w_2):
    before = (*at_heel_strike(walker, half_angle), w_1, w_2)
    mirrored = impact(walker._replace(slope=-walker.slope), *(-value for value in before))
    assert mirrored == tuple(-value for value in impact(walker, *before))


@given(walkers, half_angles)
def test_guard_and_step_length_agree_with_foot_positions(walker, half_angle):
    theta_1, theta_2 = at_heel_strike(walker, half_angle)
    foot = Motion(walker, theta_1, theta_2, 0.0, 0.0).swing_foot
    downhill = np.array([math.cos(walker.slope), -math.sin(walker.slope)])
    uphill_normal = np.array([math.sin(walker.slope), math.cos(walker.slope)])
    assert feet_on_slope(walker, theta_1, theta_2) == pytest.approx(0.0, abs=1e-15)
    assert foot @ uphill_normal == pytest.approx(0.0, abs=1e-14 * walker.leg_length)
    assert step_length(walker, theta_2, theta_1) == pytest.approx(foot @ downhill, rel=1e-12)


@given(walkers, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_swing_foot_height_is_the_distance_from_the_slope(walker, theta_1, theta_2):
    foot = Motion(walker, theta_1, theta_2, 0.0, 0.0).swing_foot
    normal = np.array([math.sin(walker.slope), math.cos(walker.slope)])
    assert swing_foot_height(walker, theta_1, theta_2) == pytest.approx(foot @ normal, abs=1e-14 * walker.leg_length)
