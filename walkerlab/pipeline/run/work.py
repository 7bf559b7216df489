"""Spread units of work over processes, in batches, and store the result of each unit at once, so that work can
resume."""

import contextlib
import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Final, NamedTuple

from walkerlab.errors import NoAnswer, WalkerlabError
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.run.workers import SizedExecutor, WorkerDiedError, WorkerPool
from walkerlab.pipeline.store.files import Checkpoint, Numbers

SCOUTS: Final = 2
"""Size of the first batch. It runs alone, because it compiles the kernels for all others and shows how long a unit
takes."""
MIN_BATCH_S: Final = 0.5
MAX_BATCH: Final = 1000
SHARES: Final = 3
"""A batch is at most 1/SHARES of the remaining work per worker (or MIN_BATCH_S), so that all workers finish at about
the same time."""
BUGS: Final = (ArithmeticError, AssertionError, AttributeError, ImportError, LookupError, NameError, TypeError)
"""Errors that indicate a bug. They are not retried, because a retry would only repeat them."""
MAX_DEATHS: Final = 12
"""Maximum number of worker deaths before the first result. More of them mean that the machine is the cause, not the
work.
"""
LAST_ATTEMPT: Final = 3
"""Number of failures after which a unit gets a last attempt. It then runs alone, because Dask blames the death of a
worker on every unit that the worker was given."""
NOTHING_COMPUTED: Final = "its job came to its time limit, or was stopped, before it had computed one unit"


class WorkUnit(NamedTuple):
    """Piece of work that is computed as a whole. Its result is stored under `name`."""

    name: str
    size: int  # number of parts that the unit counts for in the progress
    run: Callable[[], Any]  # function that computes the result; any process can call it


Batch = tuple[WorkUnit, ...]
"""Units that are sent to a process together."""
Timed = tuple[Any, float]
"""Result of a unit and its run time (s)."""


class InPlace(SizedExecutor):
    """Executor that runs each call immediately, in this process."""

    size = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run a call. Any error is raised immediately."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class JobEndsError(BaseException):
    """Raised in a cluster's job when a signal announces the job's end."""


class JobEndedError(WalkerlabError):
    """Raised for a cluster's job that ended before it had computed one unit."""

    exit_code = 4


def compute(units: Batch) -> list[Timed]:
    """Compute units in turn. If the process is about to be ended, return the results so far."""
    results: list[Timed] = []
    with contextlib.suppress(JobEndsError):
        for unit in units:
            started = time.perf_counter()
            results.append((unit.run(), time.perf_counter() - started))
    return results


@dataclass
class Spread:
    """Distributes work units over an executor's workers, and retries the units of workers that die."""

    todo: Iterator[WorkUnit]  # units that are not handed out yet
    left: int  # number of units left in `todo`
    keep: Callable[[Batch, Sequence[Timed]], None]  # called with units and their results as they arrive
    give_up: Callable[[WorkUnit, BaseException], None]  # called with a unit that failed repeatedly, and its last error
    batch_s: float  # target duration of a batch, s; 0 makes batches of one unit
    unit_s: float | None = None  # run time of a unit, s; None until the first batch has returned
    _again: deque[tuple[Batch, int]] = field(default_factory=deque)
    _suspects: deque[Batch] = field(default_factory=deque)  # units that run alone later, as their last attempt
    _running: dict[Future[Any], tuple[Batch, int]] = field(default_factory=dict)
    _deaths: int = 0
    _alive: bool = False

    def run(self, executor: SizedExecutor) -> None:
        """Compute all units.

        Raises NoAnswer if workers keep dying before they compute anything. An error that indicates a bug is raised at
        once.
        """
        while self.left or self._again or self._running or self._suspects:
            if not (self.left or self._again or self._running):
                self._again.append((self._suspects.popleft(), LAST_ATTEMPT))
            # There is always one batch more than there are workers, so that no worker has to wait for its next batch.
            max_running = 1 if self.unit_s is None else executor.size + 1
            while len(self._running) < max_running and (self._again or self.left):
                batch, failures = self._again.popleft() if self._again else (self._next_batch(executor.size), 0)
                self._running[executor.submit(compute, batch)] = batch, failures
            ended, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in ended:
                batch, failures = self._running.pop(future)
                error = future.exception()
                results = [] if error is not None else future.result()
                if results:
                    self._arrived(batch[: len(results)], results)
                    rest = batch[len(results) :]
                    # The worker had to end before it came to these units, so this does not count as a failure of
                    # theirs.
                    self._again.extend([(rest, 0)] if rest else [])
                else:
                    self._failed(batch, failures, error or JobEndedError(NOTHING_COMPUTED))

    def _next_batch(self, workers: int) -> Batch:
        size = min(self.left, self._batch_size(workers))
        self.left -= size
        return tuple(islice(self.todo, size))

    def _batch_size(self, workers: int) -> int:
        if not self.batch_s:
            return 1
        if self.unit_s is None:
            return SCOUTS
        least = MIN_BATCH_S / self.unit_s
        fair = self.left / (SHARES * max(1, workers))
        return max(1, min(MAX_BATCH, math.ceil(min(self.batch_s / self.unit_s, max(fair, least)))))

    def _arrived(self, batch: Batch, results: Sequence[Timed]) -> None:
        self._alive = True
        walls = [wall_s for _, wall_s in results]
        # The first units also load compiled code, so the last unit of the first batch gives a better estimate.
        latest = max(1e-6, walls[-1] if self.unit_s is None else sum(walls) / len(walls))
        self.unit_s = latest if self.unit_s is None else 0.5 * (self.unit_s + latest)
        self.keep(batch, results)

    def _failed(self, batch: Batch, failures: int, error: BaseException) -> None:
        """Retry a failed batch, then its halves, and give up on a unit that keeps failing.

        Errors that would only repeat, such as bugs, are re-raised.
        """
        of_worker = isinstance(error, WorkerDiedError | JobEndedError)
        if isinstance(error, BUGS) or (isinstance(error, WalkerlabError) and not of_worker):
            raise error
        self._deaths += 1
        if self._deaths > MAX_DEATHS and not self._alive:
            advice = "Results are kept: run the same command again to resume. Check this machine's memory and limits."
            raise NoAnswer(f"all worker processes died: {type(error).__name__}: {error}", advice)
        middle = len(batch) // 2
        if failures and middle:
            self._again.extend((half, 1) for half in (batch[:middle], batch[middle:]))
        elif failures + 1 < LAST_ATTEMPT:
            self._again.append((batch, failures + 1))
        elif failures < LAST_ATTEMPT:
            # If it stayed None, all further batches would run alone.
            self.unit_s = self.unit_s or 1.0
            self._suspects.append(batch)
        else:
            self.give_up(batch[0], error)


def complete(
    units: Sequence[WorkUnit],
    checkpoint: Checkpoint,
    label: str,
    progress: Progress,
    jobs: int,
    shared_from: int = 0,
    compiled: bool = False,
) -> tuple[list[Numbers], int]:
    """Compute the units that the checkpoint lacks, and add their results to it.

    checkpoint   units that an earlier run computed
    jobs         maximum number of processes
    shared_from  minimum total size for which starting processes saves time
    compiled     whether all kernels are compiled; if not, the first unit runs alone and compiles them once

    Returns the result of every unit, and the total size of the units that this call computed.
    """
    waiting = [unit for unit in units if unit.name not in checkpoint.kept]
    size = sum(unit.size for unit in waiting)
    total = sum(unit.size for unit in units)
    progress.start(label, total)
    progress.advance(total - size)

    def keep(batch: Batch, results: Sequence[Timed]) -> None:
        for unit, (numbers, _) in zip(batch, results, strict=True):
            checkpoint.keep(unit.name, numbers)
            progress.advance(unit.size)

    def give_up(_unit: WorkUnit, error: BaseException) -> None:
        raise error

    workers = min(jobs, len(waiting)) if min(jobs, len(waiting)) > 1 and size >= shared_from else 0
    with WorkerPool(workers) if workers else InPlace() as executor:
        Spread(iter(waiting), len(waiting), keep, give_up, 0.0, 0.0 if compiled else None).run(executor)
    return [checkpoint.kept[unit.name] for unit in units], size
