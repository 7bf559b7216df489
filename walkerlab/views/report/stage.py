"""The `report` stage: write HTML pages of all available results."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from walkerlab.config.schema import Config
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.store import artifact, content
from walkerlab.pipeline.store.files import storing, write_atomically
from walkerlab.scene.omissions import STILL_COMPUTED, STOPPED, LeftOut
from walkerlab.views.report import registry, tables
from walkerlab.views.report.blocks import MAIN, Results
from walkerlab.views.report.page import Page, pictures, render
from walkerlab.views.report.sections.closing import TITLES


def run(
    config: Config,
    inputs: Mapping[str, artifact.Stored],
    progress: Progress,
    folder: Path,
    left_out: Sequence[LeftOut] = (),
) -> content.Content:
    """Write the report's pages into the run's folder.

    Raises StorageError if a page cannot be stored.
    """
    progress.start("report", 1)
    written, results = write_pages(config, inputs, folder, left_out)
    progress.advance()
    blocks = (block for page in written for section in page.sections for block in section.blocks)
    files = artifact.index_files(folder, [folder / page.file for page in written])
    summary = {
        "html": MAIN,
        "pages": [page.file for page in written],
        "figures": [picture.title for picture in results.pictures],
        "tables": [block.caption for block in blocks if isinstance(block, tables.Table)],
    }
    return content.Content({artifact.FILES_GROUP: files}, summary)


def write_pages(
    config: Config, inputs: Mapping[str, artifact.Stored], folder: Path, left_out: Sequence[LeftOut] = ()
) -> tuple[tuple[Page, ...], Results]:
    """Write the pages for which there are results, and remove those that have no content any more.

    Raises StorageError if a page cannot be stored or removed.
    """
    # Results are pending if this is called while other stages are running, or after the command was stopped.
    pending = tuple(entry for entry in left_out if entry.why in (STILL_COMPUTED, STOPPED))
    absent = tuple(entry for entry in left_out if entry not in pending)
    names = {entry.what for entry in absent}
    failed = frozenset(name for name in names if has_failed(config, name, names))
    plain = Results(config, inputs, (), absent, pending, failed)
    results = replace(plain, pictures=pictures(inputs, folder, numbered=bool(plain.claims)))
    pages = registry.pages_of(results, folder.name)
    for page in pages:
        write_atomically(folder / page.file, render(page).encode())
    for file in set(TITLES) - {page.file for page in pages}:
        with storing(folder / file):
            (folder / file).unlink(missing_ok=True)
    return pages, results


def has_failed(config: Config, name: str, left_out: set[str]) -> bool:
    """Whether a stage ran and failed, rather than lacking the result of another stage."""
    if name not in PIPELINE["report"].inputs(config) or PIPELINE[name].why_unsuited(config) is not None:
        return False
    return left_out.isdisjoint(PIPELINE[name].inputs(config))
