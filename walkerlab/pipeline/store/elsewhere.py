"""Reuse of results with the same stage key from other run folders."""

import mmap
import os
import shutil
from pathlib import Path

from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.pipeline.store.files import replacing
from walkerlab.pipeline.store.runfolder import RunFolder


def find_elsewhere(folder: RunFolder, stage: str, key: str) -> tuple[Path, Stored] | None:
    """Find the file and result for a key in another run folder; None if no folder has it. Damaged files are ignored."""
    try:
        names = sorted(entry.name for entry in os.scandir(folder.runs_dir) if entry.is_dir())
    except OSError:
        return None
    for path in (RunFolder(folder.runs_dir, name).artifact(stage) for name in names if name != folder.name):
        if mentions(path, key):
            verdict = artifact.check(path, key)
            if verdict.accepted and verdict.artifact is not None:
                return path, verdict.artifact
    return None


def mentions(path: Path, key: str) -> bool:
    """Whether a file contains a key; a cheap test before the file is read and verified."""
    try:
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return data.find(key.encode()) >= 0
    except (OSError, ValueError):  # the file is missing, not a regular file, or empty
        return False


def take_over(origin: Path, target: Path) -> None:
    """Link or copy a result's file to `target`.

    Sharing is safe, since artifacts are replaced but never modified. Raises StorageError if neither works.
    """
    with replacing(target) as temporary:
        try:
            os.link(origin, temporary)
        except OSError:
            shutil.copyfile(origin, temporary)
