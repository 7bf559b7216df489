"""The pipeline: the stages of all extensions, drawings last and the report at the end (see extensions.py)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from walkerlab.extensions import extensions
from walkerlab.pipeline.stage import DRAWINGS, Graph, Stage

if TYPE_CHECKING:
    from walkerlab.config.schema import Config

by_name: dict[str, Stage] = {}
for extension in extensions().values():
    for stage in extension.stages:
        by_name.setdefault(stage.name, stage)  # commands refuse equal names, with advice
STAGES = tuple(by_name.values())


def complete(drawing: Stage) -> Stage:
    """Add the stages to a drawing that say that it needs or shows their results."""
    needed = tuple(stage.name for stage in STAGES if drawing.name in stage.needed_by)
    shown = tuple(stage.name for stage in STAGES if drawing.name in stage.shown_by)

    def inputs(config: Config) -> tuple[str, ...]:
        return (*drawing.inputs(config), *needed)

    return replace(drawing, inputs=inputs, if_current=(*drawing.if_current, *shown))


PIPELINE = Graph(
    *(stage for stage in STAGES if not stage.draws),
    # the report shows what all others have drawn
    *(complete(stage) for stage in STAGES if stage.draws and stage.name not in DRAWINGS),
    *(complete(stage) for stage in STAGES if stage.name in DRAWINGS),
    at="walkerlab.pipeline.graph:PIPELINE",
)
