"""Engines that compute chunks. Each provides a concurrent.futures executor."""

import contextlib
import functools
import importlib
import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from multiprocessing import current_process
from pathlib import Path
from typing import Any, Final

from walkerlab.errors import ConfigError
from walkerlab.pipeline.run.work import JobEndedError, JobEndsError
from walkerlab.pipeline.run.workers import ONE_THREAD, SizedExecutor, WorkerPool, raise_on
from walkerlab.pipeline.store.files import storing
from walkerlab.private_files import make_private, make_private_folder, may_be_foreign

LISTING_S: Final = 5.0
"""Minimum time between two queries of Slurm's queue."""
RESULT_S: Final = 30.0
"""Time that a job's result may take to appear on a network disk after the job has ended."""
RESTART_S: Final = 20.0
"""Time without a worker after which workers are started again. On its own, Dask takes some seconds to replace one."""
SILENT_WORKER_S: Final = 600.0
"""If Slurm's queue has not answered for this long, its jobs count as lost."""
GONE = "gone"
SILENT = "silent"
ENDED_STATES: Final = {
    "BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "REVOKED",
    "TIMEOUT", GONE, SILENT,
}  # fmt: skip
"""States of a Slurm job that is no longer running."""

GUARD = 'From Python, call it under `if __name__ == "__main__":` in a file. The engine `local` needs no such guard.'


@dataclass(frozen=True)
class EngineOptions:
    """Options for an engine's pool of workers."""

    workers: int = 0  # number of processes; 0 for the engine's default
    address: str = ""  # address of a running scheduler; empty to start one
    modules: tuple[str, ...] = ()  # modules that workers will need
    folder: Path = Path()  # folder for the engine's files
    options: Mapping[str, str] = field(default_factory=dict)  # options of this engine only, by name


@dataclass(frozen=True)
class SweepEngine:
    """Engine that computes the chunks of a sweep."""

    # Opens a pool and closes it afterwards. Its `size` is the number of chunks that it computes at the same time.
    opened: Callable[[EngineOptions], contextlib.AbstractContextManager[SizedExecutor]]
    chunk_s: float  # target duration of a chunk, s: long compared with the engine's overhead

    @contextlib.contextmanager
    def start_early(self, options: EngineOptions) -> Iterator["SweepEngine"]:
        """Yield the engine for one sweep. Local workers start at once, and import modules while the points are
        prepared."""
        if self.opened is not local:
            yield self
            return
        with local(options) as pool:
            pool.start_all()
            yield replace(self, opened=lambda _order: contextlib.nullcontext(pool))


def local(options: EngineOptions) -> WorkerPool:
    """Run workers on this machine, one thread each."""
    refuse_address("local", options)
    modules = ("walkerlab.pipeline.sweeps.chunk", *options.modules)
    return WorkerPool(options.workers or os.cpu_count() or 1, modules, dict.fromkeys(ONE_THREAD, "1"))


@contextlib.contextmanager
def environment_of_workers() -> Iterator[None]:
    """Make processes that start in the `with` block use one thread and import nothing from the current folder."""
    changes = dict.fromkeys((*ONE_THREAD, "PYTHONSAFEPATH"), "1")
    before = {name: os.environ[name] for name in changes.keys() & os.environ.keys()}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name in changes.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)


@contextlib.contextmanager
def dask(options: EngineOptions) -> Iterator["JobExecutor"]:
    """Use a Dask cluster at an address, or start one on this machine."""
    distributed = extra("distributed", "dask")
    # Dask copies these variables into the environment of this process whenever it starts or replaces a worker.
    with environment_of_workers(), contextlib.ExitStack() as stack:
        workers: DaskWorkers | None = None
        if options.address:
            client = stack.enter_context(distributed.Client(options.address))
        else:
            count = options.workers or os.cpu_count() or 1
            try:
                cluster = distributed.LocalCluster(
                    n_workers=count, threads_per_worker=1, dashboard_address=None, processes=True
                )
            except RuntimeError as error:
                raise ConfigError(f"--engine dask: its processes did not start: {error}", GUARD) from error
            stack.enter_context(cluster)
            client = stack.enter_context(distributed.Client(cluster))
            workers = DaskWorkers(cluster, client, count)
        # Dask's own executor reports an error if a worker dies before it hands over a result. Here such a chunk is
        # computed again, as in every engine.
        size = options.workers or max(1, len(client.nthreads()))
        # By default, Dask gives equal calls the same result, so a second attempt would get the error of the first.
        submit = functools.partial(client.submit, retries=0, pure=False)
        executor = JobExecutor(submit, size, None if workers is None else workers.wait)
        try:
            yield executor
        finally:
            client.cancel(list(executor.jobs))


class DaskWorkers:
    """Workers of a cluster that this process started.

    Dask does not always replace a worker that it killed for using too much memory.
    """

    def __init__(self, cluster: Any, client: Any, count: int) -> None:
        self.cluster = cluster
        self.client = client
        self.count = count
        self._lock = threading.Lock()
        self._seen_at = time.monotonic()  # last time at which there was a worker

    def wait(self, job: Any) -> None:
        """Wait until a job has ended. If the cluster has had no worker for a while, start its workers again."""
        while not job.done():
            with contextlib.suppress(TimeoutError):
                extra("distributed", "dask").wait(job, timeout=LISTING_S)
            with self._lock:
                if job.done() or self.client.nthreads():
                    self._seen_at = time.monotonic()
                elif time.monotonic() - self._seen_at > RESTART_S:
                    self.cluster.scale(0)
                    time.sleep(1.0)  # gives the cluster time to forget its closed workers
                    self.cluster.scale(self.count)
                    self._seen_at = time.monotonic()


@contextlib.contextmanager
def slurm(options: EngineOptions) -> Iterator["JobExecutor"]:
    """Submit a Slurm job for each chunk. `cluster=local` runs the jobs on this machine, for trials."""
    submitit = extra("submitit", "slurm")
    refuse_address("slurm", options)
    # Options arrive as strings, but submitit rejects numbers given as strings.
    parameters: dict[str, Any] = {name: number_or_text(text) for name, text in options.options.items()}
    cluster = str(parameters.pop("cluster", "slurm"))
    python = parameters.pop("python", None)
    interpreter = {"slurm_python": python} if python else {}
    try:
        job_runner = submitit.AutoExecutor(private_jobs_folder(options.folder), cluster=cluster, **interpreter)
        job_runner.update_parameters(**{"name": "walkerlab", "timeout_min": 60, "cpus_per_task": 1} | parameters)
    # submitit checks the types of options by assertions.
    except (AssertionError, RuntimeError, TypeError, ValueError, NotImplementedError) as error:
        raise ConfigError(f"--engine slurm: {error}", "--engine-option cluster=local tries it locally.") from error
    queue = SlurmQueue(str(job_runner.parameters["time"])) if cluster == "slurm" else None
    submit = functools.partial(job_runner.submit, run_until_signalled)
    executor = JobExecutor(submit, options.workers or 16, None if queue is None else queue.wait)
    with environment_of_workers():
        try:
            yield executor
        finally:
            for job in list(executor.jobs):
                with contextlib.suppress(OSError):  # the job may have ended meanwhile
                    if not job.paths.result_pickle.exists():
                        job.cancel(check=False)


def number_or_text(text: str) -> int | float | str:
    """Return the whole or decimal number that a text holds, or the text itself.

    >>> [number_or_text(text) for text in ("60", "1.5", "24:00:00")]
    [60, 1.5, '24:00:00']
    """
    return int(text) if text.isdigit() else float(text) if re.fullmatch(r"\d+\.\d+", text) else text


def run_until_signalled(fn: Callable[..., Any], *args: Any) -> Any:
    """Run a function in a job. A signal that announces the end of the job raises JobEndsError in it."""
    announcement = os.environ.get("SUBMITIT_PREEMPT_SIGNAL", "USR2")
    numbers = (signal.Signals[f"SIG{announcement}"], signal.SIGTERM)
    for number in numbers:
        raise_on(number, JobEndsError)
    try:
        return fn(*args)
    finally:
        for number in numbers:  # a second signal must not prevent the result from being stored
            signal.signal(number, signal.SIG_IGN)


class SlurmQueue:
    """States of this user's Slurm jobs, read from the queue. submitit queries only Slurm's accounting database, which
    many clusters lack."""

    def __init__(self, time_limit: str) -> None:
        """Store the time limit of the jobs (min). Slurm is not queried before a state is needed."""
        self.time_limit = time_limit
        self._lock = threading.Lock()
        self._states: dict[str, str] = {}
        # Start as if the last query were long ago, so that the first call of `state` queries Slurm without waiting.
        self._listed_at = self._answered_at = time.monotonic() - LISTING_S

    def wait(self, job: Any) -> None:
        """Wait until a job has stored its result.

        Raises JobEndedError if the job ended without a result.
        """
        submitted = seen_alive = time.monotonic()
        while not job.paths.result_pickle.exists():
            state = self.state(job.job_id, submitted)
            if state in ENDED_STATES:
                if time.monotonic() - seen_alive > RESULT_S:
                    raise JobEndedError(self.describe(job, state))
            else:
                seen_alive = time.monotonic()
            time.sleep(1.0)

    def state(self, job_id: str, submitted: float) -> str:
        """Return the state of a job that was submitted at time `submitted` of the monotonic clock.

        GONE means that the queue no longer lists the job, SILENT that Slurm has not answered for a long time, and
        UNKNOWN that the last query failed or was made before the job was submitted.
        """
        with self._lock:
            now = time.monotonic()
            if now - self._listed_at >= LISTING_S:
                self._listed_at = now
                # With `all`, the list keeps finished jobs for a few minutes.
                command = ["squeue", "--noheader", "--me", "--states=all", "--format=%i %T"]
                done = subprocess.run(command, capture_output=True, text=True, check=False)
                if done.returncode == 0:
                    self._answered_at = now
                    self._states = dict(line.split()[:2] for line in done.stdout.splitlines())
            if self._answered_at == self._listed_at and self._listed_at > submitted:
                return self._states.get(job_id, GONE)
            return SILENT if now - self._answered_at > SILENT_WORKER_S else "UNKNOWN"

    def describe(self, job: Any, state: str) -> str:
        what = {
            "TIMEOUT": f"reached its time limit ({self.time_limit} min; --engine-option timeout_min=N)",
            "OUT_OF_MEMORY": "needed more memory than it may have (--engine-option mem_gb=N)",
            GONE: "left the queue",
            SILENT: f"is not known, because squeue has not answered for {SILENT_WORKER_S:.0f} s",
        }.get(state, f"ended: {state}")
        return f"Slurm job {job.job_id} {what}, without a result; its output: {job.paths.stderr}"


def private_jobs_folder(run_folder: Path) -> Path:
    """Create a folder for pickled jobs and results that only this user can open. Close an existing folder to others.

    This matters because loading a pickle runs the code in it.

    Raises ConfigError if other users may replace it, StorageError if it cannot be created or closed.
    """
    jobs = run_folder / "jobs"
    with storing(jobs):
        make_private_folder(run_folder)
        if may_be_foreign(run_folder.resolve()):
            raise ConfigError(
                f"--engine slurm: {run_folder} belongs to another user or is writable by others, which is unsafe "
                "because jobs are loaded from it.",
                f"Choose another folder with --runs, or close this one: chmod o-w {run_folder}",
            )
        if jobs.exists():
            make_private(jobs)
        make_private_folder(jobs)
    return jobs


class JobExecutor(SizedExecutor):
    """Executor that starts jobs through a library, and waits for each job in a thread."""

    def __init__(self, start: Callable[..., Any], size: int, wait_for: Callable[[Any], None] | None = None) -> None:
        """Store the functions that start a job and wait for it.

        start     called with a function and its arguments; returns a job whose `result()` waits
        wait_for  called with a job; returns when its result is there, or raises an error; None to call only `result()`
        """
        self._start = start
        self.size = size
        self._wait_for = wait_for
        self.jobs: set[Any] = set()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        job = self._start(fn, *args, **kwargs)
        self.jobs.add(job)

        def wait() -> None:
            try:
                if self._wait_for is not None:
                    self._wait_for(job)
                future.set_result(job.result())
            except BaseException as error:  # the error of a cancelled job need not be an Exception
                future.set_exception(error)
            self.jobs.discard(job)

        threading.Thread(target=wait, daemon=True).start()
        return future


def refuse_address(name: str, options: EngineOptions) -> None:
    """Raise ConfigError if an address is given for an engine that takes none."""
    if options.address:
        raise ConfigError(f"--engine {name}={options.address}: {name} takes no address.", "Only dask does.")


def extra(module: str, name: str) -> Any:
    """Import a library that is installed only with an extra of the package.

    Raises ConfigError if it is not installed.
    """
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


def parse_engine(text: str) -> tuple[SweepEngine, str]:
    """Return the engine and the address of NAME or NAME=ADDRESS.

    Raises ConfigError for an unknown name.
    """
    name, _, address = text.partition("=")
    if name not in ENGINES:
        raise ConfigError(f"--engine {text}: unknown engine; choose from {', '.join(ENGINES)}.")
    # This mark shows that multiprocessing has started this process, which runs the calling script again.
    if text == "dask" and getattr(current_process(), "_inheriting", False):
        raise ConfigError(
            "--engine dask: Dask's processes run the calling script again, which would start another sweep.", GUARD
        )
    return ENGINES[name], address
