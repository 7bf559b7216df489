"""What is recorded of a walk on compliant ground besides its steps: samples, energy books, the tangent."""

from typing import Any, NamedTuple

from walkerlab.ground.energy import book_energy, dissipated_power, foot_elastic_energy
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import feet_motion, walker_state
from walkerlab.hybrid.contact_tangent import Tangent, carry_tangent
from walkerlab.kernels import inlined
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
    observer: ContactObserver, method: Any, system: Any, walker: ContactWalker, carried: Any, stance: int
) -> None:
    """Take note of the last step, which stands: samples, books, tangent."""
    mode = (carried[0] != 0, carried[1] != 0)
    record_samples(observer, method, system, walker, mode, stance)
    if observer.booked:
        keep_books(observer, method, system, walker, mode)
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
    """What the last step dissipated, how deep the feet are at its end, and how well the energy balances there."""
    damping, friction = work_until(method, system, walker, mode, 1.0)
    observer.books[DAMPING] += damping
    observer.books[FRICTION] += friction
    end = walker_state(system, end_state(method, system))
    feet = feet_motion(walker, end)
    for foot in range(2):
        if mode[foot]:
            observer.extremes[MAX_PENETRATION] = max(observer.extremes[MAX_PENETRATION], -feet[foot].height)
    lost = observer.books[DAMPING] + observer.books[FRICTION] + observer.books[EDGES]
    residual = book_energy(walker, mode, end) + lost - observer.extremes[START_ENERGY]
    observer.extremes[RESIDUAL] = max(observer.extremes[RESIDUAL], abs(residual))


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
    span = fraction * (method.clock[T] - method.clock[T_OLD])
    damping, friction = 0.0, 0.0
    for i in range(3):
        y = walker_state(system, interpolate(method, system, fraction * NODES[i]))
        power = dissipated_power(walker, carried, y)
        damping += span * WEIGHTS[i] * power[0]
        friction += span * WEIGHTS[i] * power[1]
    return damping, friction
