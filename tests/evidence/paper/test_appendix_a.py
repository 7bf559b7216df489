"""Compare the printed equations with Lagrange's equations, derived here, and both with the compiled physics."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from late_imports import import_late
from printed_compass import ground_reaction, kinetic_energy, potential_energy

from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, accelerations

sp = import_late("sympy")
paper = import_late("appendix_a")


@pytest.fixture(scope="module")
def swing():
    return paper.from_lagrange(paper.q, sp.zeros(2, 1))


@pytest.fixture(scope="module")
def released():
    return paper.from_lagrange(paper.q_e, sp.Matrix([paper.x, paper.y]))


def without_inertia(matrix):
    return matrix.subs({paper.J: 0})


def same(expression, other):
    return sp.simplify(sp.expand_trig(expression - other)) == 0


def test_printed_inertia_matrix_and_gravity_of_the_swing_phase_are_right(swing):
    printed = paper.printed_swing()
    assert paper.differing(printed.D, without_inertia(swing.D)) == {}
    assert paper.differing(printed.G, swing.G) == {}


def test_printed_coriolis_matrix_has_one_wrong_sign_in_row_2(swing):
    wrong = paper.differing(paper.printed_swing().bias, swing.bias)
    assert list(wrong) == [(1, 0)]
    term = paper.m * paper.L * paper.b * paper.w_1**2 * sp.sin(paper.theta_2 - paper.theta_1)
    assert same(wrong[1, 0], 2 * term)


def test_printed_inertia_matrix_and_gravity_with_the_foot_released_are_right(released):
    printed = paper.printed_impact()
    assert paper.differing(printed.D, without_inertia(released.D)) == {}
    assert paper.differing(printed.G, released.G) == {}


def test_printed_coriolis_matrix_with_the_foot_released_has_the_same_wrong_sign(released):
    wrong = paper.differing(paper.printed_impact().bias, released.bias)
    assert list(wrong) == [(1, 0)]
    term = paper.m * paper.L * paper.b * paper.w_1**2 * sp.sin(paper.theta_2 - paper.theta_1)
    assert same(wrong[1, 0], 2 * term)


def test_printed_foot_position_has_a_wrong_height():
    wrong = paper.differing(paper.PRINTED_FOOT, paper.swing_foot(sp.Matrix([paper.x, paper.y])))
    assert list(wrong) == [(1, 0)]
    assert same(wrong[1, 0], 2 * paper.L * (sp.cos(paper.theta_1) - sp.cos(paper.theta_2)))


def test_first_two_rows_of_the_released_equations_are_the_swing_phase(released, swing):
    assert paper.differing(released.D[:2, :2], swing.D) == {}
    assert paper.differing(released.bias[:2, :], swing.bias) == {}


lengths = st.floats(0.1, 10.0)
masses = st.floats(0.1, 100.0)
walkers = st.builds(
    lambda L, fraction, m, M_H, J, g, slope: RigidWalker(L, fraction * L, m, M_H, J * m * L * L, g, slope, CORRECTED),
    lengths,
    st.floats(0.05, 0.95),
    masses,
    st.floats(0.0, 100.0),
    st.floats(0.0, 0.3),
    st.floats(0.5, 50.0),
    st.floats(-0.5, 0.5),
)
angles = st.floats(-1.5, 1.5)
rates = st.floats(-3.0, 3.0)
states = st.tuples(angles, angles, rates, rates)


@pytest.fixture(scope="module")
def numeric(swing):
    """Return D, bias, G, energies and ground reaction, as derived, as functions of parameters, angles and rates."""
    names = sp.symbols("t1 t2 u1 u2 a1 a2")
    stance_mass, hip, swing_mass = paper.leg_masses_and_hip(sp.zeros(2, 1))
    bodies = ((paper.m, stance_mass), (paper.M_H, hip), (paper.m, swing_mass))
    momentum_rate = sum((mass * p.diff(paper.t, 2) for mass, p in bodies), sp.zeros(2, 1))
    weight = sp.Matrix([0, paper.g * (paper.M_H + 2 * paper.m)])
    potential = sum(mass * paper.g * p[1] for mass, p in bodies)
    substitutions = [
        *zip(paper.dq.diff(paper.t), names[4:], strict=True),
        *zip(paper.dq, names[2:4], strict=True),
        *zip(paper.q, names[:2], strict=True),
    ]

    def function(expression):
        return sp.lambdify((*paper.PARAMETERS, *names), expression.subs(substitutions), "numpy")

    return {
        "D": function(swing.D),
        "force": function(swing.bias + swing.G),
        "kinetic": function((paper.dq.T * swing.D * paper.dq)[0] / 2),
        "potential": function(sp.sympify(potential)),
        "reaction": function(momentum_rate + weight),
    }


def arguments(walker, state, accelerated=(0.0, 0.0)):
    parameters = walker.leg_length, walker.foot_to_mass, walker.leg_mass, walker.hip_mass, walker.leg_inertia
    return (*parameters, walker.gravity, *state, *accelerated)


def close(value, expected, scale):
    """Whether two values agree up to the rounding of terms of size `scale`. Cancellation in D^-1 can magnify this
    rounding.
    """
    return abs(value - expected) <= 1e-11 * scale


@given(walkers, states)
def test_accelerations_solve_lagrange_equations(numeric, walker, state):
    alpha = accelerations(walker, *state)
    D = numeric["D"](*arguments(walker, state))
    force = numeric["force"](*arguments(walker, state)).ravel()
    for row in range(2):
        terms = (D[row][0] * alpha[0], D[row][1] * alpha[1], force[row])
        assert close(sum(terms), 0.0, max(map(abs, terms)) + D[row][row] * max(map(abs, alpha)))


@given(walkers, states)
def test_energies_are_sums_over_the_masses(numeric, walker, state):
    kinetic = float(numeric["kinetic"](*arguments(walker, state)))
    potential = float(numeric["potential"](*arguments(walker, state)))
    scale = walker.gravity * walker.leg_length * (walker.hip_mass + 2 * walker.leg_mass)
    assert kinetic_energy(walker, *state) == pytest.approx(kinetic, rel=1e-12, abs=1e-12 * scale)
    assert potential_energy(walker, *state[:2]) == pytest.approx(potential, rel=1e-12, abs=1e-12 * scale)


@given(walkers, states)
def test_ground_reaction_is_the_momentum_rate_plus_the_weight(numeric, walker, state):
    alpha = accelerations(walker, *state)
    force_x, force_y = numeric["reaction"](*arguments(walker, state, alpha)).ravel()
    along, normal = ground_reaction(walker, *state)
    sine, cosine = math.sin(walker.slope), math.cos(walker.slope)
    mass = walker.hip_mass + 2 * walker.leg_mass
    scale = mass * (walker.gravity + walker.leg_length * (9.0 + max(map(abs, alpha))))
    # The direction down the slope is (cos phi, -sin phi).
    assert close(along, force_x * cosine - force_y * sine, scale)
    assert close(normal, force_x * sine + force_y * cosine, scale)


@settings(max_examples=30)
@given(walkers, states)
def test_printed_equations_differ_only_in_the_row_of_the_stance_leg(numeric, walker, state):
    alpha = accelerations(walker._replace(c21_sign=AS_PRINTED), *state)
    D = numeric["D"](*arguments(walker, state))
    force = numeric["force"](*arguments(walker, state)).ravel()
    b = walker.leg_length - walker.foot_to_mass
    misprint = 2 * walker.leg_mass * walker.leg_length * b * state[2] ** 2 * math.sin(state[1] - state[0])
    for row, extra in enumerate((0.0, misprint)):
        terms = (D[row][0] * alpha[0], D[row][1] * alpha[1], force[row], extra)
        assert close(sum(terms), 0.0, max(map(abs, terms)) + D[row][row] * max(map(abs, alpha)))
