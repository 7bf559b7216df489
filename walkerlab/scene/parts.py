"""Build the parts of a walker (an assembly), which both models share, from the dimensions that its type has.

It also finds the laws of ground and hinges that the config names, built-in ones and those of extensions.

The frame of a body has its origin at a hinge (the knee for a shank, otherwise the hip). The y axis points up the body.
"Ahead" is the walking direction while the leg is upright. Leg 1 swings first, leg 2 stands first. A positive angle puts
the foot forward, so in a flexed knee the angle of the shank is smaller than that of the thigh.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from walkerlab.config import walkers
from walkerlab.config.contact import Contact
from walkerlab.config.drives import push_offs
from walkerlab.config.reads import RigidConfig
from walkerlab.errors import ConfigError
from walkerlab.extensions import code_by_word, load
from walkerlab.physics.kernels import LawKind
from walkerlab.physics.mechanics.hinges import HINGE_LAWS
from walkerlab.physics.mechanics.parts import Assembly, BallFoot, Body, Coupling, Knee, Particle, Revolute

LEG_NAMES = ("leg 1", "leg 2")
THIGHS = ("thigh 1", "thigh 2")
SHANKS = ("shank 1", "shank 2")
TORSO = "torso"
UPPER_END = (0.0, 0.0)


@dataclass(frozen=True)
class Limb:
    """Rigid limb, with distances (m) from its upper end."""

    length_m: float
    mass_kg: float
    mass_below_m: float  # distance of the centre of mass below the upper end
    mass_ahead_m: float = 0.0
    inertia_kg_m2: float = 0.0  # about the centre of mass of the limb

    def body(self, name: str) -> Body:
        return Body(name, self.mass_kg, (self.mass_ahead_m, -self.mass_below_m), self.inertia_kg_m2)


@dataclass(frozen=True)
class Arc:
    """Circular sole, whose lowest point is level with the leg's lower end. If the radius is 0, the foot is a point."""

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
    # Hinges within one leg are knees. The hip joins bodies of both legs.
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


PARTS_DOCS = "docs/walkers.md shows a walker described by its parts."
AnyWalker = walkers.CompassWalker | walkers.StraightLegs | walkers.Kneed | walkers.AssembledWalker


def assembly_of(walker: AnyWalker, rigid: bool = False) -> Assembly:
    """Return the parts of a walker. In the rigid model a compass has point feet.

    Raises ConfigError for inconsistent parts.
    """
    parts = legs_of(walker, rigid)
    other = walker.second
    parts = parts if other is walker else replace_second_leg(parts, legs_of(other, rigid))
    torso = walker.torso
    return parts if torso is None else add_torso(parts, torso.mass_kg, torso.above_hip_m, torso.inertia_kg_m2)


def legs_of(walker: AnyWalker, rigid: bool) -> Assembly:
    """Return the parts of a walker, leaving out any torso and building both legs like leg 1."""
    if isinstance(walker, walkers.CompassWalker):
        leg = Limb(walker.leg_length_m, walker.leg_mass_kg, walker.mass_to_hip_m, 0.0, walker.leg_inertia_kg_m2)
        return straight_legs(leg, hip_mass(walker, rigid), Arc(0.0 if rigid else walker.foot_radius_m))
    if isinstance(walker, walkers.StraightLegs):
        centre = walker.leg_mass_below_hip_m, walker.leg_mass_ahead_m
        leg = Limb(walker.leg_length_m, walker.leg_mass_kg, *centre, walker.leg_inertia_kg_m2)
        return straight_legs(leg, hip_mass(walker, rigid), Arc(walker.foot_radius_m, walker.foot_centre_ahead_m))
    if isinstance(walker, walkers.Kneed):
        upper = walker.thigh
        lower = walker.shank
        thigh = Limb(upper.length_m, upper.mass_kg, upper.mass_below_hip_m, upper.mass_ahead_m, upper.inertia_kg_m2)
        shank = Limb(lower.length_m, lower.mass_kg, lower.mass_below_knee_m, lower.mass_ahead_m, lower.inertia_kg_m2)
        return kneed_legs(thigh, shank, walker.hip_mass_kg, Arc(walker.foot_radius_m, walker.foot_centre_ahead_m))
    return described_parts(walker)


def hip_mass(walker: walkers.CompassWalker | walkers.StraightLegs, rigid: bool) -> float:
    """Return the hip mass (kg) of a walker with straight legs, or a larger one if the contact model needs it."""
    # On compliant ground, legs that are point masses need a hip mass. Without one, two legs side by side could turn
    # about their masses and move the hip freely, so that no force would determine the acceleration of the hip.
    if rigid:
        return walker.hip_mass_kg
    present = walkers.torso_mass(walker.torso) + walker.leg_inertia_kg_m2 / walker.leg_length_m**2
    return max(walker.hip_mass_kg, walkers.LIGHTEST_CONTACT * walker.total_mass_kg - present)


def described_parts(walker: walkers.AssembledWalker) -> Assembly:
    try:
        return Assembly(
            bodies=tuple(Body(**dict(body)) for body in walker.bodies),
            joints=tuple(Revolute(**hinge.model_dump(exclude={"locks"})) for hinge in walker.hinges),
            particles=tuple(Particle(**dict(particle)) for particle in walker.particles),
            feet=tuple(BallFoot(f"foot of {foot.body}", **dict(foot)) for foot in walker.feet),
            knees=tuple(Knee(hinge.name, hinge.parent, hinge.child) for hinge in walker.hinges if hinge.locks),
            couplings=tuple(Coupling(**dict(coupling)) for coupling in walker.couplings),
            legs=walker.legs,
        )
    except (KeyError, ValueError) as error:
        raise ConfigError(f"walker: {error.args[0]}", PARTS_DOCS) from None


class Drives(NamedTuple):
    """Torques at hip and knees, and push-offs, as parameters of either model."""

    hip: tuple[float, ...]
    push_offs: tuple[float, float]  # N s, of each leg
    knees: tuple[tuple[float, float, float], ...]  # hinge parameters of each leg's knee; empty without dampers

    @property
    def shared(self) -> dict[str, Any]:
        """Parameters that the two legs have in common."""
        return {"hip": self.hip, "push_off": max(self.push_offs)}


def drive_parameters(config: RigidConfig) -> Drives:
    dampings = knee_dampings(config.walker)
    # Knees have no spring and no torque.
    knees = tuple((0.0, damping, 0.0) for damping in dampings) if any(dampings) else ()
    return Drives(config.walker.hip.parameters, push_offs(config.push_off), knees)


def knee_dampings(walker: AnyWalker) -> tuple[float, float]:
    """Return the damping (N m s/rad) of each leg's knee, or 0 for a leg without a knee."""
    knees = (getattr(each, "knee", None) for each in (walker, walker.second))
    first, second = (0.0 if knee is None else knee.damping_N_m_s_per_rad for knee in knees)
    return first, second


def knee_locked_at_strike(walker: AnyWalker) -> bool:
    """Whether the trailing knee is rigid during heel strike."""
    return not isinstance(walker, walkers.Kneed | walkers.AssembledWalker) or walker.knee.at_heel_strike == "locked"


def hinge_law_of(walker: AnyWalker) -> Any:
    return law_class(HINGE_LAWS, walker.hip.hinge_law)


def law_class(kind: LawKind, word: str) -> Any:
    """Return the class of the law that a config names.

    Raises ConfigError if a law that an extension added is incomplete.
    """
    try:
        law = kind.laws.get(word) or load(code_by_word(kind.key)[word])
    # `load` runs another package's code, which may raise anything.
    except Exception as error:
        raise ConfigError(
            f"{kind.key}: the code of '{word}' cannot be imported: {type(error).__name__}: {error}.",
            "`walkerlab extensions` shows which package adds it.",
        ) from error
    if missing := missing_members(law, kind):
        named = f"the {kind.key.removesuffix('_law').replace('_', '-')} law {law.__name__} ('{word}')"
        raise ConfigError(f"{named} is incomplete: it lacks {', '.join(missing)}.", where_to_look(kind))
    return law


def ground_law(kind: LawKind, contact: Contact) -> Any:
    """Create the law that a contact block in SI names. Raises ConfigError as `law_class` does."""
    law = law_class(kind, getattr(contact, kind.key))
    try:
        return law.from_contact(contact)
    except (TypeError, AttributeError) as error:
        raise ConfigError(f"{error}.", where_to_look(kind)) from error


def where_to_look(kind: LawKind) -> str:
    return f"{kind.protocol.__name__} in {kind.protocol.__module__} lists the members of a law."


def missing_members(law: type, kind: LawKind) -> list[str]:
    """List what the class of a law lacks: members of the protocol, and registered cases of functions."""
    members = [name for name in vars(kind.protocol) if not name.startswith("_")]
    missing = [name for name in members if not hasattr(law, name)]
    if kind.derived and not issubclass(law, kind.protocol):
        missing = [f"the base class {kind.protocol.__name__}"]
    # A law with one of these functions needs the others, too. For example, counted events must also be sampled.
    together = kind.together if any(law in function for function in kind.together) else ()
    cases = [function for function in (*kind.required, *together) if law not in function]
    return missing + [f"a case @{function.__name__}.case({law.__name__})" for function in cases]
