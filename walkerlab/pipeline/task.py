"""One stage ready to run, here or in another process, and what is compiled ahead of it."""

import contextlib
import importlib
import sys
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial
from inspect import signature
from typing import Any

from walkerlab import kernel_cache
from walkerlab.config.reads import only
from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer, WalkerlabError
from walkerlab.pipeline.graph import Stage
from walkerlab.pipeline.progress import Progress
from walkerlab.store.content import Content
from walkerlab.store.files import drawing_into
from walkerlab.workers import WorkerPool, tell


@dataclass(frozen=True)
class StageTask:
    """A stage with all that it is given.

    config   what it takes of the config
    inputs   the results that it gets
    offered  what else it may ask for, by the names of parameters of its `run`:
             jobs        processes for independent cells
             checkpoint  what an interrupted run has left of its result
             again       whether walks are taken a second time for their numerical error
             folder      of its run, which it draws into
             left_out    the results that it has to do without as it draws
    """

    name: str
    module: str
    config: Any
    inputs: Mapping[str, Content]
    offered: Mapping[str, Any]

    def run(self, progress: Progress) -> Content:
        """Call the stage's `run` with what it declared and nothing else."""
        # Imported now and not before: a stage brings its libraries and compiled code along.
        run = importlib.import_module(self.module).run
        given = {name: self.offered[name] for name in self.offered.keys() & signature(run).parameters.keys()}
        folder = given.get("folder")
        try:
            with contextlib.nullcontext() if folder is None else drawing_into(folder):
                content = run(self.config, self.inputs, progress, **given)
        except NoAnswer as error:
            partial = error.partial if isinstance(error.partial, Content) else Content()
            why = {"no_answer": {"message": error.message, "advice": error.advice}}
            return replace(partial, summary={**partial.summary, **why}, complete=False)
        if not isinstance(content, Content):
            raise TypeError(f"{self.module}.run returned {type(content).__name__}, not Content")
        return content


def task_of(stage: Stage, config: Config, inputs: Mapping[str, Content], **offered: Any) -> StageTask:
    """The task of a stage under a config; see `StageTask` for what may be offered."""
    return StageTask(stage.name, stage.module, only(config, stage.takes_under(config)), inputs, offered)


class PipeReporter:
    """The progress of a stage in a worker: each call is told as it is to the process that waits."""

    def __getattr__(self, call: str) -> Callable[..., None]:
        """What a stage calls."""
        return lambda *arguments: tell((call, *arguments))


def run_in_worker(task: StageTask) -> Content:
    """Run a stage in a worker, telling its progress."""
    reporter: Any = PipeReporter()
    importlib.import_module(task.module)
    with kernel_cache.watched(reporter.compiling):
        return task.run(reporter)


def nothing_compiled_yet() -> bool:
    """Whether what was imported has kernels, and none of them was compiled on this machine yet."""
    return "walkerlab.kernels" in sys.modules and kernel_cache.nothing_compiled_yet()


def compile_kernels(module: str, function: str, config: Config, only_first: bool) -> None:
    """Compile the kernels of a stage; with `only_first`, only where nothing is compiled yet."""
    stage = importlib.import_module(module)
    if not only_first or nothing_compiled_yet():
        getattr(stage, function)(config)


class Precompiler:
    """Kernels of later stages, compiled in the workers of a pool while earlier stages compile their own; their errors.

    On a new machine they would otherwise wait for the compiler, one after the other. What is compiled goes into the
    cache that all processes share. A stage whose kernels were not compiled ahead compiles for itself.
    """

    def __init__(self, pool: WorkerPool, config: Config) -> None:
        """Nothing is compiled ahead so far."""
        self._pool, self._config = pool, config
        self._begun: dict[str, Future[None]] = {}

    def begin(self, stage: Stage, only_first: bool) -> Future[None] | None:
        """Compile for a stage that takes long to compile, once; None if nothing is begun.

        only_first  only where nothing is compiled yet, which the worker finds out
        """
        if not stage.precompile or stage.name in self._begun:
            return None
        work = partial(compile_kernels, stage.module, stage.precompile, self._config, only_first)
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
