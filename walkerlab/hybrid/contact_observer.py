"""What is recorded of a walk on compliant ground besides its steps: samples, energy books, the tangent."""

from typing import Any, NamedTuple

from walkerlab.ground.energy import book_energy, dissipated_power, foot_elastic_energy
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import CLIMB, HEIGHT, PER_FOOT, feet_motion, walker_state
from walkerlab.hybrid.contact_tangent import Tangent, carry_tangent
from walkerlab.kernels import inlined
from walkerlab.solvers.events import RISING, CrossingFinder, first_crossing
from walkerlab.solvers.stepping import T_OLD, T, end_state, interpolate
from walkerlab.solvers.system import State

# indices into `books`
DAMPING, FRICTION, EDGES, BOOKS = 0, 1, 2, 3
# indices into `extremes`
MAX_PENETRATION, RESIDUAL, START_ENERGY = 0, 1, 2
# nodes and weights of the Radau quadrature on a step: exact to the order of the method of that name
NODES = (0.15505102572168219, 0.6449489742783178, 1.0)
WEIGHTS = (0.37640306270046725, 0.5124858261884216, 0.1111111111111111)


class ContactObserver(NamedTuple):
    """Samples, books and tangent of a walk; what is not wanted has no room and costs a look."""

    booked: bool  # whether to keep the books
    times: Any  # (samples,) s, rising
    states: Any  # (samples, 8)
    carried: Any  # (samples, 2)
    stance: Any  # (samples,)
    sampled_books: Any  # (samples, 3) J dissipated so far, by channel
    recorded: Any  # (1,)
    books: Any  # (3,) J dissipated so far
    extremes: Any  # (3,) deepest penetration m, largest residual of the energy balance J, energy at the start J
    tangent: Tangent  # derivative of the state with respect to where it started, if wanted


@inlined
def observe(
    observer: ContactObserver,
    method: Any,
    system: Any,
    walker: ContactWalker,
    finder: CrossingFinder,
    carried: Any,
    stance: int,
) -> None:
    """Take note of the last step, which stands and whose signals are sampled: samples, books, tangent."""
    mode = (carried[0] != 0, carried[1] != 0)
    record_samples(observer, method, system, walker, mode, stance)
    if observer.booked:
        keep_books(observer, method, system, walker, mode)
        for foot in range(2):
            if mode[foot]:
                note_depth(observer, method, system, walker, finder, foot)
    if observer.tangent.Phi.shape[1] > 0:
        carry_tangent(observer.tangent, method, system)


@inlined
def record_samples(
    observer: ContactObserver, method: Any, system: Any, walker: ContactWalker, mode: tuple[bool, bool], stance: int
) -> None:
    """The samples that fall into the last step."""
    t, h = method.clock[T_OLD], method.clock[T] - method.clock[T_OLD]
    index = observer.recorded[0]
    while index < observer.times.size and observer.times[index] <= method.clock[T]:
        fraction = (observer.times[index] - t) / h
        y = walker_state(system, interpolate(method, system, fraction))
        for i in range(len(y)):
            observer.states[index, i] = y[i]
        damping, friction = work_until(method, system, walker, mode, fraction)
        observer.sampled_books[index, DAMPING] = observer.books[DAMPING] + damping
        observer.sampled_books[index, FRICTION] = observer.books[FRICTION] + friction
        observer.sampled_books[index, EDGES] = observer.books[EDGES]
        observer.carried[index, 0], observer.carried[index, 1] = mode
        observer.stance[index] = stance
        index += 1
    observer.recorded[0] = index


@inlined
def keep_books(
    observer: ContactObserver, method: Any, system: Any, walker: ContactWalker, mode: tuple[bool, bool]
) -> None:
    """What the last step dissipated, and how well the energy balances at its end."""
    damping, friction = work_until(method, system, walker, mode, 1.0)
    observer.books[DAMPING] += damping
    observer.books[FRICTION] += friction
    end = walker_state(system, end_state(method, system))
    lost = observer.books[DAMPING] + observer.books[FRICTION] + observer.books[EDGES]
    residual = book_energy(walker, mode, end) + lost - observer.extremes[START_ENERGY]
    observer.extremes[RESIDUAL] = max(observer.extremes[RESIDUAL], abs(residual))


@inlined
def note_depth(
    observer: ContactObserver, method: Any, system: Any, walker: ContactWalker, finder: CrossingFinder, foot: int
) -> None:
    """How deep a foot got in the last step: at its end, or where it stopped sinking in."""
    end, first = finder.nodes.size - 1, foot * PER_FOOT
    deepest = -finder.values[first + HEIGHT, end]
    if finder.values[first + CLIMB, 0] < 0.0 < finder.values[first + CLIMB, end]:
        at = first_crossing(finder, first + CLIMB, RISING, 0.0, False)
        lowest = feet_motion(walker, walker_state(system, interpolate(method, system, min(at, 1.0))))
        deepest = max(deepest, -lowest[foot].height)
    observer.extremes[MAX_PENETRATION] = max(observer.extremes[MAX_PENETRATION], deepest)


@inlined
def observe_edge(observer: ContactObserver, walker: ContactWalker, foot: int, carried: bool, y: State) -> None:
    """A foot left its pad: the spring under it is gone, and what it held with it."""
    if carried and observer.booked:
        observer.books[EDGES] += foot_elastic_energy(walker, foot, y)


@inlined
def work_until(
    method: Any, system: Any, walker: ContactWalker, carried: tuple[bool, bool], fraction: float
) -> tuple[float, float]:
    """Work (J) lost to damping and to friction in the first part of the last step."""
    damping, friction = 0.0, 0.0
    for foot in range(2):
        if carried[foot]:
            lost = foot_work(method, system, walker, foot, fraction)
            damping += lost[0]
            friction += lost[1]
    return damping, friction


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
