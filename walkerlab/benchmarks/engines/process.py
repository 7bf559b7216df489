"""An engine in a process of its own: neither a crash nor a hang can take the stage down."""

from __future__ import annotations

import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from walkerlab.workers import Worker, WorkerDiedError, WorkerTimeoutError

START_UP_S = 60.0  # for a first task, which loads the engine and compiles
R = TypeVar("R")


@dataclass(frozen=True)
class TaskLost:
    """A task without a result, and why."""

    why: str
    timed_out: bool = False


class OwnProcess:
    """Does tasks one after the other in a worker that is started anew after a crash or a time-out.

    It works in a folder of its own and unheard, since engines write logs and talk.
    """

    def __init__(self) -> None:
        """Nothing is started before the first task."""
        self._worker: Worker | None = None
        self._folder = tempfile.TemporaryDirectory(prefix="walkerlab-engine-")
        self._abandoned = False

    def __enter__(self) -> OwnProcess:
        """Itself."""
        return self

    def __exit__(self, *_error: object) -> None:
        """End the process."""
        self._end()
        self._folder.cleanup()

    def do(self, task: Callable[[], R], timeout_s: float) -> R | TaskLost:
        """The result of a task that processes can be sent, or what became of it; RuntimeError once it is abandoned."""
        if self._abandoned:
            raise RuntimeError("nobody waits for this process any more")
        if self._worker is None:
            self._worker = Worker(folder=Path(self._folder.name), quiet=True)
            timeout_s += START_UP_S
        try:
            return self._worker.do(task, timeout_s=timeout_s)
        except WorkerTimeoutError:
            self._end()
            return TaskLost(f"no answer within {timeout_s:.0f} s", timed_out=True)
        except WorkerDiedError as died:
            self._end()
            return TaskLost(f"the engine's process ended with code {died.exit_code_of_worker}")
        except Exception as error:  # whatever an engine raises is its row's outcome
            return TaskLost(traceback.format_exception_only(error)[0].strip()[:200])

    def abandon(self) -> None:
        """End what is running and take no more tasks; from another thread than the one that waits."""
        self._abandoned = True
        worker = self._worker
        if worker is not None:
            worker.process.kill()

    def _end(self) -> None:
        """End the process by force, since an engine may hang."""
        if self._worker is not None:
            self._worker.process.kill()
            self._worker.close()
            self._worker = None
