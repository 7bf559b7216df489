"""Continuation of solutions over a parameter: from value to value, or along their curve through its folds.

Both predict the next solution and correct it by Newton's method. From value to value the predictor is a polynomial
through the last solutions. A curve is the set of solutions of `m` equations in `m + 1` unknowns: the predictor follows
the tangent and the corrector stays on the plane normal to it, so that a fold is a regular point.

Source: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems (1977); Kuznetsov, Elements of
applied bifurcation theory, chapter 10.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from walkerlab.orbits.newton import MAX_EVALUATIONS, Effort, Equations, Evaluated, NotConverged, newton
from walkerlab.outcome import Outcome
from walkerlab.solvers.system import Floats

D = TypeVar("D")
FEW_CORRECTIONS = 3
RESOLUTION = 1e-14  # of arclength
Points = tuple[tuple[float, Floats], ...]
"""Solutions by abscissa, the latest last."""


class Strides(NamedTuple):
    """Limits of the stride over the parameter, and how many points the predictor uses."""

    widest: float
    narrowest: float
    remembered: int


class Way(NamedTuple):
    """How far a solution has been followed, and the state from which it continues."""

    at: float
    stride: float
    points: Points


class Follower:
    """Follows a solution over a rising parameter; earlier progress is cached."""

    def __init__(
        self,
        solve: Callable[[float, Floats], Floats | None],
        first: Way,
        strides: Strides,
        abscissa: Callable[[float], float] = float,
    ) -> None:
        """Begin with the solution `first`.

        solve     return the solution (m,) at a value, given a prediction; None if it fails
        abscissa  variable in which the solution is smooth, as a function of the parameter
        """
        self._solve, self._strides, self._abscissa, self._ways = solve, strides, abscissa, [first]

    def to(self, target: float) -> Way:
        """Follow the solution to the parameter's value `target`, or to where it is lost.

        Strides do not depend on the target until the last, so the cached ones serve every target.
        """
        way = self._ways[0]
        for way in self._ways:  # grows on the way
            following = way.at + way.stride
            if following >= target or way.stride < self._strides.narrowest:
                break
            if way is self._ways[-1]:
                self._ways.append(self._onward(way, following))
        while way.at < target and way.stride >= self._strides.narrowest:
            way = self._onward(way, min(target, way.at + way.stride))
        return way

    def _onward(self, way: Way, ahead: float) -> Way:
        """Advance with a wider next stride or, if the solution fails, stay with half the stride."""
        abscissa = self._abscissa(ahead)
        found = self._solve(ahead, interpolated(way.points, abscissa))
        if found is None:
            return way._replace(stride=0.5 * way.stride)
        points = (*way.points, (abscissa, found))[-self._strides.remembered :]
        return Way(ahead, min(self._strides.widest, 1.2 * way.stride), points)


def interpolated(points: Points, x: float) -> Floats:
    """Evaluate at x the polynomial through `points` (Lagrange)."""
    total = np.zeros_like(points[0][1])
    for i, (x_i, y_i) in enumerate(points):
        weight = 1.0
        for j, (x_j, _) in enumerate(points):
            if j != i:
                weight *= (x - x_j) / (x_i - x_j)
        total += weight * y_i
    return total


@dataclass(frozen=True)
class Solved(Generic[D]):
    """A point of a curve, with its unit tangent."""

    x: Floats
    tangent: Floats  # of unit length
    evaluated: Evaluated[D]
    corrections: int


def corrected(
    equations: Equations[D], guess: Floats, normal: Floats, tolerance: float, most: int = MAX_EVALUATIONS
) -> Solved[D] | NotConverged:
    """Solve for the point of a curve on the plane through `guess` with that normal."""

    def on_plane(x: Floats) -> Evaluated[D]:
        here = equations(x)
        value = np.append(here.value, normal @ (x - guess))
        return here._replace(value=value, jacobian=np.vstack((here.jacobian, normal)))

    found = newton(on_plane, guess, Effort(tolerance, most))
    if isinstance(found, NotConverged):
        return found
    try:
        direction = np.linalg.solve(found.evaluated.jacobian, np.eye(guess.size)[-1])
    except np.linalg.LinAlgError:
        return NotConverged(Outcome.WALKED, singular=True)
    return Solved(found.x, direction / np.linalg.norm(direction), found.evaluated, found.corrections)


@dataclass(frozen=True)
class StepControl:
    """Limits of one step.

    first, shortest, longest  arclengths
    turn       cosine of the largest angle between tangents of neighbours
    tolerance  on the equations
    """

    first: float = 0.01
    shortest: float = 1e-8
    longest: float = 0.05
    turn: float = 0.97
    tolerance: float = 1e-12


def stepped(
    equations: Equations[D],
    last: Solved[D],
    length: float,
    control: StepControl,
    acceptable: Callable[[Solved[D]], bool] = lambda _: True,
    before: Solved[D] | None = None,
) -> tuple[Solved[D], float] | NotConverged:
    """Return the next point of a curve after `last`, and the length of the step after it.

    acceptable  additional condition of the caller on the new point
    before      point before `last`, if any: it gives the curvature
    """
    lost = NotConverged(Outcome.WALKED)
    bend = np.zeros_like(last.x)  # how fast the tangent turns, per unit of arclength
    if before is not None:
        bend = np.asarray((last.tangent - before.tangent) / np.linalg.norm(last.x - before.x))
    while length >= control.shortest:
        guess = last.x + length * last.tangent + 0.5 * length**2 * bend
        found = corrected(equations, guess, last.tangent, control.tolerance)
        if isinstance(found, Solved):
            gone = float(np.linalg.norm(found.x - guess))
            if found.tangent @ last.tangent > control.turn and gone < 0.5 * length and acceptable(found):
                longer = 1.6 if found.corrections <= FEW_CORRECTIONS else 1.0
                return found, min(control.longest, longer * length)
        else:
            lost = found
        length *= 0.5
    return lost


@dataclass(frozen=True)
class Segment(Generic[D]):
    """The curve between two neighbours, as a function of the distance along the first one's tangent."""

    equations: Equations[D]
    first: Solved[D]
    second: Solved[D]
    tolerance: float

    @property
    def length(self) -> float:
        """Distance of the second point along the first one's tangent."""
        return float(self.first.tangent @ (self.second.x - self.first.x))

    def at(self, s: float) -> Solved[D] | NotConverged:
        """Solve for the point at distance s, which may lie slightly outside."""
        share = s / self.length
        bend = self.second.x - self.first.x - self.length * self.first.tangent
        guess = self.first.x + s * self.first.tangent + share * share * bend
        return corrected(self.equations, guess, self.first.tangent, self.tolerance, 2 * MAX_EVALUATIONS)


class _OffTheCurve(Exception):  # noqa: N818 (the end of one search, not an error)
    """The corrector found no point between two neighbours."""


def root_along(segment: Segment[D], measure: Callable[[Solved[D]], float]) -> Solved[D] | None:
    """Return the point of a segment where `measure` changes sign; None if the curve is lost.

    Brent's method on the corrected curve.
    """
    # Imported here: what follows no curve does without.
    from scipy.optimize import brentq

    found: dict[float, Solved[D]] = {0.0: segment.first, segment.length: segment.second}

    def at(s: float) -> float:
        if s not in found:
            point = segment.at(s)
            if isinstance(point, NotConverged):
                raise _OffTheCurve
            found[s] = point
        return measure(found[s])

    try:
        root = brentq(at, 0.0, segment.length, xtol=RESOLUTION, rtol=4.0 * np.finfo(float).eps)
        at(root)
    except (_OffTheCurve, ValueError):
        return None
    return found[root]
