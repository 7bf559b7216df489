"""Following a gait from a vanishing slope to the slope that is asked for."""

from typing import NamedTuple

import numpy as np

from walkerlab.hybrid.outcome import Outcome
from walkerlab.mechanics.standing import on_slope
from walkerlab.orbits.small_slope import SmallSlopeSeed, Vector
from walkerlab.orbits.step_map import Shooting, newton

WIDEST_STRIDE, NARROWEST_STRIDE = 1.6, 1.001  # from one slope to the next, as ratio of cube roots
REMEMBERED = 3  # points that the next one is extrapolated from
JUMP = 0.02  # a gait further than this from where it was expected is another gait
SLACK = 1e-8  # residual that is good enough on the way, relative; a multiplier tends to 1 as the slope vanishes
RETREATS = 5  # halvings of the seed's amplitude, whose error shrinks with the amplitude's square


Points = tuple[tuple[float, Vector], ...]  # s^2 and y, the latest last


class Reached(NamedTuple):
    """How far a gait could be followed."""

    slope: float  # rad
    z: Vector | None  # (3,) at the slope asked for; None if the gait was lost before


class Way(NamedTuple):
    """How far a gait was followed, and how it goes on from there."""

    reached: float  # s of the last gait
    ratio: float  # of the next s to it
    points: Points


class SlopeBranch:
    """A gait as a function of the slope: y = (theta_2 + phi, dtheta_1, dtheta_2) / s and T over s^2, s = phi^(1/3).

    In s^2 both gaits of the small-slope theory are smooth, and polynomials through the last points foretell the next.
    The way to a slope begins as the way to any steeper one does; that part of it is walked once and remembered.
    """

    def __init__(self, shooting: Shooting, seed: SmallSlopeSeed) -> None:
        """Start from a seed; `shooting` is for the seed's walker, on whatever slope."""
        self.shooting = shooting
        self.seed = seed
        self.limit = ((0.0, np.array([*seed.limit, seed.period])),)
        self.remembered: list[Way] = []

    def follow(self, slope: float) -> Reached:
        """The gait at `slope` > 0 (rad), in steps that adapt to how well it is foretold."""
        target, seed = float(np.cbrt(slope)), float(np.cbrt(self.seed.slope))
        way = self._begin(target) if target <= seed else self._common(seed, target)
        if way is None:
            return Reached(0.0, None)
        while way.reached < target:
            if way.ratio < NARROWEST_STRIDE:
                return Reached(way.reached**3, None)
            way = self._tried(way, min(target, way.ratio * way.reached))
        return Reached(slope, self._state(target, way.points[-1][1]))

    def _common(self, seed: float, target: float) -> Way | None:
        """What the way from the seed's s to the target has in common with ways further on; None if it has no start."""
        if not self.remembered:
            begun = self._begin(seed)
            if begun is None:
                return None
            self.remembered.append(begun)
        for way in self.remembered:
            following = way.ratio * way.reached
            if following >= target or way.ratio < NARROWEST_STRIDE:
                break
            if way is self.remembered[-1]:
                self.remembered.append(self._tried(way, following))
        return way

    def _begin(self, s: float) -> Way | None:
        """Take the first gait at s or, where the seed is too rough for that, nearer to its limit; None if nowhere."""
        for _ in range(RETREATS + 1):
            points = self._corrected(self.limit, s)
            if points is not None:
                return Way(s, WIDEST_STRIDE, points)
            s *= 0.5
        return None

    def _tried(self, way: Way, s: float) -> Way:
        """On to s with a wider stride, or where the gait is not found there the same place with a narrower one."""
        points = self._corrected(way.points, s)
        if points is None:
            return way._replace(ratio=way.ratio**0.5)
        return Way(s, min(WIDEST_STRIDE, way.ratio**1.5), points)

    def _corrected(self, points: Points, s: float) -> Points | None:
        """The last points and the gait at s, if Newton's method finds it near where it is expected."""
        expected = self._expected(points, s)
        z = self._state(s, expected)
        shooting = self.shooting._replace(walker=on_slope(self.shooting.walker, s**3))
        status, period, residual, _ = newton(shooting, z, SLACK * s)
        if status != Outcome.WALKED or residual > 100.0 * SLACK * s:
            return None
        found = scaled(s, z, period)
        moved = np.abs(found - expected)
        if moved[:3].max() > JUMP * np.abs(found[:3]).max() or moved[3] > JUMP * period:
            return None
        return (*points[1 - REMEMBERED :], (s * s, found))

    def _expected(self, points: Points, s: float) -> Vector:
        """The polynomial through the points at s; the seed itself while there is nothing but the limit."""
        if len(points) == 1:
            s_seed = float(np.cbrt(self.seed.slope))
            points = (*points, (s_seed**2, scaled(s_seed, self.seed.z, self.seed.period)))
        return interpolated(points, s * s)

    @staticmethod
    def _state(s: float, y: Vector) -> Vector:
        return np.array([s * y[0] - s**3, s * y[1], s * y[2]])


def scaled(s: float, z: Vector, period: float) -> Vector:
    """The point (y, T) of a gait at s."""
    return np.array([(z[0] + s**3) / s, z[1] / s, z[2] / s, period])


def interpolated(points: Points, x: float) -> Vector:
    """Value at x of the polynomial through `points` (Lagrange)."""
    total = np.zeros_like(points[0][1])
    for i, (x_i, y_i) in enumerate(points):
        weight = 1.0
        for j, (x_j, _) in enumerate(points):
            if j != i:
                weight *= (x - x_j) / (x_i - x_j)
        total += weight * y_i
    return total
