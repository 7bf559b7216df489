"""Index of the files that a drawing stage wrote, with their digests, as a group of its artifact."""

import hashlib
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

import numpy as np

from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.pipeline.store.files import file_digest

GROUP = "files"


def index(folder: Path, files: Iterable[Path]) -> Group:
    """Build the group that lists files below a run folder, for storage under the name `GROUP`.

    Raises ValueError for a file outside the folder and FileNotFoundError for a missing one.
    """
    listed = sorted(files)
    names = [path.relative_to(folder).as_posix() for path in listed]
    digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in listed]
    return Group(
        {
            "file": Variable(np.array(names, dtype=object), ("file",), "", "path in the run folder"),
            # figures that plot run times differ between runs, so the content's digest excludes the digests of files
            "sha256": Variable(np.array(digests, dtype=object), ("file",), "", "sha256 of the file", timing=True),
        }
    )


def indexed_files(content: Content) -> dict[str, str]:
    """Return the digest of each listed file, by path in the run folder. It is empty if the content has no list."""
    group = content.groups.get(GROUP)
    return dict(zip(group["file"].tolist(), group["sha256"].tolist(), strict=True)) if group is not None else {}


def broken_file(folder: Path, content: Content) -> str | None:
    """Describe the first listed file that is missing or altered, or return None if all are intact."""
    for name, digest in indexed_files(content).items():
        current = file_digest(folder / PurePosixPath(name))
        if current is None:
            return f"{name} is missing"
        if current != digest:
            return f"{name} was altered"
    return None
