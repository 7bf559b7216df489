"""Walking on compliant ground: integrate to the next event, let it change what the ground does, go on.

Compiled as a whole for the project's own methods; the same source runs in Python with a library's integrator.
"""

from typing import Any

from walkerlab.ground.held import bends_otherwise, held_flags, stop_flags
from walkerlab.ground.motion import OnGround
from walkerlab.ground.pinned import Pinned
from walkerlab.ground.terrain import Terrain
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import PASSING, Frame, is_switching, walker_state
from walkerlab.hybrid.contact_knee import cross_knee
from walkerlab.hybrid.contact_observer import ContactObserver, observe
from walkerlab.hybrid.contact_rules import (
    AIRBORNE_SINCE,
    GOES_ON,
    LAST_TOUCH,
    STANCE,
    STEPS,
    WalkState,
    happen,
    is_above,
    is_to_lift,
    note_flexion,
)
from walkerlab.hybrid.contact_scan import Feet, Scene, scan
from walkerlab.hybrid.outcome import Outcome
from walkerlab.kernels import by_type, by_type_or_default, inlined
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
def in_mode(system: Any, walk_state: WalkState) -> Any:
    """The system for the ground that there is now."""


@in_mode.case(OnGround)
def free_mode(system: OnGround, walk_state: WalkState) -> OnGround:
    """Each foot finds ground or not."""
    walker, has_ground = system.walker, (walk_state.has_ground[0] != 0, walk_state.has_ground[1] != 0)
    held = held_flags(walker.held, walker.knees, walk_state.knee)
    return OnGround(walker, has_ground, held, stop_flags(walker.knees, walk_state.knee))


@in_mode.case(Pinned)
def hinged_mode(system: Pinned, walk_state: WalkState) -> Pinned:
    """The other foot finds ground or not."""
    walker, has_ground = system.walker, walk_state.has_ground[1 - system.foot] != 0
    held, stops = held_flags(walker.held, walker.knees, walk_state.knee), stop_flags(walker.knees, walk_state.knee)
    return Pinned(walker, system.tree, system.foot, system.along, system.blank, held, stops, has_ground)


@by_type_or_default
def is_hinged(system: Any) -> bool:
    """Whether a hinge carries the walker, until its first step releases it."""
    return False


@is_hinged.case(Pinned)
def pinned_is(system: Pinned) -> bool:
    """Yes."""
    return True


@inlined
def walk_part(
    system: Any,
    walker: ContactWalker,
    terrain: Terrain,
    frame: Frame,
    method: Any,
    finder: CrossingFinder,
    observer: ContactObserver,
    walk_state: WalkState,
    t: float,
    y: State,
    stop_passing_after: int,
) -> int:
    """Walk from state y at time t (s) until the walk state is full, the hinge is released, or the walk ends.

    With `stop_passing_after` at least zero it also stops when, after that many steps, the feet pass each other; with
    AT_LIFT a walk whose walk state is full goes on until the foot that carried its last step has lifted.

    Returns the outcome's number, or GOES_ON if the walker has to go on with other bodies; the method stands at the end.
    """
    mode = in_mode(system, walk_state)
    begin(method, mode, t, y, method.clock[H_NEXT])
    arriving, refinements, rewinds, event = False, 0, 0, -1
    target = deadline(frame, walk_state)
    latest = target  # the end of the step in which an event was found: it is not sought beyond
    scene = Scene(walker, terrain, frame, terrain.order_matters or stop_passing_after >= 0)
    feet = Feet(
        walk_state.has_ground,
        walk_state.cells,
        walk_state.sides,
        walk_state.at_zero,
        walk_state.touched,
        walk_state.feet,
        walk_state.knee,
        walk_state.releasing,
    )
    while walk_state.feet[STEPS] < walk_state.touch_time.size or (
        stop_passing_after == AT_LIFT and is_to_lift(walk_state)
    ):
        status = advance(method, mode, target)
        if status != STEP_DONE:
            return BUDGET_EXHAUSTED if status == OUT_OF_BUDGET else SOLVER_FAILED
        prepare_dense(method, mode)
        fraction, found = scan(method, mode, scene, feet, finder)
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
                rewind(method, mode)
                continue
        elif arriving and method.clock[T] >= target:
            wait = time_to_zero(method, finder, event)
            happens = abs(wait) <= EVENT_TIME
            again = refinements <= REFINEMENTS and rewinds < DOUBTS
            if not happens and again and method.clock[T_OLD] < target + wait <= latest:
                target += wait
                refinements += 1
                rewinds += 1
                rewind(method, mode)
                continue
        rewinds = 0
        observe(observer, method, mode, walker, finder, walk_state.has_ground, walk_state.knee, walk_state.feet[STANCE])
        note_flexion(walker.knees, walk_state, walker_state(mode, end_state(method, mode)))
        outcome = judge(mode, scene, method, walk_state)
        if outcome != GOES_ON:
            return outcome
        if method.clock[T] - method.clock[T_OLD] > 2.0 * EVENT_TIME:
            # of events at one and the same time each is found once
            for i in range(walk_state.at_zero.size):
                walk_state.at_zero[i] = 0
        arriving = False
        if happens:
            end = walker_state(mode, end_state(method, mode))
            steps = walk_state.feet[STEPS]
            outcome = happen(walker, terrain, observer, walk_state, event, method.clock[T], end)
            if outcome != GOES_ON:
                return outcome
            released = is_hinged(system) and walk_state.feet[STEPS] > steps
            if released or (event == PASSING and 0 <= stop_passing_after <= walk_state.feet[STEPS]):
                return WALKED
            if bends_otherwise(walker.knees, walk_state.knee):
                return GOES_ON
            if not is_switching(event):
                before, mode = mode, in_mode(system, walk_state)
                y = cross_knee(walker.knees, observer, method, before, mode, event)
                begin(method, mode, method.clock[T], y, method.clock[H_NEXT])
        target = deadline(frame, walk_state)
    return WALKED


@inlined
def deadline(frame: Frame, walk_state: WalkState) -> float:
    """When the walk ends if nothing happens before: too long a step, or too long a flight (s)."""
    by_step = walk_state.times[LAST_TOUCH] + LONGEST_STEP * frame.pendulum_time
    by_flight = walk_state.times[AIRBORNE_SINCE] + LONGEST_FLIGHT * frame.pendulum_time
    return min(by_step, by_flight)


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
def judge(mode: Any, scene: Scene, method: Any, walk_state: WalkState) -> int:
    """End the walk if it has flown or taken too long; note until when a foot was on the ground.

    The event at the step's end has not changed the walk state yet: a foot that leaves there was on the ground before.
    """
    t, pendulum_time = method.clock[T], scene.frame.pendulum_time
    grounded = is_hinged(mode)
    for foot in range(2):
        grounded = grounded or (walk_state.has_ground[foot] != 0 and not is_above(walk_state, foot))
    if grounded:
        walk_state.times[AIRBORNE_SINCE] = t
    if t >= walk_state.times[LAST_TOUCH] + LONGEST_STEP * pendulum_time:
        return NO_HEEL_STRIKE
    if t >= walk_state.times[AIRBORNE_SINCE] + LONGEST_FLIGHT * pendulum_time:
        return LIFTED_OFF
    return GOES_ON
