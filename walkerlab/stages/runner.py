"""Runs a stage and what it needs: reuses what is up to date, stores each result as soon as it is there."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from walkerlab.config.canonical import only
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.stages.ahead import Ahead
from walkerlab.stages.graph import PIPELINE, Graph, Stage
from walkerlab.stages.plan import LeftOut, Planner, Step, input_digest, left_out, no_answer, plan
from walkerlab.stages.progress import Reporter, Silent
from walkerlab.store import artifact, provenance
from walkerlab.store.artifact import Stored
from walkerlab.store.content import Content
from walkerlab.store.elsewhere import take_over
from walkerlab.store.files import drawing_into
from walkerlab.store.parts import Parts
from walkerlab.store.runfolder import RunFolder

__all__ = ["Done", "StageReport", "execute", "plan", "preview"]


@dataclass(frozen=True)
class Done:
    """What was done with one stage: `action` as in `plan.Step`, `wall_s` the time it ran."""

    stage: str
    action: str
    reason: str
    wall_s: float = 0.0


@dataclass(frozen=True)
class StageReport:
    """How running a stage went.

    run_dir    the run's folder
    artifact   the file of its result; None if there is none
    reused     whether the result was there already
    wall_s     time of the whole, what it needs included
    left_out   what was not computed on the way, and why
    summary    of the result; empty if there is none
    steps      what was done with each stage
    no_answer  message and advice, if the computation has no answer or the drawing had to do without one
    """

    stage: str
    run_dir: Path
    artifact: Path | None
    reused: bool
    wall_s: float
    left_out: tuple[LeftOut, ...]
    summary: dict[str, Any]
    steps: tuple[Done, ...]
    no_answer: NoAnswer | None = None


def execute(
    config: Config,
    target: str,
    folder: RunFolder,
    *,
    force: bool = False,
    wait: bool = True,
    jobs: int = 1,
    full: bool = False,
    reporter: Reporter | None = None,
    graph: Graph = PIPELINE,
) -> StageReport:
    """Have the result of a stage in its folder, running what is not up to date.

    force  run the target and all it needs
    wait   for another process that works in the folder, and reuse what it made
    jobs   processes for stages with independent cells
    full   run the target's campaigns too

    Raises ConfigError if the config has not what the target needs, LockedError (only without `wait`), StorageError.
    No answer is no exception here: see `StageReport.no_answer`.
    """
    started = time.perf_counter()
    refuse_without_contact(graph[target], config)
    stages = asked_for(target, config, graph, full)
    planner = Planner(config, folder, graph, force)
    steps = planner.plan(stages)
    run = Run(planner, reporter or Silent(), jobs)
    if any(step.action == "run" or step.origin is not None for step in steps):
        with folder.locked(wait, run.reporter.note):
            # Decided anew, stage by stage: another process may have worked here until now.
            run = Run(Planner(config, folder, graph, force), run.reporter, jobs)
            run.carry_out(stages)
    else:
        for step in steps:
            run.skip(step)
    return run.report(graph[target], time.perf_counter() - started)


def preview(
    config: Config,
    target: str,
    folder: RunFolder,
    *,
    force: bool = False,
    full: bool = False,
    graph: Graph = PIPELINE,
) -> StageReport:
    """What `execute` would do, as the report it would give before anything has run; touches nothing.

    Raises ConfigError if the config has not what the target needs.
    """
    started = time.perf_counter()
    refuse_without_contact(graph[target], config)
    planner = Planner(config, folder, graph, force)
    run = Run(planner, Silent(), jobs=1)
    for step in planner.plan(asked_for(target, config, graph, full)):
        run.skip(step)
    return run.report(graph[target], time.perf_counter() - started)


def asked_for(target: str, config: Config, graph: Graph, full: bool) -> tuple[Stage, ...]:
    """The stages that asking for a target means, in the order in which they run."""
    stages = graph.needed_for(target, config)
    return (*stages, *graph.campaigns_of(target)) if full else stages


def refuse_without_contact(stage: Stage, config: Config) -> None:
    """Raise ConfigError if a stage is asked for that the config leaves out."""
    if stage.needs_contact and config.contact is None:
        raise ConfigError(
            f"{stage.name} needs a contact block, and the config has none.",
            "Add one to the config; `walkerlab schema` lists its keys.",
        )


class Run:
    """One execution: what is known of the results, and what was done so far."""

    def __init__(self, planner: Planner, reporter: Reporter, jobs: int) -> None:
        """Nothing is done yet."""
        self.planner = planner
        self.folder = planner.folder
        self.reporter = reporter
        self.jobs = jobs
        self.done: list[Done] = []
        self.announced = False
        self.ahead = Ahead()
        self.later: Sequence[Stage] = ()

    def carry_out(self, stages: Sequence[Stage]) -> None:
        """Decide on one stage after another, and do it."""
        for index, stage in enumerate(stages):
            self.later = stages[index + 1 :]
            self.planner.look_at_current(stage, stages)
            step = self.planner.decide(stage)
            if step.damaged and step.origin is None:
                self.reporter.warn(f"{self.folder.artifact(stage.name)} is {step.reason}; made anew")
            if step.action == "run":
                self._run(step)
            else:
                if step.origin is not None:
                    take_over(step.origin, self.folder.artifact(stage.name))
                self.planner.expect(step)
                self.skip(step)

    def skip(self, step: Step) -> None:
        """Take note of a stage that does not run."""
        self._record(Done(step.stage.name, step.action, step.reason))

    def _record(self, done: Done) -> None:
        self.done.append(done)
        self.reporter.note(said_of(done))

    def _run(self, step: Step) -> None:
        started = time.perf_counter()
        try:
            result = self._result(step)
        finally:
            self.reporter.finish()
        self.planner.settle(step.stage, result)
        reason = step.reason if result.complete else f"no answer: {no_answer(result)}"
        self._record(Done(step.stage.name, "run", reason, time.perf_counter() - started))

    def _result(self, step: Step) -> Stored:
        """Run a stage and store what it returns, or what it has got when it finds that there is no answer."""
        stage, identity = step.stage, step.identity
        assert identity is not None, "a stage that is left out does not run"
        inputs = self.planner.inputs(stage)
        digests = {name: input_digest(stage, result) for name, result in inputs.items()}
        begun = provenance.begin(self.planner.config, digests)
        complete = True
        try:
            content = self._call(step, inputs)
        except NoAnswer as error:
            content, complete = unanswered(error), False
        path = self.folder.artifact(stage.name)
        stored = artifact.write(path, content, identity, begun.until_now(), complete)
        if stage.keeps_parts:
            self._parts(step).forget()
        return stored

    def _parts(self, step: Step) -> Parts:
        """What an earlier run has left of a result."""
        assert step.identity is not None, "a stage that is left out has no parts"
        return Parts(self.folder.parts(step.stage.name), step.identity.key)

    def _call(self, step: Step, inputs: dict[str, Stored]) -> Content:
        """Call a stage's `run` with what it declared and nothing else."""
        stage = step.stage
        # Imported now and not before: a stage brings its libraries and compiled code along.
        run = importlib.import_module(stage.module).run
        self._announce_compilation()
        self.ahead.wait_for(stage)
        config = only(self.planner.config, stage.reads)
        extra: dict[str, Any] = {"jobs": self.jobs} if stage.has_cells else {}
        if stage.keeps_parts:
            extra["parts"] = parts = self._parts(step)
            if self.planner.force:
                parts.forget()
        if stage.draws:
            extra |= {"folder": self.folder.path, "left_out": self.planner.missing_inputs(stage)}
            with drawing_into(self.folder.path):
                content = run(config, inputs, self.reporter, **extra)
        else:
            content = run(config, inputs, self.reporter, **extra)
        if not isinstance(content, Content):
            raise TypeError(f"{stage.module}.run returned {type(content).__name__}, not Content")
        return content

    def _announce_compilation(self) -> None:
        """Say once why the first stages of a new installation take so long; a stage without kernels is not asked."""
        kernels = sys.modules.get("walkerlab.kernels")
        if kernels is not None and not self.announced and kernels.nothing_compiled_yet():
            self.announced = True
            self.reporter.note("compiling the models for this machine, once; later runs use the compiled code")
            self.ahead.begin(self.later, self.planner.config)

    def report(self, target: Stage, wall_s: float) -> StageReport:
        """How it went."""
        result = self.planner.results.get(target.name)
        summary = dict(result.summary) if result is not None else {}
        for campaign in self.planner.graph.campaigns_of(target.name):
            if campaign.name in self.planner.results:
                summary[campaign.name] = self.planner.results[campaign.name].summary
        return StageReport(
            stage=target.name,
            run_dir=self.folder.path,
            artifact=self.folder.artifact(target.name) if result is not None else None,
            reused=any(done.stage == target.name and done.action == "reuse" for done in self.done),
            wall_s=wall_s,
            left_out=self._left_out(target, summary.pop("left_out", [])),
            summary=summary,
            steps=tuple(self.done),
            no_answer=self._no_answer(summary.get("no_answer")),
        )

    def _left_out(self, target: Stage, by_stage: Sequence[dict[str, str]]) -> tuple[LeftOut, ...]:
        """Stages that were left out on the way, results that a drawing did without, and what scenes do without.

        What is optional and nobody asked for was not left out; a drawing says all the same that there is one.
        """
        graph = self.planner.graph
        found = list(self.planner.missing_inputs(target)) if target.draws else []
        found = [entry for entry in found if not graph[entry.what].optional]
        found += [left_out(done.stage, done.reason) for done in self.done if done.action == "leave out"]
        entries = [*by_stage]
        for done in self.done:
            if done.action != "leave out":
                entries += graph[done.stage].does_without(self.planner.config)
        found += [LeftOut(str(entry["what"]), str(entry["why"]), str(entry.get("saves", ""))) for entry in entries]
        return tuple(dict.fromkeys(found))

    def _no_answer(self, said: dict[str, str] | None) -> NoAnswer | None:
        """Whether the target, or something that it needs or has to do without, has no answer."""
        if said is not None:
            return NoAnswer(said["message"], said["advice"])
        for done in self.done:
            result = self.planner.results.get(done.stage)
            said = None if result is None else result.summary.get("no_answer")
            if said is not None:
                return NoAnswer(f"{done.stage}: {said['message']}", said["advice"])
        return None


def unanswered(error: NoAnswer) -> Content:
    """What is stored of a stage without an answer: what it has got, and what it says."""
    partial = error.partial if isinstance(error.partial, Content) else Content()
    said = {"message": error.message, "advice": error.advice}
    return replace(partial, summary={**partial.summary, "no_answer": said})


def said_of(done: Done) -> str:
    """One line about what was done with a stage."""
    match done.action:
        case "run":
            return f"{done.stage}: ran in {done.wall_s:.2f} s ({done.reason})"
        case "reuse":
            return f"{done.stage}: reused ({done.reason})"
        case _:
            return f"{done.stage}: left out ({done.reason})"
