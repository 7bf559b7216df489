"""Resolve a `--config` argument to a config and the folder of its run."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from walkerlab.config import files, loader, problems, reads, schema, walkers
from walkerlab.errors import ConfigError
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Damaged, brief
from walkerlab.pipeline.store.runs import SHOWN_CHANGES, RunFolder, config_text, find_run, read_all, stored_in

SUFFIX = ".h5"
BUILTIN = "built-in "
"""Prefix that marks the source of a run as a built-in config."""


@dataclass(frozen=True)
class ResolvedRun:
    """A loaded config and its run folder."""

    loaded: loader.LoadedConfig
    folder: RunFolder
    extends: str  # file or built-in name in the `extends` of new configs with results of this run


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
    path = None if text is None else Path(text)
    run = None
    if text is not None and not files.is_config(text):
        run = artifact_at(Path(text)) or run_at(text, runs)
    if run is not None:
        folder, earlier = run
        read = loader.load(earlier, sets, strides, name)
        runs = folder.runs_dir
        source = folder.source
    else:
        read = loader.load(path, sets, strides, name)
        source = source_of(path, runs)
    refuse_invalid_parts(read)
    for stage in PIPELINE.stages:
        stage.checks(read.config)
    changes = [*sets, *([] if strides is None else [f"strides={strides}"])]
    # A name that the user chose does not show the changes, so the source must. Otherwise, results of another config
    # in that folder would seem to belong to this one.
    if name is not None and changes:
        source += f" with {', '.join(changes)}"
    return ResolvedRun(read, RunFolder(runs, read.run_name, source, read.changes), files.config_to_extend(text))


def edits_since(config: schema.Config, folder: RunFolder) -> tuple[str, list[str]]:
    """Return the file of a run's config and, in the form KEY OLD -> NEW, the changes made in it since the run.

    Keys that were set when the run was made are not compared.
    """
    source = folder.source.partition(" with ")[0]
    is_builtin = source.startswith(BUILTIN)
    path = files.BUILTIN_FOLDER / source.removeprefix(BUILTIN) if is_builtin else folder.runs_dir / source
    file = files.ConfigFile(path, source if is_builtin else os.path.relpath(path))
    if not source:
        return "", []
    if not files.is_file(path):
        return file.label, ["it is no longer there"]
    try:
        edited = loader.load(file).config
    except ConfigError:
        return file.label, ["it is no longer valid"]
    changed_keys = {loader.key_of(change) for change in folder.changes}
    # Setting slope_deg changes slope_rad, and setting any key may change angles of the start.
    changed_keys |= {"slope_rad", "start"} if changed_keys else set()
    dumps = (each.model_dump(mode="json", exclude={"name", "sweep"}) for each in (config, edited))
    before, after = (dict(reads.flatten(dump)) for dump in dumps)
    return file.label, [
        f"{key} {brief(value)} -> {brief(after.get(key))}"
        for key, value in before.items()
        if after.get(key) != value and changed_keys.isdisjoint((key, key.partition(".")[0]))
    ]


def warn_of_edits(config: schema.Config | None, folder: RunFolder, warn: Callable[[str], None]) -> None:
    """Warn if the config file of a run was edited after the run. `config` is the config of the run, or None
    if it cannot be read."""
    if config is None:
        return
    file, edits = edits_since(config, folder)
    if edits:
        more = ", ..." if len(edits) > SHOWN_CHANGES else ""
        warn(
            f"{file} has changed since {folder.path} was computed ({', '.join(edits[:SHOWN_CHANGES])}{more}). The "
            "run is exported as it was computed. Give the file itself to compute the edited config."
        )


def refuse_invalid_parts(read: loader.LoadedConfig) -> None:
    """Raise ConfigError, with a position in the file, if the parts listed in a config do not form a walker."""
    if not isinstance(read.config.walker, walkers.AssembledWalker):
        return
    # Imported here, because importing the mechanics takes long, and only walkers of parts can be invalid here.
    from walkerlab.scene.rigid import level_walker

    try:
        level_walker(read.config.walker, read.config.gravity_m_s2)
    except ConfigError as error:
        raise problems.problem_error(read.tree.entries["walker"].position, error.message, advice=error.advice) from None


def artifact_at(path: Path) -> tuple[RunFolder, files.ConfigFile] | None:
    """Return the run of an artifact and the config stored in it, or None if there is no such file."""
    if path.suffix != SUFFIX or not files.is_file(path):
        return None
    folder = RunFolder.open_folder(path.parent)
    try:
        stored = artifact.read(path)
    except Damaged as error:
        advice = f"Use the config of its folder: `-c {folder.quoted_path}`."
        raise ConfigError(f"{path} is damaged, and no config can be taken from it: {error}.", advice) from None
    return folder, files.ConfigFile(Path(folder.name), str(path), stored.provenance.config, folder.changes)


def run_at(text: str, runs: Path) -> tuple[RunFolder, files.ConfigFile] | None:
    """Return the run whose name or folder is `text`, and its config, or None if there is no such run."""
    folder = find_run(text, runs)
    if folder is None:
        return None
    config = config_text(folder)
    if config is None:
        bad = "".join(f" {reason}." for reason in read_all(folder, stored_in(folder))[1].values())
        raise ConfigError(
            f"{folder.path} has no result to take a config from.{bad}", "Give a run folder, an artifact or a file."
        )
    return folder, files.ConfigFile(Path(folder.name), str(folder.path), config, folder.changes)


def source_of(path: Path | None, runs: Path) -> str:
    """Return the source of a config: a built-in name, or a path relative to the folder of all runs.

    The path is relative so that a project can be moved together with its runs.
    """
    file = files.find_config(path).path.resolve()
    if file.parent == files.BUILTIN_FOLDER.resolve():
        return f"{BUILTIN}{file.name}"
    return os.path.relpath(file, runs.resolve())
