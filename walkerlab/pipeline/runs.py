"""Run folders: which there are, what config and results each holds, and how two of them differ."""

import contextlib
import datetime
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkerlab.config.canonical import flatten
from walkerlab.config.problems import suggestion
from walkerlab.config.reader import read as read_text
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping as Tree
from walkerlab.config.validation import validate_tree
from walkerlab.config.writer import to_yaml
from walkerlab.errors import ConfigError, StaleError
from walkerlab.pipeline.executor import survey
from walkerlab.pipeline.graph import PIPELINE, Graph, Stage
from walkerlab.pipeline.headlines import LAST_OF, headlines
from walkerlab.prose import listed
from walkerlab.store import artifact
from walkerlab.store.artifact import Stored
from walkerlab.store.key import differences
from walkerlab.store.runfolder import Record, RunFolder

SWEEP = "sweep-"
"""What names of sweeps' files begin with."""
SHOWN_CHANGES = 3
"""Keys that a refusal names."""


@dataclass(frozen=True)
class RunSummary:
    """One run folder.

    changes   KEY=VALUE of each key in which its config differs from the file that it is from
    stages    names of those with a stored result
    current   of these, the ones that are up to date; None if the run's config is not known any more
    sweeps    files of sweeps
    bytes     size of all its files
    changed_utc  when the last of them was written, UTC, ISO 8601
    """

    name: str
    run_dir: Path
    changes: tuple[str, ...]
    stages: tuple[str, ...]
    current: tuple[str, ...] | None
    sweeps: tuple[str, ...]
    bytes: int
    changed_utc: str


def runs_in(runs_dir: Path, graph: Graph = PIPELINE) -> Iterator[RunSummary]:
    """Every run in a folder, by name; folders without results are none."""
    for path in sorted(runs_dir.glob("*/")):
        folder = RunFolder.at(path)
        stages = tuple(stage.name for stage in graph.stages if folder.artifact(stage.name).is_file())
        sweeps = tuple(sorted(file.name for file in path.glob(f"{SWEEP}*.h5")))
        if not stages and not sweeps:
            continue
        config, current = config_of(folder), None
        if config is not None:
            current = tuple(step.stage.name for step in survey(config, folder, graph) if step.action == "reuse")
        stats = [file.stat() for file in path.rglob("*") if file.is_file()]
        when = datetime.datetime.fromtimestamp(max(stat.st_mtime for stat in stats), datetime.UTC)
        size, changed = sum(stat.st_size for stat in stats), when.isoformat(timespec="seconds")
        yield RunSummary(folder.name, folder.path, folder.changes, stages, current, sweeps, size, changed)


def config_text(folder: RunFolder) -> str | None:
    """The resolved config of a run, as YAML; None if nothing in its folder tells it."""
    record = folder.record()
    if record is not None:
        return record.config
    found = read_all(folder, stored_in(folder))[0].values()
    return max(found, key=lambda stored: stored.provenance.ended_utc).provenance.config if found else None


def stored_in(folder: RunFolder) -> list[str]:
    """The stages of whose results there are files in a folder, whether or not they can be read."""
    return [path.stem for path in folder.path.glob("*.h5")]


def config_of(folder: RunFolder) -> Config | None:
    """The config of a run; None if nothing tells it, or this program's schema does not take it any more."""
    try:
        tree = read_text(config_text(folder) or "", "stored config")
        return validate_tree(tree) if isinstance(tree, Tree) else None
    except ConfigError:
        return None


def read_all(folder: RunFolder, stages: Iterable[str]) -> tuple[dict[str, Stored], dict[str, str]]:
    """The results of these stages that can be read, and what is wrong with the others that are there, in words."""
    intact: dict[str, Stored] = {}
    bad: dict[str, str] = {}
    for stage in stages:
        path = folder.artifact(stage)
        found = artifact.check(path, stage=None if stage.startswith(SWEEP) else stage)
        if found.artifact is not None:
            intact[stage] = found.artifact
        elif found.reason != artifact.NOT_THERE:
            bad[stage] = f"{path} {'is' if found.damaged else 'cannot be read:'} {found.reason}"
    return intact, bad


def results_in(folder: RunFolder, stages: Iterable[str], graph: Graph = PIPELINE) -> dict[str, Stored]:
    """The results of these stages, so far as they are there; StaleError that names all that cannot be read."""
    intact, bad = read_all(folder, stages)
    if bad:
        commands = listed(makes(folder, graph[stage]) for stage in bad)
        them = "recomputes it" if len(bad) == 1 else "recompute them"
        raise StaleError(f"{'; '.join(bad.values())}.", f"{commands} {them}.")
    return intact


def result_in(folder: RunFolder, stage: str, graph: Graph = PIPELINE) -> Stored:
    """A stage's result; StaleError if it is not there, or cannot be read."""
    return the_result(results_in(folder, [stage], graph), folder, stage, graph)


def the_result(results: Mapping[str, Stored], folder: RunFolder, stage: str, graph: Graph = PIPELINE) -> Stored:
    """A stage's result among those of its run; StaleError if it is not there."""
    if stage not in results:
        raise StaleError(f"{folder.path} has no result of {stage}.", f"{makes(folder, graph[stage])} computes it.")
    return results[stage]


@contextlib.contextmanager
def results_to_show(
    folder: RunFolder, stages: Iterable[str], warn: Callable[[str], None], graph: Graph = PIPELINE
) -> Iterator[dict[str, Stored]]:
    """The results of these stages, so far as they are there, for a body that shows them; warn of what is outdated.

    Raises StaleError as `results_in`, and where an outdated result lacks what the body needs.
    """
    results = results_in(folder, stages, graph)
    outdated = why_outdated(folder, results, graph)
    for stage, why in outdated.items():
        warn(f"{folder.artifact(stage)} is out of date: {why}; {makes(folder, graph[stage])} makes it anew.")
    with refusing_older(folder, outdated, graph):
        yield results


def why_outdated(folder: RunFolder, stages: Collection[str], graph: Graph = PIPELINE) -> dict[str, str]:
    """By stage, why its result is not the one of the run's config and this version; only those that are not."""
    config = config_of(folder)
    if config is None:
        return dict.fromkeys(stages, "this version cannot read the config of its run")
    steps = {step.stage.name: step for step in survey(config, folder, graph)}
    return {name: steps[name].reason for name in stages if steps[name].action != "reuse"}


@contextlib.contextmanager
def refusing_older(folder: RunFolder, outdated: Collection[str], graph: Graph = PIPELINE) -> Iterator[None]:
    """Raise StaleError where a body does not find in outdated results what this version stores."""
    try:
        yield
    except KeyError as missing:
        if not outdated:
            raise
        paths, commands = ([*map(str, map(folder.artifact, outdated))], [makes(folder, graph[one]) for one in outdated])
        they = "is outdated and lacks" if len(paths) == 1 else "are outdated and lack"
        raise StaleError(f"{listed(paths)} {they} {missing}.", f"{listed(commands)} computes it anew.") from missing


def makes(folder: RunFolder, stage: Stage) -> str:
    """The command that makes a stage's result in a run's folder."""
    return f"`walkerlab {stage.command} -c {folder.typed}`"


def find_run(text: str, runs_dir: Path) -> RunFolder | None:
    """The run of a name in the folder of all runs, or of a folder's path; None if there is none."""
    path = Path(text)
    is_name = path.name == text and text != ".."
    places = (runs_dir / path, path) if is_name else (path,)
    return next((RunFolder.at(place) for place in places if place.is_dir()), None)


def run_named(text: str, runs_dir: Path) -> RunFolder:
    """The run of a name in the folder of all runs, or of a folder's path; ConfigError if there is none."""
    found = find_run(text, runs_dir)
    if found is not None:
        return found
    there = sorted(path.name for path in runs_dir.glob("*/"))
    near = suggestion(Path(text).name, there) or (f" There are {', '.join(there)}." if there else "")
    raise ConfigError(f"there is no run {text}.{near}", "`walkerlab report` creates the run of the paper config.")


def claim(folder: RunFolder, config: Config) -> None:
    """Have a folder say that its results are of a config, before one is written; to be called under its lock.

    Raises ConfigError as `refuse_another_config`.
    """
    refuse_another_config(folder, config)
    record = folder.record()
    asked = Record(folder.name, folder.source, to_yaml(config), folder.changes)
    if record is None or (comes_from(record, folder) and record != asked):
        folder.write_record(asked)


def refuse_another_config(folder: RunFolder, config: Config) -> None:
    """Raise ConfigError if a folder has results of another config, unless that is an earlier state of the same file.

    The name and the `sweep` block do not count: no number depends on them.
    """
    record = folder.record()
    if (record is not None and comes_from(record, folder)) or not any(folder.path.glob("*.h5")):
        return
    held = config_of(folder)
    if held is None and record is None:  # nothing there can be read
        return
    changes = ["it is no longer a config"]
    if held is not None:
        changes = list(
            differences("", *(one.model_dump(mode="json", exclude={"name", "sweep"}) for one in (held, config)))
        )
    if changes:
        origin = f", made from {record.source}" if record is not None and record.source else ""
        more = ", …" if len(changes) > SHOWN_CHANGES else ""
        raise ConfigError(
            f"{folder.path} has results of another config{origin}; they are not overwritten "
            f"({', '.join(changes[:SHOWN_CHANGES])}{more}).",
            "`--name NAME` gives this one a folder of its own; "
            f"`walkerlab clean -c {folder.typed}` removes what is there.",
        )


def comes_from(record: Record, folder: RunFolder) -> bool:
    """Whether what a folder holds was made under its name from the same file, perhaps before that was edited."""
    return (record.run, record.source) == (folder.name, folder.source)


@dataclass(frozen=True)
class Pair:
    """A number of two runs; `change` is relative to the first, None where that is no number or zero."""

    name: str
    first: Any
    second: Any
    change: float | None


@dataclass(frozen=True)
class RunDifference:
    """How two runs differ.

    config       keys with both values, as JSON
    numbers      by stage, every number and word of the two summaries; stages that only one has are left out
    headlines    by stage, the few of them that say most
    only_first, only_second  stages that only one has
    """

    config: tuple[tuple[str, Any, Any], ...]
    numbers: Mapping[str, tuple[Pair, ...]]
    headlines: Mapping[str, tuple[Pair, ...]]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]


def difference(
    first: Mapping[str, Stored], second: Mapping[str, Stored], configs: Sequence[Config | None]
) -> RunDifference:
    """How the results of two runs differ, and the configs of both; nothing is said of a config that is not known."""
    both = [name for name in first if name in second]
    one, other = ({} if config is None else dict(flatten(config.model_dump(mode="json"))) for config in configs)
    return RunDifference(
        tuple((key, one.get(key), other.get(key)) for key in {**one, **other} if one.get(key) != other.get(key)),
        {name: pairs(*(dict(flatten(run[name].summary, lists=True)) for run in (first, second))) for name in both},
        {name: pairs(*(headline_values(name, run[name].summary) for run in (first, second))) for name in both},
        tuple(name for name in first if name not in second),
        tuple(name for name in second if name not in first),
    )


def pairs(first: Mapping[str, Any], second: Mapping[str, Any]) -> tuple[Pair, ...]:
    """Numbers and words of two results side by side, by name."""
    both = {name: (first.get(name), second.get(name)) for name in {**first, **second}}
    return tuple(Pair(name, *values, change(*values)) for name, values in both.items())


def headline_values(stage: str, summary: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of a stage's summary that say most, by name."""
    last = {name: summary[whole][-1] for name, whole in LAST_OF.items() if summary.get(whole)}
    every = dict(flatten(summary, lists=True)) | last
    return {name: every[name] for name in headlines(stage, every)}


def change(first: Any, second: Any) -> float | None:
    """Relative change of a number."""
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (first, second))
    return float(second / first - 1.0) if numbers and first else None
