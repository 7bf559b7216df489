"""What is recorded of a rigid walk besides its heel strikes: samples, extremes of what the model assumes, energy."""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.hybrid.hip_torque import torque_work
from walkerlab.kernels import by_reference, inlined, vector
from walkerlab.mechanics.hinges import hip_law
from walkerlab.mechanics.impact import push_off
from walkerlab.mechanics.standing import Mode, energies, ground_reaction, momentum, swing_foot
from walkerlab.mechanics.tree import new_record, read_at_once, record_type
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.stepping import T_OLD, T, interpolate, sample

NO_FORCE = 1e300  # above any normal force
CLOSER = 3  # parabolas to an extremum
# composite Simpson rule on eighths
SIMPSON = (1.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 1.0 / 24.0)


@read_at_once
class RigidTally(np.record):  # type: ignore[misc]  # NumPy's stubs call one of its bases final
    """Counts, extremes and energies of a walk: a structured scalar that kernels write to."""

    recorded: int  # samples
    min_normal_force: float  # N
    max_friction_ratio: float  # |T / N|
    max_scuff_depth: float  # m
    energy_drift: float  # J, the largest in a swing
    min_impulse: float  # N s, the smallest normal one of the strikes
    max_impulse_ratio: float  # the largest ratio of a strike's tangential impulse to its normal one
    lowest_energy: float  # J, from the stance foot, of this swing
    highest_energy: float
    latest_energy: float
    energy_integral: float  # J s, over time
    duration: float  # s
    lost_in_strikes: float  # J, kinetic energy that the strikes of the steps taken cost
    lost_in_step: float  # J, the same of the step at hand
    forward: float  # J, positive work of the hip's constant torque in the steps taken
    forward_in_step: float  # J, the same of the step at hand


RIGID_TALLY = record_type(RigidTally, {})


def new_tally() -> RigidTally:
    """The tally of a walk that has not begun."""
    tally: RigidTally = new_record(RIGID_TALLY, min_normal_force=NO_FORCE, min_impulse=NO_FORCE)
    return tally


@by_reference
class Observer(NamedTuple):
    """What is recorded of a walk besides its heel strikes; nothing, if it is not `watching`."""

    watching: bool
    times: Any  # (samples,) s, rising
    states: Any  # (samples, 2 n)
    steps: Any  # (samples,) which step a sample belongs to
    tally: RigidTally


def new_observer(times: Any, numbers: int) -> Observer:
    """An observer with memory for samples of a state of some `numbers` at `times` (s, rising)."""
    return Observer(True, times, np.zeros((times.size, numbers)), np.zeros(times.size, np.int64), new_tally())


def unwatched() -> Observer:
    """The observer of a walk of which only the heel strikes are wanted."""
    return new_observer(np.zeros(0), 0)._replace(watching=False)


@inlined
def observe_start(observer: Observer, mode: Mode, y: Any) -> None:
    """Take note of the start of a swing phase, whose energy it must keep."""
    if observer.watching:
        kinetic, potential = energies(mode.model, y)
        observer.tally.lowest_energy = observer.tally.highest_energy = kinetic + potential
        record_extremes(observer, mode, y)


@inlined
def observe_strike(observer: Observer, mode: Mode, heel: bool, before: Any, after: Any) -> None:
    """Record what a strike of knee or heel takes, and the ground's impulse on the foot that stands afterwards.

    That impulse is all of the change of momentum but the push-off's part. A heel strike ends the step at hand.
    """
    if observer.watching:
        model, tally = mode.model, observer.tally
        along, normal = momentum(model, before)
        along_after, normal_after = momentum(model, after)
        along, impulse = along_after - along, normal_after - normal
        tally.lost_in_step += energies(model, before)[0] - energies(model, after)[0]
        if heel:
            if model.push_off != 0.0:
                push = push_off(model, after)
                along, impulse = along - push.along, impulse - push.upward
                tally.max_impulse_ratio = max(tally.max_impulse_ratio, abs(push.along) / push.upward)
            tally.lost_in_strikes += tally.lost_in_step
            tally.forward += tally.forward_in_step
            tally.lost_in_step = tally.forward_in_step = 0.0
        tally.min_impulse = min(tally.min_impulse, impulse)
        if impulse > 0.0:
            tally.max_impulse_ratio = max(tally.max_impulse_ratio, abs(along) / impulse)


@inlined
def assumptions(mode: Mode, y: Any) -> tuple[float, float, float]:
    """What the model assumes (section 3.1 of the paper), worst where largest.

    Pull of the ground (N), friction ratio where it pushes, depth of the swing foot (m).
    """
    along, normal = ground_reaction(mode, y)
    ratio = abs(along) / normal if normal > 0.0 else 0.0
    return -normal, ratio, -swing_foot(mode.model, y)[0]


@inlined
def assumptions_at(method: Any, mode: Mode, fraction: float) -> tuple[float, float, float]:
    """`assumptions` at a fraction of the last step."""
    y = vector(mode.model.zero_state)
    interpolate(method, mode, fraction, y)
    return assumptions(mode, y)


@inlined
def keep_worst(observer: Observer, worst: tuple[float, float, float]) -> None:
    """Keep the worst of what the model assumes."""
    tally = observer.tally
    tally.min_normal_force = min(tally.min_normal_force, -worst[0])
    tally.max_friction_ratio = max(tally.max_friction_ratio, worst[1])
    tally.max_scuff_depth = max(tally.max_scuff_depth, worst[2])


@inlined
def record_extremes(observer: Observer, mode: Mode, y: Any) -> tuple[float, float, float]:
    """Keep the worst of what the model assumes, and the energy."""
    tally, worst = observer.tally, assumptions(mode, y)
    keep_worst(observer, worst)
    kinetic, potential = energies(mode.model, y)
    now = kinetic + potential
    tally.lowest_energy, tally.highest_energy = min(tally.lowest_energy, now), max(tally.highest_energy, now)
    tally.latest_energy = now
    tally.energy_drift = max(tally.energy_drift, tally.highest_energy - tally.lowest_energy)
    return worst


@inlined
def vertex(before: float, at: float, after: float) -> float:
    """Where between three evenly spaced values (at -1, 0, 1) the parabola through them is largest; beyond: nowhere."""
    bend = before - 2.0 * at + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 2.0


@inlined
def ascend_to_worst(
    observer: Observer, method: Any, mode: Mode, measure: int, middle: float, spacing: float, last: float
) -> None:
    """Follow a measure of `assumptions` to its maximum near `middle` of the step, by parabolas that close in.

    The fractions of the step are kept below `last`.
    """
    for _ in range(CLOSER):
        before = assumptions_at(method, mode, middle - spacing)
        at = assumptions_at(method, mode, middle)
        after = assumptions_at(method, mode, middle + spacing)
        shift = vertex(before[measure], at[measure], after[measure])
        if abs(shift) > 1.0:
            return
        middle += shift * spacing
        keep_worst(observer, assumptions_at(method, mode, middle))
        spacing *= 0.125
        middle = min(max(middle, spacing), last - spacing)


@inlined
def observe(
    observer: Observer, method: Any, mode: Mode, finder: CrossingFinder, row: int, fraction: float, step: int
) -> None:
    """Take note of the last integration step up to `fraction` of it; its dense output is ready.

    Samples that fall into it are kept; extremes and the energy's integral are taken from eighths of it.

    row  of the finder's values that is free
    """
    torque = hip_law(mode.model).torque
    if torque != 0.0:
        sample(method, mode, finder.nodes, finder.states)
        observer.tally.forward_in_step += torque_work(torque, method, mode, finder, row, fraction).positive
    t, h = method.clock[T_OLD], method.clock[T] - method.clock[T_OLD]
    t_end, spacing = t + fraction * h, 0.125 * fraction
    mean_energy = SIMPSON[0] * observer.tally.latest_energy
    y = vector(mode.model.zero_state)
    before = at = assumptions_at(method, mode, 0.0)
    for eighth in range(1, 9):
        interpolate(method, mode, spacing * eighth, y)
        after = record_extremes(observer, mode, y)
        mean_energy += SIMPSON[eighth] * observer.tally.latest_energy
        for measure in range(3):
            if eighth > 1 and abs(vertex(before[measure], at[measure], after[measure])) <= 1.0:
                ascend_to_worst(observer, method, mode, measure, spacing * (eighth - 1), spacing, fraction)
        before, at = at, after
    observer.tally.energy_integral += mean_energy * fraction * h
    observer.tally.duration += fraction * h
    index = observer.tally.recorded
    while index < observer.times.size and observer.times[index] <= t_end:
        interpolate(method, mode, (observer.times[index] - t) / h, y)
        for i in range(len(y)):
            observer.states[index, i] = y[i]
        observer.steps[index] = step
        index += 1
    observer.tally.recorded = index
