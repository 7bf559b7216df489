"""Resolve a `--config` argument to a config and the folder of its run."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from walkerlab.config.files import (
    BUILTIN_FOLDER,
    DEFAULT,
    ConfigFile,
    builtin_config,
    builtin_names,
    config_to_extend,
    find_config,
)
from walkerlab.config.loader import LoadedConfig, load
from walkerlab.config.problems import problem_error
from walkerlab.config.walkers import PartsWalker
from walkerlab.errors import ConfigError
from walkerlab.pipeline.runs import config_text, find_run, read_all, stored_in
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Damaged
from walkerlab.pipeline.store.runfolder import RunFolder

SUFFIX = ".h5"


@dataclass(frozen=True)
class ResolvedRun:
    """A loaded config and its run folder."""

    loaded: LoadedConfig
    folder: RunFolder
    extends: str  # config that a new one, written from this run's results, extends: a file or a built-in name


def resolve(
    text: str | None,
    sets: Sequence[str] = (),
    strides: int | None = None,
    runs: Path = Path("runs"),
    name: str | None = None,
) -> ResolvedRun:
    """Resolve `--config`: a file, a built-in config, or a run by its name, its folder or one of its artifacts.

    text     value of `--config`; None for the built-in paper config
    sets     `--set` options, KEY=VALUE, in order
    strides  value of `--strides`, which overrides everything else
    runs     folder of all runs; a run given by its path stays where it is
    name     name of the run's folder; None to derive it from the settings

    Raises ConfigError if `text` matches nothing or the config is invalid.
    """
    path, run = None if text is None else Path(text), None
    if path is not None and text not in builtin_names() and not (path.is_file() and path.suffix != SUFFIX):
        run = artifact_at(path) or run_at(str(text), runs)
    if run is not None:
        folder, earlier = run
        read, runs, source = load(earlier, sets, strides, name), folder.runs_dir, folder.source
    else:
        read, source = load(path, sets, strides, name), source_of(path, runs)
    refuse_what_makes_no_walker(read)
    changes = [*sets, *([] if strides is None else [f"strides={strides}"])]
    if name is not None and changes:
        source += f" with {', '.join(changes)}"
    return ResolvedRun(read, RunFolder(runs, read.run_name, source, read.changes), config_to_extend(text))


def refuse_what_makes_no_walker(read: LoadedConfig) -> None:
    """Raise ConfigError, with a position in the file, if the parts listed in a config do not form a walker."""
    config = read.config
    if not isinstance(config.walker, PartsWalker):
        return
    # Imported here: mechanics take long to import, and walkers of other types are valid by construction.
    from walkerlab.scene.rigid import level_walker

    try:
        level_walker(config.walker, config.gravity_m_s2)
    except ConfigError as error:
        raise problem_error(read.tree.entries["walker"].position, error.message, advice=error.advice) from None


def artifact_at(path: Path) -> tuple[RunFolder, ConfigFile] | None:
    """Return the run of an artifact and the config stored in it; None if there is no such file."""
    if path.suffix != SUFFIX or not path.is_file():
        return None
    folder = RunFolder.at(path.parent)
    try:
        stored = artifact.read(path)
    except Damaged as error:
        raise ConfigError(
            f"{path} is damaged, and no config can be taken from it: {error}.",
            f"Use the config of its folder: `-c {folder.quoted_path}`.",
        ) from None
    return folder, ConfigFile(Path(folder.name), str(path), stored.provenance.config, folder.changes)


def run_at(text: str, runs: Path) -> tuple[RunFolder, ConfigFile] | None:
    """Return the run with this name or folder, and its config; None if there is no such run."""
    folder = find_run(text, runs)
    if folder is None:
        return None
    config = config_text(folder)
    if config is None:
        bad = "".join(f" {why}." for why in read_all(folder, stored_in(folder))[1].values())
        raise ConfigError(
            f"{folder.path} has no result to take a config from.{bad}", "Give a run folder, an artifact or a file."
        )
    return folder, ConfigFile(Path(folder.name), str(folder.path), config, folder.changes)


def source_of(path: Path | None, runs: Path) -> str:
    """Return the source of a config: a built-in name, or a path relative to the folder of all runs.

    The path is relative so that a project can be moved together with its runs.
    """
    file = (builtin_config(DEFAULT) if path is None else find_config(path)).path.resolve()
    if file.parent == BUILTIN_FOLDER.resolve():
        return f"built-in {file.name}"
    return os.path.relpath(file, runs.resolve())
