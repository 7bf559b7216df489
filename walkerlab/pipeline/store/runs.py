"""Runs: find their folders, read their configs and results, and claim a folder for a config."""

import contextlib
from collections.abc import Iterable
from pathlib import Path

from walkerlab.config.files import SHOWN_PATH
from walkerlab.config.problems import printable, suggestion
from walkerlab.config.reader import read as read_text
from walkerlab.config.schema import Config
from walkerlab.config.tree import BlockNode
from walkerlab.config.validation import validate_tree
from walkerlab.config.writer import to_yaml
from walkerlab.errors import ConfigError
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.pipeline.store.key import differences
from walkerlab.pipeline.store.runfolder import Record, RunFolder

SWEEP = "sweep-"
"""Prefix of sweep files."""
SHOWN_CHANGES = 3
"""Maximum number of changed keys in a message."""


def config_text(folder: RunFolder) -> str | None:
    """Return the resolved config of a run as YAML, or None if neither its record nor a readable result contains it."""
    record = folder.record()
    if record is not None:
        return record.config
    origins = [stored.provenance for stored in read_all(folder, stored_in(folder))[0].values()]
    latest = max(origins, key=lambda origin: origin.ended_utc, default=None)
    return None if latest is None else latest.config


def stored_in(folder: RunFolder) -> list[str]:
    """Return the stages with a result file in a folder, readable or not."""
    return [path.stem for path in folder.path.glob("*.h5")]


def config_of(folder: RunFolder) -> Config | None:
    """Return the config of a run, or None if it is unknown or this version's schema rejects it."""
    try:
        tree = read_text(config_text(folder) or "", "stored config")
        return validate_tree(tree) if isinstance(tree, BlockNode) else None
    except ConfigError:
        return None


def read_all(folder: RunFolder, stages: Iterable[str]) -> tuple[dict[str, Stored], dict[str, str]]:
    """Return the readable results of these stages, and a message for each unreadable one, by stage."""
    intact: dict[str, Stored] = {}
    bad: dict[str, str] = {}
    for stage in stages:
        path = folder.artifact(stage)
        verdict = artifact.check(path, stage=None if stage.startswith(SWEEP) else stage)
        if verdict.artifact is not None:
            intact[stage] = verdict.artifact
        elif verdict.reason != artifact.NOT_THERE:
            bad[stage] = f"{path} {'is' if verdict.damaged else 'cannot be read:'} {verdict.reason}"
    return intact, bad


def find_run(text: str, runs_dir: Path) -> RunFolder | None:
    """Find a run by its name in the folder of all runs, or by its path, or return None if it does not exist."""
    path = Path(text)
    is_name = path.name == text and text != ".."
    places = (runs_dir / path, path) if is_name else (path,)
    # the system refuses a path that is too long
    with contextlib.suppress(OSError):
        return next((RunFolder.open_folder(place) for place in places if place.is_dir()), None)
    return None


def run_named(text: str, runs_dir: Path) -> RunFolder:
    """Find a run by its name in the folder of all runs, or by its path.

    Raises ConfigError if it does not exist.
    """
    run = find_run(text, runs_dir)
    if run is not None:
        return run
    names = sorted(path.name for path in runs_dir.glob("*/"))
    near = suggestion(Path(text).name, names) or (f" Available runs: {', '.join(names)}." if names else "")
    raise ConfigError(
        f"there is no run {printable(text, SHOWN_PATH)}.{near}",
        "`walkerlab report` creates the run of the paper config.",
    )


def claim(folder: RunFolder, config: Config) -> None:
    """Record in a folder which config its results belong to, and call it under the lock, before any result is written.

    Raises ConfigError as `refuse_another_config` does.
    """
    refuse_another_config(folder, config)
    record = folder.record()
    new_record = Record(folder.name, folder.source, to_yaml(config), folder.changes)
    if record is None or (comes_from(record, folder) and record != new_record):
        folder.write_record(new_record)


def refuse_another_config(folder: RunFolder, config: Config) -> None:
    """Raise ConfigError if a folder has results of another config, unless it is an earlier state of the same file.

    The name and the `sweep` block are not compared, since no result depends on them.
    """
    record = folder.record()
    if (record is not None and comes_from(record, folder)) or not any(folder.path.glob("*.h5")):
        return
    recorded = config_of(folder)
    if recorded is None and record is None:  # nothing in the folder can be read
        return
    changes = ["its config is no longer valid"]
    if recorded is not None:
        compared = (each.model_dump(mode="json", exclude={"name", "sweep"}) for each in (recorded, config))
        changes = list(differences("", *compared))
    if changes:
        origin = f", made from {record.source}" if record is not None and record.source else ""
        more = ", …" if len(changes) > SHOWN_CHANGES else ""
        raise ConfigError(
            f"{folder.path} has results of another config{origin}; they are not overwritten "
            f"({', '.join(changes[:SHOWN_CHANGES])}{more}).",
            "`--name NAME` gives this one a folder of its own; "
            f"`walkerlab clean -c {folder.quoted_path}` removes those results.",
        )


def comes_from(record: Record, folder: RunFolder) -> bool:
    """Whether a folder's results come from the same config file and run name, even if the file was edited since."""
    return (record.run, record.source) == (folder.name, folder.source)
