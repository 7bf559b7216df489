"""Graphs of stages, and the pipeline, which is the graph of all stages, including those of extensions.

Drawings come near the end, and the report comes last.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from walkerlab.errors import ConfigError
from walkerlab.extensions import extensions, load
from walkerlab.pipeline.plan.stage import DRAWINGS, Stage

if TYPE_CHECKING:
    from walkerlab.config.schema import Config


class Graph:
    """Stages of a pipeline, each after the stages that it needs.

    at  import path of the graph, module:NAME, by which other processes find it; needed for sweeps
    """

    def __init__(self, *stages: Stage, at: str = "") -> None:
        """Store the stages.

        Raises ValueError if two stages have the same name.
        """
        self.stages = stages
        self.at = at
        self._by_name = {stage.name: stage for stage in stages}
        if len(self._by_name) != len(stages):
            raise ValueError("two stages have the same name")

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str, ...]]:
        """Pickle only the import path, because stages hold functions that cannot be pickled."""
        if not self.at:
            raise TypeError("a graph without `at`, its import path, cannot be sent to other processes")
        return load, (self.at,)

    def __getitem__(self, name: str) -> Stage:
        return self._by_name[name]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._by_name)

    def needed_for(self, target: str, config: "Config") -> tuple[Stage, ...]:
        """Return the target and all stages that it needs under a config, in running order."""
        needed = {target}
        for stage in reversed(self.stages):
            if stage.name in needed:
                needed.update(stage.inputs(config))
        return tuple(stage for stage in self.stages if stage.name in needed)

    def needed_in_memory(self, target: str, config: "Config") -> tuple[Stage, ...]:
        """Return the stages as `needed_for` does.

        Raises ConfigError if one of them lacks a config block or draws files.
        """
        stages = self.needed_for(target, config)
        for stage in stages:
            if stage.draws:
                raise ConfigError(f"{stage.name} only writes files to a run folder and has no result in memory.")
            stage.refuse_unsuited(target, config)
        return stages

    def campaigns_of(self, target: str) -> tuple[Stage, ...]:
        """Return the long stages that only `target --full` runs."""
        return tuple(stage for stage in self.stages if stage.only_by == f"{target} --full")


by_name: dict[str, Stage] = {}
for extension in extensions().values():
    for stage in extension.stages:
        by_name.setdefault(stage.name, stage)  # `check_names` reports duplicate names
STAGES = tuple(by_name.values())


def complete(drawing: Stage) -> Stage:
    """Add the stages that name a drawing in `needed_by` or `shown_by` to the drawing's inputs.

    A stage with the same name as a config block is needed only by configs with that block.
    """
    needed = tuple(stage for stage in STAGES if drawing.name in stage.needed_by)
    shown_names = tuple(stage.name for stage in STAGES if drawing.name in stage.shown_by)

    def inputs(config: "Config") -> tuple[str, ...]:
        needed_names = (
            stage.name for stage in needed if stage.name not in stage.requires or getattr(config, stage.name)
        )
        return (*drawing.inputs(config), *needed_names)

    return replace(drawing, inputs=inputs, if_current=(*drawing.if_current, *shown_names))


PIPELINE = Graph(
    *(stage for stage in STAGES if not stage.draws),
    # The report comes last, because it shows what all others have drawn.
    *(complete(stage) for stage in STAGES if stage.draws and stage.name not in DRAWINGS),
    *(complete(stage) for stage in STAGES if stage.name in DRAWINGS),
    at="walkerlab.pipeline.plan.graph:PIPELINE",
)
