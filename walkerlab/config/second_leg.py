"""Keys of a second leg that differs from the first: `walker.leg_2` of each type of walker, and `push_off.leg_2`."""

from typing import Any, Literal

from walkerlab.config.fields import Block, key
from walkerlab.config.reads import flatten


def second_leg(unit: str, least: float | None = None) -> Any:
    limits: dict[str, Any] = {} if least is None else {"ge": least}
    return key(None, unit, "the same for leg 2", bounds="as for leg 1", default_in_words="as for leg 1", **limits)


class SecondCompassLeg(Block):
    """Properties of leg 2 that differ from those of leg 1, which swings first."""

    leg_length_m: float | None = second_leg("m", 1e-3)
    foot_to_mass_m: float | None = second_leg("m", 0.0)
    leg_mass_kg: float | None = second_leg("kg", 1e-12)
    leg_inertia_kg_m2: float | None = second_leg("kg m^2", 0.0)
    foot_radius_m: float | None = second_leg("m", 0.0)


class SecondStraightLeg(Block):
    """Properties of leg 2 that differ from those of leg 1, which swings first."""

    leg_length_m: float | None = second_leg("m", 1e-3)
    leg_mass_kg: float | None = second_leg("kg", 1e-12)
    leg_mass_below_hip_m: float | None = second_leg("m")
    leg_mass_ahead_m: float | None = second_leg("m")
    leg_inertia_kg_m2: float | None = second_leg("kg m^2", 0.0)
    foot_radius_m: float | None = second_leg("m", 0.0)
    foot_centre_ahead_m: float | None = second_leg("m")


class SecondThigh(Block):
    """Properties of the thigh of leg 2 that differ from those of leg 1."""

    length_m: float | None = second_leg("m", 1e-3)
    mass_kg: float | None = second_leg("kg", 1e-12)
    mass_below_hip_m: float | None = second_leg("m")
    mass_ahead_m: float | None = second_leg("m")
    inertia_kg_m2: float | None = second_leg("kg m^2", 0.0)


class SecondShank(Block):
    """Properties of the shank of leg 2 that differ from those of leg 1."""

    length_m: float | None = second_leg("m", 1e-3)
    mass_kg: float | None = second_leg("kg", 1e-12)
    mass_below_knee_m: float | None = second_leg("m")
    mass_ahead_m: float | None = second_leg("m")
    inertia_kg_m2: float | None = second_leg("kg m^2", 0.0)


class SecondKnee(Block):
    """Properties of the knee of leg 2 that differ from those of leg 1."""

    damping_N_m_s_per_rad: float | None = second_leg("N m s/rad", 0.0)


class SecondKneedLeg(Block):
    """Properties of leg 2 that differ from those of leg 1, which swings first."""

    thigh: SecondThigh = SecondThigh()
    shank: SecondShank = SecondShank()
    knee: SecondKnee = SecondKnee()
    foot_radius_m: float | None = second_leg("m", 0.0)
    foot_centre_ahead_m: float | None = second_leg("m")


class KneelessLeg(SecondStraightLeg):
    """A second leg without a knee. Omitted keys have the values of leg 1 with its knee locked."""

    type: Literal["straight-legs"] = key(..., "", "a leg without a knee")


class SecondPushOff(Block):
    """The push-off of leg 2, if it differs from that of leg 1."""

    impulse_N_s: float | None = second_leg("N s", 0.0)


def states_second_leg(config: Any) -> bool:
    """Whether a config has keys for leg 2 or its push-off. Also true for a walker whose type has no key `leg_2`."""
    return getattr(config.walker, "leg_2", ...) is not None or config.push_off.leg_2 is not None


def describe_second_leg(walker: Any) -> str:
    """Describe the keys of leg 2 that a config states, with their values, or return '' if it states none."""
    leg = getattr(walker, "leg_2", None)
    keys = {} if leg is None else leg.model_dump(exclude_none=True)
    return ", ".join(f"{name}: {value}" for name, value in flatten(keys))


def lock_knee(thigh: Any, shank: Any) -> dict[str, float]:
    """Return the keys of the straight leg that a thigh and a shank form when the knee is locked."""
    mass = thigh.mass_kg + shank.mass_kg
    below = thigh.mass_kg * thigh.mass_below_hip_m + shank.mass_kg * (thigh.length_m + shank.mass_below_knee_m)
    ahead = thigh.mass_kg * thigh.mass_ahead_m + shank.mass_kg * shank.mass_ahead_m
    apart = (thigh.length_m + shank.mass_below_knee_m - thigh.mass_below_hip_m, shank.mass_ahead_m - thigh.mass_ahead_m)
    reduced = thigh.mass_kg * shank.mass_kg / mass
    return {
        "leg_length_m": thigh.length_m + shank.length_m,
        "leg_mass_kg": mass,
        "leg_mass_below_hip_m": below / mass,
        "leg_mass_ahead_m": ahead / mass,
        "leg_inertia_kg_m2": thigh.inertia_kg_m2 + shank.inertia_kg_m2 + reduced * (apart[0] ** 2 + apart[1] ** 2),
    }
