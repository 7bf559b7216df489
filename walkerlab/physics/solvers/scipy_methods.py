"""Integrators of SciPy and SUNDIALS with the interface of `stepping`, for comparison and as a check.

The right-hand side is compiled, but the walk itself runs in Python, from the source that is compiled for the
built-in methods.
"""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers import stepping
from walkerlab.physics.solvers.system import Integers, derivative, jacobian

DENSE_DEGREE = 7
"""Upper bound on the degree of the dense output of these methods."""


class OutOfBudgetError(Exception):
    """Raised within a library's step when the budget of right-hand sides is exhausted."""


@kernel
def right_hand_side(system: Any, t: float, y: Any, dy: Any) -> None:
    derivative(system, t, y, dy)


@kernel
def jacobian_matrix(system: Any, t: float, y: Any, J: Any) -> None:
    jacobian(system, t, y, J)


def entry_point(function: Any, *arguments: Any) -> Callable[..., None]:
    """Return a kernel's machine code for arguments of these types. Calling it avoids the cost of dispatch."""
    types = tuple(numba.typeof(argument) for argument in arguments)
    code: Callable[..., None] = function if numba.config.DISABLE_JIT else function.compile(types)
    return code


class ScipyMethod:
    """Integrator of another library, with the fields that `stepping` requires."""

    def __init__(
        self, new_solver: Callable[..., Any], takes_jacobian: bool, n: int, rtol: float, atol: float, budget: int
    ) -> None:
        """Prepare for n equations. `begin` calls `new_solver`, which has the signature of scipy's solvers."""
        self.new_solver = new_solver
        self.takes_jacobian = takes_jacobian
        self.rtol = rtol
        self.atol = atol
        self.clock = np.zeros(3)
        self.y_old = np.zeros(n)
        self.y = np.zeros(n)
        self.counts = stepping.new_counts(budget)
        self.solver: Any = None
        self.dense: Any = None


def counting_rhs(counts: Integers, system: Any, n: int) -> Callable[[float, Any], Any]:
    """Return the compiled right-hand side in the form that libraries call.

    It counts calls and raises OutOfBudgetError.
    """
    probe = np.zeros(n)
    code = entry_point(right_hand_side, system, 0.0, probe, probe)

    def fun(t: float, y: Any) -> Any:
        if counts[stepping.RHS] >= counts[stepping.BUDGET]:
            raise OutOfBudgetError
        counts[stepping.RHS] += 1
        dy = np.empty(n)
        # The machine code is compiled for contiguous arrays.
        code(system, t, np.ascontiguousarray(y), dy)
        return dy

    return fun


def counting_jacobian(method: ScipyMethod, system: Any, n: int) -> Callable[[float, Any], Any]:
    code = entry_point(jacobian_matrix, system, 0.0, np.zeros(n), np.zeros((n, n)))

    def jac(t: float, y: Any) -> Any:
        method.counts[stepping.JACOBIANS] += 1
        J = np.empty((n, n))
        code(system, t, y, J)
        return J

    return jac


@stepping.begin.case(ScipyMethod)
def begin_scipy(method: ScipyMethod, system: Any, t: float, y: Any, h: float) -> None:
    n = method.y.size
    method.y[:] = y
    method.clock[stepping.T_OLD] = method.clock[stepping.T] = t
    # SciPy warns about a smaller relative tolerance and replaces it.
    options: dict[str, Any] = {"rtol": max(method.rtol, 2.3e-14), "atol": method.atol}
    if method.takes_jacobian:
        options["jac"] = counting_jacobian(method, system, n)
    method.dense = None
    try:
        # SciPy's solvers keep the array that they are given, and `advance` overwrites `method.y`.
        method.solver = method.new_solver(counting_rhs(method.counts, system, n), t, method.y.copy(), np.inf, **options)
    except OutOfBudgetError:
        method.solver = None


@stepping.advance.case(ScipyMethod)
def advance_scipy(method: ScipyMethod, system: Any, t_end: float) -> int:
    """Take the rest of the solver's last step if it was cut short or rewound, otherwise its next step."""
    clock = method.clock
    if method.dense is None or method.solver.t <= clock[stepping.T]:
        status = step_solver(method)
        if status != stepping.STEP_DONE:
            return status
    solver = method.solver
    clock[stepping.T_OLD], clock[stepping.T] = clock[stepping.T], min(solver.t, t_end)
    method.y_old[:] = method.y
    method.y[:] = solver.y if clock[stepping.T] == solver.t else method.dense(clock[stepping.T])
    return stepping.STEP_DONE


def step_solver(method: ScipyMethod) -> int:
    """Take one step, whose size the solver chooses, and return a status as `advance` does."""
    if method.solver is None:
        return stepping.OUT_OF_BUDGET
    try:
        # A trial step may overflow. The library then takes a shorter one.
        with np.errstate(over="ignore", invalid="ignore"):
            method.solver.step()
        if method.solver.status == "failed":
            return stepping.STEP_TOO_SMALL
        # Creating the dense output may evaluate the right-hand side and exhaust the budget.
        method.dense = method.solver.dense_output()
    except OutOfBudgetError:
        return stepping.OUT_OF_BUDGET
    method.counts[stepping.ACCEPTED] += 1
    method.clock[stepping.H_NEXT] = method.solver.t - method.solver.t_old
    return stepping.STEP_DONE


@stepping.rewind.case(ScipyMethod)
def rewind_scipy(method: ScipyMethod, system: Any) -> None:
    """Go back to the start of the step, but keep its dense output, which `advance` evaluates at the event."""
    method.clock[stepping.T] = method.clock[stepping.T_OLD]
    method.y[:] = method.y_old


def dense_at(method: ScipyMethod, fractions: Any) -> Any:
    """Evaluate the dense output at a fraction of the last step, or at several."""
    t_old, t = method.clock[stepping.T_OLD], method.clock[stepping.T]
    return method.dense(t_old + fractions * (t - t_old))


@stepping.interpolate.case(ScipyMethod)
def interpolate_scipy(method: ScipyMethod, system: Any, fraction: float, y: Any) -> None:
    y[:] = dense_at(method, fraction)[: y.size]


@stepping.sample.case(ScipyMethod)
def sample_scipy(method: ScipyMethod, system: Any, fractions: Any, states: Any) -> None:
    columns = dense_at(method, fractions)[: states.shape[1]]
    states[: len(fractions), : len(columns)] = columns.T
