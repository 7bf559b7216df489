"""The kinds of walkers and their measures: keys of the block `walker`."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Final, Literal

from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from walkerlab.config.fields import Block, key
from walkerlab.config.numbers import same
from walkerlab.errors import ConfigError

WISSE: Final = "Wisse, Schwab, Int. J. Robotics Research 24 (2005): arc feet"
HSU_CHEN: Final = "Hsu Chen, Passive dynamic walking with knees, MIT (2007)"
LONGEST: Final = 1e3  # m
LEG_LENGTH_DIGITS: Final = 1e-6  # relative, to which a leg's length agrees with its parts
HEAVIEST: Final = 1e6  # kg
LIGHTEST_CONTACT: Final = 1e-9  # of the walker's mass: what a foot on compliant ground must carry along

Metres = Annotated[float, Field(ge=-LONGEST, le=LONGEST)]
Point = tuple[Metres, Metres]
LegBodies = Annotated[tuple[str, ...], Field(strict=False)]


def length(meaning: str, source: str = "this project") -> Any:
    """Metadata of a length."""
    return key("m", meaning, source, ge=1e-3, le=LONGEST)


def mass(meaning: str, source: str = "this project", least: float = 1e-12) -> Any:
    """Metadata of a mass."""
    return key("kg", meaning, source, ge=least, le=HEAVIEST)


def offset(meaning: str, source: str) -> Any:
    """Metadata of a place beside another one."""
    return key("m", meaning, source, ge=-LONGEST, le=LONGEST)


def inertia(of: str, source: str = "a point mass") -> Any:
    """Metadata of an inertia."""
    return key("kg m^2", f"inertia of {of} about its own centre of mass", source, ge=0.0, le=1e9)


def point(meaning: str) -> Any:
    """Metadata of a point in a body's frame."""
    return key("m", meaning, bounds="two numbers, ahead and up", sequence=True)


def refuse(kind: str, reason: str) -> PydanticCustomError:
    """What cannot be meant, with the reason."""
    return PydanticCustomError("walker", reason.replace("{", "(").replace("}", ")"), {"kind": kind})


class Torso(Block):
    """An upper body at the hip, kept on the bisector of the legs."""

    mass_kg: Annotated[float, mass("mass of the torso")]
    above_hip_m: Annotated[float, key("m", "its centre of mass above the hip", ge=0.0, le=LONGEST)]
    inertia_kg_m2: Annotated[float, inertia("the torso")] = 0.0
    held: Annotated[
        Literal["bisecting"], key("", "what holds it", "Wisse, Schwab, van der Helm, Robotica 22 (2004)")
    ] = "bisecting"


class CompassWalker(Block):
    """Two straight legs, each with a mass on it, and a mass at the hip."""

    type: Annotated[Literal["compass"], key("", "kind of walker", "Fig. 1")] = "compass"
    leg_length_m: Annotated[float, length("L, from foot to hip", "Table 1")] = 1.0
    foot_to_mass_m: Annotated[
        float,
        key(
            "m",
            "a, from foot to leg mass; b = L - a is the rest",
            "section 2: 'in the middle of the legs'",
            bounds="from 0 to below leg_length_m",
            default="leg_length_m / 2",
            ge=0.0,
        ),
    ] = Field(default_factory=lambda data: data.get("leg_length_m", 1.0) / 2)
    leg_mass_kg: Annotated[float, mass("m, mass of one leg", "Table 1")] = 5.0
    hip_mass_kg: Annotated[float, mass("M_H, mass at the hip", "Table 1", 0.0)] = 10.0
    leg_inertia_kg_m2: Annotated[float, inertia("one leg", "section 4: point masses")] = 0.0
    foot_radius_m: Annotated[
        float,
        key(
            "m",
            "radius of the ball foot of the contact model, 0 is a point; its centre is L - r from the hip",
            "section 4: 'beveled with a radius of 1 mm'",
            bounds="from 0 to below leg_length_m / 2",
            ge=0.0,
        ),
    ] = 0.001
    torso: Torso | None = None

    @field_validator("foot_to_mass_m")
    @classmethod
    def _mass_lies_on_the_leg(cls, value: float, info: ValidationInfo) -> float:
        length = info.data.get("leg_length_m")
        if length is None or value < length:
            return value
        massless = "equals leg_length_m, so b = 0: the leg's mass sits at the hip and the swing leg is massless; "
        reason = f"{massless if value == length else ''}must be below leg_length_m, {{length}}"
        raise PydanticCustomError("off-leg", reason, {"length": f"{length:g}"})

    @field_validator("foot_radius_m")
    @classmethod
    def _foot_is_smaller_than_half_a_leg(cls, value: float, info: ValidationInfo) -> float:
        length = info.data.get("leg_length_m")
        return arc_within(value, length and length / 2, "half of leg_length_m")

    @property
    def mass_to_hip_m(self) -> float:
        """b = L - a, m."""
        return self.leg_length_m - self.foot_to_mass_m

    @property
    def total_mass_kg(self) -> float:
        """Two legs, the hip and a torso, kg."""
        return 2 * self.leg_mass_kg + self.hip_mass_kg + torso_mass(self.torso)

    @property
    def lean_rad(self) -> float:
        """Angle of the line from hip to foot in an upright leg."""
        return 0.0


class StraightLegs(Block):
    """Two straight legs of any distribution of mass, whose feet are arcs that roll in both models."""

    type: Annotated[Literal["straight-legs"], key("", "kind of walker", WISSE)] = "straight-legs"
    leg_length_m: Annotated[float, length("hip to sole, foot included", WISSE)] = 0.4
    leg_mass_kg: Annotated[float, mass("mass of one leg", WISSE)] = 1.0
    leg_mass_below_hip_m: Annotated[float, offset("a leg's centre of mass below the hip", WISSE)] = 0.1
    leg_mass_ahead_m: Annotated[float, offset("a leg's centre of mass ahead of its line, leg upright", WISSE)] = 0.0
    leg_inertia_kg_m2: Annotated[float, inertia("one leg")] = 0.01
    hip_mass_kg: Annotated[float, mass("mass at the hip", WISSE, 0.0)] = 0.0
    foot_radius_m: Annotated[
        float, key("m", "radius of the sole's arc, 0 is a point", WISSE, bounds="from 0 to below leg_length_m", ge=0.0)
    ] = 0.1
    foot_centre_ahead_m: Annotated[float, offset("the arc's centre ahead of the leg's line", WISSE)] = 0.0
    torso: Torso | None = None

    @field_validator("leg_inertia_kg_m2")
    @classmethod
    def _turns(cls, value: float, info: ValidationInfo) -> float:
        if value == 0.0 and info.data.get("leg_mass_below_hip_m") == 0.0 and info.data.get("leg_mass_ahead_m") == 0.0:
            raise refuse("massless", "is 0 with the leg's mass at the hip: the swing leg would be massless")
        return value

    @field_validator("foot_radius_m")
    @classmethod
    def _arc_fits(cls, value: float, info: ValidationInfo) -> float:
        return arc_within(value, info.data.get("leg_length_m"), "leg_length_m")

    @property
    def total_mass_kg(self) -> float:
        """Two legs, the hip and a torso, kg."""
        return 2 * self.leg_mass_kg + self.hip_mass_kg + torso_mass(self.torso)

    @property
    def lean_rad(self) -> float:
        """Angle of the line from hip to foot centre in an upright leg."""
        return math.atan2(self.foot_centre_ahead_m, self.leg_length_m - self.foot_radius_m)


class Thigh(Block):
    """The upper half of a leg with a knee."""

    length_m: Annotated[float, length("hip to knee", HSU_CHEN)] = 0.5
    mass_kg: Annotated[float, mass("mass of one thigh", HSU_CHEN)] = 0.5
    mass_below_hip_m: Annotated[float, offset("its centre of mass below the hip", HSU_CHEN)] = 0.325
    mass_ahead_m: Annotated[float, offset("its centre of mass ahead", HSU_CHEN)] = 0.0
    inertia_kg_m2: Annotated[float, inertia("one thigh")] = 0.0


class Shank(Block):
    """The lower half of a leg with a knee, foot included."""

    length_m: Annotated[float, length("knee to sole", HSU_CHEN)] = 0.5
    mass_kg: Annotated[float, mass("mass of one shank", HSU_CHEN)] = 0.05
    mass_below_knee_m: Annotated[float, offset("its centre of mass below the knee", HSU_CHEN)] = 0.125
    mass_ahead_m: Annotated[float, offset("its centre of mass ahead", HSU_CHEN)] = 0.0
    inertia_kg_m2: Annotated[float, inertia("one shank")] = 0.0

    @field_validator("inertia_kg_m2")
    @classmethod
    def _turns(cls, value: float, info: ValidationInfo) -> float:
        if value == 0.0 and info.data.get("mass_below_knee_m") == 0.0 and info.data.get("mass_ahead_m") == 0.0:
            raise refuse("massless", "is 0 with the shank's mass at the knee: the shank would be massless")
        return value


class KneeJoint(Block):
    """How knees lock and are released."""

    lock: Annotated[
        Literal["ideal", "compliant"],
        key("", "ideal: a plastic impact, then one body; compliant: a one-sided stop, then latched", HSU_CHEN),
    ] = "ideal"
    at_heel_strike: Annotated[
        Literal["locked", "free"],
        key("", "the trailing knee during the heel strike: locked and released just after it, or free", HSU_CHEN),
    ] = "locked"
    release: Annotated[
        Literal["compression", "touch"],
        key("", "contact model: released when the leading foot stops sinking in, or at its first touch"),
    ] = "compression"
    stop_stiffness: Annotated[float, key("N m/rad", "stiffness of a compliant stop", ge=1.0, le=1e12)] = 1.0e5
    stop_damping: Annotated[float, key("N m s/rad", "damping of a compliant stop", ge=0.0, le=1e9)] = 90.0


class Kneed(Block):
    """Two legs with knees that lock straight before the foot comes down."""

    type: Annotated[Literal["kneed"], key("", "kind of walker", HSU_CHEN)] = "kneed"
    thigh: Thigh = Thigh()
    shank: Shank = Shank()
    hip_mass_kg: Annotated[float, mass("mass at the hip", HSU_CHEN, 0.0)] = 0.5
    foot_radius_m: Annotated[
        float,
        key("m", "radius of the sole's arc, 0 is a point", HSU_CHEN, bounds="from 0 to below shank.length_m", ge=0.0),
    ] = 0.0
    knee: KneeJoint = KneeJoint()
    torso: Torso | None = None

    @field_validator("foot_radius_m")
    @classmethod
    def _arc_fits(cls, value: float, info: ValidationInfo) -> float:
        shank = info.data.get("shank")
        return arc_within(value, None if shank is None else shank.length_m, "shank.length_m")

    @property
    def leg_length_m(self) -> float:
        """Hip to sole, m."""
        return self.thigh.length_m + self.shank.length_m

    @property
    def total_mass_kg(self) -> float:
        """Two legs, the hip and a torso, kg."""
        return 2 * (self.thigh.mass_kg + self.shank.mass_kg) + self.hip_mass_kg + torso_mass(self.torso)

    @property
    def lean_rad(self) -> float:
        """Angle of the line from hip to foot in an upright leg."""
        return 0.0


class PartBody(Block):
    """A rigid body with a frame of its own, upright as the walker stands."""

    name: Annotated[str, key("", "name of the body", bounds="any text")]
    mass_kg: Annotated[float, mass("its mass", least=0.0)]
    centre_m: Annotated[Point, point("its centre of mass")]
    inertia_kg_m2: Annotated[float, inertia("the body")] = 0.0


class PartHinge(Block):
    """A frictionless hinge between points of two bodies."""

    name: Annotated[str, key("", "name of the hinge", bounds="any text")]
    parent: Annotated[str, key("", "one body", bounds="any text")]
    parent_point_m: Annotated[Point, point("the hinge in its frame")]
    child: Annotated[str, key("", "the other body", bounds="any text")]
    child_point_m: Annotated[Point, point("the hinge in its frame")]
    locks: Annotated[
        bool, key("", "whether it is a knee, parent the thigh and child the shank", bounds="true or false")
    ] = False


class PartParticle(Block):
    """A point mass fixed to a body."""

    name: Annotated[str, key("", "name of the particle", bounds="any text")]
    mass_kg: Annotated[float, mass("its mass", least=0.0)]
    body: Annotated[str, key("", "the body it is fixed to", bounds="any text")]
    at_m: Annotated[Point, point("where, in its frame")]


class PartFoot(Block):
    """A foot: an arc about a point of a body."""

    body: Annotated[str, key("", "the body it belongs to", bounds="any text")]
    centre_m: Annotated[Point, point("the arc's centre in its frame")]
    radius_m: Annotated[float, key("m", "radius of the arc, 0 is a point", ge=0.0, le=LONGEST)] = 0.0


class PartCoupling(Block):
    """A body whose angle is a weighted sum of others' angles."""

    body: Annotated[str, key("", "the body that follows", bounds="any text")]
    of: Annotated[tuple[str, ...], key("", "the bodies that it follows", bounds="a list of names", sequence=True)]
    weights: Annotated[tuple[float, ...], key("1", "their weights", bounds="a list of numbers", sequence=True)]


class PartsWalker(Block):
    """A walker described by its bodies, hinges, particles, feet and couplings."""

    type: Annotated[Literal["parts"], key("", "kind of walker")]
    bodies: Annotated[
        tuple[PartBody, ...],
        key("", "the bodies", bounds="blocks of name, mass_kg, centre_m, inertia_kg_m2", sequence=True),
    ]
    hinges: Annotated[
        tuple[PartHinge, ...],
        key(
            "",
            "the hinges, without closed loops",
            bounds="blocks of name, parent, parent_point_m, child, child_point_m, locks",
            sequence=True,
        ),
    ]
    particles: Annotated[
        tuple[PartParticle, ...], key("", "point masses", bounds="blocks of name, mass_kg, body, at_m", sequence=True)
    ] = ()
    feet: Annotated[
        tuple[PartFoot, PartFoot],
        key("", "a foot for either leg", bounds="blocks of two of body, centre_m, radius_m", sequence=True),
    ]
    couplings: Annotated[
        tuple[PartCoupling, ...],
        key("", "bodies that follow others", bounds="blocks of body, of, weights", sequence=True),
    ] = ()
    legs: Annotated[
        tuple[LegBodies, LegBodies],
        key("", "bodies of either leg, hip down", bounds="two lists of names", sequence=True),
    ]
    leg_length_m: Annotated[float, length("hip to sole as the parts have it: what lengths and falls are measured by")]
    knee: KneeJoint = KneeJoint()
    torso: Torso | None = None

    @field_validator("leg_length_m")
    @classmethod
    def _agrees_with_the_soles(cls, value: float, info: ValidationInfo) -> float:
        if {"hinges", "feet", "legs"} - info.data.keys():
            return value  # what is wrong with those is told
        found = hip_to_sole(info.data["hinges"], info.data["feet"], info.data["legs"])
        if found is None or math.isclose(value, found, rel_tol=LEG_LENGTH_DIGITS):
            return value
        reason = "is not what the parts have: upright, from the hip's hinge to the first leg's sole, it is {found} m"
        raise PydanticCustomError("soles", reason, {"found": f"{found:.9g}"})

    @property
    def foot_radius_m(self) -> float:
        """Radius of the feet, m."""
        return self.feet[0].radius_m

    @property
    def total_mass_kg(self) -> float:
        """Everything, kg."""
        parts = [body.mass_kg for body in self.bodies] + [particle.mass_kg for particle in self.particles]
        return sum(parts) + torso_mass(self.torso)

    @property
    def lean_rad(self) -> float:
        """Not told by single keys; a start is taken as given."""
        return 0.0


def hip_to_sole(
    hinges: tuple[PartHinge, ...], feet: tuple[PartFoot, PartFoot], legs: tuple[LegBodies, LegBodies]
) -> float | None:
    """How far the first leg's sole lies below the hip while all bodies are upright, m.

    None where no hinges lead from the other leg to the foot's body: parts that make no walker.
    """
    places = {(hinge.parent, hinge.child): (hinge.parent_point_m, hinge.child_point_m) for hinge in hinges}
    places |= {(hinge.child, hinge.parent): (hinge.child_point_m, hinge.parent_point_m) for hinge in hinges}
    chain = [legs[1][0], *legs[0]] if legs[0] and legs[1] else []
    below, upper = 0.0, 0.0  # m, of the present body's upper hinge: below the hip, over its own origin
    for body, lower in pairwise(chain):
        if (body, lower) not in places:
            return None
        leaving, entering = places[body, lower]
        below += upper - leaving[1] if body in legs[0] else 0.0
        upper = entering[1]
        if lower == feet[0].body:
            return below + upper - feet[0].centre_m[1] + feet[0].radius_m
    return None


def torso_mass(torso: Torso | None) -> float:
    """Mass of a torso, if there is one (kg)."""
    return 0.0 if torso is None else torso.mass_kg


def rigid_bodies(walker: Any) -> int:
    """How many angles the rigid model's state has: swing leg, stance leg, what else swings, a torso."""
    bodies = len(walker.bodies) - len(walker.legs[1]) + 1 if isinstance(walker, PartsWalker) else 2
    return bodies + int(isinstance(walker, Kneed)) + int(walker.torso is not None)


def is_plain_compass(walker: Any) -> bool:
    """Whether this is the walker of Appendix A."""
    return bool(walker.type == "compass" and walker.torso is None)


def is_the_papers(walker: Any) -> bool:
    """Whether this is the paper's own walker, up to rounding of its numbers."""
    paper = CompassWalker()
    return isinstance(walker, CompassWalker) and all(
        same(getattr(walker, name), getattr(paper, name)) for name in CompassWalker.model_fields
    )


def too_light_for_contact(walker: Any) -> str:
    """Why a walker cannot stand on compliant ground; empty if it can."""
    share = walker.leg_mass_kg / walker.total_mass_kg if isinstance(walker, CompassWalker) else 1.0
    if share >= LIGHTEST_CONTACT:
        return ""
    return (
        f"the walker's feet have next to no mass ({share:.1g} of the whole): on compliant ground they would have to be "
        "infinitely fast"
    )


def without_contact(asked: str, walker: Any, instead: str) -> ConfigError:
    """What to say where what is asked for needs contact, and the config has none.

    instead  what to do about a block that is missing
    """
    why = too_light_for_contact(walker)
    if why:
        return ConfigError(f"{asked} needs contact, but {why}.", "Stay with the rigid model, or give the legs mass.")
    return ConfigError(f"{asked} needs a contact block, and the config has none.", instead)


def arc_within(radius: float, longest: float | None, name: str) -> float:
    """The radius; refused if the arc is larger than what it belongs to."""
    if longest is not None and radius >= longest:
        raise PydanticCustomError("foot", "must be below {name}, {longest}", {"name": name, "longest": f"{longest:g}"})
    return radius


Walker = Annotated[
    Annotated[CompassWalker, Tag("compass")]
    | Annotated[StraightLegs, Tag("straight-legs")]
    | Annotated[Kneed, Tag("kneed")]
    | Annotated[PartsWalker, Tag("parts")],
    Discriminator(
        lambda data: data.get("type", "compass") if isinstance(data, dict) else getattr(data, "type", "compass")
    ),
]
WALKERS: Final[dict[str, type[Block]]] = {
    "compass": CompassWalker,
    "straight-legs": StraightLegs,
    "kneed": Kneed,
    "parts": PartsWalker,
}
