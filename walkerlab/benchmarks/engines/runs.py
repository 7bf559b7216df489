"""What is done in an engine's process: a walk, a swing without ground, a ball and a block on its own contact."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walkerlab.benchmarks.engines.adapter import Contact, OwnContact, Simulation, Stepping
from walkerlab.benchmarks.engines.follow import Follower, follower
from walkerlab.benchmarks.engines.planar import (
    HINGED,
    UPRIGHT,
    Ball,
    Link,
    PlanarModel,
    ball_and_ground,
    chain_of,
    planar_model,
)
from walkerlab.benchmarks.engines.registry import ENGINES
from walkerlab.benchmarks.engines.scenes import EngineScene
from walkerlab.hybrid.contact_rules import STEPS
from walkerlab.hybrid.outcome import Outcome

Floats = NDArray[np.float64]
ROUNDING = 1e-9


@dataclass(frozen=True)
class WalkAnswer:
    """A walk in an engine.

    end      state of the free walker when it was over; None if it ended otherwise
    touches  (steps,) s; along: (steps,) m; slips: (steps,) m
    steps    of the engine
    time_s   when it was over
    wall_s   time of its loop
    """

    outcome: str
    end: Floats | None
    touches_s: Floats
    along_m: Floats
    slips_m: Floats
    steps: int
    time_s: float
    wall_s: float


@dataclass(frozen=True)
class WalkTask:
    """A walk with an engine's integrator, on the ground of our law or its own.

    touches  after which it is over
    until_s  when it is over at the latest, s
    own      the engine's own contact, tuned; None for our law
    most     steps of the engine
    """

    engine: str
    stepping: Stepping
    scene: EngineScene
    touches: int
    until_s: float
    own: OwnContact | None
    most: int

    def run(self) -> WalkAnswer:
        """Walk."""
        scene = self.scene
        q, v = scene.from_base(scene.start)
        rules = follower(scene, self.touches, q, v)
        law = rules.look.forces if self.own is None else self.own
        engine = ENGINES[self.engine].adapter().simulation(scene.model, self.stepping, q, v, law)
        seen = Seen(rules, engine)
        begun = time.perf_counter()
        engine.run(self.most, self.until_s, seen.on_step)
        wall = time.perf_counter() - begun
        over = rules.outcome is None and seen.time_s >= (1.0 - ROUNDING) * self.until_s
        outcome = rules.outcome or Outcome.WALKED if over or rules.outcome is not None else Outcome.BUDGET_EXHAUSTED
        done, ledger = int(rules.ledger.feet[STEPS]), rules.ledger
        return WalkAnswer(
            outcome.label,
            scene.about_centre(seen.q, seen.v) if outcome is Outcome.WALKED else None,
            ledger.touch_time[:done].copy(),
            ledger.touch_along[:done].copy(),
            ledger.slip[:done].copy(),
            seen.steps,
            seen.time_s,
            wall,
        )


class Seen:
    """What is seen of a walk at the ends of its steps."""

    def __init__(self, rules: Follower, engine: Simulation) -> None:
        """Nothing yet; the engine is told where there is ground."""
        self.rules, self.engine = rules, engine
        self.steps, self.time_s = 0, 0.0
        self.q: Floats = np.zeros(0)
        self.v: Floats = np.zeros(0)
        self.hand_over_ground()

    def on_step(self, time_s: float, q: Floats, v: Floats) -> bool:
        """Let the rules look at a step's end; whether the walk goes on."""
        self.steps += 1
        self.time_s, self.q, self.v = time_s, q, v
        if self.rules.follow(time_s, q, v):
            self.hand_over_ground()
        return self.rules.outcome is None

    def hand_over_ground(self) -> None:
        """Tell the engine under which feet there is ground."""
        for foot in range(2):
            self.engine.carry(foot, bool(self.rules.ledger.carried[foot]))


@dataclass(frozen=True)
class SwingAnswer:
    """A swing without ground: the angles and velocities at its end."""

    end: Floats  # (2 n) absolute angles and velocities
    wall_s: float


@dataclass(frozen=True)
class SwingTask:
    """The walker hinged to the ground at its stance foot, in free swing."""

    engine: str
    stepping: Stepping
    model: PlanarModel
    chain: Floats
    slope: float
    start: Floats  # (2 n) absolute angles (rad) and velocities (rad/s)
    until_s: float
    most: int

    def run(self) -> SwingAnswer:
        """Swing."""
        n = len(self.chain)
        q: Floats = np.linalg.solve(self.chain, self.start[:n] + self.slope).astype(np.float64)
        v: Floats = np.linalg.solve(self.chain, self.start[n:]).astype(np.float64)
        engine = ENGINES[self.engine].adapter().simulation(self.model, self.stepping, q, v, None)
        begun = time.perf_counter()
        last = recorded(engine, self.most, self.until_s)[-1]
        wall = time.perf_counter() - begun
        end = np.concatenate((self.chain @ last[1] - self.slope, self.chain @ last[2]))
        return SwingAnswer(end, wall)


def recorded(engine: Simulation, steps: int, until_s: float) -> list[tuple[float, Floats, Floats]]:
    """Time, coordinates and velocities at the end of every step."""
    seen: list[tuple[float, Floats, Floats]] = []

    def on_step(time_s: float, q: Floats, v: Floats) -> bool:
        seen.append((time_s, np.array(q), np.array(v)))
        return True

    engine.run(steps, until_s, on_step)
    return seen


def pinned_model(scene: EngineScene) -> tuple[PlanarModel, Floats]:
    """The scene's walker hinged at the centre of its stance foot, and its chain of angles."""
    foot = scene.assembly.feet[scene.stance]
    model = planar_model(scene.assembly, foot.body, foot.centre_m, HINGED, scene.gravity, scene.ours.slope)
    return model, chain_of(scene.assembly, foot.body)


@dataclass(frozen=True)
class TuningAnswer:
    """What a ball and a block do on an engine's own contact, in the target's terms."""

    own: OwnContact
    penetration: float  # m, of the ball at rest
    damping_ratio: float  # of the ball about its rest
    friction: float  # of the block that slides
    creep_velocity: float  # m/s, of the block that stands on an incline


@dataclass(frozen=True)
class TuningTask:
    """A ball dropped and a block slid on an engine's own contact."""

    engine: str
    contact: str
    target: Contact
    step_s: float
    sliding_velocity: float  # m/s

    def run(self) -> TuningAnswer:
        """Tune by closed forms, then measure."""
        adapter = ENGINES[self.engine].adapter()
        own = adapter.tuned(self.contact, self.target)
        ball = Bench(self, own)
        depth = ball.at_rest()
        ratio = ball.damping_ratio(depth)
        return TuningAnswer(own, depth, ratio, ball.friction(depth), ball.creep(depth))


class Bench:
    """A heavy ball that cannot turn, on level or inclined ground: bouncing ball and sliding block in one."""

    def __init__(self, task: TuningTask, own: OwnContact) -> None:
        """Keep what its runs share."""
        self.task, self.own = task, own
        self.adapter = ENGINES[task.engine].adapter()

    def after(self, time_s: float, along: float, depth: float, velocity: tuple[float, float]) -> Motion:
        """How the ball moves for a time from `depth` (m) inside the ground, pulled by `along` times its weight."""
        target, h = self.task.target, self.task.step_s
        radius, ground = ball_and_ground(0.0)
        link = Link("ball", target.mass, (0.0, 0.0), target.mass, -1, (0.0, 0.0), (0.0, 0.0))
        model = PlanarModel(
            (link,), UPRIGHT, (Ball(0, (0.0, 0.0), radius, ground),), along * target.gravity, target.gravity
        )
        stepping = Stepping(self.adapter.CONTACTS[self.own.model], h)
        engine = self.adapter.simulation(model, stepping, np.array((0.0, -depth)), np.array(velocity), self.own)
        engine.carry(0, True)
        steps = max(2, round(time_s / h))
        return Motion(recorded(engine, steps, steps * h))

    @property
    def settling_s(self) -> float:
        """Several times the slower time constant of the target's ball (s)."""
        omega = math.sqrt(self.task.target.gravity / self.task.target.penetration)
        ratio = self.task.target.damping_ratio
        slow = omega * (ratio - math.sqrt(ratio * ratio - 1.0)) if ratio > 1.0 else omega * ratio
        return 8.0 / slow

    def at_rest(self) -> float:
        """Penetration (m) of a ball that was dropped from the surface."""
        return -float(self.after(self.settling_s, 0.0, 0.0, (0.0, 0.0)).q[-1, 1])

    def damping_ratio(self, depth: float) -> float:
        """Of the oscillator that fits the ball's motion about its rest (least squares of accelerations)."""
        omega = math.sqrt(self.task.target.gravity / self.task.target.penetration)
        motion = self.after(self.settling_s / 4.0, 0.0, depth, (0.0, -0.02 * depth * omega))
        x, v = (motion.q[:, 1] + depth) / depth, motion.v[:, 1] / (depth * omega)
        # means of two ends of a step stand for its middle, whatever the engine's own rule
        middle = np.column_stack((x[1:] + x[:-1], v[1:] + v[:-1])) / 2.0
        (k, c), *_ = np.linalg.lstsq(middle, -np.diff(motion.v[:, 1]) / np.diff(motion.t), rcond=None)
        stiffness, damping = k / depth, c / (depth * omega)
        return float(damping / (2.0 * math.sqrt(stiffness))) if stiffness > 0.0 else 0.0

    def friction(self, depth: float) -> float:
        """Deceleration over gravity of a block that slides, once its penetration has settled."""
        target, settled = self.task.target, self.settling_s
        start = self.task.sliding_velocity + target.friction * target.gravity * 1.25 * settled
        motion = self.after(1.25 * settled, 0.0, depth, (start, 0.0))
        watched = len(motion.v) // 5
        fall = motion.v[-1 - watched, 0] - motion.v[-1, 0]
        return float(fall / ((motion.t[-1] - motion.t[-1 - watched]) * target.gravity))

    def creep(self, depth: float) -> float:
        """Velocity (m/s) at which a block that stands on an incline creeps down."""
        target = self.task.target
        return float(self.after(self.settling_s, target.creep_load, depth, (target.creep_velocity, 0.0)).v[-1, 0])


class Motion:
    """A recorded motion: times (steps,), coordinates and velocities (steps, 2) at the ends of steps."""

    def __init__(self, seen: list[tuple[float, Floats, Floats]]) -> None:
        """Stack what was seen."""
        self.t = np.array([time_s for time_s, _, _ in seen])
        self.q = np.array([q for _, q, _ in seen])
        self.v = np.array([v for _, _, v in seen])
