"""Keep files that Python executes (compiled code and pickles) where only this user can write."""

import contextlib
import os
import shutil
import stat
from pathlib import Path


def is_own(status: os.stat_result) -> bool:
    """Whether a file belongs to this user. True on systems without numbered owners, such as Windows."""
    return not hasattr(os, "geteuid") or status.st_uid == os.geteuid()


def is_foreign(path: Path) -> bool:
    """Whether a file, folder or link belongs neither to this user nor to root."""
    status = path.lstat()
    return not (is_own(status) or status.st_uid == 0)


def may_be_foreign(path: Path) -> bool:
    """Whether a user other than root and ourselves may have written a file or folder. For a link, assume so."""
    mode = path.lstat().st_mode
    return is_foreign(path) or stat.S_ISLNK(mode) or bool(mode & stat.S_IWOTH)


def make_private_folder(folder: Path) -> None:
    """Create a folder, and parents that do not exist, for this user alone."""
    # `mkdir` with `parents=True` would not make the parents private.
    for each in (*reversed(folder.parents), folder):
        each.mkdir(0o700, exist_ok=True)


def make_private(path: Path) -> list[Path]:
    """Remove other users' access to a file, or to a folder and everything in it. Delete files that others may have
    written, and return the paths of the deleted files.

    Raises OSError if such a file cannot be deleted.
    """
    if may_be_foreign(path):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
        return [path]
    status = path.lstat()
    if is_own(status) and status.st_mode & 0o077:
        path.chmod(status.st_mode & 0o700)
    deleted = []
    for each in list(path.iterdir()) if stat.S_ISDIR(status.st_mode) else ():
        with contextlib.suppress(FileNotFoundError):  # another process may have deleted it
            deleted += make_private(each)
    return deleted
