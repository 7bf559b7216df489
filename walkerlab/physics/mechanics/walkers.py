"""Catalogue of walkers: assemblies of parts, built from the dimensions of each type of walker.

A body's frame has its origin at a hinge (the knee for a shank, otherwise the hip) and its y axis points up the body;
"ahead" is the walking direction while the leg is upright. Leg 1 swings first, leg 2 stands first. A positive angle puts
a leg's foot forward, so in a flexed knee the shank's angle is smaller than the thigh's.
"""

from dataclasses import dataclass, replace

from walkerlab.physics.mechanics.parts import Assembly, BallFoot, Body, Coupling, Knee, Particle, Revolute

LEG_NAMES = ("leg 1", "leg 2")
THIGHS = ("thigh 1", "thigh 2")
SHANKS = ("shank 1", "shank 2")
TORSO = "torso"
UPPER_END = (0.0, 0.0)


@dataclass(frozen=True)
class Limb:
    """Rigid limb hanging from its upper end, SI."""

    length_m: float
    mass_kg: float
    mass_below_m: float  # distance of the centre of mass below the upper end
    mass_ahead_m: float = 0.0
    inertia_kg_m2: float = 0.0  # about the limb's centre of mass

    def body(self, name: str) -> Body:
        return Body(name, self.mass_kg, (self.mass_ahead_m, -self.mass_below_m), self.inertia_kg_m2)


@dataclass(frozen=True)
class Arc:
    """Circular sole, whose lowest point is level with the leg's lower end. A zero radius makes a point foot."""

    radius_m: float = 0.0
    centre_ahead_m: float = 0.0

    def foot(self, body: str, length_m: float) -> BallFoot:
        return BallFoot(f"foot of {body}", body, (self.centre_ahead_m, self.radius_m - length_m), self.radius_m)


def straight_legs(leg: Limb, hip_mass_kg: float, foot: Arc) -> Assembly:
    return Assembly(
        bodies=tuple(leg.body(name) for name in LEG_NAMES),
        joints=(Revolute("hip", LEG_NAMES[1], UPPER_END, LEG_NAMES[0], UPPER_END),),
        particles=(Particle("hip", hip_mass_kg, LEG_NAMES[1], UPPER_END),),
        feet=tuple(foot.foot(name, leg.length_m) for name in LEG_NAMES),
        legs=((LEG_NAMES[0],), (LEG_NAMES[1],)),
    )


def replace_second_leg(walker: Assembly, other: Assembly) -> Assembly:
    """Return `walker` with the second leg of `other`. The hip mass is that of `walker`."""
    legs = walker.legs[0], other.legs[1]
    sources = (walker, legs[0]), (other, legs[1])
    names = (legs[0][0], legs[1][0], *legs[0][1:], *legs[1][1:])
    bodies = {body.name: body for source, leg in sources for body in source.bodies if body.name in leg}
    # The hip joins bodies of both legs, so the hinges within one leg are knees.
    knees = tuple(j for source, leg in sources for j in source.joints if {j.parent, j.child} <= {*leg})
    return Assembly(
        bodies=tuple(bodies[name] for name in names),
        joints=(Revolute("hip", names[1], UPPER_END, names[0], UPPER_END), *knees),
        particles=(Particle("hip", walker.particles[0].mass_kg, names[1], UPPER_END),),
        feet=(walker.feet[0], other.feet[1]),
        knees=tuple(knee for source, leg in sources for knee in source.knees if knee.shank in leg),
        legs=legs,
    )


def kneed_legs(thigh: Limb, shank: Limb, hip_mass_kg: float, foot: Arc) -> Assembly:
    at_knee = (0.0, -thigh.length_m)
    knees = tuple(Revolute(f"knee {k + 1}", THIGHS[k], at_knee, SHANKS[k], UPPER_END) for k in range(2))
    return Assembly(
        bodies=(*(thigh.body(name) for name in THIGHS), *(shank.body(name) for name in SHANKS)),
        joints=(Revolute("hip", THIGHS[1], UPPER_END, THIGHS[0], UPPER_END), *knees),
        particles=(Particle("hip", hip_mass_kg, THIGHS[1], UPPER_END),),
        feet=tuple(foot.foot(name, shank.length_m) for name in SHANKS),
        knees=tuple(Knee(f"knee {k + 1}", THIGHS[k], SHANKS[k]) for k in range(2)),
        legs=((THIGHS[0], SHANKS[0]), (THIGHS[1], SHANKS[1])),
    )


def add_torso(walker: Assembly, mass_kg: float, above_hip_m: float, inertia_kg_m2: float) -> Assembly:
    """Add a torso that is hinged at the hip and kept on the bisector of the legs.

    Source: Wisse, Schwab, van der Helm, Passive dynamic walking model with upper body, Robotica 22 (2004).
    """
    upper = tuple(leg[0] for leg in walker.legs)
    return replace(
        walker,
        bodies=(*walker.bodies, Body(TORSO, mass_kg, (0.0, above_hip_m), inertia_kg_m2)),
        joints=(*walker.joints, Revolute("torso", upper[1], UPPER_END, TORSO, UPPER_END)),
        couplings=(*walker.couplings, Coupling(TORSO, upper, (0.5, 0.5))),
    )
