"""DOP853: explicit Runge-Kutta method of order 8 with error estimates of order 5 and 3 and dense output of order 7.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), sections II.4 to II.6.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.kernels import kernel_part, pass_by_reference, vector
from walkerlab.physics.solvers import dop853_tableau as tableau
from walkerlab.physics.solvers import lanes, stepping
from walkerlab.physics.solvers.lanes import fused, stage_state
from walkerlab.physics.solvers.system import Floats, State, block, derivative

# With the safety factor of Hairer's code, 0.9, a fifth of a walk's steps are rejected, and the same error costs 11 %
# more work.
SAFETY = 0.8
# Limits on the ratio of successive step sizes, as in Hairer's dop853.f.
SHRINK_MOST = 0.333
GROW_MOST = 6.0
EXPONENT = 1.0 / 8.0
STAGE_COUNT = 12
EXTRA_STAGES = 3
# LAST_STAGE is the row of the derivative at the step's end, and ALL_STAGES the number of rows with dense output.
LAST_STAGE = STAGE_COUNT
ALL_STAGES = STAGE_COUNT + 1 + EXTRA_STAGES


def rows(weights: Sequence[Sequence[float]], length: int) -> Floats:
    """Build a matrix (rows, length) from rows of weights, padded with zeros."""
    return np.array([[*row, *[0.0] * (length - len(row))] for row in weights])


STAGE_NODES = np.array(tableau.NODES)
# row s: weights of the state of stage s; row LAST_STAGE: weights of the solution
A = rows(tableau.A, ALL_STAGES)
D = rows([tableau.D_4, tableau.D_5, tableau.D_6, tableau.D_7], ALL_STAGES)
ERROR_WEIGHTS_5 = np.array(tableau.ERROR_5)
ERROR_WEIGHTS_3 = np.array(tableau.ERROR_3)


@pass_by_reference
class Dop853(NamedTuple):
    """DOP853 with memory for n equations. See `stepping` for the first six fields."""

    rtol: float
    atol: float
    clock: Any
    y_old: Any
    y: Any
    counts: Any
    at: Any  # (n,) state of the last evaluated stage
    stages: Any  # (ALL_STAGES, n) derivatives at the stages
    dense: Any  # (7, n) nested coefficients of the dense output


def new_dop853(n: int, rtol: float, atol: float, budget: int) -> Dop853:
    y_old, y, at = np.zeros((3, n))
    stages = np.zeros((ALL_STAGES, n))
    dense = np.zeros((7, n))
    return Dop853(rtol, atol, np.zeros(3), y_old, y, stepping.new_counts(budget), at, stages, dense)


@kernel_part
def evaluate_stages(method: Dop853, system: Any, t: float, h: float, first: int, end: int) -> None:
    """Evaluate stages `first` to `end - 1` of a step of h from `y_old` at time t (s). `at` keeps the last state."""
    y = method.y_old
    at = method.at
    K = method.stages
    total = vector(block(system))
    width = len(total)
    for s in range(first, end):
        for start in range(0, y.size, width):
            for i in range(width):
                total[i] = 0.0
            for j in range(s):
                weight = A[s, j]
                if weight != 0.0:
                    for i in range(width):
                        total[i] = fused(weight, K[j, start + i], total[i])
            for i in range(width):
                at[start + i] = fused(h, total[i], y[start + i])
        derivative(system, t + STAGE_NODES[s] * h, at, K[s])
    method.counts[stepping.RHS] += end - first


@kernel_part
def try_step(method: Dop853, system: Any, t: float, h: float) -> float:
    """Compute a step of h (s) from `y_old` into `y`, and return its error relative to the tolerance by (10.17)."""
    y_old = method.y_old
    y = method.y
    at = method.at
    K = method.stages
    evaluate_stages(method, system, t, h, 1, LAST_STAGE + 1)
    by_order_5 = vector(block(system))
    by_order_3 = vector(block(system))
    width = len(by_order_5)
    error_5 = 0.0
    error_3 = 0.0
    for start in range(0, y.size, width):
        for i in range(width):
            by_order_5[i], by_order_3[i] = 0.0, 0.0
        for j in range(STAGE_COUNT):
            if ERROR_WEIGHTS_5[j] != 0.0:
                for i in range(width):
                    by_order_5[i] = fused(ERROR_WEIGHTS_5[j], K[j, start + i], by_order_5[i])
                    by_order_3[i] = fused(ERROR_WEIGHTS_3[j], K[j, start + i], by_order_3[i])
        for i in range(width):
            # `at` is the state of the last stage, which is the solution.
            y[start + i] = at[start + i]
            scale = 1.0 / (method.atol + method.rtol * max(abs(y_old[start + i]), abs(y[start + i])))
            relative_5 = by_order_5[i] * scale
            relative_3 = by_order_3[i] * scale
            error_5 += relative_5 * relative_5
            error_3 += relative_3 * relative_3
    denominator = error_5 + 0.01 * error_3
    if denominator == 0.0:
        return 0.0
    return abs(h) * error_5 / math.sqrt(denominator * y.size)


@kernel_part
def scaled_norm(method: Dop853, v: Any) -> float:
    """Compute the norm of v with each component divided by its tolerance at the current state."""
    total = 0.0
    for i in range(v.size):
        relative = v[i] / (method.atol + method.rtol * abs(method.y[i]))
        total += relative * relative
    return math.sqrt(total)


@kernel_part
def change_of_step(error: float) -> float:
    """Compute the factor for the step size after a step with this error. Three square roots give the eighth root."""
    return max(SHRINK_MOST, SAFETY / math.sqrt(math.sqrt(math.sqrt(error))))


@stepping.begin.case(Dop853)
def begin_dop853(method: Dop853, system: Any, t: float, y: Any, h: float) -> None:
    """Evaluate the derivative and, for h = 0, choose the first step as Hairer's hinit does."""
    clock = method.clock
    at = method.at
    slope = method.stages[LAST_STAGE]
    # No step has been taken yet, so this row is free.
    ahead = method.stages[0]
    clock[stepping.T_OLD], clock[stepping.T], clock[stepping.H_NEXT] = t, t, h
    for i in range(method.y.size):
        method.y[i] = y[i]
    derivative(system, t, method.y, slope)
    method.counts[stepping.RHS] += 1
    if h > 0.0:
        return
    size = scaled_norm(method, method.y)
    steepness = scaled_norm(method, slope)
    guess = 0.01 * size / steepness if size > 1e-5 and steepness > 1e-5 else 1e-6
    for i in range(at.size):
        at[i] = fused(guess, slope[i], method.y[i])
    derivative(system, t + guess, at, ahead)
    method.counts[stepping.RHS] += 1
    for i in range(at.size):
        at[i] = ahead[i] - slope[i]
    curvature = scaled_norm(method, at) / guess
    steepest = max(steepness, curvature)
    h_curvature = max(1e-6, guess * 1e-3) if steepest <= 1e-15 else (0.01 / steepest) ** EXPONENT
    clock[stepping.H_NEXT] = min(100.0 * guess, h_curvature)


@stepping.advance.case(Dop853)
def advance_dop853(method: Dop853, system: Any, t_end: float) -> int:
    """Advance by one step, with Hairer's step control and a smaller safety factor."""
    clock = method.clock
    counts = method.counts
    y_old = method.y_old
    y = method.y
    K = method.stages
    t, h = clock[stepping.T], clock[stepping.H_NEXT]
    for i in range(y.size):
        # The derivative at the end of a step is the first stage of the next.
        y_old[i], K[0, i] = y[i], K[LAST_STAGE, i]
    limit = GROW_MOST
    outcome = stepping.OUT_OF_BUDGET
    while counts[stepping.RHS] < counts[stepping.BUDGET]:
        # Stretch a step that nearly reaches the end, to avoid a tiny last step.
        last = t + 1.01 * h >= t_end
        if last:
            h = t_end - t
        error = try_step(method, system, t, h)
        if error <= 1.0:
            counts[stepping.ACCEPTED] += 1
            growth = limit if error == 0.0 else min(limit, change_of_step(error))
            clock[stepping.T_OLD], clock[stepping.T] = t, t_end if last else t + h
            # A step shortened by t_end says little about the next one.
            clock[stepping.H_NEXT] = max(clock[stepping.H_NEXT], h * growth) if last else h * growth
            return stepping.STEP_DONE
        counts[stepping.REJECTED] += 1
        # As in Hairer's code, the step does not grow right after a rejection.
        limit = 1.0
        # The error may be infinite or not a number.
        h *= change_of_step(error) if error < 1e300 else 0.1
        clock[stepping.H_NEXT] = h
        if h <= stepping.SMALLEST_STEP * max(abs(t), 1.0):
            outcome = stepping.STEP_TOO_SMALL
            break
    # Trial steps have overwritten the state and its derivative.
    for i in range(y.size):
        y[i], K[LAST_STAGE, i] = y_old[i], K[0, i]
    return outcome


@stepping.rewind.case(Dop853)
def rewind_dop853(method: Dop853, system: Any) -> None:
    for i in range(method.y.size):
        method.y[i], method.stages[LAST_STAGE, i] = method.y_old[i], method.stages[0, i]
    method.clock[stepping.T] = method.clock[stepping.T_OLD]


@stepping.prepare_dense.case(Dop853)
def prepare_dense_dop853(method: Dop853, system: Any) -> None:
    """Evaluate three more stages and the coefficients of the dense output."""
    t, h = method.clock[stepping.T_OLD], method.clock[stepping.T] - method.clock[stepping.T_OLD]
    evaluate_stages(method, system, t, h, LAST_STAGE + 1, ALL_STAGES)
    y_old = method.y_old
    y = method.y
    K = method.stages
    dense = method.dense
    for i in range(y.size):
        dense[0, i] = y[i] - y_old[i]
        dense[1, i] = h * K[0, i] - y[i] + y_old[i]
        dense[2, i] = fused(-h, K[0, i], fused(-h, K[LAST_STAGE, i], 2.0 * y[i] - 2.0 * y_old[i]))
        for row in range(4):
            total = 0.0
            for j in range(ALL_STAGES):
                total = fused(D[row, j], K[j, i], total)
            dense[3 + row, i] = h * total


@stepping.interpolate.case(Dop853)
def interpolate_dop853(method: Dop853, system: Any, fraction: float, y: Any) -> None:
    """Evaluate the dense output (Hairer's contd8), with nested products expanded into one weight per row."""
    s, r, d = fraction, 1.0 - fraction, method.dense
    w1 = s * r
    w3 = s * r * s * r
    for i in range(y.size):
        low = fused(w1 * s, d[2, i], fused(w1, d[1, i], fused(s, d[0, i], method.y_old[i])))
        high = fused(w3 * s * r, d[5, i], fused(w3 * s, d[4, i], fused(w3, d[3, i], low)))
        y[i] = fused(w3 * s * r * s, d[6, i], high)


# ---- walks in lanes --------------------------------------------------------------------------------------------------

LANE_NODES = tableau.NODES
WEIGHTS = tuple(tableau.nonzero(row) for row in tableau.A[: LAST_STAGE + 1])
LANE_ERROR_5 = tableau.nonzero(tableau.ERROR_5)
LANE_ERROR_3 = tableau.nonzero(tableau.ERROR_3)


@kernel_part
def run_stages(system: Any, t: float, y: State, k1: State, h: float) -> tuple[tuple[State, ...], State, State]:
    """Compute the stages needed for solution and error (k1, k6 to k12), the solution, and its derivative."""
    # The stages are written out, because in compiled code a tuple's type includes its length, so no loop can extend it.
    k2 = lanes.derivative(system, t + LANE_NODES[1] * h, stage_state(y, h, WEIGHTS[1], (k1,)))
    k3 = lanes.derivative(system, t + LANE_NODES[2] * h, stage_state(y, h, WEIGHTS[2], (k1, k2)))
    k4 = lanes.derivative(system, t + LANE_NODES[3] * h, stage_state(y, h, WEIGHTS[3], (k1, k3)))
    k5 = lanes.derivative(system, t + LANE_NODES[4] * h, stage_state(y, h, WEIGHTS[4], (k1, k3, k4)))
    k6 = lanes.derivative(system, t + LANE_NODES[5] * h, stage_state(y, h, WEIGHTS[5], (k1, k4, k5)))
    k7 = lanes.derivative(system, t + LANE_NODES[6] * h, stage_state(y, h, WEIGHTS[6], (k1, k4, k5, k6)))
    k8 = lanes.derivative(system, t + LANE_NODES[7] * h, stage_state(y, h, WEIGHTS[7], (k1, k4, k5, k6, k7)))
    k9 = lanes.derivative(system, t + LANE_NODES[8] * h, stage_state(y, h, WEIGHTS[8], (k1, k4, k5, k6, k7, k8)))
    k10 = lanes.derivative(system, t + LANE_NODES[9] * h, stage_state(y, h, WEIGHTS[9], (k1, k4, k5, k6, k7, k8, k9)))
    k11 = lanes.derivative(
        system, t + LANE_NODES[10] * h, stage_state(y, h, WEIGHTS[10], (k1, k4, k5, k6, k7, k8, k9, k10))
    )
    k12 = lanes.derivative(system, t + h, stage_state(y, h, WEIGHTS[11], (k1, k4, k5, k6, k7, k8, k9, k10, k11)))
    needed = (k1, k6, k7, k8, k9, k10, k11, k12)
    y_new = stage_state(y, h, WEIGHTS[12], needed)
    return needed, y_new, lanes.derivative(system, t + h, y_new)


@kernel_part
def error_sums(method: Any, y: State, y_new: State, by_order_5: State, by_order_3: State) -> tuple[float, float]:
    """Compute, for each error estimate, the sum of the squared ratios of error to tolerance.

    method  object that has the tolerances rtol and atol
    """
    error_5 = 0.0
    error_3 = 0.0
    for i in range(len(y)):
        scale = 1.0 / (method.atol + method.rtol * max(abs(y[i]), abs(y_new[i])))
        relative_5 = by_order_5[i] * scale
        relative_3 = by_order_3[i] * scale
        error_5 += relative_5 * relative_5
        error_3 += relative_3 * relative_3
    return error_5, error_3
