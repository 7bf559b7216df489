"""Where chunks are computed: each engine is a factory of a concurrent.futures executor; none schedules itself."""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field, replace
from multiprocessing import current_process
from pathlib import Path
from typing import Any

from walkerlab.errors import ConfigError
from walkerlab.workers import WorkerPool

GUARD = 'From Python, call it under `if __name__ == "__main__":` in a file. The engine `local` needs no such guard.'
ONE_THREAD = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Order:
    """What an engine is asked for.

    workers  processes; 0 leaves it to the engine
    address  of a scheduler that runs already; empty to have one made
    modules  that workers will need
    folder   for an engine's own files
    options  an engine's own, by name
    """

    workers: int = 0
    address: str = ""
    modules: tuple[str, ...] = ()
    folder: Path = Path()
    options: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Pool:
    """An executor that is ready.

    workers  chunks that it computes at once
    """

    executor: Executor
    workers: int


@dataclass(frozen=True)
class SweepEngine:
    """One way to compute.

    opened   a context that gives a pool and closes it
    chunk_s  how long a chunk is to take, s: long against what a chunk costs the engine
    """

    opened: Callable[[Order], contextlib.AbstractContextManager[Pool]]
    chunk_s: float

    @contextlib.contextmanager
    def begun(self, order: Order) -> Iterator[SweepEngine]:
        """The engine for one sweep; on this machine its workers load what they need while points are still made."""
        if self.opened is not local:
            yield self
            return
        with local(order) as pool:
            pool.executor.start_all()  # type: ignore[attr-defined]
            yield replace(self, opened=lambda _order: contextlib.nullcontext(pool))


@contextlib.contextmanager
def local(order: Order) -> Iterator[Pool]:
    """Processes of this machine, one thread each."""
    refuse_address("local", order)
    workers = order.workers or os.cpu_count() or 1
    modules = ("walkerlab.sweeps.chunk", *order.modules)
    with WorkerPool(workers, modules, dict.fromkeys(ONE_THREAD, "1")) as executor:
        yield Pool(executor, workers)


@contextlib.contextmanager
def one_thread_each() -> Iterator[None]:
    """Have processes that are started meanwhile compute in one thread."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextlib.contextmanager
def dask(order: Order) -> Iterator[Pool]:
    """Workers of a Dask cluster that runs at an address, or of one that is made on this machine."""
    distributed = extra("distributed", "dask")
    # Dask writes these into this process's environment whenever it starts a worker, also in place of one that died.
    with one_thread_each(), contextlib.ExitStack() as stack:
        if order.address:
            client = stack.enter_context(distributed.Client(order.address))
        else:
            workers = order.workers or os.cpu_count() or 1
            try:
                cluster = distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None, processes=True
                )
            except RuntimeError as error:
                raise ConfigError(f"--engine dask: its processes did not start: {error}", GUARD) from error
            stack.enter_context(cluster)
            client = stack.enter_context(distributed.Client(cluster))
        # A worker's death is dealt with chunk by chunk, here as in every engine. Dask's own executor mistakes a result
        # whose worker dies before it is handed over for an error.
        executor = JobExecutor(functools.partial(client.submit, retries=0, pure=False))
        try:
            yield Pool(executor, order.workers or max(1, len(client.scheduler_info()["workers"])))
        finally:
            client.cancel(list(executor.jobs))


@contextlib.contextmanager
def slurm(order: Order) -> Iterator[Pool]:
    """Jobs of Slurm, one for each chunk; `cluster=local` runs them on this machine, to try a sweep out."""
    submitit = extra("submitit", "slurm")
    refuse_address("slurm", order)
    options: dict[str, Any] = {name: int(text) if text.isdigit() else text for name, text in order.options.items()}
    cluster = str(options.pop("cluster", "slurm"))
    python = options.pop("python", None)
    try:
        made = submitit.AutoExecutor(
            order.folder / "jobs", cluster=cluster, **({"slurm_python": python} if python else {})
        )
        made.update_parameters(**{"name": "walkerlab", "timeout_min": 60, "cpus_per_task": 1} | options)
    except (RuntimeError, TypeError, ValueError, NotImplementedError) as error:
        raise ConfigError(f"--engine slurm: {error}", "--engine-option cluster=local tries it out here.") from error
    executor = JobExecutor(made.submit)
    try:
        yield Pool(executor, order.workers or 16)
    finally:
        for job in list(executor.jobs):
            with contextlib.suppress(OSError):  # a job that has ended meanwhile
                if not job.done():
                    job.cancel(check=False)


class JobExecutor(Executor):
    """A library's jobs as futures, each waited for by a thread."""

    def __init__(self, start: Callable[..., Any]) -> None:
        """Nothing is submitted yet.

        start  called with a function and its arguments, returns a job whose `result()` waits
        """
        self._start = start
        self.jobs: set[Any] = set()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit one job."""
        future: Future[Any] = Future()
        job = self._start(fn, *args, **kwargs)
        self.jobs.add(job)

        def wait() -> None:
            try:
                result = job.result()
            except BaseException as error:  # a cancelled job's is no Exception
                future.set_exception(error)
            else:
                future.set_result(result)
            self.jobs.discard(job)

        threading.Thread(target=wait, daemon=True).start()
        return future


def refuse_address(name: str, order: Order) -> None:
    """Raise ConfigError for an address that an engine has no use for."""
    if order.address:
        raise ConfigError(f"--engine {name}={order.address}: {name} takes no address.", "Only dask does.")


def extra(module: str, name: str) -> Any:
    """A library that comes with one of the package's extras; ConfigError if it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ConfigError(
            f"--engine {name} needs {module}, which is not installed.", f"pip install 'walkerlab[{name}]'"
        ) from error


ENGINES: dict[str, SweepEngine] = {
    "local": SweepEngine(local, chunk_s=5.0),
    "dask": SweepEngine(dask, chunk_s=10.0),
    "slurm": SweepEngine(slurm, chunk_s=60.0),
}


def engine_named(text: str) -> tuple[SweepEngine, str]:
    """The engine, and the address if there is one, of NAME or NAME=ADDRESS; ConfigError if there is none."""
    name, _, address = text.partition("=")
    if name not in ENGINES:
        raise ConfigError(f"--engine {text}: no such engine; there are {', '.join(ENGINES)}.")
    # what multiprocessing itself goes by: a process that it starts runs the script first
    if text == "dask" and getattr(current_process(), "_inheriting", False):
        raise ConfigError(
            "--engine dask: the processes that Dask starts run the calling script, which would sweep once more.", GUARD
        )
    return ENGINES[name], address
