"""From a file, `--set` and `--strides` to one typed config, its warnings and the name of its run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from walkerlab.config.files import ConfigFile, builtin, find, read_layers, with_cases
from walkerlab.config.layers import parse_settings, stacked, strides_setting, with_settings
from walkerlab.config.numbers import short
from walkerlab.config.run_name import run_name
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping, Position, Scalar
from walkerlab.config.validation import typed

DEFAULT: Final = "paper"
MOVED_RAD: Final = 1e-12


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


def load(path: Path | None = None, sets: Sequence[str] = (), strides: int | None = None) -> LoadedConfig:
    """Load a config.

    path     of a YAML file, or the name of a built-in config; None is the built-in paper config
    sets     `--set` options, KEY=VALUE, in order
    strides  `--strides`, over everything else

    Raises ConfigError with file, line, column, value, what is allowed and the nearest key of every problem.
    """
    file = builtin(DEFAULT) if path is None else find(path)
    tree = _named(stacked(read_layers(file)), file)
    settings = parse_settings(sets)
    if strides is not None:
        settings.append(strides_setting(strides))
    changed_tree = with_cases(with_settings(tree, settings), Path())
    changed = typed(changed_tree)
    base = typed(tree) if settings else changed
    config, warnings = on_the_slope(changed, changed_tree)
    return LoadedConfig(config, run_name(base, changed, _degrees(changed_tree)), warnings, file.label)


def _named(tree: Mapping, file: ConfigFile) -> Mapping:
    """`tree` with the file's own name, unless it has another."""
    if "name" in tree.entries:
        return tree
    named = tree.without()
    start = Position(file.label, 1, 1)
    named.put("name", Scalar(start, file.path.stem, file.path.stem), start)
    return named


def _degrees(tree: Mapping) -> float | None:
    node = tree.entries.get("slope_deg")
    return float(node.value) if isinstance(node, Scalar) and isinstance(node.value, int | float) else None


def on_the_slope(config: Config, tree: Mapping) -> tuple[Config, tuple[str, ...]]:
    """`config` with theta_1 of its start such that both feet stand on the slope, theta_1 + theta_2 = -2 phi."""
    if isinstance(config.start, str):
        return config, ()
    given, stance, *rates = config.start
    swing = -2 * config.slope_rad - stance
    placed = config.model_copy(update={"start": (swing, stance, *rates)})
    if abs(swing - given) <= MOVED_RAD:
        return placed, ()
    moved = (
        f"{tree.entries['start'].position}: start: theta_1 moved from {short(given)} to {short(swing)} rad, "
        f"so that both feet stand on the slope of {short(config.slope_rad)} rad"
    )
    return placed, (moved,)
