"""Compare walkers on one foot with Lagrange's equations and with sums over their masses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from late_imports import import_late
from rigid_physics import heel_strike, knee_strike, potential_energy, rates, state_linked

from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, accelerations, assembled
from walkerlab.evidence.paper.appendix_a import impact as impact_of_appendix_a
from walkerlab.physics.kernels import kernel, uncompiled
from walkerlab.physics.mechanics import impact
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.mechanics.rigid_model import (
    AT_STRIKE,
    BENT,
    STANCE,
    STRAIGHT,
    SWING,
    Mode,
    apply_couplings,
    energies,
    ground_reaction,
    kinetic_energy,
    mode_jacobian,
    swing_foot,
)
from walkerlab.physics.solvers.system import derivative
from walkerlab.scene.parts import Arc, Limb, add_torso, kneed_legs, straight_legs

sp = import_late("sympy")

THIGH = Limb(0.46, 1.1, 0.21, 0.02, 0.013)
SHANK = Limb(0.52, 0.4, 0.17, -0.015, 0.004)
LEG = Limb(0.9, 1.7, 0.35, 0.03, 0.05)
RADIUS, AHEAD = 0.18, 0.03
HIP, TORSO, ABOVE, TORSO_INERTIA = 0.8, 2.3, 0.31, 0.06
G, SLOPE = 9.81, 0.07
KNEED = rigid_on_slope(
    add_torso(kneed_legs(THIGH, SHANK, HIP, Arc(RADIUS, AHEAD)), TORSO, ABOVE, TORSO_INERTIA), G, SLOPE
)
ON_STRAIGHT_LEGS = rigid_on_slope(straight_legs(LEG, HIP, Arc(RADIUS, AHEAD)), G, SLOPE)
PAPER = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, 0.0174, CORRECTED)

angle, rate = st.floats(-0.8, 0.8), st.floats(-3.0, 3.0)
free = st.tuples(angle, angle, angle, rate, rate, rate)  # of swing thigh, stance leg and swing shank


def turned(psi, across, up):
    return sp.Matrix([across * sp.cos(psi) - up * sp.sin(psi), across * sp.sin(psi) + up * sp.cos(psi)])


def kneed_points(thigh, stance, shank, centre):
    """Return (mass, inertia, angle, position) of all parts in the slope's frame, measured from the stance foot's
    centre.
    """
    hip = centre - turned(stance, AHEAD, RADIUS - THIGH.length_m - SHANK.length_m)
    stance_knee = hip + turned(stance, 0, -THIGH.length_m)
    knee = hip + turned(thigh, 0, -THIGH.length_m)
    torso = (thigh + stance) / 2
    return (
        (HIP, 0, stance, hip),
        (THIGH.mass_kg, THIGH.inertia_kg_m2, stance, hip + turned(stance, THIGH.mass_ahead_m, -THIGH.mass_below_m)),
        (SHANK.mass_kg, SHANK.inertia_kg_m2, stance,
         stance_knee + turned(stance, SHANK.mass_ahead_m, -SHANK.mass_below_m)),
        (THIGH.mass_kg, THIGH.inertia_kg_m2, thigh, hip + turned(thigh, THIGH.mass_ahead_m, -THIGH.mass_below_m)),
        (SHANK.mass_kg, SHANK.inertia_kg_m2, shank, knee + turned(shank, SHANK.mass_ahead_m, -SHANK.mass_below_m)),
        (TORSO, TORSO_INERTIA, torso, hip + turned(torso, 0, ABOVE)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def lagrange():
    """Return compiled functions: accelerations of (thigh, stance, shank), kinetic energy, and the momentum rate minus
    gravity along and normal to the slope.
    """
    q, dq, ddq = sp.symbols("q:3"), sp.symbols("dq:3"), sp.symbols("ddq:3")
    points = kneed_points(q[0], q[1], q[2], sp.Matrix([-RADIUS * q[1], RADIUS]))

    def in_time(expression):
        return sum((expression.diff(a) * b for a, b in zip(q, dq, strict=True)), sp.zeros(*expression.shape))

    T, V = sp.Integer(0), sp.Integer(0)
    momentum = sp.zeros(2, 1)
    gravity = sp.Matrix([G * sp.sin(SLOPE), -G * sp.cos(SLOPE)])
    for mass, inertia, psi, place in points:
        velocity = in_time(place)
        T += mass * velocity.dot(velocity) / 2 + inertia * in_time(sp.Matrix([psi]))[0] ** 2 / 2
        V -= mass * gravity.dot(place)
        momentum += mass * velocity
    p = sp.Matrix([T.diff(v) for v in dq])
    M = p.jacobian(sp.Matrix(dq))
    rest = p.jacobian(sp.Matrix(q)) * sp.Matrix(dq) - sp.Matrix([(T - V).diff(a) for a in q])
    force = momentum.jacobian(sp.Matrix(q)) * sp.Matrix(dq) + momentum.jacobian(sp.Matrix(dq)) * sp.Matrix(ddq)
    force -= sum(mass for mass, *_ in points) * gravity
    return sp.lambdify((q, dq), (M, rest, T, V), cse=True), sp.lambdify((q, dq, ddq), force, cse=True)


def kneed_state(numbers):
    thigh, stance, shank, d_thigh, d_stance, d_shank = numbers
    torso, d_torso = 0.5 * (thigh + stance), 0.5 * (d_thigh + d_stance)
    return (thigh, stance, shank, torso, d_thigh, d_stance, d_shank, d_torso)


@given(free)
def test_rolling_kneed_walker_with_torso_obeys_lagrange_equations(lagrange, numbers):
    y = kneed_state(numbers)
    psi = np.array(numbers[:3]) + SLOPE
    M, rest, T, V = lagrange[0](psi, numbers[3:])
    wanted = np.linalg.solve(M, -rest[:, 0])
    found = rates(KNEED, BENT, y)
    assert found[:3] == pytest.approx(wanted, rel=1e-10, abs=1e-9)
    assert found[3] == pytest.approx(0.5 * (found[0] + found[1]), rel=1e-12)
    assert kinetic_energy(KNEED, y) == pytest.approx(T, rel=1e-12)
    upright = lagrange[0]([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])[3]
    at_rest = potential_energy(KNEED, kneed_state((-SLOPE, -SLOPE, -SLOPE, 0, 0, 0)))
    assert potential_energy(KNEED, y) - at_rest == pytest.approx(V - upright, abs=1e-11)
    force = lagrange[1](psi, numbers[3:], wanted)[:, 0]
    assert ground_reaction(Mode(KNEED, BENT), y) == pytest.approx(force, rel=1e-9, abs=1e-8)


@given(free)
def test_straight_leg_moves_as_one_body(lagrange, numbers):
    """With thigh and shank held together, Lagrange's equations of both add up to one equation for one angle."""
    thigh, stance, _, d_thigh, d_stance, _ = numbers
    y = kneed_state((thigh, stance, thigh, d_thigh, d_stance, d_thigh))
    M, rest, _, _ = lagrange[0](np.array([thigh, stance, thigh]) + SLOPE, (d_thigh, d_stance, d_thigh))
    E = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    wanted = np.linalg.solve(E.T @ M @ E, -E.T @ rest[:, 0])
    found = rates(KNEED, STRAIGHT, y)
    assert (found[0], found[1]) == pytest.approx(wanted, rel=1e-10, abs=1e-9)
    assert found[2] == found[0]


@given(st.tuples(angle, angle, rate, rate), st.sampled_from([CORRECTED, AS_PRINTED]))
def test_assembled_compass_swings_as_in_appendix_a(y, sign):
    walker = PAPER._replace(c21_sign=sign, leg_inertia=0.1)
    model = assembled(walker)
    assert rates(model, BENT, y) == pytest.approx(accelerations(walker, *y), rel=1e-12, abs=1e-12)
    assert heel_strike(model, y) == pytest.approx(impact_of_appendix_a(walker, *y), rel=1e-12, abs=1e-12)


def masses_of(model, y, new):
    """Return (mass, position, velocity) and (inertia, rate) of all parts of the kneed walker with straight legs.

    new  whether it stands on the foot that has just come down
    """
    thigh, stance, d_thigh, d_stance = y[0], y[1], y[4], y[5]
    centre = np.array([0.0, RADIUS])
    velocity = np.array([-RADIUS * d_stance, 0.0])

    def at(psi, spin, across, up, of, moving):
        lever = np.array([across * np.cos(psi) - up * np.sin(psi), across * np.sin(psi) + up * np.cos(psi)])
        return of + lever, moving + spin * np.array([-lever[1], lever[0]])

    p_st, p_sw = stance + SLOPE, thigh + SLOPE
    L = THIGH.length_m + SHANK.length_m
    hip, d_hip = at(p_st, d_stance, -AHEAD, L - RADIUS, centre, velocity)
    found, spins = [(HIP, hip, d_hip)], []
    for psi, spin in ((p_st, d_stance), (p_sw, d_thigh)):
        knee, d_knee = at(psi, spin, 0.0, -THIGH.length_m, hip, d_hip)
        found.append((THIGH.mass_kg, *at(psi, spin, THIGH.mass_ahead_m, -THIGH.mass_below_m, hip, d_hip)))
        found.append((SHANK.mass_kg, *at(psi, spin, SHANK.mass_ahead_m, -SHANK.mass_below_m, knee, d_knee)))
        spins.append((THIGH.inertia_kg_m2 + SHANK.inertia_kg_m2, spin))
    found.append((TORSO, *at(0.5 * (p_st + p_sw), 0.5 * (d_stance + d_thigh), 0.0, ABOVE, hip, d_hip)))
    spins.append((TORSO_INERTIA, 0.5 * (d_stance + d_thigh)))
    foot, _ = at(p_sw, d_thigh, AHEAD, RADIUS - L, hip, d_hip)
    return found, spins, hip, d_hip, foot


def angular_momentum(parts, spins, about):
    total = sum(inertia * spin for inertia, spin in spins)
    return total + sum(m * ((r - about)[0] * v[1] - (r - about)[1] * v[0]) for m, r, v in parts)


@given(st.tuples(angle, rate, rate))
def test_heel_strike_conserves_angular_momenta_about_the_new_contact_and_the_hip(numbers):
    """Conserved are the angular momentum of the whole walker about the new contact point, and that of the trailing leg
    plus half of the torso's about the hip.
    """
    stance, d_stance, d_thigh = numbers
    thigh = -2.0 * (SLOPE + KNEED.lean) - stance
    y = kneed_state((thigh, stance, thigh, d_thigh, d_stance, d_thigh))
    after = heel_strike(KNEED, y)
    old, old_spins, hip, _, foot = masses_of(KNEED, y, new=False)
    new, new_spins, new_hip, _, _ = masses_of(KNEED, after, new=True)
    contact, new_contact = foot - [0.0, RADIUS], np.array([0.0, 0.0])
    before = angular_momentum(old, old_spins, contact)
    assert angular_momentum(new, new_spins, new_contact) == pytest.approx(before, rel=1e-9, abs=1e-9)
    # The trailing leg has parts 1 and 2 before the strike, as stance leg, and parts 3 and 4 after it, as swing leg. The
    # torso comes last.
    trailing = angular_momentum(old[1:3], old_spins[:1], hip) + 0.5 * angular_momentum(old[5:], old_spins[2:], hip)
    left = angular_momentum(new[3:5], new_spins[1:2], new_hip) + 0.5 * angular_momentum(new[5:], new_spins[2:], new_hip)
    assert left == pytest.approx(trailing, rel=1e-9, abs=1e-9)
    assert after[2] == after[0]
    assert after[6] == after[4]


@given(free)
def test_knee_strike_conserves_the_momenta_of_the_stance_leg_and_the_straightened_leg(numbers):
    """Conserved are the generalised momenta of Lagrange's equations for the stance leg, and for thigh and shank
    together.
    """
    thigh, stance, _, *speeds = numbers
    y = kneed_state((thigh, stance, thigh, *speeds))
    after = knee_strike(KNEED, y)
    assert after[6] == after[4]
    assert after[7] == pytest.approx(0.5 * (after[4] + after[5]), abs=1e-12)
    assert kinetic_energy(KNEED, after) <= kinetic_energy(KNEED, y) * (1.0 + 1e-12)

    def momenta(state):
        unit, h = np.eye(8), 1e-6
        locked = [unit[4] + unit[6] + 0.5 * unit[7], unit[5] + 0.5 * unit[7]]
        ahead = [kinetic_energy(KNEED, tuple(state + h * e)) for e in locked]
        behind = [kinetic_energy(KNEED, tuple(state - h * e)) for e in locked]
        return (np.array(ahead) - behind) / (2 * h)

    assert momenta(np.array(after)) == pytest.approx(momenta(np.array(y)), rel=1e-7, abs=1e-7)


def differences(f, y, h=1e-5, along=None):
    directions = np.eye(len(y)) if along is None else along
    columns = [np.array(f(tuple(y + h * e))) - np.array(f(tuple(y - h * e))) for e in directions]
    return np.array(columns).T / (2 * h)


@pytest.mark.parametrize("phase", [BENT, STRAIGHT])
@given(numbers=free)
def test_jacobian_equals_finite_differences_of_the_rates(phase, numbers):
    y = np.array(kneed_state(numbers))
    J = np.full((8, 8), np.nan)
    mode_jacobian(Mode(KNEED, phase), 0.0, y, J)
    slopes = differences(lambda x: rates(KNEED, phase, x), y)
    assert J[4:] == pytest.approx(slopes, rel=1e-6, abs=1e-7 * np.abs(slopes).max())
    assert (J[:4] == np.eye(4, 8, 4)).all()


@pytest.mark.parametrize("phase", [BENT, STRAIGHT])
@given(numbers=free)
def test_tangent_columns_obey_the_linearised_equations(phase, numbers):
    y, directions = np.array(kneed_state(numbers)), np.random.default_rng(0).normal(size=(3, 8))
    J, f = np.zeros((8, 8)), np.full(32, np.nan)
    mode_jacobian(Mode(KNEED, phase), 0.0, y, J)
    derivative(Mode(KNEED, phase), 0.0, np.concatenate((y, *directions)), f)
    assert tuple(f[:4]) == tuple(y[4:])
    assert tuple(f[4:8]) == rates(KNEED, phase, y)
    assert f[8:].reshape(3, 8) == pytest.approx(directions @ J.T, rel=1e-9, abs=1e-9 * np.abs(J).max())


@given(numbers=free)
def test_locked_leg_moves_like_a_leg_of_one_piece(numbers):
    """The inertia of the leg of one piece follows from the parallel axis theorem."""
    mass, below = THIGH.mass_kg + SHANK.mass_kg, THIGH.length_m + SHANK.mass_below_m
    ahead = (THIGH.mass_kg * THIGH.mass_ahead_m + SHANK.mass_kg * SHANK.mass_ahead_m) / mass
    down = (THIGH.mass_kg * THIGH.mass_below_m + SHANK.mass_kg * below) / mass
    inertia = THIGH.inertia_kg_m2 + SHANK.inertia_kg_m2
    inertia += THIGH.mass_kg * ((THIGH.mass_ahead_m - ahead) ** 2 + (THIGH.mass_below_m - down) ** 2)
    inertia += SHANK.mass_kg * ((SHANK.mass_ahead_m - ahead) ** 2 + (below - down) ** 2)
    leg = Limb(THIGH.length_m + SHANK.length_m, mass, down, ahead, inertia)
    one_piece = rigid_on_slope(
        add_torso(straight_legs(leg, HIP, Arc(RADIUS, AHEAD)), TORSO, ABOVE, TORSO_INERTIA), G, SLOPE
    )
    y = state_linked(KNEED, STRAIGHT, kneed_state(numbers))
    found = rates(KNEED, STRAIGHT, y)
    expected = rates(one_piece, STRAIGHT, [y[k] for k in (0, 1, 3, 4, 5, 7)])
    assert [found[k] for k in (0, 1, 3)] == pytest.approx(expected, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("strike", [heel_strike, knee_strike])
@given(numbers=free)
def test_derivatives_of_heel_and_knee_strikes_equal_finite_differences(strike, numbers):
    y = np.array(kneed_state(numbers))
    found = np.array(strike(KNEED, y, np.eye(8))[8:]).reshape(8, 8).T
    slopes = differences(lambda x: strike(KNEED, x), y)
    assert found == pytest.approx(slopes, rel=1e-6, abs=1e-7 * np.abs(slopes).max())


@pytest.mark.parametrize("leg", [SWING, STANCE])
def test_both_feet_touch_if_the_legs_lean_symmetrically(leg):
    lean = ON_STRAIGHT_LEGS.lean
    y = apply_couplings(ON_STRAIGHT_LEGS, STRAIGHT, (0.3 - 2.0 * (SLOPE + lean), -0.3) if leg else (0.2, 0.1))
    both = y[SWING] + y[STANCE] + 2.0 * (SLOPE + lean)
    height, _ = swing_foot(ON_STRAIGHT_LEGS, (*y, 0.0, 0.0))
    assert (abs(height) < 1e-12) == (abs(both) < 1e-12)


@pytest.mark.parametrize(("order", "walker"), [
    (1, lambda e: straight_legs(Limb(1.0, 5.0, 0.5), 10.0, Arc(e))),
    (1, lambda e: add_torso(straight_legs(Limb(1.0, 5.0, 0.5), 10.0, Arc()), e, 0.3, 0.0)),
])  # fmt: skip
def test_walker_with_vanishing_foot_radius_and_torso_equals_the_compass(order, walker):
    """As radius and torso mass vanish, the rates of the legs approach those of the compass linearly."""
    y = (0.2, -0.1, -0.8, -1.1)
    compass = rigid_on_slope(straight_legs(Limb(1.0, 5.0, 0.5), 10.0, Arc()), G, SLOPE)
    wanted = np.array(rates(compass, BENT, y))
    errors = []
    for e in (1e-3, 1e-4):
        model = rigid_on_slope(walker(e), G, SLOPE)
        full = y if len(model.zero_state) == 4 else (*y[:2], 0.05, *y[2:], -0.95)
        errors.append(np.abs(np.array(rates(model, BENT, full))[:2] - wanted).max())
    assert np.log10(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


@kernel
def compiled(system, y, f, reaction):
    derivative(system, 0.0, y, f)
    reaction[0], reaction[1] = ground_reaction(system, y[:8])
    reaction[2], reaction[3] = energies(system.model, y[:8])


@kernel
def compiled_strikes(model, y, heel, knee):
    impact.strike(model, model, AT_STRIKE, y, heel)
    impact.strike(model, model, STRAIGHT, y, knee)


@pytest.mark.parametrize("phase", [BENT, STRAIGHT])
def test_compiled_code_reads_no_uninitialised_memory(phase):
    """In Python, scratch memory begins as NaN, so equal results show that compiled code reads none of it."""
    y = np.random.default_rng(1).uniform(-0.5, 0.5, 24)
    results = []
    for rate, strikes in ((compiled, compiled_strikes), (uncompiled(compiled), uncompiled(compiled_strikes))):
        f, reaction, heel, knee = np.zeros(24), np.zeros(4), np.zeros(24), np.zeros(24)
        rate(Mode(KNEED, phase), y, f, reaction)
        strikes(KNEED, y, heel, knee)
        results.append(np.concatenate((f, reaction, heel, knee)))
    np.testing.assert_allclose(results[0], results[1], rtol=1e-11, atol=1e-11)


def test_simulating_a_walk_does_not_modify_the_walker():
    with pytest.raises(ValueError, match="read-only"):
        KNEED.slope = 0.1
    steeper = KNEED.changed(slope=0.1)
    assert (steeper.slope, KNEED.slope) == (0.1, SLOPE)
    assert steeper != KNEED
    assert KNEED.changed(slope=SLOPE) == KNEED
    assert hash(KNEED) == hash(KNEED.changed(slope=SLOPE))
