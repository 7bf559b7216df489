"""Tests of a ball foot in the ground: point of action of the force, energy, and exact derivatives."""

import ground_walkers as ground
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from system_rates import gradient_of, rate_of

from walkerlab.physics.ground.energy import dissipated_power, kinetic_energy, potential_energy, total_energy
from walkerlab.physics.ground.friction import Coulomb
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.ground.walker import foot_force, one_foot_motion, place_on_ground

BOTH = (True, True)
angles = st.tuples(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7))
rates = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
slips = st.floats(-1.5, 1.5)
climbs = st.floats(-0.2, 0.2)
depths = st.floats(1e-6, 3e-4)
feet = st.sampled_from([0, 1])
SOFT = Impact(1e5, 1.7, 2e3, 5e-3)
BALL = 0.05


def motion_of(walker, foot, state):
    return one_foot_motion(walker.whole, foot, state)


@given(theta=angles, omega=rates, slip=slips, vertical_velocity=climbs, depth=depths, foot=feet)
def test_slip_is_the_velocity_of_the_foot_material_at_the_contact(theta, omega, slip, vertical_velocity, depth, foot):
    """Follow the point that is now lowest for a moment, while the ball turns with its leg."""
    walker = ground.compass(radius=BALL)
    state = np.array(ground.placed(walker, foot, depth, theta, omega, slip, vertical_velocity))
    _, _, (_, hip, v_hip) = ground.masses_of_the_compass(state)
    reach, angle, w = 1.0 - BALL, theta[foot] + ground.SLOPE, omega[foot]
    centre_to_lowest = np.array([0.0, -BALL])
    hip_to_centre = reach * np.array([np.sin(angle), -np.cos(angle)])

    def material_point(t):
        turned = np.array([[np.cos(w * t), -np.sin(w * t)], [np.sin(w * t), np.cos(w * t)]])
        return hip + v_hip * t + turned @ (hip_to_centre + centre_to_lowest)

    velocity = (material_point(1e-5) - material_point(-1e-5)) / 2e-5
    motion = motion_of(walker, foot, tuple(state))
    np.testing.assert_allclose((motion.slip, motion.vertical_velocity), velocity, atol=1e-8)
    np.testing.assert_allclose((motion.slip, motion.vertical_velocity), (slip, vertical_velocity), atol=1e-12)
    np.testing.assert_allclose((motion.along, motion.height), material_point(0.0), atol=1e-12)
    assert motion.height == pytest.approx(-depth, abs=1e-12)


@given(theta=angles, omega=rates, slip=slips, vertical_velocity=climbs, depth=depths, foot=feet)
def test_energies_are_sums_over_legs_and_hip(theta, omega, slip, vertical_velocity, depth, foot):
    walker = ground.compass()
    state = ground.placed(walker, foot, depth, theta, omega, slip, vertical_velocity)
    bodies = ground.masses_of_the_compass(state)
    field = ground.GRAVITY * np.array([np.sin(ground.SLOPE), -np.cos(ground.SLOPE)])
    assert kinetic_energy(walker.whole, state) == pytest.approx(sum(m * v @ v for m, _, v in bodies) / 2, rel=1e-12)
    assert potential_energy(walker.whole, state) == pytest.approx(-sum(m * p @ field for m, p, _ in bodies), rel=1e-12)


@given(theta=angles, omega=rates, slip=slips, vertical_velocity=climbs, depth=depths, foot=feet)
def test_momentum_changes_by_the_contact_force(theta, omega, slip, vertical_velocity, depth, foot):
    """For the whole walker, gravity and ground change the momentum and the angular momentum about the contact point."""
    walker = ground.compass(radius=BALL)
    has_ground = (foot == 0, foot == 1)
    state = np.array(ground.placed(walker, foot, depth, theta, omega, slip, vertical_velocity))
    rate = np.array(rate_of(place_on_ground(walker, has_ground), state))
    motion = motion_of(walker, foot, tuple(state))
    force = foot_force(walker, motion)
    contact = np.array([motion.along, motion.height])
    field = ground.GRAVITY * np.array([np.sin(ground.SLOPE), -np.cos(ground.SLOPE)])

    def momenta(y):
        bodies = ground.masses_of_the_compass(y)
        linear = sum(m * v for m, _, v in bodies)
        angular = sum(m * ((p - contact)[0] * v[1] - (p - contact)[1] * v[0]) for m, p, v in bodies)
        return np.array([*linear, angular])

    h = 1e-6 / (1.0 + np.abs(rate).max())
    change = (momenta(state + h * rate) - momenta(state - h * rate)) / (2 * h)
    weights = [(m * field, p - contact) for m, p, _ in ground.masses_of_the_compass(state)]
    pull = sum(w for w, _ in weights) + np.array([force.along, force.normal.force])
    torque = sum(arm[0] * w[1] - arm[1] * w[0] for w, arm in weights)
    size = 1e3 + abs(force.normal.force)
    np.testing.assert_allclose(change, [*pull, torque], atol=1e-7 * size)


@given(theta=angles, omega=rates, slip=slips, vertical_velocity=climbs, depth=st.floats(1e-4, 8e-3), foot=feet)
@example(theta=(0.6875, 0.0), omega=(0.0, 2.0**-7), slip=0.0, vertical_velocity=0.0, depth=2.0**-7, foot=0)
def test_power_is_balanced_and_the_ground_only_dissipates(theta, omega, slip, vertical_velocity, depth, foot):
    """Along the motion, the energy falls at the rate at which damping and friction take it."""
    walker = ground.compass(normal=SOFT)
    state = np.array(ground.placed(walker, foot, depth, theta, omega, slip, vertical_velocity))
    rate = np.array(rate_of(place_on_ground(walker, BOTH), state))
    powers = [dissipated_power(place_on_ground(walker, BOTH), each, tuple(state))[:2] for each in range(2)]
    damping, friction = np.sum(powers, axis=0)
    assert damping >= 0.0
    assert friction >= 0.0
    # the other foot must not reach a switching point of the law
    assume(abs(motion_of(walker, 1 - foot, tuple(state)).height) > 1e-4)
    # The step is long enough that the rounding of energies of 1 kJ remains small.
    h = 1e-5 / (1.0 + np.abs(rate).max() * 1e-2)
    before, after = (total_energy(place_on_ground(walker, BOTH), tuple(state + step * rate)) for step in (-h, h))
    size = 1.0 + damping + friction + 1e3 * kinetic_energy(walker.whole, tuple(state))
    assert (after - before) / (2 * h) == pytest.approx(-(damping + friction), abs=1e-5 * size)


def test_foot_in_the_air_or_without_ground_has_no_contact_force():
    walker = ground.compass()
    hovering = ground.placed(walker, 1, -0.3, (-0.2, 0.2), (1.0, -1.0), 0.1, 0.1)
    inside = ground.placed(walker, 1, 1e-4, (-0.2, 0.2), (1.0, -1.0), 0.1, 0.1)
    assert rate_of(place_on_ground(walker, BOTH), hovering) == rate_of(
        place_on_ground(walker, (False, False)), hovering
    )
    free = rate_of(place_on_ground(walker, (False, False)), inside)
    np.testing.assert_allclose(free[4:6], (walker.gravity_along, -walker.gravity_down), rtol=1e-15)
    assert dissipated_power(place_on_ground(walker, BOTH), 1, hovering) == (0.0, 0.0, 0.0)


def test_smooth_ground_has_no_tangential_force():
    walker = ground.compass(friction=ground.SMOOTH)
    for slip in (-1.0, 0.05, 2.0):
        state = ground.placed(walker, 1, 6e-5, (-0.2, 0.17), (-0.6, -0.9), slip, -0.01)
        assert foot_force(walker, motion_of(walker, 1, state)).along == 0.0
        rate = rate_of(place_on_ground(walker, BOTH), state)
        assert rate[4] == walker.gravity_along
        assert dissipated_power(place_on_ground(walker, BOTH), 1, state)[1] == 0.0


@given(theta=angles, omega=rates, slip=slips, vertical_velocity=climbs, depth=depths, foot=feet)
def test_smooth_ground_acts_like_zero_friction_coefficients(theta, omega, slip, vertical_velocity, depth, foot):
    smooth, none = ground.compass(friction=ground.SMOOTH), ground.compass(friction=Coulomb(0.0, 0.0, 0.1, 1.0))
    state = ground.placed(smooth, foot, depth, theta, omega, slip, vertical_velocity)
    assert rate_of(place_on_ground(smooth, BOTH), state) == rate_of(place_on_ground(none, BOTH), state)
    J, K = gradient_of(place_on_ground(smooth, BOTH), state), gradient_of(place_on_ground(none, BOTH), state)
    np.testing.assert_array_equal(J, K)


def differenced(system, state, steps):
    columns = []
    for j, h in enumerate(steps):
        moved = [np.array(state) for _ in range(2)]
        moved[0][j] -= h
        moved[1][j] += h
        below, above = (np.array(rate_of(system, y)) for y in moved)
        columns.append((above - below) / (moved[1][j] - moved[0][j]))
    return np.array(columns).T


@pytest.mark.parametrize("friction", [ground.COULOMB, ground.SMOOTH], ids=["coulomb", "smooth"])
@settings(max_examples=40)
@given(
    theta=angles,
    omega=rates,
    slip=st.sampled_from([-1.4, -0.5, -0.06, 0.003, 0.4, 1.2]),
    vertical_velocity=climbs,
    depth=st.floats(1e-4, 4e-3),
    foot=feet,
)
def test_derivatives_on_ground_equal_finite_differences(friction, theta, omega, slip, vertical_velocity, depth, foot):
    walker = ground.compass(friction=friction, normal=SOFT, radius=BALL, inertia=0.2)
    state = ground.placed(walker, foot, depth, theta, omega, slip, vertical_velocity)
    has_ground = (foot == 0, foot == 1)
    motion = motion_of(walker, foot, state)
    assume(foot_force(walker, motion).normal.force > 1e-2)  # the force must not be near the clip at zero
    J = gradient_of(place_on_ground(walker, has_ground), state)
    position = 1e-3 * depth
    steps = (1e-6, position, position, position, 1e-5, 1e-5, 1e-5, 1e-5)
    expected = differenced(place_on_ground(walker, has_ground), state, steps)
    # Compare each column relative to its own size: the stiffness for the height is a million times that of friction.
    size = np.abs(expected).max(axis=0) + 1.0
    assert (np.abs(J - expected) / size).max() < 1e-4


@pytest.mark.parametrize("vertical_velocity", [-1e-4, 0.0, 1e-4])
def test_derivatives_are_correct_at_the_stiffness_of_the_paper(vertical_velocity):
    walker = ground.compass()
    state = ground.placed(walker, 1, 6e-5, (-0.2, 0.17), (-0.6, -0.86), 2e-3, vertical_velocity)
    J = gradient_of(place_on_ground(walker, (False, True)), state)
    steps = (1e-6, 1e-9, 1e-9, 1e-9, 1e-6, 1e-6, 1e-6, 1e-6)
    expected = differenced(place_on_ground(walker, (False, True)), state, steps)
    assert np.abs(J[:, 1]).max() > 1e6  # The matrix is so stiff that an absolute tolerance would say nothing.
    size = np.abs(expected).max(axis=0) + 1.0
    assert (np.abs(J - expected) / size).max() < 1e-5


def creep_velocity(slope, friction):
    """Return the velocity at which a loaded block creeps steadily down a slope."""
    block = ground.sledge(friction=friction, slope=slope)
    system = place_on_ground(block, BOTH)
    start = ground.placed(block, 0, 3e-5, (-slope,), (0.0,), 0.0, 0.0)

    path = solve_ivp(
        lambda _, y: rate_of(system, y),
        (0.0, 1.0),
        start,
        method="Radau",
        jac=lambda _, y: gradient_of(system, y),
        rtol=1e-8,
        atol=1e-11,
    )
    assert path.success
    return path.y[3, -1]


@pytest.mark.parametrize("slope", [0.02, 0.1])
def test_loaded_block_creeps_downhill_instead_of_sticking(slope):
    """The slope needs T/N = tan(slope), and the cubic gives mu = mu_s (3 u - u^3) / 2 at u = v / v_s. So v is near v_s
    (T/N) / (1.5 mu_s).
    """
    law = ground.COULOMB
    velocity = creep_velocity(slope, law)
    u = velocity / law.stiction_velocity
    assert law.static * (3 * u - u**3) / 2 == pytest.approx(np.tan(slope), rel=1e-5)
    assert velocity == pytest.approx(law.stiction_velocity * np.tan(slope) / (1.5 * law.static), rel=u**2)


def test_block_on_a_slope_steeper_than_its_friction_slides_away():
    law = Coulomb(0.2, 0.1, 0.01, 0.1)
    velocity = creep_velocity(0.3, law)
    # speed after 1 s, less what it lost while mu_s held the block
    expected = ground.GRAVITY * (np.sin(0.3) - 0.1 * np.cos(0.3))
    assert 0.9 * expected < velocity <= expected * 1.001
