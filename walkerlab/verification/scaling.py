"""Walkers of another size, mass and gravity that must do the same, in their own units (dimensional analysis)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from walkerlab.config.contact import Contact
from walkerlab.config.schema import Config

# the twin's leg (m), mass (kg) and gravity (m/s^2): odd numbers, so that rounding falls differently
TWIN_LEG, TWIN_MASS, TWIN_GRAVITY = 1.37, 11.3, 7.43


@dataclass(frozen=True)
class Scale:
    """How many times larger the twin's measures are."""

    length: float
    mass: float
    gravity: float

    @property
    def time(self) -> float:
        """Of sqrt(L/g)."""
        return math.sqrt(self.length / self.gravity)

    @property
    def speed(self) -> float:
        """Of lengths in times."""
        return self.length / self.time

    @property
    def force(self) -> float:
        """Of weights."""
        return self.mass * self.gravity


def pendulum_time(config: Config) -> float:
    """sqrt(L/g) of a config's walker (s)."""
    return math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)


def to_twin(config: Config) -> Scale:
    """The scale that leads from a config's walker to its twin of ordinary size."""
    walker = config.walker
    return Scale(TWIN_LEG / walker.leg_length_m, TWIN_MASS / walker.total_mass_kg, TWIN_GRAVITY / config.gravity_m_s2)


def scaled(config: Config, by: Scale) -> Config:
    """The config of the similar walker: every quantity with a unit scaled, angles and pure numbers as they are."""
    old = config.walker
    walker = old.model_copy(
        update={
            "leg_length_m": old.leg_length_m * by.length,
            "foot_to_mass_m": old.foot_to_mass_m * by.length,
            "leg_mass_kg": old.leg_mass_kg * by.mass,
            "hip_mass_kg": old.hip_mass_kg * by.mass,
            "leg_inertia_kg_m2": old.leg_inertia_kg_m2 * by.mass * by.length**2,
            "foot_radius_m": old.foot_radius_m * by.length,
        }
    )
    changes: dict[str, object] = {"walker": walker, "gravity_m_s2": config.gravity_m_s2 * by.gravity}
    if not isinstance(config.start, str):
        theta_1, theta_2, omega_1, omega_2 = config.start
        changes["start"] = (theta_1, theta_2, omega_1 / by.time, omega_2 / by.time)
    if config.contact is not None:
        changes["contact"] = scaled_contact(config.contact, by)
    return config.model_copy(update=changes)


def scaled_contact(contact: Contact, by: Scale) -> Contact:
    """The similar walker's ground."""
    si = contact.in_si()
    pitch = contact.pad_pitch
    return contact.model_copy(
        update={
            "units": "si",
            "stiffness": si.stiffness_N_per_m_e * by.force / by.length**si.exponent,
            "damping": si.damping_N_s_m * by.force / by.speed,
            "full_damping_penetration": si.full_damping_penetration_m * by.length,
            "stiction_velocity": si.stiction_velocity_m_s * by.speed,
            "friction_velocity": si.friction_velocity_m_s * by.speed,
            "pad_pitch": pitch if isinstance(pitch, str) else pitch * by.length,
        }
    )
