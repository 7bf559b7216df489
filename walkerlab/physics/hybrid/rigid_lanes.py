"""Walks of the rigid model in parallel lanes, each with its own step size. A lane whose walk ends takes the next start.

All lanes take a solver step of a Runge-Kutta method together. A lane whose solver step may contain a heel strike or a
fall is then handled alone: the event is located on the quintic Hermite interpolant of its event function, the solver
step is repeated up to the event, and a last Newton correction completes it. The result of a walk does not depend on the
walks in other lanes.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.hybrid import endings
from walkerlab.physics.hybrid.rigid_walk import LONGEST_SWING, hip_above_fall, hull
from walkerlab.physics.kernels import dispatch_by_type, kernel, kernel_part, vector
from walkerlab.physics.mechanics.hinges import HIP_ROW, SpringDamper, hinge_law, hinge_torque
from walkerlab.physics.mechanics.impact import strike
from walkerlab.physics.mechanics.rigid_model import AT_STRIKE, RigidModel, feet_on_slope
from walkerlab.physics.mechanics.trigonometry import sine_cosine
from walkerlab.physics.solvers import dop853, events, lanes
from walkerlab.physics.solvers.events import NO_CROSSING, CrossingFinder, Jet, Quintic
from walkerlab.physics.solvers.lanes import Lanes
from walkerlab.physics.solvers.system import State

# rows of a batch's memory, with one value per lane
START_STATE, START_RATE, END_STATE, END_RATE = 0, 4, 8, 12  # state and derivative at both ends of the last attempt
# s: next solver step, last attempted solver step, time, time left for a heel strike
NEXT_STEP, TRIED_STEP, LANE_TIME, TIME_LEFT = range(16, 20)
ARRIVALS, FIRST_TRY, TRIES, HAS_EVENT, STEP_BEFORE = range(20, 25)
LANE_ROWS = 25
SLOT_OF_START, STEPS_TAKEN = 0, 1  # rows of `LaneMemory.slots`

NOBODY = -1
FIRST_LANE_STEP = 0.1  # pendulum times
# pendulum times; a heel strike closer than this is reached by a Taylor expansion instead of a solver step
ARRIVAL_TIME = 1e-5
STRIKE_REFINEMENTS = 6
MAX_TRIES = 20_000  # attempted solver steps in one swing
MIN_LANE_STEP = 1e-13  # pendulum times
TINY_ERROR = 1e-300


class TwoLegs(NamedTuple):
    """Rigid model of two straight legs, with the values that lanes need."""

    model: RigidModel
    A: tuple[float, ...]  # (4,) constants of rigid_model.py, row by row
    B: tuple[float, ...]
    arm_x: tuple[float, ...]  # (2,)
    arm_y: tuple[float, ...]
    hip: SpringDamper
    # kg m^2. `unpaired` to `lean` are copies of the model's values, which save loading them in loops.
    unpaired: float
    mass: float  # kg
    radius: float  # m
    gravity_along: float  # m/s^2
    gravity_down: float
    slope: float  # rad
    lean: float  # rad
    # rad, angle between the stance leg and the slope's normal at which the hip is above the centre of the stance foot
    upright: float
    fallen: float  # rad, largest angle from `upright` at which the hip is high enough
    pendulum_time: float  # s


def two_legs(model: RigidModel) -> TwoLegs | None:
    """Convert a model of two equal straight legs with a linear hip for use in lanes. Any other model gives None."""
    hip = hinge_law(model, HIP_ROW)
    # Laws of extensions are written for floats and may not work for lanes.
    if len(model.arm_x) != 2 or model.kneed or model.legs_differ or type(hip) is not SpringDamper:
        return None
    x, y = model.hip_x, model.hip_y
    lowest = (endings.FALLEN_HIP * model.leg_length - model.radius) / math.hypot(x, y)

    values: dict[str, Any] = {name: tuple(model[name].ravel().tolist()) for name in ("A", "B", "arm_x", "arm_y")}
    for name in ("unpaired", "mass", "radius", "gravity_along", "gravity_down", "slope", "lean"):
        values[name] = float(model[name])
    return TwoLegs(
        model,
        **values,
        hip=hip,
        upright=math.atan2(x, y),
        # With large feet `lowest` may be below -1: the hip cannot get that low.
        fallen=math.acos(max(-1.0, lowest)),
        pendulum_time=math.sqrt(model.leg_length / model.gravity),
    )


@lanes.derivative.case(TwoLegs, forced_inline=True)
def swing_derivative(system: TwoLegs, t: float, y: Any) -> Any:
    """Evaluate the equations of motion of rigid_model.py, written out for two bodies. Values are floats or lanes."""
    R = system.radius
    along = system.gravity_along
    down = system.gravity_down
    s_1, c_1 = sine_cosine(y[0] + system.slope)
    s_2, c_2 = sine_cosine(y[1] + system.slope)
    F_1 = c_1 * system.arm_x[0] - s_1 * system.arm_y[0]
    U_1 = s_1 * system.arm_x[0] + c_1 * system.arm_y[0]
    F_2 = c_2 * system.arm_x[1] - s_2 * system.arm_y[1]
    U_2 = s_2 * system.arm_x[1] + c_2 * system.arm_y[1]
    cos_d = c_1 * c_2 + s_1 * s_2
    sin_d = s_1 * c_2 - c_1 * s_2
    squared_1 = y[2] * y[2]
    squared_2 = y[3] * y[3]
    r_1 = -along * U_1 - down * F_1
    r_2 = -along * U_2 - down * F_2
    M_12 = system.A[2] * cos_d + system.B[2] * sin_d
    # Adding lanes of zeros turns A[3] into lanes, because the variable must have one type in both branches below.
    M_22 = system.A[3] + 0.0 * cos_d
    if R != 0.0:
        pulled = system.mass * along + squared_1 * F_1 + squared_2 * F_2
        r_2 = r_2 - R * pulled
        M_12 = M_12 + R * U_1
        M_22 = M_22 + 2.0 * R * U_2 + system.mass * R * R
    turning = system.A[2] * sin_d - system.B[2] * cos_d
    r_2 = r_2 + squared_1 * (turning + system.unpaired * sin_d)
    r_1 = r_1 - squared_2 * turning
    hip = hinge_torque(system.hip, y[0] - y[1], y[2] - y[3]).resistance
    r_1 = r_1 - hip
    r_2 = r_2 + hip
    # M_11 is constant, so the elimination begins with it.
    inverse = 1.0 / system.A[0]
    factor = M_12 * inverse
    alpha_2 = (r_2 - factor * r_1) / (M_22 - factor * M_12)
    return (y[2], y[3], r_1 * inverse - factor * alpha_2, alpha_2)


class LaneMemory(NamedTuple):
    """Workspace of a batch, apart from its starts and results. Its size does not depend on the number of walks."""

    rtol: float
    atol: float
    rows: Any  # (LANE_ROWS, WIDTH)
    slots: Any  # (2, WIDTH) index of each lane's start, and number of steps taken
    finder: CrossingFinder


def new_lane_memory(rtol: float, atol: float) -> LaneMemory:
    lanes.teach_arithmetic()
    rows = np.zeros((LANE_ROWS, lanes.WIDTH))
    slots = np.full((2, lanes.WIDTH), NOBODY, np.int64)
    # A finder of degree 5 fits the quintics.
    return LaneMemory(rtol, atol, rows, slots, events.new_crossing_finder(5))


class Fates(NamedTuple):
    outcome: Any  # (n,) outcome codes
    steps: Any  # (n,) number of steps taken


def new_fates(n: int) -> Fates:
    return Fates(np.zeros(n, np.int64), np.zeros(n, np.int64))


@dispatch_by_type
def record_strike(observer: Any, walk: int, step: int, t: float, y: Any) -> int:
    """Record a heel strike at time t (s), with state y after it, and return GOES_ON or the outcome code."""


@kernel
def walk_lanes(walker: TwoLegs, memory: LaneMemory, observer: Any, starts: Any, fates: Fates) -> None:
    """Walk from each start (n, 4) with both feet on the slope, until the walk ends or the observer ends it."""
    slots = memory.slots
    waiting = 0
    for lane in range(lanes.WIDTH):
        waiting = refill(walker, memory, starts, fates, lane, waiting)
    walking = True
    while walking:
        if try_steps(walker, memory):
            walking = False
            for lane in range(lanes.WIDTH):
                if slots[SLOT_OF_START, lane] == NOBODY:
                    continue
                if memory.rows[HAS_EVENT, lane] > 0.0:
                    outcome = handle_step(walker, memory, observer, lane)
                    if outcome != endings.GOES_ON:
                        fates.outcome[slots[SLOT_OF_START, lane]] = outcome
                        fates.steps[slots[SLOT_OF_START, lane]] = slots[STEPS_TAKEN, lane]
                        waiting = refill(walker, memory, starts, fates, lane, waiting)
                walking = walking or slots[SLOT_OF_START, lane] != NOBODY


@kernel_part
def refill(walker: TwoLegs, memory: LaneMemory, starts: Any, fates: Fates, lane: int, waiting: int) -> int:
    """Give a lane the next valid start, and return the number of starts used so far."""
    while waiting < starts.shape[0]:
        y = (starts[waiting, 0], starts[waiting, 1], starts[waiting, 2], starts[waiting, 3])
        waiting += 1
        if hip_above_fall(walker.model, y) >= 0.0:
            memory.slots[SLOT_OF_START, lane], memory.slots[STEPS_TAKEN, lane] = waiting - 1, 0
            begin_swing(walker, memory, lane, 0.0, y, FIRST_LANE_STEP * walker.pendulum_time)
            return waiting
        fates.outcome[waiting - 1], fates.steps[waiting - 1] = endings.REJECTED, 0
    memory.slots[SLOT_OF_START, lane] = NOBODY
    # An idle lane is computed with the others, so it needs a valid state. Its solver steps have length zero and are
    # ignored.
    begin_swing(walker, memory, lane, 0.0, (0.0, 0.0, 0.0, 0.0), 0.0)
    return waiting


@kernel_part
def begin_swing(walker: TwoLegs, memory: LaneMemory, lane: int, t: float, y: State, h: float) -> None:
    rows = memory.rows
    rate = lanes.derivative(walker, t, y)
    for i in range(4):
        rows[START_STATE + i, lane], rows[START_RATE + i, lane] = y[i], rate[i]
    rows[NEXT_STEP, lane], rows[LANE_TIME, lane] = h, t
    rows[TIME_LEFT, lane] = LONGEST_SWING * walker.pendulum_time
    rows[ARRIVALS, lane], rows[FIRST_TRY, lane], rows[TRIES, lane] = 0.0, 1.0, 0.0


@kernel_part
def load_state(rows: Any, row: int) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    return lanes.load(rows, row), lanes.load(rows, row + 1), lanes.load(rows, row + 2), lanes.load(rows, row + 3)


@kernel_part
def try_steps(walker: TwoLegs, memory: LaneMemory) -> bool:
    """Try a solver step in every lane, accept it where no event is possible, and return whether a lane needs attention.

    A lane needs attention if the solver step may contain an event or ends at one, if time is up, or if there are too
    many solver steps or they become too small.
    """
    rows = memory.rows
    y = load_state(rows, START_STATE)
    k1 = load_state(rows, START_RATE)
    left = lanes.load(rows, TIME_LEFT)
    tries = lanes.load(rows, TRIES) + 1.0
    h = min(lanes.load(rows, NEXT_STEP), left)
    stages, end, end_rate = dop853.run_stages(walker, 0.0, y, k1, h)
    by_order_5 = lanes.combine(dop853.LANE_ERROR_5, stages)
    by_order_3 = lanes.combine(dop853.LANE_ERROR_3, stages)
    error_5, error_3 = dop853.error_sums(memory, y, end, by_order_5, by_order_3)
    # Lanes cannot branch, so TINY_ERROR prevents a division by zero here and below. h is negative where a lane goes
    # back to a heel strike.
    error = abs(h) * error_5 / math.sqrt(4.0 * (error_5 + 0.01 * error_3) + TINY_ERROR)
    change = dop853.SAFETY / math.sqrt(math.sqrt(math.sqrt(error + TINY_ERROR)))
    change = min(dop853.GROW_MOST, max(dop853.SHRINK_MOST, change))
    accepted = 1.0 - error
    # positive if this solver step uses up the remaining time
    over = TINY_ERROR - (left - h)
    stuck = max(tries - MAX_TRIES, MIN_LANE_STEP * walker.pendulum_time - abs(h))
    attention = max(may_end(walker, y, end, h), over, lanes.load(rows, ARRIVALS))
    # A rejected solver step needs no attention: the lane tries a shorter one next.
    event = lanes.choose(stuck, 1.0, lanes.choose(accepted, lanes.choose(attention, 1.0, 0.0), 0.0))
    quiet = lanes.choose(event, 0.0, accepted)
    for i in range(4):
        lanes.store(lanes.choose(quiet, end[i], y[i]), rows, START_STATE + i)
        lanes.store(lanes.choose(quiet, end_rate[i], k1[i]), rows, START_RATE + i)
        lanes.store(end[i], rows, END_STATE + i)
        lanes.store(end_rate[i], rows, END_RATE + i)
    advanced = lanes.choose(quiet, h, 0.0)
    lanes.store(h * change, rows, NEXT_STEP)
    lanes.store(h, rows, TRIED_STEP)
    lanes.store(lanes.load(rows, LANE_TIME) + advanced, rows, LANE_TIME)
    lanes.store(left - advanced, rows, TIME_LEFT)
    lanes.store(lanes.choose(quiet, 0.0, lanes.load(rows, FIRST_TRY)), rows, FIRST_TRY)
    lanes.store(tries, rows, TRIES)
    lanes.store(event, rows, HAS_EVENT)
    return lanes.any_positive(event)


@kernel_part
def may_end(walker: TwoLegs, y: Any, end: Any, h: Lanes) -> Lanes:
    """Compute a value that is positive if a solver step of h (s) from y to `end` may contain a strike or a fall."""
    ahead = hull(y[0] - y[1], h * (y[2] - y[3]), end[0] - end[1], h * (end[2] - end[3]))
    start = feet_on_slope(walker, y[0], y[1])
    stop = feet_on_slope(walker, end[0], end[1])
    guard = hull(start, h * (y[2] + y[3]), stop, h * (end[2] + end[3]))
    return max(min(ahead[1], -guard[0]), abs(end[1] + walker.slope - walker.upright) - walker.fallen)


@kernel_part
def handle_step(walker: TwoLegs, memory: LaneMemory, observer: Any, lane: int) -> int:
    """Handle the solver step of a lane that needs attention.

    Returns GOES_ON, or the outcome code if the lane's walk is over.
    """
    rows = memory.rows
    if rows[TRIES, lane] >= MAX_TRIES:
        return endings.BUDGET_EXHAUSTED
    if abs(rows[TRIED_STEP, lane]) < MIN_LANE_STEP * walker.pendulum_time:
        return endings.SOLVER_FAILED
    if rows[ARRIVALS, lane] > 0.0:
        return arrive(walker, memory, observer, lane)
    strike_at = strike_in_step(walker, memory, lane)
    fall_at = fall_in_step(walker, memory, lane)
    if fall_at < strike_at:
        return endings.FELL
    if strike_at <= 1.0:
        rows[ARRIVALS, lane], rows[STEP_BEFORE, lane] = 1.0, rows[NEXT_STEP, lane]
        # A heel strike right at the start must not look like a solver step that is too small.
        rows[NEXT_STEP, lane] = max(strike_at * rows[TRIED_STEP, lane], 2.0 * MIN_LANE_STEP * walker.pendulum_time)
        return endings.GOES_ON
    if rows[TIME_LEFT, lane] <= rows[TRIED_STEP, lane]:
        return endings.NO_HEEL_STRIKE
    move_on(memory, lane)
    return endings.GOES_ON


@kernel_part
def move_on(memory: LaneMemory, lane: int) -> None:
    rows = memory.rows
    for i in range(4):
        rows[START_STATE + i, lane], rows[START_RATE + i, lane] = rows[END_STATE + i, lane], rows[END_RATE + i, lane]
    rows[LANE_TIME, lane] += rows[TRIED_STEP, lane]
    rows[TIME_LEFT, lane] -= rows[TRIED_STEP, lane]
    rows[FIRST_TRY, lane] = 0.0


@kernel_part
def arrive(walker: TwoLegs, memory: LaneMemory, observer: Any, lane: int) -> int:
    """Apply the heel strike if the solver step has reached it. Otherwise choose the next step so that it ends there."""
    rows = memory.rows
    slots = memory.slots
    move_on(memory, lane)
    rate = rows[START_STATE + 2, lane] + rows[START_STATE + 3, lane]
    guard = feet_on_slope(walker, rows[START_STATE, lane], rows[START_STATE + 1, lane])
    wait = -guard / rate if rate != 0.0 else 0.0
    if abs(wait) > ARRIVAL_TIME * walker.pendulum_time and rows[ARRIVALS, lane] <= STRIKE_REFINEMENTS:
        rows[ARRIVALS, lane] += 1.0
        step_before = abs(rows[STEP_BEFORE, lane])
        # The solver step may have overshot the heel strike. If so, the next step goes backwards.
        rows[NEXT_STEP, lane] = max(-step_before, min(step_before, wait))
        return endings.GOES_ON
    y = vector(walker.model.zero_state)
    new = vector(walker.model.zero_state)
    bridge(rows, lane, wait, y)
    strike(walker.model, walker.model, AT_STRIKE, y, new)
    step = slots[STEPS_TAKEN, lane]
    t = rows[LANE_TIME, lane] + wait
    slots[STEPS_TAKEN, lane] += 1
    outcome = record_strike(observer, slots[SLOT_OF_START, lane], step, t, new)
    if outcome == endings.GOES_ON:
        begin_swing(walker, memory, lane, t, (new[0], new[1], new[2], new[3]), rows[STEP_BEFORE, lane])
    return outcome


@kernel_part
def bridge(rows: Any, lane: int, wait: float, y: Any) -> None:
    """Write the state after a short `wait` (s) into y, by a Taylor expansion of second order in the angles."""
    for i in range(2):
        omega = rows[START_STATE + 2 + i, lane]
        alpha = rows[START_RATE + 2 + i, lane]
        y[i] = rows[START_STATE + i, lane] + wait * (omega + 0.5 * wait * alpha)
        y[2 + i] = omega + wait * alpha


@kernel_part
def event_function(rows: Any, row: int, lane: int, swing: float, stance: float) -> Jet:
    """Compute swing * theta_1 + stance * theta_2 and its first two time derivatives at an end of a solver step."""
    # The derivative follows four rows below the state, so the accelerations are six rows below the angles.
    return (
        swing * rows[row, lane] + stance * rows[row + 1, lane],
        swing * rows[row + 2, lane] + stance * rows[row + 3, lane],
        swing * rows[row + 6, lane] + stance * rows[row + 7, lane],
    )


@kernel_part
def interpolate_step(memory: LaneMemory, lane: int, swing: float, stance: float, constant: float) -> Quintic:
    """Interpolate swing * theta_1 + stance * theta_2 + constant over a lane's solver step with a quintic."""
    rows = memory.rows
    a = event_function(rows, START_STATE, lane, swing, stance)
    b = event_function(rows, END_STATE, lane, swing, stance)
    return events.hermite(rows[TRIED_STEP, lane], (a[0] + constant, a[1], a[2]), (b[0] + constant, b[1], b[2]))


@kernel_part
def strike_in_step(walker: TwoLegs, memory: LaneMemory, lane: int) -> float:
    """Find the fraction of a lane's solver step at which the heel strikes with the swing leg ahead, or NO_CROSSING."""
    guard = interpolate_step(memory, lane, 1.0, 1.0, feet_on_slope(walker, 0.0, 0.0))
    at_start = memory.rows[FIRST_TRY, lane] > 0.0
    strike_at = events.first_fall(memory.finder, guard, at_start, 0.0)
    if strike_at > 1.0:
        return NO_CROSSING
    ahead = interpolate_step(memory, lane, 1.0, -1.0, 0.0)
    # A fall through zero with the swing leg behind is a scuff, which the model ignores.
    while strike_at <= 1.0 and events.evaluate_quintic(ahead, strike_at) <= 0.0:
        strike_at = events.first_fall(memory.finder, guard, at_start, strike_at + 1e-12)
    return strike_at


@kernel_part
def fall_in_step(walker: TwoLegs, memory: LaneMemory, lane: int) -> float:
    """Find the fraction of a lane's solver step at which the hip gets too low.

    Returns NO_CROSSING if the hip is high enough at the end of the step.
    """
    from_upright = walker.slope - walker.upright
    angle = memory.rows[END_STATE + 1, lane] + from_upright
    if abs(angle) <= walker.fallen:
        return NO_CROSSING
    side = 1.0 if angle > 0.0 else -1.0
    height = interpolate_step(memory, lane, 0.0, -side, walker.fallen - side * from_upright)
    return events.first_fall(memory.finder, height, False, 0.0)
