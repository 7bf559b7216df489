"""The runs in a folder: which there are, the config of each, and how two of them differ."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkerlab.config.problems import nearest
from walkerlab.config.reader import read as read_text
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping as Tree
from walkerlab.config.validation import typed
from walkerlab.errors import ConfigError, StaleError
from walkerlab.stages.graph import PIPELINE, Graph
from walkerlab.stages.plan import survey
from walkerlab.store import artifact
from walkerlab.store.artifact import Damaged, Stored
from walkerlab.store.runfolder import RunFolder


@dataclass(frozen=True)
class RunSummary:
    """One run folder.

    stages    names of those with a stored result
    current   of these, the ones that are up to date; None if the run's config is not known any more
    sweeps    files of sweeps
    bytes     size of all its files
    changed   when the last of them was written, UTC, ISO 8601
    """

    name: str
    run_dir: Path
    stages: tuple[str, ...]
    current: tuple[str, ...] | None
    sweeps: tuple[str, ...]
    bytes: int
    changed: str


def runs_in(runs_dir: Path, graph: Graph = PIPELINE) -> Iterator[RunSummary]:
    """Every run in a folder, by name; folders without results are none."""
    for path in sorted(runs_dir.glob("*/")):
        folder = RunFolder(runs_dir, path.name)
        stages = tuple(stage.name for stage in graph.stages if folder.artifact(stage.name).is_file())
        sweeps = tuple(sorted(file.name for file in path.glob("sweep-*.h5")))
        if stages or sweeps:
            yield summary_of(folder, stages, sweeps, graph)


def summary_of(folder: RunFolder, stages: tuple[str, ...], sweeps: tuple[str, ...], graph: Graph) -> RunSummary:
    """What is to be said of one run."""
    stats = [file.stat() for file in folder.path.rglob("*") if file.is_file()]
    when = datetime.datetime.fromtimestamp(max(stat.st_mtime for stat in stats), datetime.UTC)
    config = config_of(folder, graph)
    current = None
    if config is not None:
        current = tuple(step.stage.name for step in survey(config, folder, graph) if step.action == "reuse")
    return RunSummary(
        folder.name, folder.path, stages, current, sweeps, sum(stat.st_size for stat in stats),
        when.isoformat(timespec="seconds"),
    )  # fmt: skip


def config_of(folder: RunFolder, graph: Graph = PIPELINE) -> Config | None:
    """The config that a run's last written result was made with; None if there is none that is still a config."""
    found = sorted(results_in(folder, graph).values(), key=lambda stored: stored.provenance.ended_utc)
    return resolved_config(found[-1]) if found else None


def resolved_config(stored: Stored) -> Config | None:
    """The config that an artifact was made with; None if this program's schema does not take it any more."""
    try:
        tree = read_text(stored.provenance.config, "stored config")
        return typed(tree) if isinstance(tree, Tree) else None
    except ConfigError:
        return None


def results_in(folder: RunFolder, graph: Graph = PIPELINE) -> dict[str, Stored]:
    """The intact results of a run, by stage."""
    found = {}
    for stage in graph.stages:
        try:
            found[stage.name] = artifact.read(folder.artifact(stage.name))
        except (OSError, Damaged):
            continue
    return found


def run_named(text: str, runs_dir: Path) -> RunFolder:
    """The run of a name in the folder of all runs, or of a path; StaleError if there is none."""
    for path in (runs_dir / text, Path(text)):
        if path.is_dir():
            return RunFolder(path.parent, path.name)
    there = sorted(path.name for path in runs_dir.glob("*/"))
    near = nearest(Path(text).name, there)
    meant = f" Did you mean {near}?" if near else f" There are {', '.join(there)}." if there else ""
    raise StaleError(f"there is no run {text}.{meant}", "`walkerlab report` makes the run of the paper config.")


@dataclass(frozen=True)
class Pair:
    """A number of two runs; `change` is relative to the first, None where that is no number or zero."""

    name: str
    first: Any
    second: Any
    change: float | None


@dataclass(frozen=True)
class Difference:
    """How two runs differ.

    config       keys with both values, as JSON
    numbers      by stage, every number and word of the two summaries; stages that only one has are left out
    only_first, only_second  stages that only one has
    """

    config: tuple[tuple[str, Any, Any], ...]
    numbers: Mapping[str, tuple[Pair, ...]]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]


def difference(first: Mapping[str, Stored], second: Mapping[str, Stored]) -> Difference:
    """How the results of two runs differ."""
    both = [name for name in first if name in second]
    return Difference(
        config_difference(first, second),
        {name: pairs(first[name].summary, second[name].summary) for name in both},
        tuple(name for name in first if name not in second),
        tuple(name for name in second if name not in first),
    )


def config_difference(first: Mapping[str, Stored], second: Mapping[str, Stored]) -> tuple[tuple[str, Any, Any], ...]:
    """Keys in which the configs of two runs differ."""
    configs = []
    for results in (first, second):
        last = max(results.values(), key=lambda stored: stored.provenance.ended_utc)
        config = resolved_config(last)
        configs.append({} if config is None else dict(leaves_of(config.model_dump(mode="json"))))
    one, other = configs
    return tuple((key, one.get(key), other.get(key)) for key in {**one, **other} if one.get(key) != other.get(key))


def leaves_of(block: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names and values of nested objects; lists are values."""
    for name, value in block.items():
        if isinstance(value, Mapping):
            yield from leaves_of(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def pairs(first: Mapping[str, Any], second: Mapping[str, Any]) -> tuple[Pair, ...]:
    """Numbers and words of two summaries side by side; lists number by number."""
    one, other = dict(single_values(first)), dict(single_values(second))
    return tuple(Pair(name, one.get(name), other.get(name), change(one.get(name), other.get(name)))
                 for name in {**one, **other})  # fmt: skip


def single_values(summary: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Dotted names of all numbers and words in a summary, the places in lists among the names."""
    for name, value in summary.items():
        if isinstance(value, Mapping):
            yield from ((f"{name}.{inner}", item) for inner, item in single_values(value))
        elif isinstance(value, list):
            listed = {str(place): item for place, item in enumerate(value)}
            yield from ((f"{name}.{inner}", item) for inner, item in single_values(listed))
        else:
            yield name, value


def change(first: Any, second: Any) -> float | None:
    """Relative change of a number."""
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (first, second))
    return float(second / first - 1.0) if numbers and first else None
