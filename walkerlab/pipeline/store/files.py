"""Write files atomically, explain file system errors, format CSV that is safe in a spreadsheet, and keep checkpoints.

A checkpoint is a journal next to the artifact, from which an interrupted run resumes. The first line is the key of the
result, and one line follows for each unit of work. Every line has a checksum. Lines are only appended, and an
incomplete last line is dropped.
"""

import contextlib
import csv
import errno
import hashlib
import io
import itertools
import json
import os
import re
import secrets
import stat
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from walkerlab.errors import StorageError

TEMPORARY = ".*.tmp"
"""Pattern of temporary files. A process that holds the lock of the run folder may remove all of them."""

ADVICE = {
    errno.ENOSPC: "Free some space, or choose another folder with --runs.",
    errno.EDQUOT: "Free some of your quota, or choose another folder with --runs.",
    errno.EFBIG: "The limit on file sizes (ulimit -f) is too small for this result.",
    **dict.fromkeys((errno.EROFS, errno.EACCES, errno.EPERM), "Choose a writable folder with --runs."),
    errno.ENOTDIR: "A file stands where a folder is needed; choose another folder with --runs.",
    errno.EEXIST: "A file stands where a folder is needed; choose another folder with --runs.",
    errno.EISDIR: "There is a folder where the result belongs; move it elsewhere.",
    errno.ENAMETOOLONG: "Choose a shorter folder with --runs, or a shorter name in the config.",
    errno.ELOOP: "A symbolic link stands in the way; choose another folder with --runs.",
    errno.EIO: "The disk reports an error; choose another folder with --runs.",
}


@contextlib.contextmanager
def storing(path: Path) -> Iterator[None]:
    """Turn an OSError that is raised while storing `path` into a StorageError."""
    try:
        yield
    except OSError as error:
        raise refused(path, error) from error


@contextlib.contextmanager
def storage_errors(folder: Path) -> Iterator[None]:
    """Convert an OSError for which there is `ADVICE`, such as that of a full disk, to a StorageError about `folder`.

    Other errors of the `with` block are raised unchanged.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in ADVICE:
            raise
        raise refused(folder, error) from error


def refused(path: Path, error: OSError) -> StorageError:
    advice = ADVICE.get(error.errno or 0, "Choose another folder with --runs.")
    return StorageError(f"{path} could not be stored: {error.strerror or error}.", advice)


def write_atomically(path: Path, *parts: bytes) -> None:
    """Write a file completely, or leave the old one untouched.

    parts  pieces of the content, in order

    Raises StorageError if the file cannot be written (full disk, read-only folder, ...).
    """
    with replacing(path) as temporary, temporary.open("xb") as file:
        file.writelines(parts)


def write_numbered(path: Path, text: str) -> Path:
    """Write a text to `path`, or to a numbered path if `path` holds a different text, and return the path used.

    The numbered path is the first of `name-2`, `name-3`, ... that is free or holds the same text. A file that holds the
    same text is kept. Raises StorageError if the file cannot be written.
    """
    for number in itertools.count(1):
        place = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        with storing(place):
            if not place.exists():
                place.write_text(text, encoding="utf-8")
            if place.read_text(encoding="utf-8") == text:
                return place
    raise AssertionError("there is always another name")


def as_text(name: str) -> str:
    """Convert a name from the command line to text that can be stored, escaping bytes that are not UTF-8."""
    return os.fsencode(name).decode(errors="backslashreplace")


def write_through(path: Path, data: bytes) -> None:
    """Write to a file that a user names: a regular file atomically, a device or pipe directly.

    Links are followed, never replaced. Raises StorageError if the file cannot be written.
    """
    with storing(path):
        if path.exists() and not stat.S_ISREG(path.stat().st_mode):
            path.write_bytes(data)
            return
    write_atomically(path.resolve(), data)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a `with` block a temporary file that replaces `path` at the end. After an error, `path` is unchanged.

    Raises StorageError if the file cannot be written.
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
            # The temporary file is still there after a failure, or if it was a hard link to `path` itself.
            with contextlib.suppress(OSError):
                temporary.unlink()
        if hasattr(os, "O_DIRECTORY"):  # the entries of a folder can be flushed only on these systems
            descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)


def refuse_full_disk(path: Path, size: int) -> None:
    """Try to create a temporary file of `size` bytes, and raise OSError if the disk has no room for it."""
    with path.open("xb") as file:
        try:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)
        finally:
            path.unlink()


def make_folder(path: Path) -> None:
    """Create a folder and its parents.

    Raises StorageError if that fails.
    """
    with storing(path):
        path.mkdir(parents=True, exist_ok=True)


def read_bounded(path: Path, limit: int) -> bytes:
    """Read a regular file of at most `limit` bytes.

    Raises ValueError for other files, and OSError if the file cannot be read.
    """
    # Without O_NONBLOCK, opening a pipe waits for a writer. Without O_BINARY, Windows changes bytes.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise ValueError("not a regular file")
        if status.st_size > limit:
            raise ValueError(f"{status.st_size} bytes, more than the {limit} that an artifact may have")
        # `read` allocates memory for the size requested, so request the size of the file, not the limit.
        return file.read(status.st_size)


def file_digest(path: Path) -> str | None:
    """Return the sha256 of a file, or None if it cannot be read. Pipes and devices are not read, as they might never
    end."""
    with contextlib.suppress(OSError):
        if path.is_file():
            with path.open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
    return None


def remove_leftovers(folder: Path) -> list[Path]:
    """Remove temporary files of dead writers in a folder and below. Call this only under the lock."""
    leftovers = sorted(path for path in folder.rglob(TEMPORARY) if path.is_file())
    for path in leftovers:
        with storing(path):
            path.unlink(missing_ok=True)
    return leftovers


FORMULA = re.compile(r"[=+\-@\t\r]")
"""Pattern of the first character of texts that a spreadsheet would evaluate as formulas."""
NUMERAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def csv_text(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> bytes:
    """Format rows as CSV below a header. A missing value becomes an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(csv_cell, heads))
    writer.writerows(map(csv_cell, row) for row in rows)
    return text.getvalue().encode()


def csv_cell(value: Any) -> Any:
    """Convert a value to a CSV cell. Text that a spreadsheet would evaluate gets a leading apostrophe."""
    # Numbers such as -1.5 begin like a formula, but are harmless.
    if isinstance(value, str) and FORMULA.match(value) and not NUMERAL.fullmatch(value):
        return f"'{value}"
    return "" if value is None else value


Numbers = list[float]


class Checkpoint:
    """Numbers computed by the completed work units of a result, by unit name."""

    def __init__(self, path: Path | None, key: str) -> None:
        """Resume from the journal at `path` if its key matches, otherwise start over with the first unit.

        path  path of the journal; None to keep the numbers only in memory
        """
        self.path = path
        self.key = key
        self.kept: dict[str, Numbers] = {}
        self._intact = 0  # number of valid bytes at the beginning of the file
        with contextlib.suppress(OSError, ValueError, TypeError):  # the last line may be incomplete
            lines = [] if path is None else path.read_bytes().splitlines(keepends=True)
            for text in lines if lines[:1] == [line([key])] else []:
                entry = json.loads(text.partition(b" ")[2])
                if text != line(entry):
                    break
                # The first line is the key.
                if self._intact:
                    name, numbers = entry
                    self.kept[str(name)] = [float(number) for number in numbers]
                self._intact += len(text)

    def keep(self, name: str, numbers: Numbers) -> None:
        """Store the numbers of a work unit.

        Raises StorageError if they cannot be stored.
        """
        self.kept[name] = numbers
        if self.path is None:
            return
        with storing(self.path), self.path.open("r+b" if self._intact else "wb") as file:
            # An earlier process that was killed may have left an incomplete line.
            file.truncate(self._intact)
            file.seek(self._intact)
            if not self._intact:
                file.write(line([self.key]))
            file.write(line([name, numbers]))
            file.flush()
            os.fsync(file.fileno())
            self._intact = file.tell()

    def forget(self) -> None:
        """Remove all units.

        Raises StorageError if the journal cannot be removed.
        """
        self.kept = {}
        self._intact = 0
        if self.path is not None:
            with storing(self.path):
                self.path.unlink(missing_ok=True)


def line(value: object) -> bytes:
    """Encode a value as a line with its checksum. Numbers are restored exactly."""
    text = json.dumps(value, allow_nan=False).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)
