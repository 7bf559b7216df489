"""Newton's method for gaits of either model and for points on their branches."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.solvers.system import Floats

Data = TypeVar("Data")
MAX_NEWTON_EVALUATIONS = 8
# residuals up to this many tolerances count as rounding errors if a move does not halve them
ROUNDING_FACTOR = 100.0


class Evaluated(NamedTuple, Generic[Data]):
    outcome: Outcome | None  # WALKED if there is a value
    value: Floats  # (m,)
    jacobian: Floats  # (m, m) for a point, or (m, m + 1) for a curve
    data: Data  # data for the caller

    @property
    def residual(self) -> float:
        """Largest absolute component of the value, or infinity if there is no value."""
        return max(map(abs, self.value.tolist())) if self.outcome is Outcome.WALKED else np.inf


# m equations and their derivative at x, with m unknowns for a point and m + 1 for a curve
Equations = Callable[[Floats], Evaluated[Data]]


@dataclass(frozen=True)
class Solution(Generic[Data]):
    x: Floats
    evaluated: Evaluated[Data]
    corrections: int


@dataclass(frozen=True)
class NotConverged:
    outcome: Outcome | None  # WALKED if the equations could be evaluated; None if the parameter gives no valid walker
    singular: bool = False  # whether the Jacobian was singular, i.e. a multiplier is 1


class Effort(NamedTuple):
    """Required accuracy of a solution, and limits of the search for it."""

    tolerance: float  # largest residual of a solution
    max_evaluations: int = MAX_NEWTON_EVALUATIONS
    shortest: float = 1.0  # a move of at most this fraction of a full one is not halved again
    growth: float = 1.0  # a move is halved if it multiplies the residual by this or more
    rounding: float = ROUNDING_FACTOR  # see ROUNDING_FACTOR


def newton(equations: Equations[Data], guess: Floats, effort: Effort) -> Solution[Data] | NotConverged:
    """Solve m equations from a guess (m,). On failure, return NotConverged with the outcome of the walk."""
    tolerance, max_evaluations, shortest, growth, rounding = effort
    x = guess
    current = equations(guess)
    corrections = 0
    evaluations = 1
    residual = current.residual
    while tolerance < residual < np.inf:
        try:
            move = np.linalg.solve(current.jacobian, -current.value)
        except np.linalg.LinAlgError:
            return NotConverged(Outcome.WALKED, singular=True)
        share = 1.0
        while True:
            if evaluations >= max_evaluations:
                return NotConverged(Outcome.WALKED)
            ahead = equations(x + share * move)
            evaluations += 1
            remaining = ahead.residual
            # The residual is as small as rounding errors allow, so the better of the two points is the solution.
            if 0.5 * residual <= remaining < np.inf and min(residual, remaining) <= rounding * tolerance:
                if remaining < residual:
                    return Solution(x + share * move, ahead, corrections + 1)
                return Solution(x, current, corrections)
            if remaining < growth * residual or share <= shortest:
                break
            share *= 0.5
        x = x + share * move
        current = ahead
        residual = remaining
        corrections = corrections + 1
    if current.outcome is Outcome.WALKED:
        return Solution(x, current, corrections)
    # If the parameters became invalid only in a later Newton move, the guess itself was valid.
    return NotConverged(Outcome.WALKED if current.outcome is None and corrections else current.outcome)
