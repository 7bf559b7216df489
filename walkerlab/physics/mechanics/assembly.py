"""Constants of the equations of motion, from the parts of a walker.

Choose a point of the tree, the root. Every other point lies at root + sum over bodies k of R(theta_k) d_k, where the
levers d_k are constants of the assembly and theta_k the bodies' absolute angles. The kinetic energy depends only on

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

from walkerlab.physics.mechanics.parts import Assembly, Position
from walkerlab.physics.solvers.system import Floats


class Tree(NamedTuple):
    """Constants of a tree of n bodies about its root."""

    mass: float  # kg
    A: Floats  # (n, n) kg m^2
    B: Floats
    arm_x: Floats  # (n,) c, kg m: first moments about the root; zero if the root is the centre of mass
    arm_y: Floats

    def merge_bodies(self, members: Floats) -> dict[str, Any]:
        """Return the fields of a Mechanism for grouped bodies. `members` (bodies, n) is 1 where a body belongs to a
        group.
        """
        A, B = (members.T @ pairs @ members for pairs in (self.A, self.B))
        return {"A": A, "B": B, "arm_x": self.arm_x @ members, "arm_y": self.arm_y @ members, "mass": self.mass}


def reduction(rows: Mapping[int, Floats], n: int) -> Floats:
    """Build the matrix E (n, n) of links.py from each follower's weights (n,)."""
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
        if joint.parent == body:
            yield joint.child, joint.parent_point_m, joint.child_point_m
        if joint.child == body:
            yield joint.parent, joint.child_point_m, joint.parent_point_m


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
    mass_levers = [(mass, levers(assembly, root, at)) for mass, at in masses(assembly)]
    return sum_masses(assembly, mass_levers)


def tree_about_centre(assembly: Assembly) -> tuple[Tree, tuple[Floats, ...]]:
    """Compute the constants about the centre of mass, and the levers (bodies, 2) in m from there to each foot."""
    # Any point serves as the first root; the levers are then shifted to the centre of mass.
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
    """Return, by index of each coupled body, the weights (bodies,) with which it follows the others."""
    rows = {}
    for coupling in assembly.couplings:
        row = np.zeros(len(assembly.bodies))
        for neighbour, weight in zip(coupling.of, coupling.weights, strict=True):
            row[assembly.index(neighbour)] += weight
        rows[assembly.index(coupling.body)] = row
    return rows
