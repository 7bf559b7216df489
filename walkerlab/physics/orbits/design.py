"""Minimum or maximum of a gait quantity over walker parameters, with bounds on other quantities.

SciPy's SLSQP searches parameters scaled to their bounds, with exact gradients and from several starts. If there is no
gait, the objective increases with the distance from the last point that had one, so that the search avoids the gap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from walkerlab.physics.solvers.system import Floats

PRECISION = 1e-9  # a search ends when the quantity changes by less than this, relative to its initial value
MAX_DESIGN_ITERATIONS = 60
BOUND_TOLERANCE = 1e-6  # fraction of the range; parameters closer than this to a bound count as on it
SAME_OPTIMUM = 1e-4  # searches whose results differ by at most this fraction of the range found the same optimum
# A point without a gait that lies one range away from the last gait is penalised by this multiple of the quantity's
# initial value. The penalty grows with the square of the distance.
PENALTY_SLOPE = 10.0


@dataclass(frozen=True)
class Point:
    numbers: Mapping[str, float]
    gradients: Mapping[str, Floats]
    apart: float = 1.0  # difference between the magnitudes of the two largest multipliers


@dataclass(frozen=True)
class DesignProblem:
    quantity: str  # quantity to minimise, or to maximise if `sign` is -1
    sign: float
    lower: Floats  # (variables,) bounds
    upper: Floats  # (variables,) bounds
    keep: Mapping[str, tuple[float, float]]  # bounds on other quantities
    evaluate: Callable[[Floats], Point | None]  # returns the gait's quantities at parameters (variables,), or None


@dataclass
class DesignSearch:
    x: Floats
    point: Point | None
    gradient_norm: float = 0.0


Searcher = Callable[[int, Floats], DesignSearch]


def minimise(problem: DesignProblem, start: Floats) -> DesignSearch:
    from scipy.optimize import NonlinearConstraint, minimize  # imported here, because it takes a tenth of a second

    span = problem.upper - problem.lower
    search = DesignSearch(start, None)
    seen = dict[bytes, Point | None]()

    def point_at(u: Floats) -> Point | None:
        # SLSQP may leave the bounds by rounding.
        x = problem.lower + np.clip(u, 0.0, 1.0) * span
        # Points are kept, because the objective and each constraint ask for the same one in turn.
        if x.tobytes() not in seen:
            seen[x.tobytes()] = problem.evaluate(x)
        point = seen[x.tobytes()]
        if point is not None:
            search.x = x
            search.point = point
        return point

    first = point_at((start - problem.lower) / span)
    if first is None:
        return search
    size = max(abs(first.numbers[problem.quantity]), 1e-300)
    last_good = [((search.x - problem.lower) / span, first)]

    def value_of(name: str, scale: float) -> Callable[[Floats], tuple[float, Floats]]:
        def evaluate(u: Floats) -> tuple[float, Floats]:
            point = point_at(u)
            if point is not None and name in point.numbers:
                last_good[0] = (u.copy(), point)
                return scale * point.numbers[name], scale * point.gradients[name] * span
            last, last_point = last_good[0]
            back = u - last
            # At the last good point itself, which may lack this quantity, the distance counts as one range, so that the
            # value rises.
            distance = float(np.linalg.norm(back)) or 1.0
            return scale * last_point.numbers[name] + PENALTY_SLOPE * distance * distance, 2.0 * PENALTY_SLOPE * back

        return evaluate

    objective = value_of(problem.quantity, problem.sign / size)
    constraints = [
        NonlinearConstraint(lambda u, of=of: of(u)[0], *bounds, lambda u, of=of: of(u)[1])
        for bounds, of in ((bounds, value_of(name, 1.0)) for name, bounds in problem.keep.items())
    ]
    result = minimize(
        objective, last_good[0][0], jac=True, method="SLSQP", bounds=[(0.0, 1.0)] * span.size, constraints=constraints,
        options={"ftol": PRECISION, "maxiter": MAX_DESIGN_ITERATIONS},
    )  # fmt: skip
    # The last point evaluated need not be the result.
    point_at(np.clip(result.x, 0.0, 1.0))
    # On a bound the gradient need not vanish.
    free = (result.x > BOUND_TOLERANCE) & (result.x < 1.0 - BOUND_TOLERANCE)
    search.gradient_norm = float(np.linalg.norm(objective(result.x)[1][free]))
    return search


def is_feasible(problem: DesignProblem, point: Point) -> bool:
    slack = {name: 1e-6 * max(abs(low), abs(high)) for name, (low, high) in problem.keep.items()}
    return all(
        name in point.numbers and low - slack[name] <= point.numbers[name] <= high + slack[name]
        for name, (low, high) in problem.keep.items()
    )


def search_from_starts(
    problem: DesignProblem, current: Floats, starts: int, seed: int, search: Searcher | None = None
) -> list[DesignSearch]:
    """Search from the `current` parameters and from random ones, and return the successful searches, best first."""
    search = search or (lambda _, start: minimise(problem, start))
    random_starts = np.random.default_rng(seed).uniform(problem.lower, problem.upper, (starts - 1, current.size))
    all_starts = (np.clip(current, problem.lower, problem.upper), *random_starts)
    searches = [search(number, start) for number, start in enumerate(all_starts)]
    successful = [search_end for search_end in searches if search_end.point is not None]

    def rank(search_end: DesignSearch) -> tuple[bool, float]:
        assert search_end.point is not None
        return not is_feasible(problem, search_end.point), problem.sign * search_end.point.numbers[problem.quantity]

    return sorted(successful, key=rank)


def count_optima(problem: DesignProblem, searches: list[DesignSearch]) -> int:
    span = problem.upper - problem.lower
    ends = list[Floats]()
    for search in searches:
        if search.point is not None and is_feasible(problem, search.point):
            u = (search.x - problem.lower) / span
            if all(np.abs(u - end).max() > SAME_OPTIMUM for end in ends):
                ends.append(u)
    return len(ends)
