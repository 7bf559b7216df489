"""Executor that reuses, runs or leaves out each stage of a pipeline."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial
from queue import SimpleQueue
from typing import Any

from walkerlab.config.schema import Config
from walkerlab.pipeline.graph import PIPELINE
from walkerlab.pipeline.progress import Reporter, Silent, StageReporter
from walkerlab.pipeline.results import FolderResults, MemoryResults, Results, Step
from walkerlab.pipeline.stage import Graph, Stage, without_block
from walkerlab.pipeline.store.artifact import NOT_THERE, Stored
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.key import Identity
from walkerlab.pipeline.store.runfolder import RunFolder
from walkerlab.pipeline.task import Task, run_in_worker, task_of
from walkerlab.pipeline.workers import WorkerPool
from walkerlab.scene.omissions import STILL_COMPUTED, STOPPED, LeftOut


@dataclass(frozen=True)
class RunningStage:
    """A running stage."""

    step: Step
    task: Task
    reporter: StageReporter
    started: float


class Executor:
    """Brings the results of some stages up to date for one config.

    stages    stages to bring up to date, each after the stages that it needs
    force     run every stage that is not left out, even if its result is current
    jobs      maximum number of processes, for independent stages and for independent work units of a stage
    again     whether to repeat walks at tighter tolerances to measure their numerical error
    answers   results so far, by stage
    left_out  reasons why stages are left out, by stage
    done      steps that have ended so far, without their results, which would otherwise stay in memory
    """

    def __init__(
        self,
        config: Config,
        results: Results,
        stages: Sequence[Stage],
        *,
        force: bool = False,
        jobs: int = 1,
        again: bool = True,
        reporter: Reporter | None = None,
    ) -> None:
        """Store the arguments without reading or running anything."""
        self.config, self.results, self.stages, self.graph = config, results, tuple(stages), results.keys.graph
        self.force, self.jobs, self.again, self.reporter = force, jobs, again, reporter or Silent()
        self.answers: dict[str, Content] = {}
        self.left_out: dict[str, str] = {}
        self.done: list[Step] = []
        self._early: dict[str, Content] = {}
        self._keys: dict[str, str] = {}
        self._waiting: list[Stage] = []
        self._running: dict[Future[Any] | None, RunningStage] = {}
        self._working: set[Future[Any]] = set()
        self._events: SimpleQueue[Callable[[], bool]] = SimpleQueue()
        self._left: list[str] = []
        self._total = 0

    def plan(self) -> tuple[Step, ...]:
        """Decide for each stage whether to reuse, run or leave it out, assuming that all succeed; changes no file."""
        steps = []
        for stage in self.stages:
            step = self._decide(stage)
            if not (stage.only_by and step.action == "run"):  # an optional result counts only if it exists
                self._expect(step)
            steps.append(step)
        return tuple(steps)

    def carry_out(self, likely: Sequence[Stage] = ()) -> None:
        """Reuse, run or leave out each stage; `likely` holds the stages that the plan expects to run."""
        self._waiting, self._left, self._total = list(self.stages), [stage.name for stage in likely], len(likely)
        side_by_side = self.jobs > 1 and any_side_by_side(likely, self.config)
        try:
            with WorkerPool(self.jobs) as pool:
                while self._waiting or self._running:
                    self._start_ready_stages(pool if side_by_side else None)
                    while self._working and not self._events.get()():
                        pass
                    self._draw_early(self._waiting)
        except BaseException:
            self._draw_early(self._waiting[-1:], STOPPED)
            raise
        finally:
            for running_stage in self._running.values():
                running_stage.reporter.end("")

    def skip(self, step: Step) -> None:
        """Record a stage that does not run."""
        self.done.append(replace(step, found=None))
        self.reporter.note(outcome_line(step))

    def inputs(self, stage: Stage) -> dict[str, Content]:
        """Return the available results that a stage uses, required or optional, by stage."""
        available = self.answers.keys() - self.left_out.keys()
        return {name: self.answers[name] for name in stage.results(self.config) if name in available}

    def missing_inputs(self, stage: Stage) -> tuple[LeftOut, ...]:
        """Return the results that a stage lacks, with the reasons."""
        missing = (name for name in stage.results(self.config) if name not in self._keys)
        return tuple(omission_of(name, self._why_absent(name)) for name in missing)

    def _decide(self, stage: Stage) -> Step:
        """Decide whether to reuse, run or leave out a stage, after the same decision for its inputs.

        Optional inputs outside this plan are looked up first; a damaged one is recorded as left out.
        """
        for name in stage.if_current:
            if self.graph[name] not in self.stages:
                step = self._judge(self.graph[name], force=False)
                if step.action == "reuse" and step.origin is None:
                    self._expect(step)
                elif step.damaged:
                    self.left_out[name] = f"its result is {step.reason}; {self._command_of(name)} recomputes it"
        return self._judge(stage, self.force)

    def _judge(self, stage: Stage, force: bool) -> Step:
        why = stage.why_unsuited(self.config)
        for name in () if stage.draws else stage.inputs(self.config):
            if why is None and name in self.left_out:
                why = f"it needs {name}: {self.left_out[name]}"
        if why is not None:
            return Step(stage, "leave out", why)
        return self.results.find(stage, self._identity(stage), self.inputs(stage), force)

    def _identity(self, stage: Stage) -> Identity:
        keys = {name: self._keys[name] for name in stage.results(self.config) if name in self._keys}
        # a drawing states why results are left out, so the reasons are part of its identity
        keys |= {absent.what: f"left out: {absent.why}" for absent in self.missing_inputs(stage)}
        return self.results.keys.identity(stage, self.config, keys, self.again)

    def _expect(self, step: Step) -> None:
        """Record the expected outcome of a step, assuming that it succeeds."""
        if step.identity is None:
            self.left_out[step.stage.name] = step.reason
        elif step.action == "reuse" and step.found is not None:
            self._settle(step, step.found)
        else:
            self._keys[step.stage.name] = step.identity.key

    def _settle(self, step: Step, answer: Content) -> None:
        """Record a stage's result, or the reason why it found no answer."""
        self.answers[step.stage.name] = answer
        if answer.no_answer is not None:
            self.left_out[step.stage.name] = answer.no_answer.message
        elif step.identity is not None:
            self._keys[step.stage.name] = step.identity.key

    def _why_absent(self, name: str) -> str:
        command = self._command_of(name)
        if self.graph[name].only_by:
            return self.left_out.get(name, f"it was not requested; {command} computes it")
        none_yet = self.graph[name].why_unsuited(self.config) or f"no current result; {command} computes one"
        return self.left_out.get(name, none_yet)

    def _command_of(self, name: str) -> str:
        return f"`walkerlab {self.graph[name].command}`"

    def _start_ready_stages(self, pool: WorkerPool | None) -> None:
        """Start all ready stages in `pool`, or run the next one in this process if `pool` is None."""
        for stage in list(self._waiting):
            timing = any(running_stage.step.stage.work == "times" for running_stage in self._running.values())
            if timing or len(self._working) == self.jobs:
                return
            if not self._is_ready(stage):
                continue
            step = self._decide(stage)
            if step.action == "run" and stage.work == "times" and self._running:
                continue
            self._waiting.remove(stage)
            if step.action != "run":
                self.results.take_over(step)
                self._expect(step)
                self.skip(step)
            elif pool is None:
                self._run_here(step)
                return
            else:
                running_stage = self._begin(step)
                future = pool.start(
                    partial(run_in_worker, running_stage.task), partial(self._hear, running_stage.reporter)
                )
                self._running[future] = running_stage
                self._watch(future)

    def _run_here(self, step: Step) -> None:
        running_stage = self._running[None] = self._begin(step)
        self._finish(None, running_stage.task(running_stage.reporter))

    def _watch(self, future: Future[Any]) -> None:
        """Track a future; when it completes, an event is put in the queue."""
        self._working.add(future)
        future.add_done_callback(lambda ended: self._events.put(partial(self._ended, ended)))

    def _hear(self, reporter: StageReporter, message: tuple[str, Any]) -> None:
        """Pass a worker's message from the thread that receives it to this thread, through the event queue."""
        call, *arguments = message
        self._events.put(lambda: bool(getattr(reporter, call)(*arguments)))

    def _ended(self, future: Future[Any]) -> bool:
        """Handle a finished future; return True, because a process has become free."""
        self._working.remove(future)
        if future in self._running:
            self._finish(future, future.result())
        return True

    def _is_ready(self, stage: Stage) -> bool:
        return self._unsettled().isdisjoint(stage.results(self.config))

    def _unsettled(self) -> set[str]:
        running = (running_stage.step.stage for running_stage in self._running.values())
        return {stage.name for stage in (*self._waiting, *running)}

    def _begin(self, step: Step) -> RunningStage:
        if step.damaged is not None:
            self.reporter.warn(f"{step.damaged} is {step.reason}; recomputing it")
        stage, inputs = step.stage, self.inputs(step.stage)
        offered = dict(self.results.begin(step, self.config, inputs, self.force))
        absent = self.missing_inputs(stage)
        offered |= {"jobs": self.jobs, "again": self.again, "left_out": absent, "early": self._early.get(stage.name)}
        task = task_of(stage, self.config, inputs, **offered)
        number = self._total - len(self._left) + 1 + len(self._running)
        total = max(self._total, number)
        place = [f"{number} of {total}"] if total > 1 else []
        why = [step.reason] if step.reason != NOT_THERE else []
        expected = step.found.provenance.took_s if isinstance(step.found, Stored) else None
        reporter = self.reporter.begin(stage.name, ", ".join(place + why), expected)
        return RunningStage(step, task, reporter, time.perf_counter())

    def _finish(self, future: Future[Any] | None, answer: Content) -> None:
        """Store a stage's result (partial if the stage found no answer) and report that the stage has ended."""
        running_stage = self._running[future]
        step, name = running_stage.step, running_stage.step.stage.name
        awaited = any(name in stage.results(self.config) for stage in self._waiting)
        stored = self.results.keep(step, answer, awaited)
        del self._running[future]
        self._settle(step, stored)
        reason = step.reason if stored.no_answer is None else f"no answer: {stored.no_answer.message}"
        done = replace(step, reason=reason, found=None, wall_s=time.perf_counter() - running_stage.started)
        self.done.append(done)
        self._left = [stage_left for stage_left in self._left if stage_left != name]
        answered = [] if stored.complete else ["no answer"]
        rest = [f"still to run: {', '.join(self._left)}"] if self._left else []
        running_stage.reporter.end("; ".join([outcome_line(done), *answered, *rest]))

    def _draw_early(self, drawings: Sequence[Stage], why: str = STILL_COMPUTED) -> None:
        """Draw what the results so far suffice for; `why`: reason why the others are missing.

        Only the last drawing, the page, is drawn again after each stage: it also shows what the others have drawn.
        """
        unsettled = self._unsettled()
        folder = self.results.folder
        for stage in drawings:
            missing = unsettled.intersection(stage.results(self.config))
            inputs = self.inputs(stage) | {name: self._early[name] for name in missing & self._early.keys()}
            pending = {name for name in missing if self.graph[name].why_unsuited(self.config) is None}
            drawn = stage.name in self._early and stage is not self.stages[-1]
            if folder is None or not stage.early_with or not pending or not inputs or drawn:
                continue
            if unsettled.isdisjoint(stage.early_with):
                absent = [entry for entry in self.missing_inputs(stage) if entry.what not in pending]
                absent += [LeftOut(other.name, why) for other in self.stages if other.name in pending]
                task = task_of(stage, self.config, inputs, folder=folder, left_out=tuple(absent))
                self._early[stage.name] = task(Silent())
                self.reporter.announce_page(self._early[stage.name].summary, folder)


def survey(config: Config, folder: RunFolder, graph: Graph = PIPELINE) -> tuple[Step, ...]:
    """Return the step that would bring each stage of a run folder up to date; changes no file."""
    return Executor(config, FolderResults(folder, graph, elsewhere=False), graph.stages).plan()


def answer_in_memory(
    config: Config, target: str, memory: MemoryResults, *, again: bool = True, reporter: Reporter | None = None
) -> Content:
    """Compute a stage's result without files, reusing inputs from memory.

    again  whether to repeat walks at tighter tolerances to measure their numerical error

    Raises ConfigError as `Graph.needed_in_memory` does.
    """
    stages = memory.keys.graph.needed_in_memory(target, config)
    run = Executor(config, memory, stages, again=again, reporter=reporter)
    run.carry_out()
    if target in run.answers:
        return run.answers[target]
    advice = next(answer.no_answer.advice for answer in run.answers.values() if answer.no_answer is not None)
    return Content({}, {"no_answer": {"message": run.left_out[target], "advice": advice}}, complete=False)


def omission_of(stage: str, why: str) -> LeftOut:
    """Describe a stage that is left out, with the reason and what that saves."""
    return LeftOut(stage, why, "loading and compiling contact code" if why == without_block("contact") else "")


def any_side_by_side(stages: Sequence[Stage], config: Config) -> bool:
    """Whether at least two of the stages are independent and can run in parallel."""
    needed: dict[str, set[str]] = {}
    for stage in stages:
        own = {name for name in stage.results(config) if name in needed}
        needed[stage.name] = own.union(*(needed[name] for name in own))
    return any(len(needed[stage.name]) < place for place, stage in enumerate(stages))


def short_reason(why: str) -> str:
    """Cut a reason off before it quotes another stage's reason or error, which is shown on a line of its own."""
    return why.partition(": ")[0] if why.startswith(("it needs ", "no answer: ")) else why.partition(": no answer: ")[0]


def outcome_line(done: Step) -> str:
    if done.action == "run":
        return f"{done.stage.name}: ran in {done.wall_s:.2f} s"
    action = "reused" if done.action == "reuse" else "left out"
    return f"{done.stage.name}: {action} ({short_reason(done.reason)})"
