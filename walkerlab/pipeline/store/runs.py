"""Runs: their folders, files and locks, and the configs and results in them."""

import contextlib
import datetime
import json
import os
import shlex
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from walkerlab.config import problems, schema, validation, writer
from walkerlab.config.files import SHOWN_PATH
from walkerlab.config.reader import read as read_text
from walkerlab.config.tree import BlockNode
from walkerlab.errors import ConfigError, LockedError
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Damaged, Stored, differences, indexed_files, read
from walkerlab.pipeline.store.files import (
    TEMPORARY,
    make_folder,
    read_bounded,
    remove_leftovers,
    storing,
    write_atomically,
)

RECORD = ".run.json"
LOCK = ".lock"
WORKER = ".worker.json"
RECORD_BYTES = 1 << 20
"""Maximum size of a run record."""


@dataclass(frozen=True)
class Record:
    """Name and config of a run. They are recorded in the folder, because a result may come from another run and hold
    the config of that run."""

    run: str  # name of the folder when the record was written
    source: str  # origin of the config, as in `RunFolder`
    config: str  # resolved config of the results, as YAML text
    changes: tuple[str, ...] = ()  # changes of the config, as in `RunFolder`


@dataclass(frozen=True)
class Holder:
    """Process that holds the lock of a run folder."""

    command: str  # its command line
    process: int
    since_utc: str  # ISO 8601

    def __str__(self) -> str:
        since = datetime.datetime.fromisoformat(self.since_utc).astimezone()
        return f"`{self.command}` (process {self.process}, since {since:%Y-%m-%d %H:%M:%S})"


@dataclass(frozen=True)
class RunFolder:
    """Folder runs/<name>/ of one run."""

    runs_dir: Path  # folder that holds all runs
    name: str  # name of the run, safe as a folder name
    source: str = ""  # origin of its config: a path relative to `runs_dir`, or a built-in config; empty if unknown
    changes: tuple[str, ...] = ()  # KEY=VALUE of each key in which the config differs from its source

    @classmethod
    def open_folder(cls, path: Path) -> "RunFolder":
        """Return the run in a folder, with its recorded source and changes."""
        # A path such as `.` shows the folder's name only after it is resolved.
        folder = path if path.name not in ("", "..") else path.resolve()
        record = cls(folder.parent, folder.name).record()
        if record is None:
            return cls(folder.parent, folder.name, "", changes_in(folder.name))
        return cls(folder.parent, folder.name, record.source, record.changes)

    @property
    def path(self) -> Path:
        return self.runs_dir / self.name

    @property
    def explicit_path(self) -> str:
        """Path of the folder in a form that cannot be mistaken for a run's name."""
        text = str(self.path)
        return text if os.sep in text else f".{os.sep}{text}"

    @property
    def quoted_path(self) -> str:
        return shlex.quote(self.explicit_path)

    @property
    def figures(self) -> Path:
        return self.path / "figures"

    def artifact(self, stage: str) -> Path:
        """Return the file of a stage's result."""
        return self.path / f"{stage}.h5"

    def checkpoint(self, stage: str) -> Path:
        """Return the checkpoint file of an incomplete result."""
        return self.path / f"{stage}.parts"

    def record(self) -> Record | None:
        """Read the run record, or return None if it is missing or unreadable."""
        try:
            entry = json.loads(read_bounded(self.path / RECORD, RECORD_BYTES))
            run = str(entry["run"])
            changes = entry.get("changes")
            listed = changes_in(run) if changes is None else tuple(map(str, changes))
            return Record(run, str(entry["source"]), str(entry["config"]), listed)
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
            return None

    def worker(self) -> Holder | None:
        """Return the process that works in the folder, or None if the folder is idle or the record is unreadable."""
        try:
            worker = Holder(**json.loads(read_bounded(self.path / WORKER, RECORD_BYTES)))
        except (OSError, ValueError, TypeError, RecursionError):
            return None
        # Imported here, because most folders lack this file and are not locked.
        from filelock import FileLock, Timeout

        # A killed process leaves its file, but not its lock.
        with contextlib.suppress(Timeout, OSError), FileLock(self.path / LOCK, timeout=0):
            return None
        return worker

    @contextlib.contextmanager
    def locked(self, wait: bool = True, say: Callable[[str], None] | None = None) -> Iterator[None]:
        """Hold the folder's lock, which the system releases when this process ends.

        Creates the folder if needed and removes leftovers of killed writers.

        wait  whether to wait for another process
        say   called with a message before waiting

        Raises LockedError if another process holds the lock and `wait` is false, StorageError if the folder or
        the lock file cannot be created.
        """
        # Imported here, because a run that reuses everything needs no lock.
        from filelock import FileLock, Timeout

        from walkerlab.pipeline.store.provenance import command_line, utc_now

        make_folder(self.path)
        lock = FileLock(self.path / LOCK)
        with storing(self.path / LOCK):
            try:
                lock.acquire(timeout=0)
            except Timeout:
                message = f"{self.worker() or 'another walkerlab process'} is working in {self.path}"
                if not wait:
                    advice = "Leave out --no-wait to wait for it, or choose another folder with --name NAME."
                    raise LockedError(f"{message}.", advice) from None
                if say is not None:
                    say(f"waiting: {message} (`--name NAME` chooses another folder)")
                lock.acquire()
        try:
            # While this process holds the lock, every temporary file is left over from a process that was killed.
            remove_leftovers(self.path)
            worker = Holder(command_line(), os.getpid(), utc_now())
            with contextlib.suppress(OSError):  # only messages of other processes need this file
                (self.path / WORKER).write_text(json.dumps(asdict(worker)), encoding="utf-8")
            yield
        finally:
            with contextlib.suppress(OSError):
                (self.path / WORKER).unlink()
            lock.release()


def changes_in(name: str) -> tuple[str, ...]:
    """Read the config changes (KEY=VALUE) from a folder's name, for folders without a record."""
    return tuple(filter(None, name.partition("@")[2].split(",")))


SWEEP = "sweep-"
"""Prefix of sweep files."""
SHOWN_CHANGES = 3
"""Maximum number of changed keys in a message."""


def config_text(folder: RunFolder) -> str | None:
    """Return the resolved config of a run as YAML, from its record or a readable result, or None if neither has it."""
    record = folder.record()
    if record is not None:
        return record.config
    origins = [stored.provenance for stored in read_all(folder, stored_in(folder))[0].values()]
    latest = max(origins, key=lambda origin: origin.ended_utc, default=None)
    return None if latest is None else latest.config


def stored_in(folder: RunFolder) -> list[str]:
    """Return the stages with a result file in a folder, readable or not."""
    return [path.stem for path in folder.path.glob("*.h5")]


def config_of(folder: RunFolder) -> schema.Config | None:
    """Return the config of a run, or None if it is unknown or this version's schema rejects it."""
    with contextlib.suppress(ConfigError):
        tree = read_text(config_text(folder) or "", "stored config")
        return validation.validate_tree(tree) if isinstance(tree, BlockNode) else None
    return None


def read_all(folder: RunFolder, stages: Iterable[str]) -> tuple[dict[str, Stored], dict[str, str]]:
    """Return the readable results of these stages, by stage, and a message for each unreadable one."""
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
    # The system refuses a path that is too long.
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
    near = problems.suggestion(Path(text).name, names) or (f" Available runs: {', '.join(names)}." if names else "")
    advice = "`walkerlab report` creates the run of the paper config."
    raise ConfigError(f"there is no run {problems.printable(text, SHOWN_PATH)}.{near}", advice)


def claim(folder: RunFolder, config: schema.Config) -> None:
    """Record in a folder which config its results belong to. Call this under the lock, before any result is written.

    Raises ConfigError as `refuse_another_config` does, and StorageError if the record cannot be written.
    """
    refuse_another_config(folder, config)
    record = folder.record()
    new_record = Record(folder.name, folder.source, writer.to_yaml(config), folder.changes)
    if record is None or (is_of_same_config_file(record, folder) and record != new_record):
        write_atomically(folder.path / RECORD, json.dumps(asdict(new_record), indent=1).encode())


def refuse_another_config(folder: RunFolder, config: schema.Config) -> None:
    """Raise ConfigError if a folder has results of another config, unless that is an earlier version of the same file.

    The name and the `sweep` block are not compared, since no result depends on them.
    """
    record = folder.record()
    if (record is not None and is_of_same_config_file(record, folder)) or not any(folder.path.glob("*.h5")):
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


def is_of_same_config_file(record: Record, folder: RunFolder) -> bool:
    """Whether a record names the same config file and run as a folder. The file may have been edited since."""
    return (record.run, record.source) == (folder.name, folder.source)


DRAWN = ("figures/figure-*.svg", "figures/figure-*.png", "report.html", "report-*.html")
"""Patterns of the files that drawing stages write, in case the index of these files is lost."""
CHUNKS = "sweep-chunks"
FIGURES_FOLDER = "figures"
UNFINISHED = (TEMPORARY, f"{FIGURES_FOLDER}/{TEMPORARY}", f"{CHUNKS}/{TEMPORARY}")
SWEPT = ("sweep-*.h5", "sweep-*.csv", f"{CHUNKS}/*.h5", "sweep.html", "figures/sweep-*.svg", "figures/sweep-*.png")
STATE_FILES = (RECORD, LOCK, WORKER)
STATE_ENDINGS = (".h5", ".parts")
COMPARED = ("figures/diff-*.svg", "figures/diff-*.png")


def files_of(folder: RunFolder, stages: Iterable[str]) -> list[Path]:
    """Return the files of a run that exist: results of these stages, drawings, sweeps, and leftovers of killed
    writers."""
    files = {path for pattern in (*DRAWN, *SWEPT, *COMPARED, *UNFINISHED) for path in folder.path.glob(pattern)}
    inside = folder.path.resolve()
    for stage in stages:
        files |= {folder.artifact(stage), folder.checkpoint(stage)}
        with contextlib.suppress(OSError, Damaged):
            listed = indexed_files(read(folder.artifact(stage)))
            # A file from somebody else could list files outside the folder, and `clean` would remove them.
            files |= {folder.path / name for name in listed if (inside / name).resolve().is_relative_to(inside)}
    return sorted(path for path in files if path.is_file() or path.is_symlink())


def owner_of(path: Path, stages: Iterable[str]) -> RunFolder | None:
    """Return the run to which a result, drawing or record belongs, or None for any other file, which is the user's."""
    resolved = path.resolve()
    # Results are in the run's folder, and drawings in a folder below it.
    for place in (resolved.parent, resolved.parent.parent):
        folder = RunFolder.open_folder(place)
        if folder.record() is None and not any(place.glob("*.h5")):
            continue
        is_state = resolved.parent == place and (resolved.suffix in STATE_ENDINGS or resolved.name in STATE_FILES)
        if is_state or resolved in {file.resolve() for file in files_of(folder, stages)}:
            return folder
    return None


def remove(folder: RunFolder, files: Iterable[Path]) -> None:
    """Remove files of a run folder, its record and its empty subfolders. Call this under the lock.

    Raises StorageError if a file cannot be removed.
    """
    for path in (*files, folder.path / RECORD):
        with storing(path):
            path.unlink(missing_ok=True)
    for emptied in (folder.figures, folder.path / CHUNKS):
        with contextlib.suppress(OSError):
            emptied.rmdir()


def remove_if_empty(folder: RunFolder) -> None:
    """Remove a run folder that holds only its lock. Call this after releasing the lock."""
    lock = folder.path / LOCK
    if list(folder.path.iterdir()) == [lock]:
        with contextlib.suppress(OSError):
            lock.unlink()
            folder.path.rmdir()
