"""An engine in a process of its own: it can end the stage neither by a crash nor by taking for ever."""

from __future__ import annotations

import os
import sys
import tempfile
import traceback
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

START_UP_S = 60.0  # for a first task, which loads the engine and compiles
R_co = TypeVar("R_co", covariant=True)
R = TypeVar("R")


class Task(Protocol[R_co]):
    """Something to be done there; processes can be sent it."""

    def run(self) -> R_co:
        """Its result."""


@dataclass(frozen=True)
class Lost:
    """A task without a result, and why."""

    why: str
    timed_out: bool = False


@dataclass(frozen=True)
class Done(Generic[R]):
    """A task's result."""

    result: R


class OwnProcess:
    """Does tasks one after the other in a process that is started anew after a crash or a time-out."""

    def __init__(self) -> None:
        """Nothing is started before the first task."""
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._abandoned = False

    def __enter__(self) -> OwnProcess:
        """Itself."""
        return self

    def __exit__(self, *_error: object) -> None:
        """End the process."""
        self.end()

    def do(self, task: Task[R], timeout_s: float) -> R | Lost:
        """A task's result, or what became of it; RuntimeError once it is abandoned."""
        if self._abandoned:
            raise RuntimeError("nobody waits for this process any more")
        if self._pipe is None:
            self._start()
            timeout_s += START_UP_S
        assert self._pipe is not None, "the process has just been started"
        try:
            self._pipe.send(task)
            if not self._pipe.poll(timeout_s):
                self.end()
                return Lost(f"no answer within {timeout_s:.0f} s", timed_out=True)
            answer: Done[R] | Lost = self._pipe.recv()
        except (EOFError, OSError):
            return Lost(f"the engine's process ended with code {self.end()}")
        return answer if isinstance(answer, Lost) else answer.result

    def _start(self) -> None:
        context = get_context("spawn")
        self._pipe, there = context.Pipe()
        self._process = context.Process(target=serve, args=(there,), daemon=True)
        self._process.start()
        there.close()

    def abandon(self) -> None:
        """End what is running and take no more tasks; from another thread than the one that waits."""
        self._abandoned = True
        process = self._process
        if process is not None:
            process.kill()

    def end(self) -> int | None:
        """End the process, by force if need be; its exit code."""
        if self._process is None or self._pipe is None:
            return None
        self._pipe.close()
        self._process.join(0.2)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        code = self._process.exitcode
        self._process = self._pipe = None
        return code


def serve(pipe: Any) -> None:
    """Do tasks until there are no more; in a folder of their own and unheard, since engines write logs and talk."""
    sys.path[:] = [str(Path(entry).absolute()) for entry in sys.path]
    with tempfile.TemporaryDirectory(prefix="walkerlab-engine-") as folder, Path(os.devnull).open("w") as nowhere:
        os.chdir(folder)
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
        answer_all(pipe)


def answer_all(pipe: Any) -> None:
    """Do one task after the other until the pipe is closed."""
    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer: Done[Any] | Lost = Done(task.run())
        except Exception as error:  # whatever an engine raises is its row's outcome
            said = traceback.format_exception_only(error)[-1].strip()
            answer = Lost(said[:200])
        pipe.send(answer)
