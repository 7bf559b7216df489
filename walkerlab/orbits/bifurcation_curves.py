"""Curves of folds and flips over a plane of two parameters, followed as bifurcations themselves.

A bifurcation is a gait whose test function vanishes: P^n(z) = z and det(DP -+ 1) = 0, one equation more than for a
gait, in one unknown more, the second parameter. The curve is continued by arclength like a branch.

Source: Kuznetsov, Elements of applied bifurcation theory, section 10.3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from walkerlab.hybrid.outcome import Outcome
from walkerlab.orbits.bifurcations import Bifurcation, Kind, critical_value
from walkerlab.orbits.continuation import (
    Evaluated,
    Floats,
    NotConverged,
    Solved,
    StepControl,
    corrected,
    stepped,
)
from walkerlab.orbits.families import BranchEnd, ValueSpan, why_lost
from walkerlab.orbits.step_maps import IteratedMap, StepMap, walk_steps

REACH = 1e-5  # of the differences of the test function, unknowns being of magnitude one
CONTROL = StepControl(first=0.01, shortest=1e-6, longest=0.03, turn=0.97, tolerance=1e-11)
MAPS = 256  # of values of the second parameter, kept


class MapAt(Protocol):
    """Step maps over the first parameter, by the value of the second."""

    def __call__(self, second: float) -> StepMap | None:
        """The map; None where the second parameter makes no walker."""


class CriticalGaits:
    """P^n(z) - z = 0 and a test function, over x = (z, first / its scale, second / its scale)."""

    def __init__(self, map_at: MapAt, kind: Kind, period: int, scales: tuple[float, float]) -> None:
        """Bifurcations of a kind of gaits of `period` steps."""
        self._map_at = lru_cache(MAPS)(map_at)
        self.kind, self.period, self.scales = kind, period, scales

    def cycle(self, x: Floats) -> IteratedMap | None:
        """The steps from x; None where there is no walker or the walk ends."""
        step_map = self._map_at(float(x[-1]) * self.scales[1])
        if step_map is None:
            return None
        cycle = walk_steps(step_map, x[:-2], float(x[-2]) * self.scales[0], self.period)
        return cycle if cycle.outcome is Outcome.WALKED else None

    def at(self, x: Floats) -> Evaluated[IteratedMap | None]:
        """Residual and derivative at x (d + 2,); of the gait exact but along the second parameter."""
        d = x.size - 2
        here = self.cycle(x)
        beside = [[self.cycle(x + sign * REACH * unit) for sign in (1.0, -1.0)] for unit in np.eye(x.size)]
        if here is None or any(cycle is None for pair in beside for cycle in pair):
            return Evaluated(Outcome.NO_HEEL_STRIKE, np.zeros(d + 1), np.zeros((d + 1, d + 2)), None)
        jacobian = np.zeros((d + 1, d + 2))
        jacobian[:d, :d] = here.DP - np.eye(d)
        jacobian[:d, d] = self.scales[0] * here.Dp
        for column, (up, down) in enumerate(beside):
            assert up is not None
            assert down is not None
            jacobian[d, column] = (critical_value(self.kind, up.DP) - critical_value(self.kind, down.DP)) / (
                2.0 * REACH
            )
            if column == d + 1:
                jacobian[:d, column] = (up.z - down.z) / (2.0 * REACH)
        value = np.append(here.z - x[:d], critical_value(self.kind, here.DP))
        return Evaluated(Outcome.WALKED, value, jacobian, here)


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """A curve of bifurcations over the plane.

    first, second  (points,) values of the parameters along it
    ends           where and why it ends; `value` is that of the second parameter
    """

    kind: Kind
    period: int
    first: Floats
    second: Floats
    ends: tuple[BranchEnd, BranchEnd]


def curve_through(
    bifurcation: Bifurcation,
    period: int,
    map_at: MapAt,
    spans: tuple[ValueSpan, ValueSpan],
    second: float,
    points: int,
    advance: Callable[[], None] = lambda: None,
    control: StepControl = CONTROL,
) -> BifurcationCurve | None:
    """The curve through a bifurcation that was located at a value of the second parameter; None if it is lost there.

    spans   of both parameters: the curve is followed inside
    points  at most, each way
    """
    scales = (spans[0].size, spans[1].size)
    equations = CriticalGaits(map_at, bifurcation.kind, period, scales)
    x = np.append(bifurcation.point.x, second / scales[1])
    x[-2] = bifurcation.value / scales[0]
    at_second = np.append(np.zeros(x.size - 1), 1.0)
    start = corrected(equations, x, at_second, control.tolerance)
    if isinstance(start, NotConverged):
        return None
    halves = [
        traced(equations, replace(start, tangent=sign * start.tangent), spans, points, advance, control)
        for sign in (-1.0, 1.0)
    ]
    along = np.vstack((halves[0][0][::-1], halves[1][0][1:]))
    return BifurcationCurve(bifurcation.kind, period, along[:, 0], along[:, 1], (halves[0][1], halves[1][1]))


def traced(
    equations: CriticalGaits, start: Solved[IteratedMap | None], spans: tuple[ValueSpan, ValueSpan], points: int,
    advance: Callable[[], None], control: StepControl,
) -> tuple[Floats, BranchEnd]:  # fmt: skip
    """Values (points, 2) of both parameters from a point along its tangent, and why they end."""
    scales = np.array(equations.scales)
    values, before, last, length = [start.x[-2:] * scales], None, start, control.first
    while len(values) < points:
        following = stepped(equations, last, length, control, before=before)
        if isinstance(following, NotConverged):
            return np.array(values), BranchEnd(float(values[-1][1]), why_lost(following))
        solved, _, length = following
        value = solved.x[-2:] * scales
        advance()
        if value[0] not in spans[0] or value[1] not in spans[1]:
            values.append(clipped(values[-1], value, spans))
            return np.array(values), BranchEnd(float(values[-1][1]), "end of the plane")
        values.append(value)
        before, last = last, solved
    return np.array(values), BranchEnd(float(values[-1][1]), f"{points} points are used up")


def clipped(inside: Floats, outside: Floats, spans: tuple[ValueSpan, ValueSpan]) -> Floats:
    """The last point on the way out of the plane."""
    share = 1.0
    for k, span in enumerate(spans):
        edge = span.least if outside[k] < span.least else span.most
        if outside[k] not in span:
            share = min(share, float((edge - inside[k]) / (outside[k] - inside[k])))
    return np.asarray(inside + share * (outside - inside))
