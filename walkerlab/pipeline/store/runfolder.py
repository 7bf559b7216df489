"""Folder of a run: its files and the lock under which they are written."""

from __future__ import annotations

import contextlib
import datetime
import json
import os
import shlex
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from walkerlab.errors import LockedError
from walkerlab.pipeline.store.files import make_folder, read_bounded, remove_leftovers, storing, write_atomically

RECORD = ".run.json"
LOCK = ".lock"
WORKER = ".worker.json"
RECORD_BYTES = 1 << 20
"""Maximum size of a run record."""


@dataclass(frozen=True)
class Record:
    """Name and config of a folder's run. Results that were taken over from another run hold that run's config."""

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

    runs_dir: Path  # the folder of all runs
    name: str  # name of the run, safe as a folder name
    source: str = ""  # origin of its config: a path relative to `runs_dir`, or a built-in config; empty if unknown
    changes: tuple[str, ...] = ()  # KEY=VALUE of each key in which the config differs from its source

    @classmethod
    def open_folder(cls, path: Path) -> RunFolder:
        """Return the run in a folder, with its recorded source and changes."""
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

    def write_record(self, record: Record) -> None:
        """Write the run record.

        Raises StorageError if that fails.
        """
        write_atomically(self.path / RECORD, json.dumps(asdict(record), indent=1).encode())

    def worker(self) -> Holder | None:
        """Return the process that works in the folder, or None if there is none, or if its command is unknown."""
        try:
            worker = Holder(**json.loads(read_bounded(self.path / WORKER, RECORD_BYTES)))
        except (OSError, ValueError, TypeError, RecursionError):
            return None
        # Imported here: a folder without this file is not locked.
        from filelock import FileLock, Timeout

        # A killed process leaves its file, but not its lock.
        with contextlib.suppress(Timeout, OSError), FileLock(self.path / LOCK, timeout=0):
            return None
        return worker

    @contextlib.contextmanager
    def locked(self, wait: bool = True, say: Callable[[str], None] | None = None) -> Iterator[None]:
        """Hold the folder's lock, which the system releases when this process ends.

        Creates the folder if needed and removes leftovers of killed writers.

        wait  whether to wait for another process; `say` is then called with a message

        Raises LockedError if another process holds the lock and `wait` is false, StorageError if the folder or
        the lock file cannot be created.
        """
        # Imported here: a run that reuses everything needs no lock.
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
