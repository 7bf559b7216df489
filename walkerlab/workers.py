"""Processes that work beside this one: `in_order` for a list of calls, `WorkerPool` for calls that come bit by bit.

A worker is an interpreter of its own that is sent calls and sends back what they return. It never runs the caller's
script, so that scripts without a guard, code from standard input and notebooks can have workers. Workers end with the
process that started them, however that ends; an interrupt of the keyboard is that process's to deal with.
"""

import contextlib
import importlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

from walkerlab.errors import WalkerlabError
from walkerlab.kernel_cache import cache_root
from walkerlab.stopping import raise_on

PATIENCE_S = 5.0
"""How long a worker may take to end what it began, before it is killed."""
START = """
import signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.path[:] = {path!r}
from walkerlab.workers import serve
serve({line}, {modules!r})
"""

R = TypeVar("R")
Hear = Callable[[Any], None]


class WorkerDiedError(WalkerlabError):
    """A worker ended before it had answered: it crashed, or was killed."""

    exit_code = 4

    def __init__(self, exit_code: int) -> None:
        """Say how.

        exit_code  of the process, negative for a signal
        """
        how = signal.Signals(-exit_code).name if exit_code < 0 else f"exit code {exit_code}"
        super().__init__(
            f"a worker process ended before it had answered ({how}).",
            "What it printed may say why. If it was killed, perhaps memory was short: --jobs 1 needs less.",
        )
        self.exit_code_of_worker = exit_code

    def __reduce__(self) -> tuple[type, tuple[int]]:
        """What a copy in another process is made of."""
        return type(self), (self.exit_code_of_worker,)


class WorkerTimeoutError(Exception):
    """A worker has not answered in time."""


@dataclass(frozen=True)
class Told:
    """What a call says while it runs."""

    value: Any


@dataclass(frozen=True)
class Answer:
    """What became of a call: the value that it returned, or the error that it raised."""

    value: Any = None
    error: Exception | None = None


class Worker:
    """One process, which does one call after the other."""

    def __init__(
        self,
        modules: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        quiet: bool = False,
    ) -> None:
        """Start it.

        modules      that it loads at once, while nothing is asked of it yet
        environment  variables that differ from this process's
        folder       that it works in; this process's if left out
        quiet        whether what it prints is dropped
        """
        self._line, theirs = Pipe()
        path = [os.path.abspath(entry) for entry in sys.path]  # noqa: PTH100 (entries are texts, '' the folder here)
        code = START.format(path=path, line=theirs.fileno(), modules=tuple(modules))
        output = subprocess.DEVNULL if quiet else None
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            pass_fds=(theirs.fileno(),),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            cwd=folder,
            # One folder of compiled code for all, chosen and told of here.
            env={**os.environ, "WALKERLAB_CACHE": str(cache_root()), **(environment or {})},
        )
        theirs.close()

    def do(self, call: Callable[[], R], hear: Hear | None = None, timeout_s: float | None = None) -> R:
        """What a call returns there; raises what it raises.

        hear       is given what the call tells meanwhile
        timeout_s  the longest time between two things that are heard, s

        Raises WorkerDiedError and WorkerTimeoutError.
        """
        work = pickle.dumps(call)
        with contextlib.suppress(OSError):  # a worker that is dead says so as well by never answering
            self._line.send_bytes(work)
        while isinstance(message := self._received(timeout_s), Told):
            if hear is not None:
                hear(message.value)
        if message.error is not None:
            raise message.error
        value: R = message.value
        return value

    def _received(self, timeout_s: float | None) -> Told | Answer:
        try:
            if not self._line.poll(timeout_s):
                raise WorkerTimeoutError
            message: Told | Answer = self._line.recv()
        except (EOFError, OSError):
            raise WorkerDiedError(self.ended()) from None
        return message

    @property
    def alive(self) -> bool:
        """Whether it can be asked for more."""
        return self.process.poll() is None

    def leave(self) -> None:
        """Ask it to drop what it is at, and to end."""
        self.process.terminate()

    def ended(self) -> int:
        """Wait for its end, and kill it if that does not come; its exit code."""
        try:
            return self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()

    def close(self) -> None:
        """End it."""
        self.leave()
        self.ended()
        self._line.close()


class WorkerPool(Executor):
    """Workers that are started as they are needed, and anew in place of those that die; ended with the pool."""

    def __init__(self, size: int, modules: Sequence[str] = (), environment: Mapping[str, str] | None = None) -> None:
        """At most `size` workers; none is started. For `modules` and `environment` see `Worker`."""
        self.size = size
        self._new_worker = partial(Worker, modules, environment)
        self._threads = ThreadPoolExecutor(size)  # each waits for one worker
        self._lock = threading.Lock()
        self._idle: list[Worker] = []
        self._busy: list[Worker] = []
        self._closed = False

    def start_all(self) -> None:
        """Start all workers at once, so that they load what they need meanwhile."""
        with self._lock:
            self._idle += [self._new_worker() for _ in range(self.size - len(self._idle) - len(self._busy))]

    def start(self, call: Callable[[], R], hear: Hear | None = None) -> Future[R]:
        """Have a call done by the next worker that is free; `hear` is given what it tells, in another thread."""
        return self._threads.submit(self._do, call, hear)

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        """Have a function called by the next worker that is free."""
        return self.start(partial(fn, *args, **kwargs))

    def _do(self, call: Callable[[], R], hear: Hear | None) -> R:
        with self._lock:
            if self._closed:
                raise WorkerDiedError(-signal.SIGTERM)
            self._idle = [worker for worker in self._idle if worker.alive]
            worker = self._idle.pop() if self._idle else self._new_worker()
            self._busy.append(worker)
        try:
            return worker.do(call, hear)
        finally:
            with self._lock:
                self._busy.remove(worker)
                self._idle.append(worker)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers; with `wait`, once they have done what they were given."""
        self._threads.shutdown(wait=wait, cancel_futures=cancel_futures)
        with self._lock:
            self._closed = True
            workers = [*self._idle, *self._busy]
        for worker in workers:
            worker.leave()
        for worker in workers:
            worker.ended()
        self._threads.shutdown()  # no thread listens any more
        for worker in workers:
            worker.close()

    def __exit__(self, *_: object) -> None:
        """End the workers, whatever they are at."""
        self.shutdown(wait=False, cancel_futures=True)


def in_order(
    calls: Sequence[Callable[[], R]], jobs: int, first: Sequence[int] = (), rank: Callable[[int], float] = float
) -> Iterator[R]:
    """What independent calls return, in their order, whoever did them.

    jobs   processes
    first  places of calls that are done here, before several processes would each compile the same
    rank   by place: calls of least rank begin first, so that no process is left alone with a long one at the end
    """
    if jobs <= 1 or len(calls) <= 1:
        for call in calls:
            yield call()
        return
    ready = {place: calls[place]() for place in first}
    with WorkerPool(min(jobs, len(calls))) as pool:
        others = {place: pool.start(calls[place]) for place in sorted({*range(len(calls))} - {*first}, key=rank)}
        for place in range(len(calls)):
            yield ready[place] if place in ready else others[place].result()


# What follows runs in the worker.


class LeaveError(BaseException):
    """This process is to end, and what it has begun with it."""


def tell(value: Any) -> None:
    """Say something to whom waits for the call that runs."""
    assert _lines, "only calls in a worker can tell"
    _lines[0].send(Told(value))


_lines: list[Connection] = []
"""In a worker: to the process that started it."""


def serve(number: int, modules: Sequence[str]) -> None:
    """Do one call after the other, until this process is told to end.

    number  of the open file that calls come through
    """
    os.set_inheritable(number, False)
    line = Connection(number)
    _lines.append(line)
    calls: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=receive, args=(line, calls), daemon=True).start()
    # Until there is something to drop, a process that is told to end just ends.
    for module in modules:
        importlib.import_module(module)
    with contextlib.suppress(LeaveError):
        raise_on(signal.SIGTERM, LeaveError)
        while True:
            line.send_bytes(answer(calls.get()))
    # What was begun is dropped: told once more, as by a terminal and by who started it, the process just ends.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def receive(line: Connection, calls: queue.SimpleQueue[bytes]) -> None:
    """Take what is sent, and end this process once nobody is there to send any more."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            calls.put(line.recv_bytes())
    os._exit(1)


def answer(work: bytes) -> bytes:
    """Do a call; the answer, which names in words what cannot be sent."""
    try:
        return pickle.dumps(Answer(pickle.loads(work)()))
    except Exception as error:
        said = f"In a worker process:\n{traceback.format_exc()}"
        error.add_note(said)
        try:
            failed = pickle.dumps(Answer(error=error))
            pickle.loads(failed)
        except Exception:  # an exception may be made of anything
            return pickle.dumps(Answer(error=RuntimeError(said)))
        return failed
