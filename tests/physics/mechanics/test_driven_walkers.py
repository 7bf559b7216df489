"""Compare hip torques and the push-off of random walkers with equations written mass by mass."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigid_physics import heel_strike, rates, state_linked, total_energy
from scipy.integrate import solve_ivp
from test_random_walkers import (
    EXAMPLES,
    TYPES,
    G,
    angular_momentum,
    both_feet_down,
    each_type,
    energy_of,
    in_motion,
    numbers,
    slopes,
    state_of,
    walkers_differ_by,
)

from walkerlab.physics.mechanics import impact
from walkerlab.physics.mechanics.hinges import HIP_ROW
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.mechanics.rigid_model import AT_STRIKE, BENT, STANCE, STRAIGHT, SWING, Mode
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.solvers.system import jacobian
from walkerlab.scene.parts import assembly_of

hips = st.builds(
    lambda stiffness, damping, torque: {
        "hip": (stiffness, damping, torque)
    },
    st.floats(0.0, 20.0), st.floats(0.0, 2.0), st.floats(-5.0, 5.0),
)  # fmt: skip


def driven(test):
    """Run the test for random walkers of one type at a time, uphill and downhill, with random drives and states."""

    @each_type
    @settings(max_examples=EXAMPLES)
    @given(data=st.data(), slope=slopes, uphill=st.booleans(), hip=hips, push=st.floats(0.01, 5.0), free=numbers)
    def for_type(kind, data, slope, uphill, hip, push, free):
        assembly = assembly_of(data.draw(TYPES[kind]), rigid=True)
        model = rigid_on_slope(assembly, G, -slope if uphill else slope).changed(**hip, push_off=push)
        test(assembly, model, free)

    for_type.__name__, for_type.__doc__ = test.__name__, test.__doc__
    return for_type


def apart(model, y):
    """Return how far the swing leg is ahead (rad), and the rate (rad/s)."""
    n = len(model.arm_x)
    return y[SWING] - y[STANCE], y[n + SWING] - y[n + STANCE]


def momentum(points):
    return sum(m * v for m, _, v in points)


@driven
def test_energy_change_of_a_swing_equals_the_work_of_torque_and_damper(assembly, model, free):
    y, n = state_of(model, BENT, free), len(model.arm_x)

    def with_work(_, x):
        rate, (_, damping, torque) = apart(model, x)[1], model.laws[HIP_ROW]
        return (*x[n : 2 * n], *rates(model, BENT, tuple(x[:-1])), (torque - damping * rate) * rate)

    swing = solve_ivp(with_work, (0.0, 0.1), (*y, 0.0), "DOP853", rtol=1e-11, atol=1e-12)
    spring = [0.5 * model.laws[HIP_ROW][0] * apart(model, x)[0] ** 2 for x in swing.y.T]
    without = model.changed(hip=(0.0, *model.laws[HIP_ROW][1:]))
    balance = [total_energy(without, tuple(x[:-1])) + e - x[-1] for x, e in zip(swing.y.T, spring, strict=True)]
    assert np.ptp(balance) < 1e-7 * (1.0 + np.abs(balance).max())
    assert total_energy(model, y) == pytest.approx(total_energy(without, y) + spring[0], abs=1e-9)


@driven
def test_hip_torques_act_on_both_legs_and_nothing_else(assembly, model, free):
    """Only gravity changes the angular momentum about the foothold, and a positive torque swings the free leg
    forward.
    """
    passive = model.changed(hip=0.0)
    y, n = state_of(model, BENT, free), len(model.arm_x)
    h, rate_of = 1e-6, []
    for walker in (model, passive):
        alpha = rates(walker, BENT, y)
        faster, slower = ((*y[:n], *np.add(y[n:], sign * h * np.array(alpha))) for sign in (1.0, -1.0))
        spins = [
            angular_momentum(*in_motion(assembly, walker, x, np.zeros(2))[:2], (0.0, -model.radius))
            for x in (faster, slower)
        ]
        rate_of.append((spins[0] - spins[1]) / (2.0 * h))
    assert rate_of[0] == pytest.approx(rate_of[1], rel=1e-6, abs=1e-5)
    with_torque = model.changed(hip=(0.0, 0.0, 1.0))
    change = np.subtract(rates(with_torque, BENT, y), rates(passive, BENT, y))
    assert change[SWING] - change[STANCE] > 0.0


@driven
def test_push_off_acts_along_the_line_from_trailing_contact_to_hip(assembly, model, free):
    y = both_feet_down(model, free)
    after = heel_strike(model, y)
    points, spins, foot = in_motion(assembly, model, y, np.zeros(2))
    new_points, new_spins, _ = in_motion(assembly, model, after, foot)
    contact, trailing = foot - (0.0, model.radius), np.array((0.0, -model.radius))
    angle = y[STANCE] + model.slope
    hip = np.array((
        np.cos(angle) * model.hip_x - np.sin(angle) * model.hip_y,
        np.sin(angle) * model.hip_x + np.cos(angle) * model.hip_y,
    ))  # fmt: skip
    push = model.push_off * (hip - trailing) / np.linalg.norm(hip - trailing)
    moment = float(np.linalg.det([trailing - contact, push]))
    gained = angular_momentum(new_points, new_spins, contact) - angular_momentum(points, spins, contact)
    scale = 1.0 + energy_of(points, spins)
    assert gained == pytest.approx(moment, abs=1e-9 * scale)

    # the energy gained is each impulse times the mean of its point's velocities, both the other's that rests
    def hip_at(state, rolled):
        psi = state[STANCE] + model.slope
        return rolled + np.array((
            np.cos(psi) * model.hip_x - np.sin(psi) * model.hip_y,
            np.sin(psi) * model.hip_x + np.cos(psi) * model.hip_y,
        ))  # fmt: skip

    def rate(place, state):
        n, h = len(state) // 2, 1e-6
        ends = []
        for sign in (1.0, -1.0):
            turned = (*np.add(state[:n], sign * h * np.array(state[n:])), *state[n:])
            ends.append(place(turned, np.array((-sign * h * model.radius * state[n + STANCE], 0.0))))
        return (ends[0] - ends[1]) / (2.0 * h)

    gain = 0.5 * float(push @ rate(hip_at, after))
    pushed = impact.push_off(model, np.array(after))
    assert (pushed.along, pushed.upward) == pytest.approx(tuple(push), abs=1e-9)
    ground = momentum(new_points) - momentum(points) - push
    landing = rate(lambda state, centre: in_motion(assembly, model, state, centre)[2], y)
    landing += (model.radius * y[len(y) // 2 + SWING], 0.0)
    change = energy_of(new_points, new_spins) - energy_of(points, spins)
    assert change == pytest.approx(gain + 0.5 * float(ground @ landing), abs=1e-7 * scale)


@driven
def test_push_off_acts_on_the_free_walker_just_before_the_strike(assembly, model, free):
    """Compute for each mass what an impulse at the trailing contact point changes, with locked knees and a held
    torso.
    """
    y, n = np.array(both_feet_down(model, free)), len(model.arm_x)
    Z = model.E[STRAIGHT][:, np.diag(model.E[STRAIGHT]) != 0.0]
    rest = np.concatenate((y[:n], np.zeros(n)))
    # angular velocities, then the two velocities of the foot centre
    moves = [np.concatenate((y[:n], column)) for column in Z.T]

    def velocities(k):
        points, spins, _ = in_motion(assembly, model, moves[k] if k < len(moves) else rest, np.zeros(2))
        rolled = np.array((model.radius * moves[k][n + STANCE], 0.0)) if k < len(moves) else np.eye(2)[k - len(moves)]
        return [(m, v + rolled) for m, _, v in points], spins

    every = [velocities(k) for k in range(len(moves) + 2)]
    M = np.array([
        [sum(m * (v @ u) for (m, v), (_, u) in zip(a[0], b[0], strict=True))
         + sum(i * w * x for (i, w), (_, x) in zip(a[1], b[1], strict=True)) for b in every]
        for a in every
    ])  # fmt: skip
    psi = y[STANCE] + model.slope
    turned = np.array([[np.cos(psi), -np.sin(psi)], [np.sin(psi), np.cos(psi)]])
    to_hip = turned @ (model.hip_x, model.hip_y) + (0.0, model.radius)
    e = to_hip / np.linalg.norm(to_hip)
    # The contact point is one radius below the centre of the foot.
    J = np.array([*(model.radius * move[n + STANCE] * e[0] for move in moves), *e])
    work = 0.5 * model.push_off**2 * J @ np.linalg.solve(M, J)
    (found,) = impact.push_off_work(model, y[None])
    assert found == pytest.approx(work, rel=1e-9)


@driven
def test_derivatives_of_driven_strikes_and_swings_equal_finite_differences(assembly, model, free):
    y, h = both_feet_down(model, free), 1e-5
    n = len(model.arm_x)
    angles = state_linked(model, AT_STRIKE, (*np.linspace(0.3, -0.2, n), *np.linspace(-0.5, 0.7, n)))
    image = heel_strike(model, y, [angles])[2 * n :]
    there = [heel_strike(model, tuple(np.add(y, sign * h * np.array(angles)))) for sign in (1.0, -1.0)]
    assert walkers_differ_by(image, np.subtract(*there) / (2.0 * h)) < 1e-6
    J = np.zeros((2 * n, 2 * n))
    jacobian(Mode(model, BENT), 0.0, np.array(y, float), J)
    ahead = [rates(model, BENT, tuple(np.add(y, sign * h * np.array(angles)))) for sign in (1.0, -1.0)]
    assert walkers_differ_by(J[n:] @ angles, np.subtract(*ahead) / (2.0 * h)) < 1e-6


@driven
def test_unit_walker_has_the_scaled_drives(assembly, model, free):
    unit, units = unit_walker(model)
    n = len(model.arm_x)

    def in_units(state, of):
        return (*state[:n], *(x * of for x in state[n:]))

    y, struck = state_of(model, BENT, free), both_feet_down(model, free)
    found = np.array(rates(unit, BENT, in_units(y, units.time))) / units.time**2
    assert walkers_differ_by(found, rates(model, BENT, y)) < 1e-9
    after = heel_strike(unit, in_units(struck, units.time))
    assert walkers_differ_by(in_units(after, 1.0 / units.time), heel_strike(model, struck)) < 1e-9
