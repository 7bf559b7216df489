"""Families of gaits over a parameter: branches, their bifurcations, and the cascades beyond their flips.

A branch is followed from a gait in both directions until it leaves the span or is lost. At each flip the branch of
twice the period is entered along the eigenvector to -1, at the amplitude given by the flip's normal form.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from walkerlab.orbits.bifurcations import (
    KINDS,
    Bifurcation,
    FlipForm,
    GaitEquations,
    bifurcation_in,
    critical_value,
    flip_form,
    onto_doubled,
)
from walkerlab.orbits.continuation import Segment, Solved, StepControl, corrected, stepped
from walkerlab.orbits.newton import Effort, NotConverged
from walkerlab.orbits.step_map import Cycle, Monitor, StepMap, gait_near
from walkerlab.outcome import TOLD, Outcome
from walkerlab.solvers.system import Floats

SAME = 1e-6  # distance of states below which two gaits are one
HALVINGS = 12  # of the amplitude on the way onto a branch
TURN_OF_MULTIPLIERS = 0.6  # by how much a multiplier may change between neighbours, near the unit circle
NEAR_CIRCLE = 1.6  # magnitude of multipliers that this is asked of
EVALUATIONS = 20  # of Newton's method from a seed
ROUND = "comes round to where it began"
NO_WALKER = "no walker has the parameter's next value"
END_OF_SPAN = "end of the span"
AT_AN_END = 1e-12  # of the span
POINTS, GROWTH = 400, 1e4  # of one branch; of a disturbance over a cycle, beyond which no gait is resolved


@dataclass(frozen=True)
class ValueSpan:
    """Range of the parameter to cover."""

    least: float
    most: float

    @property
    def size(self) -> float:
        return self.most - self.least

    def __contains__(self, value: float) -> bool:
        return self.least <= value <= self.most

    def nearest(self, value: float) -> float:
        """Clamp a value to the span."""
        return min(max(value, self.least), self.most)


CONTROL = StepControl()


@dataclass(frozen=True)
class BranchEnd:
    """Where a branch ends, and why."""

    value: float
    reason: str


@dataclass(frozen=True)
class Crossing:
    """Value on a branch at which a monitored assumption begins or ceases to hold."""

    monitor: Monitor
    value: float


@dataclass(frozen=True, eq=False)
class GaitBranch:
    """Gaits of one period along a curve."""

    period: int
    points: tuple[Cycle, ...]
    ends: tuple[BranchEnd, BranchEnd]
    bifurcations: tuple[Bifurcation, ...]
    crossings: tuple[Crossing, ...]

    @property
    def closed(self) -> bool:
        """Whether the branch is a closed loop."""
        return self.ends[1].reason == ROUND

    @cached_property
    def values(self) -> Floats:
        """Parameter values (points,)."""
        return np.array([point.value for point in self.points])

    @property
    def stable_ranges(self) -> tuple[tuple[float, float], ...]:
        """Parameter ranges over which the branch is stable, bounded by bifurcations and ends."""
        found: list[list[float]] = []
        values = [self.ends[0].value]  # of the stable stretch being passed through
        stable = self.points[0].stable
        for one, other in pairwise(self.points):
            if one.stable:
                values.append(one.value)
            if one.stable != other.stable:
                on_it = (b.value for b in self.bifurcations if b.lies_between(one, other))
                edge = next(on_it, 0.5 * (one.value + other.value))
                if stable:
                    found.append([*values, edge])
                values, stable = [edge], other.stable
        if stable:
            found.append([*values, self.points[-1].value, self.ends[1].value])
        return tuple((min(stretch), max(stretch)) for stretch in found)

    def closes_on(self, flip: Bifurcation) -> list[bool]:
        """Return for each end whether it is this flip of another branch."""
        reach = (2.0 * np.ptp(values) + 1e-12 for values in (self.values[:2], self.values[-2:]))
        near = [bool(abs(end.value - flip.value) <= far) for end, far in zip(self.ends, reach, strict=True)]
        closing = (flip.kind == "flip" and end.reason.startswith("closes") for end in self.ends)
        return [one and other for one, other in zip(closing, near, strict=True)]

    @property
    def flipped_outside(self) -> bool:
        """Whether the whole branch lies beyond a flip that is not on it: one multiplier below -1 throughout."""
        on_it = any(one.kind == "flip" for one in self.bifurcations)
        return not on_it and critical_value("flip", self.points[0].DP) < 0.0


class Seed(NamedTuple):
    """Section coordinates z (d,) near a gait of `steps` steps at a value of the parameter."""

    z: Floats
    value: float
    steps: int = 1


@dataclass(frozen=True)
class BranchFollower:
    """Follows the branches of one model over one span.

    most     maximum number of points on a branch
    advance  called after each point
    """

    step_map: StepMap
    span: ValueSpan
    control: StepControl = CONTROL
    most: int = POINTS
    advance: Callable[[], None] = lambda: None

    def family(self, seeds: Iterable[Seed], periods: int, known: tuple[GaitBranch, ...] = ()) -> tuple[GaitBranch, ...]:
        """Return `known`, every other branch through the seeds, and the cascades beyond their flips.

        periods  maximum number of steps of a gait
        """
        branches = list(known)
        for seed in seeds:
            start = self.solved_at(seed.z, seed.value, seed.steps)
            if start is None:
                continue
            gait = start.evaluated.data
            like = [branch for branch in branches if branch.period == seed.steps]
            sooner = any(np.abs(step.z - gait.z).max() < SAME for step in gait.steps[:-1])
            if sooner or any(self.lies_on(branch, gait) for branch in like):
                continue
            rising = start if start.tangent[-1] > 0.0 else replace(start, tangent=-start.tangent)
            found = self.trace(rising, seed.steps)
            if not found.closed:
                behind = self.trace(replace(rising, tangent=-rising.tangent), seed.steps)
                found = GaitBranch(
                    seed.steps,
                    (*reversed(behind.points[1:]), *found.points),
                    (behind.ends[1], found.ends[1]),
                    (*reversed(behind.bifurcations), *found.bifurcations),
                    (*reversed(behind.crossings), *found.crossings),
                )
            # between a flip and the first gait beyond it a branch that is known has no points
            if not any(self.lies_on(found, branch.points[0]) for branch in like):
                branches.append(found)
        for branch in branches:  # grows on the way
            if 2 * branch.period <= periods and branch not in known:
                branches.extend(self.doubled(branch, branches))
        return tuple(closed_on(branch, branches) for branch in branches)

    def equations(self, period: int) -> GaitEquations:
        return GaitEquations(self.step_map, period, self.span.size)

    def solved_at(self, z: Floats, value: float, period: int) -> Solved[Cycle] | None:
        """Solve for the point of the curve of gaits near z at a value; None if Newton's method fails."""
        x, tolerance = np.append(z, value / self.span.size), self.control.tolerance
        found = corrected(self.equations(period), x, np.eye(x.size)[-1], tolerance, EVALUATIONS)
        return None if isinstance(found, NotConverged) else found

    def lies_on(self, branch: GaitBranch, gait: Cycle) -> bool:
        """Whether a gait is on a branch already, starting at any of its steps."""
        value, effort = gait.value, Effort(self.control.tolerance, EVALUATIONS)
        starts = [gait.z, *(step.z for step in gait.steps)]
        for one, other in pairwise(branch.points):
            if not min(one.value, other.value) <= value <= max(one.value, other.value) or one.value == other.value:
                continue
            share = (value - one.value) / (other.value - one.value)
            guess = one.z + share * (other.z - one.z)
            here = gait_near(self.step_map, guess, value, effort, branch.period)
            if isinstance(here, Cycle) and min(float(np.max(np.abs(here.z - z))) for z in starts) < SAME:
                return True
        return False

    def doubled(self, parent: GaitBranch, known: Iterable[GaitBranch]) -> list[GaitBranch]:
        """Follow the branches of twice the period from the flips of a branch."""
        found: list[GaitBranch] = []
        for flip in parent.bifurcations:
            like = [branch for branch in (*known, *found) if branch.period == 2 * parent.period]
            if flip.kind != "flip" or any(any(branch.closes_on(flip)) for branch in like):
                continue
            form = flip_form(self.equations(parent.period), flip)
            start = None if form is None else self.beyond(flip, form, parent.period)
            if start is not None:
                branch = self.trace(start, 2 * parent.period)
                first = BranchEnd(flip.value, f"flip of the gait of {parent.period} {steps_word(parent.period)}")
                found.append(replace(branch, ends=(first, branch.ends[1])))
        return found

    def beyond(self, flip: Bifurcation, form: FlipForm, period: int) -> Solved[Cycle] | None:
        """Return the first gait of twice the period, at the normal form's amplitude; None if it is lost.

        Its tangent points away from the flip: the halves of the cycle move apart along it.
        """
        for halving in range(HALVINGS):
            guess, normal, xi = onto_doubled(flip, form, 0.5**halving)
            found = corrected(self.equations(2 * period), guess, normal, self.control.tolerance)
            if isinstance(found, Solved) and np.linalg.norm(found.x - guess) < 0.5 * xi:
                half = self.equations(period)(found.x)
                parting = half.value @ (half.jacobian @ found.tangent)
                return found if parting > 0.0 else replace(found, tangent=-found.tangent)
        return None

    def trace(self, start: Solved[Cycle], period: int) -> GaitBranch:
        """Follow a branch from a gait along its tangent until it ends."""
        equations = self.equations(period)
        points, before, last, end = [self.point(start)], None, start, None
        bifurcations, crossings = list[Bifurcation](), list[Crossing]()
        step = self.control.first
        if period > 1:
            step = min(step, 0.5 * float(np.linalg.norm(apart(start.evaluated.data))))
        while end is None:
            if len(points) >= self.most:
                end = BranchEnd(points[-1].value, f"{self.most} points are used up")
                break
            following = self.onward(equations, last, step, before)
            if isinstance(following, BranchEnd):
                end = following
                break
            solved, step, end = following
            if passes(Segment(equations, last, solved, self.control.tolerance), start, self.control.turn):
                end, solved = BranchEnd(points[0].value, ROUND), start
            if period % 2 == 0 and halves_meet(last.evaluated.data, solved.evaluated.data):
                end = BranchEnd(points[-1].value, f"closes on the gait of {period // 2} {steps_word(period // 2)}")
                break
            segment = Segment(equations, last, solved, self.control.tolerance)
            located = (bifurcation_in(segment, kind, equations.scale) for kind in KINDS)
            bifurcations += [one for one in located if one is not None]
            points.append(self.point(solved))
            one, other = points[-2:]
            for monitor, ahead, after in zip(self.step_map.monitors, one.monitors, other.monitors, strict=True):
                if monitor.limit is not None and (ahead - monitor.limit) * (after - monitor.limit) < 0.0:
                    share = (monitor.limit - ahead) / (after - ahead)
                    crossings.append(Crossing(monitor, one.value + share * (other.value - one.value)))
            if end is None and abs(points[-1].multipliers[0]) > GROWTH:
                end = BranchEnd(points[-1].value, f"a disturbance grows more than {GROWTH:g}-fold a cycle")
            before, last = last, solved
        if end.reason == ROUND:  # told from an unstable gait on, so that no stable stretch is cut in two
            begin = min(range(len(points) - 1), key=lambda k: (points[k].stable, points[k].value))
            points = [*points[begin:-1], *points[: begin + 1]]
            end = replace(end, value=points[0].value)
        first = BranchEnd(points[0].value, end.reason if end.reason == ROUND else "start")
        return GaitBranch(period, tuple(points), (first, end), tuple(bifurcations), tuple(crossings))

    def near_enough(self, last: Solved[Cycle]) -> Callable[[Solved[Cycle]], bool]:
        """Return a check that multipliers near the unit circle moved little, so that no two crossings are missed."""
        critical = [one for one in last.evaluated.data.multipliers if 1.0 / NEAR_CIRCLE < abs(one) < NEAR_CIRCLE]

        def near(found: Solved[Cycle]) -> bool:
            after = found.evaluated.data.multipliers
            return all(min(abs(one - other) for other in after) < TURN_OF_MULTIPLIERS for one in critical)

        return near

    def onward(
        self, equations: GaitEquations, last: Solved[Cycle], step: float, before: Solved[Cycle] | None
    ) -> tuple[Solved[Cycle], float, BranchEnd | None] | BranchEnd:
        """Return the next point, the next step length, and the branch's end if it is reached.

        A step that leaves the span is cut at its edge, since beyond it there may be no walker. Returns only the end if
        there is no further point.
        """
        ahead, acceptable = last.x + step * last.tangent, self.near_enough(last)
        edge = self.span.nearest(equations.value(ahead))
        if edge != equations.value(ahead):
            if abs(edge - equations.value(last.x)) <= AT_AN_END * self.span.size:
                return BranchEnd(edge, END_OF_SPAN)
            at_edge = self.at_edge(equations, last, ahead)
            if at_edge is not None and at_edge.tangent @ last.tangent > self.control.turn and acceptable(at_edge):
                return at_edge, step, BranchEnd(edge, END_OF_SPAN)
        following = stepped(equations, last, step, self.control, acceptable, before)
        if isinstance(following, NotConverged):
            return BranchEnd(equations.value(last.x), why_lost(following))
        solved, step = following
        value = equations.value(solved.x)
        if value in self.span:
            return solved, step, None
        at_edge = self.at_edge(equations, last, solved.x)
        if at_edge is None:
            return solved, step, BranchEnd(value, END_OF_SPAN)
        return at_edge, step, BranchEnd(self.span.nearest(value), END_OF_SPAN)

    def at_edge(self, equations: GaitEquations, last: Solved[Cycle], beyond: Floats) -> Solved[Cycle] | None:
        """Solve for the gait at the edge of the span, on the way from `last` to a point (d + 1,) beyond."""
        start, value = equations.value(last.x), equations.value(beyond)
        edge = self.span.nearest(value)
        guess = last.x + (edge - start) / (value - start) * (beyond - last.x)
        guess[-1] = edge / self.span.size
        found = corrected(equations, guess, np.eye(guess.size)[-1], self.control.tolerance)
        if isinstance(found, NotConverged):
            return None
        return found if found.tangent @ last.tangent > 0.0 else replace(found, tangent=-found.tangent)

    def point(self, solved: Solved[Cycle]) -> Cycle:
        """Return the gait at a point of the curve, with its monitors."""
        self.advance()
        gait = solved.evaluated.data
        return replace(gait, monitors=self.step_map.watch(gait.z, gait.value, len(gait.steps)))


def passes(segment: Segment[Cycle], gait: Solved[Cycle], turn: float) -> bool:
    """Whether a gait lies between two neighbours on a curve with the same direction.

    turn  cosine of the largest angle between the tangents
    """
    first = segment.first
    along = float(first.tangent @ (gait.x - first.x))
    if not 0.0 < along <= segment.length or gait.tangent @ first.tangent < turn:
        return False
    near = segment.at(along)
    return isinstance(near, Solved) and bool(np.abs(near.x - gait.x).max() < SAME)


def steps_word(n: int) -> str:
    return "step" if n == 1 else "steps"


def apart(gait: Cycle) -> Floats:
    """Return the difference between a gait's states half a cycle apart; zero for a gait of half as many steps."""
    return np.asarray(gait.steps[len(gait.steps) // 2 - 1].z - gait.z)


def halves_meet(last: Cycle, gait: Cycle) -> bool:
    """Whether a branch has reached the gait of half as many steps: the cycle's halves coincide or have swapped."""
    parted = apart(gait)
    return bool(np.abs(parted).max() < SAME or apart(last) @ parted < 0.0)


def closed_on(branch: GaitBranch, branches: Iterable[GaitBranch]) -> GaitBranch:
    """Return the branch with each end that closes on another's flip moved to that flip."""
    flips = [one for parent in branches for one in parent.bifurcations if 2 * parent.period == branch.period]
    ends = []
    for place, end in enumerate(branch.ends):
        near = [flip.value for flip in flips if branch.closes_on(flip)[place]]
        ends.append(replace(end, value=min(near, key=lambda value: abs(value - end.value))) if near else end)
    return branch if tuple(ends) == branch.ends else replace(branch, ends=(ends[0], ends[1]))


def why_lost(lost: NotConverged) -> str:
    """Describe why a branch is lost."""
    if lost.outcome is Outcome.WALKED:
        return "Newton's method finds no further gait"
    if lost.outcome is None:
        return NO_WALKER
    aside = "" if lost.outcome is Outcome.REJECTED else f"{lost.outcome.label}: "
    return f"{aside}{TOLD[lost.outcome].why}"
