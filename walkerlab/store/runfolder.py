"""The folder of a run: where its files are, and the lock under which they are written."""

from __future__ import annotations

import contextlib
import json
import os
import shlex
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from walkerlab.errors import LockedError
from walkerlab.store.files import make_folder, read_bounded, remove_leftovers, storing, write_atomically

RECORD, LOCK = ".run.json", ".lock"
RECORD_BYTES = 1 << 20
"""No record is larger."""


@dataclass(frozen=True)
class Record:
    """What a run folder says of its results; a result that was taken over names the run that it was made in.

    run      the folder's name when it was written
    source   where the config is from, as in `RunFolder`
    config   that they were asked for with, resolved, as YAML text
    changes  as in `RunFolder`
    """

    run: str
    source: str
    config: str
    changes: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunFolder:
    """runs/<name>/ of one run.

    runs_dir  the folder of all runs
    name      of the run; path-safe
    source    where its config is from: a file as seen from `runs_dir`, or a built-in one; empty if unknown
    changes   KEY=VALUE of each key in which the config differs from that file
    """

    runs_dir: Path
    name: str
    source: str = ""
    changes: tuple[str, ...] = ()

    @classmethod
    def at(cls, path: Path) -> RunFolder:
        """The run in a folder; source and changes are those that it was written with."""
        whole = path if path.name not in ("", "..") else path.resolve()
        record = cls(whole.parent, whole.name).record()
        if record is None:
            return cls(whole.parent, whole.name, "", changes_in(whole.name))
        return cls(whole.parent, whole.name, record.source, record.changes)

    @property
    def path(self) -> Path:
        """The folder."""
        return self.runs_dir / self.name

    @property
    def given(self) -> str:
        """The folder as a path that is not taken for a name."""
        text = str(self.path)
        return text if os.sep in text else f".{os.sep}{text}"

    @property
    def typed(self) -> str:
        """The same as it is typed in a shell."""
        return shlex.quote(self.given)

    @property
    def figures(self) -> Path:
        """The folder of its figures."""
        return self.path / "figures"

    def artifact(self, stage: str) -> Path:
        """The file of a stage's result."""
        return self.path / f"{stage}.h5"

    def checkpoint(self, stage: str) -> Path:
        """The file of what was computed of a stage's result until it is complete."""
        return self.path / f"{stage}.parts"

    def record(self) -> Record | None:
        """What the folder says of its results; None if it says nothing that can be read."""
        try:
            said = json.loads(read_bounded(self.path / RECORD, RECORD_BYTES))
            run, changes = str(said["run"]), said.get("changes")
            listed = changes_in(run) if changes is None else tuple(map(str, changes))
            return Record(run, str(said["source"]), str(said["config"]), listed)
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
            return None

    def write_record(self, record: Record) -> None:
        """Have the folder say this of its results from now on; StorageError if the system refuses."""
        write_atomically(self.path / RECORD, json.dumps(asdict(record), indent=1).encode())

    @contextlib.contextmanager
    def locked(self, wait: bool = True, say: Callable[[str], None] | None = None) -> Iterator[None]:
        """Hold the folder's lock, which the system takes back when this process ends, in whatever way.

        The folder is made if need be, and cleared of what killed writers left.

        wait  whether to wait for another process; if so, `say` is told what is being waited for

        Raises LockedError if another process holds the lock and `wait` is false, StorageError if the folder or
        the lock's file cannot be made.
        """
        # Imported here: a run that reuses everything takes no lock.
        from filelock import FileLock, Timeout

        make_folder(self.path)
        lock = FileLock(self.path / LOCK)
        with storing(self.path / LOCK):
            try:
                lock.acquire(timeout=0)
            except Timeout:
                held = f"another walkerlab process is working in {self.path}"
                if not wait:
                    raise LockedError(f"{held}.", "Leave out --no-wait to wait for it.") from None
                if say is not None:
                    say(f"waiting: {held}")
                lock.acquire()
        try:
            remove_leftovers(self.path)
            yield
        finally:
            lock.release()


def changes_in(name: str) -> tuple[str, ...]:
    """The changes that a folder's name shows: all there is to tell where no record lists them."""
    return tuple(filter(None, name.partition("@")[2].split(",")))
