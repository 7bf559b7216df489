"""Radau IIA of order 5: implicit, L-stable, for stiff contact; simplified Newton with the system's exact Jacobian.

Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), section IV.8.
"""

import math
from typing import Any

from walkerlab.kernels import inlined
from walkerlab.solvers.fused import fused
from walkerlab.solvers.radau5_stages import (
    ERROR_OLD,
    FRESH,
    H_FACTORED,
    H_OLD,
    NEWTON_MOST,
    RATE,
    SMOOTH,
    UNKNOWNS,
    Radau5,
    factor_matrices,
    new_radau5,
    solve_real,
    solve_stages,
)
from walkerlab.solvers.radau5_tableau import ERROR, P_1, P_2, P_3
from walkerlab.solvers.shifted_system import unknowns
from walkerlab.solvers.stepping import (
    ACCEPTED,
    BUDGET,
    H_NEXT,
    JACOBIANS,
    OUT_OF_BUDGET,
    REJECTED,
    RHS,
    SMALLEST_STEP,
    STEP_DONE,
    STEP_TOO_SMALL,
    T_OLD,
    T,
    advance,
    begin,
    dense_degree,
    interpolate,
    prepare_dense,
    rewind,
)
from walkerlab.solvers.system import derivative, jacobian

__all__ = ["Radau5", "new_radau5"]

SAFETY, SHRINK_MOST, GROW_MOST = 0.9, 0.125, 8.0
KEEP_LOW, KEEP_HIGH = 1.0, 1.2  # step ratios within which the factored matrices are kept
FRESH_RATE = 1e-3  # Newton convergence below which the Jacobian is kept
FIRST_STEP = 1e-6


@begin.case(Radau5)
def begin_radau5(method: Radau5, system: Any, t: float, y: Any, h: float) -> None:
    """Derivative and Jacobian at the start; what was learnt of the step before is forgotten."""
    clock, control = method.clock, method.control
    clock[T_OLD], clock[T], clock[H_NEXT] = t, t, h if h > 0.0 else FIRST_STEP
    for i in range(method.y.size):
        method.y[i] = y[i]
    derivative(system, t, method.y, method.slope[0])
    method.counts[RHS] += 1
    refresh(method, system)
    control[H_OLD], control[RATE], control[SMOOTH] = 0.0, 1.0, 0.0


@inlined
def step_error(method: Radau5, system: Any, t: float, h: float, again: bool) -> float:
    """Error relative to the tolerance, (8.19); filtered once more, (8.20), after a rejection or a start."""
    n = method.y.size
    error, z = method.f[0], method.z
    for i in range(n):
        method.f[1, i] = (ERROR[0] * z[0, i] + ERROR[1] * z[1, i] + ERROR[2] * z[2, i]) / h
        error[i] = method.slope[0, i] + method.f[1, i]
    solve_real(method, error)
    size = error_size(method, error)
    if size >= 1.0 and again:
        for i in range(n):
            method.at[i] = method.y[i] + error[i]
        derivative(system, t, method.at, error)
        method.counts[RHS] += 1
        for i in range(n):
            error[i] += method.f[1, i]
        solve_real(method, error)
        size = error_size(method, error)
    return size


@inlined
def error_size(method: Radau5, error: Any) -> float:
    """Root mean square of the error over the tolerance."""
    y, total = method.y, 0.0
    for i in range(y.size):
        scale = method.atol + method.rtol * max(abs(y[i]), abs(y[i] + method.z[2, i]))
        total += (error[i] / scale) ** 2
    return max(1e-10, math.sqrt(total / y.size))


@advance.case(Radau5)
def advance_radau5(method: Radau5, system: Any, t_end: float) -> int:
    """One accepted step with Hairer's predictive step control."""
    clock, control = method.clock, method.control
    t, h = clock[T], clock[H_NEXT]
    rejected = False
    while method.counts[RHS] < method.counts[BUDGET]:
        if h <= SMALLEST_STEP * max(abs(t), 1e-3):
            return STEP_TOO_SMALL
        last = t + 1.0001 * h >= t_end
        if last:
            h = t_end - t
        fine = control[H_FACTORED] == h or factor_matrices(method, h)
        iterations = solve_stages(method, system, t, h) if fine else 0
        if iterations == 0:
            method.counts[REJECTED] += 1
            control[SMOOTH] = 0.0
            if control[FRESH] == 0.0:
                refresh(method, system)
            else:
                h *= 0.5
            rejected = True
            continue
        error = step_error(method, system, t, h, rejected or control[SMOOTH] == 0.0)
        safety = min(SAFETY, SAFETY * (1 + 2 * NEWTON_MOST) / (iterations + 2 * NEWTON_MOST))
        shrink = max(1.0 / GROW_MOST, min(1.0 / SHRINK_MOST, error**0.25 / safety))
        if error < 1.0:
            accept(method, system, t, t_end if last else t + h)
            h_new = next_step(method, h, error, shrink, safety)
            clock[H_NEXT] = max(h_new, clock[H_NEXT]) if last else h_new
            return STEP_DONE
        method.counts[REJECTED] += 1
        rejected = True
        h /= shrink
        control[SMOOTH] = 0.0
    return OUT_OF_BUDGET


@inlined
def refresh(method: Radau5, system: Any) -> None:
    """The Jacobian at the step's start."""
    jacobian(system, method.clock[T], method.y, method.J)
    method.counts[JACOBIANS] += 1
    method.control[FRESH], method.control[H_FACTORED] = 1.0, 0.0
    method.control[UNKNOWNS] = unknowns(method.J)


@inlined
def next_step(method: Radau5, h: float, error: float, shrink: float, safety: float) -> float:
    """The step after an accepted one: the smaller of the error's and Gustafsson's prediction, (8.25)."""
    control = method.control
    if control[ERROR_OLD] > 0.0 and control[H_OLD] > 0.0:
        predicted = control[H_OLD] / h * (error * error / control[ERROR_OLD]) ** 0.25 / safety
        shrink = max(shrink, max(1.0 / GROW_MOST, min(1.0 / SHRINK_MOST, predicted)))
    control[ERROR_OLD], control[H_OLD] = max(1e-2, error), h
    h_new = h / shrink
    if control[FRESH] == 0.0 and KEEP_LOW * h <= h_new <= KEEP_HIGH * h:
        return h
    return h_new


@inlined
def accept(method: Radau5, system: Any, t: float, t_new: float) -> None:
    """Make the step's end the state, keep its polynomial, and renew derivative and Jacobian."""
    clock, control = method.clock, method.control
    y, z, slope, dense = method.y, method.z, method.slope, method.dense
    for i in range(y.size):
        dense[0, i] = fused(P_1[2], z[2, i], fused(P_1[1], z[1, i], P_1[0] * z[0, i]))
        dense[1, i] = fused(P_2[2], z[2, i], fused(P_2[1], z[1, i], P_2[0] * z[0, i]))
        dense[2, i] = fused(P_3[2], z[2, i], fused(P_3[1], z[1, i], P_3[0] * z[0, i]))
        method.y_old[i], slope[1, i] = y[i], slope[0, i]
        y[i] += z[2, i]
    derivative(system, t_new, y, slope[0])
    method.counts[RHS] += 1
    method.counts[ACCEPTED] += 1
    clock[T_OLD], clock[T] = t, t_new
    control[SMOOTH] = 1.0
    control[FRESH] = 0.0
    if control[RATE] > FRESH_RATE:
        refresh(method, system)


@rewind.case(Radau5)
def rewind_radau5(method: Radau5, system: Any) -> None:
    """Back to the step's start; the Jacobian of its end is near enough, the polynomial is not used."""
    clock, control = method.clock, method.control
    for i in range(method.y.size):
        method.y[i], method.slope[0, i] = method.y_old[i], method.slope[1, i]
    clock[T] = clock[T_OLD]
    refresh(method, system)
    control[SMOOTH], control[H_OLD] = 0.0, 0.0


@prepare_dense.case(Radau5)
def prepare_dense_radau5(method: Radau5, system: Any) -> None:
    """The collocation polynomial is there already."""


@interpolate.case(Radau5)
def interpolate_radau5(method: Radau5, system: Any, fraction: float, y: Any) -> None:
    """The collocation polynomial."""
    s, dense = fraction, method.dense
    for i in range(y.size):
        y[i] = fused(s * s * s, dense[2, i], fused(s * s, dense[1, i], fused(s, dense[0, i], method.y_old[i])))


@dense_degree.case(Radau5)
def dense_degree_radau5(method: Radau5) -> int:
    """Three."""
    return 3
