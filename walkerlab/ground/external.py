"""The ground's forces for a program that integrates the walker itself, in that program's own coordinates.

Coordinates: where a point of the base body is, along the slope and over it (m), then one angle a link, each measured
from the link that it is hinged to (rad); the base's from the slope's normal. Forces are generalised in the same order.
"""

from typing import Any

import numpy as np

from walkerlab.ground.friction import FrictionLaw
from walkerlab.ground.held import NoKnees, NoneHeld
from walkerlab.ground.merged import Unmerged
from walkerlab.ground.motion import OnGround, all_wrenches
from walkerlab.ground.normal_force import NormalLaw
from walkerlab.ground.walker import ContactWalker, Foot, foot_motion
from walkerlab.kernels import inlined, kernel
from walkerlab.mechanics.tree import Tree, sines_cosines
from walkerlab.mechanics.tuples import put
from walkerlab.solvers.system import State
from walkerlab.solvers.vectors import load

LEGS = ((0,), (1,))  # of no consequence to the feet


def in_arrays(walker: ContactWalker) -> tuple[Any, Any, FrictionLaw]:
    """Levers (6, n) and numbers of a walker as arrays, and its friction: a call with these takes a microsecond."""
    rows = [row for foot in walker.feet for row in (foot.lever_x, foot.lever_y, foot.rolling)]
    numbers = np.array([walker.slope, walker.feet[0].radius, walker.feet[1].radius, *walker.normal])
    return np.array(rows), numbers, walker.friction


@inlined
def from_arrays(levers: Any, numbers: Any, friction: Any, state: State, angles: Any) -> ContactWalker:
    """As much of the walker as its feet need; `state` and `angles` are zeros of the right length."""
    first = Foot(load(levers, 0, angles), load(levers, 1, angles), load(levers, 2, angles), numbers[1])
    second = Foot(load(levers, 3, angles), load(levers, 4, angles), load(levers, 5, angles), numbers[2])
    normal = NormalLaw(numbers[3], numbers[4], numbers[5], numbers[6])
    tree = Tree(0.0, angles, angles, angles, angles)
    straight = (NoneHeld(), NoKnees(), LEGS, state, Unmerged())
    return ContactWalker(tree, (first, second), normal, friction, 0.0, 0.0, numbers[0], *straight)


@inlined
def absolute_state(slope: float, chain: Any, q: Any, v: Any, y: State, n: int) -> State:
    """The state in absolute angles; `chain` (n, links) holds a one where an angle is a sum over a joint."""
    for i in range(2):
        y = put(y, i, q[i])
        y = put(y, 2 + n + i, v[i])
    for k in range(n):
        angle, rate = -slope, 0.0
        for j in range(chain.shape[1]):
            angle += chain[k, j] * q[2 + j]
            rate += chain[k, j] * v[2 + j]
        y = put(y, 2 + k, angle)
        y = put(y, 4 + n + k, rate)
    return y


@kernel
def feet_and_forces(
    levers: Any,
    numbers: Any,
    friction: Any,
    state: State,
    angles: Any,
    chain: Any,
    has_ground: Any,
    q: Any,
    v: Any,
    feet: Any,
    forces: Any,
) -> None:
    """How both feet move into feet (2, 4) and, unless that is empty, the ground's forces into forces (2 + links).

    levers ...  of `in_arrays`, of a walker whose feet's levers are from the base's point
    state       zeros, as many as the state has; angles: as many as there are bodies
    chain       (n, links) which joints lie between the base and each body; bodies that move as one share theirs
    has_ground     (2,) whether there is ground under each foot
    q, v        (2 + links) coordinates and velocities of the other program
    feet        along (m), height (m), slip (m/s), velocity of the height (m/s)
    """
    n = len(angles)
    walker = from_arrays(levers, numbers, friction, state, angles)
    y = absolute_state(walker.slope, chain, q, v, state, n)
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    for foot in range(2):
        motion = foot_motion(walker, walker.feet[foot], s, c, y)
        feet[foot, 0], feet[foot, 1] = motion.along, motion.height
        feet[foot, 2], feet[foot, 3] = motion.slip, motion.vertical_velocity
    if forces.size == 0:
        return
    wrench = all_wrenches(OnGround(walker, (has_ground[0] != 0, has_ground[1] != 0)), s, c, y)
    forces[0], forces[1] = wrench[0], wrench[1]
    for j in range(chain.shape[1]):
        total = 0.0
        for k in range(n):
            total += chain[k, j] * wrench[2][k]
        forces[2 + j] = total
