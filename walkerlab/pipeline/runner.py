"""Runs a stage and what it needs: reuses what is up to date, stores each result as soon as it is there."""

import importlib
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.kernel_cache import watched
from walkerlab.pipeline import plan
from walkerlab.pipeline.graph import PIPELINE, Graph, Stage
from walkerlab.pipeline.progress import Reporter, Silent, StageReporter
from walkerlab.pipeline.runs import claim, refuse_another_config
from walkerlab.pipeline.task import Precompiler, StageAnswer, StageTask, nothing_compiled_yet, run_in_worker, task_of
from walkerlab.scene.left_out import LeftOut
from walkerlab.store import artifact, provenance
from walkerlab.store.elsewhere import take_over
from walkerlab.store.parts import Parts
from walkerlab.store.provenance import Provenance
from walkerlab.store.runfolder import RunFolder
from walkerlab.workers import WorkerPool


@dataclass(frozen=True)
class StageDone:
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
    """Have the result of a stage in its folder, running what is not up to date.

    Raises ConfigError if the config has not what the target needs or the folder holds results of another one,
    LockedError (only without `options.wait`), StorageError.
    No answer is no exception here: see `StageReport.no_answer`.
    """
    started = time.perf_counter()
    graph[target].refuse_unsuited(target, config)
    if not options.dry:
        graph[target].refuse_question(config)
    stages = graph.needed_for(target, config) + (graph.campaigns_of(target) if options.full else ())
    planner = plan.Planner(config, folder, graph, options.force)
    steps = planner.plan(stages)
    run = Execution(planner, reporter or Silent(), options.jobs)
    changes = any(step.action == "run" or step.origin is not None for step in steps)
    if changes and options.dry:
        refuse_another_config(folder, config)
    if changes and not options.dry:
        refuse_incomplete_law(config, steps)
        reused = "" if options.force else ", and its results will be reused"
        with folder.locked(options.wait, lambda held: run.reporter.note(held + reused)):
            claim(folder, config)
            # Decided anew, stage by stage: another process may have worked here until now.
            run = Execution(plan.Planner(config, folder, graph, options.force), run.reporter, options.jobs)
            run.carry_out(stages, [step.stage for step in steps if step.action == "run"])
    else:
        for step in steps:
            run.skip(step)
    return run.report(graph[target], time.perf_counter() - started)


def refuse_incomplete_law(config: Config, steps: Sequence[plan.Step]) -> None:
    """Raise ConfigError, before anything is compiled, for a friction law of the user's own that lacks something."""
    if config.contact is not None and any(step.stage.needs_contact for step in steps if step.action == "run"):
        # Imported here: it loads the compiler, as what runs will.
        from walkerlab.scene.contact import friction_law

        friction_law(config.contact)


@dataclass(frozen=True)
class Begun:
    """A stage that runs."""

    step: plan.Step
    task: StageTask
    provenance: Provenance
    reporter: StageReporter
    started: float


class Execution:
    """One execution: what is known of the results, and what was done so far."""

    def __init__(self, planner: plan.Planner, reporter: Reporter, jobs: int) -> None:
        """Nothing is done yet."""
        self.planner = planner
        self.folder = planner.folder
        self.reporter = reporter
        self.jobs = jobs
        self.done: list[StageDone] = []
        self.waiting: list[Stage] = []
        self.running: dict[Future[Any] | None, Begun] = {}
        self.working: set[Future[Any]] = set()
        self.events: SimpleQueue[Callable[[], bool]] = SimpleQueue()
        self.left: list[str] = []
        self.of = 0

    def carry_out(self, stages: Sequence[Stage], to_run: Sequence[Stage]) -> None:
        """Decide on the stages, and do what is decided; those of `to_run` will probably run."""
        self.waiting, self.left, self.of = list(stages), [stage.name for stage in to_run], len(to_run)
        try:
            with WorkerPool(self.jobs) as pool:
                precompiler = Precompiler(pool, self.planner.config)
                if self.jobs > 1 and any_side_by_side(to_run, self.planner.config):
                    self._side_by_side(stages, pool, precompiler)
                else:
                    self._one_by_one(stages, precompiler)
                precompiler.raise_bugs({done.stage for done in self.done if done.action == "run"})
        finally:
            for begun in self.running.values():
                begun.reporter.end("")

    def skip(self, step: plan.Step) -> None:
        """Take note of a stage that does not run."""
        done = StageDone(step.stage.name, step.action, step.reason)
        self.done.append(done)
        self.reporter.note(said_of(done))

    def _one_by_one(self, stages: Sequence[Stage], precompiler: Precompiler) -> None:
        for stage in stages:
            step = self.planner.decide(stage, stages)
            self.waiting.remove(stage)
            if step.action != "run":
                self._pass_over(step)
                continue
            importlib.import_module(stage.module)
            if not precompiler.begun and nothing_compiled_yet():
                precompiler.begin(self.waiting)
            precompiler.wait_for(stage)
            begun = self.running[None] = self._begin(step)
            with watched(begun.reporter.compiling):
                answer = begun.task.run(begun.reporter)
            self._settle(self.running.pop(None), answer)
            self._draw_early(stages)

    def _pass_over(self, step: plan.Step) -> None:
        """Go on without running a stage; its result may lie in another run folder."""
        if step.origin is not None:
            take_over(step.origin, self.folder.artifact(step.stage.name))
        self.planner.expect(step)
        self.skip(step)

    def _side_by_side(self, stages: Sequence[Stage], pool: WorkerPool, precompiler: Precompiler) -> None:
        while self.waiting or self.running:
            self._start_what_can_run(stages, pool, precompiler)
            while self.working and not self.events.get()():
                pass
            self._draw_early(stages)

    def _start_what_can_run(self, stages: Sequence[Stage], pool: WorkerPool, precompiler: Precompiler) -> None:
        """Give work to free processes: stages whose inputs are there, kernels of those that wait."""
        for stage in list(self.waiting):
            if len(self.working) == self.jobs or any(begun.step.stage.alone for begun in self.running.values()):
                return
            if not self._ready(stage, stages):
                compiling = precompiler.begin_if_first(stage) if stage.name in self.left else None
                if compiling is not None:
                    self._work(compiling)
                continue
            step = self.planner.decide(stage, stages)
            if step.action != "run":
                self.waiting.remove(stage)
                self._pass_over(step)
            elif not (stage.alone and self.running):
                self.waiting.remove(stage)
                begun = self._begin(step)
                future = pool.start(partial(run_in_worker, begun.task), partial(self._heard, begun.reporter))
                self.running[future] = begun
                self._work(future)

    def _work(self, future: Future[Any]) -> None:
        """Look after a process's work; its end is an event."""
        self.working.add(future)
        future.add_done_callback(lambda ended: self.events.put(partial(self._ended, ended)))

    def _heard(self, reporter: StageReporter, told: tuple[str, Any]) -> None:
        """Have what a process tells passed on in this thread's turn; it is heard in another one, and ends nothing."""
        call, *arguments = told
        self.events.put(lambda: bool(getattr(reporter, call)(*arguments)))

    def _ended(self, future: Future[Any]) -> bool:
        """Store what a stage has returned; True, since a process is free."""
        self.working.remove(future)
        if future in self.running:
            answer = future.result()
            self._settle(self.running.pop(future), answer)
        return True

    def _ready(self, stage: Stage, stages: Sequence[Stage]) -> bool:
        """Whether all that a stage takes is there, or known not to come."""
        return not {*stage.results(self.planner.config)} & self._unsettled() & {one.name for one in stages}

    def _unsettled(self) -> set[str]:
        """The stages that wait or run."""
        return {one.name for one in self.waiting} | {begun.task.name for begun in self.running.values()}

    def _begin(self, step: plan.Step) -> Begun:
        stage, identity = step.stage, step.identity
        assert identity is not None, "a stage that is left out does not run"
        if step.damaged and step.origin is None:
            self.reporter.warn(f"{self.folder.artifact(stage.name)} is {step.reason}; recomputed")
        parts = Parts(self.folder.parts(stage.name), identity.key)
        if self.planner.force:
            parts.forget()
        inputs = self.planner.inputs(stage)
        digests = {name: plan.input_digest(stage, result) for name, result in inputs.items()}
        task = task_of(
            stage,
            self.planner.config,
            inputs,
            jobs=self.jobs,
            parts=parts,
            folder=self.folder.path,
            left_out=self.planner.missing_inputs(stage),
        )
        expected = None if step.found is None else step.found.provenance.took_s
        number = self.of - len(self.left) + 1 + len(self.running)
        of = max(self.of, number)
        place = [f"{number} of {of}"] if of > 1 else []
        why = [step.reason] if step.reason != artifact.NOT_THERE else []
        reporter = self.reporter.begin(stage.name, ", ".join(place + why), expected)
        return Begun(step, task, provenance.begin(self.planner.config, digests), reporter, time.perf_counter())

    def _settle(self, begun: Begun, answer: StageAnswer) -> None:
        """Store what a stage has returned, or what it has got where it found that there is no answer."""
        stage, identity = begun.step.stage, begun.step.identity
        assert identity is not None, "a stage that is left out does not run"
        path = self.folder.artifact(stage.name)
        try:
            result = artifact.write(
                path, answer.stored, identity, begun.provenance.until_now(), answer.no_answer is None
            )
        except BaseException:
            begun.reporter.end("")
            raise
        Parts(self.folder.parts(stage.name), identity.key).forget()
        self.planner.settle(stage, result)
        reason = begun.step.reason if result.complete else f"no answer: {plan.no_answer(result)}"
        done = StageDone(stage.name, "run", reason, time.perf_counter() - begun.started)
        self.done.append(done)
        self.left = [name for name in self.left if name != stage.name]
        answered = [] if result.complete else ["no answer"]
        left = [f"left: {', '.join(self.left)}"] if self.left else []
        begun.reporter.end("; ".join([said_of(done), *answered, *left]))

    def _draw_early(self, stages: Sequence[Stage]) -> None:
        """Draw what is to be looked at while the rest is still being computed."""
        unsettled, config, graph = self._unsettled(), self.planner.config, self.planner.graph
        for stage in self.waiting:
            inputs = self.planner.inputs(stage)
            wanted = unsettled.intersection(stage.inputs(config))
            pending = {name for name in wanted if graph[name].why_unsuited(config) is None}
            others = [name for name in pending if not graph[name].draws]
            if not stage.early_with or not others or not inputs or unsettled & set(stage.early_with):
                continue
            absent = [entry for entry in self.planner.missing_inputs(stage) if entry.what not in pending]
            absent += [LeftOut(one.name, plan.STILL_COMPUTED) for one in stages if one.name in pending]
            task = task_of(stage, config, inputs, folder=self.folder.path, left_out=tuple(absent))
            self.reporter.drawn(task.run(Silent()).content.summary, self.folder.path)

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
            results={name: dict(one.summary) for name, one in self.planner.results.items() if one.complete},
        )

    def _left_out(self, target: Stage, by_stage: Sequence[dict[str, str]]) -> tuple[LeftOut, ...]:
        """Stages that were left out on the way, results that a drawing did without, and what scenes do without.

        What is optional and nobody asked for was not left out; a drawing says all the same that there is one.
        """
        graph = self.planner.graph
        found = list(self.planner.missing_inputs(target)) if target.draws else []
        found = [entry for entry in found if not graph[entry.what].optional]
        found += [plan.left_out(done.stage, done.reason) for done in self.done if done.action == "leave out"]
        entries = [*by_stage]
        for done in self.done:
            if done.action != "leave out":
                entries += graph[done.stage].does_without(self.planner.config)
        found += [LeftOut(**entry) for entry in entries]
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


def any_side_by_side(stages: Sequence[Stage], config: Config) -> bool:
    """Whether two of the stages need nothing of each other."""
    needed: dict[str, set[str]] = {}
    for stage in stages:
        own = {name for name in stage.results(config) if name in needed}
        needed[stage.name] = own.union(*(needed[name] for name in own))
    return any(len(needed[stage.name]) < place for place, stage in enumerate(stages))


def told_once(why: str) -> str:
    """A reason without that of another stage or of the error, which are told themselves."""
    return why.partition(": ")[0] if why.startswith(("it needs ", "no answer: ")) else why.partition(": no answer: ")[0]


def said_of(done: StageDone) -> str:
    """One line about what was done with a stage."""
    why = told_once(done.reason)
    match done.action:
        case "run":
            return f"{done.stage}: ran in {done.wall_s:.2f} s"
        case "reuse":
            return f"{done.stage}: reused ({why})"
        case _:
            return f"{done.stage}: left out ({why})"
