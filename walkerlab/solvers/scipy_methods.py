"""Libraries' integrators behind the same functions as our own, with the compiled right-hand side: SciPy's, and CVODE.

They serve as peers and as a check. Walks with them run in Python: the same source, uncompiled.
"""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from walkerlab.kernels import kernel
from walkerlab.solvers.stepping import (
    ACCEPTED,
    BUDGET,
    COUNTS,
    H_NEXT,
    JACOBIANS,
    OUT_OF_BUDGET,
    RHS,
    STEP_DONE,
    STEP_TOO_SMALL,
    T_OLD,
    T,
    advance,
    begin,
    interpolate,
    prepare_dense,
    rewind,
    sample,
)
from walkerlab.solvers.system import Integers, derivative, jacobian

DENSE_DEGREE = 7
"""High enough for the dense output of all of them."""


class OutOfBudgetError(Exception):
    """The right-hand sides are used up; ends a step of a library that knows no budget."""


@kernel
def right_hand_side(system: Any, t: float, y: Any, dy: Any) -> None:
    """dy/dt of any system, arrays in and out."""
    derivative(system, t, y, dy)


@kernel
def jacobian_matrix(system: Any, t: float, y: Any, J: Any) -> None:
    """The Jacobian of any system, arrays in and out."""
    jacobian(system, t, y, J)


def entry_point(function: Any, *arguments: Any) -> Callable[..., None]:
    """The machine code of a kernel for arguments of these types, without the cost of looking at them again."""
    code: Callable[..., None] = function.compile(tuple(numba.typeof(argument) for argument in arguments))
    return code


class ScipyMethod:
    """A library's integrator with the fields of a method."""

    def __init__(
        self, new_solver: Callable[..., Any], takes_jacobian: bool, n: int, rtol: float, atol: float, budget: int
    ) -> None:
        """Prepare for n equations; the solver itself is made by `begin`.

        new_solver      makes it, called as the classes of scipy.integrate are
        takes_jacobian  whether there is use for the Jacobian
        """
        self.new_solver, self.takes_jacobian = new_solver, takes_jacobian
        self.rtol, self.atol = rtol, atol
        self.clock = np.zeros(3)
        self.y_old, self.y = np.zeros(n), np.zeros(n)
        self.counts = np.zeros(COUNTS, np.int64)
        self.counts[BUDGET] = budget
        self.solver: Any = None
        self.dense: Any = None


def counted(counts: Integers, system: Any, n: int) -> Callable[[float, Any], Any]:
    """The compiled right-hand side as libraries call it, counting and keeping the budget."""
    probe = np.zeros(n)
    code = entry_point(right_hand_side, system, 0.0, probe, probe)

    def fun(t: float, y: Any) -> Any:
        if counts[RHS] >= counts[BUDGET]:
            raise OutOfBudgetError
        counts[RHS] += 1
        dy = np.empty(n)
        code(system, t, np.ascontiguousarray(y), dy)
        return dy

    return fun


def counted_jacobian(method: ScipyMethod, system: Any, n: int) -> Callable[[float, Any], Any]:
    """The compiled Jacobian as libraries call it, counting."""
    code = entry_point(jacobian_matrix, system, 0.0, np.zeros(n), np.zeros((n, n)))

    def jac(t: float, y: Any) -> Any:
        method.counts[JACOBIANS] += 1
        J = np.empty((n, n))
        code(system, t, y, J)
        return J

    return jac


@begin.case(ScipyMethod)
def begin_scipy(method: ScipyMethod, system: Any, t: float, y: Any, h: float) -> None:
    """Make a new solver; it chooses its first step itself."""
    n = method.y.size
    method.y[:] = y
    method.clock[T_OLD] = method.clock[T] = t
    options: dict[str, Any] = {"rtol": max(method.rtol, 2.3e-14), "atol": method.atol}
    if method.takes_jacobian:
        options["jac"] = counted_jacobian(method, system, n)
    method.dense = None
    try:
        method.solver = method.new_solver(counted(method.counts, system, n), t, method.y.copy(), np.inf, **options)
    except OutOfBudgetError:
        method.solver = None


@advance.case(ScipyMethod)
def advance_scipy(method: ScipyMethod, system: Any, t_end: float) -> int:
    """What is left of the solver's last step, if that was cut short or rewound, else its next; never beyond t_end."""
    clock = method.clock
    if method.dense is None or method.solver.t <= clock[T]:
        status = step_solver(method)
        if status != STEP_DONE:
            return status
    solver = method.solver
    clock[T_OLD], clock[T] = clock[T], min(solver.t, t_end)
    method.y_old[:] = method.y
    method.y[:] = solver.y if clock[T] == solver.t else method.dense(clock[T])
    return STEP_DONE


def step_solver(method: ScipyMethod) -> int:
    """One step of the solver's own choice, with its dense output; returns what became of it."""
    if method.solver is None:
        return OUT_OF_BUDGET
    try:
        # a step tried too far may leave all bounds: the library then takes a shorter one
        with np.errstate(over="ignore", invalid="ignore"):
            method.solver.step()
        if method.solver.status == "failed":
            return STEP_TOO_SMALL
        # some dense outputs evaluate the right-hand side too
        method.dense = method.solver.dense_output()
    except OutOfBudgetError:
        return OUT_OF_BUDGET
    method.counts[ACCEPTED] += 1
    method.clock[H_NEXT] = method.solver.t - method.solver.t_old
    return STEP_DONE


@rewind.case(ScipyMethod)
def rewind_scipy(method: ScipyMethod, system: Any) -> None:
    """The step's dense output stays; `advance` reads the event's state off it."""
    method.clock[T] = method.clock[T_OLD]
    method.y[:] = method.y_old


@prepare_dense.case(ScipyMethod)
def prepare_dense_scipy(method: ScipyMethod, system: Any) -> None:
    """Each step makes its own."""


@interpolate.case(ScipyMethod)
def interpolate_scipy(method: ScipyMethod, system: Any, fraction: float, y: Any) -> None:
    """The library's dense output."""
    t_old, t = method.clock[T_OLD], method.clock[T]
    y[:] = method.dense(t_old + fraction * (t - t_old))[: y.size]


@sample.case(ScipyMethod)
def sample_scipy(method: ScipyMethod, system: Any, fractions: Any, states: Any) -> None:
    """All at once."""
    t_old, t = method.clock[T_OLD], method.clock[T]
    found = method.dense(t_old + fractions * (t - t_old))[: states.shape[1]]
    states[: len(fractions), : len(found)] = found.T
