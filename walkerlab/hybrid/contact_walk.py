"""Walking on compliant ground: integrate to the next event, let it change what the ground does, go on.

Compiled as a whole for the project's own methods; the same source runs in Python with a library's integrator.
"""

from typing import Any

from walkerlab.ground.pulse import pulse_left
from walkerlab.ground.terrain import is_uneven
from walkerlab.ground.walker import OnGround, locked_knees
from walkerlab.hybrid.contact_events import (
    AIRBORNE_SINCE,
    LAST_TOUCH,
    PASSES_SWITCHING,
    PASSING,
    PULSE_END,
    STANCE,
    STEPS,
    Frame,
    JudgedGround,
    WalkState,
    earliest_crossing,
    is_switching,
    sample_event_functions,
)
from walkerlab.hybrid.contact_observer import ContactObserver, note_work, observe
from walkerlab.hybrid.contact_rules import GOES_ON, OWED, apply_event, is_above, is_to_lift, note_flexion, release
from walkerlab.kernels import entered, inlined, kernel
from walkerlab.outcome import Outcome
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.stepping import (
    H_NEXT,
    OUT_OF_BUDGET,
    STEP_DONE,
    T_OLD,
    T,
    advance,
    begin,
    prepare_dense,
    rewind,
    sample,
)

NEVER = -1
AT_LIFT = -2  # stop once the foot that carried the last step has lifted
LONGEST_STEP = 10.0  # pendulum times within which a step must end
LONGEST_FLIGHT = 0.25  # pendulum times without any foot on the ground
EVENT_TIME = 1e-12  # s, how exactly an event is located
REFINEMENTS = 4
REWINDS = 24  # of one step; where rounding moves an event with each try, the step's end is the event
DOUBTS = 12  # rewinds of one step after which an event that its end does not bear out does not count

WALKED, LIFTED_OFF, NO_HEEL_STRIKE = int(Outcome.WALKED), int(Outcome.LIFTED_OFF), int(Outcome.NO_HEEL_STRIKE)
BUDGET_EXHAUSTED, SOLVER_FAILED = int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED)


@entered
def scan(
    system: OnGround, ground: JudgedGround, walk_state: WalkState, watch_order: bool, finder: CrossingFinder
) -> tuple[float, int]:
    """Fraction of a step, sampled at the nodes, at which the first event lies, and which it is.

    The event functions stay in `finder.values`. The fraction is NO_CROSSING if there is no event.
    """
    for node in range(finder.nodes.size):
        sample_event_functions(system, ground, walk_state, finder.states[node], node, finder)
    return earliest_crossing(system, ground, walk_state, watch_order, finder)


@kernel
def walk_in_form(
    system: OnGround,
    ground: JudgedGround,
    method: Any,
    finder: CrossingFinder,
    observer: ContactObserver,
    walk_state: WalkState,
    until: int,
) -> tuple[int, int]:
    """Walk from where the method stands until the walk state is full, the hinge is released, or the walk ends.

    until  how many steps after which it also stops when the feet pass each other, or NEVER; or AT_LIFT: a walk whose
           walk state is full goes on until the foot that carried its last step has lifted

    Returns the outcome's number, or GOES_ON if the walker has to go on in another form, and the last event that it met.
    """
    begin(method, system, method.clock[T], method.y, method.clock[H_NEXT])
    arriving, refinements, rewinds, event = False, 0, 0, -1
    target = deadline(system, ground.frame, walk_state, method.clock[T])
    latest = target  # the end of the step in which an event was found: it is not sought beyond
    watch_order = ground.terrain.order_matters or until >= 0 or is_uneven(ground.terrain)
    locked = locked_knees(walk_state.knee)
    while walk_state.feet[STEPS] < walk_state.touch_time.size or (until == AT_LIFT and is_to_lift(walk_state)):
        status = advance(method, system, target)
        if status != STEP_DONE:
            return (BUDGET_EXHAUSTED if status == OUT_OF_BUDGET else SOLVER_FAILED), event
        prepare_dense(method, system)
        sample(method, system, finder.nodes, finder.states)
        fraction, found = scan(system, ground, walk_state, watch_order, finder)
        happens = fraction <= 1.0
        if happens:
            if not arriving:
                latest = method.clock[T]
            if found != event or not arriving:
                event, refinements = found, 0
            wait = max(fraction * (method.clock[T] - method.clock[T_OLD]), EVENT_TIME)
            early = method.clock[T_OLD] + wait < method.clock[T] - EVENT_TIME
            arriving = True
            if early and refinements <= REFINEMENTS and rewinds < REWINDS:
                target = method.clock[T_OLD] + wait
                refinements += 1
                rewinds += 1
                rewind(method, system)
                continue
            if early and is_switching(found):
                # its event function is no polynomial on this step: on half of it, it is nearer to one
                arriving, refinements, target = False, 0, 0.5 * (method.clock[T_OLD] + method.clock[T])
                rewinds += 1
                if rewinds > REWINDS:
                    # nor on a short one: the step may pass it over, but nothing else that is in it
                    walk_state.feet[PASSES_SWITCHING] = 1
                    rewinds, target = 0, method.clock[T]
                rewind(method, system)
                continue
        elif arriving and method.clock[T] >= target:
            wait = time_to_zero(method, finder, event)
            happens = abs(wait) <= EVENT_TIME
            again = refinements <= REFINEMENTS and rewinds < DOUBTS
            if not happens and again and method.clock[T_OLD] < target + wait <= latest:
                target += wait
                refinements += 1
                rewinds += 1
                rewind(method, system)
                continue
        rewinds = 0
        walk_state.feet[PASSES_SWITCHING] = 0
        observe(observer, method, system, finder, walk_state)
        note_flexion(system.form, walk_state, method.y)
        outcome = judge(system, ground.frame, method.clock[T], walk_state)
        if outcome != GOES_ON:
            return outcome, event
        if method.clock[T] - method.clock[T_OLD] > 2.0 * EVENT_TIME:
            # of events at one and the same time each is found once
            for i in range(walk_state.at_zero.size):
                walk_state.at_zero[i] = 0
        arriving = False
        if happens:
            steps = walk_state.feet[STEPS]
            outcome = apply_event(system, ground.terrain, observer, walk_state, event, method.clock[T], method.y)
            if outcome != GOES_ON:
                return outcome, event
            stepped = walk_state.feet[STEPS] > steps
            if stepped:
                note_work(observer, system, method.y)
            if (stepped and is_hinged(system)) or (event == PASSING and 0 <= until <= walk_state.feet[STEPS]):
                return WALKED, event
            # where the motion jumps the tangent does, too: in another form, and where a hip's legs change
            if locked_knees(walk_state.knee) != locked or (stepped and jumps_at_touch(system)):
                return GOES_ON, event
            if not is_switching(event):
                begin(method, system, method.clock[T], method.y, method.clock[H_NEXT])
        if walk_state.releasing[0] == OWED and pulse_left(system, method.clock[T]) <= EVENT_TIME:
            release(walk_state, 1 - walk_state.feet[STANCE])
            return GOES_ON, PULSE_END
        target = deadline(system, ground.frame, walk_state, method.clock[T])
    return WALKED, event


@inlined
def is_hinged(system: OnGround) -> bool:
    """Whether a hinge carries the walker, until its first step releases it."""
    return system.form.places == 0


@inlined
def jumps_at_touch(system: OnGround) -> bool:
    """Whether a step's touch may change what acts on the walker at once: the hip's legs change, a push-off begins."""
    return system.form.driven_hip or system.form.push_off != 0.0


@inlined
def deadline(system: OnGround, frame: Frame, walk_state: WalkState, t: float) -> float:
    """When the walk ends if nothing happens before: too long a step, or too long a flight (s); or when a pulse does."""
    by_step = walk_state.times[LAST_TOUCH] + LONGEST_STEP * frame.pendulum_time
    by_flight = walk_state.times[AIRBORNE_SINCE] + LONGEST_FLIGHT * frame.pendulum_time
    left = pulse_left(system, t)
    return min(by_step, by_flight, t + left) if left > EVENT_TIME else min(by_step, by_flight)


@inlined
def time_to_zero(method: Any, finder: CrossingFinder, event: int) -> float:
    """How much later than the end of the last step an event function is zero (s), by its slope there."""
    last = finder.nodes.size - 1
    h = method.clock[T] - method.clock[T_OLD]
    change = finder.values[event, last] - finder.values[event, last - 1]
    span = (finder.nodes[last] - finder.nodes[last - 1]) * h
    if change == 0.0:
        return 0.0
    wait = -finder.values[event, last] * span / change
    return max(-0.5 * h, min(0.5 * h, wait))


@inlined
def judge(system: OnGround, frame: Frame, t: float, walk_state: WalkState) -> int:
    """End the walk if it has flown or taken too long at time t (s); note until when a foot was on the ground.

    The event at the step's end has not changed the walk state yet: a foot that leaves there was on the ground before.
    """
    grounded = is_hinged(system)
    for foot in range(2):
        grounded = grounded or (walk_state.has_ground[foot] != 0 and not is_above(walk_state, foot))
    if grounded:
        walk_state.times[AIRBORNE_SINCE] = t
    if t >= walk_state.times[LAST_TOUCH] + LONGEST_STEP * frame.pendulum_time:
        return NO_HEEL_STRIKE
    if t >= walk_state.times[AIRBORNE_SINCE] + LONGEST_FLIGHT * frame.pendulum_time:
        return LIFTED_OFF
    return GOES_ON
