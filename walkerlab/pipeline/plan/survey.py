"""Survey runs: which of their results are up to date, and which commands compute the others."""

import contextlib
import datetime
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from walkerlab.config.schema import Config
from walkerlab.errors import StaleError
from walkerlab.labels import join_words
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.planner import Planner
from walkerlab.pipeline.plan.results import FolderResults, Step
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.pipeline.store.runfolder import RunFolder
from walkerlab.pipeline.store.runs import SWEEP, config_of, read_all


def survey(config: Config, folder: RunFolder, graph: Graph = PIPELINE) -> tuple[Step, ...]:
    """Return the step that would bring each stage of a run folder up to date. This changes no file."""
    return Planner(config, FolderResults(folder, graph, elsewhere=False), graph.stages).plan()


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
        folder = RunFolder.open_folder(path)
        stages = tuple(name for name in graph.names if folder.artifact(name).is_file())
        sweeps = tuple(sorted(file.name for file in path.glob(f"{SWEEP}*.h5")))
        if not stages and not sweeps:
            continue
        config = config_of(folder)
        current = None
        if config is not None:
            current = tuple(step.stage.name for step in survey(config, folder, graph) if step.action == "reuse")
        stats = [file.stat() for file in path.rglob("*") if file.is_file()]
        when = datetime.datetime.fromtimestamp(max(stat.st_mtime for stat in stats), datetime.UTC)
        size = sum(stat.st_size for stat in stats)
        changed = when.isoformat(timespec="seconds")
        yield RunSummary(folder.name, folder.path, folder.changes, stages, current, sweeps, size, changed)


def results_in(folder: RunFolder, stages: Iterable[str], graph: Graph = PIPELINE) -> dict[str, Stored]:
    """Return the existing results of these stages.

    Raises StaleError naming all that are unreadable.
    """
    intact, bad = read_all(folder, stages)
    if bad:
        commands = join_words(command(folder, graph[stage]) for stage in bad)
        them = "recomputes it" if len(bad) == 1 else "recompute them"
        raise StaleError(f"{'; '.join(bad.values())}.", f"{commands} {them}.")
    return intact


def result_in(folder: RunFolder, stage: str, graph: Graph = PIPELINE) -> Stored:
    """Return a stage's result.

    Raises StaleError if it is missing or unreadable.
    """
    return the_result(results_in(folder, [stage], graph), folder, stage, graph)


def the_result(results: Mapping[str, Stored], folder: RunFolder, stage: str, graph: Graph = PIPELINE) -> Stored:
    """Return a stage's result from the results of its run.

    Raises StaleError if it is missing.
    """
    if stage not in results:
        raise StaleError(f"{folder.path} has no result of {stage}.", f"{command(folder, graph[stage])} computes it.")
    return results[stage]


@contextlib.contextmanager
def results_to_show(
    folder: RunFolder, stages: Iterable[str], warn: Callable[[str], None], graph: Graph = PIPELINE
) -> Iterator[dict[str, Stored]]:
    """Give a `with` block the existing results of these stages, and warn of outdated ones.

    Raises StaleError as `results_in` does, and if the block reads something that an outdated result lacks.
    """
    results = results_in(folder, stages, graph)
    outdated = why_outdated(folder, results, graph)
    for stage, why in outdated.items():
        warn(f"{folder.artifact(stage)} is out of date: {why}; {command(folder, graph[stage])} recomputes it.")
    with refusing_older(folder, outdated, graph):
        yield results


def why_outdated(folder: RunFolder, stages: Collection[str], graph: Graph = PIPELINE) -> dict[str, str]:
    """Return the reasons why results are outdated, by stage. Current results are not listed."""
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
