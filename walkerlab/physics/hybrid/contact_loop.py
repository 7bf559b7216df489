"""Walking on compliant ground: integrate to the next event, apply it, continue."""

from typing import Any, NamedTuple

from walkerlab.physics.ground.pulse import pulse_left
from walkerlab.physics.ground.terrain import is_uneven
from walkerlab.physics.ground.walker import OnGround, locked_knees
from walkerlab.physics.hybrid import contact_state as events
from walkerlab.physics.hybrid import endings
from walkerlab.physics.hybrid.contact_crossings import earliest_crossing, sample_event_functions
from walkerlab.physics.hybrid.contact_record import ContactObserver, note_work, observe
from walkerlab.physics.hybrid.contact_state import WalkState, has_not_lifted, is_above, is_switching
from walkerlab.physics.hybrid.contact_transitions import apply_event, note_flexion, release
from walkerlab.physics.kernels import kernel, kernel_part
from walkerlab.physics.mechanics.hinges import HIP_ROW, is_sprung
from walkerlab.physics.solvers import stepping
from walkerlab.physics.solvers.events import CrossingFinder

NO_LIMIT = -1
AT_LIFT = -2  # stop once the foot that carried the last step has lifted
LONGEST_STEP = 10.0  # pendulum times within which a step must end
LONGEST_FLIGHT = 0.25  # longest time for which both feet may be off the ground, in pendulum times
EVENT_TIME = 1e-12  # s, accuracy of event times
EVENT_REFINEMENTS = 4
# Maximum number of rewinds per solver step. After that, the end of the step counts as the event: rounding moves the
# event slightly at each repetition, so the search might never end.
MAX_REWINDS = 24
# Maximum number of rewinds for an event that a solver step just missed. After that, the event is dropped unless it
# occurs at the end of the step.
MAX_DOUBTFUL_REWINDS = 12


@kernel
def scan(system: OnGround, walk_state: WalkState, watch_order: bool, finder: CrossingFinder) -> tuple[float, int]:
    """Sample all event functions on a solver step into `finder.values`, and find the first event.

    Returns the same as `earliest_crossing`.
    """
    for node in range(finder.nodes.size):
        sample_event_functions(system, walk_state, finder.states[node], node, finder)
    return earliest_crossing(system, walk_state, watch_order, finder)


class EventSearch(NamedTuple):
    """State of the search for an event's time, which repeats solver steps until one of them ends at the event."""

    target: float  # s, latest end of the next solver step
    event: int  # event that is being located, or the last event
    latest: float  # s, end of the solver step in which the event first appeared, an upper bound of its time
    refinements: int  # number of corrections of the event's expected time; 0 if `target` is another time
    rewinds: int  # number of rewinds of the present solver step
    accepted: bool  # whether the last solver step is valid; if not, it is repeated up to the new target
    occurs: bool  # whether the event happens at the end of the solver step


@kernel
def walk_in_form(
    system: OnGround, method: Any, finder: CrossingFinder, observer: ContactObserver, walk_state: WalkState, until: int
) -> tuple[int, int]:
    """Walk until `walk_state` is full, the walker changes its form, a pinned step is complete, or the walk ends.

    method  solver, with the start state on entry and the end state on return
    until   NO_LIMIT, a number of steps, or AT_LIFT. After a number of steps, the walk also ends when the feet pass each
            other. With AT_LIFT, it continues until the foot that carried the last step has lifted

    Returns the outcome code, or CHANGES_FORM, and the last event.
    """
    # Keep the step size that was planned before the walk changed its form.
    stepping.begin(method, system, method.clock[stepping.T], method.y, method.clock[stepping.H_NEXT])
    search = seek(deadline(system, walk_state, method.clock[stepping.T]), events.NO_EVENT)
    terrain = walk_state.ground.terrain
    # The feet's order also decides when a walk with `until` ends, and which foothold's height a foot gets.
    watch_order = terrain.order_matters or until >= 0 or is_uneven(terrain)
    while steps_are_left(walk_state, until):
        status = stepping.advance(method, system, search.target)
        if status != stepping.STEP_DONE:
            failure = endings.BUDGET_EXHAUSTED if status == stepping.OUT_OF_BUDGET else endings.SOLVER_FAILED
            return failure, search.event
        stepping.prepare_dense(method, system)
        stepping.sample(method, system, finder.nodes, finder.states)
        fraction, event = scan(system, walk_state, watch_order, finder)
        search = aim(search, walk_state, method, finder, fraction, event)
        if not search.accepted:
            stepping.rewind(method, system)
            continue
        walk_state.progress.passes_switching = False
        observe(observer, method, system, finder, walk_state)
        note_flexion(system.form, walk_state, method.y)
        t = method.clock[stepping.T]
        outcome = judge(system, walk_state, t)
        if outcome == endings.GOES_ON:
            forget_zeros(walk_state, t - method.clock[stepping.T_OLD])
            if search.occurs:
                outcome = react(system, observer, walk_state, method, search.event, until)
        if outcome != endings.GOES_ON:
            return outcome, search.event
        if walk_state.progress.release == events.AT_PULSE_END and pulse_left(system, t) <= EVENT_TIME:
            release(walk_state, 1 - walk_state.progress.stance)
            return endings.CHANGES_FORM, events.PULSE_END
        search = seek(deadline(system, walk_state, t), search.event)
    return endings.WALKED, search.event


@kernel_part
def steps_are_left(walk_state: WalkState, until: int) -> bool:
    return walk_state.progress.steps < walk_state.touch_time.size or (until == AT_LIFT and has_not_lifted(walk_state))


@kernel_part
def seek(target: float, event: int) -> EventSearch:
    """Start the search for the next event, with solver steps up to time `target` (s). `event` was the last event."""
    return EventSearch(target, event, target, refinements=0, rewinds=0, accepted=False, occurs=False)


@kernel_part
def repeat(target: float, event: int, latest: float, refinements: int, rewinds: int) -> EventSearch:
    """Reject the last solver step: the next one starts where it did and ends at `target` (s)."""
    return EventSearch(target, event, latest, refinements, rewinds, accepted=False, occurs=False)


@kernel_part
def accept(event: int, occurs: bool) -> EventSearch:
    """Accept the last solver step, which ends the search."""
    return EventSearch(0.0, event, 0.0, 0, 0, accepted=True, occurs=occurs)


@kernel_part
def aim(
    search: EventSearch, walk_state: WalkState, method: Any, finder: CrossingFinder, fraction: float, event: int
) -> EventSearch:
    """Decide whether the last solver step is valid, and when the next must end. A `fraction` above 1 means no event."""
    start, end = method.clock[stepping.T_OLD], method.clock[stepping.T]
    if fraction <= 1.0:
        return approach(search, walk_state, start, end, fraction, event)
    # This solver step was shortened to end at an event, but shows none: it may have ended just before it.
    if search.refinements > 0 and end >= search.target:
        return confirm(search, start, time_to_zero(method, finder, search.event))
    return accept(search.event, False)


@kernel_part
def approach(
    search: EventSearch, walk_state: WalkState, start: float, end: float, fraction: float, event: int
) -> EventSearch:
    """Shorten the solver step from `start` to `end` (s) to end at its event, or accept it if it already ends there."""
    latest = search.latest if search.refinements > 0 else end
    # If a different event now comes first, restart the count of refinements.
    refinements = search.refinements if event == search.event else 0
    # A solver step cannot have length zero.
    wait = max(fraction * (end - start), EVENT_TIME)
    early = start + wait < end - EVENT_TIME
    if early and refinements <= EVENT_REFINEMENTS and search.rewinds < MAX_REWINDS:
        return repeat(start + wait, event, latest, refinements + 1, search.rewinds + 1)
    if early and is_switching(event):
        # Refinement does not help, so the event function is too far from a polynomial on this solver step: halve it.
        if search.rewinds < MAX_REWINDS:
            return repeat(0.5 * (start + end), event, latest, 0, search.rewinds + 1)
        # A short solver step does not help either: let this one pass switching points, but no other events.
        walk_state.progress.passes_switching = True
        return repeat(end, event, latest, 0, 0)
    return accept(event, True)


@kernel_part
def confirm(search: EventSearch, start: float, wait: float) -> EventSearch:
    """Accept the event that a solver step just missed, extend that step by `wait` (s), or drop the event."""
    occurs = abs(wait) <= EVENT_TIME
    doubtful = search.refinements <= EVENT_REFINEMENTS and search.rewinds < MAX_DOUBTFUL_REWINDS
    target = search.target + wait
    # The event cannot lie beyond the solver step in which it first appeared.
    if not occurs and doubtful and start < target <= search.latest:
        return repeat(target, search.event, search.latest, search.refinements + 1, search.rewinds + 1)
    return accept(search.event, occurs)


@kernel_part
def forget_zeros(walk_state: WalkState, h: float) -> None:
    """Clear `at_zero`, the guard against finding an event twice, unless the last solver step h (s) was too short."""
    if h > 2.0 * EVENT_TIME:
        for i in range(walk_state.at_zero.size):
            walk_state.at_zero[i] = 0


@kernel_part
def react(
    system: OnGround, observer: ContactObserver, walk_state: WalkState, method: Any, event: int, until: int
) -> int:
    """Apply the event at the end of the last solver step, and return the outcome, GOES_ON or CHANGES_FORM."""
    steps = walk_state.progress.steps
    locked = locked_knees(walk_state.knee)
    outcome = apply_event(system, observer, walk_state, event, method.clock[stepping.T], method.y)
    if outcome != endings.GOES_ON:
        return outcome
    stepped = walk_state.progress.steps > steps
    if stepped:
        note_work(observer, system, method.y)
    if (stepped and is_pinned(system)) or (event == events.PASSING and 0 <= until <= walk_state.progress.steps):
        return endings.WALKED
    # The tangent jumps when the form changes, and when forces jump as the legs change roles. Only the caller can apply
    # such a jump.
    if locked_knees(walk_state.knee) != locked or (stepped and jumps_at_touch(system)):
        return endings.CHANGES_FORM
    # The force is continuous at its switching points, so the method continues with its history.
    if not is_switching(event):
        stepping.begin(method, system, method.clock[stepping.T], method.y, method.clock[stepping.H_NEXT])
    return endings.GOES_ON


@kernel_part
def is_pinned(system: OnGround) -> bool:
    return system.form.places == 0


@kernel_part
def jumps_at_touch(system: OnGround) -> bool:
    """Whether forces may jump at the touch that ends a step: the legs change roles at the hip, or a push-off begins."""
    return is_sprung(system.form, HIP_ROW) or system.form.push_off != 0.0


@kernel_part
def deadline(system: OnGround, walk_state: WalkState, t: float) -> float:
    """Compute the time (s) at which the step or a flight gets too long or the push-off ends, whichever is first."""
    by_step, by_flight = time_limits(walk_state)
    # If the rest of the push-off is shorter than the accuracy of event times, the push-off counts as over.
    left = pulse_left(system, t)
    return min(by_step, by_flight, t + left) if left > EVENT_TIME else min(by_step, by_flight)


@kernel_part
def time_limits(walk_state: WalkState) -> tuple[float, float]:
    """Return the times (s) at which the step and the flight get too long."""
    progress = walk_state.progress
    pendulum_time = walk_state.ground.frame.pendulum_time
    return progress.last_touch + LONGEST_STEP * pendulum_time, progress.airborne_since + LONGEST_FLIGHT * pendulum_time


@kernel_part
def time_to_zero(method: Any, finder: CrossingFinder, event: int) -> float:
    """Use an event function's final slope to estimate the time (s) from the end of the solver step to its zero."""
    last = finder.nodes.size - 1
    h = method.clock[stepping.T] - method.clock[stepping.T_OLD]
    change = finder.values[event, last] - finder.values[event, last - 1]
    span = (finder.nodes[last] - finder.nodes[last - 1]) * h
    if change == 0.0:
        return 0.0
    wait = -finder.values[event, last] * span / change
    # A function that hardly changes would send the target far away.
    return max(-0.5 * h, min(0.5 * h, wait))


@kernel_part
def judge(system: OnGround, walk_state: WalkState, t: float) -> int:
    """Return the outcome if the flight or the step is too long at t (s), otherwise GOES_ON.

    `airborne_since` is updated first.
    """
    # A foot that lifts at t still counts as on the ground, because the event at the solver step's end is applied later.
    grounded = is_pinned(system)
    for foot in range(2):
        grounded = grounded or (walk_state.has_ground[foot] != 0 and not is_above(walk_state, foot))
    if grounded:
        walk_state.progress.airborne_since = t
    by_step, by_flight = time_limits(walk_state)
    if t >= by_step:
        return endings.NO_HEEL_STRIKE
    return endings.LIFTED_OFF if t >= by_flight else endings.GOES_ON
