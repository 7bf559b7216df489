"""Record the provenance of results: software, machine, time and command. A result's key does not depend on it."""

import contextlib
import datetime
import importlib.metadata
import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import walkerlab
from walkerlab.config import schema, writer
from walkerlab.extensions import external_extensions
from walkerlab.pipeline.store import commit, files

LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "h5py", "pydantic", "ruamel.yaml", "matplotlib", "jinja2")
"""Libraries that results and figures may depend on."""


@dataclass(frozen=True)
class Provenance:
    """Origin of a result: config, command, time, machine and versions."""

    config: str  # the resolved config, as YAML text
    command_line: str  # command as typed
    seed: int  # seed of all random numbers
    # started_utc, ended_utc: ISO 8601
    started_utc: str
    ended_utc: str
    platform: str  # operating system, processor, Python
    package_version: str
    library_versions: Mapping[str, str]
    # commit of the source from which the package runs or was built, with '-dirty' if the source had uncommitted
    # changes; None if unknown
    git_commit: str | None = None
    input_digests: Mapping[str, str] = field(default_factory=dict)  # digest of each input's content, by stage

    @property
    def took_s(self) -> float:
        """Run time, s."""
        start, ended = map(datetime.datetime.fromisoformat, (self.started_utc, self.ended_utc))
        return (ended - start).total_seconds()

    def finish(self) -> "Provenance":
        return replace(self, ended_utc=utc_now())


def begin(config: schema.Config, input_digests: Mapping[str, str]) -> Provenance:
    """Begin the provenance of a stage that starts now in this process."""
    now = utc_now()
    return Provenance(
        config=writer.to_yaml(config),
        command_line=command_line(),
        seed=config.seed,
        started_utc=now,
        ended_utc=now,
        platform=f"{platform.platform()}, {platform.machine()}, {platform.python_implementation()} "
        f"{platform.python_version()}",
        package_version=walkerlab.__version__,
        library_versions=library_versions(),
        git_commit=git_commit(),
        input_digests=dict(input_digests),
    )


def command_line() -> str:
    """Return the command line of this process."""
    program = Path(sys.argv[0]).name
    # Under `python -m walkerlab`, the program is called __main__.py.
    return shlex.join(["walkerlab" if program == "__main__.py" else program, *map(files.as_text, sys.argv[1:])])


def utc_now() -> str:
    """Return the time in ISO 8601 to the millisecond."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")


def library_versions() -> dict[str, str]:
    """Return the versions of extensions and of installed libraries. They come from metadata, so no library is
    imported."""
    versions = {}
    for name in LIBRARIES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[name] = importlib.metadata.version(name)
    return versions | {f"extension {found.name}": found.origin for found in external_extensions() if found.extension}


def git_commit() -> str | None:
    """Return the commit of the source from which this package runs or was built, or None if it is unknown."""
    return commit.commit_of_package(Path(walkerlab.__file__).parent)
