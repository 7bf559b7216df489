"""The keys of a config that can be turned: what each is, and over which values a slider leads it."""

import math
from collections.abc import Iterator
from typing import Any, Final

from pydantic.fields import FieldInfo

from walkerlab.config.fields import bounds_of, leaves, words_of
from walkerlab.config.schema import Config
from walkerlab.sweeps.question import described

FIRST: Final = (
    "slope_deg", "walker.", "push_off.impulse_N_s", "contact.stiffness", "contact.damping", "contact.static_friction",
    "contact.dynamic_friction", "contact.stiction_velocity", "contact.terrain",
)  # fmt: skip
"""What is shown before anything is searched for, in this order; a dot at the end means all of a block."""
DRIVES: Final = ("walker.hip.", "push_off.")
"""Shown at first only where they are at work; how knees lock is searched for."""
OF_OTHERS: Final = ("name", "source", "sweep", "design", "stability", "tune", "continuation", "basin", "robustness")
"""Keys that no walk depends on."""
AROUND: Final = 5.0
"""A slider leads to this many times its first value, and to as small a part of it."""
FAR_AROUND: Final = 100.0
"""The same for what is known by its order of magnitude."""
BY_MAGNITUDE: Final = ("contact.stiffness", "contact.damping", "velocity", "rtol", "atol", "penetration")
FROM_NOTHING: Final = {"rad": 1.0, "deg": 5.0, "kg": 10.0, "N s": 0.3, "kg m^2": 0.2, "N m": 5.0, "N m/rad": 20.0}
"""How far a slider leads whose first value is 0, by unit; of lengths, a part of the leg's."""
OF_THE_LEG: Final = 0.3


def adjustable(start: Config, config: Config) -> Iterator[dict[str, Any]]:
    """Each number, word and switch that the walker has, with its value, as JSON.

    start   the config before anything was changed, which the sliders' ends and a reset go by
    config  the same with its changes
    """
    for path, field in leaves(Config, held=config):
        key = ".".join(path)
        if path[0] in OF_OTHERS or key in ("walker.type", "contact.units", "outputs", "start"):
            continue
        value, first = held(config, path), held(start, path)
        if path == ("slope_rad",):
            key, value, first = "slope_deg", math.degrees(value), math.degrees(first)
        if isinstance(value, str | int | float):
            unit, meaning = described(config, key)
            shown = {"key": key, "value": value, "start": first, "unit": unit, "meaning": meaning}
            yield (
                shown | {"rank": rank(key, first), "bounds": bounds_of(field)} | reach(key, first, unit, field, config)
            )


def rank(key: str, first: Any) -> int | None:
    """Where a key stands among those that are shown at first; None if it is searched for."""
    if (key.startswith(DRIVES) and not first) or key.startswith("walker.knee."):
        return None
    return next(
        (place for place, name in enumerate(FIRST) if key == name or (name[-1] == "." and key.startswith(name))), None
    )


def held(config: Config, path: tuple[str, ...]) -> Any:
    """The value at a path; None if the config has no such block."""
    found: Any = config
    for name in path:
        found = getattr(found, name, None)
    return found


def reach(key: str, first: Any, unit: str, field: FieldInfo, config: Config) -> dict[str, Any]:
    """What a key's value can be turned to: one of some words, or a number on a slider."""
    if isinstance(first, bool):
        return {"words": [True, False]}
    if isinstance(first, str | None):
        return {"words": [word for word in words_of(field.annotation) if word != "fixed-point"]}
    if first == 0:
        far = OF_THE_LEG * config.walker.leg_length_m if unit == "m" else FROM_NOTHING.get(unit, 1.0)
        least, most, logarithmic = 0.0, far, False
    elif any(part in key for part in BY_MAGNITUDE):
        least, most, logarithmic = first / FAR_AROUND, first * FAR_AROUND, True
    else:
        least, most, logarithmic = *sorted((first / AROUND, first * AROUND)), False
    limits = {name: getattr(item, name) for item in field.metadata for name in ("ge", "le") if hasattr(item, name)}
    least, most = max(least, limits.get("ge", least)), min(most, limits.get("le", most))
    return {"from": least, "to": most, "log": logarithmic, "whole": isinstance(first, int)}
