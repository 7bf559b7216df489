"""Engines that compute chunks; each provides a concurrent.futures executor."""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from multiprocessing import current_process
from pathlib import Path
from typing import Any

from walkerlab.errors import ConfigError
from walkerlab.pipeline.store.files import storing
from walkerlab.pipeline.workers import ONE_THREAD, SizedExecutor, WorkerPool
from walkerlab.private_files import make_private, make_private_folder, may_be_foreign

GUARD = 'From Python, call it under `if __name__ == "__main__":` in a file. The engine `local` needs no such guard.'


@dataclass(frozen=True)
class Order:
    """Options of an engine."""

    workers: int = 0  # number of processes; 0 for the engine's default
    address: str = ""  # address of a running scheduler; empty to start one
    modules: tuple[str, ...] = ()  # modules that workers will need
    folder: Path = Path()  # folder for the engine's files
    options: Mapping[str, str] = field(default_factory=dict)  # options of this engine only, by name


@dataclass(frozen=True)
class SweepEngine:
    """Engine that computes the chunks of a sweep."""

    # opens a pool, whose `size` is the number of chunks that it computes at the same time, and closes it afterwards
    opened: Callable[[Order], contextlib.AbstractContextManager[SizedExecutor]]
    chunk_s: float  # target duration of a chunk, s: long compared with the engine's overhead

    @contextlib.contextmanager
    def start_early(self, order: Order) -> Iterator[SweepEngine]:
        """Yield the engine for one sweep; local workers start now and import modules while the points are prepared."""
        if self.opened is not local:
            yield self
            return
        with local(order) as pool:
            pool.start_all()
            yield replace(self, opened=lambda _order: contextlib.nullcontext(pool))


def local(order: Order) -> WorkerPool:
    """Run workers on this machine, one thread each."""
    refuse_address("local", order)
    modules = ("walkerlab.pipeline.sweeps.chunk", *order.modules)
    return WorkerPool(order.workers or os.cpu_count() or 1, modules, dict.fromkeys(ONE_THREAD, "1"))


@contextlib.contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes that start within the `with` block compute in one thread each."""
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
def dask(order: Order) -> Iterator[JobExecutor]:
    """Use a Dask cluster at an address, or start one on this machine."""
    distributed = extra("distributed", "dask")
    # Dask copies these variables into this process's environment whenever it starts or replaces a worker.
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
        # Worker deaths are handled chunk by chunk, as in every engine; Dask's own executor reports an error for a
        # result whose worker dies before handing it over.
        size = order.workers or max(1, len(client.scheduler_info()["workers"]))
        executor = JobExecutor(functools.partial(client.submit, retries=0, pure=False), size)
        try:
            yield executor
        finally:
            client.cancel(list(executor.jobs))


@contextlib.contextmanager
def slurm(order: Order) -> Iterator[JobExecutor]:
    """Submit a Slurm job for each chunk; `cluster=local` runs the jobs on this machine, for trials."""
    submitit = extra("submitit", "slurm")
    refuse_address("slurm", order)
    options: dict[str, Any] = {name: int(text) if text.isdigit() else text for name, text in order.options.items()}
    cluster = str(options.pop("cluster", "slurm"))
    python = options.pop("python", None)
    try:
        job_runner = submitit.AutoExecutor(
            private_jobs_folder(order.folder), cluster=cluster, **({"slurm_python": python} if python else {})
        )
        job_runner.update_parameters(**{"name": "walkerlab", "timeout_min": 60, "cpus_per_task": 1} | options)
    except (RuntimeError, TypeError, ValueError, NotImplementedError) as error:
        raise ConfigError(f"--engine slurm: {error}", "--engine-option cluster=local tries it out here.") from error
    executor = JobExecutor(job_runner.submit, order.workers or 16)
    try:
        yield executor
    finally:
        for job in list(executor.jobs):
            with contextlib.suppress(OSError):  # the job may have ended meanwhile
                if not job.done():
                    job.cancel(check=False)


def private_jobs_folder(run_folder: Path) -> Path:
    """Create a folder for pickled jobs and results, or close it to other users; they are run when they are loaded.

    Raises ConfigError if other users may replace it, StorageError if it cannot be created or closed.
    """
    jobs = run_folder / "jobs"
    with storing(jobs):
        make_private_folder(run_folder)
        if may_be_foreign(run_folder.resolve()):
            raise ConfigError(
                f"--engine slurm: {run_folder} is open to other users or belongs to another user, and jobs are loaded "
                "from there.",
                f"Choose another folder with --runs, or close this one: chmod o-w {run_folder}",
            )
        if jobs.exists():
            make_private(jobs)
        make_private_folder(jobs)
    return jobs


class JobExecutor(SizedExecutor):
    """Executor that starts jobs of a library; a thread waits for each job."""

    def __init__(self, start: Callable[..., Any], size: int) -> None:
        """Store the function that starts a job.

        start  called with a function and its arguments; returns a job whose `result()` waits
        """
        self._start, self.size = start, size
        self.jobs: set[Any] = set()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        job = self._start(fn, *args, **kwargs)
        self.jobs.add(job)

        def wait() -> None:
            try:
                result = job.result()
            except BaseException as error:  # a cancelled job may raise an error that is no Exception
                future.set_exception(error)
            else:
                future.set_result(result)
            self.jobs.discard(job)

        threading.Thread(target=wait, daemon=True).start()
        return future


def refuse_address(name: str, order: Order) -> None:
    """Raise ConfigError if an address is given for an engine that takes none."""
    if order.address:
        raise ConfigError(f"--engine {name}={order.address}: {name} takes no address.", "Only dask does.")


def extra(module: str, name: str) -> Any:
    """Import a library that an extra of the package installs; raises ConfigError if it is not installed."""
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
    """Return the engine and the address of NAME or NAME=ADDRESS; raises ConfigError for an unknown name."""
    name, _, address = text.partition("=")
    if name not in ENGINES:
        raise ConfigError(f"--engine {text}: unknown engine; choose from {', '.join(ENGINES)}.")
    # multiprocessing's own test for a process that it started; such a process first runs the calling script
    if text == "dask" and getattr(current_process(), "_inheriting", False):
        raise ConfigError(
            "--engine dask: the processes that Dask starts run the calling script, which would sweep again.", GUARD
        )
    return ENGINES[name], address
