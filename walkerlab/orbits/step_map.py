"""The step map of the rigid model and its exact derivative.

A gait's state lies on the section 'both feet on the slope, just after heel strike'. Its coordinates z are the stance
leg's angle, which the swing leg's follows from, and the velocities of all bodies that turn by themselves then: swing
leg, stance leg, and a shank whose knee was free during the impact. A compass has (theta_2, dtheta_1, dtheta_2).
"""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.rigid_observer import Unobserved
from walkerlab.hybrid.rigid_walk import take_step
from walkerlab.kernels import inlined, kernel, vector
from walkerlab.mechanics.links import spread
from walkerlab.mechanics.standing import AT_STRIKE, STANCE, STRAIGHT, SWING, Standing
from walkerlab.solvers.dop853 import new_dop853
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.linear import factor, solve
from walkerlab.solvers.stepping import BUDGET, H_NEXT, clear_counts
from walkerlab.solvers.system import State

WALKED, NO_HEEL_STRIKE = int(Outcome.WALKED), int(Outcome.NO_HEEL_STRIKE)
SMALLEST_MOVE = 2.0**-8
MOST_EVALUATIONS = 60
NO_RESIDUAL = 1e300
SMALL = 2.0**-13
"""Length of the directions that are led along: what is linear in them is exact, and needs fewer digits than the state.

With an absolute tolerance of a tenth of the relative one they keep some three digits less, which halves the steps.
"""
ROUNDING = 1e-10  # a residual this small that no longer shrinks is rounding


def on_section(walker: Standing, z: Any) -> State:
    """The state (2 n) of section coordinates z (d,)."""
    y = np.zeros(len(walker.blank))
    lift(walker, z, -2.0 * (walker.slope + walker.lean), y, 0)
    return tuple(y.tolist())


@inlined
def lift(walker: Standing, z: Any, both: float, y: Any, at: int) -> None:
    """The state of section coordinates z (d,) with straight legs whose angles sum to `both` (rad), from y[at] on.

    Linear in z for `both` = 0: the derivative of the state on the section along z.
    """
    n = len(walker.arm_x)
    theta, omega = vector(walker.arm_x), vector(walker.arm_x)
    for k in range(n):
        theta[k], omega[k] = 0.0, 0.0
    theta[STANCE], theta[SWING] = z[0], both - z[0]
    for i in range(1, len(z)):
        omega[walker.section[i] - n] = z[i]
    spread(walker.E[STRAIGHT], n, theta)
    spread(walker.E[AT_STRIKE], n, omega)
    for k in range(n):
        y[at + k], y[at + n + k] = theta[k], omega[k]


def section_of(walker: Standing, y: Any) -> Any:
    """The section coordinates (d,) of a state (2 n) just after heel strike."""
    return np.array([y[i] for i in walker.picked])


class Shooting(NamedTuple):
    """A walker's step map with the memory to evaluate, differentiate and invert it."""

    walker: Standing
    method: Any  # for the equations of the walker with a column for each coordinate
    plain: Any  # for those of the walker alone
    finder: CrossingFinder
    y: Any  # (2 n (1 + d),) the state with its columns, at the step's start and end
    plain_y: Any  # (2 n,)
    unit: Any  # (d,) a unit vector
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
        walker, method, plain, finder, np.zeros(variation_size(walker)), np.zeros(len(walker.blank)), np.zeros(d),
        np.zeros(d), np.zeros((d, d)), np.zeros((d, d)), np.zeros(d, np.int64), np.zeros(1), np.zeros(d), np.zeros(d),
        np.zeros(d), np.zeros((d, d)),
    )  # fmt: skip


@inlined
def step_from(shooting: Shooting, walker: Standing, z: Any, derived: bool) -> tuple[int, float, float]:
    """One step of `walker` from z (d,): where it led is left in `z_next`, and if `derived` its derivative in `DP`.

    Without the derivative it is a fraction of the work.

    Returns the outcome's number, the step's duration (s) and the residual, the largest component of P(z) - z: huge if
    the step did not end in a heel strike.
    """
    section, unit = walker.section, shooting.unit
    method = shooting.method if derived else shooting.plain
    y = shooting.y if derived else shooting.plain_y
    size, d = len(walker.blank), len(z)
    lift(walker, z, -2.0 * (walker.slope + walker.lean), y, 0)
    for j in range(len(y) // size - 1):
        for i in range(d):
            unit[i] = SMALL if i == j else 0.0
        lift(walker, unit, 0.0, y, size * (j + 1))
    if not derived:
        clear_counts(method)
    method.clock[H_NEXT] = 0.0
    status, period = take_step(walker, method, shooting.finder, Unobserved(), 0.0, y, 0, shooting.knee_time)
    if status != WALKED:
        return status, period, NO_RESIDUAL
    residual = 0.0
    for i in range(d):
        shooting.z_next[i] = y[section[i]]
        residual = max(residual, abs(shooting.z_next[i] - z[i]))
        if derived:
            for j in range(d):
                shooting.DP[i, j] = y[size * (j + 1) + section[i]] / SMALL
    return status, period, residual


def evaluate(shooting: Shooting, z: Any) -> tuple[int, float]:
    """A step with its derivative for callers outside compiled code: Newton's first look, without a move."""
    status, period, _, _ = newton(shooting, np.array(z, float), NO_RESIDUAL)
    return status, period


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
        status, period, residual = step_from(shooting, shooting.walker, z, scale == 1.0)
        if residual < best_residual and scale < 1.0:
            status, period, residual = step_from(shooting, shooting.walker, z, True)
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
