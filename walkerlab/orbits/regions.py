"""What walks settle on over a plane of two parameters, cell by cell.

Row by row of the second parameter, from the row that the branches are known on, the gait of one step is corrected from
its neighbours' by Newton's method. Where it is stable walks settle on it; where it is not, or there is none, a walk
from the attractor of a neighbouring cell, or from beside the gait, tells what they settle on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.hybrid.outcome import Outcome
from walkerlab.orbits.attractors import settled
from walkerlab.orbits.bifurcation_curves import MapAt
from walkerlab.orbits.bifurcations import eigenvector
from walkerlab.orbits.continuation import Floats
from walkerlab.orbits.families import BranchFollower, GaitBranch, ValueSpan
from walkerlab.orbits.step_maps import StepMap, multipliers_of

CELLS = (72, 36)
NOTHING = -1  # no walk goes on
TRANSIENT, KEPT = 400, 96  # steps
KICK = 1e-3  # away from an unstable gait, coordinates being of magnitude one


@dataclass(frozen=True, eq=False)
class Regions:
    """The plane in cells.

    first, second  (n,), (m,) middles of the cells
    period         (n, m) steps after which walks that settled repeat themselves; 0 never, NOTHING if none goes on
    """

    first: Floats
    second: Floats
    period: NDArray[np.int64]


class CellGait(NamedTuple):
    """A gait of one step at a cell."""

    z: Floats
    stable: bool
    away: Floats  # (d,) a start beside it, towards what grows


Row = list[CellGait | None]
Points = list[Floats | None]


def regions_of(
    branches: Sequence[GaitBranch],
    map_at: MapAt,
    spans: tuple[ValueSpan, ValueSpan],
    own: float,
    advance: Callable[[], None],
) -> Regions:
    """The regions of the plane around branches that were followed at the value `own` of the second parameter."""
    first, second = (middles(span, cells) for span, cells in zip(spans, CELLS, strict=True))
    period = np.full(CELLS, NOTHING, np.int64)
    begin = int(np.argmin(np.abs(second - own)))
    known = known_gaits(branches, first)
    for order in (range(begin, CELLS[1]), range(begin - 1, -1, -1)):
        gaits: Row = known
        points: Points = [None] * len(first)
        for row in order:
            step_map = map_at(float(second[row]))
            if step_map is not None:
                gaits = corrected_row(BranchFollower(step_map, spans[0]), first, gaits)
                period[:, row], points = settled_row(step_map, first, gaits, points)
            advance()
    return Regions(first, second, period)


def middles(span: ValueSpan, cells: int) -> Floats:
    """Middles of equal cells of a span."""
    return span.least + span.size * (np.arange(cells) + 0.5) / cells


def known_gaits(branches: Sequence[GaitBranch], values: Floats) -> Row:
    """Near each value a gait of one step from the branches, a stable one if there is one."""
    found: Row = [None] * len(values)
    for branch in branches:
        if branch.period > 1:
            continue
        for one, other in pairwise(branch.points):
            low, high = sorted((one.value, other.value))
            for place in np.flatnonzero((values >= low) & (values <= high) & (low < high)):
                share = (values[place] - one.value) / (other.value - one.value)
                z = one.z + share * (other.z - one.z)
                present = found[place]
                if present is None or (one.stable and not present.stable):
                    found[place] = CellGait(z, one.stable, z)
    return found


def corrected_row(follower: BranchFollower, values: Floats, before: Row) -> Row:
    """The gaits at the cells of a row, from those of the row before and from neighbours in the row itself."""
    row: Row = [None] * len(values)
    forwards, backwards = range(len(values)), range(len(values) - 1, -1, -1)
    for order, step in ((forwards, -1), (backwards, 1)):
        for place in order:
            present = row[place]
            if present is not None and present.stable:
                continue
            beside = row[place + step] if 0 <= place + step < len(values) else None
            guesses = (before[place], beside) if step < 0 else (beside,)
            for guess in guesses:
                found = None if guess is None else gait_near(follower, guess.z, float(values[place]))
                if found is not None and (present is None or found.stable):
                    row[place] = present = found
                if present is not None and present.stable:
                    break
    return row


def gait_near(follower: BranchFollower, z: Floats, value: float) -> CellGait | None:
    """The gait of one step that Newton's method finds from z."""
    solved = follower.solved_at(z, value, 1)
    if solved is None:
        return None
    DP, gait = solved.evaluated.data.DP, solved.x[:-1]
    largest = multipliers_of(DP)[0]
    return CellGait(gait, bool(abs(largest) < 1.0), gait + KICK * eigenvector(DP, largest.real))


def settled_row(step_map: StepMap, values: Floats, gaits: Row, before: Points) -> tuple[NDArray[np.int64], Points]:
    """The periods of a row's cells, and a point of the attractor in each.

    before  those of the row before
    """
    periods, points = np.full(len(values), NOTHING, np.int64), list[Floats | None]()
    for place, gait in enumerate(gaits):
        if gait is not None and gait.stable:
            periods[place] = 1
            points.append(gait.z)
            continue
        point = None
        for start in starts_at(place, gait, points, before):
            here = settled(step_map, start, float(values[place]), TRANSIENT, KEPT)
            if not isinstance(here, Outcome):
                periods[place], point = here.period, here.last
                break
        points.append(point)
    return periods, points


def starts_at(place: int, gait: CellGait | None, points: Points, before: Points) -> Iterator[Floats]:
    """Where walks begin at a cell: on the attractors of its neighbours, and beside its unstable gait."""
    candidates = (points[place - 1] if place else None, before[place], None if gait is None else gait.away)
    yield from (start for start in candidates if start is not None)
