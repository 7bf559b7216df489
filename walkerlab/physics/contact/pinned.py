"""The walker whose first stance foot is hinged to the ground: two angles, no floating base, no stance contact.

The paper's temporary revolute joint. The hinge is at the centre of the ball foot, which so keeps just touching the
ground while the leg turns over it.
"""

from typing import NamedTuple

from walkerlab.kernels import inlined
from walkerlab.physics.contact.walker import ContactWalker
from walkerlab.physics.multibody.tree import Tree, mass_matrix, sines_cosines, with_centrifugal
from walkerlab.physics.system import State, blank, derivative
from walkerlab.physics.tuples import put, solve_symmetric


class Pinned(NamedTuple):
    """The hinged walker; state (theta_1 .. theta_n, their velocities)."""

    walker: ContactWalker
    tree: Tree  # about the hinge
    foot: int  # which foot is hinged
    along: float  # m, where
    blank: State


@blank.case(Pinned)
def pinned_blank(system: Pinned) -> State:
    """The angles and their velocities."""
    return system.blank


@derivative.case(Pinned)
def pinned_derivative(system: Pinned, t: float, y: State) -> State:
    """The tree's equations about the hinge; gravity turns each body by its first moment about it."""
    tree, walker = system.tree, system.walker
    n = len(tree.arm_x)
    s, c = sines_cosines(tree, y, 0, walker.slope)
    torques = tree.arm_x
    for k in range(n):
        forward = c[k] * tree.arm_x[k] - s[k] * tree.arm_y[k]
        upward = s[k] * tree.arm_x[k] + c[k] * tree.arm_y[k]
        torques = put(torques, k, -walker.gravity_along * upward - walker.gravity_down * forward)
    alpha = solve_symmetric(mass_matrix(tree, s, c), with_centrifugal(tree, s, c, y, n, torques))
    rate = system.blank
    for k in range(n):
        rate = put(rate, k, y[n + k])
        rate = put(rate, n + k, alpha[k])
    return rate


@inlined
def floating_state(system: Pinned, y: State) -> State:
    """The same motion as a state of the free walker: the hinge tells where the centre of mass is."""
    walker = system.walker
    foot = walker.feet[system.foot]
    n = len(system.tree.arm_x)
    s, c = sines_cosines(system.tree, y, 0, walker.slope)
    along, height, speed, climb = system.along, foot.radius, 0.0, 0.0
    full = walker.blank
    for k in range(n):
        forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
        upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
        along -= forward
        height -= upward
        speed += y[n + k] * upward
        climb -= y[n + k] * forward
        full = put(full, 2 + k, y[k])
        full = put(full, 4 + n + k, y[n + k])
    full = put(full, 0, along)
    full = put(full, 1, height)
    full = put(full, 2 + n, speed)
    return put(full, 3 + n, climb)
