"""The step map of the rigid model and its exact derivative.

A gait's state lies on the section 'both feet on the slope, just after heel strike'. Its coordinates z are the stance
leg's angle, which the swing leg's follows from, and the velocities of all bodies that turn by themselves then: swing
leg, stance leg, and a shank whose knee was free during the impact. A compass has (theta_2, dtheta_1, dtheta_2).
"""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.rigid_observer import Unobserved
from walkerlab.hybrid.rigid_walk import HEEL_STRIKE, head, on_event, swing
from walkerlab.kernels import inlined, kernel
from walkerlab.mechanics.impact import heel_strike, heel_strike_along
from walkerlab.mechanics.links import spread
from walkerlab.mechanics.standing import STANCE, SWING, Mode, Standing, Variation
from walkerlab.mechanics.tuples import Vector, put
from walkerlab.solvers.dop853 import new_dop853
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.linear import factor, solve
from walkerlab.solvers.stepping import BUDGET, H_NEXT, T, clear_counts
from walkerlab.solvers.system import State, derivative

WALKED, NO_HEEL_STRIKE = int(Outcome.WALKED), int(Outcome.NO_HEEL_STRIKE)
SMALLEST_MOVE = 2.0**-8
MOST_EVALUATIONS = 60
NO_RESIDUAL = 1e300
SMALL = 2.0**-13
"""Length of the directions that are led along: what is linear in them is exact, and needs fewer digits than the state.

With an absolute tolerance of a tenth of the relative one they keep some three digits less, which halves the steps.
"""
ROUNDING = 1e-10  # a residual this small that no longer shrinks is rounding


@inlined
def on_section(walker: Standing, z: Any) -> State:
    """The state (2 n) of section coordinates z (d,)."""
    return lifted(walker, z, -2.0 * (walker.slope + walker.lean))


@inlined
def lifted(walker: Standing, z: Any, both: float) -> State:
    """The state (2 n) of section coordinates z (d,) with straight legs whose angles sum to `both` (rad).

    Linear in z for `both` = 0: the derivative of `on_section` along z.
    """
    n = len(walker.tree.arm_x)
    theta, omega = walker.tree.arm_x, walker.tree.arm_x
    for k in range(n):
        theta, omega = put(theta, k, 0.0), put(omega, k, 0.0)
    theta = put(theta, STANCE, z[0])
    theta = put(theta, SWING, both - z[0])
    for i in range(1, len(walker.picked)):
        omega = put(omega, walker.picked[i] - n, z[i])
    theta, omega = spread(walker.straight, theta), spread(walker.at_strike, omega)
    y = walker.blank
    for k in range(n):
        y = put(y, k, theta[k])
        y = put(y, n + k, omega[k])
    return y


def section_of(walker: Standing, y: Any) -> Any:
    """The section coordinates (d,) of a state (2 n) just after heel strike."""
    return np.array([y[i] for i in walker.picked])


class Shooting(NamedTuple):
    """A walker's step map with the memory to evaluate, differentiate and invert it."""

    walker: Standing
    method: Any  # for the equations of Variation
    plain: Any  # for those of the walker alone
    finder: CrossingFinder
    blank: State  # zeros of Variation
    no_move: Vector  # (d) zeros
    z_next: Any  # (d,) where a step led
    DP: Any  # (d, d) its derivative
    system: Any  # (d, d) Newton's matrix
    pivots: Any  # (d,)
    knee_time: Any  # (1,) s
    start: Any  # (d,) one of many
    move: Any  # (d,) Newton's
    best: Any  # (d,) the best state met
    best_DP: Any  # (d, d) the derivative there


def variation_size(walker: Standing) -> int:
    """How many equations the step map's derivative takes."""
    return len(walker.blank) * (1 + len(walker.picked))


def new_shooting(walker: Standing, method: Any, finder: CrossingFinder) -> Shooting:
    """The step map of `walker`, integrated with `method`, which has room for `variation_size` equations."""
    d = len(walker.picked)
    plain = new_dop853(len(walker.blank), method.rtol, method.atol, int(method.counts[BUDGET]))
    return Shooting(
        walker, method, plain, finder, (0.0,) * variation_size(walker), (0.0,) * d, np.zeros(d), np.zeros((d, d)),
        np.zeros((d, d)), np.zeros(d, np.int64), np.zeros(1), np.zeros(d), np.zeros(d), np.zeros(d), np.zeros((d, d)),
    )  # fmt: skip


@inlined
def start_of_variation(shooting: Shooting, z: Any) -> State:
    """The state on the section with the directions of the section's coordinates."""
    walker, y = shooting.walker, shooting.blank
    size = len(walker.blank)
    start = on_section(walker, z)
    for i in range(size):
        y = put(y, i, start[i])
    for j in range(len(walker.picked)):
        column = lifted(walker, put(shooting.no_move, j, 1.0), 0.0)
        for i in range(size):
            y = put(y, size * (j + 1) + i, SMALL * column[i])
    return y


@inlined
def step_with_jacobian(shooting: Shooting, z: Any) -> tuple[int, float]:
    """One step from z (d,), its end and derivative left in `z_next` and `DP`.

    The derivative is that of the flow, corrected for the events' own shifts in time, times that of the impacts
    (saltation): J_impact (Phi - f (grad g Phi) / (grad g f)).

    Returns the outcome's number and the step's duration (s).
    """
    walker, method = shooting.walker, shooting.method
    n = len(walker.tree.arm_x)
    system = Variation(Mode(walker, walker.bent), shooting.blank)
    method.clock[H_NEXT] = 0.0
    y0 = start_of_variation(shooting, z)
    status = swing(method, system, walker, shooting.finder, Unobserved(), 0.0, y0, 0, shooting.knee_time)
    if status != WALKED:
        return status, method.clock[T]
    t, full = on_event(method, Variation(Mode(walker, walker.straight), shooting.blank), HEEL_STRIKE)
    before = head(walker.blank, full, 0)
    after = heel_strike(walker, before)
    f = derivative(Mode(walker, walker.straight), t, before)
    for i in range(len(walker.picked)):
        shooting.z_next[i] = after[walker.picked[i]]
    for j in range(len(walker.picked)):
        column = head(walker.blank, full, 2 * n * (j + 1))
        wait = -(column[SWING] + column[STANCE]) / (before[n + SWING] + before[n + STANCE])
        for i in range(2 * n):
            column = put(column, i, column[i] + wait * f[i])
        column = heel_strike_along(walker, before, after, column)
        for i in range(len(walker.picked)):
            shooting.DP[i, j] = column[walker.picked[i]] / SMALL
    return WALKED, t


def evaluate(shooting: Shooting, z: Any) -> tuple[int, float]:
    """`step_with_jacobian` for callers outside compiled code: Newton's first look, without a move."""
    status, period, _, _ = newton(shooting, np.array(z, float), NO_RESIDUAL)
    return status, period


@kernel
def residual_alone(shooting: Shooting, z: Any) -> float:
    """Residual of the step from z (d,), without its derivative: a fraction of the work."""
    walker, method = shooting.walker, shooting.plain
    clear_counts(method)
    method.clock[H_NEXT] = 0.0
    mode, y0 = Mode(walker, walker.bent), on_section(walker, z)
    status = swing(method, mode, walker, shooting.finder, Unobserved(), 0.0, y0, 0, shooting.knee_time)
    if status == WALKED:
        _, y = on_event(method, Mode(walker, walker.straight), HEEL_STRIKE)
        after = heel_strike(walker, y)
        for i in range(len(walker.picked)):
            shooting.z_next[i] = after[walker.picked[i]]
    return residual_of(shooting, z, status)


@kernel
def newton(shooting: Shooting, z: Any, tolerance: float) -> tuple[int, float, float, int]:
    """Solve P(z) = z by Newton's method with the exact derivative, halving moves that make the residual grow.

    A halved move is tried without the derivative, which only a state from which Newton's method goes on needs.

    z  (d,) start; overwritten with the best state found, whose derivative is left in `DP`

    Returns the outcome's number of the step from z, its duration (s), the residual (largest component of P(z) - z)
    and the steps of walking it took.
    """
    clear_counts(shooting.method)
    best, move, DP = shooting.best, shooting.move, shooting.best_DP
    best_status, best_period, best_residual = NO_HEEL_STRIKE, 0.0, NO_RESIDUAL
    scale, evaluations = 1.0, 0
    while evaluations < MOST_EVALUATIONS:
        evaluations += 1
        residual = residual_alone(shooting, z) if scale < 1.0 else 0.0
        if residual < best_residual:
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
        for i in range(shooting.move.size):
            z[i] = best[i] + scale * move[i]
    keep(best, DP, z, shooting.DP)
    return best_status, best_period, best_residual, evaluations


@inlined
def copied(numbers: Any, to: Any) -> None:
    """Copy numbers (d,)."""
    for i in range(numbers.size):
        to[i] = numbers[i]


@inlined
def keep(z: Any, DP: Any, z_kept: Any, DP_kept: Any) -> None:
    """Copy a state and the derivative there."""
    for i in range(z.size):
        z_kept[i] = z[i]
        for j in range(z.size):
            DP_kept[i, j] = DP[i, j]


@inlined
def newton_move(shooting: Shooting, z: Any, move: Any) -> bool:
    """Newton's move (I - DP)^-1 (P(z) - z); False if the matrix is singular."""
    for i in range(shooting.move.size):
        move[i] = shooting.z_next[i] - z[i]
        for j in range(shooting.move.size):
            shooting.system[i, j] = (1.0 if i == j else 0.0) - shooting.DP[i, j]
    if not factor(shooting.system, shooting.pivots, shooting.move.size):
        return False
    solve(shooting.system, shooting.pivots, move, 0, shooting.move.size)
    return True


@inlined
def residual_of(shooting: Shooting, z: Any, status: int) -> float:
    """Largest component of P(z) - z; huge if the step did not end in a heel strike."""
    if status != WALKED:
        return NO_RESIDUAL
    largest = 0.0
    for i in range(shooting.move.size):
        largest = max(largest, abs(shooting.z_next[i] - z[i]))
    return largest
