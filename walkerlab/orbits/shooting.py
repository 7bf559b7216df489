"""Step map of the rigid model with its exact derivative, computed on the similar walker of unit size.

A gait's state lies on the section 'both feet on the slope, just after heel strike'. Its coordinates z are the stance
leg's angle, which determines the swing leg's, and the rates of all bodies that turn independently: swing leg, stance
leg, and a shank whose knee was free during the impact. A compass has (theta_2, dtheta_1, dtheta_2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import cached_property, lru_cache
from threading import local
from typing import Any, NamedTuple

import numpy as np

from walkerlab.hybrid.recorded_walk import as_state, take_walk
from walkerlab.hybrid.rigid_record import Observer, unwatched
from walkerlab.hybrid.rigid_walk import EVENTS, SHORTEST_LANDING, HeelStrikes, new_heel_strikes, take_step, walk
from walkerlab.kernels import inlined, kernel, matrix, vector
from walkerlab.mechanics.impact import pushed_at_hip
from walkerlab.mechanics.standing import (
    AT_STRIKE,
    STANCE,
    STRAIGHT,
    SWING,
    Standing,
    feet_on_slope,
    momentum,
    step_lengths,
)
from walkerlab.orbits.similarity import Units, unit_walker
from walkerlab.orbits.step_map import REMEMBERED, DisturbedWalk, Iterates, MappedStep, Monitor, StepMap, no_step
from walkerlab.outcome import Outcome
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.linear import factor, solve
from walkerlab.solvers.registry import ENDLESS, Tolerances, finder_for
from walkerlab.solvers.stepping import BUDGET, H_NEXT, clear_counts
from walkerlab.solvers.system import Floats, Integers, State

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
SHORTEST_STEP = 0.05  # in sqrt(L/g); a shorter 'step' is standing, which repeats itself too
# of random starts
MAX_EVALUATIONS, SMALLEST_SHARE = 40, 2.0**-6  # of a move of Newton's method
NO_RESIDUAL, NEAR_RESIDUAL = 1e300, 1e-6
WIDEST_WAY, LEFT = 0.1, 0.1  # to a known gait, and what part of it a move with the derivative there may leave
NEW, NOWHERE = -1, -2  # where a start leads, beside the number of a known gait


class StrikeSection(NamedTuple):
    """States of a walker just after heel strike, y = start + z basis, with scaled-down variational columns."""

    walker: Any  # (), the walker as compiled code takes it
    start: Any  # (2 n (1 + d),) the state at z = 0, with its columns
    basis: Any  # (d, 2 n)
    places: Any  # (d (1 + d),) of z in the state, and of the columns' z row by row of the derivative


@lru_cache(REMEMBERED)
def section_of(walker: Standing) -> StrikeSection:
    """Return the section of a walker (its legs are straight there)."""
    straight, at_strike, d = walker.E[STRAIGHT], walker.E[AT_STRIKE], int(walker.coordinates)
    n, places = len(straight), walker.section[:d]
    origin, basis = np.zeros(2 * n), np.zeros((d, 2 * n))
    origin[:n] = -feet_on_slope(walker, 0.0, 0.0) * straight[:, SWING]
    basis[0, :n] = straight[:, STANCE] - straight[:, SWING]
    basis[1:, n:] = at_strike[:, places[1:] - n].T
    every = np.add.outer(places, 2 * n * np.arange(1, d + 1))
    return StrikeSection(
        np.asarray(walker),
        np.append(origin, SMALL * basis),
        basis,
        np.append(places, every),
    )


def on_section(walker: Standing, z: Any) -> State:
    """Return the state (2 n) at section coordinates z (d,)."""
    return tuple(states_on_section(walker, z).tolist())


def states_on_section(walker: Standing, z: Any) -> Floats:
    """Return the states (n, 2 n) at section coordinates z (n, d); also takes a single z (d,)."""
    section = section_of(walker)
    return np.asarray(section.start[: len(walker.zero_state)] + np.asarray(z) @ section.basis)


def coordinates_of(walker: Standing, y: Any) -> Floats:
    """Return the section coordinates (d,) of a state (2 n) just after heel strike."""
    return np.asarray(y, float)[walker.section[: walker.coordinates]]


class Steps(NamedTuple):
    """Completed steps from a point of the section.

    outcome  of the last step attempted
    time     (steps,) of the heel strikes, in units of the walker
    z        (steps, d) section coordinates after each
    DP       (steps, d, d) derivatives with respect to the start; empty unless requested
    strikes  the heel strikes
    """

    outcome: Outcome
    time: Floats
    z: Floats
    DP: Floats
    strikes: HeelStrikes


class Memory(NamedTuple):
    """Work arrays for steps with their derivatives."""

    varied: Any  # method for the equations with a column for each coordinate
    finder: CrossingFinder
    observer: Observer
    y: Any  # (2 n (1 + d),) the state with its columns
    strikes: HeelStrikes  # of one step
    pivots: Any  # (d,)


class Shooting(local):
    """Step map of walkers of one kind, with the memory to evaluate it; each thread has its own."""

    def __init__(self, like: Standing, tolerances: Tolerances) -> None:
        size, d = len(like.zero_state), int(like.coordinates)
        self.plain, varied = tolerances.new(size), tolerances.new(size * (1 + d))
        finder = finder_for(self.plain, EVENTS, size)
        self.memory = Memory(
            varied, finder, unwatched(), np.zeros(size * (1 + d)), new_heel_strikes(1, 0), np.zeros(d, np.int64)
        )

    def walk(
        self,
        section: StrikeSection,
        z: Floats,
        steps: int = 1,
        derived: bool = True,
        rises: Floats | None = None,
        nearest: float = 0.0,
        start: Floats | None = None,
    ) -> Steps:
        """Walk from z (d,), with the derivative unless `derived` is false, which saves a third of the work.

        rises, nearest  see HeelStrikes, in units of the walker; even ground by default
        start           (2 n,) state off the section to walk from instead, without a derivative
        """
        memory = self.memory
        method = memory.varied if derived else self.plain
        d, size = section.basis.shape
        y = section.start[: method.y.size].copy()
        y[:size] = y[:size] + z @ section.basis if start is None else start
        method.counts[:BUDGET] = 0
        method.clock[H_NEXT] = 0.0
        strikes: HeelStrikes = new_heel_strikes(steps, y.size, rise=rises, nearest=nearest)
        status, taken = walk(section.walker, method, memory.finder, memory.observer, y, strikes)
        ahead = strikes.after[:taken].take(section.places if derived else section.places[:d], axis=1)
        DP = ahead[:, d:].reshape(taken, d if derived else 0, d) / SMALL
        return Steps(Outcome(status), strikes.time[:taken], ahead[:, :d], DP, strikes)

    def lead(self, section: StrikeSection, gaits: list[tuple[Floats, Floats]], starts: Floats) -> Integers:
        """Run Newton's method from starts (starts, d), overwritten with the last states tried.

        gaits  known gaits, as state (d,) and derivative (d, d) of the step map

        Returns (starts,) the index of the known gait that each converges to, NEW_GAIT for another solution, or NO_GAIT.
        """
        d = starts.shape[1]
        z, DP = np.zeros((len(gaits), d)), np.zeros((len(gaits), d, d))
        for k, gait in enumerate(gaits):
            z[k], DP[k] = gait
        led = np.zeros(len(starts), np.int64)
        follow_starts(section, self.memory, KnownGaits(z, np.linalg.pinv(np.eye(d) - DP)), starts, led)
        return led


class KnownGaits(NamedTuple):
    """Gaits that the search recognises without solving for them again."""

    z: Any  # (gaits, d)
    inverse: Any  # (gaits, d, d) of I - DP there


@kernel
def follow_starts(section: StrikeSection, memory: Memory, known: KnownGaits, starts: Any, led: Any) -> None:
    """Run Newton's method from starts (starts, d), results into `led` (starts,); see `RigidStepper.solve_starts`."""
    for k in range(len(starts)):
        led[k] = follow(section.walker[()], section, memory, known, starts[k])


@inlined
def follow(model: Standing, section: StrikeSection, memory: Memory, known: KnownGaits, z: Any) -> int:
    """Run Newton's method from z (d,), overwritten with the last state tried.

    A move is halved until it reduces the residual. A start that reaches no heel strike, or stands still, is given up. A
    known gait is recognised if it is close and one move with its derivative removes most of the distance.
    """
    method, y, places = memory.varied, memory.y, section.places
    (d, size), like = section.basis.shape, model.section
    best, move, system = vector(like), vector(like), matrix(like)
    least, share = NO_RESIDUAL, 1.0
    clear_counts(method)
    for _ in range(MAX_EVALUATIONS):
        for i in range(y.size):
            y[i] = section.start[i]
        for i in range(size):
            for j in range(d):
                y[i] += z[j] * section.basis[j, i]
        method.clock[H_NEXT] = 0.0
        status, t = take_step(model, method, memory.finder, memory.observer, 0.0, y, 0, memory.strikes)
        residual = NO_RESIDUAL
        if status == WALKED and t >= SHORTEST_STEP:
            residual = 0.0
            for i in range(d):
                residual = max(residual, abs(y[places[i]] - z[i]))
        if residual < least:
            least, share = residual, 1.0
            if residual <= NEAR_RESIDUAL:
                return NEW
            for i in range(d):
                best[i], move[i] = z[i], y[places[i]] - z[i]
            for gait in range(len(known.z)):
                way, left = 0.0, 0.0
                for i in range(d):
                    off = z[i] - known.z[gait, i]
                    way = max(way, abs(off))
                    for j in range(d):
                        off += known.inverse[gait, i, j] * move[j]
                    left = max(left, abs(off))
                if way < WIDEST_WAY and left < LEFT * way:
                    return gait
            for i in range(d):
                for j in range(d):
                    system[i, j] = (1.0 if i == j else 0.0) - y[places[d * (i + 1) + j]] / SMALL
            if not factor(system, memory.pivots, d):
                return NOWHERE
            solve(system, memory.pivots, move, 0, d)
        else:
            share *= 0.5
            if least == NO_RESIDUAL or share < SMALLEST_SHARE:
                return NOWHERE
        for i in range(d):
            z[i] = best[i] + share * move[i]
    return NOWHERE


class RigidMap(StepMap):
    """Step map of the rigid model in section coordinates of the similar walker of unit size."""

    monitors = (
        Monitor("min_normal_force_N", "N", "least normal force on the stance foot", 0.0),
        Monitor("max_friction_ratio", "1", "largest ratio of tangential to normal force"),
        Monitor("max_scuff_depth_m", "m", "depth of the swing foot below the slope"),
    )

    tolerances = WATCHED
    probe = 2e-5

    def __init__(
        self, walker_at: Callable[[float], Standing | None], scale: float, like: Standing, exact: Tolerances = EXACT
    ) -> None:
        """Prepare the step map of a family of walkers.

        walker_at  the walker at a value of the parameter; None where the value makes no walker
        scale      magnitude of significant changes of the parameter
        like       any one of the walkers
        exact      solver settings of a step
        """

        @lru_cache(REMEMBERED)
        def unit_at(p: float) -> Similar | None:
            walker = walker_at(p)
            if walker is None:
                return None
            unit, units = unit_walker(walker)
            section, n = section_of(unit), len(unit.arm_x)
            feet = np.array((section.start[:n] + unit.slope, section.basis[0, :n], unit.foot_x, unit.foot_y)).T
            return Similar(unit, units, section, feet.tolist(), float(unit.radius), float(-section.start[SWING]))

        self._unit_at = unit_at
        self.scale = scale
        self.names = SECTION_NAMES[: int(like.coordinates)]
        self._like, self._exact = like, Shooting(like, exact)

    @cached_property
    def _quick(self) -> Shooting:
        return Shooting(self._like, QUICK)

    def step(self, z: Floats, p: float, derived: bool = True) -> MappedStep:
        unit = self._unit_at(p)
        if unit is None:
            return no_step(None, z.size)
        step = self._exact.walk(unit.section, z, derived=derived)
        if step.outcome is not Outcome.WALKED or step.time[0] < SHORTEST_STEP:
            standing = step.outcome is Outcome.WALKED
            return no_step(Outcome.NO_HEEL_STRIKE if standing else step.outcome, z.size)
        ahead, period_s, DP = step.z[0], float(step.time[0]) * unit.units.time, step.DP[0]
        angle = float(ahead[0])
        length_m = unit.step_length(float(z[0]), angle) * unit.units.length
        return MappedStep(Outcome.WALKED, ahead, DP, period_s, length_m, angle, period_s)

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        """Return minimum normal force, maximum friction ratio and maximum scuff depth."""
        unit = self._unit_at(p)
        assert unit is not None, "what is watched was walked"
        walker, units = unit.walker, unit.units
        taken = take_walk(walker, WATCHED, on_section(walker, z), steps)
        extremes = (taken.min_normal_force, taken.max_friction_ratio, taken.max_scuff_depth)
        return np.array(extremes) * (units.force, 1.0, units.length)

    def disturbed(self, z: Floats, p: float, heights_m: Floats, push_N_s: float = 0.0) -> DisturbedWalk:
        """Walk from a gait z over footholds (m), after a push just after the heel strike at z."""
        unit = self._unit_at(p)
        assert unit is not None, "what is disturbed has a gait"
        walker, units, section, start = unit.walker, unit.units, unit.section, np.array(on_section(unit.walker, z))
        start = pushed_at_hip(walker, start, push_N_s / units.impulse) if push_N_s != 0.0 else start
        step_length = unit.step_length(float(z[0]), float(z[0]))
        rises = np.diff(heights_m, prepend=heights_m[0]) / units.length
        nearest = SHORTEST_LANDING * step_length if rises.any() else 0.0
        walked = self._exact.walk(section, z, rises.size - 1, False, rises, nearest, start)
        before, after = (states[: len(walked.time)] for states in (walked.strikes.before, walked.strikes.after))
        lengths = step_lengths(walker, np.vstack((start, after))[:-1], before)
        durations = np.diff(walked.time, prepend=0.0) * units.time
        return DisturbedWalk(walked.outcome, durations, lengths * units.length, walked.z[-1] if walked.z.size else z)

    def cost_of_transport(self, z: Floats, p: float) -> float | None:
        unit = self._unit_at(p)
        if unit is None:
            return None
        taken = take_walk(unit.walker, EXACT, on_section(unit.walker, z), 1)
        return float(taken.driven.cost_of_transport(taken.lengths_m[0])) if taken.steps else None

    def ground_after_push(self, z: Floats, p: float, push_N_s: float, steps: int) -> tuple[float, float]:
        """Return the ground's response to a push at the hip; negative values mean that it would have to pull.

        The first is its normal impulse (N s) in the push, the second its minimum normal force (N) in the steps after
        it.
        """
        unit = self._unit_at(p)
        assert unit is not None, "what is pushed has a gait"
        walker, units, start = unit.walker, unit.units, on_section(unit.walker, z)
        pushed = as_state(pushed_at_hip(walker, start, push_N_s / units.impulse))
        impulse = momentum(walker, pushed)[1] - momentum(walker, start)[1]
        walked = take_walk(walker, WATCHED, pushed, steps)
        return impulse * units.impulse, walked.min_normal_force * units.force

    def leg_and_pendulum(self, p: float) -> tuple[float, float]:
        unit = self._unit_at(p)
        assert unit is not None, "what is measured has a gait"
        return unit.units.length, unit.units.time

    def at(self, tolerances: Tolerances) -> RigidMap:
        other = copy(self)
        other.tolerances, other._exact = tolerances, Shooting(self._like, tolerances)
        return other

    def iterate(self, z: Floats, p: float, steps: int, tangent: Floats | None) -> Iterates:
        """Walk at moderate accuracy: on a chaotic attractor errors grow whatever the tolerance."""
        unit, none = self._unit_at(p), np.zeros(0)
        if unit is None:
            return Iterates(Outcome.REJECTED, np.zeros((0, z.size)), none, none, none)
        units, section = unit.units, unit.section
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
    """The similar unit walker, the units, its section, and its feet there."""

    walker: Standing
    units: Units
    section: StrikeSection
    feet: list[list[float]]  # of each body: angle from the slope's normal at z = 0, its change with theta_2, levers
    radius: float
    apart: float  # rad, less the sum of the legs' angles with both feet on the slope

    def step_length(self, before: float, after: float) -> float:
        """Return the length of a step from the stance leg's angles just after its first and last heel strike."""
        behind = 0.0  # from the foot that stood to the one that landed
        for start, turning, x, y in self.feet:
            psi = start + after * turning
            behind += math.cos(psi) * x - math.sin(psi) * y
        return self.radius * (before + after + self.apart) - behind
