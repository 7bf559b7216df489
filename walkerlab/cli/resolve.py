"""What is named on the command line for short: the page of a run, and which of its walks is meant."""

from __future__ import annotations

from pathlib import Path

from walkerlab.errors import ConfigError, StaleError
from walkerlab.report.outcomes import MODELS
from walkerlab.stages.runs import run_named
from walkerlab.store.runfolder import RunFolder

PAGE = "report.html"


def page_of(run: str, runs: Path) -> Path:
    """The page of a run, as an absolute path; ConfigError if there is no such run, StaleError if it has no page."""
    folder = run_named(run, runs)
    page = (folder.path / PAGE).resolve()
    if not page.is_file():
        raise StaleError(f"{folder.path} has no page yet.", f"`walkerlab report -c {folder.typed}` writes it.")
    return page


def walk_in(folder: RunFolder, model: str | None = None) -> str:
    """The stage whose walk is meant: if none is named the contact model's before the rigid model's.

    Raises ConfigError if the one that is named does not walk.
    """
    if model is not None and model not in MODELS:
        raise ConfigError(f"--model {model}: not a walk.", f"There are {', '.join(MODELS)}.")
    if model is not None:
        return model
    rigid, contact = MODELS
    return rigid if folder.artifact(rigid).is_file() and not folder.artifact(contact).is_file() else contact
