"""Tasks for the process of an engine: a walk, a swing without ground, and tests of contact with a ball and a block."""

import math
import time
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from walkerlab.evidence.benchmarks.engines.adapter import OwnContact, Simulation, Stepping
from walkerlab.evidence.benchmarks.engines.follow import RuleFollower
from walkerlab.evidence.benchmarks.engines.registry import PHYSICS_ENGINES
from walkerlab.exchange import planar
from walkerlab.exchange.engine_scene import EngineContact, EngineScene
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.hybrid.contact_state import steps_with_lift
from walkerlab.physics.mechanics.parts import Anchor
from walkerlab.physics.solvers.system import Floats

TIME_ROUNDING = 1e-9  # relative tolerance for times
UNLIMITED_STEPS = 10_000_000
STEADY_STEP_FACTOR = 5  # if only a steady end state is needed, steps may be this many times as large


@dataclass(frozen=True)
class WalkAnswer:
    """Result of a walk in an engine."""

    outcome: str
    end: Floats | None  # final state of the free walker, or None unless the walk was completed
    touches_s: Floats  # (steps,) touch times
    along_m: Floats  # (steps,) positions of the footholds along the slope
    slips_m: Floats  # (steps,) net slips, without that of the last step if the foot has not lifted
    steps: int  # engine steps
    time_s: float  # simulated time
    wall_s: float  # processor time of the loop


@dataclass(frozen=True)
class WalkTask:
    """A walk simulated with an engine's integrator, with our contact law or with the engine's native contact."""

    engine: str
    stepping: Stepping
    scene: EngineScene
    touches: int  # number of touches after which the walk ends
    until_s: float  # latest time at which the walk ends
    own: OwnContact | None  # the engine's tuned contact, or None for our contact law
    max_steps: int  # step budget of the engine

    def run(self) -> WalkAnswer:
        walk = EngineWalk(self)
        walk.walk_to_end()
        rules = walk.rules
        walk_state = rules.walk_state
        outcome = rules.outcome
        if outcome is None:
            outcome = Outcome.WALKED if walk.is_over else Outcome.BUDGET_EXHAUSTED
        end = rules.scene.about_centre(walk.q, walk.v) if outcome is Outcome.WALKED else None
        steps = int(walk_state.progress.steps)
        touches = walk_state.touch_time[:steps].copy(), walk_state.touch_along[:steps].copy()
        slips = walk_state.slip[: steps_with_lift(walk_state)].copy()
        return WalkAnswer(outcome.label, end, *touches, slips, walk.steps, walk.time_s, walk.wall_s)


class EngineWalk:
    """Walk in an engine. After each lock or release of a knee it continues in a new model."""

    def __init__(self, task: WalkTask) -> None:
        self.task = task
        self.engine = PHYSICS_ENGINES[task.engine]
        self.q, self.v = task.scene.from_base(task.scene.start)
        self.rules = RuleFollower(task.scene, task.touches, self.q, self.v, carries=task.own is None)
        self.steps = 0
        self.time_s = 0.0
        self.wall_s = 0.0

    @property
    def is_over(self) -> bool:
        return self.time_s >= (1.0 - TIME_ROUNDING) * self.task.until_s

    def walk_to_end(self) -> None:
        """Walk to the end. If a knee locks or is released within an engine step, repeat the step up to that instant."""
        rules = self.rules
        while rules.outcome is None and not self.is_over and self.steps < self.task.max_steps:
            self._simulate(self.task.until_s)
            if rules.turn is not None:
                # The shortened step ends at the knee event just found, so do not stop at that event again.
                rules.watches = False
                wait_s = rules.turn.share * (self.seen_s - self.time_s)
                if wait_s > TIME_ROUNDING * self.task.stepping.step_s:
                    self._simulate(self.time_s + wait_s)
                rules.watches = True
            if rules.turn is not None or rules.is_outdated:
                self.q, self.v = rules.go_on(self.q, self.v)

    def _simulate(self, until_s: float) -> None:
        """Simulate from the current state to `until_s`. Fixed steps are shortened until a whole number fits."""
        task = self.task
        rules = self.rules
        span = until_s - self.time_s
        stepping = task.stepping
        if not self.engine.adapter().INTEGRATORS[stepping.integrator].adapts:
            stepping = replace(stepping, step_s=span / math.ceil((1.0 - TIME_ROUNDING) * span / stepping.step_s))
        offset_s = self.time_s

        def forces(time_s: float, q: Floats, v: Floats) -> Floats:
            return rules.probe.forces(offset_s + time_s, q, v)

        driven = task.scene.ours.driven or task.scene.ours.whole.sprung
        outside = forces if task.own is None or driven else None
        engine = self.engine.simulation(rules.scene.model, stepping, self.q, self.v, outside, task.own)

        def hand_over_ground() -> None:
            for foot in range(2):
                engine.carry(foot, bool(rules.walk_state.has_ground[foot]))

        def monitor(time_s: float, q: Floats, v: Floats) -> bool:
            self.seen_s = offset_s + time_s
            changed = rules.follow(self.seen_s, q, v)
            if rules.turn is not None and rules.watches:
                return False
            self.steps += 1
            self.time_s = self.seen_s
            self.q = q.copy()
            self.v = v.copy()
            if changed:
                hand_over_ground()
            return rules.outcome is None and not (changed and rules.is_outdated)

        hand_over_ground()
        start_s = time.process_time()
        engine.run(task.max_steps - self.steps, span, monitor)
        self.wall_s += time.process_time() - start_s


@dataclass(frozen=True)
class SwingAnswer:
    end: Floats  # (2 n) absolute angles (rad) and velocities (rad/s)
    wall_s: float


def swing(
    engine: str, stepping: Stepping, model: planar.PlanarModel, slope: float, start: Floats, until_s: float, steps: int
) -> SwingAnswer:
    """Simulate the free swing of the walker, pinned to the ground at its stance foot.

    start  (2 n) absolute angles (rad) and velocities (rad/s)
    steps  step budget of the engine
    """
    chain = model.chain
    absolute = np.column_stack((start[: len(chain)] + slope, start[len(chain) :]))
    q, v = np.linalg.lstsq(chain, absolute, rcond=None)[0].T
    simulation = PHYSICS_ENGINES[engine].simulation(model, stepping, q, v)
    start_s = time.process_time()
    motion = record_motion(simulation, steps, until_s)
    wall = time.process_time() - start_s
    return SwingAnswer(np.concatenate((chain @ motion.q[-1] - slope, chain @ motion.v[-1])), wall)


class EngineMotion(NamedTuple):
    """Times (steps,), coordinates and velocities (steps, n) at the ends of an engine's steps."""

    t: Floats
    q: Floats
    v: Floats


def record_motion(engine: Simulation, steps: int, until_s: float) -> EngineMotion:
    """Simulate and record the state at the end of each step."""
    records: list[tuple[float, Floats, Floats]] = []

    def monitor(time_s: float, q: Floats, v: Floats) -> bool:
        records.append((time_s, q.copy(), v.copy()))
        return True

    engine.run(steps, until_s, monitor)
    return EngineMotion(*(np.array(column) for column in zip(*records, strict=True)))


def pinned_model(scene: EngineScene) -> planar.PlanarModel:
    """Return the model of the scene's walker, pinned at the centre of its stance foot."""
    foot = scene.assembly.feet[STANCE_FOOT]
    base = Anchor(foot.body, foot.centre_m)
    return planar.planar_model(scene.assembly, base, planar.PINNED, scene.gravity, scene.locked)


@dataclass(frozen=True)
class TuningAnswer:
    """Measured properties of an engine's native contact, to compare with the target."""

    own: OwnContact
    penetration: float  # m, penetration of the ball at rest
    damping_ratio: float  # damping ratio of the ball's oscillation about rest
    friction: float  # friction coefficient of the sliding block
    creep_velocity: float  # m/s, creep velocity of the block that stands on an incline


@dataclass(frozen=True)
class TuningTask:
    """Task that tunes the native contact of an engine, and measures it with a heavy ball that cannot turn.

    The ball bounces on level ground. It also serves as a block that slides on level ground or creeps on an incline.
    """

    engine: str
    contact: str
    target: EngineContact
    step_s: float  # step size of recorded motions
    sliding_velocity: float  # m/s, lowest velocity in the measurement of sliding friction

    @cached_property
    def own(self) -> OwnContact:
        return PHYSICS_ENGINES[self.engine].adapter().tune(self.contact, self.target)

    @property
    def omega(self) -> float:
        """Angular frequency (rad/s) at which the undamped ball would bounce about rest on the target contact."""
        return math.sqrt(self.target.gravity / self.target.penetration)

    @property
    def settling_s(self) -> float:
        """Time (s) after which the ball counts as at rest: eight times the slower time constant of the target."""
        ratio = self.target.damping_ratio
        slow = self.omega * (ratio - math.sqrt(ratio * ratio - 1.0)) if ratio > 1.0 else self.omega * ratio
        return 8.0 / slow

    def run(self) -> TuningAnswer:
        depth = self.penetration_at_rest()
        return TuningAnswer(self.own, depth, self.damping_ratio(depth), self.friction(depth), self.creep(depth))

    def simulate_contact(
        self, time_s: float, h: float, along: float, depth: float, velocity: tuple[float, float]
    ) -> EngineMotion:
        """Simulate the ball, which starts inside the ground and is pulled along it.

        h         step size (s)
        along     pull along the ground, as a fraction of the weight
        depth     initial penetration (m)
        velocity  initial velocity along and normal to the ground (m/s)
        """
        target = self.target
        engine = PHYSICS_ENGINES[self.engine]
        link = planar.Link("ball", target.mass, (0.0, 0.0), target.mass, -1, (0.0, 0.0), (0.0, 0.0))
        ball = planar.Ball(0, (0.0, 0.0), *planar.ball_and_ground(0.0))
        model = planar.PlanarModel((link,), planar.UPRIGHT, (ball,), along * target.gravity, target.gravity, np.eye(1))
        name = engine.adapter().CONTACTS[self.contact]
        stepping = Stepping(name, h, TIME_ROUNDING if engine.adapter().INTEGRATORS[name].adapts else None)
        simulation = engine.simulation(model, stepping, np.array((0.0, -depth)), np.array(velocity), own=self.own)
        simulation.carry(0, True)
        return record_motion(simulation, UNLIMITED_STEPS, max(2, round(time_s / h)) * h)

    def penetration_at_rest(self) -> float:
        """Return the penetration at rest (m) of a ball that is released at the surface."""
        motion = self.simulate_contact(self.settling_s, STEADY_STEP_FACTOR * self.step_s, 0.0, 0.0, (0.0, 0.0))
        return -float(motion.q[-1, 1])

    def damping_ratio(self, depth: float) -> float:
        """Fit an oscillator to the accelerations of the ball, and return its damping ratio.

        depth  penetration at rest (m)
        """
        omega = self.omega
        motion = self.simulate_contact(self.settling_s / 4.0, self.step_s, 0.0, depth, (0.0, -0.02 * depth * omega))
        x, v = (motion.q[:, 1] + depth) / depth, motion.v[:, 1] / (depth * omega)
        # Engines integrate by different rules, so we use the mean of a step's two ends as its midpoint.
        middle = np.column_stack((x[1:] + x[:-1], v[1:] + v[:-1])) / 2.0
        (k, c), *_ = np.linalg.lstsq(middle, -np.diff(motion.v[:, 1]) / np.diff(motion.t), rcond=None)
        stiffness = k / depth
        damping = c / (depth * omega)
        return float(damping / (2.0 * math.sqrt(stiffness))) if stiffness > 0.0 else 0.0

    def friction(self, depth: float) -> float:
        """Return the friction coefficient: the deceleration of a sliding block, divided by gravity.

        depth  penetration at rest (m)
        """
        settled = self.settling_s
        start = self.sliding_velocity + self.target.friction * self.target.gravity * 1.25 * settled
        motion = self.simulate_contact(1.25 * settled, self.step_s, 0.0, depth, (start, 0.0))
        # Before the last fifth of the motion, the block is still settling into the ground.
        watched = -1 - len(motion.v) // 5
        fall = motion.v[watched, 0] - motion.v[-1, 0]
        return float(fall / ((motion.t[-1] - motion.t[watched]) * self.target.gravity))

    def creep(self, depth: float) -> float:
        """Return the creep velocity (m/s) of a block that stands on an incline.

        depth  penetration at rest (m)
        """
        target = self.target
        h = STEADY_STEP_FACTOR * self.step_s
        motion = self.simulate_contact(self.settling_s, h, target.creep_load, depth, (target.creep_velocity, 0.0))
        return float(motion.v[-1, 0])
