"""What the columns of a result are: unit and meaning, typed once, beside the field that holds the values."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final, get_args, get_type_hints

UNITS: Final = {
    "rad": "rad", "deg": "deg", "m": "m", "s": "s", "N": "N", "J": "J", "kg": "kg", "m_s": "m/s", "m_s2": "m/s^2",
    "rad_s": "rad/s", "N_s_m": "N s/m", "N_s": "N s", "Hz": "Hz", "W": "W", "mm": "mm", "kg_m2": "kg m^2",
    "N_m": "N m", "N_m_per_rad": "N m/rad", "N_m_s_per_rad": "N m s/rad",
}  # fmt: skip
"""By what names of numbers end in."""
ERROR_OF_EACH_STEP: Final = {
    "step_periods_s": "step_period_s",
    "step_lengths_m": "step_length_m",
    "slips_m": "slip_m",
    "rolling_m": "rolling_m",
    "knee_strike_times_s": "knee_strike_time_s",
}
"""Numbers of each step in a walk's summary, and under which name in its `numerical_error` their largest change is."""


@dataclass(frozen=True)
class Label:
    """Unit and meaning of a field or property of a row, to be put into `Annotated`; without one it is not stored.

    unit    "1" for a pure number, "" for text
    text    what it is, in words
    dims    of a row's values; () where there is one
    timing  a measured run time, or what shows one
    absent  stands where there is no value; None leaves a gap
    name    under which it is stored, where that is not the field's
    """

    unit: str
    text: str
    dims: tuple[str, ...] = ()
    timing: bool = False
    absent: float | None = None
    name: str = ""


@cache
def labels_of(row: type) -> Mapping[str, Label]:
    """The labels of a class of rows, by field and property."""
    properties = [(name, one.fget) for name, one in vars(row).items() if isinstance(one, property)]
    returned = {name: get_type_hints(getter, include_extras=True)["return"] for name, getter in properties}
    hints = get_type_hints(row, include_extras=True) | returned
    return {name: label for name, hint in hints.items() for label in get_args(hint)[1:] if isinstance(label, Label)}


def unit_ending(name: str) -> str:
    """What tells the unit at the end of a name, as m_s of velocity_m_s; empty if nothing does."""
    return max((ending for ending in UNITS if name.endswith(f"_{ending}")), key=len, default="")


def unit_by_name(name: str) -> str:
    """The unit that a name ends in; '1' for none."""
    return UNITS.get(unit_ending(name), "1")


def in_words(key: str) -> str:
    """A key or a name without its unit, as an axis says it: thigh mass of walker.thigh.mass_kg."""
    ending = unit_ending(key)
    return key.removeprefix("walker.").removesuffix(f"_{ending}" if ending else "").replace("_", " ").replace(".", " ")


def with_unit(words: str, unit: str) -> str:
    """Words with a unit in brackets; a pure number, and text, have none."""
    return words if unit in ("", "1") else f"{words} ({unit})"
