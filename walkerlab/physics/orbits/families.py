"""Families of gaits over a parameter: branches, their bifurcations, and the cascades beyond their flips.

A branch is followed from a gait in both directions until it leaves the span or is lost. At each flip, the search
switches to the branch of twice the period: it moves along the eigenvector of the multiplier -1, by an amplitude from
the flip's normal form.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from walkerlab.outcome import OUTCOME_TEXTS, Outcome
from walkerlab.physics.orbits import bifurcations
from walkerlab.physics.orbits.bifurcations import BIFURCATION_KINDS, Bifurcation, GaitEquations, locate_bifurcation
from walkerlab.physics.orbits.continuation import CurvePoint, Segment, StepControl, correct, step_along
from walkerlab.physics.orbits.newton import Effort, NotConverged
from walkerlab.physics.orbits.step_map import Cycle, Monitor, StepMap, gait_near
from walkerlab.physics.solvers.system import Floats

SAME_STATE = 1e-6  # states closer than this count as equal
AMPLITUDE_HALVINGS = 12  # halvings of the amplitude when entering a doubled branch
MAX_MULTIPLIER_CHANGE = 0.6  # largest change of a multiplier near the unit circle from one point to the next
CRITICAL_RANGE = 1.6  # multipliers are near the unit circle if their magnitude or its inverse is below this
SEED_EVALUATIONS = 20  # maximum number of evaluations when Newton's method starts from a seed
CLOSED_LOOP = "returns to its first point"
NO_WALKER = "the parameter's next value gives no valid walker"
END_OF_SPAN = "end of the span"
EDGE_TOLERANCE = 1e-12  # values closer than this to an edge, relative to the size of the span, count as on it
# maximum number of points per branch, and maximum growth of a disturbance per cycle for which gaits can be resolved
MAX_BRANCH_POINTS = 400
MAX_CYCLE_GROWTH = 1e4


@dataclass(frozen=True)
class ValueSpan:
    least: float
    most: float

    @property
    def size(self) -> float:
        return self.most - self.least

    def __contains__(self, value: float) -> bool:
        return self.least <= value <= self.most

    def nearest(self, value: float) -> float:
        return min(max(value, self.least), self.most)


@dataclass(frozen=True)
class BranchEnd:
    value: float
    reason: str
    closes: bool = False  # whether the branch closes on the gait of half its period


@dataclass(frozen=True)
class Crossing:
    """Value on a branch at which a monitored quantity crosses its limit."""

    monitor: Monitor
    value: float


@dataclass(frozen=True, eq=False)
class GaitBranch:
    period: int
    points: tuple[Cycle, ...]
    ends: tuple[BranchEnd, BranchEnd]
    bifurcations: tuple[Bifurcation, ...]
    crossings: tuple[Crossing, ...]

    @property
    def closed(self) -> bool:
        return self.ends[1].reason == CLOSED_LOOP

    @cached_property
    def values(self) -> Floats:
        return np.array([point.value for point in self.points])

    @property
    def reach(self) -> float:
        """Distance that the parameter covers along the branch."""
        return float(np.abs(np.diff(self.values)).sum())

    @property
    def stable_ranges(self) -> tuple[tuple[float, float], ...]:
        stretches: list[list[float]] = []
        values = [self.ends[0].value]  # values on the current stable stretch
        stable = self.points[0].stable
        for gait, following in pairwise(self.points):
            if gait.stable:
                values.append(gait.value)
            if gait.stable != following.stable:
                # If no bifurcation was located between the two points, assume that stability changes halfway.
                on_it = (b.value for b in self.bifurcations if b.lies_between(gait, following))
                edge = next(on_it, 0.5 * (gait.value + following.value))
                if stable:
                    stretches.append([*values, edge])
                values = [edge]
                stable = following.stable
        if stable:
            stretches.append([*values, self.points[-1].value, self.ends[1].value])
        return tuple((min(stretch), max(stretch)) for stretch in stretches)

    def passing(self, value: float) -> Iterator[tuple[Cycle, Floats]]:
        """Yield the points just before the branch passes `value`, each with z (d,) interpolated at the value."""
        for first, second in pairwise(self.points):
            low, high = sorted((first.value, second.value))
            if low < high and low <= value <= high:
                share = (value - first.value) / (second.value - first.value)
                yield first, first.z + share * (second.z - first.z)

    def closes_on(self, flip: Bifurcation) -> list[bool]:
        # An end counts as near a flip if it is at most twice as far from the flip as from its neighbour on the branch.
        reach = (2.0 * np.ptp(values) + 1e-12 for values in (self.values[:2], self.values[-2:]))
        near = [bool(abs(end.value - flip.value) <= far) for end, far in zip(self.ends, reach, strict=True)]
        return [flip.kind == "flip" and end.closes and is_near for end, is_near in zip(self.ends, near, strict=True)]

    @property
    def flipped_outside(self) -> bool:
        """Whether a multiplier is below -1 along the whole branch, because the flip lies outside the span."""
        on_it = any(bifurcation.kind == "flip" for bifurcation in self.bifurcations)
        return not on_it and bifurcations.critical_value("flip", self.points[0].DP) < 0.0


class Seed(NamedTuple):
    """Section coordinates z (d,) near a gait of `steps` steps at a value of the parameter."""

    z: Floats
    value: float
    steps: int = 1


@dataclass(frozen=True)
class BranchTracer:
    """Follows a branch of gaits from one gait to the end of the branch."""

    step_map: StepMap
    span: ValueSpan
    control: StepControl = field(default_factory=StepControl)
    max_points: int = MAX_BRANCH_POINTS  # per branch
    advance: Callable[[], None] = lambda: None  # called after each point

    def equations(self, period: int) -> GaitEquations:
        return GaitEquations(self.step_map, period, self.span.size)

    def solve_at(self, z: Floats, value: float, period: int) -> CurvePoint[Cycle] | None:
        x = np.append(z, value / self.span.size)
        effort = Effort(self.control.tolerance, SEED_EVALUATIONS)
        solution = correct(self.equations(period), x, np.eye(x.size)[-1], effort)
        return None if isinstance(solution, NotConverged) else solution

    def trace(self, start: CurvePoint[Cycle], period: int) -> GaitBranch:
        equations = self.equations(period)
        points = [self.point(start)]
        before = None
        last = start
        end = None
        located = list[Bifurcation]()
        crossings = list[Crossing]()
        step = self.control.first
        # Just beyond a flip, a long step could lead to the same cycle with its halves exchanged.
        if period > self.step_map.stride:
            step = min(step, 0.5 * float(np.linalg.norm(half_cycle_difference(start.evaluated.data))))
        while end is None:
            if len(points) >= self.max_points:
                end = BranchEnd(points[-1].value, f"the limit of {self.max_points} points is reached")
                break
            following = self.next_point(equations, last, step, before)
            if isinstance(following, BranchEnd):
                end = following
                break
            solved, step, end = following
            if passes_through(Segment(equations, last, solved, self.control.tolerance), start, self.control.turn):
                end = BranchEnd(points[0].value, CLOSED_LOOP)
                solved = start
            if period % (2 * self.step_map.stride) == 0 and halves_meet(last.evaluated.data, solved.evaluated.data):
                half = period // 2
                end = BranchEnd(points[-1].value, f"closes on the gait of {half} {steps_word(half)}", closes=True)
                break
            segment = Segment(equations, last, solved, self.control.tolerance)
            tested = (locate_bifurcation(segment, kind, equations.scale) for kind in BIFURCATION_KINDS)
            located += [bifurcation for bifurcation in tested if bifurcation is not None]
            points.append(self.point(solved))
            left, right = points[-2:]
            for monitor, ahead, after in zip(self.step_map.monitors, left.monitors, right.monitors, strict=True):
                if monitor.limit is not None and (ahead - monitor.limit) * (after - monitor.limit) < 0.0:
                    share = (monitor.limit - ahead) / (after - ahead)
                    crossings.append(Crossing(monitor, left.value + share * (right.value - left.value)))
            if end is None and abs(points[-1].multipliers[0]) > MAX_CYCLE_GROWTH:
                end = BranchEnd(points[-1].value, f"a disturbance grows more than {MAX_CYCLE_GROWTH:g}-fold per cycle")
            before = last
            last = solved
        # A closed branch begins at an unstable gait, so that no stable stretch is split.
        if end.reason == CLOSED_LOOP:
            begin = min(range(len(points) - 1), key=lambda k: (points[k].stable, points[k].value))
            points = [*points[begin:-1], *points[: begin + 1]]
            end = replace(end, value=points[0].value)
        first = BranchEnd(points[0].value, end.reason if end.reason == CLOSED_LOOP else "start")
        return GaitBranch(period, tuple(points), (first, end), tuple(located), tuple(crossings))

    def check_after(self, last: CurvePoint[Cycle]) -> Callable[[CurvePoint[Cycle]], bool]:
        """Return a test of the next point: multipliers near the unit circle must change little, and the gait must not
        repeat after fewer steps, except at a flip.
        """
        # A pair of crossings is missed if multipliers move far. A gait of fewer steps solves the equations too, and a
        # long step may reach it. Its branch meets this one only at a flip, where a multiplier of the cycle is 1.
        critical = [m for m in last.evaluated.data.multipliers if 1.0 / CRITICAL_RANGE < abs(m) < CRITICAL_RANGE]

        def is_acceptable(point: CurvePoint[Cycle]) -> bool:
            gait = point.evaluated.data
            moves = (min(abs(m - new) for new in gait.multipliers) for m in critical)
            if any(move >= MAX_MULTIPLIER_CHANGE for move in moves):
                return False
            repeats_after = self.steps_to_repeat(gait)
            at_flip = bool(np.abs(gait.multipliers - 1.0).min() < MAX_MULTIPLIER_CHANGE)
            return repeats_after == len(gait.steps) or (2 * repeats_after == len(gait.steps) and at_flip)

        return is_acceptable

    def steps_to_repeat(self, gait: Cycle) -> int:
        """Return the number of steps after which a gait first repeats, a divisor of the number of its stored steps."""
        stride = self.step_map.stride
        strides = enumerate(gait.steps[stride - 1 :: stride], 1)
        return next(n * stride for n, step in strides if np.abs(step.z - gait.z).max() < SAME_STATE)

    def next_point(
        self, equations: GaitEquations, last: CurvePoint[Cycle], step: float, before: CurvePoint[Cycle] | None
    ) -> tuple[CurvePoint[Cycle], float, BranchEnd | None] | BranchEnd:
        """Return the next point, the next step length and, if it is reached, the end of the branch.

        Returns only the end if no point follows.
        """
        # A step that would leave the span ends at the span's edge, because the walker may not exist beyond it.
        ahead = last.x + step * last.tangent
        acceptable = self.check_after(last)
        edge = self.span.nearest(equations.value(ahead))
        if edge != equations.value(ahead):
            if abs(edge - equations.value(last.x)) <= EDGE_TOLERANCE * self.span.size:
                return BranchEnd(edge, END_OF_SPAN)
            at_edge = self.solve_at_edge(equations, last, ahead)
            if at_edge is not None and at_edge.tangent @ last.tangent > self.control.turn and acceptable(at_edge):
                return at_edge, step, BranchEnd(edge, END_OF_SPAN)
        following = step_along(equations, last, step, self.control, acceptable, before)
        if isinstance(following, NotConverged):
            return BranchEnd(equations.value(last.x), describe_loss(following))
        solved, step = following
        value = equations.value(solved.x)
        if value in self.span:
            return solved, step, None
        at_edge = self.solve_at_edge(equations, last, solved.x)
        if at_edge is None:
            return solved, step, BranchEnd(value, END_OF_SPAN)
        return at_edge, step, BranchEnd(self.span.nearest(value), END_OF_SPAN)

    def solve_at_edge(
        self, equations: GaitEquations, last: CurvePoint[Cycle], beyond: Floats
    ) -> CurvePoint[Cycle] | None:
        """Solve for the gait at the span's edge, between `last` and a point `beyond` (d + 1,).

        Returns None if that fails.
        """
        start = equations.value(last.x)
        value = equations.value(beyond)
        edge = self.span.nearest(value)
        guess = last.x + (edge - start) / (value - start) * (beyond - last.x)
        guess[-1] = edge / self.span.size
        point = correct(equations, guess, np.eye(guess.size)[-1], Effort(self.control.tolerance))
        if isinstance(point, NotConverged):
            return None
        return point if point.tangent @ last.tangent > 0.0 else replace(point, tangent=-point.tangent)

    def point(self, solved: CurvePoint[Cycle]) -> Cycle:
        self.advance()
        gait = solved.evaluated.data
        return replace(gait, monitors=self.step_map.watch(gait.z, gait.value, len(gait.steps)))


class BranchFollower(BranchTracer):
    """Finds the branches through given gaits, and the branches that split off at their flips."""

    def family(
        self, seeds: Iterable[Seed], periods: int, previous: tuple[GaitBranch, ...] = ()
    ) -> tuple[GaitBranch, ...]:
        """Return the `previous` branches, new ones through the seeds, and the cascades beyond flips of the new ones.

        periods  maximum period of a branch
        """
        branches = list(previous)
        for seed in seeds:
            start = self.solve_at(seed.z, seed.value, seed.steps)
            if start is None:
                continue
            gait = start.evaluated.data
            like = [branch for branch in branches if branch.period == seed.steps]
            if self.steps_to_repeat(gait) < seed.steps or any(self.lies_on(branch, gait) for branch in like):
                continue
            rising = start if start.tangent[-1] > 0.0 else replace(start, tangent=-start.tangent)
            branch_ahead = self.trace(rising, seed.steps)
            if not branch_ahead.closed:
                behind = self.trace(replace(rising, tangent=-rising.tangent), seed.steps)
                branch_ahead = GaitBranch(
                    seed.steps,
                    (*reversed(behind.points[1:]), *branch_ahead.points),
                    (behind.ends[1], branch_ahead.ends[1]),
                    (*reversed(behind.bifurcations), *branch_ahead.bifurcations),
                    (*reversed(behind.crossings), *branch_ahead.crossings),
                )
            # `lies_on` misses a gait just beyond the end of a known branch. So drop branches that the new one covers.
            within = [branch for branch in like if self.covers(branch_ahead, branch)]
            if all(branch.reach < branch_ahead.reach and branch not in previous for branch in within):
                branches = [*(branch for branch in branches if branch not in within), branch_ahead]
        for branch in branches:  # the list grows during the loop
            if 2 * branch.period <= periods and branch not in previous:
                branches.extend(self.follow_doubled(branch, branches))
        return tuple(close_on_flips(branch, branches) for branch in branches)

    def lies_on(self, branch: GaitBranch, gait: Cycle) -> bool:
        starts = [gait.z, *(step.z for step in gait.steps)]
        effort = Effort(self.control.tolerance, SEED_EVALUATIONS)
        for _, guess in branch.passing(gait.value):
            neighbour = gait_near(self.step_map, guess, gait.value, effort, branch.period)
            if isinstance(neighbour, Cycle) and min(np.abs(neighbour.z - z).max() for z in starts) < SAME_STATE:
                return True
        return False

    def covers(self, branch: GaitBranch, other: GaitBranch) -> bool:
        """Whether `branch` covers `other`, judged by the gait a quarter of the way along `other`."""
        # Halfway along there may be a fold, where the gaits of its two arms are hard to tell apart.
        distances = np.cumsum(np.abs(np.diff(other.values, prepend=other.values[0])))
        return self.lies_on(branch, other.points[int(np.searchsorted(distances, 0.25 * other.reach))])

    def follow_doubled(self, parent: GaitBranch, previous: Iterable[GaitBranch]) -> list[GaitBranch]:
        branches: list[GaitBranch] = []
        for flip in parent.bifurcations:
            like = [branch for branch in (*previous, *branches) if branch.period == 2 * parent.period]
            if flip.kind != "flip" or any(any(branch.closes_on(flip)) for branch in like):
                continue
            form = bifurcations.flip_form(self.equations(parent.period), flip)
            start = None if form is None else self.enter_doubled(flip, form, parent.period)
            if start is not None:
                branch = self.trace(start, 2 * parent.period)
                first = BranchEnd(flip.value, f"flip of the gait of {parent.period} {steps_word(parent.period)}")
                if not any(self.covers(other, branch) for other in like):
                    branches.append(replace(branch, ends=(first, branch.ends[1])))
        return branches

    def enter_doubled(self, flip: Bifurcation, form: bifurcations.FlipForm, period: int) -> CurvePoint[Cycle] | None:
        """Return the first gait of twice the period, at the amplitude of the normal form or at a fraction of it.

        Returns None if Newton's method finds no such gait.
        """
        # The tangent must point away from the flip, so the halves of the cycle must move apart along it.
        for halving in range(AMPLITUDE_HALVINGS):
            guess, normal, xi = bifurcations.predict_doubled(flip, form, 0.5**halving)
            point = correct(self.equations(2 * period), guess, normal, Effort(self.control.tolerance))
            # A correction as large as the amplitude may have led back to the gait that repeats after `period` steps.
            if isinstance(point, CurvePoint) and np.linalg.norm(point.x - guess) < 0.5 * xi:
                half = self.equations(period)(point.x)
                parting = half.value @ (half.jacobian @ point.tangent)
                return point if parting > 0.0 else replace(point, tangent=-point.tangent)
        return None


def passes_through(segment: Segment[Cycle], gait: CurvePoint[Cycle], turn: float) -> bool:
    """Whether a gait lies on a segment of a branch, with a tangent that turns by less than arccos(`turn`)."""
    first = segment.first
    along = float(first.tangent @ (gait.x - first.x))
    if not 0.0 < along <= segment.length or gait.tangent @ first.tangent < turn:
        return False
    near = segment.point_at(along)
    return isinstance(near, CurvePoint) and bool(np.abs(near.x - gait.x).max() < SAME_STATE)


def steps_word(n: int) -> str:
    return "step" if n == 1 else "steps"


def half_cycle_difference(gait: Cycle) -> Floats:
    """Return the difference between a gait's states half a cycle apart, or zero if it repeats after half its steps."""
    return np.asarray(gait.steps[len(gait.steps) // 2 - 1].z - gait.z)


def halves_meet(last: Cycle, gait: Cycle) -> bool:
    """Whether a branch has reached a gait of half its period: the cycle's halves coincide or have swapped places."""
    parted = half_cycle_difference(gait)
    return bool(np.abs(parted).max() < SAME_STATE or half_cycle_difference(last) @ parted < 0.0)


def close_on_flips(branch: GaitBranch, branches: Iterable[GaitBranch]) -> GaitBranch:
    flips = [b for parent in branches for b in parent.bifurcations if 2 * parent.period == branch.period]
    ends = []
    for index, end in enumerate(branch.ends):
        near = [flip.value for flip in flips if branch.closes_on(flip)[index]]
        ends.append(replace(end, value=min(near, key=lambda value: abs(value - end.value))) if near else end)
    return branch if tuple(ends) == branch.ends else replace(branch, ends=(ends[0], ends[1]))


def describe_loss(lost: NotConverged) -> str:
    if lost.outcome is Outcome.WALKED:
        return "Newton's method finds no further gait"
    if lost.outcome is None:
        return NO_WALKER
    aside = "" if lost.outcome is Outcome.REJECTED else f"{lost.outcome.label}: "
    return f"{aside}{OUTCOME_TEXTS[lost.outcome].why}"
