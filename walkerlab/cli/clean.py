"""`walkerlab clean`: remove the results of a run."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import typer

from walkerlab.cli.failures import print_json
from walkerlab.cli.request import Request
from walkerlab.store.clean import files_of, remove


def clean_run(request: Request, stages: Sequence[str], *, yes: bool, dry_run: bool, wait: bool) -> None:
    """Remove the files of these stages from the run's folder, once the user agrees.

    Raises typer.BadParameter if nobody can be asked, LockedError (only without `wait`) and StorageError.
    """
    folder = request.folder
    files = files_of(folder, stages)
    if files and not (yes or dry_run) and not agreed(folder.path, files):
        files = []
    if files and not dry_run:
        with folder.locked(wait, request.console.note):
            remove(folder, files)
    names = [str(path) for path in files]
    if request.as_json:
        print_json({"run_dir": str(folder.path), "removed": names, "dry_run": dry_run})
    else:
        said = "would be removed" if dry_run else "removed"
        print("\n".join([f"{said}: {name}" for name in names] or [f"{folder.path}: nothing {said}"]))


def agreed(folder: Path, files: Sequence[Path]) -> bool:
    """Ask; typer.BadParameter if there is no terminal to ask on."""
    if not sys.stdin.isatty():
        raise typer.BadParameter("there is no terminal to ask on; say --yes", param_hint="--yes")
    return typer.confirm(f"Remove {len(files)} files from {folder}?", err=True)
