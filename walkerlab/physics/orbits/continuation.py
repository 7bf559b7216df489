"""Continuation of solutions in a parameter: from value to value, or along the solution curve and through its folds.

Both methods predict the next solution and correct it by Newton's method. From value to value the predictor is a
polynomial through the last solutions. A curve is the set of solutions of `m` equations in `m + 1` unknowns: the
predictor follows the tangent and the corrector stays on the plane normal to it, so that a fold is a regular point.

Source: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems (1977); Kuznetsov, Elements of
applied bifurcation theory, chapter 10.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.orbits import newton
from walkerlab.physics.orbits.newton import Data, Effort, Equations, Evaluated, NotConverged, Solution
from walkerlab.physics.solvers.system import Floats

FEW_CORRECTIONS = 3  # the next step is longer if at most this many Newton corrections were needed
ROOT_RESOLUTION = 1e-14  # accuracy of a root, in arclength
# (abscissa, solution) pairs, latest last
Points = tuple[tuple[float, Floats], ...]


class Strides(NamedTuple):
    """Limits on the increments of the parameter, and the number of points that the predictor uses."""

    widest: float
    narrowest: float
    remembered: int


class FollowerState(NamedTuple):
    """Parameter value up to which a solution has been followed, its next increment, and the last points."""

    value: float
    stride: float
    points: Points


class Follower:
    """Follows a solution as the parameter rises, and caches its progress."""

    def __init__(
        self,
        solve: Callable[[float, Floats], Floats | None],
        first: FollowerState,
        strides: Strides,
        abscissa: Callable[[float], float] = float,
    ) -> None:
        """Start from the state `first`.

        solve     function that returns the solution (m,) at a value near a guess, or None if there is none
        abscissa  function that maps the value to a variable in which the solution is smooth
        """
        self._solve = solve
        self._strides = strides
        self._abscissa = abscissa
        self._states = [first]

    def follow_to(self, target: float) -> FollowerState:
        """Follow the solution to the parameter value `target`, or until it is lost."""
        # Only the last increment depends on the target, so the cached states are valid for every target.
        state = self._states[0]
        for state in self._states:  # the list grows during the loop
            following = state.value + state.stride
            if following >= target or state.stride < self._strides.narrowest:
                break
            if state is self._states[-1]:
                self._states.append(self._advance(state, following))
        while state.value < target and state.stride >= self._strides.narrowest:
            state = self._advance(state, min(target, state.value + state.stride))
        return state

    def _advance(self, state: FollowerState, ahead: float) -> FollowerState:
        abscissa = self._abscissa(ahead)
        solution = self._solve(ahead, interpolate(state.points, abscissa))
        if solution is None:
            return state._replace(stride=0.5 * state.stride)
        points = (*state.points, (abscissa, solution))[-self._strides.remembered :]
        return FollowerState(ahead, min(self._strides.widest, 1.2 * state.stride), points)


def interpolate(points: Points, x: float) -> Floats:
    total = np.zeros_like(points[0][1])
    for x_i, y_i in points:
        total += math.prod((x - x_j) / (x_i - x_j) for x_j, _ in points if x_j != x_i) * y_i
    return total


@dataclass(frozen=True)
class CurvePoint(Solution[Data]):
    tangent: Floats  # unit vector


def correct(
    equations: Equations[Data], guess: Floats, normal: Floats, effort: Effort
) -> CurvePoint[Data] | NotConverged:
    """Solve for the point of a curve on the plane through `guess` with this `normal`."""

    def evaluate_on_plane(x: Floats) -> Evaluated[Data]:
        evaluated = equations(x)
        value = np.append(evaluated.value, normal @ (x - guess))
        return evaluated._replace(value=value, jacobian=np.vstack((evaluated.jacobian, normal)))

    solution = newton.newton(evaluate_on_plane, guess, effort)
    if isinstance(solution, NotConverged):
        return solution
    try:
        # The solution of this system is tangent to the curve, and points to the same side of the plane as its normal.
        direction = np.linalg.solve(solution.evaluated.jacobian, np.eye(guess.size)[-1])
    except np.linalg.LinAlgError:
        return NotConverged(Outcome.WALKED, singular=True)
    return CurvePoint(solution.x, solution.evaluated, solution.corrections, direction / np.linalg.norm(direction))


@dataclass(frozen=True)
class StepControl:
    first: float = 0.01  # arclength of the first step
    # arclength; it is this short because folds of long gaits are sharper than 1e-8
    shortest: float = 1e-9
    longest: float = 0.05  # arclength
    turn: float = 0.97  # cosine of the largest angle between the tangents of neighbouring points
    tolerance: float = 1e-12  # largest residual of the equations


def step_along(
    equations: Equations[Data],
    last: CurvePoint[Data],
    length: float,
    control: StepControl,
    acceptable: Callable[[CurvePoint[Data]], bool] = lambda _: True,
    before: CurvePoint[Data] | None = None,
) -> tuple[CurvePoint[Data], float] | NotConverged:
    """Find the next point that passes `acceptable`, and the next step length.

    The point `before` supplies the curvature.
    """
    lost = NotConverged(Outcome.WALKED)
    bend = np.zeros_like(last.x)  # curvature: change of the tangent per arclength
    if before is not None:
        bend = np.asarray((last.tangent - before.tangent) / np.linalg.norm(last.x - before.x))
    while length >= control.shortest:
        guess = last.x + length * last.tangent + 0.5 * length**2 * bend
        point = correct(equations, guess, last.tangent, Effort(control.tolerance))
        if isinstance(point, CurvePoint):
            correction = float(np.linalg.norm(point.x - guess))
            # A sharp turn or a long correction may lead to another branch.
            if point.tangent @ last.tangent > control.turn and correction < 0.5 * length and acceptable(point):
                longer = 1.6 if point.corrections <= FEW_CORRECTIONS else 1.0
                return point, min(control.longest, longer * length)
        else:
            lost = point
        length *= 0.5
    return lost


@dataclass(frozen=True)
class Segment(Generic[Data]):
    """Curve between two neighbouring points, as a function of the distance along the first point's tangent."""

    equations: Equations[Data]
    first: CurvePoint[Data]
    second: CurvePoint[Data]
    tolerance: float

    @property
    def length(self) -> float:
        return float(self.first.tangent @ (self.second.x - self.first.x))

    def point_at(self, s: float) -> CurvePoint[Data] | NotConverged:
        share = s / self.length
        bend = self.second.x - self.first.x - self.length * self.first.tangent
        guess = self.first.x + s * self.first.tangent + share * share * bend
        effort = Effort(self.tolerance, 2 * newton.MAX_NEWTON_EVALUATIONS)
        return correct(self.equations, guess, self.first.tangent, effort)


class _OffTheCurve(Exception):  # noqa: N818 (the end of one search, not an error)
    """Raised if the corrector finds no point between two neighbours."""


def root_along(segment: Segment[Data], measure: Callable[[CurvePoint[Data]], float]) -> CurvePoint[Data] | None:
    """Return the point of a segment where `measure` changes sign, by Brent's method, or None if the curve is lost."""
    # Imported here, because only curves need it.
    from scipy.optimize import brentq

    points: dict[float, CurvePoint[Data]] = {0.0: segment.first, segment.length: segment.second}

    def measure_at(s: float) -> float:
        if s not in points:
            point = segment.point_at(s)
            if isinstance(point, NotConverged):
                raise _OffTheCurve
            points[s] = point
        return measure(points[s])

    try:
        root = brentq(measure_at, 0.0, segment.length, xtol=ROOT_RESOLUTION, rtol=4.0 * np.finfo(float).eps)
        # The root must be among `points`, even if Brent's method did not evaluate the measure there.
        measure_at(root)
    # Brent's method raises ValueError if the measure has the same sign at both ends.
    except (_OffTheCurve, ValueError):
        return None
    return points[root]
