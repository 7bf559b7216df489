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
    swing_foot_motion,
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
RELEASED = 1e-6  # of the first step; a knee in line and at its thigh's rate crosses by rounding within 1e-9 of it
# event functions, rows of the finder
HEEL_STRIKE, FALL, AHEAD, KNEE = range(4)
EVENTS = 4
KNEE_STRUCK = -1  # how a phase of a swing ends beside the outcomes
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
def may_end(model: Standing, method: Any, y: State, knee: Any, at_start: bool) -> bool:
    """Whether the last step, which led to y, may hold an event: false through most of a swing.

    A heel strike needs the swing leg ahead of the stance leg and its foot to come down onto the slope; a knee strike
    needs the knee to stretch. The event functions' values and rates at the step's ends are known.
    """
    if hip_above_fall(model, y) < 0.0:
        return True
    old, h = head(model.blank, method.y_old, 0), method.clock[T] - method.clock[T_OLD]
    n = len(model.tree.arm_x)
    if is_bent(knee):
        start, end = knee_angle(knee, old, 0), knee_angle(knee, y, 0)
        start_rate, end_rate = h * knee_angle(knee, old, n), h * knee_angle(knee, y, n)
        if hull(start, start_rate, end, end_rate, at_start)[1] >= 0.0:
            return True
    before, before_rate = foot_function(knee, model, old)
    now, now_rate = foot_function(knee, model, y)
    ahead = hull(before[1], h * before_rate[1], now[1], h * now_rate[1])
    return ahead[1] > 0.0 and hull(before[0], h * before_rate[0], now[0], h * now_rate[0])[0] <= 0.0


@by_type
def foot_function(knee: Any, model: Standing, y: State) -> tuple[tuple[float, float], tuple[float, float]]:
    """What falls through zero as the swing foot comes down, what is positive with it ahead, and their rates."""


@foot_function.case(NoKnee)
def foot_of_straight_leg(knee: NoKnee, model: Standing, y: State) -> tuple[tuple[float, float], tuple[float, float]]:
    """Both linear in the angles; scuffing near mid-swing is no zero of theirs."""
    n = len(model.tree.arm_x)
    down = feet_on_slope(model, y), y[SWING] - y[STANCE]
    return down, (y[n + SWING] + y[n + STANCE], y[n + SWING] - y[n + STANCE])


@foot_function.case(SwingKnee)
def foot_of_bent_leg(knee: SwingKnee, model: Standing, y: State) -> tuple[tuple[float, float], tuple[float, float]]:
    """Its foot's height and place."""
    return swing_foot_motion(model, y)


@inlined
def hull(
    start: float, start_rate: float, end: float, end_rate: float, zero_at_start: bool = False
) -> tuple[float, float]:
    """Bounds of an event function within a step, from its values and rates per step at the ends.

    Those of the Bernstein coefficients of Hermite's cubic, an eighth of their spread further apart: what the cubic
    leaves out is far less. Without the first one they tell of what a zero at the start leaves when divided out.
    """
    second, third = start + start_rate / 3.0, end - end_rate / 3.0
    first = second if zero_at_start else start
    least, most = min(first, second, third, end), max(first, second, third, end)
    room = HULL_ROOM * (most - least)
    return least - room, most + room


@inlined
def sample_events(knee: Any, model: Standing, y: State, node: int, finder: CrossingFinder) -> None:
    """Values of the event functions at one node of a step, where the state is y."""
    foot, _ = foot_function(knee, model, y)
    finder.values[HEEL_STRIKE, node], finder.values[AHEAD, node] = foot
    finder.values[FALL, node] = hip_above_fall(model, y)
    if is_bent(knee):
        finder.values[KNEE, node] = knee_angle(knee, y, 0)


@inlined
def events_in_step(knee: Any, finder: CrossingFinder, at_start: bool) -> tuple[float, float, float]:
    """Fractions of a sampled step at which the swing foot comes down ahead, the walker falls, and the knee strikes."""
    strike = first_crossing(finder, HEEL_STRIKE, FALLING, 0.0, at_start)
    while strike <= 1.0 and value_at(finder, AHEAD, strike) <= 0.0:
        strike = first_crossing(finder, HEEL_STRIKE, FALLING, strike + 1e-12, at_start)
    fall, struck = first_crossing(finder, FALL, FALLING, 0.0, False), NO_CROSSING
    if is_bent(knee):
        struck = first_crossing(finder, KNEE, RISING, RELEASED if at_start else 0.0, at_start)
    return strike, fall, struck


@by_type
def scan_swing(
    method: Any, system: Any, knee: Any, model: Standing, finder: CrossingFinder, at_start: bool
) -> tuple[float, float, float]:
    """`events_in_step` of the last step of a method; its dense output is ready."""


@scan_swing.case(Dop853)
@scan_swing.case(Radau5)
def scan_compiled(
    method: Any, system: Any, knee: Any, model: Standing, finder: CrossingFinder, at_start: bool
) -> tuple[float, float, float]:
    """Compiled with the walk."""
    for node in range(finder.nodes.size):
        sample_events(knee, model, interpolate(method, system, finder.nodes[node]), node, finder)
    return events_in_step(knee, finder, at_start)


@kernel
def scan_states(
    knee: Any, model: Standing, states: Any, finder: CrossingFinder, at_start: bool
) -> tuple[float, float, float]:
    """`events_in_step` of a step whose states at the nodes are the rows of `states`."""
    for node in range(finder.nodes.size):
        sample_events(knee, model, load(states, node, model.blank), node, finder)
    return events_in_step(knee, finder, at_start)


@scan_swing.case(ScipyMethod)
def scan_scipy(
    method: ScipyMethod, system: Any, knee: Any, model: Standing, finder: CrossingFinder, at_start: bool
) -> tuple[float, float, float]:
    """A walk in Python hands the step's states to compiled code at once."""
    strike, fall, struck = scan_states(knee, model, method.states_at(finder.nodes), finder, at_start)
    return strike, fall, struck


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
    latest = t + LONGEST_SWING * math.sqrt(model.leg_length / model.gravity)
    return swing_of(model.knee, method, system, model, finder, observer, t, y0, latest, step, knee_time)


@by_type
def swing_of(
    knee: Any,
    method: Any,
    system: Any,
    model: Standing,
    finder: CrossingFinder,
    observer: Any,
    t: float,
    y0: State,
    latest: float,
    step: int,
    knee_time: Any,
) -> int:
    """`swing` of a leg with this knee, over at the time `latest` (s) if not before."""


@swing_of.case(NoKnee)
def swing_straight(
    knee: NoKnee,
    method: Any,
    system: Any,
    model: Standing,
    finder: CrossingFinder,
    observer: Any,
    t: float,
    y0: State,
    latest: float,
    step: int,
    knee_time: Any,
) -> int:
    """One phase."""
    return swing_phase(method, system, knee, model, finder, observer, t, y0, latest, step, True)


@swing_of.case(SwingKnee)
def swing_bent_first(
    knee: SwingKnee,
    method: Any,
    system: Any,
    model: Standing,
    finder: CrossingFinder,
    observer: Any,
    t: float,
    y0: State,
    latest: float,
    step: int,
    knee_time: Any,
) -> int:
    """Bent until the knee strikes, then straight."""
    status = swing_phase(method, system, knee, model, finder, observer, t, y0, latest, step, True)
    if status != KNEE_STRUCK:
        return status
    t, y = on_event(method, system, KNEE)
    knee_time[step] = t
    y = with_knee_struck(system, y)
    return swing_phase(method, straightened(system), NoKnee(), model, finder, observer, t, y, latest, step, False)


@inlined
def swing_phase(
    method: Any,
    system: Any,
    knee: Any,
    model: Standing,
    finder: CrossingFinder,
    observer: Any,
    t: float,
    y0: State,
    latest: float,
    step: int,
    at_start: bool,
) -> int:
    """Integrate up to the strike that ends a phase: of the knee that is free in it, or else of the heel.

    at_start  the foot on the slope, and the knee in line, are the strike before: none of this phase
    """
    limit, coming = latest, False
    begin(method, system, t, y0, method.clock[H_NEXT])
    observe_start(observer, mode_of(system), head(model.blank, y0, 0))
    while method.clock[T] < limit:
        status = advance(method, system, limit)
        if status != STEP_DONE:
            return BUDGET_EXHAUSTED if status == OUT_OF_BUDGET else SOLVER_FAILED
        if coming:
            continue
        near = may_end(model, method, end_state(method, system), knee, at_start)
        if near or wants_dense(observer):
            prepare_dense(method, system)
        strike, fall, struck = NO_CROSSING, NO_CROSSING, NO_CROSSING
        if near:
            strike, fall, struck = scan_swing(method, system, knee, model, finder, at_start)
        observe(observer, method, mode_of(system), system, min(1.0, strike, fall, struck), step)
        if fall < min(strike, struck):
            return FELL
        if is_bent(knee) and strike < struck:
            return BENT_KNEE
        if min(strike, struck) <= 1.0:
            coming = True
            limit = method.clock[T_OLD] + min(strike, struck) * (method.clock[T] - method.clock[T_OLD])
            rewind(method, system)
        at_start = False
    if not coming:
        return NO_HEEL_STRIKE
    return KNEE_STRUCK if is_bent(knee) else WALKED


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
