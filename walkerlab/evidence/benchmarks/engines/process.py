"""Separate process for an engine, so that a crash or hang does not stop the stage."""

from __future__ import annotations

import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from walkerlab.pipeline.run.workers import Worker, WorkerDiedError, WorkerTimeoutError

START_UP_S = 60.0  # extra time for the first task, which loads the engine and compiles
R = TypeVar("R")


@dataclass(frozen=True)
class TaskLost:
    """Record of a task without a result."""

    reason: str
    timed_out: bool = False


class OwnProcess:
    """Runs tasks one after another in a worker process, which is restarted after a crash or time-out.

    The worker's output is suppressed and it has its own folder, since engines print and write logs.
    """

    def __init__(self) -> None:
        self._worker: Worker | None = None
        self._folder = tempfile.TemporaryDirectory(prefix="walkerlab-engine-")
        self._abandoned = False

    def __enter__(self) -> OwnProcess:
        return self

    def __exit__(self, *_error: object) -> None:
        self._end()
        self._folder.cleanup()

    def do(self, task: Callable[[], R], timeout_s: float) -> R | TaskLost:
        """Run a picklable task and return its result, or `TaskLost` if it has none.

        Raises RuntimeError after `abandon`.
        """
        if self._abandoned:
            raise RuntimeError("the process was abandoned")
        if self._worker is None:
            self._worker = Worker(folder=Path(self._folder.name), quiet=True)
            timeout_s += START_UP_S
        try:
            return self._worker.do(task, timeout_s=timeout_s)
        except WorkerTimeoutError:
            self._end()
            return TaskLost(f"no result within {timeout_s:.0f} s", timed_out=True)
        except WorkerDiedError as died:
            self._end()
            return TaskLost(f"the engine's process ended with code {died.exit_code_of_worker}")
        except Exception as error:  # an engine's exception is recorded in the row of its run
            return TaskLost(traceback.format_exception_only(error)[0].strip()[:200])

    def abandon(self) -> None:
        """Kill the running task and reject further ones. Another thread may call this."""
        self._abandoned = True
        worker = self._worker
        if worker is not None:
            worker.process.kill()

    def _end(self) -> None:
        """Kill the process, since an engine may hang."""
        if self._worker is not None:
            self._worker.process.kill()
            self._worker.close()
            self._worker = None
