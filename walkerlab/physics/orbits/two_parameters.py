"""Gaits as functions of two parameters: curves of folds and flips, and the attractor's period in each grid cell.

A bifurcation is a gait at which a test function vanishes: P^n(z) = z and det(DP -+ 1) = 0, one more equation than for a
gait, with the second parameter as one more unknown. The curve is continued by arclength like a branch.

Cells are computed in rows of equal second parameter, outwards from the row of the known branches. Newton's method finds
the period-1 gait of each cell from the gaits of its neighbours. A stable gait is the attractor. Otherwise a walk from
the attractor of a neighbouring cell, or from near the unstable gait, finds the attractor.

Source: Kuznetsov, Elements of applied bifurcation theory, section 10.3.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.attractors import settle
from walkerlab.physics.orbits.bifurcations import Bifurcation, GaitEquations, Kind, critical_value, eigenvector
from walkerlab.physics.orbits.continuation import CurvePoint, StepControl, correct, step_along
from walkerlab.physics.orbits.families import SEED_EVALUATIONS, BranchEnd, GaitBranch, ValueSpan, describe_loss
from walkerlab.physics.orbits.newton import Effort, Equations, Evaluated, NotConverged
from walkerlab.physics.orbits.step_map import Cycle, StepMap, gait_near
from walkerlab.physics.solvers.system import Floats, Integers

# difference step for the test function, for unknowns of magnitude one
DIFFERENCE_STEP = 1e-5
CURVE_CONTROL = StepControl(first=0.01, shortest=1e-6, longest=0.03, turn=0.97, tolerance=1e-11)
CACHED_MAPS = 256  # maps cached, one for each value of the second parameter
PLANE_CELLS = (72, 36)
ALL_FAILED = -1  # period of a cell in which every walk fails
TRANSIENT_STEPS, KEPT_STEPS = 400, 96  # number of steps that are dropped, and of steps that are examined
CELL_EFFORT = Effort(1e-12, SEED_EVALUATIONS)  # accuracy of a cell's gait
# offset from an unstable gait, for coordinates of magnitude one
UNSTABLE_OFFSET = 1e-3


# Returns the step map, a function of the first parameter, at a value of the second, or None if there is no valid
# walker.
MapAt = Callable[[float], StepMap | None]


class Plane(NamedTuple):
    """Second parameter of a family: the step map as a function of it, its span, and its value in the family."""

    map_at: MapAt
    span: ValueSpan
    value: float


def critical_gaits(map_at: MapAt, kind: Kind, period: int, scales: tuple[float, float]) -> Equations[Cycle | None]:
    """Return the equations P^n(z) = z and test function = 0 in the unknowns x = (z, first / scale, second / scale)."""
    maps = lru_cache(CACHED_MAPS)(map_at)

    def gait(x: Floats) -> Evaluated[Cycle] | None:
        step_map = maps(float(x[-1]) * scales[1])
        evaluated = None if step_map is None else GaitEquations(step_map, period, scales[0])(x[:-1])
        return None if evaluated is None or evaluated.outcome is not Outcome.WALKED else evaluated

    def equations(x: Floats) -> Evaluated[Cycle | None]:
        d = x.size - 2
        reach = DIFFERENCE_STEP * np.eye(x.size)
        neighbours = (gait(x + sign * unit) for unit in reach for sign in (1.0, -1.0))
        points = [point for point in (gait(x), *neighbours) if point is not None]
        # The differences below rely on the order of the neighbours, so none may be missing.
        if len(points) < 1 + 2 * x.size:
            return Evaluated(Outcome.NO_HEEL_STRIKE, np.zeros(d + 1), np.zeros((d + 1, d + 2)), None)
        centre = points[0]
        tests = np.array([critical_value(kind, point.data.DP) for point in points])
        by_second = (points[-2].value - points[-1].value) / (2.0 * DIFFERENCE_STEP)
        of_tests = (tests[1::2] - tests[2::2]) / (2.0 * DIFFERENCE_STEP)
        jacobian = np.vstack((np.column_stack((centre.jacobian, by_second)), of_tests))
        return Evaluated(Outcome.WALKED, np.append(centre.value, tests[0]), jacobian, centre.data)

    return equations


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    kind: Kind
    period: int
    first: Floats  # (points,) values of the first parameter
    second: Floats  # (points,) values of the second parameter
    ends: tuple[BranchEnd, BranchEnd]  # where and why the curve ends; `value` is a value of the second parameter


def follow_curve(
    bifurcation: Bifurcation, period: int, first: ValueSpan, plane: Plane, points: int,
    advance: Callable[[], None], control: StepControl,
) -> BifurcationCurve | None:  # fmt: skip
    """Follow the curve through a bifurcation both ways, within both spans and up to `points` points each way.

    Returns None if no point of the curve is found.
    """
    spans = (first, plane.span)
    scales = (spans[0].size, spans[1].size)
    equations = critical_gaits(plane.map_at, bifurcation.kind, period, scales)
    x = np.append(bifurcation.point.x, plane.value / scales[1])
    x[-2] = bifurcation.value / scales[0]
    start = correct(equations, x, np.eye(x.size)[-1], Effort(control.tolerance))
    if isinstance(start, NotConverged):
        return None
    (behind, begin), (ahead, end) = (
        trace_curve(equations, replace(start, tangent=sign * start.tangent), spans, points, advance, control)
        for sign in (-1.0, 1.0)
    )
    along = np.vstack((behind[::-1], ahead[1:]))
    return BifurcationCurve(bifurcation.kind, period, along[:, 0], along[:, 1], (begin, end))


def trace_curve(
    equations: Equations[Cycle | None], start: CurvePoint[Cycle | None], spans: tuple[ValueSpan, ValueSpan],
    points: int, advance: Callable[[], None], control: StepControl,
) -> tuple[Floats, BranchEnd]:  # fmt: skip
    scales = np.array([span.size for span in spans])
    values = [start.x[-2:] * scales]
    before = None
    last = start
    length = control.first
    while len(values) < points:
        following = step_along(equations, last, length, control, before=before)
        if isinstance(following, NotConverged):
            return np.array(values), BranchEnd(float(values[-1][1]), describe_loss(following))
        solved, length = following
        value = solved.x[-2:] * scales
        advance()
        if value[0] not in spans[0] or value[1] not in spans[1]:
            values.append(clip_to_plane(values[-1], value, spans))
            return np.array(values), BranchEnd(float(values[-1][1]), "end of the plane")
        values.append(value)
        before = last
        last = solved
    return np.array(values), BranchEnd(float(values[-1][1]), f"the limit of {points} points is reached")


def clip_to_plane(inside: Floats, outside: Floats, spans: tuple[ValueSpan, ValueSpan]) -> Floats:
    share = 1.0
    for k, span in enumerate(spans):
        edge = span.least if outside[k] < span.least else span.most
        if outside[k] not in span:
            share = min(share, float((edge - inside[k]) / (outside[k] - inside[k])))
    return np.asarray(inside + share * (outside - inside))


# ---- attractors, cell by cell ----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Regions:
    first: Floats  # (n,) values of the first parameter at the centres of the cells
    second: Floats  # (m,) values of the second parameter there
    period: Integers  # (n, m) steps after which the attractor repeats; 0 if never, ALL_FAILED if every walk fails


# Period-1 gait of each cell in a row, and a section point for each cell; None for a cell without one.
Row = list[Cycle | None]
Points = list[Floats | None]


def find_regions(branches: Sequence[GaitBranch], span: ValueSpan, plane: Plane, advance: Callable[[], None]) -> Regions:
    sides = zip((span, plane.span), PLANE_CELLS, strict=True)
    first, second = (side.least + side.size * (np.arange(cells) + 0.5) / cells for side, cells in sides)
    period = np.full(PLANE_CELLS, ALL_FAILED, np.int64)
    begin = int(np.argmin(np.abs(second - plane.value)))
    interpolated = interpolate_gaits(branches, first)
    for order in (range(begin, PLANE_CELLS[1]), range(begin - 1, -1, -1)):
        guesses = interpolated
        points: Points = [None] * len(first)
        for row in order:
            step_map = plane.map_at(float(second[row]))
            if step_map is not None:
                gaits = correct_row(step_map, first, guesses)
                guesses = [None if gait is None else gait.z for gait in gaits]
                period[:, row], points = settle_row(step_map, first, gaits, points)
            advance()
    return Regions(first, second, period)


def interpolate_gaits(branches: Sequence[GaitBranch], values: Floats) -> Points:
    """Interpolate a period-1 gait, if possible a stable one, from the branches at each value. None means no gait."""
    gaits = list[Floats | None]([None] * len(values))
    stable = np.zeros(len(values), bool)
    for branch in branches:
        if branch.period > 1:
            continue
        for index, value in enumerate(values.tolist()):
            for first, z in branch.passing(value):
                if gaits[index] is None or (first.stable and not stable[index]):
                    gaits[index], stable[index] = z, first.stable
    return gaits


def correct_row(step_map: StepMap, values: Floats, before: Points) -> Row:
    row: Row = [None] * len(values)
    indices = list(range(len(values)))
    for order, step in ((indices, -1), (indices[::-1], 1)):
        for index in order:
            neighbour = row[index + step] if 0 <= index + step < len(values) else None
            neighbour_z = None if neighbour is None else neighbour.z
            for guess in (before[index], neighbour_z) if step < 0 else (neighbour_z,):
                present = row[index]
                if guess is None or (present is not None and present.stable):
                    continue
                gait = gait_near(step_map, guess, float(values[index]), CELL_EFFORT)
                if isinstance(gait, Cycle) and (present is None or gait.stable):
                    row[index] = gait
    return row


def settle_row(step_map: StepMap, values: Floats, gaits: Row, before: Points) -> tuple[Integers, Points]:
    """Return the periods of the attractors in a row of cells, and a point on each.

    gaits   period-1 gait of each cell
    before  points on the attractors of the previous row
    """
    periods = np.full(len(values), ALL_FAILED, np.int64)
    points = list[Floats | None]()
    for index, gait in enumerate(gaits):
        if gait is not None and gait.stable:
            periods[index] = 1
            points.append(gait.z)
            continue
        # Start on the attractors of neighbouring cells, then near the cell's unstable gait, displaced in the direction
        # in which disturbances grow.
        off_gait = None if gait is None else gait.z + UNSTABLE_OFFSET * eigenvector(gait.DP, gait.multipliers[0])
        point = None
        starts = (points[index - 1] if index else None, before[index], off_gait)
        for start in (start for start in starts if start is not None):
            settled = settle(step_map, start, float(values[index]), TRANSIENT_STEPS, KEPT_STEPS)
            if not isinstance(settled, Outcome):
                periods[index], point = settled.period, settled.last
                break
        points.append(point)
    return periods, points
