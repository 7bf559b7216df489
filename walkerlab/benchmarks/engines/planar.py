"""What an engine is told of a walker: a tree of rigid bodies in a plane, hung from its base, under tilted gravity."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from walkerlab.mechanics.assembly import Anchor, levers, neighbours
from walkerlab.mechanics.parts import Assembly, Position

Floats = NDArray[np.float64]
Freedom = Literal["along", "height", "turn"]
FLOATING: tuple[Freedom, ...] = ("along", "height", "turn")
HINGED: tuple[Freedom, ...] = ("turn",)
UPRIGHT: tuple[Freedom, ...] = ("along", "height")
SMALLEST_INERTIA = 1e-13  # of mass times length squared: engines refuse a body without inertia
SMALLEST_BALL_M = 5e-4  # for point feet, which engines do not have; larger than any penetration


@dataclass(frozen=True)
class Link:
    """One rigid body, its particles lumped into it.

    parent        place of the body it is hinged to in `links`; -1 for the base
    parent_point  the hinge in the parent's frame (m); for the base the point that the root's freedoms move
    point         the hinge in its own frame (m)
    """

    name: str
    mass_kg: float
    centre_m: Position
    inertia_kg_m2: float
    parent: int
    parent_point_m: Position
    point_m: Position


@dataclass(frozen=True)
class Ball:
    """A foot: a ball on a link, with the height of the ground that it is to meet."""

    link: int
    centre_m: Position
    radius_m: float
    ground_m: float  # a point foot gets a tiny ball, and ground that much lower


@dataclass(frozen=True)
class PlanarModel:
    """A tree of links.

    links    the base first, every link after its parent
    freedoms of the base against the world
    balls    the feet
    gravity  m/s^2, along the slope and towards it
    """

    links: tuple[Link, ...]
    freedoms: tuple[Freedom, ...]
    balls: tuple[Ball, ...]
    gravity_along: float
    gravity_down: float

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.freedoms) + len(self.links) - 1


def planar_model(
    assembly: Assembly, base: str, base_point: Position, freedoms: tuple[Freedom, ...], gravity: float, slope: float
) -> PlanarModel:
    """The assembly hung from a point of its base; gravity in m/s^2, slope in rad."""
    names, hinges = order_from(assembly, base)
    links = []
    for name in names:
        parent, parent_point, point = hinges.get(name, ("", (0.0, 0.0), base_point))
        links.append(lumped(assembly, name, names.index(parent) if parent else -1, parent_point, point))
    balls = tuple(
        Ball(names.index(foot.body), foot.centre_m, *ball_and_ground(foot.radius_m)) for foot in assembly.feet
    )
    return PlanarModel(tuple(links), freedoms, balls, gravity * math.sin(slope), gravity * math.cos(slope))


def ball_and_ground(radius_m: float) -> tuple[float, float]:
    """Radius of a foot's ball and height of the ground under it (m)."""
    ball = max(radius_m, SMALLEST_BALL_M)
    return ball, radius_m - ball


def order_from(assembly: Assembly, base: str) -> tuple[list[str], dict[str, tuple[str, Position, Position]]]:
    """The bodies from the base outwards, and for each but the base: its parent and the hinge in both frames."""
    names, hinges = [base], {}
    for name in names:
        for other, leaving, entering in neighbours(assembly, name):
            if other not in names:
                names.append(other)
                hinges[other] = (name, leaving, entering)
    return names, hinges


def lumped(assembly: Assembly, name: str, parent: int, parent_point: Position, point: Position) -> Link:
    """A body and the particles on it as one."""
    body = assembly.bodies[assembly.index(name)]
    particles = [particle for particle in assembly.particles if particle.body == name and particle.mass_kg > 0.0]
    masses = np.array([body.mass_kg, *(particle.mass_kg for particle in particles)])
    places = np.array([body.centre_m, *(particle.at_m for particle in particles)])
    total = float(masses.sum())
    centre = masses @ places / total
    inertia = body.inertia_kg_m2 + float(masses @ ((places - centre) ** 2).sum(axis=1))
    least = SMALLEST_INERTIA * total * max(float(np.hypot(*(np.array(point) - centre))), SMALLEST_BALL_M) ** 2
    at = (float(centre[0]), float(centre[1]))
    return Link(name, total, at, max(inertia, least), parent, parent_point, point)


def chain_of(assembly: Assembly, base: str) -> Floats:
    """Matrix (n, n): which relative angles, base first, add up to each body's absolute angle (assembly's order)."""
    names, hinges = order_from(assembly, base)
    chain = np.zeros((len(names), len(names)))
    for name in names:
        row = assembly.index(name)
        if name in hinges:
            chain[row] = chain[assembly.index(hinges[name][0])]
        chain[row, names.index(name)] = 1.0
    return chain


def levers_from(assembly: Assembly, base: str, base_point: Position, body: str, at_m: Position) -> Floats:
    """Levers (n, 2) in m from the base's point to a point of a body."""
    return levers(assembly, Anchor(base, base_point), Anchor(body, at_m))
