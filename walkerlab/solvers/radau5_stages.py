"""The stages of a Radau IIA step: the method's memory, and the simplified Newton iteration.

Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), section IV.8.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.kernels import by_reference, inlined
from walkerlab.solvers.radau5_tableau import ALPHA, BETA, GAMMA, INV_1, INV_2, INV_3, T_1, T_2, C
from walkerlab.solvers.shifted_system import factor_shifted, solve_shifted
from walkerlab.solvers.stepping import BUDGET, COUNTS, RHS
from walkerlab.solvers.system import derivative

NEWTON_MOST = 7

# indices into `control`
H_FACTORED, H_OLD, ERROR_OLD, RATE, SMOOTH, FRESH, UNKNOWNS = 0, 1, 2, 3, 4, 5, 6


@by_reference
class Radau5(NamedTuple):
    """The method with its memory for n equations."""

    rtol: float
    atol: float
    clock: Any
    y_old: Any
    y: Any
    counts: Any
    at: Any  # (n,) where a derivative is asked for
    slope: Any  # (2, n) derivative at the start of the next step, and of the last
    z: Any  # (3, n) stages less the step's start
    w: Any  # (3, n) the same, transformed
    f: Any  # (3, n) stage derivatives, transformed; Newton's right-hand sides
    dense: Any  # (3, n) coefficients of the collocation polynomial
    J: Any  # (n, n)
    real: Any  # (n, n) factors of gamma/h I - J
    pair: Any  # (n, n) complex factors of (alpha - i beta)/h I - J
    pivots: Any  # (2, n)
    move: Any  # (n,) Newton's move, real part of the transformed system
    move_pair: Any  # (n,) complex, the pair's
    control: Any  # (7,) see the indices above


def new_radau5(n: int, rtol: float, atol: float, budget: int) -> Radau5:
    """A Radau IIA method for n equations that may evaluate `budget` right-hand sides."""
    counts = np.zeros(COUNTS, np.int64)
    counts[BUDGET] = budget
    three, square = (3, n), (n, n)
    return Radau5(
        rtol, atol, np.zeros(3), np.zeros(n), np.zeros(n), counts, np.zeros(n), np.zeros((2, n)),
        np.zeros(three), np.zeros(three), np.zeros(three), np.zeros(three),
        np.zeros(square), np.zeros(square), np.zeros(square, np.complex128), np.zeros((2, n), np.int64),
        np.zeros(n), np.zeros(n, np.complex128), np.zeros(7),
    )  # fmt: skip


@inlined
def factor_matrices(method: Radau5, h: float) -> bool:
    """Factors of both matrices of the simplified Newton iteration for step h."""
    left = int(method.control[UNKNOWNS])
    method.control[H_FACTORED] = h
    real = factor_shifted(method.J, left, GAMMA / h, method.real, method.pivots[0])
    return real and factor_shifted(method.J, left, complex(ALPHA / h, -BETA / h), method.pair, method.pivots[1])


@inlined
def solve_real(method: Radau5, r: Any) -> None:
    """Solve with the real matrix of the step, overwriting r (n,)."""
    s = GAMMA / method.control[H_FACTORED]
    solve_shifted(method.J, int(method.control[UNKNOWNS]), s, method.real, method.pivots[0], r)


@inlined
def solve_pair(method: Radau5, r: Any) -> None:
    """Solve with the complex matrix of the step, overwriting r (n,)."""
    h = method.control[H_FACTORED]
    s = complex(ALPHA / h, -BETA / h)
    solve_shifted(method.J, int(method.control[UNKNOWNS]), s, method.pair, method.pivots[1], r)


@inlined
def first_guess(method: Radau5, h: float) -> None:
    """Stages from the collocation polynomial of the step before, or zero after a start."""
    ratio = h / method.control[H_OLD] if method.control[SMOOTH] > 0.0 else 0.0
    z, w, dense = method.z, method.w, method.dense
    for i in range(method.y.size):
        start = dense[0, i] + dense[1, i] + dense[2, i]
        for stage in range(3):
            s = 1.0 + C[stage] * ratio
            z[stage, i] = s * (dense[0, i] + s * (dense[1, i] + s * dense[2, i])) - start if ratio > 0.0 else 0.0
        w[0, i] = INV_1[0] * z[0, i] + INV_1[1] * z[1, i] + INV_1[2] * z[2, i]
        w[1, i] = INV_2[0] * z[0, i] + INV_2[1] * z[1, i] + INV_2[2] * z[2, i]
        w[2, i] = INV_3[0] * z[0, i] + INV_3[1] * z[1, i] + INV_3[2] * z[2, i]


@inlined
def newton_move(method: Radau5, system: Any, t: float, h: float) -> float:
    """One simplified Newton iteration on the stages; returns the size of its move relative to the tolerance."""
    y, z, w, f = method.y, method.z, method.w, method.f
    n = y.size
    for stage in range(3):
        for i in range(n):
            method.at[i] = y[i] + z[stage, i]
        derivative(system, t + C[stage] * h, method.at, f[stage])
    method.counts[RHS] += 3
    real = method.move
    for i in range(n):
        f1, f2, f3 = f[0, i], f[1, i], f[2, i]
        real[i] = INV_1[0] * f1 + INV_1[1] * f2 + INV_1[2] * f3 - GAMMA / h * w[0, i]
        re = INV_2[0] * f1 + INV_2[1] * f2 + INV_2[2] * f3 - (ALPHA * w[1, i] + BETA * w[2, i]) / h
        im = INV_3[0] * f1 + INV_3[1] * f2 + INV_3[2] * f3 - (ALPHA * w[2, i] - BETA * w[1, i]) / h
        method.move_pair[i] = complex(re, im)
    solve_real(method, real)
    solve_pair(method, method.move_pair)
    size = 0.0
    for i in range(n):
        d1, d2, d3 = real[i], method.move_pair[i].real, method.move_pair[i].imag
        scale = 1.0 / (method.atol + method.rtol * abs(y[i]))
        size += (d1 * scale) ** 2 + (d2 * scale) ** 2 + (d3 * scale) ** 2
        w1, w2, w3 = w[0, i] + d1, w[1, i] + d2, w[2, i] + d3
        w[0, i], w[1, i], w[2, i] = w1, w2, w3
        z[0, i] = T_1[0] * w1 + T_1[1] * w2 + T_1[2] * w3
        z[1, i] = T_2[0] * w1 + T_2[1] * w2 + T_2[2] * w3
        z[2, i] = w1 + w2
    return math.sqrt(size / (3 * n))


@inlined
def solve_stages(method: Radau5, system: Any, t: float, h: float) -> int:
    """Iterate until the stages are accurate to a part of the tolerance; the iterations used, 0 if they diverge."""
    tolerance = max(10.0 * 2.3e-16 / method.rtol, min(0.03, math.sqrt(method.rtol)))
    first_guess(method, h)
    size_old, rate = 0.0, method.control[RATE]
    for iteration in range(1, NEWTON_MOST + 1):
        size = newton_move(method, system, t, h)
        if not size < 1e100:
            return 0
        if iteration > 1:
            rate = size / size_old
            if rate >= 0.99:
                return 0
            ahead = rate ** (NEWTON_MOST - iteration) / (1.0 - rate) * size
            if ahead > 10.0 * tolerance:
                return 0
            method.control[RATE] = rate
        if size == 0.0 or (iteration > 1 and rate / (1.0 - rate) * size <= tolerance):
            return iteration
        size_old = max(size, 1e-300)
    return 0
