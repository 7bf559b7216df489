"""Check that every tableau in the registry fulfils the conditions of its order, and not those of the next one."""

import numpy as np
import pytest
from rooted_trees import defects, trees
from scipy.integrate import DOP853, RK45
from scipy.integrate._ivp import radau as scipy_radau

from walkerlab.physics.solvers import dop853_tableau, radau5
from walkerlab.physics.solvers.registry import METHODS


def square(rows, stages):
    A = np.zeros((stages, stages))
    for stage, row in enumerate(rows):
        A[stage, : len(row)] = row
    return A


def collocation(T, real, pair, c):
    """Return A and b of a stiffly accurate method whose A^-1 is T diag(real, pair) T^-1."""
    turned = np.array([[real, 0.0, 0.0], [0.0, pair.real, pair.imag], [0.0, -pair.imag, pair.real]])
    A = np.linalg.inv(T @ turned @ np.linalg.inv(T))
    return A, A[-1], np.array(c)


def own_dop853():
    return square(dop853_tableau.A[:12], 12), np.array(dop853_tableau.A[12]), np.array(dop853_tableau.NODES[:12])


def own_radau5():
    T = np.array([radau5.T_1, radau5.T_2, (1.0, 1.0, 0.0)])
    return collocation(T, radau5.GAMMA, radau5.ALPHA + 1j * radau5.BETA, radau5.RADAU_NODES)


def of_scipys_radau():
    # This method has its complex pair in the opposite order.
    return collocation(scipy_radau.T, scipy_radau.MU_REAL, np.conj(scipy_radau.MU_COMPLEX), scipy_radau.C)


TABLEAUS = {
    "dop853": own_dop853,
    "radau5": own_radau5,
    "scipy-rk45": lambda: (square(RK45.A, 6), RK45.B, RK45.C),
    "scipy-dop853": lambda: (square(DOP853.A, 12), DOP853.B, DOP853.C),
    "scipy-radau": of_scipys_radau,
}
every_tableau = pytest.mark.parametrize("name", TABLEAUS)


def test_every_one_step_method_has_its_tableau_checked():
    """The remaining methods are multistep methods, which vary their order."""
    assert set(TABLEAUS) == {name for name, method in METHODS.items() if method.orders[0] == method.orders[1]}


@every_tableau
def test_stage_times_equal_the_row_sums(name):
    A, _, c = TABLEAUS[name]()
    assert A.sum(axis=1) == pytest.approx(c, abs=1e-14)


@every_tableau
def test_every_order_condition_is_met(name):
    """Coefficients have 16 digits, and their products can be as large as some tens."""
    A, b, _ = TABLEAUS[name]()
    for order in range(1, METHODS[name].orders[1] + 1):
        assert defects(A, b, order) == pytest.approx([0.0] * len(trees(order)), abs=1e-14)


@every_tableau
def test_method_fails_an_order_condition_of_the_next_order(name):
    A, b, _ = TABLEAUS[name]()
    assert max(map(abs, defects(A, b, METHODS[name].orders[1] + 1))) > 1e-9
