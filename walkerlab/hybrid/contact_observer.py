"""What is recorded of a walk on compliant ground besides its steps: samples, energy balance, the tangent."""

from typing import Any, NamedTuple

from walkerlab.ground.energy import dissipated_power, foot_elastic_energy, total_energy
from walkerlab.ground.held import Knees, knee_energy, knee_power
from walkerlab.ground.merged import store_whole
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import HEIGHT, PER_FOOT, VERTICAL_VELOCITY, feet_motion, walker_state
from walkerlab.hybrid.contact_tangent import Tangent, carry_tangent
from walkerlab.kernels import by_type_or_default, inlined
from walkerlab.solvers.events import RISING, CrossingFinder, first_crossing
from walkerlab.solvers.in_tuples import end_state, interpolate
from walkerlab.solvers.stepping import T_OLD, T
from walkerlab.solvers.system import State

# indices into `dissipated`
DAMPING, FRICTION, EDGES, KNEE_STRIKES, KNEE_STOP, CHANNEL_COUNT = 0, 1, 2, 3, 4, 5
# indices into `extremes`
MAX_PENETRATION, RESIDUAL, START_ENERGY, AT_HAND = 0, 1, 2, 3
# nodes and weights of the Radau quadrature on a step: exact to the order of the method of that name
NODES = (0.15505102572168219, 0.6449489742783178, 1.0)
WEIGHTS = (0.37640306270046725, 0.5124858261884216, 0.1111111111111111)


class ContactObserver(NamedTuple):
    """Samples, energy balance and tangent of a walk; what is not wanted has no room and costs a look."""

    track_energy: bool  # whether to keep the energy balance
    times: Any  # (samples,) s, rising
    states: Any  # (samples, 4 + 2 n) of the whole walker
    has_ground: Any  # (samples, 2)
    stance: Any  # (samples,)
    knees: Any  # (samples, 2) what each knee is doing
    sampled_dissipation: Any  # (samples, 5) J dissipated so far, by channel
    recorded: Any  # (1,)
    dissipated: Any  # (5,) J dissipated so far
    # (4,) deepest penetration m, largest residual of the energy balance J, energy at the start J: its potential from a
    # fixed origin, and from the slope below
    extremes: Any
    tangent: Tangent  # derivative of the state with respect to where it started, if wanted
    merged: Any  # tangents of the walker with one and with both knees locked; () if it keeps its bodies


@inlined
def observe(
    observer: ContactObserver,
    method: Any,
    system: Any,
    walker: ContactWalker,
    finder: CrossingFinder,
    has_ground: Any,
    knee: Any,
    stance: int,
) -> None:
    """Take note of the last step, which stands and whose event functions are sampled."""
    mode = (has_ground[0] != 0, has_ground[1] != 0)
    record_samples(observer, method, system, walker, mode, knee, stance)
    if observer.track_energy:
        add_dissipation(observer, method, system, walker, mode)
        for foot in range(2):
            if mode[foot]:
                note_depth(observer, method, system, walker, finder, foot)
    if observer.tangent.Phi.shape[1] > 0:
        carry_tangent(observer.tangent, method, system)


@inlined
def record_samples(
    observer: ContactObserver,
    method: Any,
    system: Any,
    walker: ContactWalker,
    mode: tuple[bool, bool],
    knee: Any,
    stance: int,
) -> None:
    """The samples that fall into the last step."""
    t, h = method.clock[T_OLD], method.clock[T] - method.clock[T_OLD]
    index = observer.recorded[0]
    while index < observer.times.size and observer.times[index] <= method.clock[T]:
        fraction = (observer.times[index] - t) / h
        y = walker_state(system, interpolate(method, system, fraction))
        store_whole(walker.merging, y, observer.states[index])
        damping, friction, stops = work_until(method, system, walker, mode, fraction)
        for channel in range(CHANNEL_COUNT):
            observer.sampled_dissipation[index, channel] = observer.dissipated[channel]
        observer.sampled_dissipation[index, DAMPING] += damping
        observer.sampled_dissipation[index, FRICTION] += friction
        observer.sampled_dissipation[index, KNEE_STOP] += stops
        observer.knees[index, 0], observer.knees[index, 1] = knee[0], knee[1]
        observer.has_ground[index, 0], observer.has_ground[index, 1] = mode
        observer.stance[index] = stance
        index += 1
    observer.recorded[0] = index


@inlined
def add_dissipation(
    observer: ContactObserver, method: Any, system: Any, walker: ContactWalker, mode: tuple[bool, bool]
) -> None:
    """What the last step dissipated, and how well the energy balances at its end."""
    damping, friction, stops = work_until(method, system, walker, mode, 1.0)
    observer.dissipated[DAMPING] += damping
    observer.dissipated[FRICTION] += friction
    observer.dissipated[KNEE_STOP] += stops
    end = walker_state(system, end_state(method, system))
    lost = 0.0
    for channel in range(CHANNEL_COUNT):
        lost += observer.dissipated[channel]
    held = total_energy(walker, mode, end) + knee_energy(walker.knees, system.stops, end, 2)
    residual = held + lost - observer.extremes[START_ENERGY]
    observer.extremes[RESIDUAL] = max(observer.extremes[RESIDUAL], abs(residual))


@inlined
def note_depth(
    observer: ContactObserver, method: Any, system: Any, walker: ContactWalker, finder: CrossingFinder, foot: int
) -> None:
    """How deep a foot got in the last step: at its end, or where it stopped sinking in."""
    end, first = finder.nodes.size - 1, foot * PER_FOOT
    deepest = -finder.values[first + HEIGHT, end]
    if finder.values[first + VERTICAL_VELOCITY, 0] < 0.0 < finder.values[first + VERTICAL_VELOCITY, end]:
        at = first_crossing(finder, first + VERTICAL_VELOCITY, RISING, 0.0, False)
        lowest = feet_motion(walker, walker_state(system, interpolate(method, system, min(at, 1.0))))
        deepest = max(deepest, -lowest[foot].height)
    observer.extremes[MAX_PENETRATION] = max(observer.extremes[MAX_PENETRATION], deepest)


@inlined
def observe_edge(observer: ContactObserver, walker: ContactWalker, foot: int, has_ground: bool, y: State) -> None:
    """A foot left its pad: the spring under it is gone, and what it held with it."""
    if has_ground and observer.track_energy:
        observer.dissipated[EDGES] += foot_elastic_energy(walker, foot, y)


@inlined
def work_until(
    method: Any, system: Any, walker: ContactWalker, has_ground: tuple[bool, bool], fraction: float
) -> tuple[float, float, float]:
    """Work (J) lost to damping, to friction and in the knees' stops in the first part of the last step."""
    damping, friction = 0.0, 0.0
    for foot in range(2):
        if has_ground[foot]:
            lost = foot_work(method, system, walker, foot, fraction)
            damping += lost[0]
            friction += lost[1]
    return damping, friction, stop_work(walker.knees, method, system, fraction)


@by_type_or_default
def stop_work(knees: Any, method: Any, system: Any, fraction: float) -> float:
    """Work (J) lost in the knees' stops."""
    return 0.0


@stop_work.case(Knees)
def work_in_stops(knees: Knees, method: Any, system: Any, fraction: float) -> float:
    """That of their damping."""
    span, work = fraction * (method.clock[T] - method.clock[T_OLD]), 0.0
    if system.stops[0] or system.stops[1]:
        for i in range(3):
            y = walker_state(system, interpolate(method, system, fraction * NODES[i]))
            work += span * WEIGHTS[i] * knee_power(knees, system.stops, y, 2)
    return work


@inlined
def foot_work(method: Any, system: Any, walker: ContactWalker, foot: int, fraction: float) -> tuple[float, float]:
    """Work (J) lost under a foot that there is ground for.

    Where the force law has let go, what is lost is what the spring gives up, whose powers of the penetration no
    quadrature likes; steps end where it lets go.
    """
    span = fraction * (method.clock[T] - method.clock[T_OLD])
    damping, friction, let_go = 0.0, 0.0, True
    for i in range(3):
        y = walker_state(system, interpolate(method, system, fraction * NODES[i]))
        power = dissipated_power(walker, foot, y)
        damping += span * WEIGHTS[i] * power[0]
        friction += span * WEIGHTS[i] * power[1]
        let_go = let_go and (i == 2 or power[2] == 0.0)
    if let_go:
        start, end = interpolate(method, system, 0.0), interpolate(method, system, fraction)
        damping = foot_elastic_energy(walker, foot, walker_state(system, start))
        damping -= foot_elastic_energy(walker, foot, walker_state(system, end))
    return damping, friction
