"""Gaits over two parameters: curves of folds and flips, and the periods of attractors cell by cell.

A bifurcation is a gait at which a test function vanishes: P^n(z) = z and det(DP -+ 1) = 0, one more equation than for a
gait, with the second parameter as one more unknown. The curve is continued by arclength like a branch.

The cells are computed row by row of the second parameter, from the row of the known branches outwards. Newton's method
corrects the period-1 gait of each cell from its neighbours. A stable gait is the attractor; otherwise a walk from a
neighbouring cell's attractor, or from near the unstable gait, finds the attractor.

Source: Kuznetsov, Elements of applied bifurcation theory, section 10.3.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from walkerlab.orbits.attractors import settled
from walkerlab.orbits.bifurcations import Bifurcation, GaitEquations, Kind, critical_value, eigenvector
from walkerlab.orbits.continuation import Solved, StepControl, corrected, stepped
from walkerlab.orbits.families import EVALUATIONS, BranchEnd, GaitBranch, ValueSpan, why_lost
from walkerlab.orbits.newton import Effort, Equations, Evaluated, NotConverged
from walkerlab.orbits.step_map import Cycle, StepMap, gait_near
from walkerlab.outcome import Outcome
from walkerlab.solvers.system import Floats, Integers

REACH = 1e-5  # of the differences of the test function, unknowns being of magnitude one
CONTROL = StepControl(first=0.01, shortest=1e-6, longest=0.03, turn=0.97, tolerance=1e-11)
MAPS = 256  # of values of the second parameter, kept
CELLS = (72, 36)
NOTHING = -1  # no walk goes on
TRANSIENT, KEPT = 400, 96  # steps
SOLVED = Effort(1e-12, EVALUATIONS)  # gaits of cells
KICK = 1e-3  # away from an unstable gait, coordinates being of magnitude one


MapAt = Callable[[float], StepMap | None]
"""Step maps over the first parameter, by the value of the second; None where that makes no walker."""


class Plane(NamedTuple):
    """A second parameter: step maps over the first by its values, the span to cover, and the family's own value."""

    map_at: MapAt
    span: ValueSpan
    own: float


def critical_gaits(map_at: MapAt, kind: Kind, period: int, scales: tuple[float, float]) -> Equations[Cycle | None]:
    """Return P^n(z) - z = 0 and a test function over x = (z, first / its scale, second / its scale)."""
    maps = lru_cache(MAPS)(map_at)

    def gait(x: Floats) -> Evaluated[Cycle] | None:
        step_map = maps(float(x[-1]) * scales[1])
        found = None if step_map is None else GaitEquations(step_map, period, scales[0])(x[:-1])
        return None if found is None or found.outcome is not Outcome.WALKED else found

    def equations(x: Floats) -> Evaluated[Cycle | None]:
        """Evaluate residual and derivative at x (d + 2,), by differences along the second parameter only."""
        d, reach = x.size - 2, REACH * np.eye(x.size)
        beside = (gait(x + sign * unit) for unit in reach for sign in (1.0, -1.0))
        walked = [one for one in (gait(x), *beside) if one is not None]
        if len(walked) < 1 + 2 * x.size:
            return Evaluated(Outcome.NO_HEEL_STRIKE, np.zeros(d + 1), np.zeros((d + 1, d + 2)), None)
        here, tests = walked[0], np.array([critical_value(kind, one.data.DP) for one in walked])
        by_second = (walked[-2].value - walked[-1].value) / (2.0 * REACH)
        of_tests = (tests[1::2] - tests[2::2]) / (2.0 * REACH)
        jacobian = np.vstack((np.column_stack((here.jacobian, by_second)), of_tests))
        return Evaluated(Outcome.WALKED, np.append(here.value, tests[0]), jacobian, here.data)

    return equations


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """A curve of bifurcations over two parameters.

    first, second  (points,) values of the parameters along it
    ends           where and why it ends; `value` is the second parameter's
    """

    kind: Kind
    period: int
    first: Floats
    second: Floats
    ends: tuple[BranchEnd, BranchEnd]


def curve_through(
    bifurcation: Bifurcation, period: int, first: ValueSpan, plane: Plane, points: int,
    advance: Callable[[], None], control: StepControl,
) -> BifurcationCurve | None:  # fmt: skip
    """Follow the curve through a bifurcation located at the family's own second parameter; None if it is lost there.

    first   span of the first parameter; the curve is followed within it and the plane's
    points  maximum number in each direction
    """
    spans = (first, plane.span)
    scales = (spans[0].size, spans[1].size)
    equations = critical_gaits(plane.map_at, bifurcation.kind, period, scales)
    x = np.append(bifurcation.point.x, plane.own / scales[1])
    x[-2] = bifurcation.value / scales[0]
    start = corrected(equations, x, np.eye(x.size)[-1], control.tolerance)
    if isinstance(start, NotConverged):
        return None
    (behind, begin), (ahead, end) = (
        traced(equations, replace(start, tangent=sign * start.tangent), spans, points, advance, control)
        for sign in (-1.0, 1.0)
    )
    along = np.vstack((behind[::-1], ahead[1:]))
    return BifurcationCurve(bifurcation.kind, period, along[:, 0], along[:, 1], (begin, end))


def traced(
    equations: Equations[Cycle | None], start: Solved[Cycle | None], spans: tuple[ValueSpan, ValueSpan],
    points: int, advance: Callable[[], None], control: StepControl,
) -> tuple[Floats, BranchEnd]:  # fmt: skip
    """Return values (points, 2) of both parameters from a point along its tangent, and why the curve ends."""
    scales = np.array([span.size for span in spans])
    values, before, last, length = [start.x[-2:] * scales], None, start, control.first
    while len(values) < points:
        following = stepped(equations, last, length, control, before=before)
        if isinstance(following, NotConverged):
            return np.array(values), BranchEnd(float(values[-1][1]), why_lost(following))
        solved, length = following
        value = solved.x[-2:] * scales
        advance()
        if value[0] not in spans[0] or value[1] not in spans[1]:
            values.append(clipped(values[-1], value, spans))
            return np.array(values), BranchEnd(float(values[-1][1]), "end of the plane")
        values.append(value)
        before, last = last, solved
    return np.array(values), BranchEnd(float(values[-1][1]), f"{points} points are used up")


def clipped(inside: Floats, outside: Floats, spans: tuple[ValueSpan, ValueSpan]) -> Floats:
    """Return the last point inside the plane on a segment that leaves it."""
    share = 1.0
    for k, span in enumerate(spans):
        edge = span.least if outside[k] < span.least else span.most
        if outside[k] not in span:
            share = min(share, float((edge - inside[k]) / (outside[k] - inside[k])))
    return np.asarray(inside + share * (outside - inside))


# ---- what walks settle on, cell by cell ------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Regions:
    """Attractors over the plane, cell by cell.

    first, second  (n,), (m,) centres of the cells
    period         (n, m) steps after which the attractor repeats; 0 if never, NO_ATTRACTOR if every walk fails
    """

    first: Floats
    second: Floats
    period: Integers


Row = list[Cycle | None]
"""Gaits of one step, cell by cell."""
Points = list[Floats | None]


def regions_of(branches: Sequence[GaitBranch], span: ValueSpan, plane: Plane, advance: Callable[[], None]) -> Regions:
    """Find the attractors over the plane, starting from branches known over a span of the first parameter."""
    sides = zip((span, plane.span), CELLS, strict=True)
    first, second = (side.least + side.size * (np.arange(cells) + 0.5) / cells for side, cells in sides)
    period = np.full(CELLS, NOTHING, np.int64)
    begin = int(np.argmin(np.abs(second - plane.own)))
    known = known_gaits(branches, first)
    for order in (range(begin, CELLS[1]), range(begin - 1, -1, -1)):
        guesses = known
        points: Points = [None] * len(first)
        for row in order:
            step_map = plane.map_at(float(second[row]))
            if step_map is not None:
                gaits = corrected_row(step_map, first, guesses)
                guesses = [None if gait is None else gait.z for gait in gaits]
                period[:, row], points = settled_row(step_map, first, gaits, points)
            advance()
    return Regions(first, second, period)


def known_gaits(branches: Sequence[GaitBranch], values: Floats) -> Points:
    """Return for each value a period-1 gait interpolated from the branches, preferring stable ones."""
    found, stable = list[Floats | None]([None] * len(values)), np.zeros(len(values), bool)
    for branch in branches:
        if branch.period > 1:
            continue
        for one, other in pairwise(branch.points):
            low, high = sorted((one.value, other.value))
            for place in np.flatnonzero((values >= low) & (values <= high) & (low < high)):
                if found[place] is None or (one.stable and not stable[place]):
                    share = (values[place] - one.value) / (other.value - one.value)
                    found[place], stable[place] = one.z + share * (other.z - one.z), one.stable
    return found


def corrected_row(step_map: StepMap, values: Floats, before: Points) -> Row:
    """Solve for the gaits of a row of cells, from the previous row and from neighbours in the row."""
    row: Row = [None] * len(values)
    places = list(range(len(values)))
    for order, step in ((places, -1), (places[::-1], 1)):
        for place in order:
            neighbour = row[place + step] if 0 <= place + step < len(values) else None
            beside = None if neighbour is None else neighbour.z
            for guess in (before[place], beside) if step < 0 else (beside,):
                present = row[place]
                if guess is None or (present is not None and present.stable):
                    continue
                found = gait_near(step_map, guess, float(values[place]), SOLVED)
                if isinstance(found, Cycle) and (present is None or found.stable):
                    row[place] = found
    return row


def settled_row(step_map: StepMap, values: Floats, gaits: Row, before: Points) -> tuple[Integers, Points]:
    """Return the periods of a row's attractors and a point on each; `before` holds the previous row's points."""
    periods, points = np.full(len(values), NOTHING, np.int64), list[Floats | None]()
    for place, gait in enumerate(gaits):
        if gait is not None and gait.stable:
            periods[place] = 1
            points.append(gait.z)
            continue
        # on the attractors of its neighbours, and beside its unstable gait, towards what grows
        beside = None if gait is None else gait.z + KICK * eigenvector(gait.DP, gait.multipliers[0].real)
        point, starts = None, (points[place - 1] if place else None, before[place], beside)
        for start in (one for one in starts if one is not None):
            here = settled(step_map, start, float(values[place]), TRANSIENT, KEPT)
            if not isinstance(here, Outcome):
                periods[place], point = here.period, here.last
                break
        points.append(point)
    return periods, points
