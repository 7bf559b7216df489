"""Tasks: stages with their arguments, to run in this or another process."""

import contextlib
import importlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import Any

from walkerlab.config.reads import only
from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.physics import kernel_cache
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.progress import StageReporter
from walkerlab.pipeline.run.workers import tell
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.files import drawing_into

Task = Callable[[StageReporter], Content]
"""A stage with its arguments; called with a reporter, it runs the stage."""


def task_of(stage: Stage, config: Config, inputs: Mapping[str, Content], **offered: Any) -> Task:
    """Build the task of a stage under a config, for this or another process. The arguments are as in `call_stage`."""
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
               again       whether to repeat walks to measure their numerical error, and to search for advice
               folder      run folder that the stage draws into
               left_out    results that are missing in a drawing, with the reasons
               early       what this run has drawn early from some of the results; None if nothing
    """
    # imported only now, because a stage loads libraries and compiled code
    run = importlib.import_module(module).run
    arguments = {name: offered[name] for name in offered.keys() & signature(run).parameters.keys()}
    folder = arguments.get("folder")
    drawing = contextlib.nullcontext() if folder is None else drawing_into(folder)
    try:
        with kernel_cache.watch_compilation(partial(note_compilation, reporter)), drawing:
            content = run(config, inputs, reporter, **arguments)
    except NoAnswer as error:
        partial_content = error.partial if isinstance(error.partial, Content) else Content()
        why = {"no_answer": {"message": error.message, "advice": error.advice}}
        return replace(partial_content, summary={**partial_content.summary, **why}, complete=False)
    if not isinstance(content, Content):
        raise TypeError(f"{module}.run returned {type(content).__name__}, not Content")
    return content


def note_compilation(reporter: StageReporter, kernel: str) -> None:
    reporter.note(f"compiling {kernel} for this walker; later runs reuse it")


class PipeReporter:
    """Reporter of a stage in a worker, which sends each call to the parent process."""

    def __getattr__(self, call: str) -> Callable[..., None]:
        """Return a function that sends the name of the call and its arguments."""
        return lambda *arguments: tell((call, *arguments))


def run_in_worker(task: Task) -> Content:
    """Run a stage in a worker and send its progress to the parent."""
    reporter: Any = PipeReporter()
    return task(reporter)
