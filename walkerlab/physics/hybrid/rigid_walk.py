"""Walking with the rigid model: swing phases that end in heel strikes, with or without an observer.

Tangent columns may follow the state: they obey the variational equations and jump at the events (saltation).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.hybrid import endings
from walkerlab.physics.hybrid.rigid_record import Observer, observe, observe_start, observe_strike
from walkerlab.physics.kernels import kernel, kernel_part, vector
from walkerlab.physics.mechanics import rigid_model as rigid
from walkerlab.physics.mechanics.impact import strike
from walkerlab.physics.mechanics.rigid_model import Mode, RigidModel
from walkerlab.physics.solvers import events, stepping
from walkerlab.physics.solvers.events import NO_CROSSING, CrossingFinder
from walkerlab.physics.solvers.system import derivative

LONGEST_SWING = 10.0  # a heel strike must come within this many pendulum times sqrt(L/g)
HULL_ROOM = 0.125
SHORTEST_LANDING = 0.25  # fraction of the gait's step length; on uneven ground a foot must land at least this far ahead
# The search for a knee strike starts at this fraction of a swing's first solver step. At fractions below 1e-9,
# rounding makes a straight knee at rest cross zero.
SEARCH_START = 1e-6
# row of each event function in the crossing finder
HEEL_STRIKE, HIP_FALL, AHEAD, KNEE = range(4)
LEG_RATE = 4  # row of the legs' relative angular velocity, not an event
EVENTS = 5


@kernel_part
def is_bent(system: Mode) -> bool:
    """Whether the swing knee is free, so that a knee strike ends the phase."""
    return system.phase == rigid.BENT and system.model.shank != rigid.NO_SHANK


@kernel_part
def knee_angle(model: RigidModel, y: Any, first: int) -> float:
    """Return the angle (rad) of the swing knee beyond straight, or its rate.

    first  index in y of the first angle, or of the first rate
    """
    return y[first + model.shank] - y[first + model.thigh]


@kernel_part
def hip_above_fall(model: RigidModel, y: Any) -> float:
    """Compute the height (m) of the hip above the limit below which the walker has fallen."""
    return rigid.hip_height(model, y) - endings.FALLEN_HIP * model.leg_length


@kernel_part
def may_end(system: Mode, method: Any, at_start: bool) -> bool:
    """Whether the last solver step may contain an event, judged by values and rates at its ends.

    Most solver steps contain none, so this saves sampling the event functions.
    """
    model = system.model
    old = method.y_old
    y = method.y
    h = method.clock[stepping.T] - method.clock[stepping.T_OLD]
    if hip_above_fall(model, y) < 0.0:
        return True
    n = len(model.arm_x)
    if is_bent(system):
        start, end = knee_angle(model, old, 0), knee_angle(model, y, 0)
        start_rate = h * knee_angle(model, old, n)
        end_rate = h * knee_angle(model, y, n)
        if hull(start, start_rate, end, end_rate, at_start)[1] >= 0.0:
            return True
    before = foot_function(system, old, old[n : 2 * n])
    now = foot_function(system, y, y[n : 2 * n])
    ahead = hull(before[1], h * before[3], now[1], h * now[3])
    return ahead[1] > 0.0 and hull(before[0], h * before[2], now[0], h * now[2])[0] <= 0.0


@kernel_part
def foot_function(system: Mode, y: Any, turn: Any) -> tuple[float, float, float, float]:
    """Compute the heel strike's event function, a function that is positive if the swing foot leads, and their rates.

    For straight legs that are alike, on even ground, both functions are linear in the angles, so scuffing near
    mid-swing is not a zero. Otherwise they are the foot's height above its next foothold and its distance ahead.

    turn  (n,) angular velocities, for rates of change, or a change of the angles, for directional derivatives
    """
    model = system.model
    swing = turn[rigid.SWING]
    stance = turn[rigid.STANCE]
    if is_bent(system) or system.rise != 0.0 or not model.alike:
        height, ahead, upward, apart = rigid.swing_foot_motion(model, y, turn)
        return height - system.rise, ahead, upward, apart
    return (
        rigid.feet_on_slope(model, y[rigid.SWING], y[rigid.STANCE]),
        y[rigid.SWING] - y[rigid.STANCE],
        swing + stance,
        swing - stance,
    )


@kernel_part
def hull(start: float, start_rate: float, end: float, end_rate: float, zero_at_start: bool = False) -> Any:
    """Return bounds on an event function within a solver step, from its values and rates (per step) at both ends.

    These are the bounds of the Bernstein coefficients of Hermite's cubic, widened by an eighth of their spread, far
    more than the cubic's error. With `zero_at_start`, the first coefficient is left out, which divides out this zero.
    """
    second = start + start_rate / 3.0
    third = end - end_rate / 3.0
    first = second if zero_at_start else start
    low = min(first, second, third, end)
    high = max(first, second, third, end)
    room = HULL_ROOM * (high - low)
    return low - room, high + room


@kernel_part
def sample_events(system: Mode, y: Any, node: int, finder: CrossingFinder) -> None:
    foot = foot_function(system, y, y[len(system.model.arm_x) :])
    finder.values[HEEL_STRIKE, node], finder.values[AHEAD, node] = foot[0], foot[1]
    finder.values[HIP_FALL, node] = hip_above_fall(system.model, y)
    if is_bent(system):
        finder.values[KNEE, node] = knee_angle(system.model, y, 0)


@kernel
def events_in_step(system: Mode, finder: CrossingFinder, at_start: bool) -> tuple[float, float, float]:
    """Find the fractions of a solver step at which heel strike (foot ahead), fall and knee strike occur.

    The fraction of an event that does not occur is NO_CROSSING.
    """
    for node in range(finder.nodes.size):
        sample_events(system, finder.states[node], node, finder)
    on_ground = at_start and system.behind == system.rise
    strike = events.first_crossing(finder, HEEL_STRIKE, events.FALLING, 0.0, on_ground)
    # A foot that comes down behind the stance foot scuffs, which the model ignores.
    while strike <= 1.0 and events.value_at(finder, AHEAD, strike) <= 0.0:
        strike = events.first_crossing(finder, HEEL_STRIKE, events.FALLING, strike + 1e-12, on_ground)
    fall = events.first_crossing(finder, HIP_FALL, events.FALLING, 0.0, False)
    knee_strike = NO_CROSSING
    if is_bent(system):
        straight = at_start and abs(finder.values[KNEE, 0]) < endings.STRAIGHT_KNEE
        knee_strike = events.first_crossing(finder, KNEE, events.RISING, SEARCH_START if straight else 0.0, straight)
    return strike, fall, knee_strike


@kernel_part
def take_step(
    walker: Any, method: Any, finder: CrossingFinder, observer: Any, t: float, y: Any, step: int, strikes: Any
) -> tuple[int, float]:
    """Take one step, a swing and its heel strike, from time t (s). Afterwards y holds the state and tangent columns.

    walker  as in `walk`; if the legs differ, leg 1 swings in even steps

    Returns WALKED and the time of the heel strike, and leaves the state before the strike in `method`. If the step
    fails, returns its outcome and the time at which it ended. The time of a knee strike is written into `strikes`.
    """
    model = walker[step % walker.size]
    following = walker[(step + 1) % walker.size]
    latest = t + LONGEST_SWING * math.sqrt(model.leg_length / model.gravity)
    phase = rigid.BENT if model.shank != rigid.NO_SHANK and strikes.knee_time[step] >= 0.0 else rigid.STRAIGHT
    behind = -strikes.rise[step]
    rise = strikes.rise[step + 1]
    while True:
        system = Mode(model, phase, behind, rise)
        status = swing_phase(method, system, finder, observer, t, y, latest, step)
        if status != endings.WALKED and status != endings.KNEE_STRUCK:
            return status, method.clock[stepping.T]
        heel = status == endings.WALKED
        if heel and strikes.nearest > 0.0 and rigid.swing_foot(model, method.y)[1] < strikes.nearest:
            return endings.FELL, method.clock[stepping.T]
        t = pass_event(method, system, following, y, strikes, step)
        observe_strike(observer, system, following, heel, method.y, y)
        if heel:
            return endings.WALKED, t
        strikes.knee_time[step] = t
        phase = rigid.STRAIGHT


@kernel_part
def swing_phase(
    method: Any, system: Mode, finder: CrossingFinder, observer: Any, t: float, y: Any, latest: float, step: int
) -> int:
    """Integrate up to the knee or heel strike that ends a phase, or to the time `latest` (s)."""
    # A phase starts at the strike that ended the previous one. `at_start` makes the search ignore that zero.
    limit = latest
    coming = False
    # After a knee strike the swing foot is in the air and the knee is no longer watched, so no event function starts at
    # zero.
    at_start = is_bent(system) or system.model.shank == rigid.NO_SHANK
    stepping.begin(method, system, t, y, method.clock[stepping.H_NEXT])
    observe_start(observer, system, y)
    while method.clock[stepping.T] < limit:
        status = stepping.advance(method, system, limit)
        if status != stepping.STEP_DONE:
            return endings.BUDGET_EXHAUSTED if status == stepping.OUT_OF_BUDGET else endings.SOLVER_FAILED
        # The interval up to a located event was searched and observed before the solver step was rewound.
        if coming:
            continue
        near = may_end(system, method, at_start)
        if near or observer.watching:
            stepping.prepare_dense(method, system)
        strike = fall = knee_strike = NO_CROSSING
        if near:
            stepping.sample(method, system, finder.nodes, finder.states)
            strike, fall, knee_strike = events_in_step(system, finder, at_start)
        if observer.watching:
            observe(observer, method, system, finder, LEG_RATE, min(1.0, strike, fall, knee_strike), step)
        if fall < min(strike, knee_strike):
            return endings.FELL
        # The foot lands before the knee has locked.
        if is_bent(system) and strike < knee_strike:
            return endings.BENT_KNEE
        if min(strike, knee_strike) <= 1.0:
            coming = True
            start, end = method.clock[stepping.T_OLD], method.clock[stepping.T]
            limit = start + min(strike, knee_strike) * (end - start)
            stepping.rewind(method, system)
        at_start = False
    if not coming:
        return endings.NO_HEEL_STRIKE
    return endings.KNEE_STRUCK if is_bent(system) else endings.WALKED


@kernel_part
def event_value(system: Mode, y: Any, turn: Any) -> tuple[float, float]:
    """Compute the event function of the strike that ends a phase, and its rate. `turn` is as in `foot_function`."""
    if is_bent(system):
        return knee_angle(system.model, y, 0), knee_angle(system.model, turn, 0)
    value, _, change, _ = foot_function(system, y, turn)
    return value, change


@kernel_part
def pass_event(method: Any, system: Mode, following: RigidModel, new: Any, strikes: Any, step: int) -> float:
    """Apply the strike at the end of a phase, after a last Newton correction of its time, and return that time (s).

    Afterwards `method` holds the state before the strike, `new` the state after it, and `strikes` how much later each
    tangent column strikes (its wait). At a heel strike, a column Phi becomes J (Phi + f wait), which stays on the
    section. At a knee strike, it becomes J (Phi + f wait) - f+ wait. Here f and f+ are the rates before and after the
    strike, and J is the derivative of the jump.
    """
    model = system.model
    y = method.y
    waits = strikes.waits
    n = len(model.arm_x)
    knee = is_bent(system)
    before = vector(model.zero_state)
    f = vector(model.zero_state)
    for i in range(2 * n):
        before[i] = y[i]
    derivative(system, method.clock[stepping.T], before, f)
    value, rate = event_value(system, y, y[n : 2 * n])
    # The solver step misses the event only by the error of its dense output, so one Euler step is enough to reach it.
    wait = -value / rate if rate != 0.0 else 0.0
    for i in range(2 * n):
        y[i] += wait * f[i]
        before[i] = y[i]
    t = method.clock[stepping.T] + wait
    if len(y) > 2 * n:
        derivative(system, t, before, f)
        _, rate = event_value(system, y, y[n : 2 * n])
        for column in range(1, len(y) // (2 * n)):
            at = 2 * n * column
            _, change = event_value(system, y, y[at : at + n])
            wait = -change / rate
            lift = strikes.lift[step + 1, column - 1]
            if lift != 0.0 and not knee:
                _, _, upward, _ = rigid.swing_foot_motion(model, y, y[n : 2 * n])
                # A raised foothold meets the foot earlier, because `upward` is negative.
                wait += lift / upward
            waits[step, column - 1] = wait
            events.shift_column(y, at, f, wait)
    strike(model, model if knee else following, rigid.STRAIGHT if knee else rigid.AT_STRIKE, y, new)
    if knee and len(y) > 2 * n:
        for i in range(2 * n):
            before[i] = new[i]
        derivative(Mode(model, rigid.STRAIGHT, system.behind, system.rise), t, before, f)
        for column in range(1, len(y) // (2 * n)):
            events.shift_column(new, 2 * n * column, f, -waits[step, column - 1])
    return t


class HeelStrikes(NamedTuple):
    """Heel strikes of a walk, step by step. States include the tangent columns of the walk."""

    time: Any  # (steps,) s
    before: Any  # (steps, m) states just before the strikes
    after: Any  # (steps, m) states just after the strikes, with the legs' roles exchanged
    # (steps,) s, times of the knee strikes; empty without knees. As an input, a negative time means that the knee is
    # locked from the start.
    knee_time: Any
    rise: Any  # (steps + 1,) m, input: rise of each foothold from the one before, beginning with the present foothold
    nearest: float  # m, a foot that lands less than this ahead of the stance foot ends the walk; 0 on even ground
    lift: Any  # (steps + 1, columns) m, input: derivative of each rise in each column's direction
    waits: Any  # (steps, columns) s, derivative of each step's duration in each column's direction


def new_heel_strikes(
    steps: int, m: int, kneed: bool = True, rise: Any = None, nearest: float = 0.0, columns: int = 0
) -> HeelStrikes:
    """Allocate the arrays of `HeelStrikes` for states of m values, tangent columns included."""
    before, after = np.zeros((2, steps, m))
    even = np.zeros(steps + 1) if rise is None else rise
    knee_time = np.zeros(steps if kneed else 0)
    lift = np.zeros((steps + 1, columns))
    waits = np.zeros((steps, columns))
    return HeelStrikes(np.zeros(steps), before, after, knee_time, even, nearest, lift, waits)


@kernel
def walk(
    walker: Any, method: Any, finder: CrossingFinder, observer: Observer, y: Any, strikes: HeelStrikes
) -> tuple[int, int]:
    """Walk until `strikes` is full or the walk ends, and return the outcome code and the number of steps taken.

    walker  models of the first step and, if the legs differ, of the second, from `models_in_turn`
    y       (m,) state at time 0, with tangent columns if the method has room for them; overwritten with the last state
    """
    t = 0.0
    for step in range(strikes.time.size):
        status, t = take_step(walker, method, finder, observer, t, y, step, strikes)
        if status != endings.WALKED:
            return status, step
        strikes.time[step] = t
        for i in range(y.size):
            strikes.before[step, i] = method.y[i]
            strikes.after[step, i] = y[i]
    return endings.WALKED, strikes.time.size
