"""Walking with the rigid model: swing phases that end in heel strikes, observed or not.

Compiled as a whole for the project's own methods; the same source runs in Python with a library's integrator.
"""

import math
from typing import Any

import walkerlab.mechanics.rigid_swing  # noqa: F401 (the equations of a RigidWalker, found by its type)
from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.rigid_observer import observe, observe_start, wants_dense
from walkerlab.kernels import by_type, inlined, kernel
from walkerlab.mechanics.heel_strike import feet_on_slope, impact
from walkerlab.mechanics.rigid_compass import RigidWalker, accelerations
from walkerlab.solvers.dop853 import Dop853
from walkerlab.solvers.events import FALLING, NO_CROSSING, CrossingFinder, first_crossing, value_at
from walkerlab.solvers.radau5 import Radau5
from walkerlab.solvers.scipy_methods import ScipyMethod
from walkerlab.solvers.stepping import (
    H_NEXT,
    OUT_OF_BUDGET,
    STEP_DONE,
    T_OLD,
    T,
    advance,
    begin,
    end_state,
    interpolate,
    prepare_dense,
    rewind,
)
from walkerlab.solvers.system import State

LONGEST_SWING = 10.0  # pendulum times sqrt(L/g) within which a heel strike must come
HULL_ROOM = 0.125
FALLEN_HIP = 0.5  # hip height over the slope in leg lengths
HEEL_STRIKE, FALL, AHEAD = 0, 1, 2  # signals of the finder
SIGNALS = 3
WALKED, FELL = int(Outcome.WALKED), int(Outcome.FELL)
NO_HEEL_STRIKE, REJECTED = int(Outcome.NO_HEEL_STRIKE), int(Outcome.REJECTED)
BUDGET_EXHAUSTED, SOLVER_FAILED = int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED)


@inlined
def hip_above_fall(walker: RigidWalker, y: State) -> float:
    """Height of the hip over the slope in leg lengths, less what counts as fallen."""
    return math.cos(y[1] + walker.slope) - FALLEN_HIP


@inlined
def may_end(walker: RigidWalker, method: Any, y: State) -> bool:
    """Whether the last step, which led to y, may hold a heel strike or a fall: false through most of a swing.

    A heel strike needs the swing leg ahead of the stance leg and the feet's line to fall onto the slope. Both signals
    are linear in the angles, whose values and velocities at the step's ends are known.
    """
    if hip_above_fall(walker, y) < 0.0:
        return True
    old, h = method.y_old, method.clock[T] - method.clock[T_OLD]
    ahead = hull(old[0] - old[1], h * (old[2] - old[3]), y[0] - y[1], h * (y[2] - y[3]))
    if ahead[1] <= 0.0:
        return False
    start, end = feet_on_slope(walker, old[0], old[1]), feet_on_slope(walker, y[0], y[1])
    guard = hull(start, h * (old[2] + old[3]), end, h * (y[2] + y[3]))
    return guard[0] <= 0.0


@inlined
def hull(start: float, start_rate: float, end: float, end_rate: float) -> tuple[float, float]:
    """Bounds of a signal within a step, from its values and rates per step at the ends.

    Those of the Bernstein coefficients of Hermite's cubic, an eighth of their spread further apart: what the cubic
    leaves out is far less.
    """
    second, third = start + start_rate / 3.0, end - end_rate / 3.0
    least, most = min(start, second, third, end), max(start, second, third, end)
    room = HULL_ROOM * (most - least)
    return least - room, most + room


@inlined
def sample_signals(walker: RigidWalker, y: State, node: int, finder: CrossingFinder) -> None:
    """Values of the signals at one node of a step, where the state is y."""
    finder.values[HEEL_STRIKE, node] = feet_on_slope(walker, y[0], y[1])
    finder.values[FALL, node] = hip_above_fall(walker, y)
    finder.values[AHEAD, node] = y[0] - y[1]


@inlined
def events_in_step(finder: CrossingFinder, at_start: bool) -> tuple[float, float]:
    """Fractions of a sampled step at which the swing foot strikes with its leg ahead, and at which the walker falls."""
    strike = first_crossing(finder, HEEL_STRIKE, FALLING, 0.0, at_start)
    while strike <= 1.0 and value_at(finder, AHEAD, strike) <= 0.0:
        strike = first_crossing(finder, HEEL_STRIKE, FALLING, strike + 1e-12, at_start)
    return strike, first_crossing(finder, FALL, FALLING, 0.0, False)


@by_type
def scan_swing(
    method: Any, system: Any, walker: RigidWalker, finder: CrossingFinder, at_start: bool
) -> tuple[float, float]:
    """`events_in_step` of the last step of a method; its dense output is ready."""


@scan_swing.case(Dop853)
@scan_swing.case(Radau5)
def scan_compiled(
    method: Any, system: Any, walker: RigidWalker, finder: CrossingFinder, at_start: bool
) -> tuple[float, float]:
    """Compiled with the walk."""
    for node in range(finder.nodes.size):
        sample_signals(walker, interpolate(method, system, finder.nodes[node]), node, finder)
    return events_in_step(finder, at_start)


@kernel
def scan_states(walker: RigidWalker, states: Any, finder: CrossingFinder, at_start: bool) -> tuple[float, float]:
    """`events_in_step` of a step whose states at the nodes are the rows of `states`."""
    for node in range(finder.nodes.size):
        y = (states[node, 0], states[node, 1], states[node, 2], states[node, 3])
        sample_signals(walker, y, node, finder)
    return events_in_step(finder, at_start)


@scan_swing.case(ScipyMethod)
def scan_scipy(
    method: ScipyMethod, system: Any, walker: RigidWalker, finder: CrossingFinder, at_start: bool
) -> tuple[float, float]:
    """A walk in Python hands the step's states to compiled code at once."""
    strike, fall = scan_states(walker, method.states_at(finder.nodes), finder, at_start)
    return strike, fall


@inlined
def swing(
    method: Any, system: Any, walker: RigidWalker, finder: CrossingFinder, observer: Any, t: float, y0: State, step: int
) -> int:
    """Integrate one swing phase up to and including the instant before its heel strike.

    The first four numbers of the system's state are the walker's. On WALKED the method stands at the heel strike.
    """
    limit = t + LONGEST_SWING * math.sqrt(walker.leg_length / walker.gravity)
    begin(method, system, t, y0, method.clock[H_NEXT])
    observe_start(observer, walker, y0)
    arriving, at_start = False, True
    while method.clock[T] < limit:
        status = advance(method, system, limit)
        if status != STEP_DONE:
            return BUDGET_EXHAUSTED if status == OUT_OF_BUDGET else SOLVER_FAILED
        if arriving:
            continue
        near = may_end(walker, method, end_state(method, system))
        if near or wants_dense(observer):
            prepare_dense(method, system)
        strike, fall = NO_CROSSING, NO_CROSSING
        if near:
            strike, fall = scan_swing(method, system, walker, finder, at_start)
        observe(observer, method, system, walker, min(1.0, strike, fall), step)
        if fall < strike:
            return FELL
        if strike <= 1.0:
            limit = method.clock[T_OLD] + strike * (method.clock[T] - method.clock[T_OLD])
            rewind(method, system)
            arriving = True
        at_start = False
    return WALKED if arriving else NO_HEEL_STRIKE


@kernel
def walk(
    walker: RigidWalker,
    method: Any,
    finder: CrossingFinder,
    observer: Any,
    start: State,
    strikes: Any,
    before: Any,
    after: Any,
) -> tuple[int, int]:
    """Walk until `strikes` is full or the walk ends.

    start    state at time 0
    strikes  (steps,) times of the heel strikes, s; written
    before   (steps, 4) states just before them; written
    after    (steps, 4) states just after them, roles changed; written

    Returns the outcome's number and how many steps were taken.
    """
    t, y = 0.0, start
    for step in range(strikes.size):
        status = swing(method, walker, walker, finder, observer, t, y, step)
        if status != WALKED:
            return status, step
        t, y = slide_onto_slope(walker, method.clock[T], end_state(method, walker))
        strikes[step] = t
        new = impact(walker, y[0], y[1], y[2], y[3])
        for i in range(4):
            before[step, i] = y[i]
            after[step, i] = new[i]
        y = new
    return WALKED, strikes.size


@inlined
def slide_onto_slope(walker: RigidWalker, t: float, y: State) -> tuple[float, State]:
    """Newton's last correction of the heel strike's time (s) and state: the guard is linear in the state."""
    theta_1, theta_2, omega_1, omega_2 = y[0], y[1], y[2], y[3]
    rate = omega_1 + omega_2
    wait = -feet_on_slope(walker, theta_1, theta_2) / rate if rate != 0.0 else 0.0
    alpha_1, alpha_2 = accelerations(walker, theta_1, theta_2, omega_1, omega_2)
    late = (theta_1 + wait * omega_1, theta_2 + wait * omega_2, omega_1 + wait * alpha_1, omega_2 + wait * alpha_2)
    return t + wait, late
