"""Bring a stage in a run's folder up to date under the folder's lock, and report the outcome.

If the stage found parameters, `run_and_write` also writes a config with them that extends the run's config.
"""

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from walkerlab.config import files, loader, schema, writer
from walkerlab.errors import NoAnswer
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.planner import Planner, omission_of
from walkerlab.pipeline.plan.resolve import ResolvedRun
from walkerlab.pipeline.plan.results import FolderResults, Step
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.progress import Reporter
from walkerlab.pipeline.run.executor import Executor
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.pipeline.store.files import write_numbered
from walkerlab.pipeline.store.runs import RunFolder, claim, refuse_another_config
from walkerlab.scene.omissions import LeftOut


@dataclass(frozen=True)
class StageReport:
    """Report on running a stage."""

    stage: str
    run_dir: Path  # the run's folder
    artifact: Path | None  # file of the result; None if there is no result
    reused: bool  # whether the result existed already
    wall_s: float  # total time, including that of the inputs
    left_out: tuple[LeftOut, ...]  # results that were not computed, with the reasons
    summary: dict[str, Any]  # summary of the result; empty if there is no result
    steps: tuple[Step, ...]  # action taken for each stage
    # Error of the requested stage or, if that has an answer, of the first stage without one. None if all have answers.
    no_answer: NoAnswer | None = None
    # summaries of all stages with a complete result, by stage
    results: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    content: Stored | None = None  # the result as stored; None if there is no result

    def as_json(self) -> dict[str, Any]:
        """Return the JSON object of a stage: keys common to all stages, then those of its summary."""
        common: dict[str, Any] = {
            "stage": self.stage,
            "run_dir": str(self.run_dir),
            "artifact": None if self.artifact is None else str(self.artifact),
            "reused": self.reused,
            "wall_s": self.wall_s,
            "left_out": [asdict(entry) for entry in self.left_out],
        }
        findings = {key: value for key, value in self.summary.items() if key not in (*common, "no_answer")}
        error = {} if self.no_answer is None else {"error": self.no_answer.as_json()}
        stages = [
            {"stage": step.stage.name, "action": step.action, "reason": step.reason, "wall_s": step.wall_s}
            for step in self.steps
        ]
        return common | findings | {"stages": stages} | error


@dataclass(frozen=True)
class Options:
    """Options for running a stage."""

    force: bool = False  # run the stage and all that it needs, even if their results are current
    wait: bool = True  # if another process works in the folder, wait for it and reuse what it has stored
    jobs: int = 1  # maximum number of processes, for independent stages and for independent work units of a stage
    full: bool = False  # also run the stage's long campaigns
    dry: bool = False  # only report the plan, without changing a file


DEFAULT_OPTIONS = Options()


def execute(
    config: schema.Config,
    target: str,
    folder: RunFolder,
    options: Options = DEFAULT_OPTIONS,
    reporter: Reporter | None = None,
    graph: Graph = PIPELINE,
) -> StageReport:
    """Bring a stage's result up to date, running whatever it needs.

    Raises ConfigError if the config lacks a block that the target requires or the folder holds results of another
    config, LockedError if another process works in the folder and `options.wait` is false, and StorageError. A stage
    without an answer raises nothing (see `StageReport.no_answer`).
    """
    started = time.perf_counter()
    graph[target].refuse_unsuited(target, config)
    if not options.dry:
        graph[target].refuse_question(config)
    stages = graph.needed_for(target, config) + (graph.campaigns_of(target) if options.full else ())

    def executor() -> Executor:
        planner = Planner(config, FolderResults(folder, graph), stages, force=options.force)
        return Executor(planner, options.jobs, reporter)

    run = executor()
    steps = run.planner.plan()
    changes = any(step.action == "run" or step.origin is not None for step in steps)
    if changes and options.dry:
        refuse_another_config(folder, config)
    if changes and not options.dry:
        for stage in (step.stage for step in steps if step.action == "run"):
            stage.checks(config)
        reused = "" if options.force else "; its results will be reused"
        with folder.locked(options.wait, lambda message: run.reporter.note(message + reused)):
            claim(folder, config)
            # Decide again, because another process may have worked in the folder until now.
            run = executor()
            run.carry_out([step.stage for step in steps if step.action == "run"])
    else:
        for step in steps:
            run.skip(step)
    return report_of(run, folder, graph[target], time.perf_counter() - started)


def run_and_write(
    run: ResolvedRun,
    target: str,
    options: Options = DEFAULT_OPTIONS,
    reporter: Reporter | None = None,
    graph: Graph = PIPELINE,
) -> StageReport:
    """Execute a stage of a run. If it found parameters, write a config with them and add its file to the summary.

    Raises the errors of `execute`, and StorageError if the config cannot be written.
    """
    report = execute(run.loaded.config, target, run.folder, options, reporter, graph)
    name = graph[target].finds
    if name and report.summary and report.no_answer is None and not options.dry:
        report.summary["config"] = str(write_config(run, report, name))
    return report


def write_config(run: ResolvedRun, report: StageReport, name: str) -> Path:
    """Write the parameters that a stage found as a config of this name, and return its file."""
    summary = report.summary
    values = summary["best"] if "best" in summary else {row["key"]: row["value"] for row in summary["estimates"]}
    found = run.loaded.variant([files.parse_setting(f"{key}={value!r}") for key, value in values.items()])
    base = loader.paper_config_with({}) if run.extends == files.DEFAULT else run.loaded.base
    # The new config describes the walker that was found, without the settings of the stage that found it.
    changed = found.model_copy(update={report.stage: getattr(base, report.stage)})
    # A path in `extends` is relative to the file that contains it.
    typed = run.extends if run.extends in files.builtin_names() else os.path.relpath(run.extends, report.run_dir)
    text = writer.to_extending_yaml(typed, base, changed, f"{base.name}-{name}")
    return write_numbered(report.run_dir / f"{name}.yaml", text)


def report_of(run: Executor, folder: RunFolder, target: Stage, wall_s: float) -> StageReport:
    answers = run.planner.answers
    result = answers.get(target.name)
    summary = dict(result.summary) if result is not None else {}
    for campaign in run.planner.graph.campaigns_of(target.name):
        if campaign.name in answers:
            summary[campaign.name] = answers[campaign.name].summary
    return StageReport(
        stage=target.name,
        run_dir=folder.path,
        artifact=folder.artifact(target.name) if result is not None else None,
        reused=any(done.stage.name == target.name and done.action == "reuse" for done in run.done),
        wall_s=wall_s,
        left_out=all_left_out(run, target, summary.pop("left_out", [])),
        summary=summary,
        steps=tuple(run.done),
        no_answer=no_answer_of(run, summary.get("no_answer")),
        results={name: dict(answer.summary) for name, answer in answers.items() if answer.complete},
        content=result if isinstance(result, Stored) else None,
    )


def all_left_out(run: Executor, target: Stage, by_stage: Sequence[dict[str, str]]) -> tuple[LeftOut, ...]:
    """List what was left out: stages, results missing in a drawing, and parts that stages omit under this config.

    Optional results that nobody requested are not listed.
    """
    missing = run.planner.missing_inputs(target) if target.draws else ()
    absent = [entry for entry in missing if not run.planner.graph[entry.what].only_by]
    absent += [omission_of(done.stage.name, done.reason) for done in run.done if done.action == "leave out"]
    entries = [*by_stage]
    for done in run.done:
        if done.action != "leave out":
            entries += done.stage.does_without(run.planner.config)
    absent += [LeftOut(**entry) for entry in entries]
    return tuple(dict.fromkeys(absent))


def no_answer_of(run: Executor, message: dict[str, str] | None) -> NoAnswer | None:
    """Return the error of the target or, if it has an answer, of the first stage without one. Return None if all have
    one.

    message  message and advice of the target's error; None if it has an answer
    """
    if message is not None:
        return NoAnswer(message["message"], message["advice"])
    for name, answer in ((done.stage.name, run.planner.answers.get(done.stage.name)) for done in run.done):
        reason = None if answer is None else answer.summary.get("no_answer")
        if reason is not None:
            return NoAnswer(f"{name}: {reason['message']}", reason["advice"])
    return None
