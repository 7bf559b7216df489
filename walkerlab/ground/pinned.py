"""The walker whose first stance foot is hinged to the ground: two angles, no floating base, no stance contact.

The paper's temporary revolute joint. The hinge is at the centre of the ball foot, which so keeps just touching the
ground while the leg turns over it.
"""

from typing import Any, NamedTuple

from walkerlab.ground.held import divide_by_held_mass, knee_gradients, knee_torques, turned_by
from walkerlab.ground.motion import ground_gradients, ground_wrench
from walkerlab.ground.walker import ContactWalker, Foot
from walkerlab.kernels import inlined
from walkerlab.mechanics.tree import (
    Tree,
    mass_matrix,
    sines_cosines,
    tree_gradients,
    with_centrifugal,
)
from walkerlab.mechanics.tuples import Vector, put
from walkerlab.solvers.in_tuples import blank, derivative, jacobian
from walkerlab.solvers.system import State


class Pinned(NamedTuple):
    """The hinged walker; state (theta_1 .. theta_n, their velocities)."""

    walker: ContactWalker
    tree: Tree  # about the hinge
    foot: int  # which foot is hinged
    along: float  # m, where
    blank: State
    held: tuple[bool, ...] = ()  # as of OnGround
    stops: tuple[bool, ...] = ()
    has_ground: bool = False  # whether there is ground under the other foot


@blank.case(Pinned)
def pinned_blank(system: Pinned) -> State:
    """The angles and their velocities."""
    return system.blank


@inlined
def gravity_torques(system: Pinned, s: Vector, c: Vector) -> Vector:
    """Torque of gravity on each body (N m): its first moment about the hinge in the field."""
    tree, walker = system.tree, system.walker
    torques = tree.arm_x
    for k in range(len(s)):
        forward = c[k] * tree.arm_x[k] - s[k] * tree.arm_y[k]
        upward = s[k] * tree.arm_x[k] + c[k] * tree.arm_y[k]
        torques = put(torques, k, -walker.gravity_along * upward - walker.gravity_down * forward)
    return torques


@inlined
def swing_foot(system: Pinned) -> Foot:
    """The other foot, its levers from the hinge."""
    hinged, foot = system.walker.feet[system.foot], system.walker.feet[1 - system.foot]
    lever_x, lever_y = foot.lever_x, foot.lever_y
    for k in range(len(lever_x)):
        lever_x = put(lever_x, k, lever_x[k] - hinged.lever_x[k])
        lever_y = put(lever_y, k, lever_y[k] - hinged.lever_y[k])
    return Foot(lever_x, lever_y, foot.rolling, foot.radius)


@inlined
def rooted_state(system: Pinned, y: State) -> State:
    """The free walker's state with the hinge in the place of the centre of mass: what `swing_foot` moves by."""
    walker = system.walker
    n = len(system.tree.arm_x)
    full = put(put(walker.blank, 0, system.along), 1, walker.feet[system.foot].radius)
    for k in range(n):
        full = put(full, 2 + k, y[k])
        full = put(full, 4 + n + k, y[n + k])
    return full


@inlined
def outer_torques(system: Pinned, s: Vector, c: Vector, y: State) -> Vector:
    """Torques on the bodies about the hinge (N m) of gravity and of the ground under the other foot."""
    torques = gravity_torques(system, s, c)
    if system.has_ground:
        rooted = rooted_state(system, y)
        torques = ground_wrench(system.walker, swing_foot(system), s, c, rooted, (0.0, 0.0, torques))[2]
    return torques


@derivative.case(Pinned)
def pinned_derivative(system: Pinned, t: float, y: State) -> State:
    """The tree's equations about the hinge."""
    tree = system.tree
    n = len(tree.arm_x)
    s, c = sines_cosines(tree, y, 0, system.walker.slope)
    torques = with_centrifugal(tree, s, c, y, n, outer_torques(system, s, c, y))
    torques = knee_torques(system.walker.knees, system.stops, y, 0, torques)
    alpha = turned_by(system.walker.held, system.held, mass_matrix(tree, s, c), torques)
    rate = system.blank
    for k in range(n):
        rate = put(rate, k, y[n + k])
        rate = put(rate, n + k, alpha[k])
    return rate


@jacobian.case(Pinned)
def pinned_jacobian(system: Pinned, t: float, y: State, J: Any) -> None:
    """Derivatives of the tree's equations about the hinge."""
    tree, walker = system.tree, system.walker
    n = len(tree.arm_x)
    s, c = sines_cosines(tree, y, 0, walker.slope)
    for i in range(2 * n):
        for j in range(2 * n):
            J[i, j] = 1.0 if j == i + n else 0.0
    for k in range(n):
        forward = c[k] * tree.arm_x[k] - s[k] * tree.arm_y[k]
        upward = s[k] * tree.arm_x[k] + c[k] * tree.arm_y[k]
        J[n + k, k] = walker.gravity_down * upward - walker.gravity_along * forward
    if system.has_ground:
        ground_gradients(walker, swing_foot(system), s, c, rooted_state(system, y), 0, J)
    M = mass_matrix(tree, s, c)
    torques = with_centrifugal(tree, s, c, y, n, outer_torques(system, s, c, y))
    torques = knee_torques(walker.knees, system.stops, y, 0, torques)
    knee_gradients(walker.knees, system.stops, y, 0, J)
    tree_gradients(tree, s, c, y, 0, turned_by(walker.held, system.held, M, torques), J)
    divide_by_held_mass(walker.held, system.held, tree, M, J)


@inlined
def floating_state(system: Pinned, y: State) -> State:
    """The same motion as a state of the free walker: the hinge tells where the centre of mass is."""
    walker = system.walker
    foot = walker.feet[system.foot]
    n = len(system.tree.arm_x)
    s, c = sines_cosines(system.tree, y, 0, walker.slope)
    along, height, speed, vertical_velocity = system.along, foot.radius, 0.0, 0.0
    full = walker.blank
    for k in range(n):
        forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
        upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
        along -= forward
        height -= upward
        speed += y[n + k] * upward
        vertical_velocity -= y[n + k] * forward
        full = put(full, 2 + k, y[k])
        full = put(full, 4 + n + k, y[n + k])
    full = put(full, 0, along)
    full = put(full, 1, height)
    full = put(full, 2 + n, speed)
    return put(full, 3 + n, vertical_velocity)
