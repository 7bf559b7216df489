"""Work that resumes: units of it are spread over processes in batches, and each is kept as soon as it is there."""

import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Final, NamedTuple

from walkerlab.errors import NoAnswer, WalkerlabError
from walkerlab.pipeline.progress import Progress
from walkerlab.store.checkpoint import Checkpoint, Numbers
from walkerlab.workers import WorkerDiedError, WorkerPool

SCOUTS: Final = 2
"""Units of the first batch, which goes ahead alone: it has the kernels compiled once and measures what a unit takes."""
MIN_BATCH_S: Final = 0.5
MAX_BATCH: Final = 1000
SHARES: Final = 3
"""A batch is at most this part of what is left to a worker, so that all end together."""
BUGS: Final = (ArithmeticError, AssertionError, AttributeError, ImportError, LookupError, NameError, TypeError)
"""Errors that mean a bug, which another attempt would meet again."""
MAX_DEATHS: Final = 12
"""Deaths before any batch has come back, after which it is the machine and not the work."""


class WorkUnit(NamedTuple):
    """Work that is computed in one go, and kept under its name.

    size  in what its progress counts
    run   computes the result, in any process
    """

    name: str
    size: int
    run: Callable[[], Any]


Batch = tuple[WorkUnit, ...]
"""Units that a process is sent at once."""
Timed = tuple[Any, float]
"""Result of a unit, and the time (s) it took."""


class InPlace(Executor):
    """Executor that calls in this process, at once."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call; raises what the call raises."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def compute(units: Batch) -> list[Timed]:
    """Compute units in this process."""
    results = []
    for unit in units:
        started = time.perf_counter()
        results.append((unit.run(), time.perf_counter() - started))
    return results


@dataclass
class Spread:
    """Units spread over an executor; a worker that dies takes nothing with it.

    todo     units, of which `left` are not handed out yet
    keep     takes units and their results as they arrive
    give_up  takes a unit that was attempted in vain, and why
    batch_s  how long a batch is to take, s; 0: a unit at a time
    unit_s   how long a unit takes, s; None before the first batch is back, which then goes ahead alone
    """

    todo: Iterator[WorkUnit]
    left: int
    keep: Callable[[Batch, Sequence[Timed]], None]
    give_up: Callable[[WorkUnit, BaseException], None]
    batch_s: float
    unit_s: float | None = None
    _again: deque[tuple[Batch, int]] = field(default_factory=deque)
    _running: dict[Future[Any], tuple[Batch, int]] = field(default_factory=dict)
    _deaths: int = 0
    _alive: bool = False

    def run(self, executor: Executor, workers: int) -> None:
        """Compute all units; `workers` is 0 if the executor works in place.

        Raises NoAnswer if no worker lives long enough to compute anything, and bugs at once.
        """
        while self.left or self._again or self._running:
            # as much as the workers can work on, and one batch more for each that waits
            most = 1 if self.unit_s is None else workers + 1
            while len(self._running) < most and (self._again or self.left):
                batch, failures = self._again.popleft() if self._again else (self._next_batch(workers), 0)
                self._running[executor.submit(compute, batch)] = batch, failures
            ended, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in ended:
                batch, failures = self._running.pop(future)
                error = future.exception()
                if error is None:
                    self._arrived(batch, future.result())
                else:
                    self._failed(batch, failures, error)

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
        # The first units also load the compiled code; the last ones tell better what the next will take.
        latest = max(1e-6, walls[-1] if self.unit_s is None else sum(walls) / len(walls))
        self.unit_s = latest if self.unit_s is None else 0.5 * (self.unit_s + latest)
        self.keep(batch, results)

    def _failed(self, batch: Batch, failures: int, error: BaseException) -> None:
        """Try a batch again, then split it, then give its unit up; a bug is raised."""
        if isinstance(error, BUGS) or (isinstance(error, WalkerlabError) and not isinstance(error, WorkerDiedError)):
            raise error
        self._deaths += 1
        if self._deaths > MAX_DEATHS and not self._alive:
            raise NoAnswer(
                f"no worker lives: {type(error).__name__}: {error}",
                "What was computed is kept, and the same command goes on. Look at memory and limits of this machine.",
            )
        middle = len(batch) // 2
        if failures and middle:
            self._again.extend((half, 1) for half in (batch[:middle], batch[middle:]))
        elif failures < 3:
            self._again.append((batch, failures + 1))
        else:
            self.unit_s = self.unit_s or 1.0
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
    """Compute the units that are not there yet, and keep each as soon as it is.

    checkpoint   what an earlier run has left, and where new results are kept
    jobs         processes
    shared_from  size of all units that takes longer than starting another process
    compiled     whether all kernels are there; otherwise the first unit goes ahead, so that one process compiles

    Returns the numbers of each unit, and the size of those that were computed.
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
        Spread(iter(waiting), len(waiting), keep, give_up, 0.0, 0.0 if compiled else None).run(executor, workers)
    return [checkpoint.kept[unit.name] for unit in units], size
