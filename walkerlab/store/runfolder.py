"""The folder of a run: where its files are, and the lock under which they are written."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from walkerlab.errors import LockedError
from walkerlab.store.files import make_folder, remove_leftovers, storing


@dataclass(frozen=True)
class RunFolder:
    """runs/<name>/ of one run.

    runs_dir  the folder of all runs
    name      of the run; path-safe
    """

    runs_dir: Path
    name: str

    @property
    def path(self) -> Path:
        """The folder."""
        return self.runs_dir / self.name

    @property
    def figures(self) -> Path:
        """The folder of its figures."""
        return self.path / "figures"

    def artifact(self, stage: str) -> Path:
        """The file of a stage's result."""
        return self.path / f"{stage}.h5"

    def parts(self, stage: str) -> Path:
        """The file of what there is of a stage's result while it is in the making."""
        return self.path / f"{stage}.parts"

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
        lock = FileLock(self.path / ".lock")
        with storing(self.path / ".lock"):
            try:
                lock.acquire(timeout=0)
            except Timeout:
                held = f"another walkerlab process is working in {self.path}"
                if not wait:
                    raise LockedError(f"{held}.", "Leave out --no-wait to wait for it.") from None
                if say is not None:
                    say(f"waiting: {held}, and its results will be reused")
                lock.acquire()
        try:
            remove_leftovers(self.path)
            yield
        finally:
            lock.release()
