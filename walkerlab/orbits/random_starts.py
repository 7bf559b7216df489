"""Random starting values of a search for gaits: each is followed as far as it takes to see where it leads.

A start comes near a solution of P(z) = z with few derivatives, each of which takes as long as five steps: Broyden's
updates serve between them (Broyden 1965, his first method). What is found is solved to rounding elsewhere.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.kernels import inlined, kernel
from walkerlab.orbits.step_map import (
    MOST_EVALUATIONS,
    NO_RESIDUAL,
    SMALLEST_MOVE,
    WALKED,
    Shooting,
    copied,
    newton_move,
    step_from,
)
from walkerlab.solvers.stepping import T, clear_counts

Floats = NDArray[np.float64]

# angle between the legs (rad), angular velocities (sqrt(g/L)) of swing and stance leg, and of a shank whose knee was
# free at heel strike
LEAST_START, MOST_START = np.array([0.0, -1.0, -1.0, -1.0]), np.array([1.2, 1.0, 0.0, 1.0])
SHORTEST_STEP = 0.05  # in sqrt(L/g); a shorter 'step' is standing, which solves the equations too
NEAR_RESIDUAL = 1e-6  # of a start that has come near a solution
STANDING_RESIDUAL = 1e-2  # below which so short a step comes to stand
WIDEST_WAY, LEFT = 0.1, 0.1  # to a known gait, and what part of it a move with the derivative there may leave
NEW, NOWHERE = -1, -2  # where a start leads, beside the number of a known gait


class KnownGaits(NamedTuple):
    """Gaits that need not be found again."""

    z: Any  # (gaits, d)
    inverse: Any  # (gaits, d, d) of I - DP there


def known_gaits(shooting: Shooting, gaits: list[tuple[Floats, Floats]]) -> KnownGaits:
    """Gaits by state (d,) and derivative (d, d) of the step map there."""
    d = shooting.move.size
    z, DP = np.zeros((len(gaits), d)), np.zeros((len(gaits), d, d))
    for k, (state, derivative) in enumerate(gaits):
        z[k], DP[k] = state, derivative
    return KnownGaits(z, np.linalg.pinv(np.eye(d) - DP))


@kernel
def follow_starts(shooting: Shooting, known: KnownGaits, starts: Any, led: Any) -> None:
    """Follow starts (starts, d), which are overwritten with the last states tried.

    led  (starts,) number of the known gait that a start leads to, NEW for another solution, or NOWHERE; written
    """
    for i in range(len(starts)):
        copied(starts[i], shooting.start)
        led[i] = follow(shooting, known, shooting.start)
        copied(shooting.start, starts[i])


@inlined
def follow(shooting: Shooting, known: KnownGaits, z: Any) -> int:
    """Where a start z (d,) leads, which is overwritten with the last state tried.

    After a full move that makes the residual smaller, Broyden's update of the derivative serves for the next one; else
    the derivative is computed anew, and moves with it are halved until they do. A start that does not walk to a heel
    strike, or comes to stand, is given up.
    """
    clear_counts(shooting.method)
    best, move = shooting.best, shooting.move
    _, _, best_residual = step_from(shooting, shooting.walker, z, False)
    scale, evaluations = 1.0, 1
    stale, exact, nearer = True, False, True
    while NEAR_RESIDUAL < best_residual < NO_RESIDUAL and evaluations < MOST_EVALUATIONS:
        if nearer:
            if best_residual < STANDING_RESIDUAL and shooting.plain.clock[T] < SHORTEST_STEP:
                return NOWHERE
            gait = leads_to(known, z, shooting.z_next)
            if gait >= 0:
                return gait
        if stale:
            status, _, _ = step_from(shooting, shooting.walker, z, True)
            if status != WALKED:
                return NOWHERE
            stale, exact, scale = False, True, 1.0
        if scale == 1.0:
            copied(z, best)
            if not newton_move(shooting, z, move):
                return NOWHERE
        for i in range(z.size):
            z[i] = best[i] + scale * move[i]
        _, _, residual = step_from(shooting, shooting.walker, z, False)
        evaluations += 1
        nearer = residual < best_residual
        if nearer:
            stale, exact, best_residual = scale < 1.0, False, residual
            if not stale:
                update(shooting, z, move)
        else:
            copied(best, z)
            stale, scale = not exact, 0.5 * scale
            if scale < SMALLEST_MOVE:
                return NOWHERE
    return NEW if best_residual <= NEAR_RESIDUAL else NOWHERE


@inlined
def leads_to(known: KnownGaits, z: Any, end: Any) -> int:
    """Number of the known gait that Newton's method with the derivative there leads to from z (d,); else NOWHERE.

    It does if the way is short and one move leaves a small part of it: what the next leaves is smaller still.

    end  (d,) where the step from z leads
    """
    for k in range(len(known.z)):
        way, left = 0.0, 0.0
        for i in range(z.size):
            off = z[i] - known.z[k, i]
            way = max(way, abs(off))
            for j in range(z.size):
                off += known.inverse[k, i, j] * (end[j] - z[j])
            left = max(left, abs(off))
        if way < WIDEST_WAY and left < LEFT * way:
            return k
    return NOWHERE


@inlined
def update(shooting: Shooting, z: Any, move: Any) -> None:
    """Broyden's update of the derivative in `DP` after a full move (d,) to z (d,)."""
    square = 0.0
    for i in range(move.size):
        square += move[i] * move[i]
    for i in range(move.size):
        for j in range(move.size):
            shooting.DP[i, j] += (shooting.z_next[i] - z[i]) * move[j] / square
