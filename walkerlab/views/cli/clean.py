"""`walkerlab clean`: remove the results of a run."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import typer

from walkerlab.pipeline.store.clean import CHUNKS, FIGURES, files_of, remove, remove_if_empty
from walkerlab.pipeline.store.runfolder import RunFolder
from walkerlab.views.cli.failures import print_result
from walkerlab.views.cli.request import Request


def clean_folders(request: Request, every: bool, stages: Sequence[str], yes: bool) -> None:
    """Delete the stages' files of one run or, with `every`, of all runs, after confirmation, and remove emptied
    folders.

    Raises typer.BadParameter if there is no terminal to ask on, LockedError (with `--no-wait`) and StorageError.
    """
    if every:
        names = sorted(path.name for path in request.runs.iterdir() if path.is_dir()) if request.runs.is_dir() else []
        folders = [RunFolder(request.runs, name) for name in names]
    else:
        folders = [request.folder]
    files_by_folder = {folder: files_of(folder, stages) for folder in folders}
    files = [path for paths in files_by_folder.values() for path in paths]
    sizes = {path: path.lstat().st_size for path in files}
    where = folders[0].path if len(folders) == 1 else request.runs
    if files and not (yes or request.dry_run):
        if not sys.stdin.isatty():
            raise typer.BadParameter("cannot ask for confirmation without a terminal; give --yes", param_hint="--yes")
        if not typer.confirm(f"Remove {len(files)} files from {where}?", err=True):
            files_by_folder = {}
            files = []
    if not request.dry_run:
        for folder, paths in files_by_folder.items():
            if paths:
                with folder.locked(not request.no_wait, request.console.note):
                    remove(folder, paths)
                remove_if_empty(folder)
    verb = "would be removed" if request.dry_run else "removed"
    lines = [f"{verb}: {line}" for line in file_lines(files, sizes)] or [f"{where}: nothing {verb}"]
    print_result(request, {"run_dir": str(where), "removed": [*map(str, files)], "dry_run": request.dry_run}, lines)


def file_lines(files: Sequence[Path], sizes: Mapping[Path, int]) -> list[str]:
    """Return a line for each file, but only one line for all figures of a run and for all chunks of a sweep."""
    lines: dict[str, list[Path]] = {}
    for path in files:
        stem = {CHUNKS: f"{path.stem.rpartition('-')[0]}-*", FIGURES: "*"}.get(path.parent.name, path.name)
        lines.setdefault(str(path.parent / stem), []).append(path)
    return [
        line if len(paths) == 1 else f"{line} ({len(paths)} files, {sum(sizes[path] for path in paths) / 1e6:.1f} MB)"
        for line, paths in lines.items()
    ]
