"""A walker on compliant ground: an assembled tree with ball feet, described about its centre of mass.

Coordinates in the slope's frame: along the slope (positive downhill) and height over it, m; the bodies' absolute
angles from the vertical, rad. State: (along, height, theta_1 .. theta_n, and the velocities of all these).
"""

from typing import Any, NamedTuple

from walkerlab.ground.friction import friction_coefficient
from walkerlab.ground.normal_force import NormalForce, NormalLaw, impact_normal_force
from walkerlab.kernels import inlined
from walkerlab.mechanics.tree import Tree
from walkerlab.mechanics.tuples import Vector
from walkerlab.solvers.system import State


class Foot(NamedTuple):
    """A ball foot: where its centre is from the centre of mass, body by body."""

    lever_x: Vector  # (n) m, in the bodies' frames
    lever_y: Vector
    rolling: Vector  # (n) m, the ball's radius for its own body, else zero
    radius: float  # m


class ContactWalker(NamedTuple):
    """Everything that stays the same while it walks."""

    tree: Tree
    feet: tuple[Foot, Foot]
    normal: NormalLaw
    friction: Any  # a FrictionLaw
    gravity_along: float  # m/s^2
    gravity_down: float  # m/s^2, towards the slope
    slope: float  # rad
    held: Any  # Independent or Held: which bodies follow others
    knees: Any  # NoKnees, Knees, OneBends or NoneBends
    legs: tuple[tuple[int, ...], tuple[int, ...]]  # bodies of either leg of the whole walker, from the hip down
    blank: State  # a state of zeros
    merging: Any  # Unmerged, ByKnees or Merged: what it is while knees are locked


class FootMotion(NamedTuple):
    """Where a foot's lowest point is and how it moves."""

    along: float  # m
    height: float  # m over the slope, negative inside the ground
    slip: float  # m/s, velocity along the slope of the material point there
    vertical_velocity: float  # m/s, velocity of the height


@inlined
def foot_motion(walker: ContactWalker, foot: Foot, s: Vector, c: Vector, y: State) -> FootMotion:
    """Position and velocity of the lowest point of a ball foot; the slip is that of the ball's own material there."""
    n = len(s)
    along, height = y[0], y[1] - foot.radius
    slip, vertical_velocity = y[2 + n], y[3 + n]
    for k in range(n):
        omega = y[4 + n + k]
        forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
        upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
        along += forward
        height += upward
        slip += omega * (foot.rolling[k] - upward)
        vertical_velocity += omega * forward
    return FootMotion(along, height, slip, vertical_velocity)


class FootForce(NamedTuple):
    """What the ground does to a foot."""

    along: float  # N, friction
    normal: NormalForce
    by_slip: float  # N s/m, derivative of the friction
    coefficient: float  # friction over normal force, with its sign


@inlined
def foot_force(walker: ContactWalker, motion: FootMotion) -> FootForce:
    """Force of the ground on a foot that is inside it."""
    normal = impact_normal_force(-motion.height, -motion.vertical_velocity, walker.normal)
    mu, mu_slope = friction_coefficient(walker.friction, motion.slip)
    return FootForce(mu * normal.force, normal, mu_slope * normal.force, mu)
