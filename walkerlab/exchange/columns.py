"""Map the columns of a recording to quantities of a walk in SI units, by name, by suffix or as the user specifies."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Final

import numpy as np

from walkerlab.errors import ConfigError
from walkerlab.exchange.recording import TIME, Array, Recording

DEG_RAD: Final = math.pi / 180.0
ANGLES: Final = {
    "rad": 1.0, "radian": 1.0, "radians": 1.0, "deg": DEG_RAD, "degree": DEG_RAD, "degrees": DEG_RAD, "°": DEG_RAD,
}  # fmt: skip
LENGTHS: Final = {
    "m": 1.0, "meter": 1.0, "metre": 1.0, "mm": 1e-3, "millimeter": 1e-3, "cm": 1e-2, "centimeter": 1e-2, "km": 1e3,
    "in": 0.0254, "inch": 0.0254, "ft": 0.3048, "foot": 0.3048,
}  # fmt: skip
UNIT_VALUES: Final[Mapping[str, Mapping[str, float]]] = {
    "time": {
        "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "millisecond": 1e-3,
        "min": 60.0, "minute": 60.0,
    },
    "angle": ANGLES,
    "rate": {f"{unit}/{second}": value for unit, value in ANGLES.items() for second in ("s", "sec")},
    "length": LENGTHS,
    "speed": {f"{unit}/{second}": value for unit, value in LENGTHS.items() for second in ("s", "sec")},
    "force": {"n": 1.0, "newton": 1.0, "kn": 1e3},
    "energy": {"j": 1.0, "joule": 1.0, "mj": 1e-3, "n mm": 1e-3},
}  # fmt: skip
"""Value of each unit in SI, by kind of quantity; unit names are in lower case."""
SI: Final = {kind: next(iter(units)) for kind, units in UNIT_VALUES.items()}
OF_LEG: Final = {
    "angle": "angle", "velocity": "rate", "shank_angle": "angle", "shank_velocity": "rate", "foot_along_m": "length",
    "foot_height_m": "length", "knee_along_m": "length", "knee_height_m": "length", "normal_force_N": "force",
    "friction_force_N": "force", "penetration_m": "length", "slip_velocity_m_s": "speed",
}  # fmt: skip
OF_WALKER: Final = {
    TIME: "time", "torso_angle": "angle", "torso_velocity": "rate", "hip_along_m": "length", "hip_height_m": "length",
    "kinetic_J": "energy", "potential_J": "energy", "mechanical_J": "energy", "total_energy_J": "energy",
}  # fmt: skip
QUANTITY_KINDS: Final = OF_WALKER | {f"{name} {leg}": kind for name, kind in OF_LEG.items() for leg in (1, 2)}
"""Kind of unit by quantity; names of a leg's quantities end in the leg's number, 1 or 2."""
NEEDED: Final = (TIME, "angle 1", "angle 2")
UNIT_AT_END: Final = re.compile(r"_(?:m_s|m|n)$")
LINE: Final = re.compile(r"(.+?)\s*>\s*(.+)")
"""Pattern for the angle of a line from one marker to another, as in `angle 1=HIP>HEEL`."""


@dataclass(frozen=True, eq=False)
class RecordedWalk:
    """Recorded walk in SI units: time (samples,), quantities (samples,) by name, and the columns they come from."""

    time_s: Array
    quantities: dict[str, Array]
    sources: dict[str, str] = field(default_factory=dict)

    def both_legs(self, name: str) -> Array | None:
        """Return a quantity of both legs (samples, 2); None unless it is recorded for both."""
        both = [self.quantities.get(f"{name} {leg}") for leg in (1, 2)]
        return None if both[0] is None or both[1] is None else np.stack([both[0], both[1]], axis=1)


def as_walk(recording: Recording, columns: Mapping[str, str], units: Mapping[str, str]) -> RecordedWalk:
    """Return the quantities of a recorded walk in SI units.

    columns  columns that the user names, by quantity; `HIP>FOOT` is the angle of the line between two markers
    units    units that the file does not state, by kind ('angle', 'length', ...), by quantity or by column

    Raises ConfigError for a column or unit that is unknown or missing, and for gaps.
    """
    sources = {**matches(recording, set(columns)), **named_columns(recording, columns)}
    for name in NEEDED:
        if name not in sources:
            raise missing(recording, name)
    values = {name: in_si(recording, name, source, units) for name, source in sources.items()}
    time = values.pop(TIME)
    return RecordedWalk(time, values, sources)


def plain(name: str) -> str:
    """Return a name in lower case, with underscores as its only separators."""
    return re.sub(r"[\s_\-]+", "_", name.strip().lower())


def matches(recording: Recording, named: set[str]) -> dict[str, str]:
    """Return a column by quantity: the column with the quantity's name, otherwise the only one whose name ends in it.

    named  quantities to skip, because the user names their columns
    """
    sources = {}
    for name in QUANTITY_KINDS.keys() - named:
        names = {plain(name), plain(name).removesuffix("_m"), *leg_names(name)}
        exact = [column for column in recording.columns if plain(column) in names]
        longer = [column for column in recording.columns if any(ends_in(plain(column), ending) for ending in names)]
        if len(candidates := exact or longer) == 1:
            sources[name] = candidates[0]
        elif len(candidates) > 1:
            raise ConfigError(
                f"{recording.path}: columns {' and '.join(candidates[:3])} could each be {name!r}.",
                f'Choose one: --columns "{name}=..."',
            )
    return sources


def leg_names(name: str) -> list[str]:
    """Return a leg quantity's name in exported models, e.g. leg_1.angle for 'angle 1'; empty for other quantities."""
    quantity, blank, leg = name.rpartition(" ")
    return [f"leg_{leg}.{UNIT_AT_END.sub('', plain(quantity))}"] if blank else []


def ends_in(name: str, ending: str) -> bool:
    """Return whether a name ends in `ending` after a dot or a slash."""
    return name.endswith((f".{ending}", f"/{ending}"))


def named_columns(recording: Recording, columns: Mapping[str, str]) -> dict[str, str]:
    """Return the columns that the user names, by quantity; raises ConfigError for an unknown quantity or column."""
    known = {plain(name): name for name in QUANTITY_KINDS}
    sources = {}
    for quantity, column in columns.items():
        name = known.get(plain(quantity))
        if name is None:
            near = get_close_matches(plain(quantity), known, 1)
            advice = f"Did you mean {known[near[0]]!r}?" if near else f"Available: {', '.join(QUANTITY_KINDS)}."
            raise ConfigError(f"--columns: {quantity!r} is not a quantity of a walk.", advice)
        ends = LINE.fullmatch(column)
        markers = [f"{marker}.{axis}" for marker in (ends[1], ends[2]) for axis in "xyz"] if ends else [column]
        for needed in markers:
            if needed not in recording.columns:
                near = get_close_matches(needed, recording.columns, 1, 0.3)
                advice = (
                    f"Did you mean {near[0]!r}?" if near else f"Available: {', '.join(list(recording.columns)[:12])}."
                )
                raise ConfigError(f"{recording.path} has no column {needed!r}.", advice)
        sources[name] = column
    return sources


def missing(recording: Recording, name: str) -> ConfigError:
    """Build the error for a quantity without a column; it suggests the column with the most similar name."""
    near = get_close_matches(plain(name), [plain(column) for column in recording.columns], 1, 0.2)
    nearest = next((column for column in recording.columns if near and plain(column) == near[0]), "NAME")
    there = ", ".join(column for column in list(recording.columns)[:12])
    return ConfigError(
        f"{recording.path} has no column for {name!r}; it has: {there}.", f'Name it: --columns "{name}={nearest}"'
    )


def in_si(recording: Recording, name: str, source: str, units: Mapping[str, str]) -> Array:
    """Return a quantity in SI units; raises ConfigError for gaps, and for a missing or unsuitable unit."""
    kind = QUANTITY_KINDS[name]
    if ends := LINE.fullmatch(source):
        return line_angle(*(marker_place(recording, marker, units) for marker in (ends[1], ends[2])))
    values = recording.columns[source] * unit_value(recording, name, source, kind, units)
    return complete(recording, name, source, values)


def complete(recording: Recording, name: str, source: str, values: Array) -> Array:
    """Return the values of a column; raises ConfigError if it has gaps."""
    gaps = np.flatnonzero(~np.isfinite(values))
    if gaps.size:
        time = recording.columns[TIME][gaps[0]]
        raise ConfigError(
            f"{recording.path}: {source!r} ({name}) has {gaps.size} gaps, the first at time {time:.6g} "
            f"(sample {gaps[0] + 1}).",
            "Fill the gaps, or cut the recording to a part without them.",
        )
    return values


def unit_value(recording: Recording, name: str, source: str, kind: str, units: Mapping[str, str]) -> float:
    """Return the SI value of a column's unit, which the user, the file or the column's name states."""
    unit = (
        units.get(source) or units.get(name) or recording.units.get(source) or units.get(kind)
        or recording.kind_units.get(kind) or unit_in_name(source, kind) or rate_unit(recording, kind, units)
    )  # fmt: skip
    if not unit:
        raise ConfigError(
            f"{recording.path} states no unit for {source!r} ({name}).",
            f"Add --units {kind}={SI[kind]}, or another unit: {', '.join(list(UNIT_VALUES[kind])[:6])}.",
        )
    value = UNIT_VALUES[kind].get(unit.strip().lower())
    if value is None:
        raise ConfigError(
            f"{recording.path}: {unit!r}, stated for {name!r}, is not a known unit of {kind}.",
            f"Known units: {', '.join(list(UNIT_VALUES[kind])[:6])}; set --units {kind}={SI[kind]}.",
        )
    return value


def unit_in_name(column: str, kind: str) -> str:
    """Return the unit at the end of a column's name, such as mm in hip_mm; empty if the name has none."""
    endings = [unit for unit in UNIT_VALUES[kind] if plain(column).endswith(f"_{unit.replace('/', '_')}")]
    return max(endings, key=len, default="")


def rate_unit(recording: Recording, kind: str, units: Mapping[str, str]) -> str:
    """Derive the unit of velocities from the unit of angles or lengths; empty if that is not stated either."""
    moved = {"rate": "angle", "speed": "length"}.get(kind, "")
    unit = units.get(moved) or recording.kind_units.get(moved)
    return f"{unit}/s" if unit else ""


def marker_place(recording: Recording, marker: str, units: Mapping[str, str]) -> Array:
    """Return the positions (samples, 3) of a marker (m)."""
    axes = [f"{marker}.{axis}" for axis in "xyz"]
    scale = unit_value(recording, marker, axes[0], "length", units)
    return np.stack([complete(recording, marker, axis, recording.columns[axis] * scale) for axis in axes], axis=1)


def line_angle(top: Array, bottom: Array) -> Array:
    """Return the angles (samples,) of a line from the vertical (rad), positive if the lower end is ahead.

    Ahead is the direction of the upper end's motion along the horizontal axis on which it moves most.
    """
    vertical = int(np.argmax(np.abs(np.mean(top - bottom, axis=0))))
    spans = np.ptp(top, axis=0)
    spans[vertical] = -1.0
    ahead = int(np.argmax(spans))
    forward = np.sign(top[-1, ahead] - top[0, ahead]) or 1.0
    return np.asarray(np.arctan2(forward * (bottom - top)[:, ahead], np.abs((top - bottom)[:, vertical])))


def parse_pairs(option: str, texts: Sequence[str]) -> dict[str, str]:
    """Parse pairs such as `a=b,c=d` into a dictionary; raises ConfigError for any other form."""
    pairs = [pair for text in texts for pair in text.split(",") if pair.strip()]
    for pair in pairs:
        if "=" not in pair or not all(side.strip() for side in pair.split("=", 1)):
            raise ConfigError(f"{pair!r} is not of the form NAME=NAME.", f'Write {option} "a=b,c=d".')
    return {key.strip(): value.strip() for key, value in (pair.split("=", 1) for pair in pairs)}


def parse_units(texts: Sequence[str]) -> dict[str, str]:
    """Return units by kind, quantity or column; a unit alone, such as `deg`, applies to its kind (angles)."""
    pairs, alone = [], {}
    for part in (part.strip() for text in texts for part in text.split(",") if part.strip()):
        kinds = [kind for kind, units in UNIT_VALUES.items() if part.lower() in units]
        if "=" in part:
            pairs.append(part)
        elif kinds:
            alone[kinds[0]] = part
        else:
            known = ", ".join(unit for units in UNIT_VALUES.values() for unit in units)
            raise ConfigError(f"{part!r} is not a known unit.", f"Known units: {known}.")
    return alone | parse_pairs("--units", pairs)
