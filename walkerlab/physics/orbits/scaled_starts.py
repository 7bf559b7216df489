"""Starts with scaled velocities: how far the velocities may change, and the smallest change that leads to walking.

In the paper both velocities were raised by hand until the contact model walked. In this module a start is a pair of
factors (s_1, s_2) applied to the velocities of swing and stance leg, and (1, 1) is the unchanged rigid start.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import ContactWalker
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, walk_contact
from walkerlab.physics.hybrid.contact_state import JudgedGround
from walkerlab.physics.hybrid.recorded_walk import scale_rates, take_walk
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.physics.solvers.stepping import RHS
from walkerlab.physics.solvers.system import Floats, Integers, State

START_TOLERANCES = Tolerances("radau5", 1e-7, 1e-9, 10_000_000)
RIGID_TOLERANCES = Tolerances("dop853", 1e-7, 1e-9, ENDLESS)
SETTLED_SHARE = 0.02  # largest deviation from the gait, as a fraction of its period and step length
MARGIN_STEP = 0.02  # spacing of the factors that are tried in turn until a walk fails
SMALLEST_FACTOR = 0.0
LARGEST_FACTOR = 4.0
MARGIN_HALVINGS = 14
# number of successively finer grids around the best start, and number of cells of each grid on each side of it
ZOOMS, ZOOM_CELLS = 4, 4
ZOOM_OFFSETS = np.array(list(product(range(-ZOOM_CELLS, ZOOM_CELLS + 1), repeat=2)))


class StartTrial(NamedTuple):
    outcome: int
    steps: int
    settled: bool  # whether the walk's last step matches the gait's period and length within 2 %
    evaluations: int  # number of right-hand-side evaluations

    @property
    def walks(self) -> bool:
        return self.outcome == Outcome.WALKED and self.settled


@dataclass(frozen=True)
class ScaledStarts:
    walker: ContactWalker
    ground: JudgedGround
    pose: State  # (2 + n) position and angles of the start
    by_swing: State  # (2 + n) velocities due to the swing leg's angular velocity
    by_stance: State  # (2 + n) velocities due to the stance leg's angular velocity
    steps: int
    # (period in s, length in m) of each step of the gait on which walks must settle, one pair if the legs are equal;
    # None if they need not settle
    gait: tuple[tuple[float, float], ...] | None
    tolerances: Tolerances = START_TOLERANCES

    def start(self, swing: float, stance: float) -> State:
        rates = (swing * a + stance * b for a, b in zip(self.by_swing, self.by_stance, strict=True))
        return (*self.pose, *rates)

    def walk(self, swing: float, stance: float) -> StartTrial:
        walk = self.walk_from(self.start(swing, stance))
        settled = walk.outcome is Outcome.WALKED and (self.gait is None or self.settling_steps(walk) is not None)
        return StartTrial(walk.outcome, walk.touch_time_s.size, settled, int(walk.work[RHS]))

    def walk_from(self, start: State) -> ContactWalkResult:
        return walk_contact(self.walker, self.ground, False, STANCE_FOOT, start, self.tolerances, self.steps, None)

    def settling_steps(self, walk: ContactWalkResult) -> int | None:
        """Return the number of steps after which periods and lengths match the gait.

        Returns None if the last step does not match.
        """
        if self.gait is None:
            return None
        # `np.resize` repeats the gait's steps as often as the walk needs.
        period, length = np.resize(self.gait, (walk.periods_s.size, 2)).T
        off_period = np.abs(walk.periods_s - period)
        off_length = np.abs(walk.lengths_m - length)
        off = np.flatnonzero((off_period > SETTLED_SHARE * period) | (off_length > SETTLED_SHARE * np.abs(length)))
        first = int(off[-1]) + 1 if off.size else 0
        return first if first < walk.periods_s.size else None

    def coarser(self, rtol: float, atol: float, budget: int) -> ScaledStarts:
        """Return the same starts with the looser tolerances of a map, and without locating switching points."""
        quick = JudgedGround(self.ground.terrain, self.ground.frame._replace(locate_switching=False))
        return replace(self, ground=quick, tolerances=Tolerances(self.tolerances.method, rtol, atol, budget))


def scaled_starts(
    walker: ContactWalker,
    ground: JudgedGround,
    start_of: Callable[[float, float], State],
    steps: int,
    gait: tuple[tuple[float, float], ...] | None,
) -> ScaledStarts:
    """Build the scaled starts of a scene. `start_of` is linear in the factors for the two angular velocities."""
    still = start_of(0.0, 0.0)
    swing = start_of(1.0, 0.0)
    stance = start_of(0.0, 1.0)
    half = len(still) // 2
    return ScaledStarts(walker, ground, still[:half], swing[half:], stance[half:], steps, gait)


@dataclass(frozen=True)
class Margin:
    name: str  # scaled velocities and direction of the change
    factor: float  # last factor at which the start leads to walking
    fails: StartTrial | None  # first failure beyond `factor`; None if there is none up to the limit


SCALING_DIRECTIONS = (
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
    """Find how far the velocities of a start may be scaled, separately and together, before the walker no longer walks.

    around   factors for the velocities of swing and stance leg that lead to walking
    largest  largest factor tried
    """
    # Factors are `step` apart until one fails. Then the last interval is bisected.
    results = []
    for name, *direction in SCALING_DIRECTIONS:
        sign = 1.0 if max(direction) > 0.0 else -1.0
        limit = largest - 1.0 if sign > 0.0 else 1.0 - SMALLEST_FACTOR
        good = 0.0
        bad = limit
        failure = None
        halvings = 0
        while good < limit and halvings <= MARGIN_HALVINGS:
            change = min(good + step, limit) if failure is None else 0.5 * (good + bad)
            trial = starts.walk(around[0] * (1.0 + change * direction[0]), around[1] * (1.0 + change * direction[1]))
            if trial.walks:
                good = change
            else:
                bad = change
                failure = trial
            # Only halvings count, not the steps before the first failure.
            halvings += failure is not None
        results.append(Margin(name, 1.0 + sign * good, failure))
    return results


@dataclass(frozen=True)
class Adjustment:
    swing: float
    stance: float
    trial: StartTrial

    @property
    def distance(self) -> float:
        return math.hypot(self.swing - 1.0, self.stance - 1.0)


def smallest_change(
    starts: ScaledStarts, quick: ScaledStarts, candidates: np.ndarray, cell: tuple[float, float]
) -> Adjustment | None:
    """Find the start nearest to (1, 1) that leads to walking, on finer and finer grids around the nearest candidate.

    starts      starts with the config's solver tolerances
    quick       the same starts with the map's tolerances; the result leads to walking with both
    candidates  (n, 2) factors of a map's cells that lead to walking
    cell        spacing of the map's cells
    """
    order = np.argsort(np.hypot(*(candidates - 1.0).T), kind="stable")
    for swing, stance in candidates[order]:
        if not starts.walk(float(swing), float(stance)).walks:
            continue
        best = (float(swing), float(stance))
        spacing = np.array(cell)
        for _ in range(ZOOMS):
            spacing = spacing / ZOOM_CELLS
            grid = np.array(best) + spacing * ZOOM_OFFSETS
            distance = np.hypot(*(grid - 1.0).T)
            nearer = np.flatnonzero(distance < math.hypot(best[0] - 1.0, best[1] - 1.0) - 1e-12)
            nearest_first = grid[nearer[np.argsort(distance[nearer], kind="stable")]].tolist()
            # Evaluate one point at a time, with the cheap walk first, because it already rules out most points.
            both = ((a, b) for a, b in nearest_first if quick.walk(a, b).walks and starts.walk(a, b).walks)
            best = next(both, best)
        return Adjustment(*best, starts.walk(*best))
    return None


# ---- map of scaled starts, in the contact model and in the rigid model -----------------------------------------------


@dataclass(frozen=True)
class StartMap:
    """Results of walks over factors for both velocities. A row has a single factor for the stance leg's velocity."""

    swing: Floats  # (columns,) factors for the swing leg's velocity
    stance: Floats  # (rows,) factors for the stance leg's velocity
    outcome: Integers  # (rows, columns)
    steps: Integers  # (rows, columns)
    settled: Integers  # (rows, columns) 1 if the last step matches the gait

    @property
    def walking(self) -> Floats:
        """Factors (n, 2) of the cells whose walk is completed and settles on the gait."""
        rows, columns = np.nonzero((self.outcome == Outcome.WALKED) & (self.settled == 1))
        return np.column_stack((self.swing[columns], self.stance[rows]))

    def share(self) -> float:
        return float(self.walking.shape[0]) / self.outcome.size


def contact_row(starts: ScaledStarts, swing: Floats, stance: float) -> Integers:
    trials = [starts.walk(float(factor), float(stance)) for factor in swing]
    return np.array([(trial.outcome, trial.steps, trial.settled) for trial in trials], np.int64)


def rigid_map(walker: RigidModel, state: State, swing: Floats, stance: Floats, steps: int) -> StartMap:
    """Compute the map of starts of the rigid model. If its ground would have to pull, the outcome is `lifted-off`."""

    def cell(factor_1: float, factor_2: float) -> tuple[int, int, bool]:
        walk = take_walk(walker, RIGID_TOLERANCES, scale_rates(walker, state, factor_1, factor_2), steps)
        return int(walk.outcome), walk.steps, walk.steps == steps

    rows = [[cell(swing_factor, stance_factor) for swing_factor in swing.tolist()] for stance_factor in stance.tolist()]
    return as_map(swing, stance, list(np.array(rows, np.int64)))


def as_map(swing: Floats, stance: Floats, rows: Sequence[Integers]) -> StartMap:
    return StartMap(swing, stance, *np.moveaxis(np.stack(rows), 2, 0))
