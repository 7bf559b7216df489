"""Units and meanings of result columns, declared next to the fields that hold their values."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final, get_args, get_type_hints

UNITS: Final = {
    "rad": "rad", "deg": "deg", "m": "m", "s": "s", "N": "N", "J": "J", "kg": "kg", "m_s": "m/s", "m_s2": "m/s^2",
    "rad_s": "rad/s", "N_s_m": "N s/m", "s_m": "s/m", "N_s": "N s", "Hz": "Hz", "W": "W", "mm": "mm", "kg_m2": "kg m^2",
    "N_m": "N m", "N_m_per_rad": "N m/rad", "N_m_s_per_rad": "N m s/rad",
}  # fmt: skip
"""Units by the suffix of a quantity's name."""
RIGID_STAGE: Final = "simulate"
CONTACT_STAGE: Final = "contact-sim"
"""Stages that simulate a walk."""
ERROR_OF_EACH_STEP: Final = {
    "step_periods_s": "step_period_s",
    "step_lengths_m": "step_length_m",
    "slips_m": "slip_m",
    "rolling_m": "rolling_m",
    "knee_strike_times_s": "knee_strike_time_s",
}
"""Names that `numerical_error` uses for the per-step quantities in the summary of a walk."""


@dataclass(frozen=True)
class Label:
    """Unit and meaning of a field or property of a row, used in `Annotated`. Unlabelled fields are not stored."""

    unit: str  # "1" for pure numbers, "" for text
    text: str  # meaning
    dims: tuple[str, ...] = ()  # dimensions of a row's value; () for a scalar
    timing: bool = False  # whether the value is a measured run time or derived from one
    absent: float | None = None  # what to store for a missing value; None stores nothing
    name: str = ""  # stored name, if it differs from that of the field


@cache
def labels_of(row: type) -> Mapping[str, Label]:
    """Return the labels of a row class by the name of the field or property."""
    properties = [(name, member.fget) for name, member in vars(row).items() if isinstance(member, property)]
    returned = {name: get_type_hints(getter, include_extras=True)["return"] for name, getter in properties}
    hints = get_type_hints(row, include_extras=True) | returned
    return {name: label for name, hint in hints.items() for label in get_args(hint)[1:] if isinstance(label, Label)}


def unit_ending(name: str) -> str:
    """Return the unit suffix of a name, e.g. m_s for velocity_m_s, or '' if it has none."""
    return max((ending for ending in UNITS if name.endswith(f"_{ending}")), key=len, default="")


def unit_by_name(name: str) -> str:
    """Return the unit that the suffix of a name stands for, or '1' if it has none.

    In a dotted name, the last part with a unit counts.
    """
    return next((UNITS[ending] for part in reversed(name.split(".")) if (ending := unit_ending(part))), "1")


def axis_label(key: str) -> str:
    """Convert a key to an axis label without units, e.g. walker.thigh.mass_kg to 'thigh mass'."""
    parts = key.removeprefix("walker.").split(".")
    shown = (part.removesuffix(f"_{unit_ending(part)}") for part in parts if part != "leg_2")
    words = " ".join(shown).replace("_", " ")
    return f"{words.removeprefix('leg ')} of leg 2" if "leg_2" in parts else words


def add_unit(words: str, unit: str) -> str:
    return words if unit in ("", "1") else f"{words} ({unit})"


def join_words(parts: Iterable[str]) -> str:
    """Join words as in English: 'a', 'a and b', 'a, b and c'."""
    words = list(parts)
    return " and ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else "".join(words)
