"""From a file, `--set` and `--strides` to one typed config, its warnings and the name of its run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from walkerlab.config.files import DEFAULT, ConfigFile, builtin, find, read_layers, with_cases
from walkerlab.config.layers import Setting, parse_settings, stacked, strides_setting, with_settings
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


@dataclass(frozen=True, slots=True)
class Template:
    """A config that is read but not yet typed, of which many variants are made.

    base   the config as it is
    tree   what it was typed from
    """

    base: LoadedConfig
    tree: Mapping

    def variant(self, settings: Sequence[Setting]) -> Config:
        """The config with some keys set, checked by the schema; ConfigError with the places of what is wrong."""
        tree = with_settings(self.tree, settings)
        return on_the_slope(typed(tree), tree)[0]


def load(path: Path | None = None, sets: Sequence[str] = (), strides: int | None = None) -> LoadedConfig:
    """Load a config.

    path     of a YAML file, or the name of a built-in config; None is the built-in paper config
    sets     `--set` options, KEY=VALUE, in order
    strides  `--strides`, over everything else

    Raises ConfigError with file, line, column, value, what is allowed and the nearest key of every problem.
    """
    return template(path, sets, strides).base


def template(path: Path | None = None, sets: Sequence[str] = (), strides: int | None = None) -> Template:
    """The same config as `load` gives, ready to be varied; raises ConfigError as that."""
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
    name = run_name(base, changed, _degrees(changed_tree))
    return Template(LoadedConfig(config, name, warnings, file.label), changed_tree)


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
