"""A run's own config, read back from its artifacts."""

from __future__ import annotations

from pathlib import Path

from walkerlab.config.loader import EarlierRun
from walkerlab.errors import ConfigError, StaleError
from walkerlab.store.artifact import Damaged, Stored, read

SUFFIX = ".h5"


def run_at(path: Path | None) -> EarlierRun | None:
    """The run whose folder or artifact a path is; None if it is neither. Raises ConfigError if it cannot be read."""
    if path is None:
        return None
    if path.is_dir():
        return of_folder(path)
    if path.suffix == SUFFIX and path.is_file():
        return EarlierRun(artifact_at(path).provenance.config, path.resolve().parent.name, str(path))
    return None


def of_folder(folder: Path) -> EarlierRun:
    """The run of a folder: the config of the artifact that was made last; ConfigError if it has none."""
    made = [stored for path in sorted(folder.glob(f"*{SUFFIX}")) if (stored := intact(path)) is not None]
    if not made:
        raise ConfigError(f"{folder} has no result to take a config from.", "Give a run folder, an artifact or a file.")
    last = max(made, key=lambda stored: stored.provenance.ended_utc)
    return EarlierRun(last.provenance.config, folder.resolve().name, str(folder))


def intact(path: Path) -> Stored | None:
    """The artifact at a path; None if it is not to be trusted."""
    try:
        return read(path)
    except (Damaged, OSError):
        return None


def artifact_at(path: Path) -> Stored:
    """The artifact at a path; StaleError in words if there is none, or it is damaged."""
    try:
        return read(path)
    except FileNotFoundError:
        raise StaleError(f"there is no artifact {path}.", "`walkerlab status` lists those of a run.") from None
    except (Damaged, OSError) as error:
        raise StaleError(f"{path} is damaged: {error}.", "Run its stage again.") from None
