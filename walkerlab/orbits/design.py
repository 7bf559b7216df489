"""Minimum or maximum of a gait quantity over walker parameters, with bounds on other quantities.

SciPy's SLSQP on parameters scaled to their bounds, with exact gradients, from several starts. Where there is no gait
the function rises with distance from the last point that had one, so that the search avoids the gap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from walkerlab.solvers.system import Floats

PRECISION = 1e-9  # of the quantity over its start's
MAX_ITERATIONS = 60
ON_BOUND = 1e-6  # of the range
SAME = 1e-4  # of the range: ends of searches that are one optimum
STEEP = 10.0  # slope of the continuation, in the quantity's own size per range


@dataclass(frozen=True)
class Point:
    """Gait quantities at given walker parameters, with their gradients (variables,)."""

    numbers: Mapping[str, float]
    gradients: Mapping[str, Floats]
    apart: float = 1.0  # between the magnitudes of its two largest multipliers


@dataclass(frozen=True)
class Aim:
    """The optimisation problem.

    quantity  to minimise, or to maximise with `sign` -1
    lower, upper  (variables,) bounds
    keep      bounds on other quantities
    at        evaluate the gait at parameters (variables,); None if there is none
    """

    quantity: str
    sign: float
    lower: Floats
    upper: Floats
    keep: Mapping[str, tuple[float, float]]
    at: Callable[[Floats], Point | None]


@dataclass
class Descent:
    """The end of one search."""

    x: Floats
    point: Point | None
    gradient_norm: float = 0.0


def sought(question: Aim, start: Floats) -> Descent:
    """Minimise from `start` (variables,)."""
    from scipy.optimize import NonlinearConstraint, minimize  # a tenth of a second that nothing else needs

    span = question.upper - question.lower
    search, seen = Descent(start, None), dict[bytes, Point | None]()

    def at(u: Floats) -> Point | None:
        x = question.lower + np.clip(u, 0.0, 1.0) * span
        if x.tobytes() not in seen:
            seen[x.tobytes()] = question.at(x)
        point = seen[x.tobytes()]
        if point is not None:
            search.x, search.point = x, point
        return point

    first = at((start - question.lower) / span)
    if first is None:
        return search
    size = max(abs(first.numbers[question.quantity]), 1e-300)
    good = [((search.x - question.lower) / span, first)]

    def value_of(name: str, scale: float) -> Callable[[Floats], tuple[float, Floats]]:
        def found(u: Floats) -> tuple[float, Floats]:
            point = at(u)
            if point is not None and name in point.numbers:
                good[0] = (u.copy(), point)
                return scale * point.numbers[name], scale * point.gradients[name] * span
            last, known = good[0]
            back = u - last
            way = float(np.linalg.norm(back)) or 1.0
            return scale * known.numbers[name] + STEEP * way * way, 2.0 * STEEP * back

        return found

    objective = value_of(question.quantity, question.sign / size)
    constraints = [
        NonlinearConstraint(lambda u, of=of: of(u)[0], *bounds, lambda u, of=of: of(u)[1])
        for bounds, of in ((bounds, value_of(name, 1.0)) for name, bounds in question.keep.items())
    ]
    ended = minimize(
        objective, good[0][0], jac=True, method="SLSQP", bounds=[(0.0, 1.0)] * span.size, constraints=constraints,
        options={"ftol": PRECISION, "maxiter": MAX_ITERATIONS},
    )  # fmt: skip
    at(np.clip(ended.x, 0.0, 1.0))
    free = (ended.x > ON_BOUND) & (ended.x < 1.0 - ON_BOUND)
    search.gradient_norm = float(np.linalg.norm(objective(ended.x)[1][free]))
    return search


def kept(question: Aim, point: Point) -> bool:
    """Whether the other quantities are within their bounds, up to rounding."""
    slack = {name: 1e-6 * max(abs(low), abs(high)) for name, (low, high) in question.keep.items()}
    return all(
        name in point.numbers and low - slack[name] <= point.numbers[name] <= high + slack[name]
        for name, (low, high) in question.keep.items()
    )


def searched(
    question: Aim, own: Floats, starts: int, seed: int, search: Callable[[int, Floats], Descent] | None = None
) -> list[Descent]:
    """Search from the walker's own parameters and from random ones; return the best first, feasible ones before others.

    search  runs one search from its index and start (variables,); `minimise` by default
    """
    search = search or (lambda _, start: sought(question, start))
    drawn = np.random.default_rng(seed).uniform(question.lower, question.upper, (starts - 1, own.size))
    begun = (np.clip(own, question.lower, question.upper), *drawn)
    found = [search(number, start) for number, start in enumerate(begun)]
    ended = [one for one in found if one.point is not None]

    def rank(one: Descent) -> tuple[bool, float]:
        assert one.point is not None
        return not kept(question, one.point), question.sign * one.point.numbers[question.quantity]

    return sorted(ended, key=rank)


def optima(question: Aim, searches: list[Descent]) -> int:
    """Count the distinct optima among the feasible searches."""
    span, ends = question.upper - question.lower, list[Floats]()
    for one in searches:
        if one.point is not None and kept(question, one.point):
            u = (one.x - question.lower) / span
            if all(np.abs(u - other).max() > SAME for other in ends):
                ends.append(u)
    return len(ends)
