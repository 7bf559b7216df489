"""The report: one HTML page of everything that there is a result of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from walkerlab.config.schema import Config
from walkerlab.report.blocks import Section, Table
from walkerlab.report.lead import lead, title
from walkerlab.report.page import render
from walkerlab.report.pictures import pictures
from walkerlab.report.registry import sections_of
from walkerlab.report.results import Absent, Results
from walkerlab.stages.graph import PIPELINE
from walkerlab.stages.plan import LeftOut
from walkerlab.stages.progress import Progress
from walkerlab.store import index
from walkerlab.store.artifact import Stored
from walkerlab.store.content import Content
from walkerlab.store.files import write_atomically

PAGE = "report.html"


def run(
    config: Config,
    inputs: Mapping[str, Stored],
    progress: Progress,
    folder: Path,
    left_out: Sequence[LeftOut] = (),
) -> Content:
    """Write the page into the run's folder.

    inputs    results by stage: those that there are
    left_out  the stages without a result, and why

    Raises StorageError if the page cannot be stored.
    """
    progress.start("report", 1)
    results = Results(whole(config), inputs, pictures(inputs, folder), absent(config, left_out))
    sections = sections_of(results)
    page = folder / PAGE
    write_atomically(page, render(title(folder.name), lead(results, folder.name), sections).encode())
    progress.advance()
    return Content(
        {index.GROUP: index.index(folder, [page])},
        {
            "html": PAGE,
            "figures": [picture.title for picture in results.pictures],
            "tables": [block.caption for block in blocks_of(sections) if isinstance(block, Table)],
        },
    )


def whole(config: Config) -> Config:
    """The config itself, all keys of which this stage declares, instead of the view on it."""
    return Config.model_construct(**{name: getattr(config, name) for name in Config.model_fields})


def absent(config: Config, left_out: Sequence[LeftOut]) -> tuple[Absent, ...]:
    """What there is no result of; what was tried itself, and not given up for want of another, has failed."""
    names = {entry.what for entry in left_out}
    return tuple(Absent(one.what, one.why, has_failed(config, one.what, names), one.saves) for one in left_out)


def has_failed(config: Config, name: str, left_out: set[str]) -> bool:
    """Whether a stage without a result was run and found no answer."""
    stage = next((stage for stage in PIPELINE.stages if stage.name == name), None)
    if stage is None or name not in PIPELINE["report"].inputs(config):
        return False
    without_contact = stage.needs_contact and config.contact is None
    return not without_contact and left_out.isdisjoint(stage.inputs(config))


def blocks_of(sections: Sequence[Section]) -> list[object]:
    """All blocks of the page."""
    return [block for section in sections for block in section.blocks]
