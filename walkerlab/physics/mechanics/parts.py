"""Parts from which a planar walker is assembled, as in a multibody program.

Each body has its own frame, whose axes are parallel to the world's at angle zero. Positions refer to this frame.
"""

from dataclasses import dataclass

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


@dataclass(frozen=True)
class BallFoot:
    """Ball fixed to a body, which touches the ground directly below its centre. A zero radius makes a point foot."""

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
        """Return the hinge between two bodies, with the first as the parent, or None if they are not hinged
        directly.
        """
        for joint in self.joints:
            if (joint.parent, joint.child) == (body, other):
                return joint
            if (joint.child, joint.parent) == (body, other):
                return Revolute(joint.name, body, joint.child_point_m, other, joint.parent_point_m)
        return None
