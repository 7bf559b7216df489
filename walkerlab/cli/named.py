"""What is named on the command line for short: the page of a run, and which of its walks is meant."""

from __future__ import annotations

from pathlib import Path

from walkerlab.errors import StaleError
from walkerlab.report.outcomes import CONTACT, RIGID
from walkerlab.stages.runs import run_named

PAGE = "report.html"
WALKS = (CONTACT, RIGID)
"""Stages that walk; the first that a run has is shown."""


def page_of(run: Path, runs: Path) -> Path:
    """The page of a run, as an absolute path; StaleError if it was not written yet."""
    folder = run_named(str(run), runs).path
    page = (folder / PAGE).resolve()
    if not page.is_file():
        raise StaleError(f"{folder} has no page yet.", f"`walkerlab report -c {folder}` writes it.")
    return page


def walk_in(folder: Path) -> str:
    """The stage whose walk is meant if none is named."""
    return next((stage for stage in WALKS if (folder / f"{stage}.h5").is_file()), WALKS[0])
