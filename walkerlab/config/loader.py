"""From a file, `--set` and `--strides` to one typed config, its warnings and the name of its run."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from walkerlab.config.files import DEFAULT, ConfigFile, builtin, find, read_layers, with_cases
from walkerlab.config.layers import ConfigSetting, option_setting, parse_settings, stacked, with_settings
from walkerlab.config.numbers import short
from walkerlab.config.overlay import refuse_bad_cases
from walkerlab.config.placing import on_the_slope
from walkerlab.config.run_name import run_name
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping, Position, Scalar
from walkerlab.config.validation import typed
from walkerlab.config.walkers import CompassWalker

STEEP_RAD: Final = 0.5
"""No passive walker is known to walk on a slope as steep; a number above it is perhaps in degrees."""
HEAVY_KG_M3: Final = 1000.0
"""A mass above that of a cube of water as wide as the legs are long is perhaps in grams."""


@dataclass(frozen=True, slots=True)
class LoadedConfig:
    """A config that is ready to run.

    config    resolved, in the schema's types
    run_name  name of its folder below the runs folder
    warnings  what was changed in it, in words
    source    the file it is from
    """

    config: Config
    run_name: str
    warnings: tuple[str, ...]
    source: str


@dataclass(frozen=True, slots=True)
class EarlierRun:
    """A run that a config is taken from.

    text   its resolved config
    name   of its folder, in which the same config runs again
    label  as messages name it
    """

    text: str
    name: str
    label: str


@dataclass(frozen=True, slots=True)
class Template:
    """A config that is read but not yet typed, of which many variants are made.

    base   the config as it is
    tree   what it was typed from
    """

    base: LoadedConfig
    tree: Mapping

    def variant(self, settings: Sequence[ConfigSetting]) -> Config:
        """The config with some keys set, checked by the schema; ConfigError with the places of what is wrong."""
        tree = with_settings(self.tree, settings)
        return on_the_slope(typed(tree), tree)[0]


def load(
    path: Path | None = None, sets: Sequence[str] = (), strides: int | None = None, run: EarlierRun | None = None
) -> LoadedConfig:
    """Load a config.

    path     of a YAML file, or the name of a built-in config; None is the built-in paper config
    sets     `--set` options, KEY=VALUE, in order
    strides  `--strides`, over everything else
    run      whose config it is, instead of a file's

    Raises ConfigError with file, line, column, value, what is allowed and the nearest key of every problem.
    """
    return template(path, sets, strides, run).base


def template(
    path: Path | None = None,
    sets: Sequence[str] = (),
    strides: int | None = None,
    run: EarlierRun | None = None,
    name: str | None = None,
) -> Template:
    """The same config as `load` gives, ready to be varied; raises ConfigError as that.

    name  `--name`, over the config's own; None leaves that
    """
    if run is not None:
        file = ConfigFile(Path(run.name), run.label, run.text)
    else:
        file = builtin(DEFAULT) if path is None else find(path)
    tree = _named(stacked(read_layers(file)), file)
    settings = parse_settings(sets)
    options = {"strides": strides, "name": name}
    settings += [option_setting(key, value) for key, value in options.items() if value is not None]
    changed_tree = with_cases(with_settings(tree, settings), Path())
    changed = typed(changed_tree)
    base = typed(tree) if settings else changed
    refuse_bad_cases(changed, changed_tree)
    config, warnings = on_the_slope(changed, changed_tree)
    slope = changed_tree.entries.get("slope_deg")
    degrees = float(slope.value) if isinstance(slope, Scalar) and isinstance(slope.value, int | float) else None
    folder = name or run_name(base, changed, degrees, None if run is None else run.name)
    own = (*_renamed(tree, file), *_left_behind(config, changed_tree), *_in_other_units(config, changed_tree))
    warnings = (*own, *warnings)
    return Template(LoadedConfig(config, folder, warnings, file.label), changed_tree)


def safe_name(text: str) -> str:
    """A text as the name of a run folder: accents, blanks and what else such a name cannot have replaced."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.")[:64].rstrip(".") or "run"


def _named(tree: Mapping, file: ConfigFile) -> Mapping:
    """`tree` with the file's own name, unless it has another."""
    if "name" in tree.entries:
        return tree
    named = tree.without()
    start, name = Position(file.label, 1, 1), safe_name(file.path.stem)
    named.put("name", Scalar(start, name, name), start)
    return named


def _renamed(tree: Mapping, file: ConfigFile) -> tuple[str, ...]:
    """That the run cannot have the file's own name, if so."""
    name = tree.entries["name"]
    if not isinstance(name, Scalar) or name.position != Position(file.label, 1, 1) or name.value == file.path.stem:
        return ()
    return (f"{file.label}: the run is named {name.value}, since a run folder cannot be named as the file is",)


def _in_other_units(config: Config, tree: Mapping) -> tuple[str, ...]:
    """That a slope is perhaps meant in degrees, and masses in grams."""
    found = []
    slope = tree.keys.get("slope_rad")
    if slope is not None and abs(config.slope_rad) > STEEP_RAD:
        degrees = short(round(math.degrees(config.slope_rad), 1))
        found.append(f"{slope}: slope_rad is in radians, so this is {degrees} degrees; slope_deg takes degrees")
    block = tree.entries.get("walker")
    places = block.keys if isinstance(block, Mapping) else {}
    heavy = HEAVY_KG_M3 * config.walker.leg_length_m**3
    for key, mass in masses("walker", config.walker.model_dump(mode="json")):
        if mass > heavy:
            given = places.get(key.split(".")[1], tree.position)
            legs = f"legs of {short(config.walker.leg_length_m)} m"
            found.append(f"{given}: {key} is {short(mass)} kg on {legs}; masses are in kg, not in g")
    return tuple(found)


def masses(key: str, value: Any) -> Iterator[tuple[str, float]]:
    """The masses (kg) in a block, with their keys."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from masses(f"{key}.{name}", inner)
    elif isinstance(value, list):
        for place, inner in enumerate(value):
            yield from masses(f"{key}.{place}", inner)
    elif key.endswith("mass_kg") and isinstance(value, int | float):
        yield key, float(value)


def _left_behind(config: Config, tree: Mapping) -> tuple[str, ...]:
    """That a leg was given another length than the config beneath has, and its mass stays where that puts it."""
    walker, block = config.walker, tree.entries.get("walker")
    if not isinstance(walker, CompassWalker) or not isinstance(block, Mapping):
        return ()
    leg, mass = block.keys.get("leg_length_m"), block.keys.get("foot_to_mass_m")
    if leg is None or mass is None or leg.source == mass.source or walker.foot_to_mass_m == walker.leg_length_m / 2:
        return ()
    return (
        f"{leg}: walker.leg_length_m is {short(walker.leg_length_m)} m, and walker.foot_to_mass_m stays "
        f"{short(walker.foot_to_mass_m)} m, as {mass.source} has it: the mass is not in the middle of the leg",
    )
