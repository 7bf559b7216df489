"""Checkpoint of a long computation, from which an interrupted run resumes.

A journal next to the artifact: first the key of the result, then a line for each unit of work, each with a checksum.
Lines are only appended; an incomplete last line is dropped.
"""

import contextlib
import json
import os
import zlib
from pathlib import Path

from walkerlab.pipeline.store.files import storing

Numbers = list[float]


class Checkpoint:
    """Numbers computed by the completed work units of one result, by name of the unit."""

    def __init__(self, path: Path | None, key: str) -> None:
        """Resume from the journal at `path` if its key matches, otherwise start over with the first unit.

        path  path of the journal; None to keep the numbers only in memory
        """
        self.path = path
        self.key = key
        self.kept: dict[str, Numbers] = {}
        self._intact = 0  # number of valid bytes in the file
        with contextlib.suppress(OSError, ValueError, TypeError):  # the last line may be incomplete
            lines = [] if path is None else path.read_bytes().splitlines(keepends=True)
            for text in lines if lines[:1] == [line([key])] else []:
                entry = json.loads(text.partition(b" ")[2])
                if text != line(entry):
                    break
                if self._intact:
                    name, numbers = entry
                    self.kept[str(name)] = [float(number) for number in numbers]
                self._intact += len(text)

    def keep(self, name: str, numbers: Numbers) -> None:
        """Add the numbers of a unit.

        Raises StorageError if they cannot be stored.
        """
        self.kept[name] = numbers
        if self.path is None:
            return
        with storing(self.path), self.path.open("r+b" if self._intact else "wb") as file:
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
