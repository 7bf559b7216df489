"""Walking on compliant ground: integrate to the next event, let it change what the ground does, go on.

Compiled as a whole for the project's own methods; the same source runs in Python with a library's integrator.
"""

from typing import Any, NamedTuple

from walkerlab.gait.contact_observer import ContactObserver, observe, observe_edge
from walkerlab.gait.contact_scan import Feet, Scene, scan
from walkerlab.gait.contact_signals import (
    ALONG,
    FALL,
    HEIGHT,
    LEFT_EDGE,
    PASSING,
    PER_FOOT,
    RIGHT_EDGE,
    Frame,
    feels_ground,
    feet_motion,
    is_join,
    walker_state,
)
from walkerlab.gait.outcome import Outcome
from walkerlab.kernels import by_type, inlined
from walkerlab.physics.contact.motion import OnGround
from walkerlab.physics.contact.pinned import Pinned
from walkerlab.physics.contact.terrain import (
    carried_after_lift,
    carried_in_air,
    carried_in_cell,
    order_matters,
    stride_measure,
)
from walkerlab.physics.contact.walker import ContactWalker, FootMotion
from walkerlab.physics.system import State
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.stepping import (
    H_NEXT,
    OUT_OF_BUDGET,
    STEP_DONE,
    T_OLD,
    T,
    advance,
    begin,
    end_state,
    prepare_dense,
    rewind,
)

LONGEST_STEP = 10.0  # pendulum times within which a step must end
LONGEST_FLIGHT = 0.25  # pendulum times without any foot on the ground
SLIDE = 0.25  # of the stride measure
AHEAD = 0.25  # of the stride measure: how far ahead a step must land
TRIP = 0.25  # of the stride measure: how far from its foothold a foot must come down to have tripped
EVENT_TIME = 1e-12  # s, how exactly an event is located
REFINEMENTS = 4
REWINDS = 24  # of one step; where rounding moves an event with each try, the step's end is the event

WALKED, FELL, OFF_PAD = int(Outcome.WALKED), int(Outcome.FELL), int(Outcome.OFF_PAD)
LIFTED_OFF, SLID, NO_HEEL_STRIKE = int(Outcome.LIFTED_OFF), int(Outcome.SLID), int(Outcome.NO_HEEL_STRIKE)
BUDGET_EXHAUSTED, SOLVER_FAILED = int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED)
GOES_ON = -1

# indices into Ledger.times
LAST_TOUCH, AIRBORNE_SINCE = 0, 1
# indices into Ledger.feet
STANCE, STEPS = 0, 1


class Ledger(NamedTuple):
    """What a walk remembers: read by its rules, and in part its result."""

    touch_time: Any  # (steps,) s
    touch_along: Any  # (steps,) m
    slip: Any  # (steps,) m, net slip of the stance foot of each step
    carried: Any  # (2,) whether there is ground under a foot
    cells: Any  # (2,) which cell of its lane a foot is over
    left_cells: Any  # (2,) the cell where it last stood
    foothold: Any  # (2,) m, where it touched
    at_zero: Any  # (signals,) which signals the last event left at zero
    times: Any  # (2,) see the indices above
    feet: Any  # (2,) see the indices above


@by_type
def in_mode(system: Any, ledger: Ledger) -> Any:
    """The system for the ground that there is now."""


@in_mode.case(OnGround)
def free_mode(system: OnGround, ledger: Ledger) -> OnGround:
    """Each foot finds ground or not."""
    return OnGround(system.walker, (ledger.carried[0] != 0, ledger.carried[1] != 0))


@in_mode.case(Pinned)
def hinged_mode(system: Pinned, ledger: Ledger) -> Pinned:
    """The hinge does not ask."""
    return system


@by_type
def is_hinged(system: Any) -> bool:
    """Whether a hinge carries the walker, until its first step releases it."""


@is_hinged.case(OnGround)
def free_is_not(system: OnGround) -> bool:
    """No."""
    return False


@is_hinged.case(Pinned)
def pinned_is(system: Pinned) -> bool:
    """Yes."""
    return True


@inlined
def walk_part(
    system: Any,
    walker: ContactWalker,
    terrain: Any,
    frame: Frame,
    method: Any,
    finder: CrossingFinder,
    observer: ContactObserver,
    ledger: Ledger,
    t: float,
    y: State,
    stop_passing_after: int,
) -> int:
    """Walk from state y at time t (s) until the ledger is full, the hinge is released, or the walk ends.

    With `stop_passing_after` at least zero it also stops when, after that many steps, the feet pass each other.

    Returns the outcome's number; the method stands at the end.
    """
    mode = in_mode(system, ledger)
    begin(method, mode, t, y, method.clock[H_NEXT])
    arriving, refinements, rewinds, signal = False, 0, 0, -1
    target = deadline(frame, ledger)
    latest = target  # the end of the step in which an event was found: it is not sought beyond
    scene = Scene(walker, terrain, frame, order_matters(terrain) or stop_passing_after >= 0)
    feet = Feet(ledger.carried, ledger.cells, ledger.at_zero)
    while ledger.feet[STEPS] < ledger.touch_time.size:
        status = advance(method, mode, target)
        if status != STEP_DONE:
            return BUDGET_EXHAUSTED if status == OUT_OF_BUDGET else SOLVER_FAILED
        prepare_dense(method, mode)
        fraction, found = scan(method, mode, scene, feet, finder)
        if arriving and method.clock[T] < target:
            arriving = False
        if not arriving:
            signal = found
            if fraction <= 1.0:
                wait = fraction * (method.clock[T] - method.clock[T_OLD])
                latest = method.clock[T]
                target = method.clock[T_OLD] + max(wait, EVENT_TIME)
                arriving, refinements = True, 0
                if target < method.clock[T] and rewinds < REWINDS:
                    rewinds += 1
                    rewind(method, mode)
                    continue
        elif refinements < REFINEMENTS and rewinds < REWINDS:
            wait = time_to_zero(method, finder, signal)
            if abs(wait) > EVENT_TIME and method.clock[T_OLD] < target + wait <= latest:
                target += wait
                refinements += 1
                rewinds += 1
                rewind(method, mode)
                continue
        rewinds = 0
        observe(observer, method, mode, walker, ledger.carried, ledger.feet[STANCE])
        outcome = judge(mode, scene, method, finder, ledger)
        if outcome != GOES_ON:
            return outcome
        if method.clock[T] - method.clock[T_OLD] > 2.0 * EVENT_TIME:
            # of events at one and the same time each is found once
            for i in range(ledger.at_zero.size):
                ledger.at_zero[i] = 0
        if arriving:
            end = walker_state(mode, end_state(method, mode))
            steps = ledger.feet[STEPS]
            outcome = happen(walker, terrain, observer, ledger, signal, method.clock[T], end)
            if outcome != GOES_ON:
                return outcome
            released = is_hinged(system) and ledger.feet[STEPS] > steps
            if released or (signal == PASSING and 0 <= stop_passing_after <= ledger.feet[STEPS]):
                return WALKED
            if not is_join(signal):
                mode = in_mode(system, ledger)
                begin(method, mode, method.clock[T], end_state(method, mode), method.clock[H_NEXT])
            arriving = False
        target = deadline(frame, ledger)
    return WALKED


@inlined
def deadline(frame: Frame, ledger: Ledger) -> float:
    """When the walk ends if nothing happens before: too long a step, or too long a flight (s)."""
    by_step = ledger.times[LAST_TOUCH] + LONGEST_STEP * frame.pendulum_time
    by_flight = ledger.times[AIRBORNE_SINCE] + LONGEST_FLIGHT * frame.pendulum_time
    return min(by_step, by_flight)


@inlined
def time_to_zero(method: Any, finder: CrossingFinder, signal: int) -> float:
    """How much later than the end of the last step a signal is zero (s), by its slope there."""
    last = finder.nodes.size - 1
    h = method.clock[T] - method.clock[T_OLD]
    change = finder.values[signal, last] - finder.values[signal, last - 1]
    span = (finder.nodes[last] - finder.nodes[last - 1]) * h
    if change == 0.0:
        return 0.0
    wait = -finder.values[signal, last] * span / change
    return max(-0.5 * h, min(0.5 * h, wait))


@inlined
def judge(mode: Any, scene: Scene, method: Any, finder: CrossingFinder, ledger: Ledger) -> int:
    """End the walk if it has flown, slid or taken too long; note when a foot was last on the ground.

    The signals of the last step are sampled; their last node is its end.
    """
    t, end = method.clock[T], finder.nodes.size - 1
    pendulum_time = scene.frame.pendulum_time
    grounded = is_hinged(mode)
    for foot in range(2):
        height = finder.values[foot * PER_FOOT + HEIGHT, end]
        grounded = grounded or feels_ground(mode, ledger.carried[foot] != 0, height)
    if grounded:
        ledger.times[AIRBORNE_SINCE] = t
    stance = ledger.feet[STANCE]
    height = finder.values[stance * PER_FOOT + HEIGHT, end]
    slide = abs(finder.values[stance * PER_FOOT + ALONG, end] - ledger.foothold[stance])
    loaded = feels_ground(mode, ledger.carried[stance] != 0, height)
    if loaded and slide > SLIDE * stride_measure(scene.terrain):
        return SLID
    if t >= ledger.times[LAST_TOUCH] + LONGEST_STEP * pendulum_time:
        return NO_HEEL_STRIKE
    if t >= ledger.times[AIRBORNE_SINCE] + LONGEST_FLIGHT * pendulum_time:
        return LIFTED_OFF
    return GOES_ON


@inlined
def happen(
    walker: ContactWalker, terrain: Any, observer: ContactObserver, ledger: Ledger, signal: int, t: float, y: State
) -> int:
    """Let an event change the ledger; returns an outcome if it ends the walk."""
    if signal == FALL:
        return FELL
    feet = feet_motion(walker, y)
    ledger.at_zero[signal] = 1
    if signal == PASSING:
        for foot in range(2):
            pass_by(terrain, ledger, feet, foot)
        return GOES_ON
    foot = signal // PER_FOOT
    kind = signal % PER_FOOT
    if kind == HEIGHT:
        if feet[foot].climb < 0.0:
            return touch(terrain, ledger, feet, foot, t)
        lift(terrain, ledger, feet, foot)
    elif kind == LEFT_EDGE or kind == RIGHT_EDGE:
        ledger.at_zero[signal] = 0
        ledger.at_zero[foot * PER_FOOT + (LEFT_EDGE if kind == RIGHT_EDGE else RIGHT_EDGE)] = 1
        ledger.cells[foot] += 1 if kind == RIGHT_EDGE else -1
        if not carried_in_cell(terrain, ledger.cells[foot]):
            observe_edge(observer, walker, foot, ledger.carried[foot] != 0, y)
            ledger.carried[foot] = 0
        elif feet[foot].height < 0.0:
            return OFF_PAD
        else:
            ledger.carried[foot] = 1
    return GOES_ON


@inlined
def is_ahead(feet: tuple[FootMotion, FootMotion], foot: int) -> bool:
    """Whether a foot is further along than the other."""
    return feet[foot].along > feet[1 - foot].along


@inlined
def pass_by(terrain: Any, ledger: Ledger, feet: tuple[FootMotion, FootMotion], foot: int) -> None:
    """The feet changed places: one that is in the air may find ground, or lose it."""
    if feet[foot].height > 0.0:
        carried = carried_in_air(terrain, ledger.carried[foot] != 0, is_ahead(feet, foot))
        ledger.carried[foot] = 1 if carried else 0


@inlined
def lift(terrain: Any, ledger: Ledger, feet: tuple[FootMotion, FootMotion], foot: int) -> None:
    """A foot rose above the ground: from its stance, or out of a scuff."""
    if ledger.carried[foot] != 0:
        ahead = is_ahead(feet, foot)
        ledger.carried[foot] = 1 if carried_after_lift(terrain, True, ahead) else 0
        if foot != ledger.feet[STANCE] and ledger.cells[foot] == ledger.left_cells[foot] and not ahead:
            step = ledger.feet[STEPS] - 1
            if step >= 0:
                ledger.slip[step] = feet[foot].along - ledger.foothold[foot]
    else:
        carried = carried_in_air(terrain, False, is_ahead(feet, foot))
        ledger.carried[foot] = 1 if carried else 0


@inlined
def touch(terrain: Any, ledger: Ledger, feet: tuple[FootMotion, FootMotion], foot: int, t: float) -> int:
    """A foot came down on ground.

    It ends the step if it is the swing foot, on another pad than it left and far enough ahead. A swing foot that comes
    down on the pad it left, away from where it stood, has tripped over it: it scuffs.
    """
    stance = ledger.feet[STANCE]
    if ledger.carried[foot] == 0 or foot == stance:
        return GOES_ON
    measure = stride_measure(terrain)
    if not order_matters(terrain) and ledger.cells[foot] == ledger.left_cells[foot]:
        return OFF_PAD if abs(feet[foot].along - ledger.foothold[foot]) > TRIP * measure else GOES_ON
    if feet[foot].along - feet[stance].along < AHEAD * measure:
        return GOES_ON
    step = ledger.feet[STEPS]
    ledger.touch_time[step] = t
    ledger.touch_along[step] = feet[foot].along
    ledger.slip[step] = feet[stance].along - ledger.foothold[stance]
    ledger.foothold[foot] = feet[foot].along
    ledger.left_cells[foot] = ledger.cells[foot]
    ledger.times[LAST_TOUCH] = t
    ledger.feet[STANCE] = foot
    ledger.feet[STEPS] = step + 1
    return GOES_ON
