"""A stage in a run's folder: brought up to date with all it needs, under the folder's lock, and how that went."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.pipeline.executor import Executor, StageDone, left_out
from walkerlab.pipeline.graph import PIPELINE, Graph, Stage
from walkerlab.pipeline.progress import Reporter
from walkerlab.pipeline.results import FolderResults, Step
from walkerlab.pipeline.runs import claim, refuse_another_config
from walkerlab.scene.omissions import LeftOut
from walkerlab.store.runfolder import RunFolder


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
    results    the summaries of all stages on the way that have a result
    """

    stage: str
    run_dir: Path
    artifact: Path | None
    reused: bool
    wall_s: float
    left_out: tuple[LeftOut, ...]
    summary: dict[str, Any]
    steps: tuple[StageDone, ...]
    no_answer: NoAnswer | None = None
    results: Mapping[str, dict[str, Any]] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The one JSON object of a stage: the keys that all stages have, then those of its summary."""
        common: dict[str, Any] = {
            "stage": self.stage,
            "run_dir": str(self.run_dir),
            "artifact": None if self.artifact is None else str(self.artifact),
            "reused": self.reused,
            "wall_s": self.wall_s,
            "left_out": [asdict(entry) for entry in self.left_out],
        }
        own = {key: value for key, value in self.summary.items() if key not in (*common, "no_answer")}
        error = {} if self.no_answer is None else {"error": self.no_answer.as_json()}
        return common | own | {"stages": [asdict(done) for done in self.steps]} | error


@dataclass(frozen=True)
class Options:
    """How a stage is run.

    force  run it and all it needs, up to date or not
    wait   for another process that works in the folder, and reuse what it made
    jobs   processes: stages that do not need each other run side by side, and so do independent cells of a stage
    full   run its campaigns too
    dry    only say what would be done, as the report before anything has run; touches nothing
    """

    force: bool = False
    wait: bool = True
    jobs: int = 1
    full: bool = False
    dry: bool = False


USUAL = Options()


def execute(
    config: Config,
    target: str,
    folder: RunFolder,
    options: Options = USUAL,
    reporter: Reporter | None = None,
    graph: Graph = PIPELINE,
) -> StageReport:
    """Bring a stage's result up to date, running whatever it needs.

    Raises ConfigError if the config has not what the target needs or the folder holds results of another one,
    LockedError (only without `options.wait`), StorageError.
    No answer is no exception here: see `StageReport.no_answer`.
    """
    started = time.perf_counter()
    graph[target].refuse_unsuited(target, config)
    if not options.dry:
        graph[target].refuse_question(config)
    stages = graph.needed_for(target, config) + (graph.campaigns_of(target) if options.full else ())

    def executor() -> Executor:
        results = FolderResults(folder, graph)
        return Executor(config, results, stages, force=options.force, jobs=options.jobs, reporter=reporter)

    run = executor()
    steps = run.plan()
    changes = any(step.action == "run" or step.origin is not None for step in steps)
    if changes and options.dry:
        refuse_another_config(folder, config)
    if changes and not options.dry:
        refuse_incomplete_law(config, steps)
        reused = "" if options.force else ", and its results will be reused"
        with folder.locked(options.wait, lambda held: run.reporter.note(held + reused)):
            claim(folder, config)
            # Decided anew, stage by stage: another process may have worked here until now.
            run = executor()
            run.carry_out([step.stage for step in steps if step.action == "run"])
    else:
        for step in steps:
            run.skip(step)
    return report_of(run, folder, graph[target], time.perf_counter() - started)


def refuse_incomplete_law(config: Config, steps: Sequence[Step]) -> None:
    """Raise ConfigError, before anything is compiled, for a friction law of the user's own that lacks something."""
    if config.contact is not None and any(step.stage.needs_contact for step in steps if step.action == "run"):
        # Imported here: it loads the compiler, as what runs will.
        from walkerlab.scene.contact import friction_law

        friction_law(config.contact)


def report_of(run: Executor, folder: RunFolder, target: Stage, wall_s: float) -> StageReport:
    """Report how the executor brought a target up to date."""
    result = run.answers.get(target.name)
    summary = dict(result.summary) if result is not None else {}
    for campaign in run.graph.campaigns_of(target.name):
        if campaign.name in run.answers:
            summary[campaign.name] = run.answers[campaign.name].summary
    return StageReport(
        stage=target.name,
        run_dir=folder.path,
        artifact=folder.artifact(target.name) if result is not None else None,
        reused=any(done.stage == target.name and done.action == "reuse" for done in run.done),
        wall_s=wall_s,
        left_out=all_left_out(run, target, summary.pop("left_out", [])),
        summary=summary,
        steps=tuple(run.done),
        no_answer=no_answer_of(run, summary.get("no_answer")),
        results={name: dict(one.summary) for name, one in run.answers.items() if one.complete},
    )


def all_left_out(run: Executor, target: Stage, by_stage: Sequence[dict[str, str]]) -> tuple[LeftOut, ...]:
    """Stages that were left out on the way, results that a drawing did without, and what scenes do without.

    What is optional and nobody asked for was not left out; a drawing says all the same that there is one.
    """
    found = list(run.missing_inputs(target)) if target.draws else []
    found = [entry for entry in found if not run.graph[entry.what].optional]
    found += [left_out(done.stage, done.reason) for done in run.done if done.action == "leave out"]
    entries = [*by_stage]
    for done in run.done:
        if done.action != "leave out":
            entries += run.graph[done.stage].does_without(run.config)
    found += [LeftOut(**entry) for entry in entries]
    return tuple(dict.fromkeys(found))


def no_answer_of(run: Executor, message: dict[str, str] | None) -> NoAnswer | None:
    """Say that the target, or something that it needs or has to do without, has no answer; None if all have.

    message  that of the target itself, with advice
    """
    if message is not None:
        return NoAnswer(message["message"], message["advice"])
    for name, answer in ((done.stage, run.answers.get(done.stage)) for done in run.done):
        said = None if answer is None else answer.summary.get("no_answer")
        if said is not None:
            return NoAnswer(f"{name}: {said['message']}", said["advice"])
    return None
