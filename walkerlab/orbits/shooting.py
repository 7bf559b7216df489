"""The rigid model's step map, with its exact derivative: steps of the similar walker of unit size.

A gait's state lies on the section 'both feet on the slope, just after heel strike'. Its coordinates z are the stance
leg's angle, which the swing leg's follows from, and the velocities of all bodies that turn by themselves then: swing
leg, stance leg, and a shank whose knee was free during the impact. A compass has (theta_2, dtheta_1, dtheta_2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.recorded_walk import take_walk
from walkerlab.hybrid.rigid_observer import Observer, unwatched
from walkerlab.hybrid.rigid_walk import EVENTS, HeelStrikes, new_heel_strikes, take_step, walk
from walkerlab.kernels import inlined, kernel, matrix, vector
from walkerlab.mechanics.standing import AT_STRIKE, STANCE, STRAIGHT, SWING, Standing, swing_foot
from walkerlab.orbits.newton import Evaluated
from walkerlab.orbits.similarity import Units, unit_walker
from walkerlab.orbits.step_map import REMEMBERED, Iterates, MappedStep, Monitor, no_step
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.linear import factor, solve
from walkerlab.solvers.registry import ENDLESS, Tolerances, finder_for
from walkerlab.solvers.stepping import H_NEXT, T, clear_counts
from walkerlab.solvers.system import State

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

WALKED = int(Outcome.WALKED)
SMALL = 2.0**-13
"""Length of the directions that are led along: what is linear in them is exact, and needs fewer digits than the state.

With an absolute tolerance of a tenth of the relative one they keep some three digits less, which halves the steps.
"""
SECTION_NAMES = ("theta_2", "dtheta_1", "dtheta_2", "dtheta_1_shank")
EXACT = Tolerances("dop853", 1e-13, 1e-13, 20_000)
QUICK = Tolerances("dop853", 1e-9, 1e-11, ENDLESS)  # of long walks
WATCHED = Tolerances("dop853", 1e-13, 1e-13, ENDLESS)
AT_ONCE = 8  # steps that a derivative is led over at once

# of random starts
MAX_EVALUATIONS = 60
SMALLEST_MOVE = 2.0**-8
NO_RESIDUAL = 1e300
SHORTEST_STEP = 0.05  # in sqrt(L/g); a shorter 'step' is standing, which solves the equations too
NEAR_RESIDUAL = 1e-6  # of a start that has come near a solution
STANDING_RESIDUAL = 1e-2  # below which so short a step comes to stand
WIDEST_WAY, LEFT = 0.1, 0.1  # to a known gait, and what part of it a move with the derivative there may leave
NEW, NOWHERE = -1, -2  # where a start leads, beside the number of a known gait


class StrikeSection(NamedTuple):
    """The states of a walker just after a heel strike, y = origin + z basis, and z = y[places]."""

    walker: Any  # (), the walker as compiled code takes it
    origin: Any  # (2 n,)
    basis: Any  # (d, 2 n)
    places: Any  # (d,)
    columns: Any  # (2 n d,) short directions, to be led along


@lru_cache(REMEMBERED)
def section_of(walker: Standing) -> StrikeSection:
    """The section of a walker, whose legs are straight there."""
    straight, at_strike, d = walker.E[STRAIGHT], walker.E[AT_STRIKE], int(walker.coordinates)
    n, places = len(straight), walker.section[:d].copy()
    origin, basis = np.zeros(2 * n), np.zeros((d, 2 * n))
    origin[:n] = -2.0 * (walker.slope + walker.lean) * straight[:, SWING]
    basis[0, :n] = straight[:, STANCE] - straight[:, SWING]
    basis[1:, n:] = at_strike[:, places[1:] - n].T
    return StrikeSection(np.asarray(walker), origin, basis, places, SMALL * basis.ravel())


def on_section(walker: Standing, z: Any) -> State:
    """The state (2 n) of section coordinates z (d,)."""
    section = section_of(walker)
    return tuple((section.origin + np.asarray(z) @ section.basis).tolist())


def coordinates_of(walker: Standing, y: Any) -> Floats:
    """The section coordinates (d,) of a state (2 n) just after heel strike."""
    return np.asarray(y, float)[section_of(walker).places]


class Memory(NamedTuple):
    """What steps are computed in."""

    plain: Any  # method for the equations of the walker alone
    varied: Any  # for those with a column for each coordinate
    finder: CrossingFinder
    observer: Observer
    plain_y: Any  # (2 n,) the state
    varied_y: Any  # (2 n (1 + d),) with its columns
    knee_time: Any  # (1,) s
    pivots: Any  # (d,)


class Steps(NamedTuple):
    """Steps from the section on, those that were taken.

    outcome  of the last one
    time     (steps,) of the heel strikes, in units of the walker
    z        (steps, d) where each led
    DP       (steps, d, d) derivatives with respect to where the first began; none if they were not wanted
    """

    outcome: Outcome
    time: Floats
    z: Floats
    DP: Floats


class Shooting:
    """The step map of walkers that are alike, with the memory to evaluate it."""

    def __init__(self, like: Standing, tolerances: Tolerances) -> None:
        """Steps at these tolerances."""
        size, d = len(like.blank), int(like.coordinates)
        plain, varied = tolerances.new(size), tolerances.new(size * (1 + d))
        self.memory = Memory(
            plain, varied, finder_for(plain, EVENTS), unwatched(), np.zeros(size), np.zeros(size * (1 + d)),
            np.zeros(1), np.zeros(d, np.int64),
        )  # fmt: skip

    def walk(self, section: StrikeSection, z: Floats, steps: int = 1, derived: bool = True) -> Steps:
        """Walk from z (d,), with the derivative if it is wanted: without, it is a fraction of the work."""
        memory = self.memory
        method, y = (memory.varied, memory.varied_y) if derived else (memory.plain, memory.plain_y)
        size = section.origin.size
        y[:size] = section.origin + z @ section.basis
        if derived:
            y[size:] = section.columns
        clear_counts(method)
        method.clock[H_NEXT] = 0.0
        strikes: HeelStrikes = new_heel_strikes(steps, y.size)
        status, taken = walk(section.walker, method, memory.finder, memory.observer, y, strikes)
        ahead = strikes.after[:taken].reshape(taken, y.size // size, size)[:, :, section.places]
        return Steps(Outcome(status), strikes.time[:taken], ahead[:, 0], ahead[:, 1:].transpose(0, 2, 1) / SMALL)

    def lead(self, section: StrikeSection, gaits: list[tuple[Floats, Floats]], starts: Floats) -> Integers:
        """Follow starts (starts, d) to where they lead; they are overwritten with the last states tried.

        gaits  known ones, by state (d,) and derivative (d, d) of the step map there

        Returns (starts,) the number of the gait that each leads to, NEW for another solution, or NOWHERE.
        """
        d = starts.shape[1]
        z, DP = np.zeros((len(gaits), d)), np.zeros((len(gaits), d, d))
        for k, gait in enumerate(gaits):
            z[k], DP[k] = gait
        known, led = KnownGaits(z, np.linalg.pinv(np.eye(d) - DP)), np.zeros(len(starts), np.int64)
        follow_starts(section, self.memory, known, starts, led)
        return led


@dataclass(frozen=True)
class StepEquations:
    """P(z) - z = 0 of a walker."""

    shooting: Shooting
    section: StrikeSection

    def at(self, z: Floats) -> Evaluated[Steps]:
        """Residual and its derivative at z (d,)."""
        step = self.shooting.walk(self.section, z)
        if step.outcome is not Outcome.WALKED:
            return Evaluated(step.outcome, z, np.eye(z.size), step)
        return Evaluated(step.outcome, step.z[0] - z, step.DP[0] - np.eye(z.size), step)


# ---- random starts ---------------------------------------------------------------------------------------------------
# A start comes near a solution of P(z) = z with few derivatives, each of which takes as long as five steps: Broyden's
# updates serve between them (Broyden 1965, his first method). What is found is solved to rounding elsewhere.


class KnownGaits(NamedTuple):
    """Gaits that need not be found again."""

    z: Any  # (gaits, d)
    inverse: Any  # (gaits, d, d) of I - DP there


@kernel
def follow_starts(section: StrikeSection, memory: Memory, known: KnownGaits, starts: Any, led: Any) -> None:
    """See `Shooting.lead`.

    starts  (starts, d); overwritten
    led     (starts,); written
    """
    model = section.walker[()]
    d = starts.shape[1]
    z = vector(model.section)
    for i in range(len(starts)):
        copied(starts[i], d, z)
        led[i] = follow(model, section, memory, known, z)
        copied(z, d, starts[i])


@inlined
def copied(numbers: Any, d: int, to: Any) -> None:
    """Copy d numbers."""
    for i in range(d):
        to[i] = numbers[i]


@inlined
def step_from(model: Standing, section: StrikeSection, memory: Memory, z: Any, end: Any, DP: Any, derived: bool) -> Any:
    """One step from z (d,): where it leads into `end` (d,), and if `derived` its derivative into DP (d, d).

    Returns whether it ended in a heel strike, and the residual, the largest component of P(z) - z; huge if it did not.
    """
    method = memory.varied if derived else memory.plain
    y = memory.varied_y if derived else memory.plain_y
    size, d = section.origin.size, section.places.size
    for i in range(size):
        y[i] = section.origin[i]
        for j in range(d):
            y[i] += z[j] * section.basis[j, i]
    for i in range(y.size - size):
        y[size + i] = section.columns[i]
    clear_counts(memory.plain)
    method.clock[H_NEXT] = 0.0
    status, _ = take_step(model, method, memory.finder, memory.observer, 0.0, y, 0, memory.knee_time)
    if status != WALKED:
        return False, NO_RESIDUAL
    residual = 0.0
    for i in range(d):
        end[i] = y[section.places[i]]
        residual = max(residual, abs(end[i] - z[i]))
        if derived:
            for j in range(d):
                DP[i, j] = y[size * (j + 1) + section.places[i]] / SMALL
    return True, residual


@inlined
def follow(model: Standing, section: StrikeSection, memory: Memory, known: KnownGaits, z: Any) -> int:
    """Where a start z (d,) leads, which is overwritten with the last state tried.

    After a full move that makes the residual smaller, Broyden's update of the derivative serves for the next one; else
    the derivative is computed anew, and moves with it are halved until they do. A start that does not walk to a heel
    strike, or comes to stand, is given up.
    """
    d, like = section.places.size, model.section
    end, best, move, DP = vector(like), vector(like), vector(like), matrix(like)
    clear_counts(memory.varied)
    _, best_residual = step_from(model, section, memory, z, end, DP, False)
    scale, evaluations = 1.0, 1
    stale, exact, nearer = True, False, True
    while NEAR_RESIDUAL < best_residual < NO_RESIDUAL and evaluations < MAX_EVALUATIONS:
        if nearer:
            if best_residual < STANDING_RESIDUAL and memory.plain.clock[T] < SHORTEST_STEP:
                return NOWHERE
            gait = leads_to(known, z, end)
            if gait >= 0:
                return gait
        if stale:
            walked, _ = step_from(model, section, memory, z, end, DP, True)
            if not walked:
                return NOWHERE
            stale, exact, scale = False, True, 1.0
        if scale == 1.0:
            copied(z, d, best)
            if not newton_move(memory, model, z, end, DP, move):
                return NOWHERE
        for i in range(d):
            z[i] = best[i] + scale * move[i]
        _, residual = step_from(model, section, memory, z, end, DP, False)
        evaluations += 1
        nearer = residual < best_residual
        if nearer:
            stale, exact, best_residual = scale < 1.0, False, residual
            if not stale:
                update(d, z, end, move, DP)
        else:
            copied(best, d, z)
            stale, scale = not exact, 0.5 * scale
            if scale < SMALLEST_MOVE:
                return NOWHERE
    return NEW if best_residual <= NEAR_RESIDUAL else NOWHERE


@inlined
def newton_move(memory: Memory, model: Standing, z: Any, end: Any, DP: Any, move: Any) -> bool:
    """(I - DP)^-1 (end - z) into `move` (d,); False if the matrix is singular."""
    d, system = memory.pivots.size, matrix(model.section)
    for i in range(d):
        move[i] = end[i] - z[i]
        for j in range(d):
            system[i, j] = (1.0 if i == j else 0.0) - DP[i, j]
    if not factor(system, memory.pivots, d):
        return False
    solve(system, memory.pivots, move, 0, d)
    return True


@inlined
def leads_to(known: KnownGaits, z: Any, end: Any) -> int:
    """Number of the known gait that Newton's method with the derivative there leads to from z (d,); else NOWHERE.

    It does if the way is short and one move leaves a small part of it: what the next leaves is smaller still.

    end  (d,) where the step from z leads
    """
    for k in range(len(known.z)):
        way, left = 0.0, 0.0
        for i in range(known.z.shape[1]):
            off = z[i] - known.z[k, i]
            way = max(way, abs(off))
            for j in range(known.z.shape[1]):
                off += known.inverse[k, i, j] * (end[j] - z[j])
            left = max(left, abs(off))
        if way < WIDEST_WAY and left < LEFT * way:
            return k
    return NOWHERE


@inlined
def update(d: int, z: Any, end: Any, move: Any, DP: Any) -> None:
    """Broyden's update of the derivative DP (d, d) after a full move (d,) to z (d,)."""
    square = 0.0
    for i in range(d):
        square += move[i] * move[i]
    for i in range(d):
        for j in range(d):
            DP[i, j] += (end[i] - z[i]) * move[j] / square


# ---- over a parameter ------------------------------------------------------------------------------------------------


class RigidMap:
    """The rigid model: its coordinates just after the heel strike, of the similar walker of unit size."""

    monitors = (
        Monitor("min_normal_force_N", "N", "least normal force on the stance foot", 0.0),
        Monitor("max_friction_ratio", "1", "largest ratio of tangential to normal force"),
        Monitor("max_scuff_depth_m", "m", "depth of the swing foot below the slope"),
    )

    tolerances = WATCHED

    def __init__(self, walker_at: Callable[[float], Standing | None], scale: float, like: Standing) -> None:
        """A family of walkers.

        like       one of them
        walker_at  the walker at a value of the parameter; None where it makes no walker
        scale      magnitude of changes of the parameter that matter
        """
        self._unit_at = lru_cache(REMEMBERED)(lambda p: similar_of(walker_at(p)))
        self.scale = scale
        self.names = SECTION_NAMES[: int(like.coordinates)]
        self._exact, self._quick = Shooting(like, EXACT), Shooting(like, QUICK)

    def step(self, z: Floats, p: float, derived: bool = True) -> MappedStep:
        """One step, with its exact derivative along the section."""
        unit = self._unit_at(p)
        if unit is None:
            return no_step(Outcome.REJECTED, z.size)
        step = self._exact.walk(unit.section, z, derived=derived)
        if step.outcome is not Outcome.WALKED:
            return no_step(step.outcome, z.size)
        ahead, period_s, DP = step.z[0], float(step.time[0]) * unit.units.time, step.DP[0]
        after = on_section(unit.walker, ahead)
        rolled = -unit.walker.radius * (after[SWING] - z[0])  # the foot behind is the one that stood
        length_m = float(rolled - swing_foot(unit.walker, after)[1]) * unit.units.length
        return MappedStep(Outcome.WALKED, ahead, DP, period_s, length_m, float(ahead[0]), period_s)

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        """Least normal force, largest friction ratio, deepest scuff."""
        unit = self._unit_at(p)
        assert unit is not None, "what is watched was walked"
        walker, units, _ = unit
        taken = take_walk(walker, WATCHED, on_section(walker, z), steps)
        extremes = (taken.min_normal_force, taken.max_friction_ratio, taken.max_scuff_depth)
        return np.array(extremes) * (units.force, 1.0, units.length)

    def timed(self, z: Floats, p: float, steps: int, tolerances: Tolerances) -> tuple[Floats, Floats] | None:
        """Durations (steps,) in s and lengths (steps,) in m of a gait's steps, integrated otherwise."""
        unit = self._unit_at(p)
        assert unit is not None, "a gait was walked"
        taken = take_walk(unit.walker, tolerances, on_section(unit.walker, z), steps)
        return None if taken.steps < steps else (taken.periods_s * unit.units.time, taken.lengths_m * unit.units.length)

    def iterate(self, z: Floats, p: float, steps: int, tangent: Floats | None) -> Iterates:
        """A walk of ordinary accuracy, since errors grow on a chaotic attractor whatever they are."""
        unit, none = self._unit_at(p), np.zeros(0)
        if unit is None:
            return Iterates(Outcome.REJECTED, np.zeros((0, z.size)), none, none, none)
        _, units, section = unit
        if tangent is None:
            walked = self._quick.walk(section, z, steps, derived=False)
            periods = np.diff(walked.time, prepend=0.0) * units.time
            return Iterates(walked.outcome, walked.z, none, periods, walked.z[:, 0])
        outcome = Outcome.WALKED
        points, growth, times = list[Floats](), list[Floats](), list[Floats]()
        while outcome is Outcome.WALKED and len(points) * AT_ONCE < steps:
            part = self._quick.walk(section, z, min(AT_ONCE, steps - len(points) * AT_ONCE))
            outcome, images = part.outcome, part.DP @ tangent
            sizes = np.linalg.norm(images, axis=1)
            points.append(part.z)
            growth.append(sizes / np.append(1.0, sizes[:-1]) if sizes.size else sizes)
            times.append(np.diff(part.time, prepend=0.0))
            if part.time.size:
                z, tangent = part.z[-1], images[-1] / sizes[-1]
        every = np.concatenate(points)
        return Iterates(outcome, every, np.concatenate(growth), np.concatenate(times) * units.time, every[:, 0])


class Similar(NamedTuple):
    """The unit walker that a walker is similar to, the units, and its section."""

    walker: Standing
    units: Units
    section: StrikeSection


def similar_of(walker: Standing | None) -> Similar | None:
    """The similar walker of one that there is."""
    if walker is None:
        return None
    unit, units = unit_walker(walker)
    return Similar(unit, units, section_of(unit))
