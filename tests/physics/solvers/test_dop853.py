"""Tests of DOP853: its tableau, its orders, a published orbit, and SciPy's version of it."""

import math
from typing import NamedTuple

import numpy as np
import pytest
import rooted_trees
from scipy.integrate import solve_ivp

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers import dop853_tableau as tableau
from walkerlab.physics.solvers.dop853 import new_dop853
from walkerlab.physics.solvers.stepping import (
    ACCEPTED,
    BUDGET,
    H_NEXT,
    OUT_OF_BUDGET,
    REJECTED,
    RHS,
    STEP_DONE,
    STEP_TOO_SMALL,
    T,
    advance,
    begin,
    interpolate,
    prepare_dense,
    rewind,
)
from walkerlab.physics.solvers.system import block, derivative

# ---- tableau -------------------------------------------------------------------------------------------------------


def matrix(stages):
    A = np.zeros((stages, stages))
    for s, row in enumerate(tableau.A[:stages]):
        A[s, : len(row)] = row
    return A


A, B, C = matrix(12), np.array(tableau.A[12]), np.array(tableau.NODES[:12])


def defects(weights, order):
    return rooted_trees.defects(A, weights, order)


def test_number_of_trees_agrees_with_cayley():
    assert [len(rooted_trees.trees(order)) for order in range(1, 9)] == [1, 1, 2, 4, 9, 20, 48, 115]


def test_tableau_nodes_equal_the_row_sums_of_their_stages():
    assert A.sum(axis=1) == pytest.approx(C, abs=1e-14)
    extra = [sum(row) for row in tableau.A[13:]]
    assert extra == pytest.approx(tableau.NODES[13:16], abs=1e-14)


@pytest.mark.parametrize("order", range(1, 9))
def test_solution_meets_every_order_condition_up_to_8(order):
    # Coefficients have 16 digits here, and their products can be as large as some tens.
    assert defects(B, order) == pytest.approx([0.0] * len(rooted_trees.trees(order)), abs=1e-14)


def test_dop853_is_not_of_order_9():
    assert max(map(abs, defects(B, 9))) > 1e-9


@pytest.mark.parametrize(("error", "order"), [(tableau.ERROR_5, 5), (tableau.ERROR_3, 3)])
def test_error_weights_belong_to_solutions_of_order_5_and_3(error, order):
    embedded = B - np.array(error)
    for lower in range(1, order + 1):
        assert defects(embedded, lower) == pytest.approx([0.0] * len(rooted_trees.trees(lower)), abs=1e-14)
    assert max(map(abs, defects(embedded, order + 1))) > 1e-6


# ---- orders --------------------------------------------------------------------------------------------------------


class Pair(NamedTuple):
    """The equations y1' = y1 cos t and y2' = -t y2, with the solutions exp(sin t) and exp(-t^2 / 2)."""


@block.case(Pair)
def pair_block(system):
    return (0.0, 0.0)


@derivative.case(Pair)
def pair_derivative(system, t, y, f):
    f[0], f[1] = y[0] * math.cos(t), -t * y[1]


def pair_solution(t):
    return np.array([np.exp(np.sin(t)), np.exp(-0.5 * t * t)])


class Arenstorf(NamedTuple):
    """Satellite in the field of earth and moon (Hairer, Norsett, Wanner, section II.0, (0.1) and (0.2))."""

    moon: float


ARENSTORF = Arenstorf(0.012277471)
ORBIT_START = (0.994, 0.0, 0.0, -2.00158510637908252240537862224)
ORBIT_PERIOD = 17.0652165601579625588917206249


@block.case(Arenstorf)
def arenstorf_block(system):
    return (0.0, 0.0, 0.0, 0.0)


@derivative.case(Arenstorf)
def arenstorf_derivative(system, t, y, f):
    moon, earth = system.moon, 1.0 - system.moon
    to_earth = ((y[0] + moon) ** 2 + y[1] ** 2) ** 1.5
    to_moon = ((y[0] - earth) ** 2 + y[1] ** 2) ** 1.5
    f[0], f[1] = y[2], y[3]
    f[2] = y[0] + 2.0 * y[3] - earth * (y[0] + moon) / to_earth - moon * (y[0] - earth) / to_moon
    f[3] = y[1] - 2.0 * y[2] - earth * y[1] / to_earth - moon * y[1] / to_moon


@kernel
def integrate(method, system, y, t_end, h, fraction, sample):
    """Integrate from 0 to t_end in steps of h, or in steps that the method chooses. Keep the dense output of the last
    step at `fraction`.
    """
    begin(method, system, 0.0, y, h)
    status = STEP_DONE
    while method.clock[T] < t_end and status == STEP_DONE:
        if h > 0.0:
            method.clock[H_NEXT] = h
        status = advance(method, system, t_end)
    prepare_dense(method, system)
    interpolate(method, system, fraction, sample)
    return status


def fixed_steps(steps, fraction=1.0):
    method, sample = new_dop853(2, 1e30, 1e30, 10**6), np.zeros(2)
    status = integrate(method, Pair(), np.ones(2), 1.5, 1.5 / steps, fraction, sample)
    assert status == STEP_DONE
    assert method.counts[ACCEPTED] == steps
    return method.y, sample


def observed_order(errors):
    return np.log2(errors[0] / errors[1])


def test_observed_order_is_8():
    # The steps are so long that errors exceed rounding, and so short that the leading term dominates.
    errors = [np.abs(fixed_steps(steps)[0] - pair_solution(1.5)).max() for steps in (6, 12)]
    assert observed_order(errors) == pytest.approx(8.0, abs=0.5)


def test_dense_output_is_of_order_7():
    # Within a step, the error of the polynomial, h^8, dominates that of the solution.
    errors = []
    for steps in (6, 12):
        time = 1.5 - 0.63 * 1.5 / steps
        errors.append(np.abs(fixed_steps(steps, 0.37)[1] - pair_solution(time)).max())
    assert observed_order(errors) > 7.0


@pytest.mark.parametrize("fraction", [0.0, 1.0])
def test_dense_output_interpolates_the_ends_of_the_step(fraction):
    end, sample = fixed_steps(6, fraction)
    expected = end if fraction == 1.0 else fixed_steps_until(5, 6)
    assert sample == pytest.approx(expected, abs=1e-15)


def fixed_steps_until(steps, of):
    method = new_dop853(2, 1e30, 1e30, 10**6)
    integrate(method, Pair(), np.ones(2), 1.5 * steps / of, 1.5 / of, 1.0, np.zeros(2))
    return method.y


# ---- error control -------------------------------------------------------------------------------------------------


def orbit(rtol, budget=10**6):
    method = new_dop853(4, rtol, rtol, budget)
    status = integrate(method, ARENSTORF, np.array(ORBIT_START), ORBIT_PERIOD, 0.0, 1.0, np.zeros(4))
    return status, method.y, method.counts


def test_arenstorf_orbit_closes():
    status, end, counts = orbit(1e-13)
    assert status == STEP_DONE
    # the tolerance of 1e-13, magnified by the encounters with the moon
    assert end == pytest.approx(ORBIT_START, abs=1e-7)
    assert counts[REJECTED] > 0


def test_tighter_tolerance_gives_smaller_error():
    errors = [np.abs(orbit(rtol)[1][:2] - ORBIT_START[:2]).max() for rtol in (1e-7, 1e-9, 1e-11)]
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize("rtol", [1e-8, 1e-11])
def test_scipy_dop853_needs_the_same_work_for_the_same_error(rtol):
    _, end, counts = orbit(rtol)

    def rate(t, y):
        f = np.zeros(4)
        derivative(ARENSTORF, t, y, f)
        return f

    scipys = solve_ivp(rate, (0.0, ORBIT_PERIOD), ORBIT_START, "DOP853", rtol=rtol, atol=rtol)
    assert counts[RHS] == pytest.approx(scipys.nfev, rel=0.15)
    ours, theirs = (np.abs(last[:2] - ORBIT_START[:2]).max() for last in (end, scipys.y[:, -1]))
    assert ours < 10.0 * theirs


def test_every_right_hand_side_is_counted():
    _, _, counts = orbit(1e-9)
    # two at the start, twelve for each attempted step, and three for the dense output of the last step
    assert counts[RHS] == 2 + 12 * (counts[ACCEPTED] + counts[REJECTED]) + 3


def test_budget_ends_the_integration():
    status, _, counts = orbit(1e-12, budget=500)
    assert status == OUT_OF_BUDGET
    assert counts[BUDGET] <= counts[RHS] < 500 + 20


def test_solution_with_a_singularity_stops_at_the_smallest_step():
    # The satellite starts in the centre of the moon.
    method = new_dop853(4, 1e-10, 1e-10, 10**6)
    inside_the_moon = (1.0 - ARENSTORF.moon, 0.0, 0.0, 0.0)
    status = integrate(method, ARENSTORF, np.array(inside_the_moon), 1.0, 0.0, 1.0, np.zeros(4))
    assert status == STEP_TOO_SMALL


@kernel
def there_and_back(method, system, y, h, middle, back):
    """Take a step, undo it, and take half of it."""
    begin(method, system, 0.0, y, h)
    advance(method, system, 1e9)
    prepare_dense(method, system)
    interpolate(method, system, 0.5, middle)
    rewind(method, system)
    for i in range(y.size):
        back[i] = method.y[i]
    advance(method, system, 0.5 * h)


def test_step_can_be_repeated_up_to_an_event():
    method, middle, back = new_dop853(2, 1e-12, 1e-12, 10**6), np.zeros(2), np.zeros(2)
    there_and_back(method, Pair(), np.ones(2), 0.05, middle, back)
    assert tuple(back) == (1.0, 1.0)
    assert method.clock[T] == 0.025
    assert method.y == pytest.approx(middle, abs=1e-13)
    assert method.y == pytest.approx(pair_solution(0.025), abs=1e-15)


class Twice(NamedTuple):
    """Two copies of the pair in one state, which is larger than a block."""


@block.case(Twice)
def twice_block(system):
    return (0.0, 0.0)


@derivative.case(Twice)
def twice_derivative(system, t, y, f):
    for at in range(0, y.size, 2):
        f[at], f[at + 1] = y[at] * math.cos(t), -t * y[at + 1]


def test_state_of_several_blocks_is_integrated_as_a_whole():
    method = new_dop853(6, 1e-12, 1e-12, 10**6)
    assert integrate(method, Twice(), np.ones(6), 1.5, 0.0, 1.0, np.zeros(6)) == STEP_DONE
    assert method.y.reshape(3, 2) == pytest.approx(np.tile(pair_solution(1.5), (3, 1)), abs=1e-10)
