"""Types of walkers and their dimensions: keys of the block `walker`."""

import math
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import lru_cache, reduce
from itertools import pairwise
from operator import or_
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeGuard

from pydantic import Discriminator, Field, Tag, ValidationError, ValidationInfo, field_validator

from walkerlab.config.contact import Contact
from walkerlab.config.drives import MAX_LEG_SPEED, Hip, drives_and_springs_of
from walkerlab.config.fields import Block, check_against, key, meaning_error, short_number
from walkerlab.config.second_leg import KneelessLeg, SecondCompassLeg, SecondKneedLeg, SecondStraightLeg, lock_knee
from walkerlab.errors import ConfigError
from walkerlab.extensions import code_by_word, load

WISSE: Final = "Wisse, Walking Simulation Example, MATLAB files, Delft University of Technology (2003): arc feet"
MCGEER: Final = "McGeer, Passive walking with knees, IEEE Int. Conf. Robotics and Automation (1990)"
HSU_CHEN: Final = "Hsu Chen, Passive dynamic walking with knees, MIT (2007)"
MAX_LENGTH_M: Final = 1e3
LEG_LENGTH_DIGITS: Final = 1e-6  # maximum relative difference between leg_length_m and the length of the parts
MAX_MASS_KG: Final = 1e6
LIGHTEST_CONTACT: Final = 1e-9  # minimum fraction of the walker's mass that moves with a foot on compliant ground

Metres = Annotated[float, Field(ge=-MAX_LENGTH_M, le=MAX_LENGTH_M)]
Point = tuple[Metres, Metres]
LegBodies = Annotated[tuple[str, ...], Field(strict=False)]


def length(default: Any, meaning: str, source: str = "this project") -> Any:
    return key(default, "m", meaning, source, ge=1e-3, le=MAX_LENGTH_M)


def mass(default: Any, meaning: str, source: str = "this project", least: float = 1e-12) -> Any:
    return key(default, "kg", meaning, source, ge=least, le=MAX_MASS_KG)


def offset(default: Any, meaning: str, source: str) -> Any:
    return key(default, "m", meaning, source, ge=-MAX_LENGTH_M, le=MAX_LENGTH_M)


def inertia(default: Any, of: str, source: str = "a point mass") -> Any:
    return key(default, "kg m^2", f"inertia of {of} about its own centre of mass", source, ge=0.0, le=1e9)


def point(meaning: str) -> Any:
    return key(..., "m", meaning, bounds="two numbers, ahead and up", sequence=True)


def name_key(meaning: str) -> Any:
    return key(..., "", meaning, bounds="any text")


def parts(of: type[Block], meaning: str, default: Any = ..., number: str = "") -> Any:
    return key(default, "", meaning, bounds=f"blocks of {number}{', '.join(of.model_fields)}", sequence=True)


def check_arc(name: str, of: str, limit: Callable[[Any], float] = float) -> Any:
    """Validate that the foot radius is below `limit`, a function of the value of key `of`. Messages call the limit
    `name`."""
    return check_against(
        "foot_radius_m", of, lambda arc, owner: "" if arc < limit(owner) else f"must be below {name}, {limit(owner):g}"
    )


def check_inertia(inertia: str, why: str, *places: str) -> Any:
    """Validate that the key `inertia` is not 0 if the mass of the part is at its upper hinge (all keys `places` are 0).

    why  the part that would be massless, for the error message
    """

    def has_inertia(value: float, info: ValidationInfo) -> float:
        if value == 0.0 and all(info.data.get(place) == 0.0 for place in places):
            raise meaning_error(f"is 0 while {why} would be massless")
        return value

    return field_validator(inertia)(has_inertia)


class Torso(Block):
    """An upper body that is hinged at the hip and kept on the bisector of the legs."""

    mass_kg: float = mass(..., "mass of the torso")
    above_hip_m: float = key(..., "m", "height of its centre of mass above the hip", ge=0.0, le=MAX_LENGTH_M)
    inertia_kg_m2: float = inertia(0.0, "the torso")
    held: Literal["bisecting"] = key(
        "bisecting", "", "what holds the torso", "Wisse, Schwab, van der Helm, Robotica 22 (2004)"
    )


class _Legged(Block):
    """Base class of all walkers: shared properties and checks."""

    @property
    def second(self) -> Any:
        """The walker whose legs are both like leg 2, or this walker itself if it has no `leg_2`."""
        return self if getattr(self, "leg_2", None) is None else built_second(self)

    @property
    def lean_rad(self: Any) -> float:
        """Angle (rad) from the line of a leg to the line from hip to foot centre, or 0 for walkers assembled from
        parts."""
        return math.atan2(getattr(self, "foot_centre_ahead_m", 0.0), self.leg_length_m - self.foot_radius_m)

    def swing_angle(self: Any, stance_rad: float) -> float | None:
        """Return the angle (rad) at which leg 1 touches the ground behind leg 2, which stands at `stance_rad`.

        Angles are from the ground's normal. Returns None if leg 1 cannot reach the ground.
        """
        second = self.second
        if second is self:
            return float(-2 * self.lean_rad - stance_rad)
        (own, own_radius), (other, radius) = (
            (math.hypot(leg.leg_length_m - sole, getattr(leg, "foot_centre_ahead_m", 0.0)), sole)
            for leg, sole in ((each, 0.0 if each.type == "compass" else each.foot_radius_m) for each in (self, second))
        )
        height = radius + other * math.cos(stance_rad + rigid_lean(second)) - own_radius
        return None if abs(height) > own else -math.acos(height / own) - rigid_lean(self)

    @property
    def foot_radii_m(self: Any) -> tuple[float, float]:
        """Radius (m) of each leg's foot."""
        return self.foot_radius_m, self.second.foot_radius_m

    @property
    def total_mass_kg(self: Any) -> float:
        """Mass of the whole walker, kg."""
        legs = self.leg_mass_kg + self.second.leg_mass_kg
        return float(legs + self.hip_mass_kg + torso_mass(self.torso))

    @field_validator("hip", check_fields=False)
    @classmethod
    def _one_kind_of_damper(cls, value: Hip, info: ValidationInfo) -> Hip:
        knee = info.data.get("knee")
        if value.damping_N_m_s_per_rad and knee is not None and knee.damping_N_m_s_per_rad:
            raise meaning_error("has a damper, and so have the knees: their work could not be told apart")
        return value

    @field_validator("hip", check_fields=False)
    @classmethod
    def _legs_can_follow(cls, value: Hip, info: ValidationInfo) -> Hip:
        with suppress(AttributeError):  # errors of the keys above are reported already
            inertia = leg_inertia(SimpleNamespace(**info.data))
            if value.too_quick_for(inertia):
                most = f"{MAX_LEG_SPEED**2 * inertia:.3g} (torque, spring) and {MAX_LEG_SPEED * inertia:.3g} (damper)"
                raise meaning_error(
                    f"whose torques would swing the legs faster than {MAX_LEG_SPEED:g} rad/s: with their inertia about "
                    f"the hip, {inertia:.3g} kg m^2, the limits are {most}"
                )
        return value


def check_second_leg() -> Any:
    """Validate the keys of `leg_2`: a walker whose legs are both like it must be valid."""

    def makes_a_leg(cls: Any, value: Any, info: ValidationInfo) -> Any:
        # Invalid keys are missing here and are reported by their own checks. Without them, no walker can be built.
        if value is not None and info.data.keys() >= cls.model_fields.keys() - {"leg_2"}:
            try:
                double_second_leg(cls, info.data, value)
            except ValidationError as error:
                first = error.errors()[0]
                raise meaning_error(f"makes no leg: {'.'.join(map(str, first['loc']))} {first['msg']}") from None
        return value

    return field_validator("leg_2")(classmethod(makes_a_leg))


def double_second_leg(kind: type[Block], values: Mapping[str, Any], leg: Block) -> Any:
    """Build the walker whose legs are both like `leg`. `values` maps the walker's keys to their values."""
    second = {name: value for name, value in values.items() if name != "leg_2"}
    if getattr(leg, "type", None) is not None:
        shared = {
            name: second[name] for name in ("hip_mass_kg", "foot_radius_m", "foot_centre_ahead_m", "torso", "hip")
        }
        locked = lock_knee(second["thigh"], second["shank"])
        return StraightLegs.model_validate({**shared, **locked, **leg.model_dump(exclude_none=True)})
    for name, value in leg.model_dump(exclude_none=True).items():
        second[name] = {**dict(second[name]), **value} if isinstance(value, dict) else value
    return kind.model_validate(second)


@lru_cache
def built_second(walker: Any) -> Any:
    return double_second_leg(type(walker), dict(walker), walker.leg_2)


class CompassWalker(_Legged):
    """Two straight legs, each with a mass on it, and a mass at the hip."""

    type: Literal["compass"] = key("compass", "", "kind of walker", "Fig. 1")
    leg_length_m: float = length(1.0, "leg length L, from foot to hip", "Table 1")
    foot_to_mass_m: float = key(
        lambda data: data.get("leg_length_m", 1.0) / 2,
        "m",
        "distance a from foot to leg mass; from there to the hip it is b = L - a",
        "section 2: 'in the middle of the legs'",
        bounds="at least 0, less than leg_length_m",
        default_in_words="leg_length_m / 2",
        ge=0.0,
    )
    leg_mass_kg: float = mass(5.0, "m, mass of one leg", "Table 1")
    hip_mass_kg: float = mass(10.0, "M_H, mass at the hip", "Table 1", 0.0)
    leg_inertia_kg_m2: float = inertia(0.0, "one leg", "section 4: point masses")
    foot_radius_m: float = key(
        lambda data: min(0.001, data.get("leg_length_m", 1.0) / 10),
        "m",
        "radius of the ball feet of the contact model, 0 for points; their centres are L - r from the hip",
        "section 4: 'beveled with a radius of 1 mm'",
        bounds="at least 0, less than leg_length_m / 2",
        default_in_words="0.001, at most leg_length_m / 10",
        ge=0.0,
    )
    torso: Torso | None = None
    hip: Hip = Hip()
    leg_2: SecondCompassLeg | None = None

    _second = check_second_leg()
    _arc = check_arc("half of leg_length_m", "leg_length_m", lambda length: length / 2)

    _mass = check_against("foot_to_mass_m", "leg_length_m", lambda mass, length: why_off_the_leg(mass, length))

    @property
    def mass_to_hip_m(self) -> float:
        """Distance from the leg's mass to the hip, b = L - a, m."""
        return self.leg_length_m - self.foot_to_mass_m


class StraightLegs(_Legged):
    """Two straight legs of any mass distribution, whose arc feet roll in both models."""

    type: Literal["straight-legs"] = key("straight-legs", "", "kind of walker", WISSE)
    leg_length_m: float = length(0.4, "length from hip to sole, foot included", WISSE)
    leg_mass_kg: float = mass(1.0, "mass of one leg", WISSE)
    leg_mass_below_hip_m: float = offset(0.1, "distance of a leg's centre of mass below the hip", WISSE)
    leg_mass_ahead_m: float = offset(
        0.0, "distance of a leg's centre of mass ahead of the leg's line, for an upright leg", WISSE
    )
    leg_inertia_kg_m2: float = inertia(0.01, "one leg")
    hip_mass_kg: float = mass(0.0, "mass at the hip", WISSE, 0.0)
    foot_radius_m: float = key(
        0.1, "m", "radius of the sole's arc, 0 for a point", WISSE, bounds="at least 0, less than leg_length_m", ge=0.0
    )
    foot_centre_ahead_m: float = offset(0.0, "distance of the arc's centre ahead of the leg's line", WISSE)
    torso: Torso | None = None
    hip: Hip = Hip()
    leg_2: SecondStraightLeg | None = None

    _second = check_second_leg()
    _arc = check_arc("leg_length_m", "leg_length_m")
    _inertia = check_inertia(
        "leg_inertia_kg_m2", "the leg's mass is at the hip, so a swing leg", "leg_mass_below_hip_m", "leg_mass_ahead_m"
    )


class Thigh(Block):
    """The upper half of a leg with a knee."""

    length_m: float = length(0.5, "length from hip to knee", HSU_CHEN)
    mass_kg: float = mass(0.5, "mass of one thigh", HSU_CHEN)
    mass_below_hip_m: float = offset(0.325, "distance of its centre of mass below the hip", HSU_CHEN)
    mass_ahead_m: float = offset(0.0, "distance of its centre of mass ahead of the line from hip to knee", HSU_CHEN)
    inertia_kg_m2: float = inertia(0.0, "one thigh")


class Shank(Block):
    """The lower half of a leg with a knee, foot included."""

    length_m: float = length(0.5, "length from knee to sole", HSU_CHEN)
    mass_kg: float = mass(0.05, "mass of one shank", HSU_CHEN)
    mass_below_knee_m: float = offset(0.125, "distance of its centre of mass below the knee", HSU_CHEN)
    mass_ahead_m: float = offset(0.0, "distance of its centre of mass ahead of the line from knee to foot", HSU_CHEN)
    inertia_kg_m2: float = inertia(0.0, "one shank")

    _inertia = check_inertia(
        "inertia_kg_m2", "the shank's mass is at the knee, so the shank", "mass_below_knee_m", "mass_ahead_m"
    )


class KneeJoint(Block):
    """How knees lock and are released."""

    lock: Literal["ideal", "compliant"] = key(
        "ideal", "", "ideal: a plastic impact joins thigh and shank; compliant: a one-sided stop that latches", HSU_CHEN
    )
    at_heel_strike: Literal["locked", "free"] = key(
        "locked", "", "the trailing knee during the heel strike: locked and released just after it, or free", HSU_CHEN
    )
    release: Literal["compression", "touch"] = key(
        "compression",
        "",
        "instant at which the contact model releases the trailing knee: when the leading foot stops sinking in "
        "(compression), or at its first touch",
    )
    damping_N_m_s_per_rad: float = key(
        0.0, "N m s/rad", "damping of an unlocked knee; cannot be combined with a damper at the hip", ge=0.0, le=1e9
    )
    stop_stiffness: float = key(1.0e5, "N m/rad", "stiffness of a compliant stop", ge=1.0, le=1e12)
    stop_damping: float = key(90.0, "N m s/rad", "damping of a compliant stop", ge=0.0, le=1e9)


class Kneed(_Legged):
    """Two legs with knees that lock straight before the foot comes down."""

    type: Literal["kneed"] = key("kneed", "", "kind of walker", HSU_CHEN)
    thigh: Thigh = Thigh()
    shank: Shank = Shank()
    hip_mass_kg: float = mass(0.5, "mass at the hip", HSU_CHEN, 0.0)
    foot_radius_m: float = key(
        0.0,
        "m",
        "radius of the sole's arc, 0 for a point",
        HSU_CHEN,
        bounds="from 0 to less than the length from hip to sole",
        ge=0.0,
    )
    foot_centre_ahead_m: float = offset(
        0.0, "distance of the arc's centre (of the point, if the radius is 0) ahead of the shank's line", MCGEER
    )
    knee: KneeJoint = KneeJoint()
    torso: Torso | None = None
    hip: Hip = Hip()
    leg_2: SecondKneedLeg | KneelessLeg | None = None

    _second = check_second_leg()

    @field_validator("foot_radius_m")
    @classmethod
    def _arc_below_the_hip(cls, value: float, info: ValidationInfo) -> float:
        if {"thigh", "shank"} <= info.data.keys():
            leg = info.data["thigh"].length_m + info.data["shank"].length_m
            if value >= leg:
                raise meaning_error(f"must be below thigh.length_m + shank.length_m, {leg:g}")
        return value

    @property
    def leg_length_m(self) -> float:
        """Length from hip to sole, m."""
        return self.thigh.length_m + self.shank.length_m

    @property
    def leg_mass_kg(self) -> float:
        return self.thigh.mass_kg + self.shank.mass_kg


class PartBody(Block):
    """A rigid body. Its frame is upright when the walker stands upright."""

    name: str = name_key("name of the body")
    mass_kg: float = mass(..., "its mass", least=0.0)
    centre_m: Point = point("its centre of mass")
    inertia_kg_m2: float = inertia(0.0, "the body")


class PartHinge(Block):
    """A frictionless hinge between points of two bodies."""

    name: str = name_key("name of the hinge")
    parent: str = name_key("one body")
    parent_point_m: Point = point("hinge position in the parent's frame")
    child: str = name_key("the other body")
    child_point_m: Point = point("hinge position in the child's frame")
    locks: bool = key(False, "", "whether the hinge is a knee, whose parent is the thigh and whose child is the shank")


class PartParticle(Block):
    """A point mass fixed to a body."""

    name: str = name_key("name of the particle")
    mass_kg: float = mass(..., "its mass", least=0.0)
    body: str = name_key("the body it is fixed to")
    at_m: Point = point("position in the body's frame")


class PartFoot(Block):
    """A foot: a circular arc whose centre is a point of a body."""

    body: str = name_key("the body it belongs to")
    centre_m: Point = point("the arc's centre in the body's frame")
    radius_m: float = key(0.0, "m", "radius of the arc, 0 for a point", ge=0.0, le=MAX_LENGTH_M)


class PartCoupling(Block):
    """A body whose angle is a weighted sum of the angles of other bodies."""

    body: str = name_key("the body that follows")
    of: tuple[str, ...] = key(..., "", "the bodies that it follows", bounds="a list of names", sequence=True)
    weights: tuple[float, ...] = key(..., "1", "their weights", bounds="a list of numbers", sequence=True)


class AssembledWalker(_Legged):
    """A walker made of parts.

    An extension derives a type of walker from this class. The derived class adds its own keys and the
    properties that make the parts from them. It also needs the keys `leg_length_m`, `knee`, `torso` and `hip`, as in
    `PartsWalker`.
    """

    if TYPE_CHECKING:
        type: str
        bodies: tuple[PartBody, ...]
        hinges: tuple[PartHinge, ...]
        particles: tuple[PartParticle, ...]
        feet: tuple[PartFoot, PartFoot]
        couplings: tuple[PartCoupling, ...]
        legs: tuple[LegBodies, LegBodies]
        leg_length_m: float
        knee: KneeJoint
        torso: Torso | None
        hip: Hip

    @property
    def foot_radius_m(self) -> float:
        return self.feet[0].radius_m

    @property
    def foot_radii_m(self) -> tuple[float, float]:
        """Radius (m) of each leg's foot."""
        first, second = self.feet
        return first.radius_m, second.radius_m

    @property
    def total_mass_kg(self) -> float:
        masses = [body.mass_kg for body in self.bodies] + [particle.mass_kg for particle in self.particles]
        return sum(masses) + torso_mass(self.torso)


class PartsWalker(AssembledWalker):
    """A walker described by its bodies, hinges, particles, feet and couplings."""

    type: Literal["parts"] = key(..., "", "kind of walker")
    bodies: tuple[PartBody, ...] = parts(PartBody, "the bodies")
    hinges: tuple[PartHinge, ...] = parts(PartHinge, "the hinges, without closed loops")
    particles: tuple[PartParticle, ...] = parts(PartParticle, "point masses", ())
    feet: tuple[PartFoot, PartFoot] = parts(PartFoot, "a foot for each leg", number="two of ")
    couplings: tuple[PartCoupling, ...] = parts(PartCoupling, "bodies that follow others", ())
    legs: tuple[LegBodies, LegBodies] = key(
        ..., "", "bodies of each leg, from the hip down", bounds="two lists of names", sequence=True
    )
    leg_length_m: float = length(
        ..., "length from hip to sole, which must agree with the parts; scale for lengths and falls"
    )
    knee: KneeJoint = KneeJoint()
    torso: Torso | None = None
    hip: Hip = Hip()

    @field_validator("leg_length_m")
    @classmethod
    def _agrees_with_the_soles(cls, value: float, info: ValidationInfo) -> float:
        if {"hinges", "feet", "legs"} - info.data.keys():
            return value  # those keys are invalid, which has already been reported
        length = hip_to_sole(info.data["hinges"], info.data["feet"], info.data["legs"])
        if length is None or math.isclose(value, length, rel_tol=LEG_LENGTH_DIGITS):
            return value
        upright = f"standing upright, it is {length:.9g} m from the hip's hinge to the first leg's sole"
        raise meaning_error(f"disagrees with the parts: {upright}")


def hip_to_sole(
    hinges: tuple[PartHinge, ...], feet: tuple[PartFoot, PartFoot], legs: tuple[LegBodies, LegBodies]
) -> float | None:
    """Return how far (m) the sole of leg 1 is below the hip if the leg is upright, or None if no hinges connect the
    two."""
    places = {(hinge.parent, hinge.child): (hinge.parent_point_m, hinge.child_point_m) for hinge in hinges}
    places |= {(hinge.child, hinge.parent): (hinge.child_point_m, hinge.parent_point_m) for hinge in hinges}
    chain = [legs[1][0], *legs[0]] if legs[0] and legs[1] else []
    below, upper = 0.0, 0.0  # m, depth of the body's upper hinge below the hip, and its height above the body's origin
    for body, lower in pairwise(chain):
        if (body, lower) not in places:
            return None
        leaving, entering = places[body, lower]
        below += upper - leaving[1] if body in legs[0] else 0.0
        upper = entering[1]
        if lower == feet[0].body:
            return below + upper - feet[0].centre_m[1] + feet[0].radius_m
    return None


def why_off_the_leg(mass_m: float, length_m: float) -> str:
    """Explain why a mass at `mass_m` from the foot is not on the leg, or return '' if it is on the leg."""
    if mass_m < length_m:
        return ""
    massless = "equals leg_length_m, so b = 0: the leg's mass sits at the hip and the swing leg is massless; "
    return f"{massless if mass_m == length_m else ''}must be below leg_length_m, {length_m:g}"


def rigid_lean(walker: Any) -> float:
    """Return the `lean_rad` of the rigid model, which is 0 for a compass because its feet are points."""
    return 0.0 if walker.type == "compass" else float(walker.lean_rad)


def torso_mass(torso: Torso | None) -> float:
    return 0.0 if torso is None else torso.mass_kg


def rigid_bodies(walker: Any) -> int:
    """Return the number of angles in the rigid model's state: swing leg, stance leg, other swinging bodies, torso."""
    bodies = len(walker.bodies) - len(walker.legs[1]) + 1 if isinstance(walker, AssembledWalker) else 2
    return bodies + int(isinstance(walker, Kneed)) + int(walker.torso is not None)


def followers(walker: Any) -> dict[int, tuple[str, dict[int, float]]]:
    """Map each coupled angle of the rigid state, by index, to the name of its body and the weights of the angles it
    follows."""
    coupled = {}
    if isinstance(walker, AssembledWalker):
        swinging, stance = walker.legs
        shared = [body.name for body in walker.bodies if body.name not in (*swinging, *stance)]
        place = {name: k for k, name in enumerate((swinging[0], stance[0], *swinging[1:], *shared))}
        # The parts of the stance leg are locked to each other, so all of them have the angle of the leg.
        place |= dict.fromkeys(stance, 1)
        for coupling in walker.couplings:
            weights = {place[of]: weight for of, weight in zip(coupling.of, coupling.weights, strict=True)}
            coupled[place[coupling.body]] = coupling.body, weights
    if walker.torso is not None:
        coupled[rigid_bodies(walker) - 1] = "torso", {0: 0.5, 1: 0.5}
    return coupled


def is_passive_compass(config: Any) -> bool:
    """Whether the config's walker is a passive compass with equal legs and no torso, as in Appendix A."""
    compass = config.walker.type == "compass" and config.walker.torso is None and config.walker.leg_2 is None
    return bool(compass and not drives_and_springs_of(config))


def leg_inertia(walker: Any) -> float:
    """Return the inertia of one leg about the hip (kg m^2). For walkers assembled from parts, it is an upper bound."""
    if walker.type == "compass":
        below = walker.leg_length_m - walker.foot_to_mass_m
        return float(walker.leg_mass_kg * below**2 + walker.leg_inertia_kg_m2)
    if walker.type == "straight-legs":
        squared = walker.leg_mass_below_hip_m**2 + walker.leg_mass_ahead_m**2
        return float(walker.leg_mass_kg * squared + walker.leg_inertia_kg_m2)
    if walker.type == "kneed":
        upper = walker.thigh
        lower = walker.shank
        squared = (upper.length_m + lower.mass_below_knee_m) ** 2 + lower.mass_ahead_m**2
        thigh = upper.mass_kg * (upper.mass_below_hip_m**2 + upper.mass_ahead_m**2) + upper.inertia_kg_m2
        return float(thigh + lower.mass_kg * squared + lower.inertia_kg_m2)
    bodies = [body for body in walker.bodies if body.name in walker.legs[0]]
    on_them = [particle.mass_kg for particle in walker.particles if particle.body in walker.legs[0]]
    mass = sum(on_them) + sum(body.mass_kg for body in bodies)
    return float(mass * walker.leg_length_m**2 + sum(body.inertia_kg_m2 for body in bodies))


def why_no_push_off(walker: Any) -> str:
    """Explain why a walker cannot push off along its trailing leg, or return '' if it can."""
    return why_no_push_on(walker) or why_no_push_on(walker.second)


def why_no_push_on(walker: Any) -> str:
    """Explain why the trailing leg cannot push off while a leg like leg 1 leads, or return '' if it can."""
    if not isinstance(walker, CompassWalker | StraightLegs):
        free = walker.knee.at_heel_strike == "free"
        return "cannot act: it needs a locked trailing knee, but walker.knee.at_heel_strike is free" if free else ""
    if isinstance(walker, CompassWalker):
        above = walker.foot_to_mass_m
        ahead = 0.0
    else:
        above = walker.leg_length_m - walker.leg_mass_below_hip_m
        ahead = walker.leg_mass_ahead_m
    leading = walker.leg_mass_kg * (above**2 + ahead**2) + walker.leg_inertia_kg_m2
    if walker.hip_mass_kg + torso_mass(walker.torso) + leading > 0.0:
        return ""
    return "cannot act on any mass: the hip has none, and the leading leg's mass is at its foot"


def too_light_for_contact(walker: Any) -> str:
    """Explain why a walker cannot stand on compliant ground, or return '' if it can."""
    lighter = min(each.leg_mass_kg for each in (walker, walker.second)) if isinstance(walker, CompassWalker) else 1.0
    share = lighter / walker.total_mass_kg if isinstance(walker, CompassWalker) else 1.0
    if share >= LIGHTEST_CONTACT:
        return ""
    return (
        f"the walker's feet have next to no mass ({share:.1g} of the whole): on compliant ground they would have to be "
        "infinitely fast"
    )


def why_no_contact(walker: Any) -> str:
    """Explain why a walker cannot have a contact block, with advice, or return '' if it can."""
    reason = too_light_for_contact(walker)
    return (
        f"cannot carry this walker, as {reason}; leave the contact block out, or give the legs mass" if reason else ""
    )


def explain_wrong_state(start: Any, walker: Any) -> str:
    """Explain why a start has the wrong number of values for a walker, or return '' if the number is right."""
    numbers = 2 * rigid_bodies(walker)
    fits = isinstance(start, str) or len(start) == numbers
    return "" if fits else f"has {len(start)} values; this walker needs {numbers}"


def contact_to_add(walker: Any) -> str:
    """Suggest a contact block in YAML, with the paper's values scaled by mass and a terrain that suits the legs."""
    share = walker.total_mass_kg / CompassWalker().total_mass_kg
    paper = Contact()
    stiffness, damping = (short_number(float(f"{share * value:.3g}")) for value in (paper.stiffness, paper.damping))
    numbers = f"stiffness: {stiffness}, damping: {damping}"
    return f"contact: {{{numbers}, terrain: {'plane' if has_knees(walker) else 'after-mid-swing'}}}"


def has_knees(walker: Any) -> TypeGuard["Kneed | AssembledWalker"]:
    """Whether the walker has knees, so that its swing leg can clear plane ground."""
    return isinstance(walker, Kneed) or (
        isinstance(walker, AssembledWalker) and any(hinge.locks for hinge in walker.hinges)
    )


def why_rigid_alone(walker: Any) -> str:
    return f"The contact model was not used: {too_light_for_contact(walker) or 'the config has no contact block'}."


def contact_required_error(request: str, walker: Any, instead: str) -> ConfigError:
    """Build the error for a request that needs contact. `instead` is the advice if only the block is missing."""
    reason = too_light_for_contact(walker)
    if reason:
        return ConfigError(f"{request} needs contact, but {reason}.", "Use the rigid model, or give the legs mass.")
    return ConfigError(f"{request} needs a contact block, but the config has none.", instead)


def load_walkers() -> dict[str, type[Block]]:
    """Import the walker types that extensions add, keyed by their names in a config.

    Types that cannot be imported are skipped with a warning.
    """
    types = {}
    for word, code in code_by_word("walkers").items():
        try:
            types[word] = load(code)
        except Exception as error:
            reason = f"{type(error).__name__}: {error}"
            warnings.warn(f"the walker type {word} of an extension ({code}) is left out: {reason}", stacklevel=2)
    return types


if TYPE_CHECKING:
    Walker = CompassWalker | StraightLegs | Kneed | AssembledWalker
else:
    kinds = {"compass": CompassWalker, "straight-legs": StraightLegs, "kneed": Kneed, "parts": PartsWalker}
    kinds |= load_walkers()
    Walker = Annotated[
        reduce(or_, (Annotated[block, Tag(word)] for word, block in kinds.items())),
        Discriminator(
            lambda data: data.get("type", "compass") if isinstance(data, dict) else getattr(data, "type", "compass")
        ),
    ]
