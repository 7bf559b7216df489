"""Starts with scaled angular velocities: how far they may change, and the smallest change that walks.

In the paper both velocities were raised by hand until the contact model walked. Here a start is a pair of factors
(s_1, s_2) on the velocities of swing and stance leg; (1, 1) is the unchanged rigid start.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from walkerlab.ground.terrain import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import JudgedGround
from walkerlab.hybrid.contact_result import ContactWalkResult, walk_contact
from walkerlab.hybrid.recorded_walk import take_walk, with_scaled_rates
from walkerlab.mechanics.standing import Standing
from walkerlab.outcome import Outcome
from walkerlab.solvers.registry import ENDLESS, Tolerances
from walkerlab.solvers.stepping import RHS
from walkerlab.solvers.system import Floats, Integers, State

TOLERANCES = Tolerances("radau5", 1e-7, 1e-9, 10_000_000)
RIGID = Tolerances("dop853", 1e-7, 1e-9, ENDLESS)
SETTLED = 0.02  # of the gait's period and step length
MARGIN_STEP = 0.02  # how far apart factors are tried until one fails
SMALLEST_FACTOR, LARGEST_FACTOR = 0.0, 4.0
HALVINGS = 14
ZOOMS, ZOOM_CELLS = 4, 4  # grids ever finer around the best start, each so many cells to either side
OFFSETS = np.array(list(product(range(-ZOOM_CELLS, ZOOM_CELLS + 1), repeat=2)))


class StartTrial(NamedTuple):
    """Result of a walk from a scaled start."""

    outcome: int
    steps: int
    settled: bool  # whether its last step is the gait's, within two percent in period and length
    evaluations: int  # right-hand sides

    @property
    def walks(self) -> bool:
        """Whether the walk completed and settled."""
        return self.outcome == Outcome.WALKED and self.settled


@dataclass(frozen=True)
class ScaledStarts:
    """A scene and its start with scalable velocities."""

    walker: ContactWalker
    ground: JudgedGround
    place: State  # (2 + n) position and angles of the start
    by_swing: State  # (2 + n) velocities that the swing leg's angular velocity brings along
    by_stance: State  # (2 + n) and the stance leg's
    steps: int
    gait: tuple[float, float] | None  # period (s) and step length (m) to settle on; None if that is not asked
    tolerances: Tolerances = TOLERANCES

    def start(self, swing: float, stance: float) -> State:
        """Return the free walker's state with velocities scaled by these factors."""
        rates = (swing * a + stance * b for a, b in zip(self.by_swing, self.by_stance, strict=True))
        return (*self.place, *rates)

    def walk(self, swing: float, stance: float) -> StartTrial:
        walk = self.walked_from(self.start(swing, stance))
        settled = walk.outcome is Outcome.WALKED and (self.gait is None or self.settled_after(walk) is not None)
        return StartTrial(walk.outcome, walk.touch_time_s.size, settled, int(walk.work[RHS]))

    def walked_from(self, start: State) -> ContactWalkResult:
        return walk_contact(self.walker, self.ground, False, STANCE_FOOT, start, self.tolerances, self.steps, None)

    def settled_after(self, walk: ContactWalkResult) -> int | None:
        """Return the steps after which all periods and lengths match the gait; None if the last do not."""
        if self.gait is None:
            return None
        period, length = self.gait
        off_period, off_length = np.abs(walk.periods_s - period), np.abs(walk.lengths_m - length)
        off = np.flatnonzero((off_period > SETTLED * period) | (off_length > SETTLED * abs(length)))
        first = int(off[-1]) + 1 if off.size else 0
        return first if first < walk.periods_s.size else None

    def coarser(self, rtol: float, atol: float, budget: int) -> ScaledStarts:
        """Return the same starts at the lower accuracy of a map, without locating switching points."""
        quick = JudgedGround(self.ground.terrain, self.ground.frame._replace(locate_switching=False))
        return replace(self, ground=quick, tolerances=Tolerances(self.tolerances.method, rtol, atol, budget))


def scaled_starts(
    walker: ContactWalker,
    ground: JudgedGround,
    start_of: Callable[[float, float], State],
    steps: int,
    gait: tuple[float, float] | None,
) -> ScaledStarts:
    """Build the scaled starts of a scene.

    start_of  the free walker's start for factors on the two angular velocities; linear in them
    """
    still, swing, stance = start_of(0.0, 0.0), start_of(1.0, 0.0), start_of(0.0, 1.0)
    half = len(still) // 2
    return ScaledStarts(walker, ground, still[:half], swing[half:], stance[half:], steps, gait)


@dataclass(frozen=True)
class Margin:
    """How far a start may be scaled in one direction before it fails."""

    name: str  # which velocities are scaled, and whether down or up
    factor: float  # the last that walks
    fails: StartTrial | None  # what happens beyond; None if nothing fails up to the limit


DIRECTIONS = (
    ("dtheta_1 down", -1.0, 0.0),
    ("dtheta_1 up", 1.0, 0.0),
    ("dtheta_2 down", 0.0, -1.0),
    ("dtheta_2 up", 0.0, 1.0),
    ("both down", -1.0, -1.0),
    ("both up", 1.0, 1.0),
)


def margins(
    starts: ScaledStarts,
    around: tuple[float, float] = (1.0, 1.0),
    step: float = MARGIN_STEP,
    largest: float = LARGEST_FACTOR,
) -> list[Margin]:
    """Return how far the velocities of a start that walks may be scaled, alone and together, before it fails.

    step     spacing of factors until one fails; then the last interval is halved
    largest  maximum factor
    """
    found = []
    for name, *way in DIRECTIONS:
        sign = 1.0 if max(way) > 0.0 else -1.0
        limit = largest - 1.0 if sign > 0.0 else 1.0 - SMALLEST_FACTOR
        good, bad, failure, halvings = 0.0, limit, None, 0
        while good < limit and halvings <= HALVINGS:
            change = min(good + step, limit) if failure is None else 0.5 * (good + bad)
            tried = starts.walk(around[0] * (1.0 + change * way[0]), around[1] * (1.0 + change * way[1]))
            if tried.walks:
                good = change
            else:
                bad, failure = change, tried
            halvings += failure is not None
        found.append(Margin(name, 1.0 + sign * good, failure))
    return found


@dataclass(frozen=True)
class Adjustment:
    """The smallest change of the two velocities found to walk."""

    swing: float
    stance: float
    trial: StartTrial

    @property
    def distance(self) -> float:
        """Euclidean distance of the factors from (1, 1)."""
        return math.hypot(self.swing - 1.0, self.stance - 1.0)


def smallest_change(
    starts: ScaledStarts, quick: ScaledStarts, candidates: np.ndarray, cell: tuple[float, float]
) -> Adjustment | None:
    """Find the walking start nearest to (1, 1), on successively finer grids around the nearest in a map.

    starts      at the config's tolerances, which the result satisfies
    quick       at the map's tolerances
    candidates  (n, 2) factors that walk according to the map
    cell        spacing of the map
    """
    order = np.argsort(np.hypot(*(candidates - 1.0).T), kind="stable")
    for swing, stance in candidates[order]:
        if not starts.walk(float(swing), float(stance)).walks:
            continue
        best, spacing = (float(swing), float(stance)), np.array(cell)
        for _ in range(ZOOMS):
            spacing = spacing / ZOOM_CELLS
            grid = np.array(best) + spacing * OFFSETS
            distance = np.hypot(*(grid - 1.0).T)
            nearer = np.flatnonzero(distance < math.hypot(best[0] - 1.0, best[1] - 1.0) - 1e-12)
            nearest_first = grid[nearer[np.argsort(distance[nearer], kind="stable")]].tolist()
            both = ((a, b) for a, b in nearest_first if quick.walk(a, b).walks and starts.walk(a, b).walks)
            best = next(both, best)
        return Adjustment(*best, starts.walk(*best))
    return None


# ---- the map behind it: which scaled starts walk, on the ground and in the rigid model -------------------------------


@dataclass(frozen=True)
class StartMap:
    """Results over factors of both velocities; rows are factors of the stance leg."""

    swing: Floats  # (columns,) factors on the swing leg's velocity
    stance: Floats  # (rows,) factors on the stance leg's velocity
    outcome: Integers  # (rows, columns)
    steps: Integers  # (rows, columns)
    settled: Integers  # (rows, columns) 1 if the last step is the gait's

    @property
    def walking(self) -> Floats:
        """Factors (n, 2) of the cells that walk and settle."""
        rows, columns = np.nonzero((self.outcome == Outcome.WALKED) & (self.settled == 1))
        return np.column_stack((self.swing[columns], self.stance[rows]))

    def share(self) -> float:
        """Return the share of cells that walk and settle."""
        return float(self.walking.shape[0]) / self.outcome.size


def contact_row(starts: ScaledStarts, swing: Floats, stance: float) -> Integers:
    """Return outcome, steps and whether settled (columns, 3) for a row of cells."""
    trials = [starts.walk(float(factor), float(stance)) for factor in swing]
    return np.array([(trial.outcome, trial.steps, trial.settled) for trial in trials], np.int64)


def rigid_map(walker: Standing, state: State, swing: Floats, stance: Floats, steps: int) -> StartMap:
    """Compute the same map for the rigid model; where its ground would have to pull, the outcome is `lifted-off`."""

    def cell(factor_1: float, factor_2: float) -> tuple[int, int, bool]:
        walk = take_walk(walker, RIGID, with_scaled_rates(walker, state, factor_1, factor_2), steps)
        return int(walk.outcome), walk.steps, walk.steps == steps

    rows = [[cell(one, other) for one in swing.tolist()] for other in stance.tolist()]
    return as_map(swing, stance, list(np.array(rows, np.int64)))


def as_map(swing: Floats, stance: Floats, rows: Sequence[Integers]) -> StartMap:
    """Assemble the map from its rows (columns, 3)."""
    return StartMap(swing, stance, *np.moveaxis(np.stack(rows), 2, 0))
