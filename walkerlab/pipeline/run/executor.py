"""Carry out a plan: reuse, run or leave out each stage, one after another or in parallel."""

import contextlib
import importlib
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial
from inspect import signature
from queue import SimpleQueue
from typing import Any

from walkerlab.config import reads, schema
from walkerlab.errors import NoAnswer
from walkerlab.physics import kernel_cache
from walkerlab.pipeline.plan.planner import Planner
from walkerlab.pipeline.plan.results import MemoryResults, Step
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.progress import Reporter, Silent, StageReporter
from walkerlab.pipeline.run.workers import WorkerPool, tell
from walkerlab.pipeline.store import artifact, files
from walkerlab.pipeline.store.content import Content
from walkerlab.scene.omissions import STILL_COMPUTED, STOPPED, LeftOut

Task = Callable[[StageReporter], Content]
"""Call of a stage with its arguments. It takes a reporter and returns the result."""


def task_of(stage: Stage, config: schema.Config, inputs: Mapping[str, Content], **offered: Any) -> Task:
    """Build the task of a stage under a config, for this or another process. `inputs` and the rest are as in
    `call_stage`."""
    return partial(call_stage, stage.module, reads.restrict(config, stage.takes_under(config)), inputs, offered)


def call_stage(
    module: str, config: Any, inputs: Mapping[str, Content], offered: Mapping[str, Any], reporter: StageReporter
) -> Content:
    """Call the `run` of a stage's module with the optional arguments that it declares.

    config   slice of the config that the stage takes
    inputs   results of other stages, by name
    offered  optional arguments, by name:
               jobs        maximum number of processes for independent work units
               checkpoint  work units that an interrupted run has computed
               again       whether to repeat walks to measure their numerical error, and to search for advice
               folder      run folder that the stage draws into
               left_out    results that are missing in a drawing, with the reasons
               early       what this run has drawn from the first results; None if nothing
    """
    # Imported only when the stage runs, because importing it loads libraries and compiled code.
    run = importlib.import_module(module).run
    arguments = {name: offered[name] for name in offered.keys() & signature(run).parameters.keys()}
    folder = arguments.get("folder")
    drawing = contextlib.nullcontext() if folder is None else files.storage_errors(folder)
    try:
        with kernel_cache.watch_compilation(partial(note_compilation, reporter)), drawing:
            content = run(config, inputs, reporter, **arguments)
    except NoAnswer as error:
        partial_content = error.partial if isinstance(error.partial, Content) else Content()
        reason = {"no_answer": {"message": error.message, "advice": error.advice}}
        return replace(partial_content, summary={**partial_content.summary, **reason}, complete=False)
    if not isinstance(content, Content):
        raise TypeError(f"{module}.run returned {type(content).__name__}, not Content")
    return content


def note_compilation(reporter: StageReporter, kernel: str) -> None:
    reporter.note(f"compiling {kernel} for this walker; later runs reuse it")


class PipeReporter:
    """Reporter of a stage in a worker, which sends each call to the parent process."""

    def __getattr__(self, call: str) -> Callable[..., None]:
        """Return a function that sends the name of the call and its arguments."""
        return lambda *arguments: tell((call, *arguments))


def run_in_worker(task: Task) -> Content:
    """Run a stage in a worker and send its progress to the parent."""
    reporter: Any = PipeReporter()
    return task(reporter)


@dataclass(frozen=True)
class RunningStage:
    """Stage that has started and not ended."""

    step: Step
    task: Task
    reporter: StageReporter
    started: float


class Executor:
    """Brings the results of a planner's stages up to date.

    jobs  maximum number of processes, for independent stages and for independent work units of a stage
    done  steps that have ended so far, without their results, which would otherwise stay in memory
    """

    def __init__(self, planner: Planner, jobs: int = 1, reporter: Reporter | None = None) -> None:
        """Store the arguments without running anything."""
        self.planner = planner
        self.jobs = jobs
        self.reporter = reporter or Silent()
        self.done: list[Step] = []
        self._early = EarlyDrawings(planner, self.reporter)
        self._waiting: list[Stage] = []
        self._running: dict[Future[Any] | None, RunningStage] = {}
        self._working: set[Future[Any]] = set()
        self._events: SimpleQueue[Callable[[], bool]] = SimpleQueue()
        self._left: list[str] = []
        self._total = 0

    def carry_out(self, likely: Sequence[Stage] = ()) -> None:
        """Reuse, run or leave out each stage. `likely` holds the stages that the plan expects to run."""
        self._waiting = list(self.planner.stages)
        self._left = [stage.name for stage in likely]
        self._total = len(likely)
        side_by_side = self.jobs > 1 and any_side_by_side(likely, self.planner.config)
        try:
            with WorkerPool(self.jobs) as pool:
                while self._waiting or self._running:
                    self._start_ready_stages(pool if side_by_side else None)
                    # The queue also holds messages of running stages, but another stage can start only after a call has
                    # ended.
                    while self._working and not self._events.get()():
                        pass
                    self._early.draw(self._waiting, self._unsettled(), STILL_COMPUTED)
        except BaseException:
            self._early.draw(self._waiting[-1:], self._unsettled(), STOPPED)
            raise
        finally:
            for running_stage in self._running.values():
                running_stage.reporter.end("")

    def skip(self, step: Step) -> None:
        """Record that a stage does not run."""
        self.done.append(replace(step, found=None))
        self.reporter.note(outcome_line(step))

    def _start_ready_stages(self, pool: WorkerPool | None) -> None:
        """Start all ready stages in `pool`, or run the next one in this process if `pool` is None."""
        for stage in list(self._waiting):
            # Stages that measure run times would be disturbed by others.
            timing = any(running_stage.step.stage.work == "times" for running_stage in self._running.values())
            if timing or len(self._working) == self.jobs:
                return
            if not self._unsettled().isdisjoint(stage.results(self.planner.config)):
                continue
            step = self.planner.decide(stage)
            if step.action == "run" and stage.work == "times" and self._running:
                continue
            self._waiting.remove(stage)
            if step.action != "run":
                self.planner.results.take_over(step)
                self.planner.expect(step)
                self.skip(step)
            elif pool is None:
                running_stage = self._running[None] = self._begin(step)
                self._finish(None, running_stage.task(running_stage.reporter))
                return
            else:
                running_stage = self._begin(step)
                call = partial(run_in_worker, running_stage.task)
                future = pool.start(call, partial(self._hear, running_stage.reporter))
                self._running[future] = running_stage
                self._working.add(future)
                # Callbacks run in other threads. They only queue a call, so that this thread alone changes the state.
                future.add_done_callback(lambda ended: self._events.put(partial(self._ended, ended)))

    def _hear(self, reporter: StageReporter, message: tuple[str, Any]) -> None:
        """Pass a worker's message from the thread that receives it to this thread, through the event queue."""
        call, *arguments = message
        self._events.put(lambda: bool(getattr(reporter, call)(*arguments)))

    def _ended(self, future: Future[Any]) -> bool:
        """Handle a finished future, and return True, because a process has become free."""
        self._working.remove(future)
        if future in self._running:
            self._finish(future, future.result())
        return True

    def _unsettled(self) -> set[str]:
        running = (running_stage.step.stage for running_stage in self._running.values())
        return {stage.name for stage in (*self._waiting, *running)}

    def _begin(self, step: Step) -> RunningStage:
        if step.damaged is not None:
            self.reporter.warn(f"{step.damaged} is {step.reason}; recomputing it")
        planner = self.planner
        stage = step.stage
        inputs = planner.inputs(stage)
        offered = dict(planner.results.begin(step, planner.config, inputs, planner.force))
        offered |= {"jobs": self.jobs, "again": planner.again, "left_out": planner.missing_inputs(stage)}
        task = task_of(stage, planner.config, inputs, **offered, early=self._early.drawn.get(stage.name))
        number = self._total - len(self._left) + 1 + len(self._running)
        total = max(self._total, number)
        place = [f"{number} of {total}"] if total > 1 else []
        reason = [step.reason] if step.reason != artifact.NOT_THERE else []
        expected = step.found.provenance.took_s if isinstance(step.found, artifact.Stored) else None
        reporter = self.reporter.begin(stage.name, ", ".join(place + reason), expected)
        return RunningStage(step, task, reporter, time.perf_counter())

    def _finish(self, future: Future[Any] | None, answer: Content) -> None:
        """Store a stage's result (partial if the stage found no answer) and report that the stage has ended."""
        running_stage = self._running[future]
        step = running_stage.step
        name = running_stage.step.stage.name
        awaited = any(name in stage.results(self.planner.config) for stage in self._waiting)
        stored = self.planner.results.keep(step, answer, awaited)
        del self._running[future]
        self.planner.settle(step, stored)
        reason = step.reason if stored.no_answer is None else f"no answer: {stored.no_answer.message}"
        done = replace(step, reason=reason, found=None, wall_s=time.perf_counter() - running_stage.started)
        self.done.append(done)
        self._left = [stage_left for stage_left in self._left if stage_left != name]
        answered = [] if stored.complete else ["no answer"]
        rest = [f"still to run: {', '.join(self._left)}"] if self._left else []
        running_stage.reporter.end("; ".join([outcome_line(done), *answered, *rest]))


class EarlyDrawings:
    """Draws the page from the first results while the others are still being computed.

    drawn  results of early drawings, by stage
    """

    def __init__(self, planner: Planner, reporter: Reporter) -> None:
        self.planner = planner
        self.reporter = reporter
        self.drawn: dict[str, Content] = {}

    def draw(self, drawings: Sequence[Stage], unsettled: set[str], why: str) -> None:
        """Make every drawing that the results so far allow. `why` says why the `unsettled` stages have no results.

        Only the last drawing, the page, is redrawn after each stage, because it also shows what the others have drawn.
        """
        planner = self.planner
        folder = self.planner.results.folder
        for stage in drawings:
            missing = unsettled.intersection(stage.results(planner.config))
            inputs = planner.inputs(stage) | {name: self.drawn[name] for name in missing & self.drawn.keys()}
            pending = {name for name in missing if planner.graph[name].why_unsuited(planner.config) is None}
            once = stage.name in self.drawn and stage is not planner.stages[-1]
            if folder is None or not stage.early_with or not pending or not inputs or once:
                continue
            if unsettled.isdisjoint(stage.early_with):
                absent = [entry for entry in planner.missing_inputs(stage) if entry.what not in pending]
                absent += [LeftOut(other.name, why) for other in planner.stages if other.name in pending]
                task = task_of(stage, planner.config, inputs, folder=folder, left_out=tuple(absent))
                self.drawn[stage.name] = task(Silent())
                self.reporter.announce_page(self.drawn[stage.name].summary, folder)


def answer_in_memory(
    config: schema.Config, target: str, memory: MemoryResults, *, again: bool = True, reporter: Reporter | None = None
) -> Content:
    """Compute a stage's result without files, reusing inputs from memory.

    again  whether to repeat walks at tighter tolerances to measure their numerical error

    Raises ConfigError as `Graph.needed_in_memory` does.
    """
    planner = Planner(config, memory, memory.keys.graph.needed_in_memory(target, config), again=again)
    Executor(planner, reporter=reporter).carry_out()
    if target in planner.answers:
        return planner.answers[target]
    # The target did not run because one of its inputs has no answer.
    advice = next(answer.no_answer.advice for answer in planner.answers.values() if answer.no_answer is not None)
    return Content({}, {"no_answer": {"message": planner.left_out[target], "advice": advice}}, complete=False)


def any_side_by_side(stages: Sequence[Stage], config: schema.Config) -> bool:
    """Whether at least two of the stages are independent and can run in parallel."""
    needed: dict[str, set[str]] = {}
    for stage in stages:
        inputs = {name for name in stage.results(config) if name in needed}
        needed[stage.name] = inputs.union(*(needed[name] for name in inputs))
    return any(len(needed[stage.name]) < index for index, stage in enumerate(stages))


def short_reason(why: str) -> str:
    """Cut off the part of a reason that quotes another stage, because that stage's reason or error has a line of its
    own."""
    return why.partition(": ")[0] if why.startswith(("it needs ", "no answer: ")) else why.partition(": no answer: ")[0]


def outcome_line(done: Step) -> str:
    if done.action == "run":
        return f"{done.stage.name}: ran in {done.wall_s:.2f} s"
    action = "reused" if done.action == "reuse" else "left out"
    return f"{done.stage.name}: {action} ({short_reason(done.reason)})"
