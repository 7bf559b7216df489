"""What an event does to the walker where a knee locks, latches or is released: velocities, energy, the tangent."""

from typing import Any

from walkerlab.ground.held import Knees, divide_by_held_mass, knee_energy, turned_by
from walkerlab.ground.motion import OnGround, motion_gradient
from walkerlab.ground.pinned import Pinned
from walkerlab.hybrid.contact_events import EXTENSION, EXTENSION_RATE, HEIGHT, PER_FOOT, VERTICAL_VELOCITY
from walkerlab.hybrid.contact_observer import KNEE_STOP, KNEE_STRIKES, ContactObserver
from walkerlab.hybrid.contact_rules import catches
from walkerlab.hybrid.contact_tangent import Tangent, jump
from walkerlab.kernels import by_type_or_default, inlined
from walkerlab.mechanics.tree import Tree, mass_matrix, sines_cosines, tree_gradients
from walkerlab.mechanics.tuples import Vector, put
from walkerlab.solvers.in_tuples import derivative, end_state
from walkerlab.solvers.stepping import T
from walkerlab.solvers.system import State


@by_type_or_default
def cross_knee(knees: Any, observer: ContactObserver, method: Any, before: Any, after: Any, event: int) -> State:
    """The state after an event that led from one mode to another; what it cost is noted, and the tangent jumps."""
    return end_state(method, before)


@cross_knee.case(Knees)
def cross_some_knee(knees: Knees, observer: ContactObserver, method: Any, before: Any, after: Any, event: int) -> State:
    """A lock is a plastic impact; what a latch holds in its spring is lost; a release changes no velocity."""
    y = end_state(method, before)
    new, locks = y, False
    if event >= EXTENSION:
        locks = event >= EXTENSION_RATE or catches(knees.stop)
        if locks:
            new, lost = locked(after, y)
            observer.dissipated[KNEE_STRIKES] += lost
        if event >= EXTENSION_RATE:
            observer.dissipated[KNEE_STOP] += knee_energy(knees, before.stops, y, angles_of(before))
    if observer.tangent.Phi.shape[1] > 0:
        carry_over(knees, observer.tangent, method.clock[T], before, after, event, y, new, locks)
    return new


@by_type_or_default
def angles_of(system: Any) -> int:
    """Where the bodies' angles begin in the state: after the centre of mass's two positions, if nothing is hinged."""
    return 2


@by_type_or_default
def tree_of_system(system: Any) -> Tree:
    """The tree whose angles these are, about a root that the knees' impulses do not move."""
    return system.walker.tree


@angles_of.case(Pinned)
def hinged_angles(system: Pinned) -> int:
    """At once."""
    return 0


@tree_of_system.case(Pinned)
def hinged_tree(system: Pinned) -> Tree:
    """About the hinge."""
    return system.tree


@inlined
def times_rates(M: Vector, y: State, first: int, rates: Vector) -> Vector:
    """M omega (n), with the angular velocities y[first], ...; of `rates` only the length matters."""
    n = len(rates)
    for k in range(n):
        total = 0.0
        for l in range(n):
            total += M[k * n + l] * y[first + l]
        rates = put(rates, k, total)
    return rates


@inlined
def locked(system: Any, y: State) -> tuple[State, float]:
    """The state after bodies have been made to follow as `system` says, and the energy lost (J).

    The angular velocities are projected in the metric of M: E'ME z = E'M omega. The root is not moved.
    """
    tree = tree_of_system(system)
    n = len(tree.arm_x)
    rates = len(y) - n
    s, c = sines_cosines(tree, y, angles_of(system), system.walker.slope)
    M = mass_matrix(tree, s, c)
    momenta = times_rates(M, y, rates, tree.arm_x)
    omega = turned_by(system.walker.held, system.held, M, momenta)
    lost, new = 0.0, y
    for k in range(n):
        lost += 0.5 * momenta[k] * (y[rates + k] - omega[k])
        new = put(new, rates + k, omega[k])
    return new, lost


@by_type_or_default
def event_gradient(system: Any, knees: Knees, event: int, y: State, gradient: Any) -> bool:
    """Write the derivative of an event function by the state into `gradient`; whether the event changes the motion.

    The tangent is carried from section to section, where nothing is hinged.
    """
    return False


@event_gradient.case(OnGround)
def free_gradient(system: OnGround, knees: Knees, event: int, y: State, gradient: Any) -> bool:
    """Of knees: extension or its rate; of feet: height or its rate."""
    n = len(system.walker.tree.arm_x)
    for j in range(len(y)):
        gradient[j] = 0.0
    if event >= EXTENSION:
        knee = (event - EXTENSION) % 2
        first = 4 + n if event >= EXTENSION_RATE else 2
        gradient[first + knees.shanks[knee]] = 1.0
        gradient[first + knees.thighs[knee]] = -1.0
        return True
    kind = event % PER_FOOT
    if event >= 2 * PER_FOOT or (kind != HEIGHT and kind != VERTICAL_VELOCITY):
        return False
    foot = system.walker.feet[event // PER_FOOT]
    s, c = sines_cosines(system.walker.tree, y, 2, system.walker.slope)
    for j in range(len(y)):
        deeper, deeper_rate, _ = motion_gradient(foot, s, c, y, j)
        gradient[j] = -deeper if kind == HEIGHT else -deeper_rate
    return True


@inlined
def carry_over(
    knees: Knees,
    tangent: Tangent,
    t: float,
    before: Any,
    after: Any,
    event: int,
    y: State,
    new: State,
    locks: bool,
) -> None:
    """The tangent after an event: by the reset's derivative, and by how the event's time shifts."""
    size = len(y)
    if not event_gradient(before, knees, event, y, tangent.rates[2 * size :]):
        return
    reset = tangent.stages[3]
    for i in range(size):
        for j in range(size):
            reset[i, j] = 1.0 if i == j else 0.0
    if locks:
        reset_derivative(after, y, new, reset)
    rate, rate_after = derivative(before, t, y), derivative(after, t, new)
    for i in range(size):
        tangent.rates[i], tangent.rates[size + i] = rate[i], rate_after[i]
    jump(tangent)


@inlined
def reset_derivative(system: Any, y: State, new: State, reset: Any) -> None:
    """Derivative of `locked` by the state: E'ME dz = E'(M domega + dM (omega- - omega+))."""
    tree = tree_of_system(system)
    n, size = len(tree.arm_x), len(y)
    rates, first = size - n, angles_of(system)
    s, c = sines_cosines(tree, y, first, system.walker.slope)
    M = mass_matrix(tree, s, c)
    gained, still = tree.arm_x, y
    for k in range(n):
        gained = put(gained, k, new[rates + k] - y[rates + k])
        still = put(still, rates + k, 0.0)
        for j in range(size):
            reset[rates + k, j] = M[k * n + j - rates] if j >= rates else 0.0
    tree_gradients(tree, s, c, still, first, gained, reset)
    divide_by_held_mass(system.walker.held, system.held, tree, M, reset)
