"""Twins of walkers: dynamically similar walkers with another size, mass and gravity, which walk in the same way."""

import math
from typing import Any, TypeVar

from walkerlab.config.fields import Block, annotation_of
from walkerlab.config.reads import RigidConfig
from walkerlab.config.schema import Config, replace_state, state_of
from walkerlab.physics.orbits.similarity import Units

B = TypeVar("B", bound=Block)
# leg (m), mass (kg) and gravity (m/s^2) of the twin: uneven values, so that its rounding errors differ
TWIN_LEG = 1.37
TWIN_MASS = 11.3
TWIN_GRAVITY = 7.43


def pendulum_time(config: RigidConfig) -> float:
    """Return the pendulum time sqrt(L/g) (s) of a config's walker."""
    return math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)


def to_twin(config: RigidConfig) -> Units:
    """Return the scale factors from a config's walker to its twin of ordinary size."""
    length = TWIN_LEG / config.walker.leg_length_m
    mass = TWIN_MASS / config.walker.total_mass_kg
    return Units(length, mass, math.sqrt(length * config.gravity_m_s2 / TWIN_GRAVITY))


def scaled_block(block: B, by: Units) -> B:
    """Scale each value of a block according to the unit of its key."""

    def value(quantity: Any, unit: float) -> Any:
        if isinstance(quantity, Block):
            return scaled_block(quantity, by)
        if isinstance(quantity, tuple):
            return tuple(value(item, unit) for item in quantity)
        return quantity * unit if isinstance(quantity, float) and unit != 1.0 else quantity

    values: dict[str, Any] = {}
    for name, field in type(block).model_fields.items():
        values[name] = value(getattr(block, name), by.natural_unit(annotation_of(field, "unit")))
    return block.model_copy(update=values)


def scaled(config: Config, by: Units) -> Config:
    """Return the config of a similar walker: quantities with a unit are scaled, angles and pure numbers are not."""
    walker = scaled_block(config.walker, by)
    changes: dict[str, object] = {
        "walker": walker,
        "gravity_m_s2": config.gravity_m_s2 * by.length / by.time**2,
        "push_off": scaled_block(config.push_off, by),
    }
    if not isinstance(config.start, str):
        state = state_of(config.start)
        n = len(config.start) // 2
        changes["start"] = replace_state(config.start, (*state[:n], *(rate / by.time for rate in state[n:])))
    if config.contact is not None:
        si = config.contact.to_si()
        pitch = config.contact.pad_pitch
        ground = {
            "units": "si",
            "stiffness": si.stiffness * by.force / by.length**si.exponent,
            "damping": si.damping * by.mass / by.time,
            "full_damping_penetration": si.full_damping_penetration * by.length,
            "stiction_velocity": si.stiction_velocity * by.length / by.time,
            "friction_velocity": si.friction_velocity * by.length / by.time,
            "pad_pitch": pitch if isinstance(pitch, str) else pitch * by.length,
        }
        changes["contact"] = config.contact.model_copy(update=ground)
    return config.model_copy(update=changes)
