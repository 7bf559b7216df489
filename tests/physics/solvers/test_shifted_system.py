"""Compare the solutions of systems (s I - J) x = r of implicit methods, in full and in half size, with NumPy."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from walkerlab.physics.solvers.radau5 import factor_shifted, solve_shifted, unknowns

entries = st.floats(-1e3, 1e3)
shifts = st.one_of(st.floats(0.1, 1e4), st.builds(complex, st.floats(0.1, 1e4), st.floats(-1e4, 1e4)))


@st.composite
def motions(draw):
    """Draw Jacobians of q' = v, v' = f(q, v)."""
    half = draw(st.integers(1, 4))
    lower = draw(arrays(float, (half, 2 * half), elements=entries))
    return np.vstack((np.hstack((np.zeros((half, half)), np.eye(half))), lower))


def solved(J, left, s, r):
    n = J.shape[0]
    x, factors = r.astype(np.result_type(s, float)), np.zeros((n, n), np.result_type(s, float))
    pivots = np.zeros(n, np.int64)
    assert factor_shifted(J, left, s, factors, pivots)
    solve_shifted(J, left, s, factors, pivots, x)
    return x


@given(motions(), shifts, st.data())
def test_systems_from_equations_of_motion_are_solved_with_half_as_many_unknowns(J, s, data):
    n = J.shape[0]
    matrix = s * np.eye(n) - J
    assume(np.linalg.cond(matrix) < 1e8)
    r = data.draw(arrays(float, n, elements=entries))
    assert unknowns(J) == n // 2
    expected = np.linalg.solve(matrix, r)
    # Because x_q = (r_q + x_v) / s, the rounding of r over the shift remains in the positions.
    allowed = 1e-13 * np.linalg.cond(matrix) ** 2 * np.abs(expected).max() + 1e-15 * np.abs(r).max() / abs(s) + 1e-300
    for left in (n // 2, n):
        assert np.abs(solved(J, left, s, r) - expected).max() <= allowed


@pytest.mark.parametrize(
    "J",
    [np.zeros((3, 3)), np.array([[0.0, 2.0], [1.0, 0.0]]), np.array([[1e-9, 1.0], [1.0, 0.0]]), np.ones((1, 1))],
    ids=["odd", "scaled velocity", "not quite", "one equation"],
)
def test_systems_that_cannot_be_halved_keep_all_their_unknowns(J):
    assert unknowns(J) == J.shape[0]


def test_stiff_contact_step_is_solved_to_rounding():
    """The foot is on ground of 1e9 N/m and 1e5 N s/m, and the step is a microsecond."""
    J = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [-40.0, 3.0, -0.1, 0.0], [2.0, -5e7, 0.0, -5e3]])
    x = np.array([0.1, 1e-6, -2.0, 1e-2])
    for s in (3.6e6, 2.7e6 - 3.1e6j):
        np.testing.assert_allclose(solved(J, 2, s, s * x - J @ x), x, rtol=1e-13)


@pytest.mark.parametrize("damping", [1.0, 1e6, 1e12])
@pytest.mark.parametrize("shift", [1.0, 1e3, 1e9])
def test_velocities_keep_their_digits_under_stiff_damping(damping, shift):
    """Velocities are then far smaller than shift times position, so they must not be computed as such a difference."""
    J, r = np.array([[0.0, 1.0], [-1e6, -damping]]), np.array([1.0, 1.0])
    s, k, c = Fraction(shift), Fraction(10**6), Fraction(damping)
    determinant = s * (s + c) + k
    exact = np.array([float((s + c + 1) / determinant), float((s - k) / determinant)])
    # Positions keep the digits of r over the shift.
    np.testing.assert_array_less(np.abs(solved(J, 1, shift, r) - exact), 1e-14 * np.abs(exact) + [1e-15 / shift, 0.0])


def test_singular_matrix_is_reported():
    J = np.array([[0.0, 1.0], [4.0, 0.0]])
    assert not factor_shifted(J, 1, 2.0, np.zeros((2, 2)), np.zeros(2, np.int64))
