"""Parts from which a planar walker is assembled, as in a multibody program.

Each body has its own frame, whose axes are parallel to the world's at angle zero. Positions refer to this frame.

The parts give the constants of the equations of motion. Choose a point of the tree, the root. Every other point lies at
root + sum over bodies k of R(theta_k) d_k, where the levers d_k are constants of the assembly and theta_k the bodies'
absolute angles. The kinetic energy depends only on

    A_kl = sum m d_k . d_l (+ inertia on the diagonal),   B_kl = sum m d_k . (rotated d_l),   c_k = sum m d_k

with sums over all masses m. With the centre of mass as the root, c vanishes and translation decouples from rotation.
With Delta = theta_l - theta_k, the equations of motion about a root at rest are

    M_kl = A_kl cos Delta + B_kl sin Delta
    M alpha = torques + sum over l of omega_l^2 (A_kl sin Delta - B_kl cos Delta)
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.solvers.system import Floats, Integers

Position = tuple[float, float]


@dataclass(frozen=True)
class Body:
    """Rigid body with its mass, its centre of mass in the body's frame, and its inertia about that centre."""

    name: str
    mass_kg: float
    centre_m: Position
    inertia_kg_m2: float = 0.0


@dataclass(frozen=True)
class Particle:
    """Point mass fixed to a body, such as a hip mass on a joint's axle."""

    name: str
    mass_kg: float
    body: str
    at_m: Position


@dataclass(frozen=True)
class Revolute:
    """Frictionless hinge between a point of one body and a point of another."""

    name: str
    parent: str
    parent_point_m: Position
    child: str
    child_point_m: Position

    def both_ways(self) -> "tuple[Revolute, Revolute]":
        """Return the hinge, and the same hinge with its bodies exchanged."""
        return self, Revolute(self.name, self.child, self.child_point_m, self.parent, self.parent_point_m)


@dataclass(frozen=True)
class BallFoot:
    """Ball that is fixed to a body and touches the ground directly below the ball's centre.

    A zero radius makes a point foot.
    """

    name: str
    body: str
    centre_m: Position
    radius_m: float


@dataclass(frozen=True)
class Knee:
    """Hinge that locks when the shank, swinging forward, reaches the thigh's angle."""

    name: str
    thigh: str
    shank: str


@dataclass(frozen=True)
class Coupling:
    """Body whose angle is a weighted sum of other bodies' angles, such as a torso on the legs' bisector."""

    body: str
    of: tuple[str, ...]
    weights: tuple[float, ...]


@dataclass(frozen=True)
class Assembly:
    """Bodies connected by hinges, without closed loops.

    Raises KeyError for a part on an unknown body, ValueError for duplicate body names and for closed loops.
    """

    bodies: tuple[Body, ...]
    joints: tuple[Revolute, ...]
    particles: tuple[Particle, ...] = ()
    feet: tuple[BallFoot, ...] = ()
    knees: tuple[Knee, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    # bodies of each leg from the hip down, in the same order for both legs, which exchange roles at heel strike. The
    # first foot belongs to the first leg. Bodies listed for neither leg are shared by both
    legs: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())

    def __post_init__(self) -> None:
        names = [body.name for body in self.bodies]
        if len(set(names)) < len(names):
            raise ValueError(f"duplicate body name in {', '.join(names)}")
        placed = [*(particle.body for particle in self.particles), *(foot.body for foot in self.feet)]
        locked = [body for knee in self.knees for body in (knee.thigh, knee.shank)]
        coupled = [body for coupling in self.couplings for body in (coupling.body, *coupling.of)]
        for body in (*placed, *locked, *coupled, *self.legs[0], *self.legs[1]):
            self.index(body)
        # Bodies that are connected so far have the same group, so a hinge within a group would close a loop.
        group = list(range(len(names)))
        for joint in self.joints:
            one = group[self.index(joint.parent)]
            other = group[self.index(joint.child)]
            if one == other:
                raise ValueError(f"hinge {joint.name!r} makes a closed loop; only trees can be assembled")
            group = [one if of == other else of for of in group]

    def index(self, body: str) -> int:
        """Return the index of a body in `bodies`. For an unknown body, raise a KeyError that lists the known ones."""
        names = [b.name for b in self.bodies]
        if body not in names:
            raise KeyError(f"no body named {body!r}; bodies: {', '.join(names)}")
        return names.index(body)

    def hinge(self, body: str, other: str) -> Revolute | None:
        """Return the hinge between two bodies, with the first as the parent, or None if there is no such hinge."""
        hinges = (hinge for joint in self.joints for hinge in joint.both_ways())
        return next((hinge for hinge in hinges if (hinge.parent, hinge.child) == (body, other)), None)


class Tree(NamedTuple):
    """Constants of a tree of n bodies about its root."""

    mass: float  # kg
    A: Floats  # (n, n) kg m^2
    B: Floats
    arm_x: Floats  # (n,) c, kg m: first moments about the root; zero if the root is the centre of mass
    arm_y: Floats

    def merge_bodies(self, members: Floats) -> dict[str, Any]:
        """Return the fields of a Mechanism in which each group of bodies is one body.

        members  (bodies, n) 1 where a body belongs to a group, otherwise 0
        """
        A, B = (members.T @ pairs @ members for pairs in (self.A, self.B))
        return {"A": A, "B": B, "arm_x": self.arm_x @ members, "arm_y": self.arm_y @ members, "mass": self.mass}


def reduction(rows: Mapping[int, Floats], n: int) -> Floats:
    """Build the matrix E (n, n) of tree.py from each follower's weights (n,)."""
    E = np.eye(n)
    for follower, row in rows.items():
        E[follower] = row
    return E


@dataclass(frozen=True)
class Anchor:
    """Point of the tree: a body's name and a position in its frame."""

    body: str
    at_m: Position


def levers(assembly: Assembly, root: Anchor, point: Anchor) -> Floats:
    """Compute the levers d (bodies, 2) in m such that `point` lies at root + sum over k of R(theta_k) d[k].

    Raises KeyError for an unknown body, ValueError if no hinges connect the bodies of root and point.
    """
    for end in (root, point):
        assembly.index(end.body)
    d = np.zeros((len(assembly.bodies), 2))
    here = np.array(root.at_m)
    for body, leaving, entering in path(assembly, root.body, point.body):
        # A body's lever runs from the point where the path enters the body to the point where it leaves it.
        d[assembly.index(body)] += np.array(leaving) - here
        here = np.array(entering)
    d[assembly.index(point.body)] += np.array(point.at_m) - here
    return d


def path(assembly: Assembly, start: str, goal: str) -> list[tuple[str, Position, Position]]:
    """List the hinges from body `start` to body `goal` as (body, hinge point on it, hinge point on the next body)."""
    reached: dict[str, list[tuple[str, Position, Position]]] = {start: []}
    frontier = [start]
    while frontier:
        body = frontier.pop()
        for neighbour, leaving, entering in neighbours(assembly, body):
            if neighbour not in reached:
                reached[neighbour] = [*reached[body], (body, leaving, entering)]
                frontier.append(neighbour)
    if goal not in reached:
        raise ValueError(f"no hinges lead from body {start!r} to body {goal!r}; add a Revolute between them")
    return reached[goal]


def neighbours(assembly: Assembly, body: str) -> Iterator[tuple[str, Position, Position]]:
    """Yield each body that is hinged to `body`, with the hinge's point on `body` and on the neighbour."""
    for joint in assembly.joints:
        for hinge in joint.both_ways():
            if hinge.parent == body:
                yield hinge.child, hinge.parent_point_m, hinge.child_point_m


def masses(assembly: Assembly) -> Iterator[tuple[float, Anchor]]:
    """Yield every mass (kg) of the assembly with its position."""
    for body in assembly.bodies:
        yield body.mass_kg, Anchor(body.name, body.centre_m)
    for particle in assembly.particles:
        yield particle.mass_kg, Anchor(particle.body, particle.at_m)


def total_mass(assembly: Assembly) -> float:
    return sum(mass for mass, _ in masses(assembly))


def tree_about(assembly: Assembly, root: Anchor) -> Tree:
    """Compute the constants of the equations of motion about a point of a body."""
    return sum_masses(assembly, [(mass, levers(assembly, root, at)) for mass, at in masses(assembly)])


def tree_about_centre(assembly: Assembly) -> tuple[Tree, tuple[Floats, ...]]:
    """Compute the constants about the centre of mass, and the levers (bodies, 2) in m from there to each foot."""
    # Any point serves as the first root, because the levers are then shifted to the centre of mass.
    root = Anchor(assembly.bodies[0].name, assembly.bodies[0].centre_m)
    mass_levers = [(mass, levers(assembly, root, at)) for mass, at in masses(assembly)]
    centre = sum(mass * d for mass, d in mass_levers) / total_mass(assembly)
    feet = tuple(levers(assembly, root, Anchor(foot.body, foot.centre_m)) - centre for foot in assembly.feet)
    return sum_masses(assembly, [(mass, d - centre) for mass, d in mass_levers]), feet


def sum_masses(assembly: Assembly, mass_levers: list[tuple[float, Floats]]) -> Tree:
    A = np.diag([body.inertia_kg_m2 for body in assembly.bodies])
    B = np.zeros_like(A)
    c = np.zeros((len(assembly.bodies), 2))
    for mass, d in mass_levers:
        rotated = np.column_stack((-d[:, 1], d[:, 0]))
        A = A + mass * d @ d.T
        B = B + mass * d @ rotated.T
        c = c + mass * d
    return Tree(total_mass(assembly), A, B, c[:, 0], c[:, 1])


def followers(assembly: Assembly) -> dict[int, Floats]:
    """Return the weights (bodies,) with which each coupled body follows the others, by the body's index."""
    rows = {}
    for coupling in assembly.couplings:
        row = np.zeros(len(assembly.bodies))
        for neighbour, weight in zip(coupling.of, coupling.weights, strict=True):
            row[assembly.index(neighbour)] += weight
        rows[assembly.index(coupling.body)] = row
    return rows


def hip_levers(assembly: Assembly, to_foot: Floats) -> Floats:
    """Return the levers (bodies, 2) to the hip in m, from the point at which the levers `to_foot` start.

    to_foot  (bodies, 2) levers to the first foot, m
    """
    # Without named legs, the first foot takes the place of the hip.
    if not all(assembly.legs):
        return to_foot
    swing, stance = (leg[0] for leg in assembly.legs)
    foot = assembly.feet[0]
    hip = Anchor(stance, hinge_point(assembly, stance, swing))
    return to_foot + levers(assembly, Anchor(foot.body, foot.centre_m), hip)


def hinge_point(assembly: Assembly, body: str, other: str) -> Position:
    """Return the point in the frame of `body` where it is hinged to `other`, or the origin if there is none."""
    hinge = assembly.hinge(body, other)
    return (0.0, 0.0) if hinge is None else hinge.parent_point_m


def leg_bodies(assembly: Assembly) -> Integers:
    named = assembly.legs if all(assembly.legs) else tuple((foot.body,) for foot in assembly.feet)
    most = max(map(len, named))
    # The shorter leg repeats its last body, because both rows must have the same length.
    return np.array([[assembly.index(body) for body in (*leg, *leg[-1:] * (most - len(leg)))] for leg in named])
