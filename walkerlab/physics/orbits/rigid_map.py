"""Step map of the rigid model with its exact derivative, computed for the walker scaled to unit size.

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

from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import as_state, take_walk
from walkerlab.physics.hybrid.rigid_record import Observer, new_idle_observer, new_observer
from walkerlab.physics.hybrid.rigid_walk import EVENTS, SHORTEST_LANDING, HeelStrikes, new_heel_strikes, take_step, walk
from walkerlab.physics.kernels import kernel, kernel_part, matrix, vector
from walkerlab.physics.mechanics import rigid_model as rigid
from walkerlab.physics.mechanics.impact import push_at_hip
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits import step_map as maps
from walkerlab.physics.orbits.similarity import Units, unit_walker
from walkerlab.physics.orbits.step_map import DisturbedWalk, Iterates, MappedStep, Monitor, StepMap, VariedWalk
from walkerlab.physics.solvers.events import CrossingFinder
from walkerlab.physics.solvers.linear import factor, solve
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances, finder_for
from walkerlab.physics.solvers.stepping import BUDGET, H_NEXT, clear_counts
from walkerlab.physics.solvers.system import Floats, Integers, State

WalkerAt = Callable[[float], RigidModel | None]
STEP_WALKED = int(Outcome.WALKED)
# The variational columns are linear and need fewer digits than the state. Scaled down by this factor, they are
# computed to about three digits fewer (with an absolute tolerance of a tenth of the relative one), which halves the
# number of solver steps.
TANGENT_SCALE = 2.0**-13
EXACT_STEPS = Tolerances("dop853", 1e-13, 1e-13, 20_000)
LONG_WALKS = Tolerances("dop853", 1e-9, 1e-11, ENDLESS)  # tolerances for attractors
MONITORED_STEPS = Tolerances("dop853", 1e-13, 1e-13, ENDLESS)
STEPS_PER_BATCH = 8  # steps between renormalisations of a long walk's tangent
KEPT_METHODS = 4  # number of solver methods to keep, one for each number of tangent columns
# Samples later than this fraction of a step are taken at this fraction, so that none falls after the heel strike.
LAST_SAMPLE = 1.0 - 1e-9
# in sqrt(L/g). Standing still is also a fixed point, so any shorter step counts as standing still.
SHORTEST_STEP = 0.05
# Newton's method from random starts gives up after this many evaluations, or if a move is less than this fraction of a
# full one.
MAX_START_EVALUATIONS, SMALLEST_MOVE = 40, 2.0**-6
NO_RESIDUAL = 1e300
NEAR_RESIDUAL = 1e-6
# A search ends at a known gait once it is closer than RECOGNITION_DISTANCE to it and one Newton move with the gait's
# derivative would reduce the distance to less than the fraction RECOGNITION_RESIDUAL.
RECOGNITION_DISTANCE = 0.1
RECOGNITION_RESIDUAL = 0.1
# results of `solve_starts` other than the index of a known gait
NEW_GAIT = -1
NO_GAIT = -2


class StrikeSection(NamedTuple):
    """Section of states just after heel strike, y = start + z basis.

    A state includes its variational columns, which are scaled down.
    """

    walker: Any  # records for compiled code, from `models_in_turn`
    start: Any  # (2 n (1 + d),) the state at z = 0, with its variational columns
    basis: Any  # (d, 2 n)
    places: Any  # (d (1 + d),) indices of z in the state, then in each column
    # the model if its legs differ in length or sole, otherwise None: angles on the section are then linear in z
    curved: RigidModel | None


@lru_cache(maps.CACHE_SIZE)
def strike_section(walker: RigidModel) -> StrikeSection:
    """Return the section of a walker just after heel strike, where its legs are straight."""
    straight = walker.E[rigid.STRAIGHT]
    at_strike = walker.E[rigid.AT_STRIKE]
    d = int(walker.coordinates)
    n = len(straight)
    places = walker.section[:d]
    origin = np.zeros(2 * n)
    basis = np.zeros((d, 2 * n))
    origin[:n] = -rigid.feet_on_slope(walker, 0.0, 0.0) * straight[:, rigid.SWING]
    # With both feet on the slope, the legs' angles have a constant sum.
    basis[0, :n] = straight[:, rigid.STANCE] - straight[:, rigid.SWING]
    basis[1:, n:] = at_strike[:, places[1:] - n].T
    columns = np.add.outer(places, 2 * n * np.arange(1, d + 1))
    start = np.append(origin, TANGENT_SCALE * basis)
    curved = None if walker.alike else walker
    return StrikeSection(rigid.models_in_turn(walker), start, basis, np.append(places, columns), curved)


def angles_on_slope(walker: RigidModel, stance: float) -> tuple[Floats, Floats] | None:
    """Return the bodies' angles (n,) with both feet on the slope, and their derivatives with respect to `stance` (rad).

    The swing leg is behind. Returns None if it is too short or too long to reach the slope.
    """
    psi = stance + walker.slope
    straight = walker.E[rigid.STRAIGHT]
    # height of the hip above the centre of the swing foot's arc, which is one radius above the slope
    raised = rigid.hip_height(walker, np.full(2, stance)) - walker.swing_radius
    length, ahead = (f(walker.swing_hip_x, walker.swing_hip_y) for f in (math.hypot, math.atan2))
    if abs(raised) >= length:
        return None
    behind = math.acos(raised / length)
    # derivative of -acos(raised / length)
    rate = (math.cos(psi) * walker.hip_x - math.sin(psi) * walker.hip_y) / (length * math.sin(behind))
    swing = ahead - behind - walker.slope
    by_swing, by_stance = straight[:, rigid.SWING], straight[:, rigid.STANCE]
    return stance * by_stance + swing * by_swing, by_stance + rate * by_swing


def section_basis(section: StrikeSection, z: Floats) -> Floats:
    """Return the derivatives (d, 2 n) of the state with respect to the section coordinates at z (d,)."""
    if section.curved is None:
        return np.asarray(section.basis)
    basis = np.array(section.basis)
    basis[0, : basis.shape[1] // 2] = maps.valid(angles_on_slope(section.curved, float(z[0])))[1]
    return basis


def state_on_section(walker: RigidModel, z: Any) -> State:
    """Return the state (2 n) at section coordinates z (d,)."""
    return tuple(states_on_section(walker, z).tolist())


def states_on_section(walker: RigidModel, z: Any) -> Floats:
    """Return the states (n, 2 n) at section coordinates z (n, d), or the state at a single z (d,)."""
    section = strike_section(walker)
    states = np.asarray(section.start[: len(walker.zero_state)] + np.asarray(z) @ section.basis)
    if section.curved is not None:
        for state, stance in zip(np.atleast_2d(states), np.atleast_2d(z)[:, 0], strict=True):
            angles = angles_on_slope(walker, float(stance))
            if angles is not None:
                state[: len(state) // 2] = angles[0]
    return states


def coordinates_of(walker: RigidModel, y: Any) -> Floats:
    """Return the section coordinates (d,) of a state (2 n) just after heel strike."""
    return np.asarray(y, float)[walker.section[: walker.coordinates]]


class Steps(NamedTuple):
    """Steps completed from a point of the section."""

    outcome: Outcome  # outcome of the last step attempted
    time: Floats  # (steps,) times of the heel strikes, in units of the walker
    z: Floats  # (steps, d) section coordinates after each step
    DP: Floats  # (steps, d, d) derivatives with respect to the start; empty unless requested
    strikes: HeelStrikes


class StepTangents(NamedTuple):
    """Derivatives of a step with respect to its start (m = 2 n values) and to the rise of its foothold."""

    end: Floats  # (m,) state before the heel strike
    rates: Floats  # (times, 2) rates of swing and stance leg at the sample times
    waits: Floats  # (m + 1,) derivatives of the duration
    before: Floats  # (m + 1, m) derivatives of the state before the heel strike
    after: Floats  # (m + 1, m) derivatives of the state after it
    samples: Floats  # (times, m + 1, 2) derivatives of the angles of swing and stance leg at the sample times


class Memory(NamedTuple):
    varied: Any  # solver method for the equations with a variational column for each coordinate
    finder: CrossingFinder
    observer: Observer
    y: Any  # (2 n (1 + d),) the state with its variational columns
    strikes: HeelStrikes  # heel strikes of one step
    pivots: Any  # (d,)


class RigidStepper(local):
    """Step map of walkers of one kind, with separate working memory in each thread."""

    def __init__(self, like: RigidModel, tolerances: Tolerances) -> None:
        size = len(like.zero_state)
        d = int(like.coordinates)
        self.budget = tolerances.budget
        self.plain = tolerances.new(size)
        varied = tolerances.new(size * (1 + d))
        self.with_columns = lru_cache(KEPT_METHODS)(lambda columns: tolerances.new(size * (1 + columns)))
        finder = finder_for(self.plain, EVENTS, size)
        y = np.zeros(size * (1 + d))
        pivots = np.zeros(d, np.int64)
        self.memory = Memory(varied, finder, new_idle_observer(), y, new_heel_strikes(1, 0, columns=d), pivots)

    def walk(
        self,
        section: StrikeSection,
        z: Floats,
        steps: int = 1,
        derived: bool = True,
        floor: tuple[Floats, float] | None = None,
        start: Floats | None = None,
        observer: Observer | None = None,
    ) -> Steps:
        """Walk from z (d,). The derivative, a third of the work, is skipped if `derived` is false.

        floor  rises and nearest landing, as in `HeelStrikes`, in units of the walker. The default is even ground
        start  (2 n,) state from which to walk instead of z, without a derivative. It need not lie on the section
        """
        d, size = section.basis.shape
        method, columns = (self.memory.varied, d) if derived else (self.plain, 0)
        y = section.start[: method.y.size].copy()
        y[:size] = y[:size] + z @ section.basis if start is None else start
        rises, nearest = floor or (None, 0.0)
        strikes: HeelStrikes = new_heel_strikes(steps, y.size, True, rises, nearest, columns)
        if section.curved is not None and start is None:
            angles = angles_on_slope(section.curved, float(z[0]))
            if angles is None:
                return Steps(Outcome.NO_HEEL_STRIKE, np.zeros(0), np.zeros((0, d)), np.zeros((0, columns, d)), strikes)
            y[: size // 2] = angles[0]
            if derived:
                y[size : size + size // 2] = TANGENT_SCALE * angles[1]
        outcome, completed = self._walk(section, method, observer or self.memory.observer, y, strikes)
        ahead = strikes.after[:completed].take(section.places[: d * (1 + columns)], axis=1)
        DP = ahead[:, d:].reshape(completed, columns, d) / TANGENT_SCALE
        return Steps(outcome, strikes.time[:completed], ahead[:, :d], DP, strikes)

    def _walk(
        self, section: StrikeSection, method: Any, observer: Observer, y: Floats, strikes: HeelStrikes
    ) -> tuple[Outcome, int]:
        """Walk until `strikes` is full or the walk ends, and return the outcome and the number of completed steps."""
        method.counts[:BUDGET] = 0
        method.counts[BUDGET] = min(strikes.time.size * self.budget, ENDLESS)
        # Let the method choose its first step: the last step of an earlier walk would change the result.
        method.clock[H_NEXT] = 0.0
        status, completed = walk(section.walker, method, self.memory.finder, observer, y, strikes)
        return Outcome(status), completed

    def differentiate(
        self, section: StrikeSection, start: Floats, floor: tuple[Floats, float], times: Floats
    ) -> StepTangents | None:
        """Differentiate a step with respect to its start (2 n,) and its foothold's rise, or return None if it fails.

        floor  rises (2,) and nearest landing, as in `HeelStrikes`
        times  (times,) times of samples, from the start of the step
        """
        m = start.size
        # One column for each value of the start, and a zero column for the rise.
        y = np.concatenate((start, TANGENT_SCALE * np.eye(m + 1, m).ravel()))
        strikes: HeelStrikes = new_heel_strikes(1, y.size, True, *floor, m + 1)
        strikes.lift[1, m] = TANGENT_SCALE
        observer = new_observer(times, y.size)._replace(watching=times.size > 0)
        outcome, _ = self._walk(section, self.with_columns(m + 1), observer, y, strikes)
        if outcome is not Outcome.WALKED:
            return None
        before, after = (states.reshape(m + 2, m) for states in (strikes.before, strikes.after))
        samples = observer.states.reshape(times.size, m + 2, m)
        legs = [rigid.SWING, rigid.STANCE]
        rates = samples[:, 0, m // 2 :][:, legs]
        by = (strikes.waits[0], before[1:], after[1:], samples[:, 1:, legs])
        return StepTangents(before[0], rates, *(each / TANGENT_SCALE for each in by))

    def solve_starts(self, section: StrikeSection, gaits: list[tuple[Floats, Floats]], starts: Floats) -> Integers:
        """Run Newton's method from `starts` (starts, d), which are overwritten with the last points tried.

        gaits  known gaits, as section coordinates (d,) and derivative (d, d) of the step map

        Returns for each start (starts,) the index of the known gait reached, NEW_GAIT for another solution, or NO_GAIT.
        """
        d = starts.shape[1]
        z = np.array([z for z, _ in gaits]).reshape(-1, d)
        DP = np.array([DP for _, DP in gaits]).reshape(-1, d, d)
        results = np.zeros(len(starts), np.int64)
        # Take the pseudo-inverse, because I - DP is singular at a fold.
        solve_from_starts(section, self.memory, KnownGaits(z, np.linalg.pinv(np.eye(d) - DP)), starts, results)
        return results


class KnownGaits(NamedTuple):
    """Gaits that the search recognises without solving for them again."""

    z: Any  # (gaits, d)
    inverse: Any  # (gaits, d, d) inverse of I - DP


@kernel
def solve_from_starts(section: StrikeSection, memory: Memory, gaits: KnownGaits, starts: Any, results: Any) -> None:
    for k in range(len(starts)):
        results[k] = solve_from(section, memory, gaits, starts[k])


@kernel_part
def solve_from(section: StrikeSection, memory: Memory, gaits: KnownGaits, z: Any) -> int:
    """Run Newton's method from z (d,), which is overwritten with the last point tried.

    A correction is halved until it reduces the residual. The search gives up on a start at rest or one that leads to no
    heel strike. It stops if a known gait is close and one correction with its derivative would almost reach that gait.
    """
    method = memory.varied
    y = memory.y
    places = section.places
    (d, size), like = section.basis.shape, section.walker[0].section
    best = vector(like)
    move = vector(like)
    system = matrix(like)
    least = NO_RESIDUAL
    share = 1.0
    clear_counts(method)
    for _ in range(MAX_START_EVALUATIONS):
        for i in range(y.size):
            y[i] = section.start[i]
        for i in range(size):
            for j in range(d):
                y[i] += z[j] * section.basis[j, i]
        method.clock[H_NEXT] = 0.0
        status, t = take_step(section.walker, method, memory.finder, memory.observer, 0.0, y, 0, memory.strikes)
        residual = NO_RESIDUAL
        if status == STEP_WALKED and t >= SHORTEST_STEP:
            residual = 0.0
            for i in range(d):
                residual = max(residual, abs(y[places[i]] - z[i]))
        if residual < least:
            least = residual
            share = 1.0
            if residual <= NEAR_RESIDUAL:
                return NEW_GAIT
            for i in range(d):
                best[i], move[i] = z[i], y[places[i]] - z[i]
            for gait in range(len(gaits.z)):
                distance = 0.0
                remaining = 0.0
                for i in range(d):
                    # z + (I - DP)^-1 (P(z) - z) is where Newton's method with the gait's derivative would go.
                    off = z[i] - gaits.z[gait, i]
                    distance = max(distance, abs(off))
                    for j in range(d):
                        off += gaits.inverse[gait, i, j] * move[j]
                    remaining = max(remaining, abs(off))
                if distance < RECOGNITION_DISTANCE and remaining < RECOGNITION_RESIDUAL * distance:
                    return gait
            for i in range(d):
                for j in range(d):
                    system[i, j] = (1.0 if i == j else 0.0) - y[places[d * (i + 1) + j]] / TANGENT_SCALE
            if not factor(system, memory.pivots, d):
                return NO_GAIT
            solve(system, memory.pivots, move, 0, d)
        else:
            share *= 0.5
            # Give up if the start itself leads to no step.
            if least == NO_RESIDUAL or share < SMALLEST_MOVE:
                return NO_GAIT
        for i in range(d):
            z[i] = best[i] + share * move[i]
    return NO_GAIT


def reorder_by_leg(angles: Floats, steps: Integers) -> Floats:
    """Reorder the angles (samples, ..., 2) of swing and stance leg, so that each column belongs to one leg.

    steps  (samples,) number of the step of each sample; the leg that swings in step 0 becomes column 0
    """
    swaps = (steps % 2 == 1).reshape(-1, *[1] * (angles.ndim - 1))
    return np.where(swaps, angles[..., ::-1], angles)


def unit_kicks(walker: RigidModel, section: StrikeSection, start: Floats) -> Floats:
    """Return independent changes (kicks, 2 n) of the rates in a state (2 n,) just after heel strike.

    Multiplied by independent standard normal numbers, they change the rates with covariance s^2 M^-1, where M is the
    mass matrix of the rates that are free there. The factor s makes the change as large as the rates, on average.
    """
    free = section.basis[1:]
    rates = coordinates_of(walker, start)[1:]
    M = free[:, start.size // 2 :] @ rigid.mass_matrix(walker, start) @ free[:, start.size // 2 :].T
    kicks = np.linalg.inv(np.linalg.cholesky(M))
    return np.asarray(np.linalg.norm(rates) / np.linalg.norm(kicks) * kicks @ free)


class LegSwing(NamedTuple):
    """Swing of one leg: the model, the section at its start, and the dimensions that give the length of its step."""

    walker: RigidModel
    section: StrikeSection
    slope: float
    radius: float  # radius of the stance foot
    levers: list[tuple[float, float]]  # lever of each body to the swing foot

    def step_length(self, before: float, end: Floats) -> float:
        """Return a step's length from the stance leg's angle `before` (rad) at its start and the state at its `end`."""
        angles = end[: len(self.levers)].tolist()
        ahead = self.radius * (before - angles[rigid.STANCE])
        for angle, (x, y) in zip(angles, self.levers, strict=True):
            psi = angle + self.slope
            ahead += math.cos(psi) * x - math.sin(psi) * y
        return float(ahead)


def leg_dimensions(walker: RigidModel) -> tuple[float, float, list[tuple[float, float]]]:
    """Return the slope, the radius of the stance foot, and the levers to the swing foot."""
    levers = list(zip(walker.foot_x.tolist(), walker.foot_y.tolist(), strict=True))
    return float(walker.slope), float(walker.radius), levers


class SimilarWalker(NamedTuple):
    """A walker scaled to unit size, with its walks from the section in SI units."""

    walker: RigidModel
    units: Units
    section: StrikeSection
    swings: tuple[LegSwing, ...]  # one for each leg that can swing next, or a single one if the legs are equal
    # by body: angle from the slope's normal at z = 0, derivative of that angle with respect to theta_2, and foot levers
    feet: list[list[float]]
    radius: float
    apart: float  # rad, negative of the sum of the leg angles when both feet are on the slope

    def leg_swing(self, swing: int) -> LegSwing:
        """Return the swing of step number `swing`, as in `Stepper.step`."""
        return self.swings[swing % len(self.swings)]

    def floor(self, z: Floats, heights_m: Floats) -> tuple[Floats, float]:
        """Return the rise to each foothold and the nearest landing (see HeelStrikes), in units of the walker.

        heights_m  (steps + 1,) heights of the footholds, beginning with the present one
        """
        rises = np.diff(heights_m, prepend=heights_m[0]) / self.units.length
        return rises, SHORTEST_LANDING * self.step_length(float(z[0]), float(z[0])) if rises.any() else 0.0

    def step_length(self, before: float, after: float) -> float:
        """Return a step's length from the stance leg's angles (rad) just after the strikes at its start and end."""
        behind = 0.0  # distance along the slope from the landing foot to the old stance foot
        for start, turning, x, y in self.feet:
            psi = start + after * turning
            behind += math.cos(psi) * x - math.sin(psi) * y
        return self.radius * (before + after + self.apart) - behind

    def take_disturbed_walk(
        self, stepper: RigidStepper, z: Floats, heights_m: Floats, push_N_s: float, swing: int
    ) -> DisturbedWalk:
        walker, section, *_ = self.leg_swing(swing)
        units = self.units
        start = np.array(state_on_section(walker, z))
        start = push_at_hip(walker, start, push_N_s / units.impulse) if push_N_s != 0.0 else start
        walk = stepper.walk(section, z, heights_m.size - 1, False, self.floor(z, heights_m), start)
        before, after = (states[: len(walk.time)] for states in (walk.strikes.before, walk.strikes.after))
        starts = np.vstack((start, after))[:-1]
        lengths = rigid.compute_in_turns(walker, np.arange(len(before)), rigid.step_lengths, starts, before)
        durations = np.diff(walk.time, prepend=0.0) * units.time
        last = walk.z[-1] if walk.z.size else z
        return DisturbedWalk(walk.outcome, durations, lengths * units.length, after[:, rigid.STANCE], last)

    def differentiate_walk(
        self, stepper: RigidStepper, z: Floats, heights_m: Floats, along: Floats, times_s: Floats, kicked: bool
    ) -> VariedWalk | None:
        """Differentiate a walk by the chain rule, from derivatives of each step with respect to its start and rise."""
        units = self.units
        d, m = self.section.basis.shape
        steps = heights_m.size - 1
        rises, nearest = self.floor(z, heights_m)
        walk = stepper.walk(self.section, z, steps, False, (rises, nearest))
        if walk.outcome is not Outcome.WALKED:
            return None
        starts = np.vstack((state_on_section(self.walker, z), walk.strikes.after))
        touches = np.append(0.0, walk.time)
        # No kicks at the start, because changes of the start are columns of `along`, and none after the last step.
        kicks = [unit_kicks(*self.leg_swing(step)[:2], starts[step]) for step in range(1, steps)] if kicked else []
        given = along.shape[1]
        count = given + sum(map(len, kicks))
        lifts = np.zeros((steps + 1, count))
        lifts[:, :given] = np.diff(along[d:], axis=0, prepend=along[d : d + 1]) / units.length
        columns = np.zeros((count, m))
        since = np.zeros(count)
        columns[:given] = along[:d].T @ section_basis(self.section, z)
        of_step = np.clip(np.searchsorted(touches, times_s / units.time, "right") - 1, 0, steps - 1)
        parts = list[tuple[Floats, ...]]()
        for step, start in enumerate(starts[:-1]):
            walker, section, *_ = self.leg_swing(step)
            room = LAST_SAMPLE * (touches[step + 1] - touches[step])
            times = np.minimum(times_s[of_step == step] / units.time - touches[step], room)
            tangents = stepper.differentiate(section, start, (rises[step : step + 2], nearest), times)
            if tangents is None:
                return None
            moved = np.column_stack((columns, lifts[step + 1]))
            before, after = moved @ tangents.before, moved @ tangents.after
            lengths = rigid.step_length_changes(walker, tangents.end[None], columns[None], before[None])[0]
            # The sample times are fixed, so if a step begins later, its samples lie earlier within it.
            samples = np.einsum("ck,tkl->tcl", moved, tangents.samples) - since[:, None] * tangents.rates[:, None]
            parts.append((moved @ tangents.waits, lengths, after[:, rigid.STANCE], tangents.rates, samples))
            columns = after
            since = since + parts[-1][0]
            if step < len(kicks):
                first = given + sum(map(len, kicks[:step]))
                columns[first : first + len(kicks[step])] = kicks[step]
        durations, lengths, angles = (np.array(each) for each in list(zip(*parts, strict=True))[:3])
        rates, samples = (np.concatenate(each) for each in list(zip(*parts, strict=True))[3:])
        return VariedWalk(
            durations * units.time,
            lengths * units.length,
            angles,
            reorder_by_leg(rates, of_step) / units.time,
            reorder_by_leg(samples, of_step),
        )


class RigidMap(StepMap):
    """Step map of the rigid model, in section coordinates of the walker scaled to unit size."""

    monitors = (
        Monitor("min_normal_force_N", "N", "minimum normal force on the stance foot", 0.0),
        Monitor("max_friction_ratio", "1", "largest ratio of tangential to normal force"),
        Monitor("max_scuff_depth_m", "m", "largest depth of the swing foot below the slope"),
    )

    tolerances = MONITORED_STEPS
    probe = 2e-5

    def __init__(self, walker_at: WalkerAt, scale: float, like: RigidModel, exact: Tolerances = EXACT_STEPS) -> None:
        """Prepare the map of a family of walkers.

        walker_at  function from the parameter to a walker, or to None if the value gives no valid walker
        scale      size of a typical change of the parameter
        like       any walker of the family
        """

        @lru_cache(maps.CACHE_SIZE)
        def unit_at(p: float) -> SimilarWalker | None:
            walker = walker_at(p)
            if walker is None:
                return None
            unit, units = unit_walker(walker)
            section = strike_section(unit)
            n = len(unit.arm_x)
            feet = np.array((section.start[:n] + unit.slope, section.basis[0, :n], unit.foot_x, unit.foot_y)).T
            walkers = (unit, unit.exchanged) if unit.legs_differ else (unit,)
            swings = tuple(LegSwing(each, strike_section(each), *leg_dimensions(each)) for each in walkers)
            rolling = float(unit.radius), float(-section.start[rigid.SWING])
            return SimilarWalker(unit, units, section, swings, feet.tolist(), *rolling)

        self._unit_at = unit_at
        self.scale = scale
        self._like = like
        self._exact = RigidStepper(like, exact)

    @cached_property
    def _quick(self) -> RigidStepper:
        return RigidStepper(self._like, LONG_WALKS)

    def step(self, z: Floats, p: float, derived: bool = True, swing: int = 0) -> MappedStep:
        unit = self._unit_at(p)
        if unit is None:
            return maps.failed_step(None, z.size)
        leg = unit.leg_swing(swing)
        step = self._exact.walk(leg.section, z, derived=derived)
        if step.outcome is not Outcome.WALKED or step.time[0] < SHORTEST_STEP:
            standing = step.outcome is Outcome.WALKED
            return maps.failed_step(Outcome.NO_HEEL_STRIKE if standing else step.outcome, z.size)
        ahead = step.z[0]
        period_s = float(step.time[0]) * unit.units.time
        angle = float(ahead[0])
        if len(unit.swings) > 1:
            length = leg.step_length(float(z[0]), step.strikes.before[0])
        else:
            length = unit.step_length(float(z[0]), angle)
        length_m = length * unit.units.length
        return MappedStep(Outcome.WALKED, ahead, step.DP[0], period_s, length_m, angle, period_s)

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        unit = maps.valid(self._unit_at(p))
        walk = take_walk(unit.walker, MONITORED_STEPS, state_on_section(unit.walker, z), steps)
        extremes = (walk.min_normal_force, walk.max_friction_ratio, walk.max_scuff_depth)
        return np.array(extremes) * (unit.units.force, 1.0, unit.units.length)

    def take_disturbed_walk(
        self, z: Floats, p: float, heights_m: Floats, push_N_s: float = 0.0, swing: int = 0
    ) -> DisturbedWalk:
        return maps.valid(self._unit_at(p)).take_disturbed_walk(self._exact, z, heights_m, push_N_s, swing)

    def sample_legs(self, z: Floats, p: float, heights_m: Floats, times_s: Floats) -> Floats:
        unit = maps.valid(self._unit_at(p))
        observer = new_observer(times_s / unit.units.time, len(unit.walker.zero_state))
        floor = unit.floor(z, heights_m)
        self._exact.walk(unit.section, z, heights_m.size - 1, False, floor, observer=observer)
        return reorder_by_leg(observer.states[:, [rigid.SWING, rigid.STANCE]], observer.steps)

    def differentiate_walk(
        self,
        z: Floats,
        p: float,
        heights_m: Floats,
        along: Floats,
        times_s: Floats = maps.NO_TIMES,
        kicked: bool = False,
    ) -> VariedWalk | None:
        unit = self._unit_at(p)
        return None if unit is None else unit.differentiate_walk(self._exact, z, heights_m, along, times_s, kicked)

    def cost_of_transport(self, z: Floats, p: float) -> float | None:
        unit = self._unit_at(p)
        if unit is None:
            return None
        count = len(unit.swings)
        walk = take_walk(unit.walker, EXACT_STEPS, state_on_section(unit.walker, z), count)
        return float(walk.driven.cost_of_transport(walk.lengths_m.sum())) if walk.steps == count else None

    def ground_after_push(
        self, z: Floats, p: float, push_N_s: float, steps: int, swing: int = 0
    ) -> tuple[float, float]:
        """Return the ground's normal impulse (N s) in a push at the hip and its minimum normal force (N) afterwards."""
        # Negative values mean that the ground would have to pull.
        unit = maps.valid(self._unit_at(p))
        walker = unit.leg_swing(swing).walker
        start = state_on_section(walker, z)
        pushed = as_state(push_at_hip(walker, start, push_N_s / unit.units.impulse))
        impulse = rigid.momentum(walker, pushed)[1] - rigid.momentum(walker, start)[1]
        walk = take_walk(walker, MONITORED_STEPS, pushed, steps)
        return impulse * unit.units.impulse, walk.min_normal_force * unit.units.force

    def leg_and_pendulum(self, p: float) -> tuple[float, float]:
        unit = maps.valid(self._unit_at(p))
        return unit.units.length, unit.units.time

    def replace_tolerances(self, tolerances: Tolerances) -> RigidMap:
        changed = copy(self)
        changed.tolerances, changed._exact = tolerances, RigidStepper(self._like, tolerances)
        return changed

    def iterate(self, z: Floats, p: float, steps: int, tangent: Floats | None) -> Iterates:
        """Walk at moderate accuracy, since on a chaotic attractor errors grow whatever the tolerance."""
        unit = self._unit_at(p)
        none = np.zeros(0)
        if unit is None:
            return Iterates(Outcome.REJECTED, np.zeros((0, z.size)), none, none, none)
        outcome = Outcome.WALKED
        batch = steps if tangent is None else STEPS_PER_BATCH
        points = list[Floats]()
        growth = [none]
        times = list[Floats]()
        while outcome is Outcome.WALKED and len(points) * batch < steps:
            part = self._quick.walk(unit.section, z, min(batch, steps - len(points) * batch), tangent is not None)
            outcome = part.outcome
            points.append(part.z)
            times.append(np.diff(part.time, prepend=0.0))
            if tangent is not None and part.time.size:
                images = part.DP @ tangent
                sizes = np.linalg.norm(images, axis=1)
                growth.append(sizes / np.append(1.0, sizes[:-1]))
                z = part.z[-1]
                tangent = images[-1] / sizes[-1]
        all_points = np.concatenate(points)
        periods = np.concatenate(times) * unit.units.time
        return Iterates(outcome, all_points, np.concatenate(growth), periods, all_points[:, 0])
