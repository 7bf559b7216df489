"""Compare a tree with torso and knee with Lagrange's equations, and check the invariants of free flight."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from late_imports import import_late
from scipy.integrate import solve_ivp
from system_rates import rate_of
from tree_equations import mass_matrix_and_bias

from walkerlab.physics.ground.compliant import contact_walker
from walkerlab.physics.ground.energy import kinetic_energy, potential_energy
from walkerlab.physics.ground.friction import Frictionless
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.ground.walker import place_on_ground
from walkerlab.physics.mechanics.parts import Anchor, Assembly, Body, Revolute, levers, total_mass, tree_about_centre

sp = import_late("sympy")
kneed = import_late("kneed_walker")

angles = st.tuples(*[st.floats(-3.0, 3.0)] * 4)
rates = st.tuples(*[st.floats(-5.0, 5.0)] * 4)
speeds = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
GRAVITY = 9.81
IN_THE_AIR = (False, False)


@pytest.fixture(scope="module")
def lagrange():
    return kneed.lagrange_equations()


@pytest.fixture(scope="module")
def measured():
    """Return centre of mass, momentum, angular momentum about the centre, and energies of a state given at the foot's
    point.
    """
    points = kneed.mass_points()
    mass = sum(m for m, _ in points)
    velocities = [place.jacobian(kneed.q) * kneed.dq for _, place in points]
    centre = sum((m * place for m, place in points), sp.zeros(2, 1)) / mass
    momentum = sum((m * v for (m, _), v in zip(points, velocities, strict=True)), sp.zeros(2, 1))
    spin = sum(J * w for J, w in zip((0.20, 0.60, 0.04, 0.02), kneed.omega, strict=True))
    for (m, place), v in zip(points, velocities, strict=True):
        arm = place - centre
        spin += m * (arm[0] * v[1] - arm[1] * v[0])
    kinetic, potential = kneed.energies()
    quantities = (*centre, *momentum, spin, kinetic, potential)
    return sp.lambdify(
        (kneed.theta, kneed.omega, (kneed.x, kneed.y), (kneed.dx, kneed.dy), kneed.g), quantities, cse=True
    )


def flying_walker(slope=0.0):
    return contact_walker(kneed.KNEED, Impact(1e5, 1.5, 1e3, 1e-4), Frictionless(), GRAVITY, slope)


def flight(theta, omega, velocity, duration):
    """Return states (samples, 12) of the free walker along a flight."""
    system = place_on_ground(flying_walker(), IN_THE_AIR)
    start = np.array([0.0, 5.0, *theta, *velocity, *omega])
    path = solve_ivp(lambda _, y: rate_of(system, y), (0.0, duration), start, method="DOP853", rtol=1e-12, atol=1e-13)
    return path.t, path.y.T


@given(theta=angles, omega=rates, velocity=speeds)
def test_walker_with_torso_and_knee_obeys_lagrange_equations(lagrange, theta, omega, velocity):
    M, bias, weight = lagrange(theta, omega, velocity, GRAVITY)
    found = mass_matrix_and_bias(kneed.KNEED, kneed.STANCE_POINT, theta, omega, GRAVITY)
    squares = 1.0 + max(abs(w) for w in omega) ** 2
    assert np.abs(found.mass_matrix - M).max() <= 1e-12 * np.abs(M).max()
    assert np.abs(found.bias - bias.ravel()).max() <= 1e-12 * np.abs(M).max() * squares
    assert np.abs(found.weight - weight.ravel()).max() <= 1e-12 * np.abs(weight).max()


@given(theta=angles, omega=rates)
def test_pinned_walker_with_torso_and_knee_obeys_lagrange_equations(lagrange, theta, omega):
    """The hinge is at the centre of the ball. Once the matrix is moved there, the rows of the foot point drop out."""
    pinned = place_on_ground(flying_walker(slope=0.1), IN_THE_AIR, pinned=True)
    at_hinge = Anchor("stance", (0.0, 0.02))
    alpha = np.array(rate_of(pinned, (*theta, *omega))[4:])
    full = mass_matrix_and_bias(kneed.KNEED, at_hinge, theta, omega, GRAVITY)
    residual = full.mass_matrix[:4, :4] @ alpha + full.bias[:4] + full.weight[:4]
    size = np.abs(full.mass_matrix).max() * np.abs(alpha).max() + np.abs(full.weight).max()
    assert np.abs(residual).max() <= 1e-12 * size
    # The root moves by R(theta_stance) (0, 0.02), which is a change of coordinates: M_hinge = B' M_foot B.
    M, _, _ = lagrange(theta, omega, (0.0, 0.0), GRAVITY)
    B = np.eye(6)
    B[4, 0], B[5, 0] = 0.02 * np.cos(theta[0]), 0.02 * np.sin(theta[0])
    np.testing.assert_allclose(full.mass_matrix, B.T @ M @ B, atol=1e-12 * np.abs(M).max())


@given(theta=angles, omega=rates, velocity=speeds)
def test_motion_of_a_four_body_walker_obeys_lagranges_equations(lagrange, theta, omega, velocity):
    M, bias, weight = lagrange(theta, omega, velocity, GRAVITY)
    expected = np.linalg.solve(M, -(bias + weight).ravel())
    rate = rate_of(place_on_ground(flying_walker(), IN_THE_AIR), (0.0, 5.0, *theta, *velocity, *omega))
    np.testing.assert_allclose(rate[8:], expected[:4], atol=1e-9 * (1.0 + np.abs(expected).max()))


@given(theta=angles, omega=rates, velocity=speeds, foot=st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)))
def test_energies_are_sums_over_the_masses(measured, theta, omega, velocity, foot):
    *centre, p_x, p_y, _, kinetic, potential = measured(theta, omega, foot, velocity, GRAVITY)
    mass = total_mass(kneed.KNEED)
    state = (*centre, *theta, p_x / mass, p_y / mass, *omega)
    walker = flying_walker()
    assert kinetic_energy(walker.whole, state) == pytest.approx(kinetic, rel=1e-12, abs=1e-11)
    assert potential_energy(walker.whole, state) == pytest.approx(potential, rel=1e-12, abs=1e-10)


FLIGHTS = [
    ((0.1, -0.2, 0.4, -0.3), (1.0, -2.0, 3.0, -5.0), (1.0, 2.0)),
    ((-1.0, 0.5, 2.0, 1.0), (-4.0, 2.0, 6.0, 0.0), (0.0, 0.0)),
]


@pytest.mark.parametrize(("theta", "omega", "velocity"), FLIGHTS)
def test_energy_and_angular_momentum_are_constant_in_flight(measured, theta, omega, velocity):
    t, y = flight(theta, omega, velocity, 0.5)
    mass = total_mass(kneed.KNEED)
    _, feet = tree_about_centre(kneed.KNEED)
    to_foot_point = feet[1] + np.array([[0.0, -0.02], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    spins, totals = [], []
    for state in y:
        s, c = np.sin(state[2:6]), np.cos(state[2:6])
        forward, upward = (
            c * to_foot_point[:, 0] - s * to_foot_point[:, 1],
            s * to_foot_point[:, 0] + c * to_foot_point[:, 1],
        )
        foot = state[0] + forward.sum(), state[1] + upward.sum()
        w = state[8:]
        foot_velocity = state[6] - w @ upward, state[7] + w @ forward
        c_x, c_y, p_x, p_y, spin, kinetic, potential = measured(state[2:6], w, foot, foot_velocity, GRAVITY)
        np.testing.assert_allclose((c_x, c_y, p_x / mass, p_y / mass), (*state[:2], *state[6:8]), atol=1e-11)
        spins.append(spin)
        totals.append(kinetic + potential)
    assert np.ptp(spins) < 1e-9
    assert np.ptp(totals) < 1e-8
    np.testing.assert_allclose(y[:, 0], velocity[0] * t, atol=1e-11)
    np.testing.assert_allclose(y[:, 1], 5.0 + velocity[1] * t - 0.5 * GRAVITY * t**2, atol=1e-11)


@given(theta=angles)
def test_levers_add_up_to_the_vector_from_any_root_to_any_point(theta):
    """A point is root + sum of R(theta_k) d_k, from whichever end of the chain the sum starts."""
    s, c = np.sin(theta), np.cos(theta)
    foot, head, toe = kneed.STANCE_POINT, Anchor("torso", (0.1, 0.7)), Anchor("shank", (0.0, -0.48))

    def between(root, point):
        d = levers(kneed.KNEED, root, point)
        return np.array([(c * d[:, 0] - s * d[:, 1]).sum(), (s * d[:, 0] + c * d[:, 1]).sum()])

    def turned(k, across, up):
        return np.array([across * c[k] - up * s[k], across * s[k] + up * c[k]])

    hip = turned(0, 0.0, 0.98)
    np.testing.assert_allclose(between(foot, head), hip + turned(1, 0.1, 0.7), atol=1e-14)
    np.testing.assert_allclose(between(foot, toe), hip + turned(2, 0.0, -0.45) + turned(3, 0.0, -0.48), atol=1e-14)
    np.testing.assert_allclose(between(toe, head), between(foot, head) - between(foot, toe), atol=1e-14)


def test_body_without_a_hinge_is_rejected():
    loose = Assembly((Body("leg", 1.0, (0.0, 0.0)), Body("hat", 1.0, (0.0, 0.0))), joints=())
    with pytest.raises(ValueError, match="no hinges lead from body 'leg' to body 'hat'"):
        tree_about_centre(loose)


def test_hinge_to_a_missing_body_is_rejected():
    with pytest.raises(KeyError, match="no body named 'torsoo'; bodies: leg"):
        Assembly((Body("leg", 1.0, (0.0, 0.0)),), (Revolute("hip", "leg", (0.0, 0.0), "torsoo", (0.0, 0.0)),))


def test_bodies_with_the_same_name_are_rejected():
    with pytest.raises(ValueError, match="duplicate body name"):
        Assembly((Body("leg", 1.0, (0.0, 0.0)), Body("leg", 2.0, (0.0, 0.0))), joints=())


def test_root_on_an_unknown_body_is_rejected():
    with pytest.raises(KeyError, match="tail"):
        mass_matrix_and_bias(kneed.KNEED, Anchor("tail", (0.0, 0.0)), (0.0,) * 4, (0.0,) * 4, GRAVITY)


def test_closed_loop_is_rejected():
    """A tree has one hinge fewer than bodies. Without the check, the hinge that closes a loop would be ignored
    silently.
    """
    bodies = tuple(Body(name, 1.0, (0.0, 0.0)) for name in ("a", "b", "c"))
    loop = tuple(
        Revolute(f"{one}{other}", one, (1.0, 0.0), other, (0.0, 0.0))
        for one, other in (("a", "b"), ("b", "c"), ("c", "a"))
    )
    with pytest.raises(ValueError, match="closed loop"):
        Assembly(bodies, loop)


def test_walker_without_two_feet_is_rejected():
    one_legged = Assembly(kneed.KNEED.bodies, kneed.KNEED.joints, feet=kneed.KNEED.feet[:1])
    with pytest.raises(ValueError, match="two feet"):
        contact_walker(one_legged, Impact(1.0, 1.0, 0.0, 1.0), Frictionless(), 9.81, 0.0)


def test_levers_from_the_root_to_itself_are_zero():
    assert not levers(kneed.KNEED, kneed.STANCE_POINT, kneed.STANCE_POINT).any()
