"""The step map of the rigid walker and its exact derivative.

A gait's state lies on the section 'both feet on the slope, just after impact', which leaves three coordinates
z = (theta_2, dtheta_1, dtheta_2); theta_1 = -2 phi - theta_2.
"""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.rigid_observer import Unobserved
from walkerlab.hybrid.rigid_walk import slide_onto_slope, swing
from walkerlab.kernels import inlined, kernel
from walkerlab.mechanics.heel_strike import impact, impact_jacobian
from walkerlab.mechanics.rigid_compass import RigidWalker
from walkerlab.mechanics.rigid_swing import SwingVariation
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.linear import factor, solve
from walkerlab.solvers.stepping import H_NEXT, T, clear_counts, end_state
from walkerlab.solvers.system import State, derivative

WALKED, NO_HEEL_STRIKE = int(Outcome.WALKED), int(Outcome.NO_HEEL_STRIKE)
SECTION = 3
SMALLEST_MOVE = 2.0**-8
MOST_EVALUATIONS = 60
NO_RESIDUAL = 1e300
ROUNDING = 1e-10  # a residual this small that no longer shrinks is rounding
# derivative (4, 3) of the state with respect to z: theta_2 takes theta_1 along with the opposite sign
ALONG_SECTION = (-1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@inlined
def on_section(walker: RigidWalker, z: Any) -> State:
    """The state (4) of section coordinates z (3,)."""
    return (-2.0 * walker.slope - z[0], z[0], z[1], z[2])


class Shooting(NamedTuple):
    """A walker's step map with the memory to evaluate, differentiate and invert it."""

    walker: RigidWalker
    method: Any  # for the 16 equations of SwingVariation
    finder: CrossingFinder
    z_next: Any  # (3,) where a step led
    DP: Any  # (3, 3) its derivative
    system: Any  # (3, 3) Newton's matrix
    pivots: Any  # (3,)
    impact: Any  # (4, 4) derivative of the impact
    move: Any  # (3,) Newton's
    best: Any  # (3,) the best state that Newton's method has met
    best_DP: Any  # (3, 3) the derivative there


def new_shooting(walker: RigidWalker, method: Any, finder: CrossingFinder) -> Shooting:
    """The step map of `walker`, integrated with `method`."""
    square = (SECTION, SECTION)
    pivots = np.zeros(SECTION, np.int64)
    return Shooting(
        walker, method, finder, np.zeros(SECTION), np.zeros(square), np.zeros(square), pivots, np.zeros((4, 4)),
        np.zeros(SECTION), np.zeros(SECTION), np.zeros(square),
    )  # fmt: skip


@inlined
def step_with_jacobian(shooting: Shooting, z: Any) -> tuple[int, float]:
    """One step from z (3,), its end and derivative left in `z_next` and `DP`.

    The derivative is that of the flow, corrected for the heel strike's own shift in time, times that of the impact
    (saltation): J_impact (Phi - f (grad g Phi) / (grad g f)).

    Returns the outcome's number and the step's duration (s).
    """
    walker, method = shooting.walker, shooting.method
    variation = SwingVariation(walker)
    y0 = (-2.0 * walker.slope - z[0], z[0], z[1], z[2])
    method.clock[H_NEXT] = 0.0
    status = swing(method, variation, walker, shooting.finder, Unobserved(), 0.0, y0 + ALONG_SECTION, 0)
    if status != WALKED:
        return status, method.clock[T]
    full = end_state(method, variation)
    t, y = slide_onto_slope(walker, method.clock[T], full[0:4])
    new = impact(walker, y[0], y[1], y[2], y[3])
    for i in range(SECTION):
        shooting.z_next[i] = new[i + 1]
    chain_rule(walker, y, full, shooting.DP, shooting.impact)
    return WALKED, t


@inlined
def chain_rule(walker: RigidWalker, y: State, full: State, DP: Any, work: Any) -> None:
    """Assemble DP from the flow's derivative (behind the first four numbers of `full`) at the heel strike's state y."""
    impact_jacobian(walker, y[0], y[1], y[2], y[3], work)
    f = derivative(walker, 0.0, y)
    guard_rate = y[2] + y[3]
    for column in range(SECTION):
        wait = -(full[4 + column] + full[7 + column]) / guard_rate
        for row in range(SECTION):
            total = 0.0
            for k in range(4):
                total += work[row + 1, k] * (full[4 + 3 * k + column] + f[k] * wait)
            DP[row, column] = total


def evaluate(shooting: Shooting, z: Any) -> tuple[int, float]:
    """`step_with_jacobian` for callers outside compiled code: Newton's first look, without a move."""
    status, period, _, _ = newton(shooting, np.array(z, float), NO_RESIDUAL)
    return status, period


@kernel
def newton(shooting: Shooting, z: Any, tolerance: float) -> tuple[int, float, float, int]:
    """Solve P(z) = z by Newton's method with the exact derivative, halving moves that make the residual grow.

    z  (3,) start; overwritten with the best state found, whose derivative is left in `DP`

    Returns the outcome's number of the step from z, its duration (s), the residual (largest component of P(z) - z)
    and the steps of walking it took.
    """
    clear_counts(shooting.method)
    best, move, DP = shooting.best, shooting.move, shooting.best_DP
    best_status, best_period, best_residual = NO_HEEL_STRIKE, 0.0, NO_RESIDUAL
    scale, evaluations = 1.0, 0
    while evaluations < MOST_EVALUATIONS:
        evaluations += 1
        status, period = step_with_jacobian(shooting, z)
        residual = residual_of(shooting, z, status)
        if residual < best_residual:
            best_status, best_period, best_residual = status, period, residual
            keep(z, shooting.DP, best, DP)
            scale = 1.0
            if residual <= tolerance or not newton_move(shooting, z, move):
                break
        else:
            scale *= 0.5
            if scale < SMALLEST_MOVE or best_status != WALKED or best_residual < ROUNDING:
                break
        for i in range(SECTION):
            z[i] = best[i] + scale * move[i]
    keep(best, DP, z, shooting.DP)
    return best_status, best_period, best_residual, evaluations


@inlined
def keep(z: Any, DP: Any, z_kept: Any, DP_kept: Any) -> None:
    """Copy a state and the derivative there."""
    for i in range(SECTION):
        z_kept[i] = z[i]
        for j in range(SECTION):
            DP_kept[i, j] = DP[i, j]


@inlined
def newton_move(shooting: Shooting, z: Any, move: Any) -> bool:
    """Newton's move (I - DP)^-1 (P(z) - z); False if the matrix is singular."""
    for i in range(SECTION):
        move[i] = shooting.z_next[i] - z[i]
        for j in range(SECTION):
            shooting.system[i, j] = (1.0 if i == j else 0.0) - shooting.DP[i, j]
    if not factor(shooting.system, shooting.pivots, SECTION):
        return False
    solve(shooting.system, shooting.pivots, move, 0, SECTION)
    return True


@inlined
def residual_of(shooting: Shooting, z: Any, status: int) -> float:
    """Largest component of P(z) - z; huge if the step did not end in a heel strike."""
    if status != WALKED:
        return NO_RESIDUAL
    ahead = shooting.z_next
    return max(abs(ahead[0] - z[0]), abs(ahead[1] - z[1]), abs(ahead[2] - z[2]))
