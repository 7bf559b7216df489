"""Experiments in other engines, compared with our solution: under the same law, under their own, and without contact.

Under the same law, an engine integrates our contact forces. Under its own law, it computes contact by its native model.
Engines run in separate processes, so that a crash or hang does not stop the stage.
"""

import math
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

import numpy as np

from walkerlab.evidence.benchmarks.engines import runs
from walkerlab.evidence.benchmarks.engines.adapter import Integrator, OwnContact, Stepping
from walkerlab.evidence.benchmarks.engines.registry import Engine
from walkerlab.evidence.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW, EngineRow, SwingRow, TuningRow
from walkerlab.exchange.engine_scene import EngineContact, EngineScene
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.energy import kinetic_energy, potential_energy
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import changed_forms, place_on_ground, to_form, to_full
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, walk_contact
from walkerlab.physics.hybrid.contact_state import knees_at_start
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, derivative
from walkerlab.pipeline.run.workers import Worker, WorkerDiedError, WorkerTimeoutError

START_UP_S = 60.0  # extra time for the first task, in which the process loads the engine and compiles
R = TypeVar("R")


@dataclass(frozen=True)
class TaskLost:
    """Record of a task without a result."""

    reason: str
    timed_out: bool = False


class OwnProcess:
    """Runs tasks one after another in a worker process, which is restarted after a crash or time-out.

    Engines print and write log files, so the output is suppressed and the process has its own folder.
    """

    def __init__(self) -> None:
        self._worker: Worker | None = None
        self._folder = tempfile.TemporaryDirectory(prefix="walkerlab-engine-")
        self._abandoned = False

    def __enter__(self) -> "OwnProcess":
        return self

    def __exit__(self, *_error: object) -> None:
        self._end()
        self._folder.cleanup()

    def do(self, task: Callable[[], R], timeout_s: float) -> R | TaskLost:
        """Run a picklable task and return its result, or `TaskLost` if it has none.

        Raises RuntimeError after `abandon`.
        """
        if self._abandoned:
            raise RuntimeError("the process was abandoned")
        if self._worker is None:
            self._worker = Worker(folder=Path(self._folder.name), quiet=True)
            timeout_s += START_UP_S
        try:
            return self._worker.do(task, timeout_s=timeout_s)
        except WorkerTimeoutError:
            self._end()
            return TaskLost(f"no result within {timeout_s:.0f} s", timed_out=True)
        except WorkerDiedError as died:
            self._end()
            return TaskLost(f"the engine's process ended with code {died.exit_code_of_worker}")
        except Exception as error:  # an engine's exception is recorded in the row of its run
            return TaskLost(traceback.format_exception_only(error)[0].strip()[:200])

    def abandon(self) -> None:
        """Kill the running task and reject further ones. This may be called from another thread."""
        self._abandoned = True
        if (worker := self._worker) is not None:
            worker.process.kill()

    def _end(self) -> None:
        """Kill the process. An engine may hang, so it is not asked to stop."""
        if self._worker is not None:
            self._worker.process.kill()
            self._worker.close()
            self._worker = None


SAME_LAW_STEPS = (4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5, 1.25e-5, 6.25e-6, 3.125e-6)  # s
OWN_LAW_STEPS = (2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)  # s
SWING_STEPS = (8e-3, 4e-3, 2e-3, 1e-3)  # s
ADAPTIVE_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # tolerances of adaptive integrators
ERROR_GOAL = 1e-5  # stop refining once the error with our contact law is below this
SETTLED_CHANGE = 1e-4  # stop refining once the period on native contact changes by less (relative)
LARGEST_STEP_S = 0.01  # largest step of adaptive integrators
START_FACTORS = (0.95, 0.99)  # factors applied to the velocities of the gait, for walks from other starts
TUNING_STEP_S = 2e-5
COMPARED_TOUCHES = 2
OWN_TOUCHES = 10
INTO_NEXT_STEP = 0.9  # end states are compared at this fraction of the step after the last compared touch
SWING_S = 0.48
RUN_TIMEOUT_S = 120.0  # time limit of a run, after which its process is killed
OUR_METHOD = "radau5"
OUR_LADDER = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
ADAMS_RTOL = 1e-7  # relative tolerance of our walk for comparison with the native contact of engines
REFERENCES = (("radau5", 1e-11), ("dop853", 1e-12))
UNLIMITED_BUDGET = 100_000_000  # right-hand sides
UNLIMITED_S = 1e9
# With its native contact, an engine's walk may take longer than ours, so the step budget is multiplied by this.
STEP_ALLOWANCE = 2
OUR_REPEATS = 3


@dataclass(frozen=True)
class Truth:
    """Reference for a scene: our walk at a tight tolerance, computed by two methods."""

    until_s: float
    end: Floats  # state at `until_s`
    touches_s: Floats
    agreement: float  # largest difference between the end states of the two methods
    walk: ContactWalkResult  # walk of up to ten steps, for the comparison of periods


def simulate(
    scene: EngineScene, method: str, rtol: float, steps: int, until_s: float | None = None
) -> ContactWalkResult:
    """Simulate the scene with our solver. If `until_s` is given, sample the state at that time."""
    tolerances = Tolerances(method, rtol, 1e-2 * rtol, UNLIMITED_BUDGET, track_energy=False)
    return walk_contact(scene.ours, scene.ground, False, STANCE_FOOT, scene.start, tolerances, steps, until_s)


def make_truth(scene: EngineScene) -> Truth | None:
    """Compute the reference of a scene, or return None if the walk ends before states can be compared."""
    walk = simulate(scene, *REFERENCES[0], OWN_TOUCHES)
    if walk.touch_time_s.size <= COMPARED_TOUCHES:
        return None
    last, following = walk.touch_time_s[COMPARED_TOUCHES - 1 : COMPARED_TOUCHES + 1]
    until = float(last + INTO_NEXT_STEP * (following - last))
    reference, second = (simulate(scene, *method, COMPARED_TOUCHES + 1, until) for method in REFERENCES)
    end = sampled_end(reference)
    second_end = sampled_end(second)
    assert end is not None, "the walk continues beyond that time"
    assert second_end is not None, "the other method's walk also continues"
    return Truth(until, end, reference.touch_time_s[:COMPARED_TOUCHES], float(np.max(np.abs(end - second_end))), walk)


def sampled_end(result: ContactWalkResult) -> Floats | None:
    """Return the state at the second sample of a walk, or None if it was not reached. (The first one is the start.)"""
    samples = result.samples
    return None if samples is None or len(samples.states) < 2 else np.asarray(samples.states[1])


@dataclass(frozen=True)
class EngineExperiment:
    """An experiment on a scene with one engine, or with our solver."""

    scene: EngineScene
    engine: str
    version: str
    experiment: str
    truth: Truth | None = None  # reference for the runs, or None if they are not compared

    def row(
        self, integrator: str, stepping: Stepping, answer: runs.WalkAnswer | TaskLost, start: float = 1.0
    ) -> EngineRow:
        """Evaluate a run, or record why it was lost.

        integrator  name of the integrator or contact model
        start       factor applied to the gait's initial velocities
        """
        # With our contact law, the errors are those of the end state and of the touch times. With native contact, the
        # error is that of the last period, and only a completed walk from the gait has one.
        head = (self.scene.name, self.engine, self.version, self.experiment, integrator, start)
        step_s = stepping.step_s
        tolerance = stepping.tolerance
        if isinstance(answer, TaskLost):
            outcome = Outcome.BUDGET_EXHAUSTED if answer.timed_out else Outcome.SOLVER_FAILED
            nothing = (None, None, None, None, None, None)
            return EngineRow(*head, step_s, tolerance, *nothing, 0, outcome.label, answer.reason)
        period_s = length_m = slip_m = error = touch_error = None
        touches = answer.touches_s
        truth = self.truth
        if touches.size >= 2:
            period_s = float(np.diff(touches)[-1])
            length_m = float(np.diff(answer.along_m)[-1])
            if answer.slips_m.size == touches.size:  # otherwise the foot of the last step has not lifted
                slip_m = float(answer.slips_m[-1])
        if truth is not None and self.experiment == OWN_LAW:
            if period_s is not None and answer.outcome == Outcome.WALKED.label and start == 1.0:
                error = abs(period_s - truth.walk.periods_s[-1])
        elif truth is not None:
            if answer.end is not None and np.isfinite(answer.end).all():
                error = float(np.max(np.abs(answer.end - truth.end)))
            if touches.size >= COMPARED_TOUCHES:
                touch_error = float(np.max(np.abs(touches[:COMPARED_TOUCHES] - truth.touches_s)))
        if tolerance is not None or self.experiment == SAME_LAW:
            step_s = answer.time_s / max(1, answer.steps)
        numbers = error, touch_error, answer.wall_s, period_s, length_m, slip_m
        return EngineRow(*head, step_s, tolerance, *numbers, touches.size, answer.outcome)


def time_our_walk(
    scene: EngineScene, rtol: float, touches: int, until_s: float | None = None, repeats: int = 1
) -> runs.WalkAnswer:
    """Time walkerlab's walk of `touches` steps or, if `until_s` is given, up to that time in the following step.

    The run time is the median over `repeats` walks.
    """
    walls = []
    for _ in range(repeats):
        start_s = time.process_time()
        result = simulate(scene, OUR_METHOD, rtol, touches + (until_s is not None), until_s)
        walls.append(time.process_time() - start_s)
    times = result.touch_time_s[:touches]
    along = result.touch_along_m[:touches]
    slips = result.slip_m[:touches]
    steps = int(result.work[1])
    time_s = float(result.end_time_s)
    return runs.WalkAnswer(result.outcome.label, sampled_end(result), times, along, slips, steps, time_s, median(walls))


def our_rows(scene: EngineScene, truth: Truth, version: str) -> Iterator[EngineRow]:
    """Yield rows of our runs at several tolerances, then rows of our walks to compare with engines' native contact."""
    same_law = EngineExperiment(scene, OURS, version, SAME_LAW, truth)
    # The first walk compiles the kernels, which must not be timed.
    time_our_walk(scene, OUR_LADDER[0], COMPARED_TOUCHES, truth.until_s)
    for rtol in OUR_LADDER:
        answer = time_our_walk(scene, rtol, COMPARED_TOUCHES, truth.until_s, OUR_REPEATS)
        yield same_law.row(OUR_METHOD, Stepping(OUR_METHOD, 0.0, rtol), answer)
    own_law = EngineExperiment(scene, OURS, version, OWN_LAW)
    for factor in (1.0, *START_FACTORS):
        answer = time_our_walk(scene.scale_start(factor), ADAMS_RTOL, OWN_TOUCHES)
        yield own_law.row("impact", Stepping(OUR_METHOD, 0.0, ADAMS_RTOL), answer, factor)


def steppings(name: str, integrator: Integrator, steps_s: Sequence[float]) -> list[Stepping]:
    """Return the step sizes to try with an integrator, from coarse to fine, or the tolerances if it is adaptive.

    steps_s  step sizes (s) for fixed steps
    """
    if integrator.adapts:
        return [Stepping(name, LARGEST_STEP_S, tolerance) for tolerance in ADAPTIVE_TOLERANCES]
    return [Stepping(name, h) for h in steps_s]


@dataclass(frozen=True)
class EngineOnScene:
    """Experiments with one engine on one scene, in a separate process."""

    engine: Engine
    scene: EngineScene
    truth: Truth
    process: OwnProcess

    def walk(
        self, label: str, stepping: Stepping, max_steps: int, native: OwnContact | None = None, start: float = 1.0
    ) -> tuple[EngineRow, runs.WalkAnswer | TaskLost]:
        """Simulate a walk of at most `max_steps` engine steps.

        label   name of the integrator or contact model in the row
        native  the engine's native contact, or None for our contact law
        start   factor applied to the gait's initial velocities
        """
        law, until_s = (SAME_LAW, self.truth.until_s) if native is None else (OWN_LAW, UNLIMITED_S)
        scene = self.scene.scale_start(start)
        task = runs.WalkTask(self.engine.name, stepping, scene, OWN_TOUCHES, until_s, native, max_steps)
        answer = self.process.do(task.run, RUN_TIMEOUT_S)
        experiment = EngineExperiment(self.scene, self.engine.name, self.engine.version, law, self.truth)
        return experiment.row(label, stepping, answer, start), answer

    def same_law(self) -> Iterator[EngineRow]:
        """Yield runs of each integrator with our contact law, from coarse to fine."""
        for name, integrator in self.engine.adapter().INTEGRATORS.items():
            if integrator.for_contact_only:
                continue
            for stepping in steppings(name, integrator, SAME_LAW_STEPS):
                if not integrator.adapts and math.ceil(self.truth.until_s / stepping.step_s) > integrator.most_steps:
                    continue
                row, answer = self.walk(name, stepping, integrator.most_steps)
                yield row
                late = isinstance(answer, TaskLost) and answer.timed_out
                if late or (row.error is not None and row.error < ERROR_GOAL):
                    break

    def tune(self, contact: str, target: EngineContact) -> tuple[OwnContact, list[TuningRow]] | TaskLost:
        """Tune a contact model to the contact of the scene, and measure how close it comes.

        contact  name of the contact model
        """
        name = self.engine.name
        sliding = 1.5 * self.scene.ours.friction.sliding_from
        answer = self.process.do(runs.TuningTask(name, contact, target, TUNING_STEP_S, sliding).run, RUN_TIMEOUT_S)
        if isinstance(answer, TaskLost):
            return answer
        measured = (
            ("penetration at rest", "m", target.penetration, answer.penetration),
            ("damping ratio", "1", target.damping_ratio, answer.damping_ratio),
            ("sliding friction", "1", target.friction, answer.friction),
            ("creep velocity", "m/s", target.creep_velocity, answer.creep_velocity),
        )
        about = self.scene.name, name, contact, dict(answer.own.settings)
        return answer.own, [TuningRow(*about, *numbers) for numbers in measured]

    def own_law(self, contact: str, native: OwnContact) -> Iterator[EngineRow]:
        """Yield walks on the engine's native contact: from the gait with finer and finer steps, then from other starts.

        Walks from other starts use the second finest step.
        """
        # Adaptive walks from the gait share one step budget. Each is expected to take as many steps as the one before.
        name = self.engine.adapter().CONTACTS[contact]
        integrator = self.engine.adapter().INTEGRATORS[name]
        max_steps = integrator.most_steps if integrator.adapts else STEP_ALLOWANCE * integrator.most_steps
        before = None
        completed = []
        spent = 0
        usual_s = float(self.truth.walk.touch_time_s[-1])
        for stepping in steppings(name, integrator, [h for h in OWN_LAW_STEPS if usual_s / h <= integrator.most_steps]):
            row, answer = self.walk(contact, stepping, max_steps, native)
            yield row
            completed.append(stepping)
            # A run that reached the time limit counts as if it had used its budget, because finer steps take longer.
            steps = answer.steps if not isinstance(answer, TaskLost) else max_steps if answer.timed_out else 0
            spent += steps
            if steps >= max_steps or (integrator.adapts and spent + steps > max_steps):
                return
            if before is not None and has_settled(before, row):
                break
            before = row
        for stepping in completed[-2:][:1]:
            yield from (self.walk(contact, stepping, max_steps, native, factor)[0] for factor in START_FACTORS)

    def swings(self) -> tuple[list[SwingRow], list[TaskLost]]:
        """Simulate the passive swing of the pinned walker with each integrator, and return results and lost runs."""
        scene = self.scene
        engine = self.engine
        model = runs.pinned_model(self.scene)
        n = len(model.chain)
        start = np.array((*scene.start[2 : 2 + n], *scene.start[4 + n :]))
        truth, energy = swing_truth(scene, start)
        rows: list[SwingRow] = []
        lost: list[TaskLost] = []
        for integrator, entry in engine.adapter().INTEGRATORS.items():
            before: float | None = None
            for stepping in steppings(integrator, entry, SWING_STEPS):
                about = engine.name, stepping, model, scene.ours.slope, start, SWING_S, entry.most_steps
                answer = self.process.do(partial(runs.swing, *about), RUN_TIMEOUT_S)
                if isinstance(answer, TaskLost):
                    lost.append(answer)
                    break
                error = float(np.max(np.abs(answer.end - truth)))
                drift = abs(energy(answer.end) - energy(start))
                order = math.log2(before / error) if before and error and not entry.adapts else None
                who = (scene.name, engine.name, integrator, entry.order)
                rows.append(SwingRow(*who, stepping.step_s, stepping.tolerance, error, drift, order, answer.wall_s))
                before = error
        return rows, lost


def has_settled(coarse: EngineRow, fine: EngineRow) -> bool:
    if coarse.error is None or fine.error is None or coarse.period_s is None or fine.period_s is None:
        return False
    return abs(fine.period_s / coarse.period_s - 1.0) <= SETTLED_CHANGE


def swing_truth(scene: EngineScene, start: Floats, until_s: float = SWING_S) -> tuple[Floats, Any]:
    """Integrate the swing with our equations and SciPy's DOP853.

    Returns the end state, and a function for the energy (J) of a state.
    """
    from scipy.integrate import solve_ivp

    knee = knees_at_start(scene.ours, STANCE_FOOT, scene.start)
    passive = changed_forms(scene.ours, push_off=0.0, laws=0.0)
    system = place_on_ground(passive, (False, False), knee, pinned=True)
    free_form = passive.forms[1, 0]

    def rate(t: float, y: Floats) -> Any:
        f = np.zeros(y.size)
        derivative(system, t, y, f)
        return f

    def energy(y: Floats) -> float:
        return float(kinetic_energy(free_form, y) + potential_energy(free_form, y))

    y = to_form(system.form, start)
    solution = solve_ivp(rate, (0.0, until_s), y, method="DOP853", rtol=1e-13, atol=1e-14)
    return to_full(system.form, solution.y[:, -1], start.size), energy


def least_wall(rows: Sequence[EngineRow], error: float) -> float | None:
    """Return the shortest run time (s) of all runs whose error is at most `error`, or None if there is no such run."""
    good = [row for row in rows if row.error is not None and row.error <= error]
    return min((row.wall_s for row in good if row.wall_s is not None), default=None)
