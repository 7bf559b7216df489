"""Walking on compliant ground: integrate to the next event, let it change what the ground does, go on.

Compiled as a whole for the project's own methods; the same source runs in Python with a library's integrator.
"""

from typing import Any

from walkerlab.ground.held import bends_otherwise, held_flags, stop_flags
from walkerlab.ground.motion import OnGround
from walkerlab.ground.pinned import Pinned
from walkerlab.ground.terrain import order_matters
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import PASSING, Frame, is_join, walker_state
from walkerlab.hybrid.contact_knee import cross_knee
from walkerlab.hybrid.contact_observer import ContactObserver, observe
from walkerlab.hybrid.contact_rules import (
    AIRBORNE_SINCE,
    GOES_ON,
    LAST_TOUCH,
    STANCE,
    STEPS,
    Ledger,
    happen,
    is_above,
    is_to_lift,
    note_flexion,
)
from walkerlab.hybrid.contact_scan import Feet, Scene, scan
from walkerlab.hybrid.outcome import Outcome
from walkerlab.kernels import by_type, inlined
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.in_tuples import begin, end_state
from walkerlab.solvers.stepping import H_NEXT, OUT_OF_BUDGET, STEP_DONE, T_OLD, T, advance, prepare_dense, rewind
from walkerlab.solvers.system import State

AT_LIFT = -2  # stop once the foot that carried the last step has lifted
LONGEST_STEP = 10.0  # pendulum times within which a step must end
LONGEST_FLIGHT = 0.25  # pendulum times without any foot on the ground
EVENT_TIME = 1e-12  # s, how exactly an event is located
REFINEMENTS = 4
REWINDS = 24  # of one step; where rounding moves an event with each try, the step's end is the event
DOUBTS = 12  # rewinds of one step after which an event that its end does not bear out does not count

WALKED, LIFTED_OFF, NO_HEEL_STRIKE = int(Outcome.WALKED), int(Outcome.LIFTED_OFF), int(Outcome.NO_HEEL_STRIKE)
BUDGET_EXHAUSTED, SOLVER_FAILED = int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED)


@by_type
def in_mode(system: Any, ledger: Ledger) -> Any:
    """The system for the ground that there is now."""


@in_mode.case(OnGround)
def free_mode(system: OnGround, ledger: Ledger) -> OnGround:
    """Each foot finds ground or not."""
    walker, carried = system.walker, (ledger.carried[0] != 0, ledger.carried[1] != 0)
    held = held_flags(walker.held, walker.knees, ledger.knee)
    return OnGround(walker, carried, held, stop_flags(walker.knees, ledger.knee))


@in_mode.case(Pinned)
def hinged_mode(system: Pinned, ledger: Ledger) -> Pinned:
    """The other foot finds ground or not."""
    walker, carried = system.walker, ledger.carried[1 - system.foot] != 0
    held, stops = held_flags(walker.held, walker.knees, ledger.knee), stop_flags(walker.knees, ledger.knee)
    return Pinned(walker, system.tree, system.foot, system.along, system.blank, held, stops, carried)


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

    With `stop_passing_after` at least zero it also stops when, after that many steps, the feet pass each other; with
    AT_LIFT a walk whose ledger is full goes on until the foot that carried its last step has lifted.

    Returns the outcome's number, or GOES_ON if the walker has to go on with other bodies; the method stands at the end.
    """
    mode = in_mode(system, ledger)
    begin(method, mode, t, y, method.clock[H_NEXT])
    arriving, refinements, rewinds, signal = False, 0, 0, -1
    target = deadline(frame, ledger)
    latest = target  # the end of the step in which an event was found: it is not sought beyond
    scene = Scene(walker, terrain, frame, order_matters(terrain) or stop_passing_after >= 0)
    feet = Feet(
        ledger.carried,
        ledger.cells,
        ledger.sides,
        ledger.at_zero,
        ledger.touched,
        ledger.feet,
        ledger.knee,
        ledger.releasing,
    )
    while ledger.feet[STEPS] < ledger.touch_time.size or (stop_passing_after == AT_LIFT and is_to_lift(ledger)):
        status = advance(method, mode, target)
        if status != STEP_DONE:
            return BUDGET_EXHAUSTED if status == OUT_OF_BUDGET else SOLVER_FAILED
        prepare_dense(method, mode)
        fraction, found = scan(method, mode, scene, feet, finder)
        happens = fraction <= 1.0
        if happens:
            if not arriving:
                latest = method.clock[T]
            if found != signal or not arriving:
                signal, refinements = found, 0
            wait = max(fraction * (method.clock[T] - method.clock[T_OLD]), EVENT_TIME)
            early = method.clock[T_OLD] + wait < method.clock[T] - EVENT_TIME
            arriving = True
            if early and refinements <= REFINEMENTS and rewinds < REWINDS:
                target = method.clock[T_OLD] + wait
                refinements += 1
                rewinds += 1
                rewind(method, mode)
                continue
        elif arriving and method.clock[T] >= target:
            wait = time_to_zero(method, finder, signal)
            happens = abs(wait) <= EVENT_TIME
            again = refinements <= REFINEMENTS and rewinds < DOUBTS
            if not happens and again and method.clock[T_OLD] < target + wait <= latest:
                target += wait
                refinements += 1
                rewinds += 1
                rewind(method, mode)
                continue
        rewinds = 0
        observe(observer, method, mode, walker, finder, ledger.carried, ledger.knee, ledger.feet[STANCE])
        note_flexion(walker.knees, ledger, walker_state(mode, end_state(method, mode)))
        outcome = judge(mode, scene, method, ledger)
        if outcome != GOES_ON:
            return outcome
        if method.clock[T] - method.clock[T_OLD] > 2.0 * EVENT_TIME:
            # of events at one and the same time each is found once
            for i in range(ledger.at_zero.size):
                ledger.at_zero[i] = 0
        arriving = False
        if happens:
            end = walker_state(mode, end_state(method, mode))
            steps = ledger.feet[STEPS]
            outcome = happen(walker, terrain, observer, ledger, signal, method.clock[T], end)
            if outcome != GOES_ON:
                return outcome
            released = is_hinged(system) and ledger.feet[STEPS] > steps
            if released or (signal == PASSING and 0 <= stop_passing_after <= ledger.feet[STEPS]):
                return WALKED
            if bends_otherwise(walker.knees, ledger.knee):
                return GOES_ON
            if not is_join(signal):
                before, mode = mode, in_mode(system, ledger)
                y = cross_knee(walker.knees, observer, method, before, mode, signal)
                begin(method, mode, method.clock[T], y, method.clock[H_NEXT])
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
def judge(mode: Any, scene: Scene, method: Any, ledger: Ledger) -> int:
    """End the walk if it has flown or taken too long; note until when a foot was on the ground.

    The event at the step's end has not changed the ledger yet: a foot that leaves there was on the ground until then.
    """
    t, pendulum_time = method.clock[T], scene.frame.pendulum_time
    grounded = is_hinged(mode)
    for foot in range(2):
        grounded = grounded or (ledger.carried[foot] != 0 and not is_above(ledger, foot))
    if grounded:
        ledger.times[AIRBORNE_SINCE] = t
    if t >= ledger.times[LAST_TOUCH] + LONGEST_STEP * pendulum_time:
        return NO_HEEL_STRIKE
    if t >= ledger.times[AIRBORNE_SINCE] + LONGEST_FLIGHT * pendulum_time:
        return LIFTED_OFF
    return GOES_ON
