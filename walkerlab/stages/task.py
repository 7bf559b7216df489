"""One stage ready to run, here or in another process."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from walkerlab import kernel_cache
from walkerlab.config.reads import only
from walkerlab.config.schema import Config
from walkerlab.scene.left_out import LeftOut
from walkerlab.stages.graph import Stage
from walkerlab.stages.progress import Progress
from walkerlab.store.artifact import Stored
from walkerlab.store.content import Content
from walkerlab.store.files import drawing_into
from walkerlab.store.parts import Parts
from walkerlab.store.runfolder import RunFolder
from walkerlab.workers import tell


@dataclass(frozen=True)
class StageTask:
    """A stage with all that it is given.

    config    what it takes of the config
    inputs    the results that it gets
    jobs      processes for independent cells, None if it has none
    key       of its result, if it keeps parts of it; parts of another key are not used
    left_out  the results that it has to do without, if it draws
    """

    name: str
    module: str
    config: Any
    inputs: Mapping[str, Stored]
    folder: RunFolder
    jobs: int | None = None
    key: str | None = None
    left_out: tuple[LeftOut, ...] | None = None

    def run(self, progress: Progress) -> Content:
        """Call the stage's `run` with what it declared and nothing else."""
        # Imported now and not before: a stage brings its libraries and compiled code along.
        run = importlib.import_module(self.module).run
        extra: dict[str, Any] = {} if self.jobs is None else {"jobs": self.jobs}
        if self.key is not None:
            extra["parts"] = Parts(self.folder.parts(self.name), self.key)
        if self.left_out is not None:
            extra |= {"folder": self.folder.path, "left_out": self.left_out}
            with drawing_into(self.folder.path):
                content = run(self.config, self.inputs, progress, **extra)
        else:
            content = run(self.config, self.inputs, progress, **extra)
        if not isinstance(content, Content):
            raise TypeError(f"{self.module}.run returned {type(content).__name__}, not Content")
        return content


class PipeReporter:
    """The progress of a stage in a worker: each call is told as it is to the process that waits."""

    def start(self, label: str, total: int | None = None) -> None:
        """A piece of work begins."""
        tell(("start", label, total))

    def advance(self, n: int = 1) -> None:
        """So many more parts are done."""
        tell(("advance", n))

    def note(self, text: str) -> None:
        """One line."""
        tell(("note", text))

    def compiling(self, kernel: str) -> None:
        """A kernel is being compiled, or is there."""
        tell(("compiling", kernel))


def run_in_worker(task: StageTask) -> Content:
    """Run a stage in a worker, telling its progress."""
    reporter = PipeReporter()
    importlib.import_module(task.module)
    with kernel_cache.watched(reporter.compiling):
        return task.run(reporter)


def task_of(
    stage: Stage,
    config: Config,
    inputs: Mapping[str, Stored],
    folder: RunFolder,
    *,
    jobs: int,
    key: str,
    left_out: tuple[LeftOut, ...],
) -> StageTask:
    """The task of a stage; it is given of the rest what it asks for."""
    return StageTask(
        stage.name,
        stage.module,
        only(config, stage.takes_under(config)),
        inputs,
        folder,
        jobs if stage.has_cells else None,
        key if stage.keeps_parts else None,
        left_out if stage.draws else None,
    )


def nothing_compiled_yet() -> bool:
    """Whether what was imported has kernels, and none of them was compiled on this machine yet."""
    return "walkerlab.kernels" in sys.modules and kernel_cache.nothing_compiled_yet()
