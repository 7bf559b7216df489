"""Records of a rigid walk apart from its heel strikes: samples, energies and extremes that test model assumptions."""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.hybrid.walk_record import torque_work
from walkerlab.physics.kernels import kernel_part, pass_by_reference, vector
from walkerlab.physics.mechanics.hinges import HIP_ROW, hinge_law
from walkerlab.physics.mechanics.impact import push_off
from walkerlab.physics.mechanics.rigid_model import Mode, RigidModel, energies, ground_reaction, momentum, swing_foot
from walkerlab.physics.mechanics.tree import fast_fields, new_record, record_type
from walkerlab.physics.solvers.events import CrossingFinder
from walkerlab.physics.solvers.stepping import T_OLD, T, interpolate, sample

NO_FORCE = 1e300  # above any normal force
PEAK_REFINEMENTS = 3  # parabolas fitted around a maximum, each eight times narrower than the last
# composite Simpson rule on eighths
SIMPSON = (1.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 2.0 / 24.0, 4.0 / 24.0, 1.0 / 24.0)


@fast_fields
class RigidTally(np.record):  # type: ignore[misc]  # NumPy's stubs call one of its bases final
    """Counts, extremes and energies of a walk, written by kernels.

    Extremes cover the walk, except that `min_energy` and `max_energy` cover the current swing. Energies are measured
    from the stance foot. `strike_loss` and `forward_work` cover completed steps, `step_*` the current step.
    """

    recorded: int  # number of samples recorded
    min_normal_force: float  # N
    max_friction_ratio: float  # tangential over normal force
    max_scuff_depth: float  # m
    energy_drift: float  # J, largest range of the energy within a swing
    min_impulse: float  # N s, normal impulse of the ground in a strike
    max_impulse_ratio: float  # tangential over normal impulse
    min_energy: float  # J
    max_energy: float  # J
    energy: float  # J, latest value
    energy_integral: float  # J s, time integral of the energy over the walk
    duration: float  # s, duration of the walk
    strike_loss: float  # J, kinetic energy lost in strikes
    forward_work: float  # J, positive work of the hip's constant torque
    step_strike_loss: float  # J
    step_forward_work: float  # J


RIGID_TALLY = record_type(RigidTally, {})


@pass_by_reference
class Observer(NamedTuple):
    """Record of a walk in addition to its heel strikes. It stays empty unless `watching`."""

    watching: bool
    times: Any  # (samples,) s, rising
    # (samples, 2 n, plus tangent columns if any). The columns are derivatives of the states at a fixed time since the
    # last heel strike.
    states: Any
    steps: Any  # (samples,) index of the step in which each sample lies
    # () array of RIGID_TALLY, because passing a structured scalar to a kernel takes as long as a solver step
    tally: Any


def new_observer(times: Any, state_size: int) -> Observer:
    """Create an observer with memory for samples of states (state_size,) at `times` (s, rising)."""
    tally = new_record(RIGID_TALLY, min_normal_force=NO_FORCE, min_impulse=NO_FORCE)
    return Observer(True, times, np.zeros((times.size, state_size)), np.zeros(times.size, np.int64), np.asarray(tally))


def new_idle_observer() -> Observer:
    return new_observer(np.zeros(0), 0)._replace(watching=False)


@kernel_part
def observe_start(observer: Observer, mode: Mode, y: Any) -> None:
    """Record the start of a swing, with the energy that the swing must conserve."""
    if observer.watching:
        start = y[: len(mode.model.zero_state)]  # without tangent columns
        kinetic, potential = energies(mode.model, start)
        tally = observer.tally[()]
        tally.min_energy = kinetic + potential
        tally.max_energy = kinetic + potential
        record_extremes(tally, mode, start)


@kernel_part
def observe_strike(observer: Observer, mode: Mode, following: RigidModel, heel: bool, before: Any, after: Any) -> None:
    """Record a strike's energy loss and its impulse on the new stance foot, without the push-off's impulse.

    following  model of the next step; not used at a knee strike, after which the model is the same
    """
    if observer.watching:
        tally = observer.tally[()]
        along, normal = momentum(mode.model, before)
        model = following if heel else mode.model
        along_after, normal_after = momentum(model, after)
        along = along_after - along
        impulse = normal_after - normal
        tally.step_strike_loss += energies(mode.model, before)[0] - energies(model, after)[0]
        if heel:
            if model.push_off != 0.0:
                push = push_off(model, after)
                along = along - push.along
                impulse = impulse - push.upward
                # The push-off acts on the trailing foot, so that foot needs friction, too.
                tally.max_impulse_ratio = max(tally.max_impulse_ratio, abs(push.along) / push.upward)
            tally.strike_loss += tally.step_strike_loss
            tally.forward_work += tally.step_forward_work
            tally.step_strike_loss = 0.0
            tally.step_forward_work = 0.0
        tally.min_impulse = min(tally.min_impulse, impulse)
        if impulse > 0.0:
            tally.max_impulse_ratio = max(tally.max_impulse_ratio, abs(along) / impulse)


@kernel_part
def assumptions(mode: Mode, y: Any) -> tuple[float, float, float]:
    """Return the pull (N) that the ground would have to exert, the friction ratio and the swing foot's depth (m).

    See section 3.1 of the paper.
    """
    along, normal = ground_reaction(mode, y)
    ratio = abs(along) / normal if normal > 0.0 else 0.0
    # The pull is minus the normal force, so that the worst value of all three is a maximum.
    return -normal, ratio, -swing_foot(mode.model, y)[0]


@kernel_part
def assumptions_at(method: Any, mode: Mode, fraction: float) -> tuple[float, float, float]:
    y = vector(mode.model.zero_state)
    interpolate(method, mode, fraction, y)
    return assumptions(mode, y)


@kernel_part
def keep_worst(tally: Any, measures: tuple[float, float, float]) -> None:
    tally.min_normal_force = min(tally.min_normal_force, -measures[0])
    tally.max_friction_ratio = max(tally.max_friction_ratio, measures[1])
    tally.max_scuff_depth = max(tally.max_scuff_depth, measures[2])


@kernel_part
def record_extremes(tally: Any, mode: Mode, y: Any) -> tuple[float, float, float]:
    measures = assumptions(mode, y)
    keep_worst(tally, measures)
    kinetic, potential = energies(mode.model, y)
    tally.energy = kinetic + potential
    tally.min_energy = min(tally.min_energy, tally.energy)
    tally.max_energy = max(tally.max_energy, tally.energy)
    tally.energy_drift = max(tally.energy_drift, tally.max_energy - tally.min_energy)
    return measures


@kernel_part
def vertex(before: float, middle: float, after: float) -> float:
    """Find the position of the maximum of the parabola through values at -1, 0 and 1.

    Returns 2 if the parabola has no maximum.
    """
    bend = before - 2.0 * middle + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 2.0


@kernel_part
def refine_maximum(
    tally: Any, method: Any, mode: Mode, measure: int, middle: float, spacing: float, last: float
) -> None:
    """Refine the maximum of a measure near fraction `middle` of the solver step, up to `last`, and record it.

    The maximum of the parabola through three points becomes the middle of the next three, which are closer together.
    """
    for _ in range(PEAK_REFINEMENTS):
        before = assumptions_at(method, mode, middle - spacing)
        centre = assumptions_at(method, mode, middle)
        after = assumptions_at(method, mode, middle + spacing)
        shift = vertex(before[measure], centre[measure], after[measure])
        if abs(shift) > 1.0:
            return
        middle += shift * spacing
        keep_worst(tally, assumptions_at(method, mode, middle))
        spacing *= 0.125
        # The next three points must also lie in the solver step.
        middle = min(max(middle, spacing), last - spacing)


@kernel_part
def observe(
    observer: Observer, method: Any, mode: Mode, finder: CrossingFinder, row: int, fraction: float, step: int
) -> None:
    """Record the last solver step up to `fraction`: its samples, extremes and energy.

    row  row of the finder that may be overwritten
    """
    tally = observer.tally[()]
    torque = hinge_law(mode.model, HIP_ROW).torque
    if torque != 0.0:
        sample(method, mode, finder.nodes, finder.states)
        tally.step_forward_work += torque_work(torque, method, mode, finder, row, fraction).positive
    t, h = method.clock[T_OLD], method.clock[T] - method.clock[T_OLD]
    t_end = t + fraction * h
    spacing = 0.125 * fraction
    # `tally.energy` is still the energy at the end of the previous solver step, where this one starts.
    mean_energy = SIMPSON[0] * tally.energy
    y = vector(mode.model.zero_state)
    before = middle = assumptions_at(method, mode, 0.0)
    for eighth in range(1, 9):
        interpolate(method, mode, spacing * eighth, y)
        after = record_extremes(tally, mode, y)
        mean_energy += SIMPSON[eighth] * tally.energy
        for measure in range(3):
            # Refine if the parabola through the last three samples has its maximum between them.
            if eighth > 1 and abs(vertex(before[measure], middle[measure], after[measure])) <= 1.0:
                refine_maximum(tally, method, mode, measure, spacing * (eighth - 1), spacing, fraction)
        before = middle
        middle = after
    tally.energy_integral += mean_energy * fraction * h
    tally.duration += fraction * h
    index = tally.recorded
    while index < observer.times.size and observer.times[index] <= t_end:
        interpolate(method, mode, (observer.times[index] - t) / h, observer.states[index])
        observer.steps[index] = step
        index += 1
    tally.recorded = index
