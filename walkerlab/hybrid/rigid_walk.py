"""Walking with the rigid model: swing phases that end in heel strikes, observed or not.

A leg with a knee swings bent until the knee strikes, then straight. Compiled as a whole for the project's own methods;
the same source runs in Python with a library's integrator.
"""

import math
from typing import Any

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.rigid_observer import observe, observe_start, wants_dense
from walkerlab.kernels import by_type, inlined, kernel
from walkerlab.mechanics.impact import heel_strike, knee_strike, knee_strike_along
from walkerlab.mechanics.standing import (
    STANCE,
    SWING,
    Mode,
    NoKnee,
    Standing,
    SwingKnee,
    Variation,
    feet_on_slope,
    hip_height,
    swing_foot,
    swing_foot_velocity,
)
from walkerlab.mechanics.tuples import put
from walkerlab.solvers.dop853 import Dop853
from walkerlab.solvers.events import FALLING, NO_CROSSING, RISING, CrossingFinder, first_crossing, value_at
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
from walkerlab.solvers.system import State, derivative
from walkerlab.solvers.vectors import load

LONGEST_SWING = 10.0  # pendulum times sqrt(L/g) within which a heel strike must come
HULL_ROOM = 0.125
FALLEN_HIP = 0.5  # hip height over the slope in leg lengths
# event functions, rows of the finder
HEEL_STRIKE, FALL, AHEAD, KNEE = range(4)
EVENTS = 4
# what the step that is being taken leads to
NOTHING, KNEE_STRIKE, FOOT_DOWN = range(3)
WALKED, FELL, BENT_KNEE = int(Outcome.WALKED), int(Outcome.FELL), int(Outcome.BENT_KNEE)
NO_HEEL_STRIKE, REJECTED = int(Outcome.NO_HEEL_STRIKE), int(Outcome.REJECTED)
BUDGET_EXHAUSTED, SOLVER_FAILED = int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED)


@by_type
def is_bent(knee: Any) -> bool:
    """Whether a swing begins with a knee that is free."""


@by_type
def knee_angle(knee: Any, y: State, first: int) -> float:
    """Angle of the swing shank beyond its thigh from y[first] on, negative while flexed (rad); or its rate."""


@is_bent.case(NoKnee)
def never_bent(knee: NoKnee) -> bool:
    """No."""
    return False


@knee_angle.case(NoKnee)
def always_straight(knee: NoKnee, y: State, first: int) -> float:
    """In line."""
    return 0.0


@is_bent.case(SwingKnee)
def bent_at_first(knee: SwingKnee) -> bool:
    """Yes: the other foot's strike has released it."""
    return True


@knee_angle.case(SwingKnee)
def angle_of_knee(knee: SwingKnee, y: State, first: int) -> float:
    """Shank less thigh."""
    return y[first + knee.shank] - y[first + knee.thigh]


@by_type
def mode_of(system: Any) -> Mode:
    """The mode that a system integrates."""


@by_type
def straightened(system: Any) -> Any:
    """The system with the swing leg straight."""


@by_type
def with_knee_struck(system: Any, y: State) -> State:
    """The system's state after the knee strike that y (its own length) leads to."""


@mode_of.case(Mode)
def itself(system: Mode) -> Mode:
    """The system is the mode."""
    return system


@straightened.case(Mode)
def straight_mode(system: Mode) -> Mode:
    """With the links of a straight leg."""
    return Mode(system.model, system.model.straight)


@with_knee_struck.case(Mode)
def struck(system: Mode, y: State) -> State:
    """The impact."""
    return knee_strike(system.model, y)


@mode_of.case(Variation)
def varied(system: Variation) -> Mode:
    """The mode that varies."""
    return system.mode


@straightened.case(Variation)
def straight_variation(system: Variation) -> Variation:
    """Of the straight mode."""
    return Variation(Mode(system.mode.model, system.mode.model.straight), system.blank)


@with_knee_struck.case(Variation)
def struck_with_columns(system: Variation, y: State) -> State:
    """The impact, and its derivative with the shift of its own time (saltation): J (Phi + f wait) - f+ wait."""
    model = system.mode.model
    size = len(model.blank)
    before = head(model.blank, y, 0)
    after = knee_strike(model, before)
    f = derivative(system.mode, 0.0, before)
    f_after = derivative(Mode(model, model.straight), 0.0, after)
    rate = knee_angle(model.knee, f, 0)
    for i in range(size):
        y = put(y, i, after[i])
    for at in range(size, len(y), size):
        column = head(model.blank, y, at)
        wait = -knee_angle(model.knee, column, 0) / rate
        for i in range(size):
            column = put(column, i, column[i] + wait * f[i])
        column = knee_strike_along(model, before, after, column)
        for i in range(size):
            y = put(y, at + i, column[i] - wait * f_after[i])
    return y


@inlined
def head(like: State, y: State, first: int) -> State:
    """The numbers of y from `first` on, as many as `like` has."""
    for i in range(len(like)):
        like = put(like, i, y[first + i])
    return like


@inlined
def hip_above_fall(model: Standing, y: State) -> float:
    """Height of the hip over the slope less what counts as fallen (m)."""
    return hip_height(model, y) - FALLEN_HIP * model.leg_length


@inlined
def may_end(model: Standing, method: Any, y: State, bent: bool) -> bool:
    """Whether the last step, which led to y, may hold an event: false through most of a swing.

    A heel strike needs the swing leg ahead of the stance leg and its foot to come down onto the slope; a knee strike
    needs the knee to stretch. The event functions' values and rates at the step's ends are known.
    """
    if hip_above_fall(model, y) < 0.0:
        return True
    old, h = head(model.blank, method.y_old, 0), method.clock[T] - method.clock[T_OLD]
    n = len(model.tree.arm_x)
    if bent:
        start, end = knee_angle(model.knee, old, 0), knee_angle(model.knee, y, 0)
        if hull(start, h * knee_angle(model.knee, old, n), end, h * knee_angle(model.knee, y, n))[1] >= 0.0:
            return True
    before, before_rate = foot_function(model, old, bent)
    now, now_rate = foot_function(model, y, bent)
    ahead = hull(before[1], h * before_rate[1], now[1], h * now_rate[1])
    return ahead[1] > 0.0 and hull(before[0], h * before_rate[0], now[0], h * now_rate[0])[0] <= 0.0


@inlined
def foot_function(model: Standing, y: State, bent: bool) -> tuple[tuple[float, float], tuple[float, float]]:
    """What tells that the swing foot comes down (falls through zero) and that it is ahead (positive), and their rates.

    Of a straight leg both are linear in the angles; scuffing near mid-swing is no zero of theirs. A bent leg has its
    foot's height and place.
    """
    n = len(model.tree.arm_x)
    if bent:
        return swing_foot(model, y), swing_foot_velocity(model, y)
    down = feet_on_slope(model, y), y[SWING] - y[STANCE]
    return down, (y[n + SWING] + y[n + STANCE], y[n + SWING] - y[n + STANCE])


@inlined
def hull(start: float, start_rate: float, end: float, end_rate: float) -> tuple[float, float]:
    """Bounds of an event function within a step, from its values and rates per step at the ends.

    Those of the Bernstein coefficients of Hermite's cubic, an eighth of their spread further apart: what the cubic
    leaves out is far less.
    """
    second, third = start + start_rate / 3.0, end - end_rate / 3.0
    least, most = min(start, second, third, end), max(start, second, third, end)
    room = HULL_ROOM * (most - least)
    return least - room, most + room


@inlined
def sample_events(model: Standing, y: State, bent: bool, node: int, finder: CrossingFinder) -> None:
    """Values of the event functions at one node of a step, where the state is y."""
    foot, _ = foot_function(model, y, bent)
    finder.values[HEEL_STRIKE, node], finder.values[AHEAD, node] = foot
    finder.values[FALL, node] = hip_above_fall(model, y)
    finder.values[KNEE, node] = knee_angle(model.knee, y, 0)


@inlined
def events_in_step(finder: CrossingFinder, at_start: bool, bent: bool) -> tuple[float, float, float]:
    """Fractions of a sampled step at which the swing foot comes down ahead, the walker falls, and the knee strikes."""
    strike = first_crossing(finder, HEEL_STRIKE, FALLING, 0.0, at_start)
    while strike <= 1.0 and value_at(finder, AHEAD, strike) <= 0.0:
        strike = first_crossing(finder, HEEL_STRIKE, FALLING, strike + 1e-12, at_start)
    knee = first_crossing(finder, KNEE, RISING, 0.0, at_start) if bent else NO_CROSSING
    return strike, first_crossing(finder, FALL, FALLING, 0.0, False), knee


@by_type
def scan_swing(
    method: Any, system: Any, model: Standing, finder: CrossingFinder, at_start: bool, bent: bool
) -> tuple[float, float, float]:
    """`events_in_step` of the last step of a method; its dense output is ready."""


@scan_swing.case(Dop853)
@scan_swing.case(Radau5)
def scan_compiled(
    method: Any, system: Any, model: Standing, finder: CrossingFinder, at_start: bool, bent: bool
) -> tuple[float, float, float]:
    """Compiled with the walk."""
    for node in range(finder.nodes.size):
        sample_events(model, interpolate(method, system, finder.nodes[node]), bent, node, finder)
    return events_in_step(finder, at_start, bent)


@kernel
def scan_states(
    model: Standing, states: Any, finder: CrossingFinder, at_start: bool, bent: bool
) -> tuple[float, float, float]:
    """`events_in_step` of a step whose states at the nodes are the rows of `states`."""
    for node in range(finder.nodes.size):
        sample_events(model, load(states, node, model.blank), bent, node, finder)
    return events_in_step(finder, at_start, bent)


@scan_swing.case(ScipyMethod)
def scan_scipy(
    method: ScipyMethod, system: Any, model: Standing, finder: CrossingFinder, at_start: bool, bent: bool
) -> tuple[float, float, float]:
    """A walk in Python hands the step's states to compiled code at once."""
    strike, fall, knee = scan_states(model, method.states_at(finder.nodes), finder, at_start, bent)
    return strike, fall, knee


@inlined
def swing(
    method: Any,
    system: Any,
    model: Standing,
    finder: CrossingFinder,
    observer: Any,
    t: float,
    y0: State,
    step: int,
    knee_time: Any,
) -> int:
    """Integrate one swing phase up to and including the instant before its heel strike.

    The first numbers of the system's state are the walker's. The time of the knee strike (s) goes into knee_time[step].
    On WALKED the method stands at the heel strike.
    """
    limit = t + LONGEST_SWING * math.sqrt(model.leg_length / model.gravity)
    latest = limit
    begin(method, system, t, y0, method.clock[H_NEXT])
    bent, at_start, coming = is_bent(model.knee), True, NOTHING
    observe_start(observer, mode_of(system), head(model.blank, y0, 0))
    while method.clock[T] < limit:
        status = advance(method, system, limit)
        if status != STEP_DONE:
            return BUDGET_EXHAUSTED if status == OUT_OF_BUDGET else SOLVER_FAILED
        if coming == FOOT_DOWN or (coming == KNEE_STRIKE and method.clock[T] < limit):
            continue
        if coming == KNEE_STRIKE:
            t, y = on_event(method, system, KNEE)
            knee_time[step] = t
            y, system = with_knee_struck(system, y), straightened(system)
            begin(method, system, t, y, method.clock[H_NEXT])
            observe_start(observer, mode_of(system), head(model.blank, y, 0))
            bent, coming, limit = False, NOTHING, latest
            continue
        near = may_end(model, method, end_state(method, system), bent)
        if near or wants_dense(observer):
            prepare_dense(method, system)
        strike, fall, knee = NO_CROSSING, NO_CROSSING, NO_CROSSING
        if near:
            strike, fall, knee = scan_swing(method, system, model, finder, at_start, bent)
        observe(observer, method, mode_of(system), system, min(1.0, strike, fall, knee), step)
        if fall < min(strike, knee):
            return FELL
        if bent and strike < knee:
            return BENT_KNEE
        if min(strike, knee) <= 1.0:
            coming = KNEE_STRIKE if knee < strike else FOOT_DOWN
            limit = method.clock[T_OLD] + min(strike, knee) * (method.clock[T] - method.clock[T_OLD])
            rewind(method, system)
        at_start = False
    return WALKED if coming == FOOT_DOWN else NO_HEEL_STRIKE


@kernel
def walk(
    model: Standing,
    method: Any,
    finder: CrossingFinder,
    observer: Any,
    start: State,
    strikes: Any,
    before: Any,
    after: Any,
    knee_time: Any,
) -> tuple[int, int]:
    """Walk until `strikes` is full or the walk ends.

    start      state at time 0
    strikes    (steps,) times of the heel strikes, s; written
    before     (steps, 2 n) states just before them; written
    after      (steps, 2 n) states just after them, roles changed; written
    knee_time  (steps,) times of the knee strikes, s; written if there are knees

    Returns the outcome's number and how many steps were taken.
    """
    t, y = 0.0, start
    for step in range(strikes.size):
        swinging = Mode(model, model.bent)
        status = swing(method, swinging, model, finder, observer, t, y, step, knee_time)
        if status != WALKED:
            return status, step
        t, y = on_event(method, Mode(model, model.straight), HEEL_STRIKE)
        strikes[step] = t
        new = heel_strike(model, y)
        for i in range(len(new)):
            before[step, i] = y[i]
            after[step, i] = new[i]
        y = new
    return WALKED, strikes.size


@inlined
def on_event(method: Any, system: Any, event: int) -> tuple[float, State]:
    """Newton's last correction of an event's time (s) and of the state there: heel strike and knee are linear in it."""
    t, y = method.clock[T], end_state(method, system)
    mode = mode_of(system)
    f = derivative(mode, t, y)
    n = len(mode.model.tree.arm_x)
    if event == KNEE:
        value, rate = knee_angle(mode.model.knee, y, 0), knee_angle(mode.model.knee, y, n)
    else:
        value, rate = feet_on_slope(mode.model, y), y[n + SWING] + y[n + STANCE]
    wait = -value / rate if rate != 0.0 else 0.0
    for i in range(2 * n):
        y = put(y, i, y[i] + wait * f[i])
    return t + wait, y
