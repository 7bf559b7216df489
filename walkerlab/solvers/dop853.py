"""DOP853: explicit Runge-Kutta method of order 8 with error control of order 5 and 3 and dense output of order 7.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), sections II.4 to II.6.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.kernels import inlined
from walkerlab.solvers import dop853_tableau as tableau
from walkerlab.solvers.dop853_tableau import nonzero
from walkerlab.solvers.stepping import (
    ACCEPTED,
    BUDGET,
    COUNTS,
    H_NEXT,
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
    end_state,
    interpolate,
    prepare_dense,
    rewind,
)
from walkerlab.solvers.system import State, blank, derivative
from walkerlab.solvers.vectors import combine, load, shifted, store

# Hairer's code has 0.9: a fifth of a walk's steps was rejected, and the same error took 11 % more work.
SAFETY, SHRINK_MOST, GROW_MOST = 0.8, 0.333, 6.0
EXPONENT = 1.0 / 8.0
STAGES, EXTRA_STAGES = 12, 3

C = tableau.C
A_2, A_3, A_4 = nonzero(tableau.A_2), nonzero(tableau.A_3), nonzero(tableau.A_4)
A_5, A_6, A_7 = nonzero(tableau.A_5), nonzero(tableau.A_6), nonzero(tableau.A_7)
A_8, A_9, A_10 = nonzero(tableau.A_8), nonzero(tableau.A_9), nonzero(tableau.A_10)
A_11, A_12, A_13 = nonzero(tableau.A_11), nonzero(tableau.A_12), nonzero(tableau.A_13)
A_14, A_15, A_16 = nonzero(tableau.A_14), nonzero(tableau.A_15), nonzero(tableau.A_16)
D_4, D_5, D_6, D_7 = nonzero(tableau.D_4), nonzero(tableau.D_5), nonzero(tableau.D_6), nonzero(tableau.D_7)
ERROR_5, ERROR_3 = nonzero(tableau.ERROR_5), nonzero(tableau.ERROR_3)

# rows of `stages`: the derivatives that dense output needs
K1, K6, K7, K8, K9, K10, K11, K12, K13 = range(9)


class Dop853(NamedTuple):
    """The method with its memory for n equations."""

    rtol: float
    atol: float
    clock: Any
    y_old: Any
    y: Any
    counts: Any
    stages: Any  # (9, n)
    dense: Any  # (7, n) nested coefficients of the dense output


def new_dop853(n: int, rtol: float, atol: float, budget: int) -> Dop853:
    """A DOP853 for n equations that may evaluate `budget` right-hand sides."""
    counts = np.zeros(COUNTS, np.int64)
    counts[BUDGET] = budget
    return Dop853(rtol, atol, np.zeros(3), np.zeros(n), np.zeros(n), counts, np.zeros((9, n)), np.zeros((7, n)))


@inlined
def stages_of(system: Any, t: float, y: State, k1: State, h: float) -> tuple[tuple[State, ...], State, State]:
    """The stages that the solution, its error and dense output use (k1, k6 .. k12), the solution and its derivative."""
    k2 = derivative(system, t + C[1] * h, shifted(y, h, A_2, (k1,)))
    k3 = derivative(system, t + C[2] * h, shifted(y, h, A_3, (k1, k2)))
    k4 = derivative(system, t + C[3] * h, shifted(y, h, A_4, (k1, k3)))
    k5 = derivative(system, t + C[4] * h, shifted(y, h, A_5, (k1, k3, k4)))
    k6 = derivative(system, t + C[5] * h, shifted(y, h, A_6, (k1, k4, k5)))
    k7 = derivative(system, t + C[6] * h, shifted(y, h, A_7, (k1, k4, k5, k6)))
    k8 = derivative(system, t + C[7] * h, shifted(y, h, A_8, (k1, k4, k5, k6, k7)))
    k9 = derivative(system, t + C[8] * h, shifted(y, h, A_9, (k1, k4, k5, k6, k7, k8)))
    k10 = derivative(system, t + C[9] * h, shifted(y, h, A_10, (k1, k4, k5, k6, k7, k8, k9)))
    k11 = derivative(system, t + C[10] * h, shifted(y, h, A_11, (k1, k4, k5, k6, k7, k8, k9, k10)))
    k12 = derivative(system, t + h, shifted(y, h, A_12, (k1, k4, k5, k6, k7, k8, k9, k10, k11)))
    used = (k1, k6, k7, k8, k9, k10, k11, k12)
    y_new = shifted(y, h, A_13, used)
    return used, y_new, derivative(system, t + h, y_new)


@inlined
def try_step(method: Dop853, system: Any, t: float, y: State, k1: State, h: float) -> float:
    """The step from y over h into `method.y`; returns its error relative to the tolerance."""
    used, y_new, k13 = stages_of(system, t, y, k1, h)
    method.counts[RHS] += STAGES
    store(y_new, method.y, 0)
    for row in range(K13):
        store(used[row], method.stages, row)
    store(k13, method.stages, K13)
    return abs(h) * error_norm(method, y, y_new, combine(ERROR_5, used), combine(ERROR_3, used))


@inlined
def error_sums(method: Any, y: State, y_new: State, by_order_5: State, by_order_3: State) -> tuple[float, float]:
    """Sums of squares of both errors over the tolerance; `method` is whatever holds rtol and atol."""
    error_5, error_3 = 0.0, 0.0
    for i in range(len(y)):
        scale = 1.0 / (method.atol + method.rtol * max(abs(y[i]), abs(y_new[i])))
        relative_5, relative_3 = by_order_5[i] * scale, by_order_3[i] * scale
        error_5 += relative_5 * relative_5
        error_3 += relative_3 * relative_3
    return error_5, error_3


@inlined
def error_norm(method: Dop853, y: State, y_new: State, by_order_5: State, by_order_3: State) -> float:
    """Error of a step of length one relative to the tolerance: section II.10, formula (10.17)."""
    error_5, error_3 = error_sums(method, y, y_new, by_order_5, by_order_3)
    denominator = error_5 + 0.01 * error_3
    if denominator == 0.0:
        return 0.0
    return error_5 / math.sqrt(denominator * len(y))


@inlined
def scaled_norm(method: Dop853, y: State, v: State) -> float:
    """Root of the sum of squares of v over the tolerance at y."""
    total = 0.0
    for i in range(len(y)):
        total += (v[i] / (method.atol + method.rtol * abs(y[i]))) ** 2
    return math.sqrt(total)


@inlined
def change_of_step(error: float) -> float:
    """How much the next step may differ from one with this error: the eighth root in three square roots."""
    return max(SHRINK_MOST, SAFETY / math.sqrt(math.sqrt(math.sqrt(error))))


@begin.case(Dop853)
def begin_dop853(method: Dop853, system: Any, t: float, y: State, h: float) -> None:
    """Derivative at the start and, for h = 0, the first step after Hairer's hinit."""
    clock = method.clock
    clock[T_OLD], clock[T], clock[H_NEXT] = t, t, h
    slope = derivative(system, t, y)
    store(y, method.y, 0)
    store(slope, method.stages, K13)
    method.counts[RHS] += 1
    if h > 0.0:
        return
    size, steepness = scaled_norm(method, y, y), scaled_norm(method, y, slope)
    guess = 0.01 * size / steepness if size > 1e-5 and steepness > 1e-5 else 1e-6
    ahead = derivative(system, t + guess, combine((1.0, guess), (y, slope)))
    method.counts[RHS] += 1
    curvature = scaled_norm(method, y, combine((1.0, -1.0), (ahead, slope))) / guess
    steepest = max(steepness, curvature)
    wanted = max(1e-6, guess * 1e-3) if steepest <= 1e-15 else (0.01 / steepest) ** EXPONENT
    clock[H_NEXT] = min(100.0 * guess, wanted)


@advance.case(Dop853)
def advance_dop853(method: Dop853, system: Any, t_end: float) -> int:
    """One accepted step with Hairer's step control, a little more careful."""
    clock = method.clock
    t, h = clock[T], clock[H_NEXT]
    y, k1 = load(method.y, 0, blank(system)), load(method.stages, K13, blank(system))
    limit = GROW_MOST
    outcome = OUT_OF_BUDGET
    while method.counts[RHS] < method.counts[BUDGET]:
        last = t + 1.01 * h >= t_end
        if last:
            h = t_end - t
        error = try_step(method, system, t, y, k1, h)
        if error <= 1.0:
            method.counts[ACCEPTED] += 1
            growth = limit if error == 0.0 else min(limit, change_of_step(error))
            store(y, method.y_old, 0)
            clock[T_OLD], clock[T] = t, t_end if last else t + h
            # a step cut short by t_end says little about the next one
            clock[H_NEXT] = max(clock[H_NEXT], h * growth) if last else h * growth
            return STEP_DONE
        method.counts[REJECTED] += 1
        limit = 1.0
        # a step whose error is not a number is cut hard
        h *= change_of_step(error) if error < 1e300 else 0.1
        clock[H_NEXT] = h
        if h <= SMALLEST_STEP * max(abs(t), 1.0):
            outcome = STEP_TOO_SMALL
            break
    store(y, method.y, 0)
    store(k1, method.stages, K13)
    return outcome


@rewind.case(Dop853)
def rewind_dop853(method: Dop853, system: Any) -> None:
    """State and derivative of the step's start are its end again."""
    store(load(method.y_old, 0, blank(system)), method.y, 0)
    store(load(method.stages, K1, blank(system)), method.stages, K13)
    method.clock[T] = method.clock[T_OLD]


@prepare_dense.case(Dop853)
def prepare_dense_dop853(method: Dop853, system: Any) -> None:
    """Three more stages and the coefficients of the polynomial of degree 7."""
    clock, stages, like = method.clock, method.stages, blank(system)
    t, h = clock[T_OLD], clock[T] - clock[T_OLD]
    y, y_new = load(method.y_old, 0, like), load(method.y, 0, like)
    k1, k6, k7 = load(stages, K1, like), load(stages, K6, like), load(stages, K7, like)
    k8, k9, k10 = load(stages, K8, like), load(stages, K9, like), load(stages, K10, like)
    k11, k12, k13 = load(stages, K11, like), load(stages, K12, like), load(stages, K13, like)
    k14 = derivative(system, t + C[13] * h, shifted(y, h, A_14, (k1, k7, k8, k9, k10, k11, k12, k13)))
    k15 = derivative(system, t + C[14] * h, shifted(y, h, A_15, (k1, k6, k7, k8, k11, k12, k13, k14)))
    k16 = derivative(system, t + C[15] * h, shifted(y, h, A_16, (k1, k6, k7, k8, k9, k13, k14, k15)))
    method.counts[RHS] += EXTRA_STAGES
    used = (k1, k6, k7, k8, k9, k10, k11, k12, k13, k14, k15, k16)
    store(combine((1.0, -1.0), (y_new, y)), method.dense, 0)
    store(combine((h, -1.0, 1.0), (k1, y_new, y)), method.dense, 1)
    store(combine((2.0, -2.0, -h, -h), (y_new, y, k13, k1)), method.dense, 2)
    store(combine((h,), (combine(D_4, used),)), method.dense, 3)
    store(combine((h,), (combine(D_5, used),)), method.dense, 4)
    store(combine((h,), (combine(D_6, used),)), method.dense, 5)
    store(combine((h,), (combine(D_7, used),)), method.dense, 6)


@interpolate.case(Dop853)
def interpolate_dop853(method: Dop853, system: Any, fraction: float) -> State:
    """Hairer's contd8, its nested products multiplied out into one weight a row."""
    s, r = fraction, 1.0 - fraction
    d, like = method.dense, blank(system)
    w1, w2, w3, w4 = s, s * r, s * r * s, s * r * s * r
    weights = (1.0, w1, w2, w3, w4, w4 * s, w4 * s * r, w4 * s * r * s)
    rows = (load(d, 0, like), load(d, 1, like), load(d, 2, like), load(d, 3, like))
    more = (load(d, 4, like), load(d, 5, like), load(d, 6, like))
    return combine(
        weights, (load(method.y_old, 0, like), rows[0], rows[1], rows[2], rows[3], more[0], more[1], more[2])
    )


@end_state.case(Dop853)
def end_state_dop853(method: Dop853, system: Any) -> State:
    """The state at the end of the last step."""
    return load(method.y, 0, blank(system))


@dense_degree.case(Dop853)
def dense_degree_dop853(method: Dop853) -> int:
    """Seven."""
    return 7
