"""Stage `known-problems`: test the contact code on problems with known answers. The scene does not matter."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Annotated, Final

import numpy as np

from walkerlab.config.contact import Contact
from walkerlab.evidence.verification import references
from walkerlab.labels import Label, labels_of
from walkerlab.outcome import Outcome
from walkerlab.physics.energy_channels import LOSS_ENTRIES
from walkerlab.physics.ground.compliant import contact_walker
from walkerlab.physics.ground.friction import Coulomb
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.ground.terrain import checkerboard
from walkerlab.physics.ground.walker import ContactWalker, one_foot_motion
from walkerlab.physics.hybrid.contact_loop import LONGEST_FLIGHT, LONGEST_STEP
from walkerlab.physics.hybrid.contact_result import new_observer, walk_on
from walkerlab.physics.hybrid.contact_state import Frame, JudgedGround, new_walk_state
from walkerlab.physics.mechanics.parts import Assembly, BallFoot, Body, Position, Revolute
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.pipeline.progress import Progress, track
from walkerlab.pipeline.store.content import Content, rows_group

# Pads of this length have no edge in reach. Minus this length is used as leg length, so that the hip is never low
# enough to count as a fall.
UNBOUNDED_M = 1e7
OUT_OF_REACH: Position = (0.0, 1e3)  # m, position of an inactive foot
PROBLEM_BUDGET = 2_000_000  # right-hand sides
SAMPLE_COUNT = 4000
# indices of the first body's coordinates and rates in the state
BODY_HEIGHT, BODY_ANGLE, ALONG_RATE, HEIGHT_RATE, ANGLE_RATE = 1, 2, 4, 5, 6
EARTH_GRAVITY: Final = 9.81
CENTRE: Final = (0.0, 0.0)
PAPER_LAW: Final = Impact.from_contact(Contact().to_si())
PAPER_FRICTION: Final = Coulomb(0.9, 0.7, 0.1, 1.0)


@dataclass(frozen=True)
class ParticleRun:
    """Result of a rig's run: samples, end state and dissipated energy."""

    times: Floats  # (samples,) s
    states: Floats  # (samples, 8) states of both bodies
    end: State
    dissipated: Floats  # (5,) J, in the order of `energy_channels.LOSSES`


def rig(
    mass: float,
    inertia: float,
    normal: Impact,
    friction: Coulomb = PAPER_FRICTION,
    feet: tuple[Position, Position] = (CENTRE, OUT_OF_REACH),
    slope: float = 0.0,
) -> ContactWalker:
    """Build a walker that acts as one rigid body.

    It needs a second body, which has the same inertia but no mass, and idles at a hinge in the centre of mass.

    feet  positions of the point feet relative to the centre of mass (m)
    """
    assembly = Assembly(
        bodies=(Body("body", mass, CENTRE, inertia), Body("idle", 0.0, CENTRE, inertia)),
        joints=(Revolute("hinge", "body", CENTRE, "idle", CENTRE),),
        feet=(BallFoot("first", "body", feet[0], 0.0), BallFoot("second", "body", feet[1], 0.0)),
    )
    return contact_walker(assembly, normal, friction, EARTH_GRAVITY, slope)


def rig_state(position: Position, velocity: Position, angle: float = 0.0, rate: float = 0.0) -> State:
    """Return the rig's state from the position (m) and velocity (m/s) of its centre of mass in the slope's frame."""
    return (*position, angle, 0.0, *velocity, rate, 0.0)


def run_until(
    walker: ContactWalker, start: State, duration_s: float, rtol: float = 1e-9, atol: float = 1e-12
) -> ParticleRun:
    """Simulate for `duration_s`, with evenly spaced samples.

    Raises ArithmeticError if the run ends early.
    """
    frame = Frame(-UNBOUNDED_M, 2.0 * duration_s / LONGEST_FLIGHT, True)
    walk_state = new_walk_state(walker, JudgedGround(checkerboard(UNBOUNDED_M, (0.0, 0.0)), frame), 1, 1, start)
    walk_state.at_zero[:] = 0
    # Set the time of the last touch so that the rule for walks without heel strikes ends this run at `duration_s`.
    walk_state.progress.last_touch = duration_s - LONGEST_STEP * frame.pendulum_time
    times = np.arange(SAMPLE_COUNT, dtype=np.float64) * duration_s / SAMPLE_COUNT
    observer = new_observer(walker, walk_state, start, times)
    stopped = walk_on(walker, Tolerances("radau5", rtol, atol, PROBLEM_BUDGET), walk_state, observer, start)
    if stopped.outcome is not Outcome.NO_HEEL_STRIKE:
        raise ArithmeticError(f"ended as {stopped.outcome.label} at {stopped.time_s:.4g} s of {duration_s:.4g} s")
    recorded = int(observer.tally.recorded)
    times = observer.samples.time_s[:recorded]
    states = observer.samples.states[:recorded]
    return ParticleRun(times, states, stopped.state, observer.account[LOSS_ENTRIES])


@dataclass(frozen=True)
class Known:
    """A quantity computed with the contact code, and the reference value."""

    name: Annotated[str, Label("", "name of the problem")]
    quantity: Annotated[str, Label("", "compared quantity, with its unit")]
    value: Annotated[float, Label("1", "value computed by the contact code, in the quantity's unit")]
    reference: Annotated[float, Label("1", "reference value, computed by another route, in the quantity's unit")]
    source: str
    limit: float  # largest relative error that is accepted. `why_limit` gives the reason.
    why_limit: str
    wall_s: float

    @property
    def error(self) -> Annotated[float, Label("1", "relative difference from the reference")]:
        return abs(self.value - self.reference) / abs(self.reference)

    @property
    def ok(self) -> bool:
        return bool(math.isfinite(self.error) and self.error <= self.limit)


def solve_problem(
    name: str,
    quantity: str,
    run: Callable[[], float],
    reference_by: Callable[[], float],
    source: str,
    limit: float,
    why: str,
) -> Known:
    """Solve a problem with the contact code (`run`) and compute the reference. A failed run never meets the limit.

    why  reason for the limit
    """
    started = time.perf_counter()
    reference = reference_by()
    try:
        value = run()
    except ArithmeticError:
        # This is far beyond any limit, but finite, because results must not contain infinity.
        value = math.copysign(1e300, reference)
    return Known(name, quantity, value, reference, source, limit, why, time.perf_counter() - started)


SPRING: Final = Impact(1.0e6, 1.0, 0.0, 1.0e-4)
LIGHT_LAW: Final = PAPER_LAW._replace(damping=9.0e2)
THICK_LAW: Final = PAPER_LAW._replace(damping=9.0e3)
DROP = 0.1
BOUNCES = 5
BLOCK_MASS = 20.0


def bouncing_ball_period() -> float:
    """Return the mean time (s) between landings over five bounces on an undamped linear spring."""
    ball = rig(1.0, 0.1, SPRING)
    first = math.sqrt(2.0 * DROP / EARTH_GRAVITY)
    period = references.linear_bounce_period(1.0, SPRING.stiffness, DROP, EARTH_GRAVITY)
    # End the run in flight, from where the time of the next landing can be computed exactly.
    run = run_until(ball, rig_state((0.0, DROP), (0.0, 0.0)), first + (BOUNCES - 0.5) * period)
    height, rise = run.states[-1, [BODY_HEIGHT, HEIGHT_RATE]]
    until_landing = (rise + math.sqrt(rise**2 + 2.0 * EARTH_GRAVITY * height)) / EARTH_GRAVITY
    return (float(run.times[-1] + until_landing) - first) / BOUNCES


def restitution(law: Impact, speed: float) -> float:
    """Return the coefficient of restitution of a ball that is as heavy as the walker and lands at `speed` (m/s)."""
    ball = rig(BLOCK_MASS, 1.0, law)
    height = 1e-3
    start = rig_state((0.0, height), (0.0, -math.sqrt(speed**2 - 2.0 * EARTH_GRAVITY * height)))
    flying = [y for y in run_until(ball, start, 0.02).states if y[BODY_HEIGHT] > 0.0 and y[HEIGHT_RATE] > 0.0]
    if not flying:
        return 0.0
    y = flying[0]
    # Energy is constant in flight, so any sample of it gives the speed at the surface.
    return math.sqrt(y[HEIGHT_RATE] ** 2 + 2.0 * EARTH_GRAVITY * y[BODY_HEIGHT]) / speed


def block_speed(slope: float, start_speed: float) -> float:
    """Return the speed (m/s) of a block on a slope (rad) one second after it starts at `start_speed` (m/s)."""
    foot = PAPER_LAW.resting_foot(BLOCK_MASS * EARTH_GRAVITY * math.cos(slope), BLOCK_MASS)
    # The block starts at the depth at which it would rest, so that it neither falls nor bounces.
    block = rig(BLOCK_MASS, 1.0, PAPER_LAW, slope=slope)
    return float(run_until(block, rig_state((0.0, -foot.depth), (start_speed, 0.0)), 1.0).end[ALONG_RATE])


SPOKES = 8
WHEEL_SLOPE = 0.08
HUB_INERTIA = 1e-3
STIFF: Final = Impact(1.0e9, 1.0, 3.0e5, 1.0e-7)
STICKY: Final = Coulomb(2.0, 2.0, 1.0e-4, 1.0e-3)
ROUNDS = 14


def rimless_wheel_speed() -> float:
    """Return the angular speed (rad/s) of a steadily rolling wheel at the moment when a spoke is normal to the slope.

    Each run simulates the wheel with two spokes only, while it rolls from one to the other. The next run starts at the
    final speed of the last.
    """
    turn = 2.0 * math.pi / SPOKES
    ahead = (math.sin(turn), -math.cos(turn))
    wheel = rig(1.0, HUB_INERTIA, STIFF, STICKY, ((0.0, -1.0), ahead), WHEEL_SLOPE)
    # The wheel starts too slow, so that it has to find the steady speed by itself.
    speed = 0.9 * references.wheel_upright_speed(SPOKES, WHEEL_SLOPE, EARTH_GRAVITY, HUB_INERTIA)
    for _ in range(ROUNDS):
        height = 1.0 - EARTH_GRAVITY * math.cos(WHEEL_SLOPE) / STIFF.stiffness
        start = rig_state((0.0, height), (speed, 0.0), -WHEEL_SLOPE, -speed)
        run = run_until(wheel, start, turn / speed, 1e-8, 1e-11)
        angle = -(run.states[:, BODY_ANGLE] + WHEEL_SLOPE)
        speed = float(np.interp(turn, angle, -run.states[:, ANGLE_RATE]))
    return speed


ROD_ANGLE = 1.0
ROD_FRICTION = 4.0
ROD_STIFFNESS = 1.0e8


def painleve_growth_rate() -> float:
    """Compute from penetrations d the growth rate s (1/s) at which the end of a sliding rod digs in.

    For d = a + b cosh(s t), its differences D over equal times tau obey D(t + tau) + D(t - tau) = 2 cosh(s tau) D(t).
    """
    end = (math.cos(ROD_ANGLE), -math.sin(ROD_ANGLE))
    ground = Impact(ROD_STIFFNESS, 1.0, 0.0, 1.0e-4)
    friction = Coulomb(ROD_FRICTION, ROD_FRICTION, 0.1, 1.0)
    rod = rig(1.0, 1.0 / 3.0, ground, friction, (end, OUT_OF_REACH))
    rate = references.painleve_growth_rate(ROD_ANGLE, ROD_FRICTION, 1.0, ROD_STIFFNESS)
    run = run_until(rod, rig_state((0.0, math.sin(ROD_ANGLE)), (50.0, 0.0)), 6.0 / rate, 1e-11, 1e-16)
    samples = np.linspace(0.4 * run.times.size, run.times.size - 1, 4).astype(int)
    samples = samples[0] + (samples[1] - samples[0]) * np.arange(4)
    samples = samples[samples < run.times.size]
    tau = float(run.times[samples[1]] - run.times[samples[0]])
    first, middle, last = np.diff([-one_foot_motion(rod.whole, 0, run.states[index]).height for index in samples])
    return math.acosh(0.5 * (last + first) / middle) / tau


PROBLEMS: Final = (
    partial(
        solve_problem, "bouncing ball", "time between landings, s", bouncing_ball_period,
        partial(references.linear_bounce_period, 1.0, SPRING.stiffness, DROP, EARTH_GRAVITY),
        source="closed form: free flight and half a period of the spring", limit=1e-7,
        why="the tolerance, over five bounces",
    ),
    *(
        partial(
            solve_problem, name, f"restitution at 0.5 m/s, {share} of the paper's damping",
            partial(restitution, law, 0.5), partial(references.restitution, BLOCK_MASS, 0.5, law, EARTH_GRAVITY),
            source="SciPy DOP853 on the law as written in its manual", limit=1e-6,
            why="1000 x the tolerance",
        )
        for name, share, law in (
            ("ball dropped on the IMPACT law", "a hundredth", LIGHT_LAW),
            ("ball dropped on thicker ground", "a tenth", THICK_LAW),
        )
    ),
    partial(
        solve_problem, "block on an incline that holds it", "creep speed on 0.2 rad, m/s",
        partial(block_speed, 0.2, 0.0),
        partial(references.creep_speed, 0.2, PAPER_FRICTION.static, PAPER_FRICTION.stiction_velocity),
        source="root of the friction law's cubic, SciPy brentq", limit=1e-7,
        why="the tolerance",
    ),
    partial(
        solve_problem, "block on too steep an incline", "speed on 0.8 rad, one second after a start at 2 m/s, m/s",
        partial(block_speed, 0.8, 2.0),
        lambda: 2.0 + references.sliding_acceleration(0.8, PAPER_FRICTION.dynamic, EARTH_GRAVITY),
        source="closed form: g (sin - mu cos)", limit=1e-7,
        why="the tolerance",
    ),
    partial(
        solve_problem, "rimless wheel of eight spokes", "steady speed with a spoke upright at 0.08 rad, rad/s",
        rimless_wheel_speed,
        partial(references.wheel_upright_speed, SPOKES, WHEEL_SLOPE, EARTH_GRAVITY, HUB_INERTIA),
        source="McGeer 1990: closed form for rigid spokes", limit=1e-3,
        why="the ground under the spokes yields and creeps a little",
    ),
    partial(
        solve_problem, "Painleve's rod", "rate at which its end digs in at friction 4, 1/s", painleve_growth_rate,
        partial(references.painleve_growth_rate, ROD_ANGLE, ROD_FRICTION, 1.0, ROD_STIFFNESS),
        source="closed form, linearised", limit=1e-3,
        why="the rod turns a little as it digs in",
    ),
)  # fmt: skip


def run(_config: object, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Solve every problem. Wrong answers are stored as well, because the stage `stability` reports them."""
    rows = []
    for problem in track(progress, "known problems", len(PROBLEMS), PROBLEMS):
        result = problem()
        rows.append({**asdict(result), "error": result.error, "ok": result.ok})
    right = sum(row["ok"] for row in rows)
    group = rows_group(rows, labels_of(Known), "problem", "number of the row")
    return Content({"known": group}, {"known": rows, "passed": right, "failed": len(rows) - right})
