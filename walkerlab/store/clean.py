"""Which files of a run folder are this program's, and their removal; nothing else in it is touched."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from walkerlab.store.artifact import Damaged, read
from walkerlab.store.files import TEMPORARY, storing
from walkerlab.store.index import indexed_files
from walkerlab.store.runfolder import RECORD, RunFolder

DRAWN = ("figures/figure-*.svg", "figures/figure-*.png", "report.html", "report-*.html")
"""What the drawing stages write, for the case that the index of it is gone."""
CHUNKS, FIGURES = "sweep-chunks", "figures"
SWEPT = ("sweep-*.h5", "sweep-*.csv", f"{CHUNKS}/*.h5", "sweep.html", "figures/sweep-*.svg", "figures/sweep-*.png")
COMPARED = ("figures/diff-*.svg", "figures/diff-*.png")


def files_of(folder: RunFolder, stages: Iterable[str]) -> list[Path]:
    """The artifacts of these stages, the files that they list, and what killed writers left; those that exist."""
    found = {path for pattern in (*DRAWN, *SWEPT, *COMPARED, f"**/{TEMPORARY}") for path in folder.path.glob(pattern)}
    for stage in stages:
        found |= {folder.artifact(stage), folder.parts(stage)}
        found.update(listed_files(folder, stage))
    return sorted(path for path in found if path.is_file() or path.is_symlink())


def listed_files(folder: RunFolder, stage: str) -> Iterator[Path]:
    """The files that a stage's artifact lists, so far as they are inside the run folder."""
    try:
        names = indexed_files(read(folder.artifact(stage)))
    except (OSError, Damaged):
        return
    inside = folder.path.resolve()
    yield from (folder.path / name for name in names if (inside / name).resolve().is_relative_to(inside))


def remove(folder: RunFolder, files: Iterable[Path]) -> None:
    """Remove files of a run folder, its record, and its inner folders if they are empty; to be called under its lock.

    Raises StorageError if the system refuses.
    """
    for path in (*files, folder.path / RECORD):
        with storing(path):
            path.unlink(missing_ok=True)
    for emptied in (folder.figures, folder.path / CHUNKS):
        with contextlib.suppress(OSError):
            emptied.rmdir()


def remove_if_empty(folder: RunFolder) -> None:
    """Remove a run folder that has nothing in it but its lock; to be called after its lock was given back."""
    lock = folder.path / ".lock"
    if list(folder.path.iterdir()) == [lock]:
        with contextlib.suppress(OSError):
            lock.unlink()
            folder.path.rmdir()
