"""What is recorded of a rigid walk besides its heel strikes: samples, extremes of what the model assumes, energy."""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.hybrid.hip_torque import torque_work
from walkerlab.kernels import by_reference, inlined, vector
from walkerlab.mechanics.hinges import HIP_ROW, hinge_law
from walkerlab.mechanics.impact import push_off
from walkerlab.mechanics.standing import Mode, energies, ground_reaction, momentum, swing_foot
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.stepping import T_OLD, T, interpolate, sample

NO_FORCE = 1e300  # above any normal force
# indices into Observer.extremes
MIN_NORMAL_FORCE, MAX_FRICTION_RATIO, MAX_SCUFF_DEPTH, ENERGY_DRIFT, MIN_IMPULSE, MAX_IMPULSE_RATIO = range(6)
# indices into Observer.energy
LEAST, MOST, LATEST, INTEGRAL, DURATION = 0, 1, 2, 3, 4
CLOSER = 3  # parabolas to an extremum
# rows of Observer.work, and columns: kinetic energy that strikes take, positive work of the hip's constant torque
TAKEN, AT_HAND = 0, 1
STRIKES, FORWARD = 0, 1
# composite Simpson rule on eighths
SIMPSON = (1.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 1.0 / 24.0)


@by_reference
class Observer(NamedTuple):
    """What is recorded of a walk besides its heel strikes; nothing, if it is not `watching`."""

    watching: bool
    times: Any  # (samples,) s, rising
    states: Any  # (samples, 2 n)
    steps: Any  # (samples,) which step a sample belongs to
    recorded: Any  # (1,) samples recorded so far
    # (6,) least normal force N, largest |T/N|, deepest scuff m, largest drift of energy in a swing J; of the strikes'
    # impulses the least normal one N s, and the largest ratio of tangential to normal
    extremes: Any
    energy: Any  # (5,) from the stance foot: least and most of this swing J, latest J, integral over time J s, time s
    work: Any  # (2, 2) J, in the steps taken and in the one at hand


def new_observer(times: Any, numbers: int) -> Observer:
    """An observer with memory for samples of a state of some `numbers` at `times` (s, rising)."""
    extremes = np.array([NO_FORCE, 0.0, 0.0, 0.0, NO_FORCE, 0.0])
    steps = np.zeros(times.size, np.int64)
    return Observer(
        True,
        times,
        np.zeros((times.size, numbers)),
        steps,
        np.zeros(1, np.int64),
        extremes,
        np.zeros(5),
        np.zeros((2, 2)),
    )


def unwatched() -> Observer:
    """The observer of a walk of which only the heel strikes are wanted."""
    return new_observer(np.zeros(0), 0)._replace(watching=False)


@inlined
def observe_start(observer: Observer, mode: Mode, y: Any) -> None:
    """Take note of the start of a swing phase, whose energy it must keep."""
    if observer.watching:
        kinetic, potential = energies(mode.model, y)
        observer.energy[LEAST], observer.energy[MOST] = kinetic + potential, kinetic + potential
        record_extremes(observer, mode, y)


@inlined
def observe_strike(observer: Observer, mode: Mode, heel: bool, before: Any, after: Any) -> None:
    """Record what a strike of knee or heel takes, and the ground's impulse on the foot that stands afterwards.

    That impulse is all of the change of momentum but the push-off's part. A heel strike ends the step at hand.
    """
    if observer.watching:
        model, extremes, work = mode.model, observer.extremes, observer.work
        along, normal = momentum(model, before)
        along_after, normal_after = momentum(model, after)
        along, impulse = along_after - along, normal_after - normal
        work[AT_HAND, STRIKES] += energies(model, before)[0] - energies(model, after)[0]
        if heel:
            if model.push_off != 0.0:
                push = push_off(model, after)
                along, impulse = along - push.along, impulse - push.upward
                extremes[MAX_IMPULSE_RATIO] = max(extremes[MAX_IMPULSE_RATIO], abs(push.along) / push.upward)
            for entry in range(2):
                work[TAKEN, entry] += work[AT_HAND, entry]
                work[AT_HAND, entry] = 0.0
        extremes[MIN_IMPULSE] = min(extremes[MIN_IMPULSE], impulse)
        if impulse > 0.0:
            extremes[MAX_IMPULSE_RATIO] = max(extremes[MAX_IMPULSE_RATIO], abs(along) / impulse)


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
def keep_worst(observer: Observer, found: tuple[float, float, float]) -> None:
    """Keep the worst of what the model assumes."""
    extremes = observer.extremes
    extremes[MIN_NORMAL_FORCE] = min(extremes[MIN_NORMAL_FORCE], -found[0])
    extremes[MAX_FRICTION_RATIO] = max(extremes[MAX_FRICTION_RATIO], found[1])
    extremes[MAX_SCUFF_DEPTH] = max(extremes[MAX_SCUFF_DEPTH], found[2])


@inlined
def record_extremes(observer: Observer, mode: Mode, y: Any) -> tuple[float, float, float]:
    """Keep the worst of what the model assumes, and the energy."""
    extremes, energy = observer.extremes, observer.energy
    found = assumptions(mode, y)
    keep_worst(observer, found)
    kinetic, potential = energies(mode.model, y)
    now = kinetic + potential
    energy[LEAST], energy[MOST], energy[LATEST] = min(energy[LEAST], now), max(energy[MOST], now), now
    extremes[ENERGY_DRIFT] = max(extremes[ENERGY_DRIFT], energy[MOST] - energy[LEAST])
    return found


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
    torque = hinge_law(mode.model, HIP_ROW).torque
    if torque != 0.0:
        sample(method, mode, finder.nodes, finder.states)
        observer.work[AT_HAND, FORWARD] += torque_work(torque, method, mode, finder, row, fraction).positive
    t, h = method.clock[T_OLD], method.clock[T] - method.clock[T_OLD]
    t_end, spacing = t + fraction * h, 0.125 * fraction
    mean_energy = SIMPSON[0] * observer.energy[LATEST]
    y = vector(mode.model.zero_state)
    before = at = assumptions_at(method, mode, 0.0)
    for eighth in range(1, 9):
        interpolate(method, mode, spacing * eighth, y)
        after = record_extremes(observer, mode, y)
        mean_energy += SIMPSON[eighth] * observer.energy[LATEST]
        for measure in range(3):
            if eighth > 1 and abs(vertex(before[measure], at[measure], after[measure])) <= 1.0:
                ascend_to_worst(observer, method, mode, measure, spacing * (eighth - 1), spacing, fraction)
        before, at = at, after
    observer.energy[INTEGRAL] += mean_energy * fraction * h
    observer.energy[DURATION] += fraction * h
    index = observer.recorded[0]
    while index < observer.times.size and observer.times[index] <= t_end:
        interpolate(method, mode, (observer.times[index] - t) / h, y)
        for i in range(len(y)):
            observer.states[index, i] = y[i]
        observer.steps[index] = step
        index += 1
    observer.recorded[0] = index
