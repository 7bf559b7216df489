"""Whole files, replaced in one step or not at all."""

import contextlib
import errno
import hashlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path

from walkerlab.errors import StorageError

TEMPORARY = ".*.tmp"
"""What the temporary files of writers look like; those found under the run folder's lock have no owner any more."""

ADVICE = {
    errno.ENOSPC: "Free some space, or choose another folder with --runs.",
    errno.EDQUOT: "Free some of your quota, or choose another folder with --runs.",
    errno.EFBIG: "The limit on file sizes (ulimit -f) is too small for this result.",
    errno.EROFS: "Choose a folder that can be written with --runs.",
    errno.EACCES: "Choose a folder that can be written with --runs.",
    errno.EPERM: "Choose a folder that can be written with --runs.",
    errno.ENOTDIR: "A file stands where a folder is needed; choose another folder with --runs.",
    errno.EEXIST: "A file stands where a folder is needed; choose another folder with --runs.",
    errno.EISDIR: "There is a folder where the result belongs; move it elsewhere.",
    errno.ENAMETOOLONG: "Choose a shorter folder with --runs, or a shorter name in the config.",
    errno.ELOOP: "A symbolic link stands in the way; choose another folder with --runs.",
    errno.EIO: "The disk reports an error; choose another folder with --runs.",
}


@contextlib.contextmanager
def storing(path: Path) -> Iterator[None]:
    """Turn whatever the operating system refuses while `path` is stored into StorageError."""
    try:
        yield
    except OSError as error:
        raise refused(path, error) from error


@contextlib.contextmanager
def drawing_into(folder: Path) -> Iterator[None]:
    """Turn the system's refusals to store into StorageError, around code that may fail in other ways: those pass."""
    try:
        yield
    except OSError as error:
        if error.errno not in ADVICE:
            raise
        raise refused(folder, error) from error


def refused(path: Path, error: OSError) -> StorageError:
    """What the system refused, and what to do about it."""
    advice = ADVICE.get(error.errno or 0, "Choose another folder with --runs.")
    return StorageError(f"{path} could not be stored: {error.strerror or error}.", advice)


def write_atomically(path: Path, *parts: bytes) -> None:
    """Put a file in place, complete and on the disk, or leave what was there untouched.

    parts  of its content, one after another

    Raises StorageError if the system refuses (full disk, read-only folder, ...).
    """
    with replacing(path) as temporary, temporary.open("xb") as file:
        file.writelines(parts)


def as_text(name: str) -> str:
    """A name from the command line as text that can be stored: bytes that are not UTF-8 are escaped."""
    return os.fsencode(name).decode(errors="backslashreplace")


def write_through(path: Path, data: bytes) -> None:
    """Write to a file that a user names: whole or not at all if it is a regular one, into it if it is a device or pipe.

    A link is followed, never replaced. Raises StorageError if the system refuses.
    """
    with storing(path):
        special = path.exists() and not stat.S_ISREG(path.stat().st_mode)
        if special:
            path.write_bytes(data)
            return
    write_atomically(path.resolve(), data)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file to be written, then put in place, complete and on the disk; if that fails nothing is changed.

    Raises StorageError if the system refuses.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    with storing(path):
        if not path.parent.is_dir():
            raise StorageError(f"{path} could not be stored: there is no folder {path.parent}.")
        try:
            yield temporary
            with temporary.open("rb") as file:
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            # there after a failure, and where it was a link to the very file that it was to replace
            with contextlib.suppress(OSError):
                temporary.unlink()
        if hasattr(os, "O_DIRECTORY"):  # elsewhere the system has no call for a folder's entries
            descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)


def refuse_full_disk(path: Path, size: int) -> None:
    """Raise OSError if the system has no room for a new file of so many bytes; none is left."""
    with path.open("xb") as file:
        try:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)
        finally:
            path.unlink()


def make_folder(path: Path) -> None:
    """Create a folder and its parents; StorageError if the system refuses."""
    with storing(path):
        path.mkdir(parents=True, exist_ok=True)


def read_bounded(path: Path, limit: int) -> bytes:
    """The bytes of a regular file of at most `limit` bytes; ValueError for anything else, OSError if unreadable."""
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise ValueError("not a regular file")
        if status.st_size > limit:
            raise ValueError(f"{status.st_size} bytes, more than the {limit} that an artifact may have")
        # The size it has, not the limit: reading sets the memory aside at once.
        return file.read(status.st_size)


def file_digest(path: Path) -> str | None:
    """The sha256 of a file's bytes, or None if there is no such file to read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def remove_leftovers(folder: Path) -> list[Path]:
    """Remove temporary files whose writers died, in a folder and below; to be called under its lock only."""
    leftovers = sorted(path for path in folder.rglob(TEMPORARY) if path.is_file())
    for path in leftovers:
        with storing(path):
            path.unlink(missing_ok=True)
    return leftovers
