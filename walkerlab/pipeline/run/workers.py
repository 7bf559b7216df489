"""Worker processes: `map_in_order` for a list of calls, `WorkerPool` for calls that arrive one by one.

A worker is a separate interpreter that receives calls and returns their results. It never runs the caller's script, so
scripts without a guard, code from standard input and notebooks can use workers. Workers end when their parent ends,
for whatever reason. The parent handles keyboard interrupts.

Signals that stop a command raise an error in the main thread, but never inside an LLVM callback, where it would be
lost.
"""

import _thread
import contextlib
import importlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

from walkerlab.errors import WalkerlabError
from walkerlab.physics.kernel_cache import cache_root

SOON_S = 0.02
CALLED_BACK = "_raw_object_cache"
"""Prefix of the names of functions that LLVM calls after compiling or loading. Errors raised in them are lost."""

STORING_PATIENCE_S = 1.0
"""Time that a command is given to store finished results after its parent has ended."""


def raise_on(number: int, error: type[BaseException]) -> None:
    """Make a signal raise an error. Inside an LLVM callback, send the signal again shortly afterwards."""
    pending: list[threading.Timer] = []

    def arrived(number: int, frame: FrameType | None) -> None:
        while pending:
            pending.pop().cancel()
        if not is_called_back(frame):
            raise error
        pending.append(threading.Timer(SOON_S, _thread.interrupt_main, (number,)))
        pending[0].start()

    signal.signal(number, arrived)


def is_called_back(frame: FrameType | None) -> bool:
    """Whether a frame is that of an LLVM callback, or was called by one."""
    while frame is not None:
        if frame.f_code.co_name.startswith(CALLED_BACK):
            return True
        frame = frame.f_back
    return False


def end_with_parent() -> None:
    """End this process and everything it has started as soon as its parent is gone.

    This process must lead its session. The parent must hold the other end of standard input and never write to it.
    """

    def watch() -> None:
        # The parent never writes, so this returns when its end of the pipe is closed.
        os.read(0, 1)
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(STORING_PATIENCE_S)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


ONE_THREAD = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
WORKER_PATIENCE_S = 5.0
"""How long a worker may take to end before it is killed."""
# A terminal interrupts workers as well, but only the parent reacts.
START = """
import signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.path[:] = {path!r}
from walkerlab.pipeline.run.workers import serve
serve({line}, {modules!r})
"""

R = TypeVar("R")
Hear = Callable[[Any], None]


class WorkerDiedError(WalkerlabError):
    """Error for a worker that crashed or was killed before it answered."""

    exit_code = 4

    def __init__(self, exit_code: int) -> None:
        """Build the message from a worker's exit code, which is negative if a signal killed the worker."""
        how = signal.Signals(-exit_code).name if exit_code < 0 else f"exit code {exit_code}"
        super().__init__(
            f"a worker process ended before it had answered ({how}).",
            "Its output may say why. If it was killed, the machine may be short of memory: --jobs 1 needs less.",
        )
        self.exit_code_of_worker = exit_code

    # By default, pickle would pass the message to `__init__`, which takes an exit code.
    def __reduce__(self) -> tuple[type, tuple[int]]:
        return type(self), (self.exit_code_of_worker,)


class WorkerTimeoutError(Exception):
    """Error for a worker that did not answer in time."""


@dataclass(frozen=True)
class CallMessage:
    """Message that a running call sends."""

    value: Any


@dataclass(frozen=True)
class Answer:
    """Result of a call: its value, or the error that it raised."""

    value: Any = None
    error: Exception | None = None


class Worker:
    """Process that runs one call after the other."""

    def __init__(
        self,
        modules: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        quiet: bool = False,
    ) -> None:
        """Start the process.

        modules      names of modules to import before the first call
        environment  environment variables that differ from those of this process
        folder       working folder; None for that of this process
        quiet        whether to discard its output
        """
        self._line, theirs = Pipe()
        # `os.path`, because entries of sys.path are strings and '' is the current folder
        path = [os.path.abspath(entry) for entry in sys.path]  # noqa: PTH100
        code = START.format(path=path, line=theirs.fileno(), modules=tuple(modules))
        output = subprocess.DEVNULL if quiet else None
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            pass_fds=(theirs.fileno(),),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            cwd=folder,
            # All processes share one cache of compiled code.
            env={**os.environ, "WALKERLAB_CACHE": str(cache_root()), **(environment or {})},
        )
        theirs.close()

    def do(self, call: Callable[[], R], hear: Hear | None = None, timeout_s: float | None = None) -> R:
        """Run a call in the worker, and return its value or raise its error.

        hear       function that receives the call's messages
        timeout_s  maximum time between two messages, s

        Raises WorkerDiedError and WorkerTimeoutError.
        """
        work = pickle.dumps(call)
        with contextlib.suppress(OSError):  # if the worker is dead, `_receive` raises the error
            self._line.send_bytes(work)
        while isinstance(message := self._receive(timeout_s), CallMessage):
            if hear is not None:
                hear(message.value)
        if message.error is not None:
            raise message.error
        value: R = message.value
        return value

    def _receive(self, timeout_s: float | None) -> CallMessage | Answer:
        try:
            if not self._line.poll(timeout_s):
                raise WorkerTimeoutError
            message: CallMessage | Answer = self._line.recv()
        except (EOFError, OSError):
            raise WorkerDiedError(self.wait_for_end()) from None
        return message

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    def leave(self) -> None:
        """Ask the process to abandon its call and end."""
        self.process.terminate()

    def wait_for_end(self) -> int:
        """Wait until the process ends, kill it if that takes too long, and return its exit code."""
        try:
            return self.process.wait(WORKER_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()

    def close(self) -> None:
        self.leave()
        self.wait_for_end()
        self._line.close()


class SizedExecutor(Executor):
    """Executor with a `size`, the number of calls that run at the same time, or 0 if calls run in this process."""

    size: int


class WorkerPool(SizedExecutor):
    """Executor that starts workers as needed, replaces those that died and ends all of them when it is shut down."""

    def __init__(self, size: int, modules: Sequence[str] = (), environment: Mapping[str, str] | None = None) -> None:
        """Set up at most `size` workers without starting one. `modules` and `environment` are as in `Worker`."""
        self.size = size
        self._new_worker = partial(Worker, modules, environment)
        self._threads = ThreadPoolExecutor(size)  # each thread waits for the answer of one worker
        self._lock = threading.Lock()
        self._idle: list[Worker] = []
        self._busy: list[Worker] = []
        self._closed = False

    def start_all(self) -> None:
        """Start all workers now, so that they import their modules before the first call."""
        with self._lock:
            self._idle += [self._new_worker() for _ in range(self.size - len(self._idle) - len(self._busy))]

    def start(self, call: Callable[[], R], hear: Hear | None = None) -> Future[R]:
        """Run a call in the next free worker. `hear` receives its messages in another thread."""
        return self._threads.submit(self._do, call, hear)

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        """Run a function in the next free worker."""
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
                # If the worker has died, the next call removes it from the list.
                self._idle.append(worker)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers. If `wait` is true, let them finish their calls first."""
        self._threads.shutdown(wait=wait, cancel_futures=cancel_futures)
        with self._lock:
            self._closed = True
            workers = [*self._idle, *self._busy]
        for worker in workers:
            worker.leave()
        for worker in workers:
            worker.wait_for_end()
        self._threads.shutdown()  # wait until no thread listens to a worker
        for worker in workers:
            worker.close()

    def __exit__(self, *_: object) -> None:
        self.shutdown(wait=False, cancel_futures=True)


def map_in_order(
    calls: Sequence[Callable[[], R]], jobs: int, first: Sequence[int] = (), rank: Callable[[int], float] = float
) -> Iterator[R]:
    """Yield the results of independent calls, in the order of the calls.

    jobs   maximum number of processes
    first  indices of calls to run first and in this process, so that kernels are compiled once
    rank   function of an index. Calls of low rank start first, so give long calls a low rank: they then do not run
    alone at the end
    """
    if jobs <= 1 or len(calls) <= 1:
        for call in calls:
            yield call()
        return
    ready = {place: calls[place]() for place in first}
    with WorkerPool(min(jobs, len(calls))) as pool:
        futures = {place: pool.start(calls[place]) for place in sorted({*range(len(calls))} - {*first}, key=rank)}
        for place in range(len(calls)):
            yield ready[place] if place in ready else futures[place].result()


# The rest of this file runs in the worker.


class LeaveError(BaseException):
    """Error that a signal raises to end this process and abandon the call that it is running."""


def tell(value: Any) -> None:
    """Send a message to the parent process."""
    assert _lines, "only calls in a worker send messages"
    _lines[0].send(CallMessage(value))


_lines: list[Connection] = []
"""Connection to the parent process. Empty if this process is not a worker."""


def serve(number: int, modules: Sequence[str]) -> None:
    """Run calls until a signal ends this process. `number` is the file descriptor of the connection to the parent."""
    # Otherwise a program that a call starts would keep the connection open after this process has ended.
    os.set_inheritable(number, False)
    line = Connection(number)
    _lines.append(line)
    calls: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=receive, args=(line, calls), daemon=True).start()
    # Until the handler below is set, a signal simply ends the process.
    for module in modules:
        importlib.import_module(module)
    with contextlib.suppress(LeaveError):
        raise_on(signal.SIGTERM, LeaveError)
        while True:
            line.send_bytes(answer(calls.get()))
    # The call has been abandoned. The terminal and the parent may each send a signal. From now on, another one simply
    # ends the process.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def receive(line: Connection, calls: queue.SimpleQueue[bytes]) -> None:
    """Queue incoming calls, and end this process once the parent is gone."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            calls.put(line.recv_bytes())
    # `sys.exit` would end only this thread.
    os._exit(1)


def answer(work: bytes) -> bytes:
    """Run a pickled call and return its pickled answer. An error that cannot be pickled is replaced by a
    description."""
    try:
        return pickle.dumps(Answer(pickle.loads(work)()))
    except Exception as error:
        description = f"In a worker process:\n{traceback.format_exc()}"
        error.add_note(description)
        try:
            failed = pickle.dumps(Answer(error=error))
            pickle.loads(failed)
        except Exception:  # an exception may hold objects that cannot be pickled or restored
            return pickle.dumps(Answer(error=RuntimeError(description)))
        return failed
