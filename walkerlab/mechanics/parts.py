"""The parts that a planar walker is assembled from, as in a multibody program.

Every body has a frame of its own; at angle zero its axes are those of the world. Positions are given in that frame.
"""

from dataclasses import dataclass

Position = tuple[float, float]


@dataclass(frozen=True)
class Body:
    """A rigid body: mass, centre of mass in its own frame, and inertia about that centre."""

    name: str
    mass_kg: float
    centre_m: Position
    inertia_kg_m2: float = 0.0


@dataclass(frozen=True)
class Particle:
    """A point mass fixed to a body, such as a hip that is one with a joint's axle."""

    name: str
    mass_kg: float
    body: str
    at_m: Position


@dataclass(frozen=True)
class Revolute:
    """A frictionless hinge between a point of one body and a point of another."""

    name: str
    parent: str
    parent_point_m: Position
    child: str
    child_point_m: Position


@dataclass(frozen=True)
class BallFoot:
    """A ball fixed to a body: the ground touches it below its centre; radius zero is a point."""

    name: str
    body: str
    centre_m: Position
    radius_m: float


@dataclass(frozen=True)
class Assembly:
    """Bodies held together by hinges, without closed loops.

    Raises KeyError for a part on a body that is not there, ValueError for two bodies of one name and for closed loops.
    """

    bodies: tuple[Body, ...]
    joints: tuple[Revolute, ...]
    particles: tuple[Particle, ...] = ()
    feet: tuple[BallFoot, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is not a tree of known bodies."""
        names = [body.name for body in self.bodies]
        if len(set(names)) < len(names):
            raise ValueError(f"two bodies of one name among {', '.join(names)}")
        for body in [*(particle.body for particle in self.particles), *(foot.body for foot in self.feet)]:
            self.index(body)
        group = list(range(len(names)))
        for joint in self.joints:
            one, other = group[self.index(joint.parent)], group[self.index(joint.child)]
            if one == other:
                raise ValueError(f"hinge {joint.name!r} makes a closed loop; only trees can be assembled")
            group = [one if of == other else of for of in group]

    def index(self, body: str) -> int:
        """Place of a body in `bodies`; KeyError names the bodies there are."""
        names = [b.name for b in self.bodies]
        if body not in names:
            raise KeyError(f"no body named {body!r}; bodies: {', '.join(names)}")
        return names.index(body)
