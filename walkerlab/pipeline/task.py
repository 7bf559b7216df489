"""Tasks: stages with their arguments, to run in this or another process; and compilation of kernels in advance."""

import contextlib
import importlib
import sys
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import Any

from walkerlab.config.reads import only
from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer, WalkerlabError
from walkerlab.physics import kernel_cache
from walkerlab.pipeline.graph import Stage
from walkerlab.pipeline.progress import StageReporter
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.files import drawing_into
from walkerlab.pipeline.workers import WorkerPool, tell

Task = Callable[[StageReporter], Content]
"""A stage with its arguments; called with a reporter, it runs the stage."""


def task_of(stage: Stage, config: Config, inputs: Mapping[str, Content], **offered: Any) -> Task:
    """Build the task of a stage under a config, for this or another process; arguments as in `call_stage`."""
    return partial(call_stage, stage.module, only(config, stage.takes_under(config)), inputs, offered)


def call_stage(
    module: str, config: Any, inputs: Mapping[str, Content], offered: Mapping[str, Any], reporter: StageReporter
) -> Content:
    """Call the `run` of a stage's module with the optional arguments that it declares.

    config   slice of the config that the stage takes
    inputs   results of other stages, by name
    offered  optional arguments, by name:
               jobs        maximum number of processes for independent work units
               checkpoint  work units that an interrupted run has computed
               again       whether to repeat walks to measure their numerical error
               folder      run folder that the stage draws into
               left_out    results that are missing in a drawing, with the reasons
    """
    # imported only now, because a stage loads libraries and compiled code
    run = importlib.import_module(module).run
    arguments = {name: offered[name] for name in offered.keys() & signature(run).parameters.keys()}
    folder = arguments.get("folder")
    drawing = contextlib.nullcontext() if folder is None else drawing_into(folder)
    try:
        with kernel_cache.watch_compilation(reporter.compiling), drawing:
            content = run(config, inputs, reporter, **arguments)
    except NoAnswer as error:
        partial_content = error.partial if isinstance(error.partial, Content) else Content()
        why = {"no_answer": {"message": error.message, "advice": error.advice}}
        return replace(partial_content, summary={**partial_content.summary, **why}, complete=False)
    if not isinstance(content, Content):
        raise TypeError(f"{module}.run returned {type(content).__name__}, not Content")
    return content


class PipeReporter:
    """Reporter of a stage in a worker; sends each call to the parent process."""

    def __getattr__(self, call: str) -> Callable[..., None]:
        """Return a function that sends the name of the call and its arguments."""
        return lambda *arguments: tell((call, *arguments))


def run_in_worker(task: Task) -> Content:
    """Run a stage in a worker and send its progress to the parent."""
    reporter: Any = PipeReporter()
    return task(reporter)


def nothing_compiled_yet() -> bool:
    """Whether the kernels are imported and none has been compiled on this machine yet."""
    return "walkerlab.physics.kernels" in sys.modules and kernel_cache.nothing_compiled_yet()


def compile_kernels(module: str, function: str, config: Config, only_first: bool) -> None:
    """Compile the kernels of a stage; with `only_first`, only if none has been compiled yet."""
    stage = importlib.import_module(module)
    if not only_first or nothing_compiled_yet():
        getattr(stage, function)(config)


class Precompiler:
    """Compiles kernels of later stages in workers while earlier stages compile theirs.

    On a new machine the stages would otherwise wait for the compiler one after the other. All processes share the
    cache of compiled code. A stage whose kernels were not compiled ahead compiles them itself.
    """

    def __init__(self, pool: WorkerPool, config: Config) -> None:
        """Start without any compilation."""
        self._pool, self._config = pool, config
        self._begun: dict[str, Future[None]] = {}

    def begin(self, stage: Stage, only_first: bool) -> Future[None] | None:
        """Start compiling a stage's kernels; return None if it has no `precompile` function or this was done before.

        only_first  compile only if the worker finds that no kernel has been compiled yet
        """
        if not stage.precompile or stage.name in self._begun:
            return None
        future = self._pool.submit(compile_kernels, stage.module, stage.precompile, self._config, only_first)
        self._begun[stage.name] = future
        return future

    def wait_for(self, stage: Stage) -> None:
        """Wait until the compilation of a stage's kernels ends, even if it fails."""
        if stage.name in self._begun:
            self._begun[stage.name].exception()

    def raise_bugs(self, ran: Collection[str]) -> None:
        """Re-raise a bug that stopped a compilation; the stage itself reports errors that a user can act on.

        ran  names of the stages that ran; compilations for other stages are not waited for
        """
        for name, future in self._begun.items():
            ended = (name in ran or future.done()) and not future.cancelled()
            error = future.exception() if ended else None
            if error is not None and not isinstance(error, WalkerlabError):
                raise error
