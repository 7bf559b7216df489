"""Points handed to an engine in chunks, and what comes back; a worker that dies takes nothing with it."""

import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Final

from walkerlab.errors import NoAnswer
from walkerlab.sweeps.chunk import Chunk, ChunkTask, PointResult, SweepPoint, compute
from walkerlab.sweeps.engines import Order, SweepEngine

SCOUTS: Final = 2
"""Points of the first chunk, which goes ahead alone: it has the kernels compiled once and says what a point takes."""
LEAST_CHUNK_S: Final = 0.5
LARGEST_CHUNK: Final = 1000
SHARES: Final = 3
"""A chunk is at most this part of what is left to a worker, so that all end together."""
BUGS: Final = (ArithmeticError, AssertionError, AttributeError, ImportError, LookupError, NameError, TypeError)
"""Errors that mean a bug here, outside any point."""
MAX_DEATHS: Final = 12
"""Deaths before any chunk has come back, after which it is the machine and not the points."""


@dataclass
class FanOut:
    """One sweep's work on an engine.

    chunk_s  how long a chunk is to take, s
    todo     points, of which so many are `left`
    point_s  how long a point takes, s, once that is known
    """

    engine: SweepEngine
    order: Order
    chunk_s: float
    todo: Iterator[SweepPoint]
    left: int
    point_s: float | None = None
    _again: deque[ChunkTask] = field(default_factory=deque)
    _running: dict[Future[Chunk], ChunkTask] = field(default_factory=dict)
    _deaths: int = 0
    _alive: bool = False

    def run(self, graph: str, target: str, keep: Callable[[Chunk], None]) -> None:
        """Compute all points and hand each chunk to `keep`; points that could not be computed come as failed rows.

        Raises NoAnswer if no worker lives long enough to compute anything.
        """
        self.graph, self.target, self.keep = graph, target, keep
        with self.engine.opened(self.order) as pool:
            while self.left or self._again or self._running:
                # as much as the pool can work on, and one chunk more for each worker that waits
                most = 1 if self.point_s is None else pool.workers + 1
                while len(self._running) < most and (self._again or self.left):
                    one = self._again.popleft() if self._again else self._next_task(pool.workers)
                    self._running[pool.executor.submit(compute, one)] = one
                ended, _ = wait(self._running, return_when=FIRST_COMPLETED)
                for future in ended:
                    one = self._running.pop(future)
                    error = future.exception()
                    if error is None:
                        self._arrived(future.result())
                    else:
                        self._failed(one, error)

    def _next_task(self, workers: int) -> ChunkTask:
        size = min(self.left, self._chunk_size(workers))
        self.left -= size
        return ChunkTask(self.graph, self.target, tuple(islice(self.todo, size)))

    def _chunk_size(self, workers: int) -> int:
        if self.point_s is None:
            return SCOUTS
        least = LEAST_CHUNK_S / self.point_s
        fair = self.left / (SHARES * workers)
        return max(1, min(LARGEST_CHUNK, math.ceil(min(self.chunk_s / self.point_s, max(fair, least)))))

    def _arrived(self, chunk: Chunk) -> None:
        self._alive = True
        wall = sum(row.wall_s for row in chunk.rows)
        # The first points also load the compiled code; the last ones tell better what the next will take.
        latest = max(1e-6, chunk.rows[-1].wall_s if self.point_s is None else wall / len(chunk.rows))
        self.point_s = latest if self.point_s is None else 0.5 * (self.point_s + latest)
        self.keep(chunk)

    def _failed(self, one: ChunkTask, error: BaseException) -> None:
        """Try a chunk again, then split it, then give its point up; a bug is raised."""
        if isinstance(error, BUGS):
            raise error
        self._deaths += 1
        said = f"{type(error).__name__}: {error}"
        if self._deaths > MAX_DEATHS and not self._alive:
            raise NoAnswer(
                f"no worker lives: {said}",
                "What was computed is kept, and the same command goes on. Look at memory and limits of this machine.",
            )
        if one.failures and len(one.points) > 1:
            self._again.extend(replace(half, failures=1) for half in one.split())
        elif one.failures < 3:
            self._again.append(replace(one, failures=one.failures + 1))
        else:
            self.point_s = self.point_s or 1.0
            key = one.points[0].key
            self.keep(Chunk((PointResult(key, "failed", f"its worker died: {said}"),), {}))
