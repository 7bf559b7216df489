"""Compare real and complex LU factorisations with row exchanges with NumPy. Every Radau test uses their
compiled form.
"""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from walkerlab.physics.solvers.linear import factor, solve

sizes = st.integers(1, 9)
entries = st.floats(-1e3, 1e3).map(lambda x: x if abs(x) > 1e-6 else 0.0)


def solved(A, pivots, b):
    fine = factor(A, pivots, b.size)
    if fine:
        solve(A, pivots, b, 0, b.size)
    return fine


@st.composite
def systems(draw):
    n = draw(sizes)
    A, b = draw(arrays(float, (n, n), elements=entries)), draw(arrays(float, n, elements=entries))
    if draw(st.booleans()):
        A = A + 1j * draw(arrays(float, (n, n), elements=entries))
        b = b + 1j * draw(arrays(float, n, elements=entries))
    return A, b


def check(A, b):
    x, pivots = b.copy(), np.zeros(b.size, np.int64)
    assert solved(A.copy(), pivots, x)
    # The method is backward stable: the residual is a few roundings of |A| |x|, however ill-conditioned A is.
    size = np.abs(A) @ np.abs(x) + np.abs(b)
    growth = 2.0 ** (b.size - 1)
    assert np.all(np.abs(A @ x - b) <= 1e-14 * b.size * growth * (size.max() + 1e-300))
    return x


@given(systems())
def test_solution_satisfies_its_equations(system):
    A, b = system
    assume(np.linalg.matrix_rank(A) == b.size)
    assume(np.linalg.cond(A) < 1e12)
    x = check(A, b)
    expected = np.linalg.solve(A, b)
    assert np.abs(x - expected).max() <= 1e-13 * np.linalg.cond(A) * (np.abs(expected).max() + 1e-300)


def test_rows_are_exchanged_at_a_zero_or_tiny_pivot():
    """Without exchanges, the first system would divide by zero, and the second would lose every digit."""
    for A in (np.array([[0.0, 1.0], [1.0, 1.0]]), np.array([[1e-20, 1.0], [1.0, 1.0]])):
        b = np.array([1.0, 2.0])
        solved(A.copy(), np.zeros(2, np.int64), b)
        np.testing.assert_allclose(b, [1.0, 1.0], rtol=1e-15)


def test_badly_scaled_system_of_a_stiff_step_is_solved():
    """Radau meets such matrices gamma/h I - J if one over a tiny step stands next to a contact stiffness."""
    A = np.diag([3.6e9] * 4) - np.array(
        [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, -1e2, -3.0, 0.0], [0.0, -1e8, 0.0, -4e4]]
    )
    check(A, np.array([1.0, -1e-6, 3.0, 1e4]))


@pytest.mark.parametrize("n", [1, 3])
def test_singular_matrix_is_reported(n):
    A = np.ones((n, n)) if n > 1 else np.zeros((1, 1))
    assert not factor(A.copy(), np.zeros(n, np.int64), n)
    assert not factor(A.astype(complex), np.zeros(n, np.int64), n)
