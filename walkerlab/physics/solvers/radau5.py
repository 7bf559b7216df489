"""Radau IIA of order 5: implicit and L-stable, for stiff contact. Simplified Newton iterations use an exact Jacobian.

Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), section IV.8.

The linear systems, (s I - J) x = r, are reduced to half their size for equations of motion. With q' = v the
upper half of the Jacobian is (0 I). Eliminating the positions leaves (s I - J_v - J_q / s) x_v = r_v + J_q r_q / s and
x_q = (r_q + x_v) / s. Factoring then takes an eighth of the work. If the velocities were eliminated instead,
x_v = s x_q - r_q would lose digits by cancellation where damping is stiff. The source calls this 'special structure'.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.kernels import kernel_part, pass_by_reference
from walkerlab.physics.solvers import stepping
from walkerlab.physics.solvers.lanes import fused
from walkerlab.physics.solvers.linear import factor, reciprocal, solve
from walkerlab.physics.solvers.system import derivative, jacobian


@kernel_part
def unknowns(J: Any) -> int:
    """Count the unknowns of the reduced system for a Jacobian J (n, n): n/2 for equations of motion, otherwise n."""
    n = J.shape[0]
    half = n // 2
    if 2 * half != n:
        return n
    for i in range(half):
        for j in range(n):
            # The comparison is exact, because the Jacobian of equations of motion has literal zeros and ones here.
            if J[i, j] != (1.0 if j == half + i else 0.0):
                return n
    return half


@kernel_part
def factor_shifted(J: Any, size: int, s: Any, factors: Any, pivots: Any) -> bool:
    """Factor the reduced matrix for shift s, real or complex, into `factors` (size, size).

    Returns False if the matrix is singular.
    """
    n = J.shape[0]
    inverse = reciprocal(s)
    for i in range(size):
        for j in range(size):
            factors[i, j] = -J[i, j] if size == n else -J[size + i, size + j] - inverse * J[size + i, j]
        factors[i, i] += s
    return factor(factors, pivots, size)


@kernel_part
def solve_shifted(J: Any, size: int, s: Any, factors: Any, pivots: Any, r: Any) -> None:
    """Solve with factors from `factor_shifted`, overwriting r (n,)."""
    if size == J.shape[0]:
        solve(factors, pivots, r, 0, size)
        return
    inverse = reciprocal(s)
    for i in range(size):
        r[i] *= inverse
    for i in range(size):
        total = r[size + i]
        for j in range(size):
            total += J[size + i, j] * r[j]
        r[size + i] = total
    solve(factors, pivots, r, size, size)
    for i in range(size):
        r[i] += inverse * r[size + i]


ROOT6 = math.sqrt(6.0)
RADAU_NODES = ((4.0 - ROOT6) / 10.0, (4.0 + ROOT6) / 10.0, 1.0)
# eigenvalues of A^-1: one real, one complex pair; A^-1 = T Lambda T^-1, (8.5) and (8.12)
GAMMA = 3.0 + 3.0 ** (2.0 / 3.0) - 3.0 ** (1.0 / 3.0)
ALPHA = 3.0 + 0.5 * (3.0 ** (1.0 / 3.0) - 3.0 ** (2.0 / 3.0))
BETA = 0.5 * (3.0 ** (5.0 / 6.0) + 3.0 ** (7.0 / 6.0))
T_1 = (0.09443876248897524, -0.14125529502095421, 0.03002919410514742)
T_2 = (0.25021312296533332, 0.20412935229379994, -0.38294211275726192)  # the third row is (1, 1, 0)
INV_1 = (4.17871859155190428, 0.32768282076106237, 0.52337644549944951)
INV_2 = (-4.17871859155190428, -0.32768282076106237, 0.47662355450055044)
INV_3 = (0.50287263494578682, -2.57192694985560522, 0.59603920482822492)
# error estimate (8.19): h gamma_0 f(y_0) + sum e_i z_i, times gamma
ERROR = ((-13.0 - 7.0 * ROOT6) / 3.0, (-13.0 + 7.0 * ROOT6) / 3.0, -1.0 / 3.0)
# collocation polynomial z(s) = s (P_1 + s (P_2 + s P_3)), each a combination of z_1, z_2, z_3
P_1 = (13.0 / 3.0 + 7.0 * ROOT6 / 3.0, 13.0 / 3.0 - 7.0 * ROOT6 / 3.0, 1.0 / 3.0)
P_2 = (-23.0 / 3.0 - 22.0 * ROOT6 / 3.0, -23.0 / 3.0 + 22.0 * ROOT6 / 3.0, -8.0 / 3.0)
P_3 = (10.0 / 3.0 + 5.0 * ROOT6, 10.0 / 3.0 - 5.0 * ROOT6, 10.0 / 3.0)

# The safety factor, KEEP_LOW and KEEP_HIGH, FRESH_RATE, the first step and MAX_NEWTON are the defaults of Hairer's
# radau5.f (SAFE, QUOT1 and QUOT2, THET, H, NIT).
RADAU_SAFETY = 0.9
RADAU_SHRINK = 0.125
RADAU_GROWTH = 8.0
KEEP_LOW, KEEP_HIGH = 1.0, 1.2  # range of step ratios in which the factored matrices are kept
# rate of convergence of Newton's method below which the Jacobian is kept
FRESH_RATE = 1e-3
FIRST_RADAU_STEP = 1e-6
MAX_NEWTON = 7

# indices into `control`
H_FACTORED, H_OLD, ERROR_OLD, RATE, SMOOTH, FRESH, UNKNOWNS = range(7)


@pass_by_reference
class Radau5(NamedTuple):
    """Radau IIA with memory for n equations. See `stepping` for the first six fields."""

    rtol: float
    atol: float
    clock: Any
    y_old: Any
    y: Any
    counts: Any
    at: Any  # (n,) state at which a derivative is evaluated
    slope: Any  # (2, n) derivatives at the start of the next step and at the start of the last one
    z: Any  # (3, n) stages minus the step's start
    w: Any  # (3, n) z transformed by T^-1
    f: Any  # (3, n) stage derivatives
    dense: Any  # (3, n) coefficients of the collocation polynomial
    J: Any  # (n, n) Jacobian
    real: Any  # (n, n) factors of gamma/h I - J
    pair: Any  # (n, n) complex factors of (alpha - i beta)/h I - J
    pivots: Any  # (2, n)
    move: Any  # (n,) Newton's correction in the real equations of the transformed system
    move_pair: Any  # (n,) Newton's correction in the complex equations
    control: Any  # (7,) variables of step control; see the indices above


def new_radau5(n: int, rtol: float, atol: float, budget: int) -> Radau5:
    three = (3, n)
    square = (n, n)
    return Radau5(
        rtol, atol, np.zeros(3), np.zeros(n), np.zeros(n), stepping.new_counts(budget), np.zeros(n), np.zeros((2, n)),
        np.zeros(three), np.zeros(three), np.zeros(three), np.zeros(three),
        np.zeros(square), np.zeros(square), np.zeros(square, np.complex128), np.zeros((2, n), np.int64),
        np.zeros(n), np.zeros(n, np.complex128), np.zeros(7),
    )  # fmt: skip


@kernel_part
def factor_matrices(method: Radau5, h: float) -> bool:
    """Factor both matrices of the simplified Newton iteration for step h, and return False if one is singular."""
    size = int(method.control[UNKNOWNS])
    method.control[H_FACTORED] = h
    real = factor_shifted(method.J, size, GAMMA / h, method.real, method.pivots[0])
    return real and factor_shifted(method.J, size, complex(ALPHA / h, -BETA / h), method.pair, method.pivots[1])


@kernel_part
def solve_real(method: Radau5, r: Any) -> None:
    """Solve with the real matrix of the step, overwriting r (n,)."""
    s = GAMMA / method.control[H_FACTORED]
    solve_shifted(method.J, int(method.control[UNKNOWNS]), s, method.real, method.pivots[0], r)


@kernel_part
def solve_pair(method: Radau5, r: Any) -> None:
    """Solve with the complex matrix of the step, overwriting r (n,)."""
    h = method.control[H_FACTORED]
    s = complex(ALPHA / h, -BETA / h)
    solve_shifted(method.J, int(method.control[UNKNOWNS]), s, method.pair, method.pivots[1], r)


@kernel_part
def first_guess(method: Radau5, h: float) -> None:
    """Extrapolate the stages from the last step's collocation polynomial. After a start, set them to zero."""
    ratio = h / method.control[H_OLD] if method.control[SMOOTH] > 0.0 else 0.0
    z = method.z
    w = method.w
    dense = method.dense
    for i in range(method.y.size):
        # Stages are relative to the start of the new step, where the last step's polynomial has this value.
        start = dense[0, i] + dense[1, i] + dense[2, i]
        for stage in range(3):
            s = 1.0 + RADAU_NODES[stage] * ratio
            z[stage, i] = s * (dense[0, i] + s * (dense[1, i] + s * dense[2, i])) - start if ratio > 0.0 else 0.0
        w[0, i] = INV_1[0] * z[0, i] + INV_1[1] * z[1, i] + INV_1[2] * z[2, i]
        w[1, i] = INV_2[0] * z[0, i] + INV_2[1] * z[1, i] + INV_2[2] * z[2, i]
        w[2, i] = INV_3[0] * z[0, i] + INV_3[1] * z[1, i] + INV_3[2] * z[2, i]


@kernel_part
def newton_move(method: Radau5, system: Any, t: float, h: float) -> float:
    """Do one simplified Newton iteration, and return the size of its correction relative to the tolerance."""
    y, z, w, f = method.y, method.z, method.w, method.f
    n = y.size
    for stage in range(3):
        for i in range(n):
            method.at[i] = y[i] + z[stage, i]
        derivative(system, t + RADAU_NODES[stage] * h, method.at, f[stage])
    method.counts[stepping.RHS] += 3
    real = method.move
    for i in range(n):
        f1 = f[0, i]
        f2 = f[1, i]
        f3 = f[2, i]
        real[i] = INV_1[0] * f1 + INV_1[1] * f2 + INV_1[2] * f3 - GAMMA / h * w[0, i]
        # Two real equations in w_2 and w_3 are one complex equation in w_2 + i w_3 with the eigenvalue alpha - i beta.
        re = INV_2[0] * f1 + INV_2[1] * f2 + INV_2[2] * f3 - (ALPHA * w[1, i] + BETA * w[2, i]) / h
        im = INV_3[0] * f1 + INV_3[1] * f2 + INV_3[2] * f3 - (ALPHA * w[2, i] - BETA * w[1, i]) / h
        method.move_pair[i] = complex(re, im)
    solve_real(method, real)
    solve_pair(method, method.move_pair)
    size = 0.0
    for i in range(n):
        d1 = real[i]
        d2 = method.move_pair[i].real
        d3 = method.move_pair[i].imag
        scale = 1.0 / (method.atol + method.rtol * abs(y[i]))
        size += (d1 * scale) ** 2 + (d2 * scale) ** 2 + (d3 * scale) ** 2
        w1 = w[0, i] + d1
        w2 = w[1, i] + d2
        w3 = w[2, i] + d3
        w[0, i], w[1, i], w[2, i] = w1, w2, w3
        z[0, i] = T_1[0] * w1 + T_1[1] * w2 + T_1[2] * w3
        z[1, i] = T_2[0] * w1 + T_2[1] * w2 + T_2[2] * w3
        z[2, i] = w1 + w2
    return math.sqrt(size / (3 * n))


@kernel_part
def solve_stages(method: Radau5, system: Any, t: float, h: float) -> int:
    """Iterate until the stages are accurate enough, and return the number of iterations, or 0 if they diverge."""
    # FNEWT of Hairer's radau5.f: well below the error of the step, but not below rounding.
    tolerance = max(10.0 * 2.3e-16 / method.rtol, min(0.03, math.sqrt(method.rtol)))
    first_guess(method, h)
    size_old = 0.0
    rate = method.control[RATE]
    for iteration in range(1, MAX_NEWTON + 1):
        size = newton_move(method, system, t, h)
        # The comparison is also true for NaN.
        if not size < 1e100:
            return 0
        if iteration > 1:
            rate = size / size_old
            if rate >= 0.99:
                return 0
            # Predicted size of the correction that remains after the last allowed iteration. If it is too large, more
            # iterations are useless.
            ahead = rate ** (MAX_NEWTON - iteration) / (1.0 - rate) * size
            if ahead > 10.0 * tolerance:
                return 0
            method.control[RATE] = rate
        if size == 0.0 or (iteration > 1 and rate / (1.0 - rate) * size <= tolerance):
            return iteration
        size_old = max(size, 1e-300)
    return 0


@stepping.begin.case(Radau5)
def begin_radau5(method: Radau5, system: Any, t: float, y: Any, h: float) -> None:
    """Evaluate the derivative and the Jacobian at the start, and discard the history of the step-size control."""
    clock = method.clock
    control = method.control
    clock[stepping.T_OLD], clock[stepping.T], clock[stepping.H_NEXT] = t, t, h if h > 0.0 else FIRST_RADAU_STEP
    for i in range(method.y.size):
        method.y[i] = y[i]
    derivative(system, t, method.y, method.slope[0])
    method.counts[stepping.RHS] += 1
    refresh(method, system)
    control[H_OLD], control[RATE], control[SMOOTH] = 0.0, 1.0, 0.0


@kernel_part
def step_error(method: Radau5, system: Any, t: float, h: float, filtered: bool) -> float:
    """Compute the error relative to the tolerance by (8.19). If `filtered`, an error over 1 is filtered by (8.20)."""
    n = method.y.size
    error = method.f[0]
    z = method.z
    for i in range(n):
        method.f[1, i] = (ERROR[0] * z[0, i] + ERROR[1] * z[1, i] + ERROR[2] * z[2, i]) / h
        error[i] = method.slope[0, i] + method.f[1, i]
    solve_real(method, error)
    size = error_size(method, error)
    if size >= 1.0 and filtered:
        for i in range(n):
            method.at[i] = method.y[i] + error[i]
        derivative(system, t, method.at, error)
        method.counts[stepping.RHS] += 1
        for i in range(n):
            error[i] += method.f[1, i]
        solve_real(method, error)
        size = error_size(method, error)
    return size


@kernel_part
def error_size(method: Radau5, error: Any) -> float:
    """Compute the root mean square of the error divided by the tolerance."""
    y = method.y
    total = 0.0
    for i in range(y.size):
        scale = method.atol + method.rtol * max(abs(y[i]), abs(y[i] + method.z[2, i]))
        total += (error[i] / scale) ** 2
    return max(1e-10, math.sqrt(total / y.size))


@stepping.advance.case(Radau5)
def advance_radau5(method: Radau5, system: Any, t_end: float) -> int:
    """Advance by one step, with Hairer's predictive step control."""
    clock = method.clock
    control = method.control
    t, h = clock[stepping.T], clock[stepping.H_NEXT]
    rejected = False
    while method.counts[stepping.RHS] < method.counts[stepping.BUDGET]:
        if h <= stepping.SMALLEST_STEP * max(abs(t), 1e-3):
            return stepping.STEP_TOO_SMALL
        # Stretch a step that nearly reaches the end, because a tiny one would have to follow.
        last = t + 1.0001 * h >= t_end
        if last:
            h = t_end - t
        fine = control[H_FACTORED] == h or factor_matrices(method, h)
        iterations = solve_stages(method, system, t, h) if fine else 0
        if iterations == 0:
            method.counts[stepping.REJECTED] += 1
            control[SMOOTH] = 0.0
            # An old Jacobian may be to blame, and a new one costs less than a shorter step.
            if control[FRESH] == 0.0:
                refresh(method, system)
            else:
                h *= 0.5
            rejected = True
            continue
        error = step_error(method, system, t, h, rejected or control[SMOOTH] == 0.0)
        safety = min(RADAU_SAFETY, RADAU_SAFETY * (1 + 2 * MAX_NEWTON) / (iterations + 2 * MAX_NEWTON))
        # The embedded formula has order 3, so its error grows with the fourth power of the step.
        shrink = max(1.0 / RADAU_GROWTH, min(1.0 / RADAU_SHRINK, error**0.25 / safety))
        if error < 1.0:
            accept(method, system, t, t_end if last else t + h)
            h_new = next_step(method, h, error, shrink, safety)
            clock[stepping.H_NEXT] = max(h_new, clock[stepping.H_NEXT]) if last else h_new
            return stepping.STEP_DONE
        method.counts[stepping.REJECTED] += 1
        rejected = True
        h /= shrink
        control[SMOOTH] = 0.0
    return stepping.OUT_OF_BUDGET


@kernel_part
def refresh(method: Radau5, system: Any) -> None:
    """Evaluate the Jacobian at the step's start."""
    jacobian(system, method.clock[stepping.T], method.y, method.J)
    method.counts[stepping.JACOBIANS] += 1
    method.control[FRESH], method.control[H_FACTORED] = 1.0, 0.0
    method.control[UNKNOWNS] = unknowns(method.J)


@kernel_part
def next_step(method: Radau5, h: float, error: float, shrink: float, safety: float) -> float:
    """Choose the step after an accepted one: the smaller of the standard prediction and that of Gustafsson, (8.25)."""
    control = method.control
    if control[ERROR_OLD] > 0.0 and control[H_OLD] > 0.0:
        predicted = control[H_OLD] / h * (error * error / control[ERROR_OLD]) ** 0.25 / safety
        shrink = max(shrink, max(1.0 / RADAU_GROWTH, min(1.0 / RADAU_SHRINK, predicted)))
    control[ERROR_OLD], control[H_OLD] = max(1e-2, error), h
    h_new = h / shrink
    # With the same Jacobian and step size the factored matrices can be reused, which is worth more than a slightly
    # longer step.
    if control[FRESH] == 0.0 and KEEP_LOW * h <= h_new <= KEEP_HIGH * h:
        return h
    return h_new


@kernel_part
def accept(method: Radau5, system: Any, t: float, t_new: float) -> None:
    """Move to the end of the step, store its polynomial, and update derivative and Jacobian."""
    clock = method.clock
    control = method.control
    y = method.y
    z = method.z
    slope = method.slope
    dense = method.dense
    for i in range(y.size):
        dense[0, i] = fused(P_1[2], z[2, i], fused(P_1[1], z[1, i], P_1[0] * z[0, i]))
        dense[1, i] = fused(P_2[2], z[2, i], fused(P_2[1], z[1, i], P_2[0] * z[0, i]))
        dense[2, i] = fused(P_3[2], z[2, i], fused(P_3[1], z[1, i], P_3[0] * z[0, i]))
        method.y_old[i], slope[1, i] = y[i], slope[0, i]
        y[i] += z[2, i]
    derivative(system, t_new, y, slope[0])
    method.counts[stepping.RHS] += 1
    method.counts[stepping.ACCEPTED] += 1
    clock[stepping.T_OLD], clock[stepping.T] = t, t_new
    control[SMOOTH] = 1.0
    control[FRESH] = 0.0
    if control[RATE] > FRESH_RATE:
        refresh(method, system)


@stepping.rewind.case(Radau5)
def rewind_radau5(method: Radau5, system: Any) -> None:
    """Go back to the step's start. The next step's first guess does not use the polynomial."""
    clock = method.clock
    control = method.control
    for i in range(method.y.size):
        method.y[i], method.slope[0, i] = method.y_old[i], method.slope[1, i]
    clock[stepping.T] = clock[stepping.T_OLD]
    refresh(method, system)
    control[SMOOTH], control[H_OLD] = 0.0, 0.0


@stepping.interpolate.case(Radau5)
def interpolate_radau5(method: Radau5, system: Any, fraction: float, y: Any) -> None:
    s = fraction
    dense = method.dense
    for i in range(y.size):
        y[i] = fused(s * s * s, dense[2, i], fused(s * s, dense[1, i], fused(s, dense[0, i], method.y_old[i])))
