"""What is recorded of a rigid walk besides its heel strikes: samples, extremes of what the model assumes, energy."""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.kernels import by_type, inlined
from walkerlab.mechanics.standing import Mode, ground_reaction, swing_foot, total_energy
from walkerlab.solvers.stepping import T_OLD, T, interpolate
from walkerlab.solvers.system import State

NO_FORCE = 1e300  # above any normal force
# indices into Observer.extremes
MIN_NORMAL_FORCE, MAX_FRICTION_RATIO, MAX_SCUFF_DEPTH, ENERGY_DRIFT = 0, 1, 2, 3
# indices into Observer.energy
LEAST, MOST, LATEST, INTEGRAL, DURATION = 0, 1, 2, 3, 4
# composite Simpson rule on eighths
SIMPSON = (1.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 1.0 / 24.0)


class Unobserved(NamedTuple):
    """A walk of which only the heel strikes are wanted."""


class Observer(NamedTuple):
    """What is recorded of a walk besides its heel strikes."""

    times: Any  # (samples,) s, rising
    states: Any  # (samples, 2 n)
    steps: Any  # (samples,) which step a sample belongs to
    recorded: Any  # (1,) samples recorded so far
    extremes: Any  # (4,) least normal force N, largest |T/N|, deepest scuff m, largest drift of energy in a swing J
    energy: Any  # (5,) from the stance foot: least and most of this swing J, latest J, integral over time J s, time s


@by_type
def observe_start(observer: Any, mode: Mode, y: State) -> None:
    """Take note of the start of a swing phase."""


@by_type
def observe(observer: Any, method: Any, mode: Mode, system: Any, fraction: float, step: int) -> None:
    """Take note of the last integration step up to `fraction` of it; the dense output is ready."""


@by_type
def wants_dense(observer: Any) -> bool:
    """Whether `observe` needs the dense output of every integration step."""


@observe_start.case(Unobserved)
def ignore_start(observer: Unobserved, mode: Mode, y: State) -> None:
    """Nothing."""


@observe.case(Unobserved)
def ignore(observer: Unobserved, method: Any, mode: Mode, system: Any, fraction: float, step: int) -> None:
    """Nothing."""


@wants_dense.case(Unobserved)
def without_dense(observer: Unobserved) -> bool:
    """No."""
    return False


def new_observer(times: Any, numbers: int) -> Observer:
    """An observer with memory for samples of a state of some `numbers` at `times` (s, rising)."""
    extremes = np.array([NO_FORCE, 0.0, 0.0, 0.0])
    steps = np.zeros(times.size, np.int64)
    return Observer(times, np.zeros((times.size, numbers)), steps, np.zeros(1, np.int64), extremes, np.zeros(5))


@observe_start.case(Observer)
def record_start(observer: Observer, mode: Mode, y: State) -> None:
    """The energy that the swing phase must keep."""
    energy = total_energy(mode.model, y)
    observer.energy[LEAST], observer.energy[MOST] = energy, energy
    record_extremes(observer, mode, y)


@inlined
def record_extremes(observer: Observer, mode: Mode, y: State) -> None:
    """Keep the worst of what the model assumes (section 3.1 of the paper), and the energy."""
    extremes, energy = observer.extremes, observer.energy
    along, normal = ground_reaction(mode.model, mode.links, y)
    extremes[MIN_NORMAL_FORCE] = min(extremes[MIN_NORMAL_FORCE], normal)
    if normal > 0.0:
        extremes[MAX_FRICTION_RATIO] = max(extremes[MAX_FRICTION_RATIO], abs(along) / normal)
    extremes[MAX_SCUFF_DEPTH] = max(extremes[MAX_SCUFF_DEPTH], -swing_foot(mode.model, y)[0])
    now = total_energy(mode.model, y)
    energy[LEAST], energy[MOST], energy[LATEST] = min(energy[LEAST], now), max(energy[MOST], now), now
    extremes[ENERGY_DRIFT] = max(extremes[ENERGY_DRIFT], energy[MOST] - energy[LEAST])


@observe.case(Observer)
def record(observer: Observer, method: Any, mode: Mode, system: Any, fraction: float, step: int) -> None:
    """Samples that fall into the integration step; extremes and the energy's integral from eighths of it."""
    t, h = method.clock[T_OLD], method.clock[T] - method.clock[T_OLD]
    t_end = t + fraction * h
    mean_energy = SIMPSON[0] * observer.energy[LATEST]
    for eighth in range(1, 9):
        record_extremes(observer, mode, interpolate(method, system, 0.125 * eighth * fraction))
        mean_energy += SIMPSON[eighth] * observer.energy[LATEST]
    observer.energy[INTEGRAL] += mean_energy * fraction * h
    observer.energy[DURATION] += fraction * h
    index = observer.recorded[0]
    while index < observer.times.size and observer.times[index] <= t_end:
        y = interpolate(method, system, (observer.times[index] - t) / h)
        for i in range(len(y)):
            observer.states[index, i] = y[i]
        observer.steps[index] = step
        index += 1
    observer.recorded[0] = index


@wants_dense.case(Observer)
def with_dense(observer: Observer) -> bool:
    """Yes."""
    return True
