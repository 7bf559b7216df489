"""What is named on the command line for short: the page of a run, and which of its walks is meant."""

from __future__ import annotations

from pathlib import Path

from walkerlab.errors import StaleError
from walkerlab.report.outcomes import MODELS
from walkerlab.stages.runs import run_named

PAGE = "report.html"


def page_of(run: Path, runs: Path) -> Path:
    """The page of a run, as an absolute path; StaleError if it was not written yet."""
    folder = run_named(str(run), runs).path
    page = (folder / PAGE).resolve()
    if not page.is_file():
        raise StaleError(f"{folder} has no page yet.", f"`walkerlab report -c {folder}` writes it.")
    return page


def walk_in(folder: Path) -> str:
    """The stage whose walk is meant if none is named: the contact model's before the rigid model's."""
    rigid, contact = MODELS
    return rigid if (folder / f"{rigid}.h5").is_file() and not (folder / f"{contact}.h5").is_file() else contact
