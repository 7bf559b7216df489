"""Equations of motion of the walker on compliant ground, and their exact derivatives."""

from typing import Any, NamedTuple

from walkerlab.ground.held import divide_by_held_mass, knee_gradients, knee_torques, turned_by
from walkerlab.ground.walker import ContactWalker, Foot, foot_force, foot_motion
from walkerlab.kernels import inlined
from walkerlab.mechanics.tree import (
    mass_matrix,
    sines_cosines,
    tree_gradients,
    with_centrifugal,
)
from walkerlab.mechanics.tuples import Vector, put
from walkerlab.solvers.in_tuples import blank, derivative, jacobian
from walkerlab.solvers.system import State


class OnGround(NamedTuple):
    """The walker while each foot either finds ground under it or does not."""

    walker: ContactWalker
    has_ground: tuple[bool, bool]
    held: tuple[bool, ...] = ()  # (n) which bodies follow others now; none for a walker whose bodies are independent
    stops: tuple[bool, ...] = ()  # (2) which knees are in their stops; none for a walker without knees


@blank.case(OnGround)
def on_ground_blank(system: OnGround) -> State:
    """Two positions and the angles, and their velocities."""
    return system.walker.blank


@inlined
def ground_wrench(
    walker: ContactWalker, foot: Foot, s: Vector, c: Vector, y: State, wrench: tuple[float, float, Vector]
) -> tuple[float, float, Vector]:
    """Add a foot's force along and normal to the slope (N) and its torques on the bodies (N m) to `wrench`."""
    motion = foot_motion(walker, foot, s, c, y)
    if motion.height >= 0.0:
        return wrench
    force = foot_force(walker, motion)
    torques = wrench[2]
    for k in range(len(s)):
        forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
        upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
        torque = force.along * (foot.rolling[k] - upward) + force.normal.force * forward
        torques = put(torques, k, torques[k] + torque)
    return wrench[0] + force.along, wrench[1] + force.normal.force, torques


@inlined
def all_wrenches(system: OnGround, s: Vector, c: Vector, y: State) -> tuple[float, float, Vector]:
    """Force of the ground along and normal to the slope (N), and its torques on the bodies (N m)."""
    walker = system.walker
    wrench = (0.0, 0.0, walker.tree.arm_x)
    if system.has_ground[0]:
        wrench = ground_wrench(walker, walker.feet[0], s, c, y, wrench)
    if system.has_ground[1]:
        wrench = ground_wrench(walker, walker.feet[1], s, c, y, wrench)
    return wrench


@derivative.case(OnGround)
def on_ground_derivative(system: OnGround, t: float, y: State) -> State:
    """Newton for the centre of mass, and the tree's equations for the angles."""
    walker = system.walker
    tree = walker.tree
    n = len(tree.arm_x)
    s, c = sines_cosines(tree, y, 2, walker.slope)
    wrench = all_wrenches(system, s, c, y)
    torques = knee_torques(walker.knees, system.stops, y, 2, with_centrifugal(tree, s, c, y, 4 + n, wrench[2]))
    alpha = turned_by(walker.held, system.held, mass_matrix(tree, s, c), torques)
    rate = walker.blank
    for i in range(2 + n):
        rate = put(rate, i, y[2 + n + i])
    rate = put(rate, 2 + n, walker.gravity_along + wrench[0] / tree.mass)
    rate = put(rate, 3 + n, wrench[1] / tree.mass - walker.gravity_down)
    for k in range(n):
        rate = put(rate, 4 + n + k, alpha[k])
    return rate


@inlined
def ground_gradients(walker: ContactWalker, foot: Foot, s: Vector, c: Vector, y: State, first: int, J: Any) -> None:
    """Add the derivatives of a foot's force and torques to the acceleration rows of J, before masses divide them.

    first  where the angles begin in J's own state: after the root's two coordinates, or at once if the root is fixed
    """
    motion = foot_motion(walker, foot, s, c, y)
    if motion.height >= 0.0:
        return
    force = foot_force(walker, motion)
    n, size = len(s), J.shape[0]
    for j in range(size):
        place = j + (2 - first if j < first + n else 4 - 2 * first)  # in the free walker's state
        # how penetration, its rate and the slip change along coordinate or velocity j
        deeper, deeper_rate, faster = motion_gradient(foot, s, c, y, place)
        normal = force.normal.by_penetration * deeper + force.normal.by_rate * deeper_rate
        along = force.coefficient * normal + force.by_slip * faster
        if first > 0:
            J[2 + n, j] += along
            J[3 + n, j] += normal
        for k in range(n):
            forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
            upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
            J[size - n + k, j] += along * (foot.rolling[k] - upward) + normal * forward
            if place == 2 + k:
                J[size - n + k, j] -= force.along * forward + force.normal.force * upward


@inlined
def motion_gradient(foot: Foot, s: Vector, c: Vector, y: State, j: int) -> tuple[float, float, float]:
    """Derivatives of a foot's penetration, penetration rate and slip along number j of the state."""
    n = len(s)
    if j == 1:
        return -1.0, 0.0, 0.0
    if j == 2 + n:
        return 0.0, 0.0, 1.0
    if j == 3 + n:
        return 0.0, -1.0, 0.0
    if j < 2:
        return 0.0, 0.0, 0.0
    k = j - 2 if j < 2 + n else j - 4 - n
    forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
    upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
    if j < 2 + n:
        omega = y[4 + n + k]
        return -forward, omega * upward, -omega * forward
    return 0.0, -forward, foot.rolling[k] - upward


@jacobian.case(OnGround)
def on_ground_jacobian(system: OnGround, t: float, y: State, J: Any) -> None:
    """Derivatives of the equations of motion, exact up to the switching points of the force law."""
    walker = system.walker
    tree = walker.tree
    n = len(tree.arm_x)
    for i in range(4 + 2 * n):
        for j in range(4 + 2 * n):
            J[i, j] = 1.0 if j == i + 2 + n else 0.0
    s, c = sines_cosines(tree, y, 2, walker.slope)
    if system.has_ground[0]:
        ground_gradients(walker, walker.feet[0], s, c, y, 2, J)
    if system.has_ground[1]:
        ground_gradients(walker, walker.feet[1], s, c, y, 2, J)
    M = mass_matrix(tree, s, c)
    torques = with_centrifugal(tree, s, c, y, 4 + n, all_wrenches(system, s, c, y)[2])
    torques = knee_torques(walker.knees, system.stops, y, 2, torques)
    knee_gradients(walker.knees, system.stops, y, 2, J)
    tree_gradients(tree, s, c, y, 2, turned_by(walker.held, system.held, M, torques), J)
    divide_by_held_mass(walker.held, system.held, tree, M, J)
    for j in range(4 + 2 * n):
        J[2 + n, j] /= tree.mass
        J[3 + n, j] /= tree.mass
