"""Decide for each stage of a pipeline whether to reuse its result, run it or leave it out, and survey whole runs."""

import contextlib
import datetime
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from walkerlab.config.schema import Config
from walkerlab.errors import StaleError
from walkerlab.labels import join_words
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.results import FolderResults, Results, Step
from walkerlab.pipeline.plan.stage import Stage, message_without_block
from walkerlab.pipeline.store.artifact import Identity, Stored
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.runs import SWEEP, RunFolder, config_of, read_all
from walkerlab.scene.omissions import LeftOut


class Planner:
    """Decides for each of its stages, under one config, whether to reuse its result, run it or leave it out.

    stages    stages to bring up to date, each after the stages that it needs
    force     whether to run every stage that is not left out, even if the result is current
    again     whether to repeat walks at tighter tolerances to measure their numerical error
    answers   results so far, by stage
    left_out  reasons why stages are left out, by stage
    """

    def __init__(
        self, config: Config, results: Results, stages: Sequence[Stage], *, force: bool = False, again: bool = True
    ) -> None:
        """Store the arguments without reading anything."""
        self.config = config
        self.results = results
        self.stages = tuple(stages)
        self.graph = results.keys.graph
        self.force = force
        self.again = again
        self.answers: dict[str, Content] = {}
        self.left_out: dict[str, str] = {}
        self._keys: dict[str, str] = {}

    def plan(self) -> tuple[Step, ...]:
        """Decide for each stage whether to run it or reuse its result, assuming that every run succeeds. No file
        changes."""
        steps = []
        for stage in self.stages:
            step = self.decide(stage)
            if not (stage.only_by and step.action == "run"):  # an optional result is used only if it exists
                self.expect(step)
            steps.append(step)
        return tuple(steps)

    def decide(self, stage: Stage) -> Step:
        """Decide whether to reuse, run or leave out a stage. Its inputs must have been decided before.

        First, optional inputs that are not in this plan are looked up. A damaged one is recorded as left out.
        """
        for name in stage.if_current:
            if self.graph[name] not in self.stages:
                step = self._judge(self.graph[name], force=False)
                # A result in another folder does not count, because optional results are not copied.
                if step.action == "reuse" and step.origin is None:
                    self.expect(step)
                elif step.damaged:
                    self.left_out[name] = f"its result is {step.reason}; {self._command_of(name)} recomputes it"
        return self._judge(stage, self.force)

    def expect(self, step: Step) -> None:
        """Record the expected outcome of a step, assuming that it succeeds."""
        if step.identity is None:
            self.left_out[step.stage.name] = step.reason
        elif step.action == "reuse" and step.found is not None:
            self.settle(step, step.found)
        else:
            self._keys[step.stage.name] = step.identity.key

    def settle(self, step: Step, answer: Content) -> None:
        """Record a stage's result, or the reason why it found no answer."""
        self.answers[step.stage.name] = answer
        if answer.no_answer is not None:
            self.left_out[step.stage.name] = answer.no_answer.message
        elif step.identity is not None:
            self._keys[step.stage.name] = step.identity.key

    def inputs(self, stage: Stage) -> dict[str, Content]:
        """Return the available results that a stage uses, required or optional, by stage."""
        available = self.answers.keys() - self.left_out.keys()
        return {name: self.answers[name] for name in stage.results(self.config) if name in available}

    def missing_inputs(self, stage: Stage) -> tuple[LeftOut, ...]:
        """Return the inputs that a stage lacks, with the reasons."""
        missing = (name for name in stage.results(self.config) if name not in self._keys)
        return tuple(omission_of(name, self._why_absent(name)) for name in missing)

    def _judge(self, stage: Stage, force: bool) -> Step:
        reason = stage.why_unsuited(self.config)
        # A drawing needs no particular result: it shows those that exist, and says which are missing.
        for name in () if stage.draws else stage.inputs(self.config):
            if reason is None and name in self.left_out:
                reason = f"it needs {name}: {self.left_out[name]}"
        if reason is not None:
            return Step(stage, "leave out", reason)
        return self.results.find(stage, self._identity(stage), self.inputs(stage), force)

    def _identity(self, stage: Stage) -> Identity:
        keys = {name: self._keys[name] for name in stage.results(self.config) if name in self._keys}
        # A drawing shows the reasons why results are left out, so they are part of its identity.
        keys |= {absent.what: f"left out: {absent.why}" for absent in self.missing_inputs(stage)}
        return self.results.keys.identity(stage, self.config, keys, self.again)

    def _why_absent(self, name: str) -> str:
        command = self._command_of(name)
        if self.graph[name].only_by:
            return self.left_out.get(name, f"it was not requested; {command} computes it")
        none_yet = self.graph[name].why_unsuited(self.config) or f"no current result; {command} computes one"
        return self.left_out.get(name, none_yet)

    def _command_of(self, name: str) -> str:
        return f"`walkerlab {self.graph[name].command}`"


def omission_of(stage: str, why: str) -> LeftOut:
    """Describe a stage that is left out, with the reason and what this saves."""
    return LeftOut(stage, why, "loading and compiling contact code" if why == message_without_block("contact") else "")


def survey(config: Config, folder: RunFolder, graph: Graph = PIPELINE) -> tuple[Step, ...]:
    """Return, for each stage of a run folder, the step that would bring it up to date. This changes no file."""
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
    """Yield the runs in a folder, sorted by name. Folders without results are skipped."""
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
    """Return the results of these stages that exist.

    Raises StaleError, which lists all unreadable results.
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
    """Return the result of a stage from the `results` of its run.

    Raises StaleError if the result is missing.
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
    for stage, reason in outdated.items():
        warn(f"{folder.artifact(stage)} is out of date: {reason}; {command(folder, graph[stage])} recomputes it.")
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
    """Convert a KeyError in a `with` block to StaleError if some results are outdated, because they may lack the
    key."""
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
