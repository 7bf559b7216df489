"""Runs as they are named on the command line: a folder, or its name in the folder of all runs."""

from __future__ import annotations

from pathlib import Path

from walkerlab.config.problems import nearest
from walkerlab.errors import StaleError

PAGE = "report.html"


def folder_of(run: Path, runs: Path) -> Path:
    """The folder of a run; StaleError with the nearest name if there is none."""
    for folder in (run, runs / run):
        if folder.is_dir():
            return folder
    there = sorted(path.name for path in runs.iterdir() if path.is_dir()) if runs.is_dir() else []
    near = nearest(run.name, there)
    meant = f" Did you mean {near}?" if near else f" There are {', '.join(there)}." if there else ""
    raise StaleError(f"there is no run {run}.{meant}", "`walkerlab report` makes the run of the paper config.")


def page_of(run: Path, runs: Path) -> Path:
    """The page of a run, as an absolute path; StaleError if it was not written yet."""
    folder = folder_of(run, runs)
    page = (folder / PAGE).resolve()
    if not page.is_file():
        raise StaleError(f"{folder} has no page yet.", f"`walkerlab report -c {folder}` writes it.")
    return page
