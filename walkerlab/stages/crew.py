"""Processes that run stages side by side: each is sent a stage, tells of its progress, and sends back what it found."""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import threading
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from walkerlab.errors import NoAnswer, WalkerlabError
from walkerlab.stages.progress import StageReporter
from walkerlab.stages.task import Compilation, Task, kernels_told_of

PATIENCE_S = 5.0
"""How long a member may take to end what it began, before it is killed."""


@dataclass(frozen=True)
class Message:
    """What a member says: a call to the reporter of its stage, or with `last` what came of it."""

    call: str
    arguments: tuple[Any, ...] = ()
    last: bool = False


class Member:
    """One process, and what it works at."""

    def __init__(self) -> None:
        """Start the process; it waits for work."""
        context = get_context("spawn")  # compiled code and threads do not survive a fork
        self.line, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=serve, args=(theirs,))
        self.process.start()
        theirs.close()
        self.task: Task | Compilation | None = None
        self.reporter: StageReporter | None = None

    def give(self, task: Task | Compilation, reporter: StageReporter | None = None) -> None:
        """Send it to work."""
        self.task, self.reporter = task, reporter
        self.line.send(task)

    def heard(self) -> Message | None:
        """Pass on what it says to its reporter; its last message, once that comes."""
        try:
            message: Message = self.line.recv()
        except (EOFError, OSError):
            return Message("died", last=True)
        if message.last:
            self.task = None
            return message
        if self.reporter is not None:
            getattr(self.reporter, message.call)(*message.arguments)
        return None


class Crew:
    """The processes; started when they are needed, ended with the crew."""

    def __init__(self, size: int) -> None:
        """At most `size` processes; none is started."""
        self.size = size
        self.members: list[Member] = []

    def __enter__(self) -> Crew:
        """The crew."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the processes, whatever they are at."""
        for member in self.members:
            member.process.terminate()
        for member in self.members:
            member.process.join(PATIENCE_S)
            if member.process.is_alive():
                member.process.kill()
                member.process.join()

    def free(self) -> Member | None:
        """A member without work, if there is one or may be one more."""
        idle = next((member for member in self.members if member.task is None), None)
        if idle is None and len(self.members) < self.size:
            idle = Member()
            self.members.append(idle)
        return idle

    def outcomes(self) -> Iterator[tuple[Member, Task | Compilation, Message]]:
        """Wait until members have said something; those that are through, and what came of it."""
        lines = {member.line: member for member in self.members if member.task is not None}
        for line in wait(list(lines)):
            member = lines[line]  # type: ignore[index]
            task = member.task
            message = member.heard()
            if message is not None and task is not None:
                yield member, task, message


def found(message: Message) -> Any:
    """What a stage returned, from the last message of the member that ran it; raises what it raised."""
    match message.call:
        case "returned":
            return message.arguments[0]
        case "no answer":
            raise NoAnswer(*message.arguments)
        case "failed":
            kind, *words = message.arguments
            raise kind(*words)
        case "died":
            raise WalkerlabError(
                "the process that ran a stage was ended from outside.",
                "Perhaps memory was short: --jobs 1 runs one stage after the other.",
            )
        case _:
            raise RuntimeError(f"a stage has failed in its process:\n{message.arguments[0]}")


def serve(line: Connection) -> None:
    """What a member does: one piece of work after the other, until it is ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is the first process's to deal with
    signal.signal(signal.SIGTERM, leave)
    threading.Thread(target=end_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, OSError, Leave):
        while True:
            line.send(done(line.recv(), line))


class Leave(BaseException):
    """This process is to end, and what it has begun with it."""


def leave(*_: object) -> None:
    """Leave."""
    raise Leave


def end_with_parent() -> None:
    """Have this process end when the one that sends it work was killed."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def done(task: Task | Compilation, line: Connection) -> Message:
    """The last message about a piece of work."""
    try:
        if isinstance(task, Compilation):
            task.run()
            return Message("returned", (None,), last=True)
        teller = Teller(line)
        importlib.import_module(task.module)
        with kernels_told_of(teller.compiling):
            return Message("returned", (task.run(teller),), last=True)
    except NoAnswer as error:
        return Message("no answer", (error.message, error.advice, error.partial), last=True)
    except WalkerlabError as error:
        return Message("failed", (type(error), error.message, error.advice), last=True)
    except Exception:
        return Message("broken", (traceback.format_exc(),), last=True)


class Teller:
    """The progress of a stage in a member: it is told to the first process."""

    def __init__(self, line: Connection) -> None:
        """Tell it on this line."""
        self._line = line

    def start(self, label: str, total: int | None = None) -> None:
        """A piece of work begins."""
        self._line.send(Message("start", (label, total)))

    def advance(self, n: int = 1) -> None:
        """So many more parts are done."""
        self._line.send(Message("advance", (n,)))

    def note(self, text: str) -> None:
        """One line."""
        self._line.send(Message("note", (text,)))

    def compiling(self, kernel: str) -> None:
        """A kernel is being compiled, or is there."""
        self._line.send(Message("compiling", (kernel,)))
