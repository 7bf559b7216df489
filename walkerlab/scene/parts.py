"""Build the parts of a config's walker, shared by both models."""

from typing import Any

from walkerlab.config.drives import push_offs
from walkerlab.config.reads import RigidConfig
from walkerlab.config.walkers import (
    LIGHTEST_CONTACT,
    AssembledWalker,
    CompassWalker,
    Kneed,
    StraightLegs,
    second_leg_of,
    torso_mass,
)
from walkerlab.errors import ConfigError
from walkerlab.physics.mechanics.parts import Assembly, BallFoot, Body, Coupling, Knee, Particle, Revolute
from walkerlab.physics.mechanics.walkers import Arc, Limb, add_torso, kneed_legs, replace_second_leg, straight_legs

PARTS_DOCS = "docs/walkers.md shows a walker described by its parts."
AnyWalker = CompassWalker | StraightLegs | Kneed | AssembledWalker


def assembly_of(walker: AnyWalker, rigid: bool = False) -> Assembly:
    """Return the parts of a walker. In the rigid model a compass has point feet.

    Raises ConfigError for inconsistent parts.
    """
    parts = legs_of(walker, rigid)
    other = second_leg_of(walker)
    parts = parts if other is walker else replace_second_leg(parts, legs_of(other, rigid))
    torso = walker.torso
    return parts if torso is None else add_torso(parts, torso.mass_kg, torso.above_hip_m, torso.inertia_kg_m2)


def legs_of(walker: AnyWalker, rigid: bool) -> Assembly:
    """Return the parts of a walker without its torso and with two legs like leg 1."""
    if isinstance(walker, CompassWalker):
        leg = Limb(walker.leg_length_m, walker.leg_mass_kg, walker.mass_to_hip_m, 0.0, walker.leg_inertia_kg_m2)
        return straight_legs(leg, hip_mass(walker, rigid), Arc(0.0 if rigid else walker.foot_radius_m))
    if isinstance(walker, StraightLegs):
        centre = walker.leg_mass_below_hip_m, walker.leg_mass_ahead_m
        leg = Limb(walker.leg_length_m, walker.leg_mass_kg, *centre, walker.leg_inertia_kg_m2)
        return straight_legs(leg, hip_mass(walker, rigid), Arc(walker.foot_radius_m, walker.foot_centre_ahead_m))
    if isinstance(walker, Kneed):
        upper = walker.thigh
        lower = walker.shank
        thigh = Limb(upper.length_m, upper.mass_kg, upper.mass_below_hip_m, upper.mass_ahead_m, upper.inertia_kg_m2)
        shank = Limb(lower.length_m, lower.mass_kg, lower.mass_below_knee_m, lower.mass_ahead_m, lower.inertia_kg_m2)
        return kneed_legs(thigh, shank, walker.hip_mass_kg, Arc(walker.foot_radius_m, walker.foot_centre_ahead_m))
    return described_parts(walker)


def hip_mass(walker: CompassWalker | StraightLegs, rigid: bool) -> float:
    """Return the hip mass (kg) of a walker with straight legs, raised if the contact model needs more."""
    # On compliant ground, legs that are point masses need a hip mass. Without one, two legs side by side could turn
    # about their masses and move the hip freely, so that no force would determine the acceleration of the hip.
    if rigid:
        return walker.hip_mass_kg
    present = torso_mass(walker.torso) + walker.leg_inertia_kg_m2 / walker.leg_length_m**2
    return max(walker.hip_mass_kg, LIGHTEST_CONTACT * walker.total_mass_kg - present)


def described_parts(walker: AssembledWalker) -> Assembly:
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


def drive_parameters(config: RigidConfig) -> dict[str, Any]:
    return {"hip": tuple(dict(config.walker.hip).values()), "push_off": max(push_offs(config.push_off))}


def knee_dampings(walker: AnyWalker) -> tuple[float, float]:
    """Return the damping (N m s/rad) of each leg's knee, or 0 for a leg without a knee."""
    knees = (getattr(each, "knee", None) for each in (walker, second_leg_of(walker)))
    first, second = (0.0 if knee is None else knee.damping_N_m_s_per_rad for knee in knees)
    return first, second


def damper(damping: float) -> tuple[float, float, float]:
    """Return the parameters of a hinge that is only damped."""
    return 0.0, damping, 0.0


def knee_locked_at_strike(walker: AnyWalker) -> bool:
    """Whether the trailing knee is rigid during heel strike."""
    return not isinstance(walker, Kneed | AssembledWalker) or walker.knee.at_heel_strike == "locked"
