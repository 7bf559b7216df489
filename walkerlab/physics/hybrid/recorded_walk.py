"""Recorded walks of the rigid model, simulated in blocks of a few dozen steps to save memory."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid import rigid_walk
from walkerlab.physics.hybrid.endings import ON_GROUND, STRAIGHT_KNEE
from walkerlab.physics.hybrid.rigid_record import Observer, RigidTally, new_observer, observe_start
from walkerlab.physics.hybrid.walk_record import Array, DrivenWork, WalkRecord, WalkWork
from walkerlab.physics.kernels import uncompiled
from walkerlab.physics.mechanics import rigid_model as rigid
from walkerlab.physics.mechanics.hinges import HIP_ROW, SpringDamper, hinge_energy, hinge_law
from walkerlab.physics.mechanics.impact import push_off_work
from walkerlab.physics.mechanics.rigid_model import Mode, RigidModel
from walkerlab.physics.solvers.registry import Tolerances, finder_for
from walkerlab.physics.solvers.stepping import BUDGET, RHS, clear_counts
from walkerlab.physics.solvers.system import State

STEPS_AT_ONCE = 64
# evaluations of the right-hand side; the tightest tolerance needs about 700
BUDGET_OF_A_STEP = 50_000
# friction coefficient, about as for rubber on dry concrete
MAX_FRICTION = 1.0
SAMPLES_PER_UNIT_TIME = 64  # the unit of time is sqrt(L/g)
MAXIMA = ("max_friction_ratio", "max_scuff_depth", "energy_drift", "max_impulse_ratio")  # fields of tally and result
# A sample closer to a heel strike than this fraction of the sampling interval is dropped.
CLOSEST_SAMPLES = 1e-2


class Samples(NamedTuple):
    """Samples of a walk, on a regular grid and on both sides of every heel strike."""

    # (samples,) strictly increasing; the times of the samples just before and after a heel strike are adjacent floats
    time_s: Array
    state: Array  # (samples, 2 n) rad, rad/s, swing leg first
    step: NDArray[np.int64]  # (samples,) number of the step, from 0
    bent: NDArray[np.bool_]  # (samples,) whether the swing leg's knee is free


@dataclass(frozen=True, eq=False)
class RigidWalkResult(WalkRecord):
    """Result of a walk of the rigid model."""

    start: State
    before: Array  # (steps, 2 n) states just before the touches
    after: Array  # (steps, 2 n) states just after the touches, with the legs' roles exchanged
    min_normal_force: float  # N, force of the ground on the stance foot
    max_friction_ratio: float  # tangential over normal force while the ground pushes; 0 if it never pushes
    max_scuff_depth: float  # m, depth of the swing foot below the slope
    min_normal_impulse: float | None  # N s, normal impulse of the ground in a strike; None if no step was completed
    max_impulse_ratio: float  # tangential over normal impulse while the ground pushes; 0 if it never pushes
    energy_balance_residual: float  # J, over all completed steps
    lost_in_strikes: float  # J
    energy_drift: float  # J, largest range of the energy within a swing
    mean_energy: float  # J, mean over time; heights are measured from the contact point at the touch before each step
    samples: Samples | None

    @property
    def objections(self) -> tuple[str, ...]:
        """Reasons why real ground would not support this walk."""
        reasons = describe_pulls(self.min_normal_force, self.min_normal_impulse or 0.0)
        if self.max_friction_ratio > MAX_FRICTION:
            reasons.append(
                f"the stance foot would slip: it needs a friction coefficient of {self.max_friction_ratio:.3g}, "
                f"and hardly any ground provides more than {MAX_FRICTION:g}"
            )
        return tuple(reasons)

    @property
    def final_state(self) -> State:
        """State after the last heel strike, or the start if there was none."""
        return as_state(self.after[-1]) if self.steps else self.start


def describe_pulls(min_force: float, min_impulse: float) -> list[str]:
    """Describe the pull that the ground would have to exert. The list is empty if no pull is needed.

    min_force    minimum normal force (N)
    min_impulse  minimum normal impulse in a strike (N s)
    """
    pulls = ((-min_force, "N"), (-min_impulse, "N s in a strike"))
    return [f"the ground would have to pull with {pull:.3g} {unit}" for pull, unit in pulls if pull > 0.0]


def as_state(values: Any) -> State:
    """Convert values to the tuple of floats that compiled code takes as a state."""
    return tuple(float(value) for value in values)


def take_walk(
    walker: RigidModel,
    tolerances: Tolerances,
    start: State,
    steps: int,
    sampled: bool = False,
    advance: Callable[[int], None] | None = None,
    heights: Array | None = None,
    step_length: float | None = None,
) -> RigidWalkResult:
    """Walk `steps` steps from `start`, or until the walk ends, with a limited budget of evaluations per step.

    advance      called after each block with the number of steps taken in it
    heights      (steps + 1,) m, heights of the footholds above the slope, the one at the start first; None for even
                 ground
    step_length  m, step length of the gait, by default the distance between the feet at the start. On uneven ground, a
                 foot that lands less than a quarter of it ahead of the other foot ends the walk as a fall

    A negative normal force does not stop the walk, since the model's feet cannot lift off, but it sets the outcome.
    """
    recorder = Recorder(walker, tolerances, start, sampled)
    recorder.heights = heights
    rises = np.zeros(steps + 1) if heights is None else np.diff(heights, prepend=heights[0])
    if rises.any():
        judged_by = abs(rigid.swing_foot(walker, start)[1]) if step_length is None else step_length
        recorder.nearest = rigid_walk.SHORTEST_LANDING * judged_by
    height = rigid.swing_foot(walker, start)[0]
    # The walk starts in mid-step, so the swing foot leaves no foothold, and its own height takes the place of one.
    # Otherwise its event function would be taken for zero at the start.
    if abs(height) > ON_GROUND * walker.leg_length:
        rises[0] = -height
        recorder.locked = walker.kneed and is_straight(walker, start)
    if rigid_walk.hip_above_fall(walker, start) < 0.0:
        return recorder.build_result(Outcome.REJECTED)
    status = Outcome.WALKED
    while recorder.steps < steps and status == Outcome.WALKED:
        before = recorder.steps
        status = recorder.walk_on(rises[before : before + STEPS_AT_ONCE + 1])
        if advance is not None:
            advance(recorder.steps - before)
    return recorder.build_result(status)


def is_straight(walker: RigidModel, start: State) -> bool:
    """Whether thigh and shank of the swing leg have the same angle and rate."""
    knees = (rigid_walk.knee_angle(walker, start, first) for first in (0, len(start) // 2))
    return all(abs(knee) < STRAIGHT_KNEE for knee in knees)


class Recorder:
    """Simulates a walk in blocks of steps, and accumulates their records."""

    def __init__(self, walker: RigidModel, tolerances: Tolerances, start: State, sampled: bool) -> None:
        self.walker = walker
        self.sampled = sampled
        self.budget = tolerances.budget
        self.method = method = tolerances.new(len(walker.zero_state))
        self.start = self.state = start
        self.heights: Array | None = None
        self.nearest = 0.0
        self.locked = False  # whether the swing leg's knee is locked from the start
        self.time = 0.0
        self.steps = 0
        self.grid_index = 0
        self.interval = math.sqrt(walker.leg_length / walker.gravity) / SAMPLES_PER_UNIT_TIME
        self.finder = finder_for(method, rigid_walk.EVENTS, len(walker.zero_state))
        # Walks with a method of another library run in Python.
        self.walk = rigid_walk.walk if tolerances.compiled else uncompiled(rigid_walk.walk)
        self.numbers = len(walker.zero_state)
        self.kneed = walker.kneed or walker.exchanged.kneed
        self.models = rigid.models_in_turn(walker)
        self.seen = new_observer(np.zeros(0), self.numbers)
        self.tally: RigidTally = self.seen.tally[()]
        self.counts = np.zeros_like(method.counts)
        no_states = np.zeros((0, self.numbers))
        # times of the heel strikes, states before and after them, and times of the knee strikes, block by block
        self.blocks = [(np.zeros(0), no_states, no_states, np.zeros(0))]
        self.pieces: list[Samples] = []

    def walk_on(self, rises: Array) -> Outcome:
        """Take up to `rises.size - 1` more steps. `rises` (m) begins with the rise to the present foothold."""
        steps = rises.size - 1
        seen = rigid_walk.new_heel_strikes(steps, self.numbers, self.kneed, rises, self.nearest)
        times = np.zeros(0)
        if self.sampled:
            # Enough samples even if every step takes the longest time that a swing may take.
            room = math.ceil(steps * rigid_walk.LONGEST_SWING * SAMPLES_PER_UNIT_TIME) + 1
            # Within a block of steps, time is counted from the start of the block.
            times = self.interval * np.arange(self.grid_index, self.grid_index + room, dtype=np.float64) - self.time
        if self.locked and self.steps == 0:
            seen.knee_time[0] = -1.0
        observer = new_observer(times, self.numbers)
        clear_counts(self.method)
        self.method.counts[BUDGET] = min(steps * BUDGET_OF_A_STEP, self.budget - int(self.counts[RHS]))
        status, taken = self.walk(self.models, self.method, self.finder, observer, np.array(self.state), seen)
        self.counts += self.method.counts
        total = self.tally
        part = observer.tally[()]
        for name in ("min_normal_force", "min_impulse"):
            total[name] = min(total[name], part[name])
        for name in MAXIMA:
            total[name] = max(total[name], part[name])
        for name in ("strike_loss", "forward_work", "energy_integral", "duration"):
            total[name] += part[name]
        strikes = seen.time[:taken] + self.time
        before = seen.before[:taken]
        after = seen.after[:taken]
        knees = np.where(seen.knee_time < 0.0, np.nan, seen.knee_time + self.time)
        # There are no knee strikes in steps in which a leg without a knee swings.
        for k, shank in enumerate(self.models["shank"]):
            knees[k :: self.models.size] = knees[k :: self.models.size] if shank != rigid.NO_SHANK else np.nan
        if self.sampled:
            self.pieces.append(self._samples(observer, strikes, before, after, knees))
        self.blocks.append((strikes, before, after, knees[:taken] if self.kneed else np.zeros(0)))
        self.steps += taken
        if taken:
            self.state = as_state(after[-1])
            self.time = float(strikes[-1])
        return Outcome(status)

    def _samples(self, observer: Observer, strikes: Array, before: Array, after: Array, knees: Array) -> Samples:
        """Merge the samples on the grid with samples on both sides of the heel strikes."""
        count = int(observer.tally[()].recorded)
        grid = self.interval * np.arange(self.grid_index, self.grid_index + count, dtype=np.float64)
        self.grid_index += count
        events = np.append(strikes, self.time) if self.steps else strikes
        kept = are_far_from(grid, np.sort(events), CLOSEST_SAMPLES * self.interval)
        swing = self.steps + np.arange(strikes.size)
        # A strike has two states, before and after. Giving them adjacent floats as times keeps the samples in order.
        time = np.concatenate((grid[kept], np.nextafter(strikes, -np.inf), strikes))
        state = np.concatenate((observer.states[:count][kept], before, after))
        step = np.concatenate((self.steps + observer.steps[:count][kept], swing, swing + 1))
        # A knee that has not struck yet is free, unless it is locked from the start.
        until = np.append(np.where(np.isnan(knees), -np.inf, np.where(knees > self.time, knees, np.inf)), np.inf)
        bent = time < until[step - self.steps] if self.kneed else np.zeros(time.size, np.bool_)
        order = np.argsort(time)
        return Samples(time[order], state[order], step[order], bent[order])

    def build_result(self, outcome: Outcome) -> RigidWalkResult:
        # If no swing has begun, the start has not been observed yet.
        if self.tally.duration == 0.0:
            observe_start(self.seen, Mode(self.walker, rigid.BENT), self.start)
        end_time = self.time if outcome == Outcome.WALKED else float(self.tally.duration)
        if outcome == Outcome.WALKED and self.tally.min_normal_force < 0.0:
            outcome = Outcome.LIFTED_OFF
        strikes, before, after, knees = map(np.concatenate, zip(*self.blocks, strict=True))
        walker = self.walker
        # Steps and starts have no names, because a long walk would keep their memory until the end.
        lengths = rigid.compute_in_turns(
            walker, np.arange(len(before)), rigid.step_lengths, np.vstack((self.start, after))[:-1], before
        )
        climbed = 0.0 if self.heights is None else float(self.heights[self.steps])
        gravity = float(walker.mass) * float(walker.gravity_along * lengths.sum() - walker.gravity_down * climbed)
        driven, residual = driven_work(walker, self.tally, self.start, before, after, gravity)
        return RigidWalkResult(
            outcome=outcome,
            touch_time_s=strikes,
            touch_along_m=np.cumsum(lengths),
            knee_strike_time_s=knees if self.kneed else None,
            end_time_s=end_time,
            work=WalkWork(*self.counts[:BUDGET].tolist()),
            foothold_height_m=None if self.heights is None else self.heights[1 : self.steps + 1],
            driven=driven,
            energy_balance_residual=residual,
            # `strike_loss` is the loss minus the work of the push-offs.
            lost_in_strikes=float(self.tally.strike_loss) + driven.push_off,
            start=self.start,
            before=before,
            after=after,
            min_normal_force=float(self.tally.min_normal_force),
            min_normal_impulse=float(self.tally.min_impulse) if self.steps else None,
            **{name: float(self.tally[name]) for name in MAXIMA},
            mean_energy=mean_energy(walker, self.tally, self.start, strikes, after),
            samples=Samples(*map(np.concatenate, zip(*self.pieces, strict=True))) if self.pieces else None,
        )


def mean_energy(walker: RigidModel, tally: RigidTally, start: State, strikes: Array, after: Array) -> float:
    """Compute the time mean of the energy (J), with heights from the contact point at the touch before each step."""
    touched = np.append(start[rigid.STANCE], after[:, rigid.STANCE])
    zeros = rigid.compute_in_turns(walker, np.arange(touched.size), rigid.energy_at_touch, touched)
    if tally.duration == 0.0:
        return float(sum(rigid.energies(walker, start)) - zeros[0])
    # The last duration is that of a swing without a heel strike.
    durations = np.diff(strikes, prepend=0.0, append=max([float(tally.duration), *strikes[-1:]]))
    return float((tally.energy_integral - zeros @ durations) / float(tally.duration))


def driven_work(
    walker: RigidModel, tally: RigidTally, start: State, before: Array, after: Array, gravity: float
) -> tuple[DrivenWork, float]:
    """Compute the work done in the completed steps and the energy residual (J). `gravity` is gravity's work (J)."""
    # A push-off does its work before the strike, which loses part of it. The work of a damper cannot be computed from
    # the states before and after strikes, so it is taken from the energy balance, which then leaves no residual.
    rows = range(len(walker.hinges))
    laws = [hinge_law(walker, row) for row in rows]
    starts = np.vstack((start, after[:-1])) if len(after) else before
    apart = [[each[:, body] - each[:, other] for body, other in walker.hinges] for each in (starts, before)]
    torque = float(laws[HIP_ROW].torque * (apart[1][HIP_ROW] - apart[0][HIP_ROW]).sum())
    stored = [elastic_energies(laws[row], apart[1][row]) - elastic_energies(laws[row], apart[0][row]) for row in rows]
    hip = torque - float(np.sum(stored))
    # The energy of the springs counts as work of the hip, so it must not count again in the energies.
    unsprung = walker.changed(laws=0.0) if walker.sprung else walker
    last = unsprung.exchanged if len(after) % 2 else unsprung
    ends = [
        sum(rigid.energies(model, y)) - rigid.energy_at_touch(model, y[rigid.STANCE])
        for model, y in ((unsprung, start), (last, as_state(after[-1]) if len(after) else start))
    ]
    residual = float(ends[1] - ends[0] - gravity - hip + tally.strike_loss)
    knees = residual if walker.damped_knees else None
    hip = hip + residual if laws[HIP_ROW].damping else hip
    residual = 0.0 if knees is not None or laws[HIP_ROW].damping else residual
    pushed = walker.push_off or walker.exchanged.push_off
    push = float(rigid.compute_in_turns(walker, np.arange(len(before)), push_off_work, before).sum()) if pushed else 0.0
    weight = float(walker.mass * walker.gravity)
    return DrivenWork(weight, gravity, push, hip, torque, float(tally.forward_work), knees), abs(residual)


def elastic_energies(law: SpringDamper, angles: Array) -> Array:
    """Return the elastic energy (J) of a hinge law at each angle, one by one, because not all laws take arrays."""
    return np.fromiter((hinge_energy(law, angle) for angle in angles), float, len(angles))


def scale_rates(walker: RigidModel, state: State, swing: float, stance: float) -> State:
    """Return a state just after heel strike with the velocities of swing and stance leg scaled."""
    n = len(state) // 2
    rates = [(stance if body == rigid.STANCE else swing) * rate for body, rate in enumerate(state[n:])]
    return (*state[:n], *rigid.apply_couplings(walker, rigid.AT_STRIKE, rates).tolist())


def are_far_from(times: Array, events: Array, distance: float) -> NDArray[np.bool_]:
    if events.size == 0:
        return np.ones(times.size, np.bool_)
    behind = np.searchsorted(events, times).clip(max=events.size - 1)
    before = (behind - 1).clip(min=0)
    return np.asarray(np.minimum(np.abs(times - events[behind]), np.abs(times - events[before])) > distance)
