"""Engine-independent model of a walker: a tree of rigid bodies in a plane, under tilted gravity."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from walkerlab.physics.mechanics.parts import Anchor, Assembly, Knee, Position, followers, masses, neighbours
from walkerlab.physics.solvers.system import Floats

Freedom = Literal["along", "height", "turn"]
FLOATING: tuple[Freedom, ...] = ("along", "height", "turn")
PINNED: tuple[Freedom, ...] = ("turn",)
UPRIGHT: tuple[Freedom, ...] = ("along", "height")
# Smallest inertia of a body, as a multiple of mass x length^2. Engines reject bodies without inertia.
SMALLEST_INERTIA = 1e-13
# Radius of the ball that replaces a point foot in engines. It must exceed the penetration.
SMALLEST_BALL_M = 5e-4


@dataclass(frozen=True)
class Link:
    """Rigid link that combines bodies that move together, and the particles on them.

    parent_point_m  hinge in the frame of the parent (m) or, for the base, the origin of the world
    point_m         hinge in the frame of the link (m) or, for the base, the point that its degrees of freedom move
    """

    name: str
    mass_kg: float
    centre_m: Position
    inertia_kg_m2: float
    parent: int  # index of the parent link; -1 for the base
    parent_point_m: Position
    point_m: Position


@dataclass(frozen=True)
class Ball:
    """Foot: a ball on a link, and the height of the ground under it."""

    link: int
    centre_m: Position
    radius_m: float
    ground_m: float  # height of the ground (m), lowered under a point foot by the radius of the ball that replaces it


@dataclass(frozen=True)
class PlanarModel:
    """Tree of links, and the components of gravity (m/s^2) along the slope and normal to it, into the ground."""

    links: tuple[Link, ...]  # base first, every link after its parent
    freedoms: tuple[Freedom, ...]  # degrees of freedom of the base relative to the world
    balls: tuple[Ball, ...]  # feet
    gravity_along: float
    gravity_down: float
    # (bodies, links) matrix from relative angles (base first) to the absolute angles of the bodies of the assembly
    chain: Floats

    @property
    def size(self) -> int:
        return len(self.freedoms) + len(self.links) - 1


def translate(point: Position, shift: Position) -> Position:
    return (point[0] + shift[0], point[1] + shift[1])


def planar_model(
    assembly: Assembly,
    base: Anchor,
    freedoms: tuple[Freedom, ...],
    gravity: tuple[float, float],
    welds: Collection[Knee] = (),
) -> PlanarModel:
    """Build the tree of an assembly's links, depth first, from a point of its base.

    gravity  along the slope and normal to it, into the ground, m/s^2
    welds    locked knees, whose shank and thigh form one link
    """
    root = base.body
    welded = [{knee.thigh, knee.shank} for knee in welds]
    # For each link: the bodies with their origins in the frame of the link (m), and the parent with the hinge in both
    # frames.
    members: list[list[tuple[str, Position]]] = [[(root, (0.0, 0.0))]]
    hinges: list[tuple[int, Position, Position]] = [(-1, (0.0, 0.0), base.at_m)]
    frames: dict[str, tuple[int, Position]] = {root: (0, (0.0, 0.0))}
    rows = {root: np.eye(1, len(assembly.bodies))[0]}

    def grow(name: str) -> None:
        link, shift = frames[name]
        for neighbour, leaving, entering in neighbours(assembly, name):
            if neighbour in rows:
                continue
            hinge, rows[neighbour] = translate(leaving, shift), rows[name].copy()
            if {name, neighbour} in welded:
                frames[neighbour] = link, (hinge[0] - entering[0], hinge[1] - entering[1])
                members[link].append((neighbour, frames[neighbour][1]))
            else:
                frames[neighbour] = len(members), (0.0, 0.0)
                rows[neighbour][len(members)] = 1.0
                members.append([(neighbour, (0.0, 0.0))])
                hinges.append((link, hinge, entering))
            grow(neighbour)

    grow(root)
    # The rows have a column for each body, but with locked knees there are fewer links than bodies.
    chain = np.ascontiguousarray(np.array([rows[body.name] for body in assembly.bodies])[:, : len(members)])
    links = tuple(lump_bodies(assembly, *link) for link in zip(members, hinges, strict=True))
    balls = []
    for foot in assembly.feet:
        link, shift = frames[foot.body]
        balls.append(Ball(link, translate(foot.centre_m, shift), *ball_and_ground(foot.radius_m)))
    return PlanarModel(links, freedoms, tuple(balls), *gravity, chain)


def ball_and_ground(radius_m: float) -> tuple[float, float]:
    """Return the radius of a foot's ball and the height of the ground under it (m)."""
    ball = max(radius_m, SMALLEST_BALL_M)
    return ball, radius_m - ball


def lump_bodies(
    assembly: Assembly, members: Sequence[tuple[str, Position]], hinge: tuple[int, Position, Position]
) -> Link:
    """Combine bodies that move together, and the particles on them, into a link."""
    parent, parent_point, point = hinge
    particles = [
        (mass, translate(anchor.at_m, shift))
        for name, shift in members
        for mass, anchor in masses(assembly)
        if anchor.body == name and mass > 0.0
    ]
    weights = np.array([mass for mass, _ in particles])
    places = np.array([place for _, place in particles])
    total = float(weights.sum())
    centre = weights @ places / total
    inertia = sum(assembly.bodies[assembly.index(name)].inertia_kg_m2 for name, _ in members)
    inertia += float(weights @ ((places - centre) ** 2).sum(axis=1))
    least = SMALLEST_INERTIA * total * max(float(np.hypot(*(np.array(point) - centre))), SMALLEST_BALL_M) ** 2
    x, y = float(centre[0]), float(centre[1])
    return Link(members[0][0], total, (x, y), max(inertia, least), parent, parent_point, point)


def coupling_rows(assembly: Assembly, model: PlanarModel) -> list[Floats]:
    """Return a row of weights (links,) for each body that follows other bodies.

    The relative angles of the links, multiplied by these weights, add up to zero.
    """
    return [model.chain[body] - row @ model.chain for body, row in followers(assembly).items()]
