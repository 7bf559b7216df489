"""From a file, `--set` and `--strides` to one typed config, its warnings and the name of its run.

A config changed by `--set` runs beside the unchanged one, in a folder named after the change.
"""

import hashlib
import math
import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from walkerlab.config.canonical import flattened
from walkerlab.config.fields import block_of
from walkerlab.config.files import DEFAULT, ConfigFile, builtin, find, read_layers, with_cases
from walkerlab.config.layers import ConfigSetting, option_setting, setting_of, stacked, with_settings
from walkerlab.config.numbers import short
from walkerlab.config.overlay import refuse_bad_cases
from walkerlab.config.problems import Problem
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping, Position, Scalar
from walkerlab.config.validation import Location, key_at, on_the_slope, typed
from walkerlab.config.walkers import CompassWalker

STEEP_RAD: Final = 0.5
"""No passive walker is known to walk on a slope as steep; a number above it is perhaps in degrees."""
LONG_M: Final = 20.0
"""Nobody builds longer legs; a number above it is perhaps in millimetres."""
HEAVY_KG_M3: Final = 1000.0
"""A mass above that of a cube of water as wide as the legs are long is perhaps in grams."""


@dataclass(frozen=True, slots=True)
class LoadedConfig:
    """A config that is ready to run, and to be varied.

    config    resolved, in the schema's types
    run_name  name of its folder below the runs folder
    warnings  what was changed in it, in words
    source    the file it is from
    tree      what it was typed from
    """

    config: Config
    run_name: str
    warnings: tuple[str, ...]
    source: str
    tree: Mapping

    def variant(self, settings: Sequence[ConfigSetting]) -> Config:
        """The config with some keys set, checked by the schema; ConfigError with the places of what is wrong."""
        tree = with_settings(self.tree, settings)
        return on_the_slope(typed(tree), tree)[0]


def load(
    path: Path | ConfigFile | None = None,
    sets: Sequence[str] = (),
    strides: int | None = None,
    name: str | None = None,
) -> LoadedConfig:
    """Load a config.

    path     of a YAML file, or the name of a built-in config; None is the built-in paper config; a `ConfigFile` with a
             text is a run's config, named as the run's folder
    sets     `--set` options, KEY=VALUE, in order
    strides  `--strides`, over everything else
    name     `--name`, over the config's own; None leaves that

    Raises ConfigError with file, line, column, value, what is allowed and the nearest key of every problem.
    """
    file = path if isinstance(path, ConfigFile) else builtin(DEFAULT) if path is None else find(path)
    tree = stacked(read_layers(file))
    start = Position(file.label, 1, 1)
    if "name" not in tree.entries:
        safe = safe_name(file.path.stem)
        tree = tree.without()
        tree.put("name", Scalar(start, safe, safe), start)
    settings = [setting_of(text) for text in sets]
    options = {"strides": strides, "name": name}
    settings += [option_setting(key, value) for key, value in options.items() if value is not None]
    changed_tree = with_cases(with_settings(tree, settings), Path())
    changed = typed(changed_tree)
    base = typed(tree) if settings else changed
    refuse_bad_cases(changed, changed_tree)
    config, moved = on_the_slope(changed, changed_tree)
    slope = changed_tree.entries.get("slope_deg")
    degrees = float(slope.value) if isinstance(slope, Scalar) and isinstance(slope.value, int | float) else None
    folder = name or run_name(base, changed, degrees, None if file.text is None else file.path.name)
    named = tree.entries["name"]
    warnings = [*doubts(config, changed_tree), *moved]
    if isinstance(named, Scalar) and named.position == start and named.value != file.path.stem:
        cannot = "since a run folder cannot be named as the file is"
        warnings.insert(0, f"{file.label}: the run is named {named.value}, {cannot}")
    return LoadedConfig(config, folder, tuple(warnings), file.label, changed_tree)


def safe_name(text: str) -> str:
    """A text as the name of a run folder: accents, blanks and what else such a name cannot have replaced."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.")[:64].rstrip(".") or "run"


def doubts(config: Config, tree: Mapping) -> Iterator[str]:
    """What is perhaps meant otherwise: a leg whose mass stays, wrong units, a pitch without pads."""
    walker, block = config.walker, tree.entries.get("walker")
    places = block.keys if isinstance(block, Mapping) else {}
    length = short(walker.leg_length_m)
    if isinstance(walker, CompassWalker) and {"leg_length_m", "foot_to_mass_m"} <= places.keys():
        leg, mass, stays = places["leg_length_m"], places["foot_to_mass_m"].source, walker.foot_to_mass_m
        moved = leg.source.startswith("built-in") or mass.startswith("--")  # the mass itself, over a leg that was there
        if leg.source != mass and not moved and stays != walker.leg_length_m / 2:
            yield (
                f"{leg}: walker.leg_length_m is {length} m, and walker.foot_to_mass_m stays {short(stays)} m, "
                f"as {mass} has it: the mass is not in the middle of the leg"
            )
    slope = tree.keys.get("slope_rad")
    if slope is not None and abs(config.slope_rad) > STEEP_RAD:
        degrees = short(round(math.degrees(config.slope_rad), 1))
        yield str(Problem(slope, f"slope_rad is in radians, so this is {degrees} degrees; slope_deg takes degrees"))
    contact = config.contact
    if contact is not None and contact.terrain != "checkerboard" and not isinstance(contact.pad_pitch, str):
        text = f"contact.pad_pitch has no effect on {contact.terrain}, which has no pads"
        yield str(Problem(key_at(tree, ("contact", "pad_pitch")), f"{text}; only checkerboard has some"))
    for path, value in numbers(("walker",), walker.model_dump(mode="json")):
        key, text = str(path[-1]), f"{'.'.join(map(str, path))} is {short(value)}"
        if key.endswith("length_m") and value > LONG_M:
            yield str(Problem(key_at(tree, path), f"{text} m; lengths are in m, not in mm"))
        if key.endswith("mass_kg") and value > HEAVY_KG_M3 * walker.leg_length_m**3:
            yield str(Problem(key_at(tree, path), f"{text} kg on legs of {length} m; masses are in kg, not in g"))


def numbers(path: Location, value: Any) -> Iterator[tuple[Location, float]]:
    """The numbers in a block or list, with where they are."""
    if isinstance(value, dict | list):
        for name, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from numbers((*path, name), inner)
    elif isinstance(value, int | float):
        yield path, float(value)


MAX_CHANGE: Final = 80
KEPT_OF_A_LONG_CHANGE: Final = 56


def run_name(base: Config, changed: Config, slope_deg: float | None = None, run: str | None = None) -> str:
    """Name of the run folder of `changed`, which `--set` made of `base`: `name`, or `name@key=value,...`.

    The name follows from what differs and not from how the change was typed: one experiment, one folder.

    slope_deg  the slope as the user gave it, if in degrees
    run        the folder that `base` was taken from, which has perhaps a change in its name already
    """
    before, after = base.model_dump(mode="json"), changed.model_dump(mode="json")
    parts = []
    for name, field in Config.model_fields.items():
        block = block_of(field)
        if block is not None and before[name] is None and after[name] is not None:
            before[name] = block().model_dump(mode="json")
            parts.append(f"{name}=added")
    known = dict(flattened(before))
    differing = {key: value for key, value in flattened(after) if key not in known or known[key] != value}
    renamed = differing.pop("name", None)
    whole, _, earlier = (renamed or run or base.name).partition("@")
    if slope_deg is not None and "slope_rad" in differing:
        differing = {"slope_deg" if key == "slope_rad" else key: value for key, value in differing.items()}
        differing["slope_deg"] = slope_deg
    parts = [earlier] * bool(earlier) + parts + [f"{key}={_word(value)}" for key, value in differing.items()]
    change = ",".join(parts)
    if len(change) > MAX_CHANGE:
        digest = hashlib.sha256(change.encode()).hexdigest()[:12]
        change = f"{change[:KEPT_OF_A_LONG_CHANGE].rstrip('.,_=-')}-{digest}"
    return f"{whole}@{change}" if change else whole


def _word(value: Any) -> str:
    if isinstance(value, list):
        return "_".join(_word(item) for item in value) or "none"
    if isinstance(value, int | float):
        return short(value)
    return "none" if value is None else str(value)
