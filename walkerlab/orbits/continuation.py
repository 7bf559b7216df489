"""Following a curve of solutions through folds: pseudo-arclength continuation with step control.

A curve is where `m` equations in `m + 1` unknowns hold. One step predicts along the tangent and corrects by Newton's
method on the plane normal to it, so that a fold, where the parameter turns back, is a point like any other.

Source: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems (1977); Kuznetsov, Elements of
applied bifurcation theory, chapter 10.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from walkerlab.hybrid.outcome import Outcome

Floats = NDArray[np.float64]
D = TypeVar("D")
MOST_CORRECTIONS = 8
FEW_CORRECTIONS = 3
RESOLUTION = 1e-14  # of arclength
SLACK = 100.0  # a residual this much above the tolerance that no longer shrinks is rounding


@dataclass(frozen=True)
class Evaluated(Generic[D]):
    """The equations at a point.

    outcome   WALKED if there is a value
    value     (m,)
    jacobian  (m, m + 1)
    data      what the caller wants to keep of it
    """

    outcome: Outcome
    value: Floats
    jacobian: Floats
    data: D


class Equations(Protocol[D]):
    """m equations in m + 1 unknowns."""

    def at(self, x: Floats) -> Evaluated[D]:
        """Value and derivative at x (m + 1,)."""


@dataclass(frozen=True)
class Solved(Generic[D]):
    """A point of the curve."""

    x: Floats
    tangent: Floats  # of unit length
    evaluated: Evaluated[D]
    corrections: int


@dataclass(frozen=True)
class NotConverged:
    """Why Newton's method found nothing."""

    outcome: Outcome  # WALKED if it could be evaluated and did not converge


def tangent_of(jacobian: Floats, along: Floats) -> Floats:
    """Unit tangent of a curve, on the same side as `along`."""
    bordered = np.vstack((jacobian, along))
    right = np.zeros(along.size)
    right[-1] = 1.0
    direction = np.linalg.solve(bordered, right)
    return np.asarray(direction / np.linalg.norm(direction))


def corrected(
    equations: Equations[D], guess: Floats, normal: Floats, tolerance: float, most: int = MOST_CORRECTIONS
) -> Solved[D] | NotConverged:
    """Newton's method from `guess` on the plane through it with that normal."""
    x, best = guess, np.inf
    for correction in range(most):
        here = equations.at(x)
        if here.outcome is not Outcome.WALKED:
            return NotConverged(here.outcome)
        residual = float(np.max(np.abs(here.value)))
        rounding = residual >= 0.5 * best and residual <= SLACK * tolerance
        if residual <= tolerance or rounding:
            try:
                return Solved(x, tangent_of(here.jacobian, normal), here, correction)
            except np.linalg.LinAlgError:
                return NotConverged(Outcome.WALKED)
        best = min(best, residual)
        try:
            move = np.linalg.solve(np.vstack((here.jacobian, normal)), np.append(-here.value, normal @ (guess - x)))
        except np.linalg.LinAlgError:
            return NotConverged(Outcome.WALKED)
        x = x + move
    return NotConverged(Outcome.WALKED)


@dataclass(frozen=True)
class StepControl:
    """How far one step may go.

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
) -> tuple[Solved[D], float, float] | NotConverged:
    """The next point of a curve after `last`, how far it was sought, and how far to look for the one after it.

    acceptable  a caller's own wish for smaller steps
    before      the point before the last, if there is one: it tells how the curve bends
    """
    lost = NotConverged(Outcome.WALKED)
    bend = np.zeros_like(last.x) if before is None else bend_between(before, last)
    while length >= control.shortest:
        guess = last.x + length * last.tangent + 0.5 * length**2 * bend
        found = corrected(equations, guess, last.tangent, control.tolerance)
        if isinstance(found, Solved):
            gone = float(np.linalg.norm(found.x - guess))
            if found.tangent @ last.tangent > control.turn and gone < 0.5 * length and acceptable(found):
                longer = 1.6 if found.corrections <= FEW_CORRECTIONS else 1.0
                return found, length, min(control.longest, longer * length)
        else:
            lost = found
        length *= 0.5
    return lost


def bend_between(one: Solved[D], other: Solved[D]) -> Floats:
    """How fast the tangent turns from one neighbour to the other, per unit of arclength."""
    return np.asarray((other.tangent - one.tangent) / np.linalg.norm(other.x - one.x))


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
        """The point at distance s, which may lie a little outside."""
        share = s / self.length
        bend = self.second.x - self.first.x - self.length * self.first.tangent
        guess = self.first.x + s * self.first.tangent + share * share * bend
        return corrected(self.equations, guess, self.first.tangent, self.tolerance, 2 * MOST_CORRECTIONS)


class _OffTheCurve(Exception):  # noqa: N818 (the end of one search, not an error)
    """The corrector found no point between two neighbours."""


def root_along(segment: Segment[D], measure: Callable[[Solved[D]], float]) -> Solved[D] | None:
    """The point of a segment where `measure` vanishes, whose signs at both ends differ; None if it is lost.

    Brent's method on the corrected curve: secant and inverse quadratic steps, safe by their bracket.
    """
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
