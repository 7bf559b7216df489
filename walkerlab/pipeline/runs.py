"""Run folders: list them, read their configs and results, and compare two of them."""

import contextlib
import datetime
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkerlab.config.canonical import flatten
from walkerlab.config.files import SHOWN_PATH
from walkerlab.config.problems import printable, suggestion
from walkerlab.config.reader import read as read_text
from walkerlab.config.schema import Config
from walkerlab.config.tree import BlockNode
from walkerlab.config.validation import validate_tree
from walkerlab.config.writer import to_yaml
from walkerlab.errors import ConfigError, StaleError
from walkerlab.labels import join_words
from walkerlab.pipeline.executor import survey
from walkerlab.pipeline.graph import PIPELINE
from walkerlab.pipeline.headlines import LAST_OF, headlines
from walkerlab.pipeline.stage import Graph, Stage
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.pipeline.store.key import differences
from walkerlab.pipeline.store.runfolder import Record, RunFolder

SWEEP = "sweep-"
"""Prefix of sweep files."""
SHOWN_CHANGES = 3
"""Maximum number of changed keys in a message."""


@dataclass(frozen=True)
class RunSummary:
    """Summary of one run folder."""

    name: str
    run_dir: Path
    changes: tuple[str, ...]  # KEY=VALUE of each key in which the run's config differs from the config file
    stages: tuple[str, ...]  # names of stages with a stored result
    current: tuple[str, ...] | None  # names of stages that are up to date; None if the run's config is unknown
    sweeps: tuple[str, ...]  # names of sweep files
    bytes: int  # total size of the run's files
    changed_utc: str  # time of the last change, UTC, ISO 8601


def runs_in(runs_dir: Path, graph: Graph = PIPELINE) -> Iterator[RunSummary]:
    """Iterate over the runs in a folder in order of their names, skipping folders without results."""
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
    """Return the resolved config of a run as YAML; None if neither its record nor a readable result contains it."""
    record = folder.record()
    if record is not None:
        return record.config
    origins = [stored.provenance for stored in read_all(folder, stored_in(folder))[0].values()]
    latest = max(origins, key=lambda origin: origin.ended_utc, default=None)
    return None if latest is None else latest.config


def stored_in(folder: RunFolder) -> list[str]:
    """Return the stages with a result file in a folder, readable or not."""
    return [path.stem for path in folder.path.glob("*.h5")]


def config_of(folder: RunFolder) -> Config | None:
    """Return the config of a run; None if it is unknown or this version's schema rejects it."""
    try:
        tree = read_text(config_text(folder) or "", "stored config")
        return validate_tree(tree) if isinstance(tree, BlockNode) else None
    except ConfigError:
        return None


def read_all(folder: RunFolder, stages: Iterable[str]) -> tuple[dict[str, Stored], dict[str, str]]:
    """Return the readable results of these stages, and a message for each unreadable one, by stage."""
    intact: dict[str, Stored] = {}
    bad: dict[str, str] = {}
    for stage in stages:
        path = folder.artifact(stage)
        verdict = artifact.check(path, stage=None if stage.startswith(SWEEP) else stage)
        if verdict.artifact is not None:
            intact[stage] = verdict.artifact
        elif verdict.reason != artifact.NOT_THERE:
            bad[stage] = f"{path} {'is' if verdict.damaged else 'cannot be read:'} {verdict.reason}"
    return intact, bad


def results_in(folder: RunFolder, stages: Iterable[str], graph: Graph = PIPELINE) -> dict[str, Stored]:
    """Return the existing results of these stages; raises StaleError naming all that are unreadable."""
    intact, bad = read_all(folder, stages)
    if bad:
        commands = join_words(command(folder, graph[stage]) for stage in bad)
        them = "recomputes it" if len(bad) == 1 else "recompute them"
        raise StaleError(f"{'; '.join(bad.values())}.", f"{commands} {them}.")
    return intact


def result_in(folder: RunFolder, stage: str, graph: Graph = PIPELINE) -> Stored:
    """Return a stage's result; raises StaleError if it is missing or unreadable."""
    return the_result(results_in(folder, [stage], graph), folder, stage, graph)


def the_result(results: Mapping[str, Stored], folder: RunFolder, stage: str, graph: Graph = PIPELINE) -> Stored:
    """Return a stage's result from the results of its run; raises StaleError if it is missing."""
    if stage not in results:
        raise StaleError(f"{folder.path} has no result of {stage}.", f"{command(folder, graph[stage])} computes it.")
    return results[stage]


@contextlib.contextmanager
def results_to_show(
    folder: RunFolder, stages: Iterable[str], warn: Callable[[str], None], graph: Graph = PIPELINE
) -> Iterator[dict[str, Stored]]:
    """Give a `with` block the existing results of these stages; warn of outdated ones.

    Raises StaleError as `results_in` does, and if the block reads something that an outdated result lacks.
    """
    results = results_in(folder, stages, graph)
    outdated = why_outdated(folder, results, graph)
    for stage, why in outdated.items():
        warn(f"{folder.artifact(stage)} is out of date: {why}; {command(folder, graph[stage])} recomputes it.")
    with refusing_older(folder, outdated, graph):
        yield results


def why_outdated(folder: RunFolder, stages: Collection[str], graph: Graph = PIPELINE) -> dict[str, str]:
    """Return the reasons why results are outdated, by stage; current results are not listed."""
    config = config_of(folder)
    if config is None:
        return dict.fromkeys(stages, "this version cannot read the config of its run")
    steps = {step.stage.name: step for step in survey(config, folder, graph)}
    return {name: steps[name].reason for name in stages if steps[name].action != "reuse"}


@contextlib.contextmanager
def refusing_older(folder: RunFolder, outdated: Collection[str], graph: Graph = PIPELINE) -> Iterator[None]:
    """Convert a KeyError raised in a `with` block to StaleError if any results are outdated."""
    try:
        yield
    except KeyError as missing:
        if not outdated:
            raise
        paths = [str(folder.artifact(stage)) for stage in outdated]
        commands = [command(folder, graph[stage]) for stage in outdated]
        they = "is outdated and lacks" if len(paths) == 1 else "are outdated and lack"
        raise StaleError(f"{join_words(paths)} {they} {missing}.", f"Run {join_words(commands)}.") from missing


def command(folder: RunFolder, stage: Stage) -> str:
    """Return the command that computes a stage's result in a run's folder."""
    return f"`walkerlab {stage.command} -c {folder.quoted_path}`"


def find_run(text: str, runs_dir: Path) -> RunFolder | None:
    """Find a run by its name in the folder of all runs, or by its path; None if it does not exist."""
    path = Path(text)
    is_name = path.name == text and text != ".."
    places = (runs_dir / path, path) if is_name else (path,)
    # the system refuses a path that is too long
    with contextlib.suppress(OSError):
        return next((RunFolder.at(place) for place in places if place.is_dir()), None)
    return None


def run_named(text: str, runs_dir: Path) -> RunFolder:
    """Find a run by its name in the folder of all runs, or by its path; raises ConfigError if it does not exist."""
    run = find_run(text, runs_dir)
    if run is not None:
        return run
    names = sorted(path.name for path in runs_dir.glob("*/"))
    near = suggestion(Path(text).name, names) or (f" Available runs: {', '.join(names)}." if names else "")
    raise ConfigError(
        f"there is no run {printable(text, SHOWN_PATH)}.{near}",
        "`walkerlab report` creates the run of the paper config.",
    )


def claim(folder: RunFolder, config: Config) -> None:
    """Record in a folder which config its results belong to; call it under the lock, before any result is written.

    Raises ConfigError as `refuse_another_config` does.
    """
    refuse_another_config(folder, config)
    record = folder.record()
    new_record = Record(folder.name, folder.source, to_yaml(config), folder.changes)
    if record is None or (comes_from(record, folder) and record != new_record):
        folder.write_record(new_record)


def refuse_another_config(folder: RunFolder, config: Config) -> None:
    """Raise ConfigError if a folder has results of another config, unless it is an earlier state of the same file.

    The name and the `sweep` block are not compared, since no result depends on them.
    """
    record = folder.record()
    if (record is not None and comes_from(record, folder)) or not any(folder.path.glob("*.h5")):
        return
    recorded = config_of(folder)
    if recorded is None and record is None:  # nothing in the folder can be read
        return
    changes = ["its config is no longer valid"]
    if recorded is not None:
        compared = (each.model_dump(mode="json", exclude={"name", "sweep"}) for each in (recorded, config))
        changes = list(differences("", *compared))
    if changes:
        origin = f", made from {record.source}" if record is not None and record.source else ""
        more = ", …" if len(changes) > SHOWN_CHANGES else ""
        raise ConfigError(
            f"{folder.path} has results of another config{origin}; they are not overwritten "
            f"({', '.join(changes[:SHOWN_CHANGES])}{more}).",
            "`--name NAME` gives this one a folder of its own; "
            f"`walkerlab clean -c {folder.quoted_path}` removes those results.",
        )


def comes_from(record: Record, folder: RunFolder) -> bool:
    """Whether a folder's results come from the same config file and run name, even if the file was edited since."""
    return (record.run, record.source) == (folder.name, folder.source)


@dataclass(frozen=True)
class Pair:
    """Values of a quantity in two runs, and the change relative to the first (None if undefined)."""

    name: str
    first: Any
    second: Any
    change: float | None


@dataclass(frozen=True)
class RunDifference:
    """Differences between two runs."""

    config: tuple[tuple[str, Any, Any], ...]  # config keys that differ, with both values as JSON
    numbers: Mapping[str, tuple[Pair, ...]]  # all values of both summaries, for each stage that both runs have
    headlines: Mapping[str, tuple[Pair, ...]]  # headline quantities, for the same stages
    # only_first, only_second: stages with a result in one run only
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]


def difference(
    first: Mapping[str, Stored], second: Mapping[str, Stored], configs: Sequence[Config | None]
) -> RunDifference:
    """Compare the results and configs of two runs; an unknown config counts as empty."""
    both = [name for name in first if name in second]
    keys = pairs(*({} if config is None else dict(flatten(config.model_dump(mode="json"))) for config in configs))
    return RunDifference(
        tuple((pair.name, pair.first, pair.second) for pair in keys if pair.first != pair.second),
        {name: pairs(*(dict(flatten(run[name].summary, lists=True)) for run in (first, second))) for name in both},
        {name: pairs(*(headline_values(name, run[name].summary) for run in (first, second))) for name in both},
        tuple(name for name in first if name not in second),
        tuple(name for name in second if name not in first),
    )


def pairs(first: Mapping[str, Any], second: Mapping[str, Any]) -> tuple[Pair, ...]:
    """Pair the values of two results by name."""
    both = {name: (first.get(name), second.get(name)) for name in {**first, **second}}
    return tuple(Pair(name, *values, change(*values)) for name, values in both.items())


def headline_values(stage: str, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the headline quantities of a stage's summary, by name."""
    last = {name: summary[list_name][-1] for name, list_name in LAST_OF.items() if summary.get(list_name)}
    every = dict(flatten(summary, lists=True)) | last
    return {name: every[name] for name in headlines(stage, every)}


def change(first: Any, second: Any) -> float | None:
    """Return the relative change from `first` to `second`; None unless both are numbers and `first` is not 0."""
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (first, second))
    return float(second / first - 1.0) if numbers and first else None
