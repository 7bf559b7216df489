"""Destination of an export: a format and a file that must not be overwritten by mistake."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from walkerlab.errors import ConfigError, StorageError
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.store.files import storing, write_through
from walkerlab.pipeline.store.runs import owner_of
from walkerlab.views.cli.console import Console


@dataclass(frozen=True)
class Target:
    """Destination of an export."""

    to: str | None  # format, or file name if `output` is None
    output: Path | None  # file; None derives its name from the run
    inputs: tuple[Path, ...] = ()  # files that the command reads, which must not be overwritten

    def choose_file(self, what: str, stem: str, kinds: Sequence[str]) -> tuple[Path, str]:
        """Return file and format (default: first of `kinds`).

        Raises ConfigError for an unknown format or a protected file.
        """
        a_file = self.to is not None and self.output is None and "." in self.to
        output = Path(str(self.to)) if a_file else self.output
        ending = "" if output is None else output.suffix.removeprefix(".")
        kind = (None if a_file else self.to) or ending or kinds[0]
        if kind not in kinds:
            raise ConfigError(f"{what} cannot be written as {kind}.", f"--to {', '.join(kinds)}")
        if ending in kinds and ending != kind:
            raise ConfigError(f"--to {kind} contradicts the ending of {output}.", "Leave out --to, or rename the file.")
        path = output or Path(f"{stem}.{kind}")
        with storing(path):
            self.refuse(path, kind)
        return path, kind

    def refuse(self, path: Path, kind: str) -> None:
        """Raise ConfigError if the file is a folder, an input of the command, or a result of a run."""
        another = "Nothing was written; name another file with -o."
        if path.is_dir():
            raise ConfigError(f"{path} is a folder.", f"Name a file in it: -o {shlex.quote(f'{path}/NAME.{kind}')}")
        if path.exists() and any(file.exists() and path.samefile(file) for file in self.inputs):
            raise ConfigError(f"{path} is an input of this command.", another)
        owner = owner_of(path, PIPELINE.names)
        if owner is not None:
            raise ConfigError(f"{path} belongs to the results of the run {owner.path}.", another)


def write_file(path: Path, data: bytes, console: Console) -> Path:
    """Write a file, and warn if it replaces a file with different content.

    Raises StorageError if writing fails.
    """
    replaced = path.is_file() and path.read_bytes() != data
    try:
        write_through(path, data)
    except StorageError as error:
        raise StorageError(error.message, "Name another file with -o.") from error
    if replaced:
        console.warn(f"{path} existed and was replaced.")
    return path
