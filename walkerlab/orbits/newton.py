"""Newton's method for gaits of either model and for points on their branches."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.solvers.system import Floats

D = TypeVar("D")
MAX_EVALUATIONS = 8
ROUNDING = 100.0  # a residual at most this many tolerances large that a move does not halve is rounding


class Evaluated(NamedTuple, Generic[D]):
    """Value and derivative of the equations at a point.

    outcome   WALKED if there is a value
    value     (m,)
    jacobian  (m, m), or (m, m + 1) for a curve
    data      the caller's own data
    """

    outcome: Outcome | None
    value: Floats
    jacobian: Floats
    data: D

    @property
    def residual(self) -> float:
        """Largest component of the value; infinite without a value."""
        return max(map(abs, self.value.tolist())) if self.outcome is Outcome.WALKED else np.inf


Equations = Callable[[Floats], Evaluated[D]]
"""m equations at x: value and derivative; in m unknowns for a point, in one more for a curve."""


@dataclass(frozen=True)
class Solution(Generic[D]):
    x: Floats
    evaluated: Evaluated[D]
    corrections: int


@dataclass(frozen=True)
class NotConverged:
    """Why Newton's method failed.

    outcome   WALKED if the equations could be evaluated; None where the parameter makes no walker
    singular  whether the Jacobian was singular, i.e. a multiplier is 1
    """

    outcome: Outcome | None
    singular: bool = False


class Effort(NamedTuple):
    """Accuracy of a solution and the limits of its search.

    tolerance  on the residual
    most       evaluations of the equations
    shortest   share of a move below which it is not halved
    growth     ratio of residuals from which on a move is halved
    rounding   residuals up to this many tolerances count as rounding if a move does not halve them
    """

    tolerance: float
    most: int = MAX_EVALUATIONS
    shortest: float = 1.0
    growth: float = 1.0
    rounding: float = ROUNDING


def newton(equations: Equations[D], guess: Floats, effort: Effort) -> Solution[D] | NotConverged:
    """Solve m equations in m unknowns from a guess (m,).

    Returns the solution, or the outcome with which the equations failed or did not converge.
    """
    tolerance, most, shortest, growth, rounding = effort
    x, here, corrections, evaluations = guess, equations(guess), 0, 1
    residual = here.residual
    while tolerance < residual < np.inf:
        try:
            move = np.linalg.solve(here.jacobian, -here.value)
        except np.linalg.LinAlgError:
            return NotConverged(Outcome.WALKED, singular=True)
        share = 1.0
        while True:
            if evaluations >= most:
                return NotConverged(Outcome.WALKED)
            ahead = equations(x + share * move)
            evaluations += 1
            left = ahead.residual
            if 0.5 * residual <= left < np.inf and min(residual, left) <= rounding * tolerance:
                better = left < residual
                return Solution(x + share * move, ahead, corrections + 1) if better else Solution(x, here, corrections)
            if left < growth * residual or share <= shortest:
                break
            share *= 0.5
        x, here, residual, corrections = x + share * move, ahead, left, corrections + 1
    if here.outcome is Outcome.WALKED:
        return Solution(x, here, corrections)
    # a move that left the walkers says nothing of the guess
    return NotConverged(Outcome.WALKED if here.outcome is None and corrections else here.outcome)
