"""The three experiments: same law, own law, no contact; each engine against our own walk, run after run."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.benchmarks.engines.adapter import EngineContact, Integrator, OwnContact, Stepping
from walkerlab.benchmarks.engines.process import OwnProcess, TaskLost
from walkerlab.benchmarks.engines.registry import Engine
from walkerlab.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW, EngineRow, SwingRow, TuningRow
from walkerlab.benchmarks.engines.runs import (
    SwingAnswer,
    SwingTask,
    TuningAnswer,
    TuningTask,
    WalkAnswer,
    WalkTask,
    pinned_model,
)
from walkerlab.benchmarks.engines.scenes import EngineScene
from walkerlab.ground.friction import friction_coefficient
from walkerlab.ground.held import held_flags, no_stops
from walkerlab.hybrid.contact_run import ContactWalkResult, MethodSettings, knees_at_start, walk_contact
from walkerlab.hybrid.outcome import Outcome
from walkerlab.mechanics.assembly import Anchor, tree_about
from walkerlab.mechanics.tree import mass_matrix
from walkerlab.solvers.in_tuples import derivative
from walkerlab.solvers.registry import method_named

Floats = NDArray[np.float64]

SAME_LAW_STEPS = (4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5, 1.25e-5, 6.25e-6, 3.125e-6)  # s
OWN_LAW_STEPS = (2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)  # s
SWING_STEPS = (8e-3, 4e-3, 2e-3, 1e-3)  # s
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # where steps are adapted
EXACT_ENOUGH = 1e-5  # error on the same law from which on nothing finer is run
SETTLED = 1e-4  # relative change of the period on an engine's own law, after which nothing finer is run
LARGEST_STEP_S = 0.01  # where they are
STARTS = (0.95, 0.99)  # of the gait's velocities
TUNING_STEP_S = 2e-5
TOUCHES, OWN_TOUCHES = 2, 10
INTO_NEXT_STEP = 0.9  # share of the step after the last touch at which states are compared
SWING_S = 0.48
CREEP_LOAD = 0.1  # tangential over normal force, about the mean of a walk
PATIENCE_S = 120.0  # with a run, before its process is ended
OUR_METHOD = "radau5"
OUR_LADDER = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
REFERENCES = (("radau5", 1e-11), ("dop853", 1e-12))
ENDLESS = 100_000_000  # right-hand sides
ENDLESS_S = 1e9
LONGER = 2  # times as long as the walk under ADAMS's law another may take
REPEATS = 3


@dataclass(frozen=True)
class Truth:
    """Our walk of a scene at tight tolerance, by two methods.

    end        state at `until_s`
    agreement  largest difference of the two methods there
    walk       ten steps, for periods
    """

    until_s: float
    end: Floats
    touches_s: Floats
    agreement: float
    walk: ContactWalkResult


def walked(scene: EngineScene, method: str, rtol: float, steps: int, until_s: float | None = None) -> ContactWalkResult:
    """Our walk; with `until_s` also the state then."""
    settings = MethodSettings(method_named(method), rtol, 1e-2 * rtol, ENDLESS)
    return walk_contact(
        scene.ours, scene.ground, None, scene.stance, scene.start, settings, steps, until_s, track_energy=False
    )


def truth_of(scene: EngineScene) -> Truth | None:
    """The reference of a scene; None if the walk ends before states can be compared."""
    (first, first_rtol), (second, second_rtol) = REFERENCES
    walk = walked(scene, first, first_rtol, OWN_TOUCHES)
    if walk.touch_time_s.size <= TOUCHES:
        return None
    last, following = walk.touch_time_s[TOUCHES - 1 : TOUCHES + 1]
    until = float(last + INTO_NEXT_STEP * (following - last))
    one = walked(scene, first, first_rtol, TOUCHES + 1, until)
    other = walked(scene, second, second_rtol, TOUCHES + 1, until)
    end = state_at_end(one)
    agreement = float(np.max(np.abs(end - state_at_end(other))))
    return Truth(until, end, one.touch_time_s[:TOUCHES], agreement, walk)


def state_at_end(result: ContactWalkResult) -> Floats:
    """The state at the second of a walk's samples, the first being its start."""
    assert result.samples is not None, "this walk was sampled"
    return np.asarray(result.samples.states[1])


def answered(result: ContactWalkResult, wall_s: float, touches: int) -> WalkAnswer:
    """Our own walk as an engine would have answered, of so many touches."""
    there = result.samples is not None and len(result.samples.states) > 1
    return WalkAnswer(
        result.outcome.label,
        state_at_end(result) if there else None,
        result.touch_time_s[:touches],
        result.touch_along_m[:touches],
        result.slip_m[:touches],
        int(result.work[1]),
        float(result.end_time_s),
        wall_s,
    )


def our_rows(scene: EngineScene, truth: Truth, version: str) -> Iterator[EngineRow]:
    """Our own method over its ladder of tolerances, on the same walk."""
    walked(scene, OUR_METHOD, OUR_LADDER[0], TOUCHES + 1, truth.until_s)
    for rtol in OUR_LADDER:
        walls = []
        for _ in range(REPEATS):
            begun = time.process_time()
            result = walked(scene, OUR_METHOD, rtol, TOUCHES + 1, truth.until_s)
            walls.append(time.process_time() - begun)
        answer = answered(result, median(walls), TOUCHES)
        mean = answer.time_s / max(1, answer.steps)
        yield same_law_row(scene, OURS, version, OUR_METHOD, mean, rtol, truth, answer)


def same_law_rows(
    engine: Engine, version: str, scene: EngineScene, truth: Truth, process: OwnProcess
) -> Iterator[EngineRow]:
    """An engine's integrators on our law, each over its ladder of step sizes or tolerances."""
    for name, integrator in engine.adapter().INTEGRATORS.items():
        if integrator.for_contact_only:
            continue
        for stepping in ladder_of(name, integrator, truth.until_s):
            task = WalkTask(engine.name, stepping, scene, OWN_TOUCHES, truth.until_s, None, integrator.most_steps)
            answer = process.do(task, PATIENCE_S)
            if isinstance(answer, TaskLost):
                yield lost_row(scene, engine.name, version, SAME_LAW, stepping, name, 1.0, answer)
                if answer.timed_out:
                    break
                continue
            mean = answer.time_s / max(1, answer.steps)
            row = same_law_row(scene, engine.name, version, name, mean, stepping.tolerance, truth, answer)
            yield row
            if row.error is not None and row.error < EXACT_ENOUGH:
                break


def ladder_of(name: str, integrator: Integrator, until_s: float) -> Iterator[Stepping]:
    """The runs of one integrator, from coarse to fine; a whole number of steps leads to the end."""
    if integrator.adapts:
        for tolerance in TOLERANCES:
            yield Stepping(name, LARGEST_STEP_S, tolerance)
        return
    for nominal in SAME_LAW_STEPS:
        steps = math.ceil(until_s / nominal)
        if steps <= integrator.most_steps:
            yield Stepping(name, until_s / steps)


def same_law_row(
    scene: EngineScene,
    engine: str,
    version: str,
    integrator: str,
    step_s: float,
    tolerance: float | None,
    truth: Truth,
    answer: WalkAnswer,
) -> EngineRow:
    """A run with its errors; without an end state it has none."""
    error = None if answer.end is None else float(np.max(np.abs(answer.end - truth.end)))
    if error is not None and not math.isfinite(error):
        error = None
    enough = answer.touches_s.size >= TOUCHES
    touch = float(np.max(np.abs(answer.touches_s[:TOUCHES] - truth.touches_s))) if enough else None
    return EngineRow(
        scene.name, engine, version, SAME_LAW, integrator, 1.0, step_s, tolerance, error, touch, answer.wall_s,
        *last_step(answer), answer.touches_s.size, answer.outcome,
    )  # fmt: skip


def last_step(answer: WalkAnswer) -> tuple[float | None, float | None, float | None]:
    """Period (s), length (m) and slip (m) of the last step; of less than two steps there are none.

    There is no slip either where its foot did not lift.
    """
    if answer.touches_s.size < 2:
        return None, None, None
    period, length = np.diff(answer.touches_s)[-1], np.diff(answer.along_m)[-1]
    slip = float(answer.slips_m[-1]) if answer.slips_m.size == answer.touches_s.size else None
    return float(period), float(length), slip


def lost_row(
    scene: EngineScene,
    engine: str,
    version: str,
    experiment: str,
    stepping: Stepping,
    integrator: str,
    start: float,
    lost: TaskLost,
) -> EngineRow:
    """A run that was lost with its process, or that the engine refused."""
    outcome = Outcome.BUDGET_EXHAUSTED if lost.timed_out else Outcome.SOLVER_FAILED
    return EngineRow(
        scene.name, engine, version, experiment, integrator, start, stepping.step_s, stepping.tolerance, None, None,
        None, None, None, None, 0, outcome.label, lost.why,
    )  # fmt: skip


def target_of(scene: EngineScene) -> EngineContact | None:
    """What the walker's own contact is, linearised under its weight on one foot; None on frictionless ground."""
    walker = scene.ours
    law, friction = walker.normal, walker.friction
    if friction.largest == 0.0:
        return None
    mass, g = walker.tree.mass, walker.gravity_down
    depth = (mass * g / law.stiffness) ** (1.0 / law.exponent)
    stiffness = law.exponent * mass * g / depth
    creep = bisected(lambda v: -friction_coefficient(friction, v)[0] - CREEP_LOAD, 0.0, friction.rising_until)
    sliding = -friction_coefficient(friction, friction.sliding_from)[0]
    ratio = law.damping / (2.0 * math.sqrt(stiffness * mass))
    return EngineContact(mass, g, depth, law.exponent, ratio, sliding, CREEP_LOAD, creep)


def bisected(function: Any, low: float, high: float) -> float:
    """Where a rising function is zero."""
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if function(middle) > 0.0 else (middle, high)
    return high


def tuned(
    engine: Engine, contact: str, scene: EngineScene, target: EngineContact, process: OwnProcess
) -> tuple[OwnContact | None, list[TuningRow], TaskLost | None]:
    """An engine's contact model tuned to the scene's, and how far a ball and a block are from it."""
    task = TuningTask(engine.name, contact, target, TUNING_STEP_S, 1.5 * scene.ours.friction.sliding_from)
    answer: TuningAnswer | TaskLost = process.do(task, PATIENCE_S)
    if isinstance(answer, TaskLost):
        return None, [], answer
    settings = dict(answer.own.settings)
    measured = (
        ("penetration at rest", "m", target.penetration, answer.penetration),
        ("damping ratio", "1", target.damping_ratio, answer.damping_ratio),
        ("sliding friction", "1", target.friction, answer.friction),
        ("creep velocity", "m/s", target.creep_velocity, answer.creep_velocity),
    )
    return answer.own, [TuningRow(scene.name, engine.name, contact, settings, *numbers) for numbers in measured], None


def own_law_rows(
    engine: Engine, version: str, contact: str, own: OwnContact, scene: EngineScene, truth: Truth, process: OwnProcess
) -> Iterator[EngineRow]:
    """An engine's own contact over step sizes from the gait, then from other starts at the finest but one.

    Where steps are adapted, all walks from the gait share the steps that the integrator is given; another walk that
    would take more is not begun.
    """
    name = engine.adapter().CONTACTS[contact]
    integrator = engine.adapter().INTEGRATORS[name]
    most = integrator.most_steps if integrator.adapts else LONGER * integrator.most_steps

    def walk(stepping: Stepping, factor: float) -> tuple[EngineRow, int]:
        task = WalkTask(engine.name, stepping, scene.started(factor), OWN_TOUCHES, ENDLESS_S, own, most)
        answer = process.do(task, PATIENCE_S)
        if isinstance(answer, TaskLost):
            lost = lost_row(scene, engine.name, version, OWN_LAW, stepping, contact, factor, answer)
            return lost, most if answer.timed_out else 0
        step = answer.time_s / max(1, answer.steps) if integrator.adapts else stepping.step_s
        row = own_law_row(scene, engine.name, version, contact, factor, step, stepping.tolerance, truth, answer)
        return row, answer.steps

    before, done, spent = None, [], 0
    for stepping in own_law_ladder(name, integrator, float(truth.walk.touch_time_s[-1])):
        row, steps = walk(stepping, 1.0)
        yield row
        done.append(stepping)
        spent += steps
        if steps >= most or (integrator.adapts and spent + steps > most):
            return
        if before is not None and has_settled(before, row):
            break
        before = row
    yield from (walk(stepping, factor)[0] for stepping in done[-2:][:1] for factor in STARTS)


def own_law_ladder(name: str, integrator: Integrator, usual_s: float) -> Iterator[Stepping]:
    """The walks with one contact, from coarse to fine, that usually take `usual_s`."""
    if integrator.adapts:
        yield from (Stepping(name, LARGEST_STEP_S, tolerance) for tolerance in TOLERANCES)
    else:
        yield from (Stepping(name, h) for h in OWN_LAW_STEPS if usual_s / h <= integrator.most_steps)


def has_settled(coarse: EngineRow, fine: EngineRow) -> bool:
    """Whether two walks to the end have one period."""
    if coarse.error is None or fine.error is None or coarse.period_s is None or fine.period_s is None:
        return False
    return abs(fine.period_s / coarse.period_s - 1.0) <= SETTLED


def own_law_row(
    scene: EngineScene,
    engine: str,
    version: str,
    contact: str,
    start: float,
    step_s: float,
    tolerance: float | None,
    truth: Truth,
    answer: WalkAnswer,
) -> EngineRow:
    """A run with how far its last step's period is from that of ADAMS's law."""
    period, length, slip = last_step(answer)
    walked_all = answer.outcome == Outcome.WALKED.label and start == 1.0
    error = abs(period - truth.walk.periods_s[-1]) if period is not None and walked_all else None
    return EngineRow(
        scene.name, engine, version, OWN_LAW, contact, start, step_s, tolerance, error, None, answer.wall_s,
        period, length, slip, answer.touches_s.size, answer.outcome,
    )  # fmt: skip


def adams_rows(scene: EngineScene, version: str) -> Iterator[EngineRow]:
    """ADAMS's law on the same starts, by our own walk."""
    for factor in (1.0, *STARTS):
        begun = time.process_time()
        result = walked(scene.started(factor), OUR_METHOD, 1e-7, OWN_TOUCHES)
        wall = time.process_time() - begun
        answer = answered(result, wall, OWN_TOUCHES)
        mean = answer.time_s / max(1, answer.steps)
        yield EngineRow(
            scene.name, OURS, version, OWN_LAW, "impact", factor, mean, 1e-7, None, None, wall,
            *last_step(answer), answer.touches_s.size, answer.outcome,
        )  # fmt: skip


def swing_rows(engine: Engine, scene: EngineScene, process: OwnProcess) -> tuple[list[SwingRow], list[TaskLost]]:
    """The hinged walker's swing over step sizes, by each of an engine's integrators."""
    model, chain = pinned_model(scene)
    n = len(chain)
    start = np.array((*scene.start[2 : 2 + n], *scene.start[4 + n :]))
    truth, energy = swing_truth(scene, start)
    rows: list[SwingRow] = []
    lost: list[TaskLost] = []
    for integrator, entry in engine.adapter().INTEGRATORS.items():
        before = None
        for stepping in swing_ladder(integrator, entry):
            task = SwingTask(engine.name, stepping, model, chain, scene.ours.slope, start, SWING_S, entry.most_steps)
            answer: SwingAnswer | TaskLost = process.do(task, PATIENCE_S)
            if isinstance(answer, TaskLost):
                lost.append(answer)
                break
            error = float(np.max(np.abs(answer.end - truth)))
            drift = abs(energy(answer.end) - energy(start))
            order: float | None = None if before is None or error == 0.0 or entry.adapts else math.log2(before / error)
            rows.append(
                SwingRow(
                    scene.name,
                    engine.name,
                    integrator,
                    entry.order,
                    stepping.step_s,
                    stepping.tolerance,
                    error,
                    drift,
                    order,
                    answer.wall_s,
                )
            )
            before = error
    return rows, lost


def swing_ladder(name: str, integrator: Integrator) -> Iterator[Stepping]:
    """The swings of one integrator, from coarse to fine."""
    if integrator.adapts:
        yield from (Stepping(name, LARGEST_STEP_S, tolerance) for tolerance in TOLERANCES)
    else:
        yield from (Stepping(name, h) for h in SWING_STEPS)


def swing_truth(scene: EngineScene, start: Floats, until_s: float = SWING_S) -> tuple[Floats, Any]:
    """The end of the swing by our equations and SciPy's method, and the mechanical energy of a state."""
    from scipy.integrate import solve_ivp

    from walkerlab.ground.pinned import Pinned

    n = len(scene.chain)
    foot = scene.assembly.feet[scene.stance]
    tree = tree_about(scene.assembly, Anchor(foot.body, foot.centre_m))
    walker = scene.ours
    held = held_flags(walker.held, walker.knees, knees_at_start(walker, scene.stance, scene.start))
    system = Pinned(walker, tree, scene.stance, 0.0, (0.0,) * (2 * n), held, no_stops(walker.knees))

    def rate(t: float, y: Floats) -> Any:
        return derivative(system, t, tuple(y))

    def energy(y: Floats) -> float:
        angles = y[:n] + scene.ours.slope
        s, c = np.sin(angles), np.cos(angles)
        M = np.array(mass_matrix(tree, tuple(s), tuple(c))).reshape(n, n)
        arm_x, arm_y = np.array(tree.arm_x), np.array(tree.arm_y)
        forward, upward = (c * arm_x - s * arm_y).sum(), (s * arm_x + c * arm_y).sum()
        gravity = scene.ours.gravity_down * upward - scene.ours.gravity_along * forward
        return float(0.5 * y[n:] @ M @ y[n:] + gravity)

    done = solve_ivp(rate, (0.0, until_s), start, method="DOP853", rtol=1e-13, atol=1e-14)
    return np.asarray(done.y[:, -1]), energy


def least_wall(rows: Sequence[EngineRow], error: float) -> float | None:
    """Run time (s) of the quickest run with at most this error."""
    good = [row for row in rows if row.error is not None and row.error <= error]
    return min((row.wall_s for row in good if row.wall_s is not None), default=None)
