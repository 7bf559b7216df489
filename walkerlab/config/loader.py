"""From a file, `--set` and `--strides` to one typed config, its warnings and the name of its run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from walkerlab.config.files import DEFAULT, ConfigFile, builtin, find, read_layers, with_cases
from walkerlab.config.layers import parse_settings, stacked, strides_setting, with_settings
from walkerlab.config.overlay import refuse_bad_cases
from walkerlab.config.placing import on_the_slope
from walkerlab.config.run_name import run_name
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping, Position, Scalar
from walkerlab.config.validation import typed


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
    refuse_bad_cases(changed, changed_tree)
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
