"""The adjustable keys of a config, with their meaning and slider ranges."""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, Final

from pydantic.fields import FieldInfo

from walkerlab.config.fields import bounds_of, leaves, type_words, value_at, words_of
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.pipeline.sweeps.question import described
from walkerlab.scene.parameter import Parameter, parameter_of

FIRST: Final = (
    "slope_deg", "walker.", "push_off.impulse_N_s", "contact.stiffness", "contact.damping", "contact.static_friction",
    "contact.dynamic_friction", "contact.stiction_velocity", "contact.terrain",
)  # fmt: skip
"""Keys shown before any search, in this order; a trailing dot means the whole block."""
DRIVES: Final = ("walker.hip.", "push_off.")
"""Blocks of which only non-zero keys are shown initially; keys of the knee's lock appear in searches only."""
HIDDEN_KEYS: Final = (
    "name", "source", "outputs", "seed", "sweep", "design", "identify", "stability", "tune", "continuation", "basin",
    "robustness",
)  # fmt: skip
"""Keys that do not affect a walk."""
AROUND: Final = 5.0
"""Factor between a slider's initial value and either end of its range."""
FAR_AROUND: Final = 100.0
"""Factor for the keys in `BY_MAGNITUDE`, of which only the order of magnitude is known."""
BY_MAGNITUDE: Final = ("contact.stiffness", "contact.damping", "velocity", "rtol", "atol", "penetration")
DECADES: Final = 100.0
"""Ratio of bounds above which a slider is logarithmic."""
HALVINGS: Final = 10
"""Number of bisections to find the last valid value of a slider."""


def adjustable(start: Config, config: Config) -> Iterator[dict[str, Any]]:
    """Yield a JSON object for each number, choice and switch of a config that affects a walk.

    start   the config before any change, which determines the sliders' ends and the reset values
    config  the config with its changes
    """
    for path, field in leaves(Config, held=config):
        key = ".".join(path)
        if path[0] in HIDDEN_KEYS or key in ("walker.type", "contact.units"):
            continue
        value = value_at(config, path)
        first = value_at(start, path)
        if path == ("slope_rad",):
            key = "slope_deg"
            value = math.degrees(value)
            first = math.degrees(first)
        if value is not None:
            unit, meaning = described(config, key)
            shown = {"key": key, "value": value, "start": first, "unit": unit, "meaning": meaning}
            turned = reach(key, first, unit, field, start)
            yield shown | {"rank": rank(key, first) if turned else None, "bounds": bounds_of(field)} | turned


def rank(key: str, first: Any) -> int | None:
    """Return a key's position among those shown initially, or None if it appears in searches only."""
    if (key.startswith(DRIVES) and not first) or key.startswith("walker.knee."):
        return None
    places = (place for place, name in enumerate(FIRST) if key == name or (name[-1] == "." and key.startswith(name)))
    return next(places, None)


def reach(key: str, first: Any, unit: str, field: FieldInfo, start: Config) -> dict[str, Any]:
    """Return the choices or the slider range of a key, or neither if its value must be typed."""
    if isinstance(first, bool):
        return {"words": [True, False]}
    words = words_of(field.annotation)
    if type_words(field.annotation) == "word" and len(words) > 1:
        return {"words": words}
    if not isinstance(first, int | float):
        return {}
    limits = {
        name: getattr(item, name) for item in field.metadata for name in ("ge", "gt", "le", "lt") if hasattr(item, name)
    }
    low, high = limits.get("ge", limits.get("gt", -math.inf)), limits.get("le", limits.get("lt", math.inf))
    ordinary = ordinary_size(key, unit, start)
    logarithmic = False
    if first == 0:
        least = 0.0 if low >= 0.0 else -ordinary
        most = ordinary
    else:
        by = FAR_AROUND if any(part in key for part in BY_MAGNITUDE) else AROUND
        least, most = sorted((first / by, first * by))
        logarithmic = first > 0.0 and low >= 0.0 and high > DECADES * low
        # a value close to zero must be able to reach the typical size
        most = max(most, ordinary) if logarithmic else most
    if unit != "deg":
        least = max(least, low)
        most = min(most, high)
    parameter = gaits_by(key, start)
    ends = [end if parameter is None else last_allowed(parameter, start, first, end) for end in (least, most)]
    if ends[0] == ends[1]:
        return {}
    if whole := isinstance(first, int):
        ends = [round(end) for end in ends]
    return {"from": ends[0], "to": ends[1], "log": logarithmic, "whole": whole, "gaits": parameter is not None}


def ordinary_size(key: str, unit: str, start: Config) -> float:
    """Return the typical size of a quantity with this unit for the walker, or 0 if unknown."""
    mass = start.walker.total_mass_kg
    leg = start.walker.leg_length_m
    gravity = start.gravity_m_s2
    speed = math.sqrt(gravity * leg)
    if key.startswith("ground."):
        return 100.0 if unit == "1" else 0.01 * leg
    torque = mass * gravity * leg
    return {
        "deg": 5.0, "m": 0.3 * leg, "kg": 0.5 * mass, "kg m^2": 0.01 * mass * leg**2, "N s": 0.1 * mass * speed,
        "N m": 0.02 * torque, "N m/rad": 0.1 * torque, "N m s/rad": 0.02 * mass * leg * speed,
    }.get(unit, 0.0)  # fmt: skip


@lru_cache(maxsize=1000)  # asked again for every key whenever a slider is released
def gaits_by(key: str, start: Config) -> Parameter | None:
    """Return the key as a parameter along which gaits can be followed, or None if no model depends on it."""
    try:
        return parameter_of(key, start)
    except ConfigError:
        return None


def last_allowed(parameter: Parameter, start: Config, first: float, end: float) -> float:
    """Return the valid value closest to a slider's end, with the config's other values kept."""
    if parameter.config_at(start, end) is not None:
        return end
    good = first
    bad = end
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (good, middle) if parameter.config_at(start, middle) is None else (middle, bad)
    return good
