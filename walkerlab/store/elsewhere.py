"""Results in other run folders: a stage key names a result wherever it lies."""

import mmap
import os
import shutil
from pathlib import Path

from walkerlab.store import artifact
from walkerlab.store.artifact import Stored
from walkerlab.store.files import replacing
from walkerlab.store.runfolder import RunFolder


def find_elsewhere(folder: RunFolder, stage: str, key: str) -> tuple[Path, Stored] | None:
    """File and result for a key in another run folder beside this one, or None; never raises for what files may be."""
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
    """Whether a file has a key in it: most have another, and need not be read and verified to know that."""
    try:
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return data.find(key.encode()) >= 0
    except (OSError, ValueError):  # not there, no file, or empty
        return False


def take_over(found: Path, target: Path) -> None:
    """Put a result's file in place under `target` too: a hard link, or a copy where the system has none.

    Artifacts are only ever replaced, so that a shared file is as safe as one's own. Raises StorageError if the system
    refuses.
    """
    with replacing(target) as temporary:
        try:
            os.link(found, temporary)
        except OSError:
            shutil.copyfile(found, temporary)
