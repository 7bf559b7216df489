"""Walks from a start whose two angular velocities are scaled: how far each may change, and the least that walks.

The paper raised both velocities by hand until its contact model walked. Here a start is the pair of factors
(s_1, s_2) on the velocities of the swing and the stance leg, and (1, 1) is the rigid start as it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import EVENT_FUNCTIONS
from walkerlab.hybrid.contact_rules import STEPS
from walkerlab.hybrid.contact_run import JudgedGround, MethodSettings, balanced, new_observer, new_walk_state, walk_free
from walkerlab.hybrid.outcome import Outcome
from walkerlab.solvers.registry import finder_for, method_named
from walkerlab.solvers.system import State

METHOD = "radau5"
NEVER = -1
SETTLED = 0.02  # of the gait's period and step length
MARGIN_STEP = 0.02  # how far apart factors are tried until one fails
SMALLEST_FACTOR, LARGEST_FACTOR = 0.0, 4.0
HALVINGS = 14
ZOOMS, ZOOM_CELLS = 4, 4  # grids ever finer around the best start, each so many cells to either side


class StartTrial(NamedTuple):
    """How a walk from a scaled start went."""

    outcome: int
    steps: int
    settled: bool  # whether its last step is the gait's, within two percent in period and length
    evaluations: int  # right-hand sides

    @property
    def walks(self) -> bool:
        """Whether it took every step and settled."""
        return self.outcome == Outcome.WALKED and self.settled


class ScaledWalk(NamedTuple):
    """A walk's end and its touches."""

    outcome: int
    touch_time: np.ndarray  # (steps,) s
    touch_along: np.ndarray  # (steps,) m
    evaluations: int  # right-hand sides


@dataclass(frozen=True)
class ScaledStarts:
    """One scene, walked from its start with scaled velocities."""

    walker: ContactWalker
    ground: JudgedGround
    place: State  # (2 + n) position and angles of the start
    by_swing: State  # (2 + n) velocities that the swing leg's angular velocity brings along
    by_stance: State  # (2 + n) and the stance leg's
    steps: int
    gait: tuple[float, float] | None  # period (s) and step length (m) to settle on; None if that is not asked
    rtol: float = 1e-7
    atol: float = 1e-9
    budget: int = 10_000_000  # right-hand sides of a walk

    def start(self, swing: float, stance: float) -> State:
        """The free walker's state with the velocities scaled by these factors."""
        rates = (swing * a + stance * b for a, b in zip(self.by_swing, self.by_stance, strict=True))
        return (*self.place, *rates)

    def walk(self, swing: float, stance: float) -> StartTrial:
        """Walk from a scaled start."""
        walk = self.walked_from(self.start(swing, stance))
        settled = walk.outcome == Outcome.WALKED and self.is_settled(walk.touch_time, walk.touch_along)
        return StartTrial(walk.outcome, walk.touch_time.size, bool(settled), walk.evaluations)

    def walked_from(self, start: State) -> ScaledWalk:
        """Walk from a state of the free walker."""
        walk_state = new_walk_state(self.walker, self.ground.terrain, STANCE_FOOT, self.steps, start)
        observer = new_observer(self.walker, walk_state, start)
        methods = MethodSettings(method_named(METHOD), self.rtol, self.atol, self.budget)
        method = methods.of(self.walker)
        finder = finder_for(method, EVENT_FUNCTIONS)
        ended = walk_free(self.walker, self.ground, method, finder, observer, walk_state, 0.0, start, NEVER)
        outcome = balanced(ended, observer, methods)
        steps = int(walk_state.feet[STEPS])
        return ScaledWalk(
            int(outcome), walk_state.touch_time[:steps], walk_state.touch_along[:steps], int(method.counts[0])
        )

    def is_settled(self, touch_time: np.ndarray, touch_along: np.ndarray) -> bool:
        """Whether the last of a walk's steps is the gait's."""
        if self.gait is None:
            return True
        period, length = self.gait
        last_period = touch_time[-1] - (touch_time[-2] if touch_time.size > 1 else 0.0)
        last_length = touch_along[-1] - (touch_along[-2] if touch_along.size > 1 else 0.0)
        return bool(
            abs(last_period - period) <= SETTLED * period and abs(last_length - length) <= SETTLED * abs(length)
        )

    def coarser(self, rtol: float, atol: float, budget: int) -> ScaledStarts:
        """The same with other tolerances and no joins located: what a map can afford."""
        quick = JudgedGround(self.ground.terrain, self.ground.frame._replace(locate_switching=False))
        return replace(self, ground=quick, rtol=rtol, atol=atol, budget=budget)


def scaled_starts(
    walker: ContactWalker,
    ground: JudgedGround,
    start_of: Callable[[float, float], State],
    steps: int,
    gait: tuple[float, float] | None,
) -> ScaledStarts:
    """The scaled starts of a scene.

    start_of  the free walker's start for the two angular velocities' factors; linear in them
    """
    still, swing, stance = start_of(0.0, 0.0), start_of(1.0, 0.0), start_of(0.0, 1.0)
    half = len(still) // 2
    return ScaledStarts(walker, ground, still[:half], swing[half:], stance[half:], steps, gait)


@dataclass(frozen=True)
class Margin:
    """How far a start may be scaled one way before it fails."""

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


class MarginSearch(NamedTuple):
    """How margins are searched: how far apart factors are tried until one fails, and up to which factor."""

    step: float = MARGIN_STEP
    largest: float = LARGEST_FACTOR


FINE = MarginSearch()


def margins(
    starts: ScaledStarts, around: tuple[float, float] = (1.0, 1.0), search: MarginSearch = FINE
) -> list[Margin]:
    """How far the velocities of a start that walks may be scaled before it fails, alone and together."""
    return [margin(starts, around, name, (swing, stance), search) for name, swing, stance in DIRECTIONS]


def margin(
    starts: ScaledStarts, around: tuple[float, float], name: str, way: tuple[float, float], search: MarginSearch = FINE
) -> Margin:
    """Walk ever farther one way until it fails, then halve the last interval."""

    def trial(change: float) -> StartTrial:
        return starts.walk(around[0] * (1.0 + change * way[0]), around[1] * (1.0 + change * way[1]))

    up = max(way) > 0.0
    limit = search.largest - 1.0 if up else 1.0 - SMALLEST_FACTOR
    good, change = 0.0, 0.0
    while good < limit:
        change = min(good + search.step, limit)
        failure = trial(change)
        if not failure.walks:
            return halved(trial, name, good, change, failure, 1.0 if up else -1.0)
        good = change
    return Margin(name, 1.0 + (good if up else -good), None)


def halved(
    trial: Callable[[float], StartTrial], name: str, good: float, bad: float, failure: StartTrial, sign: float
) -> Margin:
    """The edge between a change that walks and one that fails."""
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        result = trial(middle)
        if result.walks:
            good = middle
        else:
            bad, failure = middle, result
    return Margin(name, 1.0 + sign * good, failure)


@dataclass(frozen=True)
class Adjustment:
    """The smallest change of the two velocities that was found to walk."""

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
    """The start nearest to (1, 1) that walks, from ever finer grids around the nearest that a map found.

    starts      walks at the config's tolerance: what is returned has walked there
    quick       the same at the map's
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
            best = nearest_that_walks(starts, quick, best, spacing)
        return Adjustment(*best, starts.walk(*best))
    return None


def nearest_that_walks(
    starts: ScaledStarts, quick: ScaledStarts, best: tuple[float, float], spacing: np.ndarray
) -> tuple[float, float]:
    """The point nearest to (1, 1) that walks, of a grid around the best so far."""
    offsets = np.arange(-ZOOM_CELLS, ZOOM_CELLS + 1)
    grid = np.array([np.array(best) + spacing * (i, j) for i in offsets for j in offsets])
    distance = np.hypot(*(grid - 1.0).T)
    nearer = np.flatnonzero(distance < math.hypot(best[0] - 1.0, best[1] - 1.0) - 1e-12)
    for index in nearer[np.argsort(distance[nearer], kind="stable")]:
        point = (float(grid[index, 0]), float(grid[index, 1]))
        if quick.walk(*point).walks and starts.walk(*point).walks:
            return point
    return best
