"""Tests of all methods in the registry. A new one is tested as soon as it is listed."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers.registry import METHODS, dense_degree, method_named
from walkerlab.physics.solvers.stepping import (
    ACCEPTED,
    OUT_OF_BUDGET,
    RHS,
    STEP_DONE,
    T_OLD,
    T,
    advance,
    begin,
    interpolate,
    prepare_dense,
    rewind,
)
from walkerlab.physics.solvers.system import block, derivative, jacobian

MOON = 0.012277471
PLENTY = 10**6


class Satellite(NamedTuple):
    """Arenstorf's orbit about earth and moon (Hairer, Norsett, Wanner, section II.0, (0.1) and (0.2))."""

    moon: float


START = np.array((0.994, 0.0, 0.0, -2.00158510637908252240537862224))
PERIOD = 17.0652165601579625588917206249


@block.case(Satellite)
def satellite_block(system):
    return (0.0, 0.0, 0.0, 0.0)


@derivative.case(Satellite)
def satellite_derivative(system, t, y, f):
    m, e = system.moon, 1.0 - system.moon
    earth = ((y[0] + m) ** 2 + y[1] ** 2) ** 1.5
    moon = ((y[0] - e) ** 2 + y[1] ** 2) ** 1.5
    f[0], f[1] = y[2], y[3]
    f[2] = y[0] + 2.0 * y[3] - e * (y[0] + m) / earth - m * (y[0] - e) / moon
    f[3] = y[1] - 2.0 * y[2] - e * y[1] / earth - m * y[1] / moon


@jacobian.case(Satellite)
def satellite_jacobian(system, t, y, J):
    m, e = system.moon, 1.0 - system.moon
    x_e, x_m = y[0] + m, y[0] - e
    r_e, r_m = math.sqrt(x_e * x_e + y[1] * y[1]), math.sqrt(x_m * x_m + y[1] * y[1])
    for i in range(4):
        for j in range(4):
            J[i, j] = 0.0
    J[0, 2], J[1, 3], J[2, 3], J[3, 2] = 1.0, 1.0, 2.0, -2.0
    pull = e / r_e**3 + m / r_m**3
    J[2, 0] = 1.0 - pull + 3.0 * (e * x_e * x_e / r_e**5 + m * x_m * x_m / r_m**5)
    J[3, 1] = 1.0 - pull + 3.0 * (e * y[1] * y[1] / r_e**5 + m * y[1] * y[1] / r_m**5)
    J[2, 1] = J[3, 0] = 3.0 * y[1] * (e * x_e / r_e**5 + m * x_m / r_m**5)


ORBIT = Satellite(MOON)


@kernel
def drive(method, system, start, t_end):
    begin(method, system, 0.0, start, 0.0)
    status = STEP_DONE
    while method.clock[T] < t_end and status == STEP_DONE:
        status = advance(method, system, t_end)
    return status


@kernel
def start(method, system, y):
    begin(method, system, 0.0, y, 0.0)


@kernel
def step(method, system, t_end):
    return advance(method, system, t_end)


@kernel
def half_way(method, system, out):
    prepare_dense(method, system)
    interpolate(method, system, 0.5, out)


@kernel
def once_more(method, system, t_end):
    rewind(method, system)
    return advance(method, system, t_end)


def called(name, function, *arguments):
    """Call a kernel as walks do: compiled for built-in methods, and in Python for those of a library."""
    return (function if METHODS[name].compiled else function.py_func)(*arguments)


def driven(name, rtol, t_end, budget=PLENTY):
    method = method_named(name).new(4, rtol, 1e-2 * rtol, budget)
    return method, called(name, drive, method, ORBIT, START, t_end)


@cache
def growth(t):
    """Return the largest factor by which a change of the start grows until time t. It is 3e3 after a tenth of the
    orbit.
    """
    change = 1e-9
    ends = [drive_to(t, START + sign * change * unit) for unit in np.eye(4) for sign in (1.0, -1.0)]
    columns = [(up - down) / (2.0 * change) for up, down in zip(ends[::2], ends[1::2], strict=True)]
    return np.abs(columns).sum(axis=0)


def drive_to(t, y):
    method = method_named("dop853").new(4, 1e-13, 1e-15, PLENTY)
    drive(method, ORBIT, y, t)
    return method.y.copy()


def allowed(name, rtol, t):
    """Return the allowed error of the end state, by component.

    A step may err by rtol times the state, which is of order one, and this error grows along the orbit. Most steps err
    less, and later errors grow less, so a hundredth of that is allowed. Methods that vary their order take many more
    steps; they are allowed a tenth.
    """
    lowest, highest = METHODS[name].orders
    return (0.01 if lowest == highest else 0.1) * growth(t) * rtol


def variations(t, z):
    """Return the rates of the state and of its derivatives (4, 4) with respect to the start."""
    rates, slopes = np.zeros(4), np.zeros((4, 4))
    satellite_derivative(ORBIT, t, z[:4], rates)
    satellite_jacobian(ORBIT, t, z[:4], slopes)
    return np.concatenate((rates, (slopes @ z[4:].reshape(4, 4)).ravel()))


@cache
def varied_orbit():
    start = np.concatenate((START, np.eye(4).ravel()))
    return solve_ivp(variations, (0.0, PERIOD), start, "DOP853", rtol=1e-12, atol=1e-14, dense_output=True).sol


def allowed_of_cvode(times, rtol):
    """Return the allowed error of the orbit's end after steps that ended at these times, by component.

    CVODE chooses its steps so that the error of each is a sixth of rtol times the state plus the absolute tolerance
    (BIAS2 in cvode.c). This error then grows. Its sign varies with the order, which differs from machine to machine, so
    the errors add up as the root of their squares.
    """
    whole = varied_orbit()(PERIOD)[4:].reshape(4, 4)
    squares = np.zeros(4)
    for t in times:
        z = varied_orbit()(t)
        later = whole @ np.linalg.inv(z[4:].reshape(4, 4))
        squares += (np.abs(later) @ (rtol * np.abs(z[:4]) + 1e-2 * rtol) / 6.0) ** 2
    return np.sqrt(squares)


# Without a moon the orbit is a circle around the earth, seen from the rotating frame. Its rate follows from Kepler's
# third law.
NO_MOON = Satellite(0.0)
RADIUS = 0.64
TURN = RADIUS**-1.5 - 1.0


def on_circle(t):
    x, y = RADIUS * math.cos(TURN * t), RADIUS * math.sin(TURN * t)
    return np.array((x, y, -TURN * y, TURN * x))


def circled(name, rtol):
    """Return the number of steps for one turn, and the error at the end."""
    method = method_named(name).new(4, rtol, 1e-2 * rtol, PLENTY)
    t_end = 2.0 * math.pi / TURN
    assert called(name, drive, method, NO_MOON, on_circle(0.0), t_end) == STEP_DONE
    return int(method.counts[ACCEPTED]), np.abs(method.y - on_circle(t_end)).max()


@pytest.fixture(scope="module")
def early():
    """Return the satellite after a tenth of its period, by the most accurate method."""
    return driven("dop853", 1e-14, 0.1 * PERIOD)[0].y.copy()


every_method = pytest.mark.parametrize("name", METHODS)


@every_method
def test_arenstorf_orbit_closes_with_every_method(name):
    """Along the orbit, changes of the position grow by a factor of about 10^4, and those of the velocity by 10^6."""
    if name.startswith("cvode"):
        method = method_named(name).new(4, 1e-9, 1e-11, PLENTY)
        bound = allowed_of_cvode(times_of_steps(method, PERIOD), 1e-9)
    else:
        method, status = driven(name, 1e-9, PERIOD)
        assert status == STEP_DONE
        bound = allowed(name, 1e-9, PERIOD)
    assert np.all(np.abs(method.y - START) < bound)
    assert method.clock[T] == PERIOD


def times_of_steps(method, t_end):
    """Drive a method as `drive` does, and yield the time after each step."""
    start.py_func(method, ORBIT, START)
    while method.clock[T] < t_end:
        assert step.py_func(method, ORBIT, t_end) == STEP_DONE
        yield float(method.clock[T])


@every_method
def test_error_falls_with_the_tolerance(name, early):
    errors = [np.abs(driven(name, rtol, 0.1 * PERIOD)[0].y - early).max() for rtol in (1e-4, 1e-6, 1e-8)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < allowed(name, 1e-8, 0.1 * PERIOD).max()


@every_method
def test_observed_order_is_the_stated_one(name):
    """On a circle, where steps are equally long, the error falls with the steps to the power of minus the order.

    The fit runs from where the error per step is no more than a thousandth to where rounding and the tolerances of
    inner iterations are far below it. Both ends of it hold the order from below only: the error constants of the next
    order are the larger ones in good methods, so that on steps this long the error falls faster. A method that varies
    its order has none to observe; its order rises as the tolerance falls, so that the error falls at least as that of
    a method of order four would, whatever it begins with.
    """
    lowest, highest = METHODS[name].orders
    steps, errors = zip(*(circled(name, 10.0**-digits) for digits in range(5, 10)), strict=True)
    observed = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert observed > (highest - 0.25 if lowest == highest else 4.0)


@every_method
def test_counted_work_rises_with_accuracy(name):
    loose, tight = (driven(name, rtol, 0.1 * PERIOD)[0].counts for rtol in (1e-4, 1e-8))
    assert 0 < loose[ACCEPTED] < tight[ACCEPTED]
    assert 0 < loose[RHS] < tight[RHS]


@every_method
def test_run_ends_when_its_budget_is_spent(name):
    method, status = driven(name, 1e-8, PERIOD, budget=100)
    assert status == OUT_OF_BUDGET
    assert method.counts[RHS] <= 130  # A step that has begun may be completed.


@every_method
def test_counts_are_integers_even_if_the_budget_is_a_float(name):
    assert method_named(name).new(4, 1e-6, 1e-8, 1e4).counts.dtype == np.int64


@every_method
def test_dense_output_in_mid_step_agrees_with_an_accurate_run_to_that_time(name):
    rtol = 1e-8
    method, _ = driven(name, rtol, 0.05 * PERIOD)
    out = np.zeros(4)
    called(name, half_way, method, ORBIT, out)
    middle = 0.5 * (method.clock[T_OLD] + method.clock[T])
    exact = driven("dop853", 1e-13, middle)[0].y
    assert out == pytest.approx(exact, abs=allowed(name, rtol, middle).max())


@every_method
def test_step_can_be_repeated_up_to_an_event(name):
    rtol = 1e-8
    method, _ = driven(name, rtol, 0.05 * PERIOD)
    event = 0.25 * method.clock[T_OLD] + 0.75 * method.clock[T]
    assert called(name, once_more, method, ORBIT, event) == STEP_DONE
    assert method.clock[T] == event
    exact = driven("dop853", 1e-13, event)[0].y
    assert method.y == pytest.approx(exact, abs=allowed(name, rtol, event).max())


@every_method
def test_steps_shortened_by_a_deadline_are_contiguous(name):
    """There are deadlines every few thousandths of the orbit, and every third step is repeated up to its middle, as
    after an event.
    """
    rtol, t_end = 1e-8, 0.1 * PERIOD
    method = method_named(name).new(4, rtol, 1e-2 * rtol, PLENTY)
    called(name, start, method, ORBIT, START)
    t, y, steps = 0.0, np.array(START), 0
    for deadline in np.linspace(0.0, t_end, 38)[1:].tolist():
        while method.clock[T] < deadline:
            assert called(name, step, method, ORBIT, deadline) == STEP_DONE
            if steps % 3 == 0:
                event = 0.5 * (method.clock[T_OLD] + method.clock[T])
                assert called(name, once_more, method, ORBIT, event) == STEP_DONE
            assert method.clock[T_OLD] == t
            assert method.y_old.tolist() == y.tolist()
            t, y, steps = float(method.clock[T]), method.y.copy(), steps + 1
        assert t == deadline
    whole, _ = driven(name, rtol, t_end)
    assert y == pytest.approx(whole.y, abs=allowed(name, rtol, t_end).max())
    if not METHODS[name].compiled:
        # The solver of a library continues its steps regardless of deadlines, so they cause no additional work.
        assert method.counts[ACCEPTED] == whole.counts[ACCEPTED]


@every_method
def test_repeated_run_is_bitwise_equal(name):
    first, second = (driven(name, 1e-7, 0.1 * PERIOD)[0] for _ in range(2))
    assert first.y.tobytes() == second.y.tobytes()
    assert first.counts.tolist() == second.counts.tolist()


@every_method
def test_interpolants_of_all_methods_have_a_degree_of_3_to_10(name):
    assert 3 <= dense_degree(method_named(name).new(4, 1e-6, 1e-8, PLENTY)) <= 10
