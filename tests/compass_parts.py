"""The compass walker built from its parts."""

from dataclasses import dataclass

from walkerlab.physics.mechanics.parts import Assembly, BallFoot, Body, Particle, Revolute


@dataclass(frozen=True)
class CompassParts:
    """Lengths, masses and inertias of a compass walker in SI units."""

    leg_length_m: float
    foot_to_mass_m: float
    leg_mass_kg: float
    hip_mass_kg: float
    leg_inertia_kg_m2: float
    foot_radius_m: float


def compass_assembly(parts: CompassParts) -> Assembly:
    """Build two legs that are hinged at a hip, which is a point mass. The frame of each leg has its origin at the hip
    and points up the leg.

    The centre of a ball foot is L - r from the hip, so that an upright leg has length L.
    """
    mass_at = (0.0, parts.foot_to_mass_m - parts.leg_length_m)
    foot_at = (0.0, parts.foot_radius_m - parts.leg_length_m)
    hip = (0.0, 0.0)
    legs = ("leg 1", "leg 2")
    return Assembly(
        bodies=tuple(Body(leg, parts.leg_mass_kg, mass_at, parts.leg_inertia_kg_m2) for leg in legs),
        joints=(Revolute("hip", "leg 2", hip, "leg 1", hip),),
        particles=(Particle("hip", parts.hip_mass_kg, "leg 2", hip),),
        feet=tuple(BallFoot(f"foot of {leg}", leg, foot_at, parts.foot_radius_m) for leg in legs),
        legs=(legs[:1], legs[1:]),
    )
