"""Kernels of later stages compiled in other processes while earlier stages compile their own.

On a new machine they would otherwise wait for the compiler, one after the other. What is compiled goes into the cache
that all processes share. A stage whose kernels were not compiled ahead compiles for itself.
"""

import importlib
from collections.abc import Collection, Sequence
from concurrent.futures import Future
from functools import partial

from walkerlab.config.schema import Config
from walkerlab.errors import WalkerlabError
from walkerlab.pipeline.graph import Stage
from walkerlab.pipeline.task import nothing_compiled_yet
from walkerlab.workers import WorkerPool


def compile_kernels(module: str, config: Config, only_first: bool) -> None:
    """Compile the kernels of a stage; if they are to be the first, only where nothing is compiled yet."""
    stage = importlib.import_module(module)
    if not only_first or nothing_compiled_yet():
        stage.compile_kernels(config)


class Precompiler:
    """What is compiled ahead of stages, in the workers of a pool, and its errors."""

    def __init__(self, pool: WorkerPool, config: Config) -> None:
        """Nothing is compiled ahead so far."""
        self._pool, self._config = pool, config
        self._begun: dict[str, Future[None]] = {}

    @property
    def begun(self) -> bool:
        """Whether anything is."""
        return bool(self._begun)

    def begin(self, later: Sequence[Stage]) -> None:
        """Compile for the first of the later stages that takes long to compile."""
        slow = [stage for stage in later if stage.compiles_long]
        if slow:
            self._start(slow[0], only_first=False)

    def begin_if_first(self, stage: Stage) -> Future[None] | None:
        """Compile for a stage that takes long to, once, if nothing is compiled yet."""
        if not stage.compiles_long or stage.name in self._begun:
            return None
        return self._start(stage, only_first=True)

    def _start(self, stage: Stage, only_first: bool) -> Future[None]:
        work = partial(compile_kernels, stage.module, self._config, only_first)
        future = self._begun[stage.name] = self._pool.start(work)
        return future

    def wait_for(self, stage: Stage) -> None:
        """Let what is compiled for a stage be there before it runs, or have failed."""
        if stage.name in self._begun:
            self._begun[stage.name].exception()

    def raise_bugs(self, ran: Collection[str]) -> None:
        """Raise what stopped a compilation; what a user can act on, the stage itself has told.

        ran  names of the stages that ran: what is still compiled for others is not waited for
        """
        for name, future in self._begun.items():
            ended = (name in ran or future.done()) and not future.cancelled()
            error = future.exception() if ended else None
            if error is not None and not isinstance(error, WalkerlabError):
                raise error
