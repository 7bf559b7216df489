"""Find and remove this program's files in a run folder. Other files stay."""

import contextlib
from collections.abc import Iterable
from pathlib import Path

from walkerlab.pipeline.store.artifact import Damaged, read
from walkerlab.pipeline.store.files import TEMPORARY, storing
from walkerlab.pipeline.store.index import indexed_files
from walkerlab.pipeline.store.runfolder import LOCK, RECORD, WORKER, RunFolder

DRAWN = ("figures/figure-*.svg", "figures/figure-*.png", "report.html", "report-*.html")
"""Patterns of the files that drawing stages write, needed if their index is lost."""
CHUNKS = "sweep-chunks"
FIGURES = "figures"
UNFINISHED = (TEMPORARY, f"{FIGURES}/{TEMPORARY}", f"{CHUNKS}/{TEMPORARY}")
SWEPT = ("sweep-*.h5", "sweep-*.csv", f"{CHUNKS}/*.h5", "sweep.html", "figures/sweep-*.svg", "figures/sweep-*.png")
STATE_FILES = (RECORD, LOCK, WORKER)
STATE_ENDINGS = (".h5", ".parts")
COMPARED = ("figures/diff-*.svg", "figures/diff-*.png")


def files_of(folder: RunFolder, stages: Iterable[str]) -> list[Path]:
    """Return the existing files of a run: results of these stages, drawings, sweeps and leftovers of killed writers."""
    files = {path for pattern in (*DRAWN, *SWEPT, *COMPARED, *UNFINISHED) for path in folder.path.glob(pattern)}
    inside = folder.path.resolve()
    for stage in stages:
        files |= {folder.artifact(stage), folder.checkpoint(stage)}
        with contextlib.suppress(OSError, Damaged):
            listed = indexed_files(read(folder.artifact(stage)))
            files |= {folder.path / name for name in listed if (inside / name).resolve().is_relative_to(inside)}
    return sorted(path for path in files if path.is_file() or path.is_symlink())


def owner_of(path: Path, stages: Iterable[str]) -> RunFolder | None:
    """Return the run that a result, drawing or record belongs to, or None for the user's own files."""
    resolved = path.resolve()
    for place in (resolved.parent, resolved.parent.parent):
        folder = RunFolder.open_folder(place)
        if folder.record() is None and not any(place.glob("*.h5")):
            continue
        is_state = resolved.parent == place and (resolved.suffix in STATE_ENDINGS or resolved.name in STATE_FILES)
        if is_state or resolved in {file.resolve() for file in files_of(folder, stages)}:
            return folder
    return None


def remove(folder: RunFolder, files: Iterable[Path]) -> None:
    """Remove files of a run folder, its record and its empty subfolders. Call this under the lock.

    Raises StorageError if a file cannot be removed.
    """
    for path in (*files, folder.path / RECORD):
        with storing(path):
            path.unlink(missing_ok=True)
    for emptied in (folder.figures, folder.path / CHUNKS):
        with contextlib.suppress(OSError):
            emptied.rmdir()


def remove_if_empty(folder: RunFolder) -> None:
    """Remove a run folder that holds only its lock. Call this after releasing the lock."""
    lock = folder.path / LOCK
    if list(folder.path.iterdir()) == [lock]:
        with contextlib.suppress(OSError):
            lock.unlink()
            folder.path.rmdir()
