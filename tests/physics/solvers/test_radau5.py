"""Tests of Radau IIA: its stability function, its orders, published stiff problems, and SciPy's version of it."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from stiff_problems import (
    CURVE,
    EXPLOSION,
    HIRES,
    HIRES_END,
    HIRES_START,
    LINEAR,
    ROBERTSON,
    ROBERTSON_END,
    ROBERTSON_START,
    STIFF,
    VAN_DER_POL,
    VDPOL_END,
    Kinetics,
    Planar,
    drive,
)
from system_rates import rate_of

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers.radau5 import new_radau5
from walkerlab.physics.solvers.registry import dense_degree
from walkerlab.physics.solvers.scipy_methods import jacobian_matrix, right_hand_side
from walkerlab.physics.solvers.stepping import (
    ACCEPTED,
    H_NEXT,
    JACOBIANS,
    OUT_OF_BUDGET,
    REJECTED,
    RHS,
    STEP_DONE,
    STEP_TOO_SMALL,
    T_OLD,
    T,
    advance,
    interpolate,
    rewind,
)

PLENTY = 10**7


@kernel
def read_off(method: Any, system: Any, fraction: float, out: Any) -> None:
    interpolate(method, system, fraction, out)


@kernel
def go_back(method: Any, system: Any) -> None:
    rewind(method, system)


@kernel
def go_on(method: Any, system: Any, t_end: float) -> int:
    return advance(method, system, t_end)


def integrated(system, y, t_end, rtol, atol, budget=PLENTY):
    method = new_radau5(len(y), rtol, atol, budget)
    assert drive(method, system, 0.0, np.array(y), 0.0, t_end) == STEP_DONE
    assert method.clock[T] == t_end
    return method


def linear(z):
    return Planar(LINEAR, z.real, z.imag, 1.0)


def one_step(z):
    """Return the end of a step of length 1 of y' = z y from y = 1. Any error is accepted."""
    method = new_radau5(2, 1e-6, 1e9, PLENTY)
    assert drive(method, linear(z), 0.0, np.array([1.0, 0.0]), 1.0, 1.0) == STEP_DONE
    assert method.counts[ACCEPTED] == 1
    return complex(*method.y)


# ---- stability -----------------------------------------------------------------------------------------------------


@given(size=st.floats(-3.0, 8.0), turn=st.floats(0.5, 1.5))
def test_stability_function_is_the_pade_approximation(size, turn):
    """Compare with the (2, 3) Pade approximation of exp(z) in the whole left half-plane."""
    z = 10.0**size * complex(math.cos(math.pi * turn), math.sin(math.pi * turn))
    pade = (1 + 2 * z / 5 + z**2 / 20) / (1 - 3 * z / 5 + 3 * z**2 / 20 - z**3 / 60)
    assert one_step(z) == pytest.approx(pade, abs=1e-11)


@pytest.mark.parametrize("omega", [0.01, 1.0, 3.0, 30.0, 1e3, 1e6])
def test_undamped_oscillations_do_not_grow(omega):
    """The method is A-stable: |R| <= 1 on the imaginary axis."""
    assert abs(one_step(1j * omega)) <= 1.0 + 1e-12


@pytest.mark.parametrize("z", [-1e4, -1e6, -1e9])
def test_infinitely_stiff_parts_vanish_within_one_step(z):
    """The method is L-stable: R falls like 3 / |z|."""
    assert abs(one_step(complex(z))) == pytest.approx(3.0 / abs(z), rel=1e-2)


# ---- orders --------------------------------------------------------------------------------------------------------


def fixed_steps(system, y, t_end, h, size):
    """Return the end after steps of length h. `size` is an error tolerance that no step exceeds."""
    method = new_radau5(2, 2e-10, size, PLENTY)
    assert drive(method, system, 0.0, np.array(y), h, t_end) == STEP_DONE
    assert method.counts[ACCEPTED] == round(t_end / h)
    assert method.counts[REJECTED] == 0
    return method


def orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


SMOOTH = Planar(VAN_DER_POL, 1.0, 0.0, 1.0)


def test_method_has_order_five_on_a_smooth_nonlinear_problem():
    start = (2.0, 0.0)
    exact = solve_ivp(lambda _, y: rate_of(SMOOTH, y), (0.0, 1.5), start, method="DOP853", rtol=1e-13, atol=1e-14).y[
        :, -1
    ]
    errors = [np.abs(fixed_steps(SMOOTH, start, 1.5, h, 0.3 * h**4).y - exact).max() for h in (0.25, 0.125, 0.0625)]
    assert orders(errors) == pytest.approx(5.0, abs=0.25)


def curve_errors(pull):
    """Return errors for the problem of Prothero and Robinson, which pulls y to (sin t, cos t)."""
    exact = np.array([math.sin(1.5), math.cos(1.5)])
    system, lengths = Planar(CURVE, pull, 0.0, 1.0), (0.5, 0.25, 0.125, 0.0625)
    return [np.abs(fixed_steps(system, (0.0, 1.0), 1.5, h, 1.0).y - exact).max() for h in lengths]


def test_method_has_order_five_on_a_mildly_attracting_curve():
    assert orders(curve_errors(-1.0)) == pytest.approx(5.0, abs=0.3)


def test_solution_on_a_stiffly_attracting_curve_is_exact_to_rounding():
    """The method is stiffly accurate: the error falls with the stiffness even for the longest step."""
    assert max(curve_errors(-1e12)) < 1e-13


def test_dense_output_is_the_collocation_polynomial_of_order_three():
    """The local error is h^4 between the ends of a step, and zero at the ends."""
    start = np.array([1.5, -0.7])
    assert dense_degree(new_radau5(2, 1e-6, 1e-6, 1)) == 3
    errors = []
    for h in (0.2, 0.1, 0.05):
        method = fixed_steps(SMOOTH, start, h, h, 30.0 * h**4)
        worst = 0.0
        for fraction in (0.2, 0.5, 0.8):
            exact = solve_ivp(
                lambda _, y: rate_of(SMOOTH, y),
                (0.0, fraction * h),
                start,
                method="DOP853",
                rtol=1e-13,
                atol=1e-14,
            ).y[:, -1]
            read = np.zeros(2)
            read_off(method, SMOOTH, fraction, read)
            worst = max(worst, np.abs(read - exact).max())
        errors.append(worst)
        for fraction, end in ((0.0, start), (1.0, method.y)):
            read_off(method, SMOOTH, fraction, read)
            np.testing.assert_allclose(read, end, rtol=1e-13)
    assert orders(errors) == pytest.approx(4.0, abs=0.3)


# ---- published problems --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tol", [1e-5, 1e-8])
def test_van_der_pol_ends_as_published(tol):
    method = integrated(STIFF, (2.0, 0.0), 2.0, tol, tol)
    np.testing.assert_allclose(method.y, VDPOL_END, rtol=20 * tol)
    assert method.counts[ACCEPTED] < 5000  # An explicit method would need millions of steps.


@pytest.mark.parametrize("tol", [1e-5, 1e-8])
def test_robertsons_reaction_ends_as_published(tol):
    method = integrated(Kinetics(ROBERTSON), ROBERTSON_START, 1e11, tol, 1e-8 * tol)
    np.testing.assert_allclose(method.y[:3], ROBERTSON_END, rtol=20 * tol)
    assert not method.y[3:].any()
    assert method.y.sum() == pytest.approx(1.0, abs=1e-12)  # The total mass is conserved.


@pytest.mark.parametrize("tol", [1e-5, 1e-8])
def test_hires_problem_ends_at_the_published_state(tol):
    method = integrated(Kinetics(HIRES), HIRES_START, 321.8122, tol, 1e-4 * tol)
    np.testing.assert_allclose(method.y, HIRES_END, rtol=50 * tol)


# ---- a peer, and the work ------------------------------------------------------------------------------------------


def test_scipy_radau_agrees_and_needs_similar_work():
    tol = 1e-8

    def fun(t, y):
        dy = np.zeros(2)
        right_hand_side(STIFF, t, y, dy)
        return dy

    def jac(t, y):
        J = np.zeros((2, 2))
        jacobian_matrix(STIFF, t, y, J)
        return J

    peer = solve_ivp(fun, (0.0, 2.0), (2.0, 0.0), method="Radau", rtol=tol, atol=tol, jac=jac)
    method = integrated(STIFF, (2.0, 0.0), 2.0, tol, tol)
    np.testing.assert_allclose(method.y, peer.y[:, -1], rtol=100 * tol)
    assert method.counts[RHS] < 1.3 * peer.nfev


def test_errors_fall_with_the_tolerance():
    errors = [
        np.abs(integrated(STIFF, (2.0, 0.0), 2.0, tol, tol).y - VDPOL_END).max() for tol in (1e-4, 1e-6, 1e-8, 1e-10)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-9


def test_analytic_jacobian_of_the_system_is_used():
    """The method computes no differences. Without the Jacobian, it could not take large steps."""
    told, untold = (Planar(LINEAR, -1e5, 0.0, part) for part in (1.0, 0.0))
    knowing = integrated(told, (1.0, 0.5), 1.0, 1e-6, 1e-6)
    ignorant = new_radau5(2, 1e-6, 1e-6, PLENTY)
    drive(ignorant, untold, 0.0, np.array([1.0, 0.5]), 0.0, 1.0)
    assert knowing.counts[ACCEPTED] < 100
    assert ignorant.counts[RHS] > 100 * knowing.counts[RHS]


def test_radau5_counts_its_work():
    method = integrated(STIFF, (2.0, 0.0), 2.0, 1e-6, 1e-6)
    rhs, accepted, jacobians = (int(method.counts[i]) for i in (RHS, ACCEPTED, JACOBIANS))
    # The start and every accepted step evaluate once, and every Newton iteration three times. A step has at least one
    # iteration.
    assert rhs >= 1 + 4 * accepted
    assert 1 <= jacobians <= accepted + method.counts[REJECTED] + 1


# ---- how it ends ---------------------------------------------------------------------------------------------------


def test_radau5_stops_at_its_budget():
    method = new_radau5(2, 1e-8, 1e-8, 500)
    assert drive(method, STIFF, 0.0, np.array([2.0, 0.0]), 0.0, 2.0) == OUT_OF_BUDGET
    assert 500 <= method.counts[RHS] < 500 + 3 * 7 + 3
    assert 0.0 < method.clock[T] < 2.0


def test_steps_that_shrink_to_rounding_end_the_run():
    """The solution of y' = y^2 is infinite at t = 1."""
    method = new_radau5(2, 1e-8, 1e-8, PLENTY)
    assert drive(method, Planar(EXPLOSION, 0.0, 0.0, 1.0), 0.0, np.array([1.0, 0.0]), 0.0, 2.0) == STEP_TOO_SMALL
    assert method.clock[T] == pytest.approx(1.0, abs=1e-6)
    assert np.all(np.isfinite(method.y))


def test_nonfinite_state_ends_the_run():
    method = new_radau5(2, 1e-8, 1e-8, 10**5)
    assert drive(method, SMOOTH, 0.0, np.array([math.nan, 0.0]), 0.0, 1.0) in (STEP_TOO_SMALL, OUT_OF_BUDGET)


def test_step_can_be_repeated_up_to_an_event():
    method = integrated(SMOOTH, (2.0, 0.0), 1.0, 1e-8, 1e-8)
    assert go_on(method, SMOOTH, 5.0) == STEP_DONE
    t_old, t_new, before = float(method.clock[T_OLD]), float(method.clock[T]), method.y_old.copy()
    event, read = t_old + 0.37 * (t_new - t_old), np.zeros(2)
    read_off(method, SMOOTH, 0.37, read)
    go_back(method, SMOOTH)
    assert method.clock[T] == t_old
    np.testing.assert_array_equal(method.y, before)
    while method.clock[T] < event:
        assert go_on(method, SMOOTH, event) == STEP_DONE
    assert method.clock[T] == event
    np.testing.assert_allclose(method.y, read, atol=1e-6)
    fresh = integrated(SMOOTH, (2.0, 0.0), event, 1e-12, 1e-12)
    np.testing.assert_allclose(method.y, fresh.y, atol=1e-6)
    assert method.clock[H_NEXT] > 0.0


def test_repeated_run_is_bitwise_equal():
    one, other = (integrated(STIFF, (2.0, 0.0), 2.0, 1e-7, 1e-7) for _ in range(2))
    np.testing.assert_array_equal(one.y, other.y)
    np.testing.assert_array_equal(one.counts, other.counts)
    again = drive(one, STIFF, 0.0, np.array([2.0, 0.0]), 0.0, 2.0)
    assert again == STEP_DONE
    np.testing.assert_array_equal(one.y, other.y)
