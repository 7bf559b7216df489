"""A walk on compliant ground with as few bodies as its knees allow.

Between a knee's lock and its release thigh and shank are one body, so the walk is one of several walkers that take
turns: of one body fewer while one knee can bend, of two fewer while none can. The whole walker's state is handed
from one to the next, and so is the tangent.
"""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.ground.held import LOCKED, NoneBends, OneBends, always_held, no_stops
from walkerlab.ground.merged import ByKnees, Unmerged, as_fewer, merged_levers, merged_state, place_of, store_whole
from walkerlab.ground.motion import OnGround
from walkerlab.ground.terrain import Terrain
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import EXTENSION, HEIGHT, PER_FOOT, VERTICAL_VELOCITY, Frame
from walkerlab.hybrid.contact_knee import carry_over, locked
from walkerlab.hybrid.contact_observer import KNEE_STRIKES, ContactObserver
from walkerlab.hybrid.contact_rules import GOES_ON, STANCE, WalkState
from walkerlab.hybrid.contact_tangent import Tangent
from walkerlab.hybrid.contact_walk import walk_part
from walkerlab.kernels import by_type, inlined
from walkerlab.mechanics.tuples import put
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.in_tuples import end_state
from walkerlab.solvers.registry import sharing
from walkerlab.solvers.stepping import T, dense_degree
from walkerlab.solvers.system import State


class MethodByKnees(NamedTuple):
    """A method with memory for a walker while one of its knees is locked, and while both are; they share their clock.

    The fields of a method that are read after a walk are here too: of the whole walker.
    """

    clock: Any
    counts: Any
    y: Any  # (4 + 2 n)
    one: Any
    both: Any


def method_by_knees(merging: ByKnees, size: int, new: Any) -> MethodByKnees:
    """Methods from `new(equations)` for a walker whose state has `size` numbers."""
    one, both = new(len(merging.one[0].blank)), new(len(merging.both.blank))
    return MethodByKnees(one.clock, one.counts, np.zeros(size), one, sharing(both, one.clock, one.counts))


@dense_degree.case(MethodByKnees)
def dense_degree_by_knees(method: MethodByKnees) -> int:
    """The same for both."""
    return dense_degree(method.both)


@by_type
def walk_by_knees(
    merging: Any,
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
    """Walk from state y at time t (s) with both feet free; arguments and what is returned as of `walk_part`."""


@walk_by_knees.case(Unmerged)
def walk_with_all_bodies(
    merging: Unmerged,
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
    """As it is."""
    system = free(walker, walk_state, always_held(walker.held))
    return walk_part(system, walker, terrain, frame, method, finder, observer, walk_state, t, y, stop_passing_after)


@walk_by_knees.case(ByKnees)
def walk_with_fewer_bodies(
    merging: ByKnees,
    walker: ContactWalker,
    terrain: Terrain,
    frame: Frame,
    method: MethodByKnees,
    finder: CrossingFinder,
    observer: ContactObserver,
    walk_state: WalkState,
    t: float,
    y: State,
    stop_passing_after: int,
) -> int:
    """One walker after another, as knees lock and are released."""
    method.clock[T] = t
    store_whole(merging, y, method.y)
    released, outcome = False, GOES_ON
    while outcome == GOES_ON:
        if walk_state.knee[0] == LOCKED and walk_state.knee[1] == LOCKED:
            fewer = merging.both
            straight = as_fewer(walker, fewer, fewer.held, NoneBends(walker.knees.release_at_touch))
            seen = seen_by(observer, observer.merged[1], fewer.onto)
            outcome = walk_merged(
                straight, terrain, frame, method, method.both, finder, seen, walk_state, stop_passing_after
            )
            hand_back(observer, seen, fewer.onto)
            released = True
        else:
            swing = 1 if walk_state.knee[0] == LOCKED else 0
            outcome = walk_bending(
                merging,
                swing,
                released,
                walker,
                terrain,
                frame,
                method,
                finder,
                observer,
                walk_state,
                stop_passing_after,
            )
            released = False
    return outcome


@inlined
def walk_bending(
    merging: ByKnees,
    swing: int,
    released: bool,
    walker: ContactWalker,
    terrain: Terrain,
    frame: Frame,
    method: MethodByKnees,
    finder: CrossingFinder,
    observer: ContactObserver,
    walk_state: WalkState,
    stop_passing_after: int,
) -> int:
    """Walk while the knee of leg `swing` can bend; from its release, or from where the walk starts, to its lock."""
    fewer = merging.one[1 - swing]
    knees = OneBends(fewer.thighs, fewer.shanks, walker.knees.release_at_touch)
    bending = as_fewer(walker, fewer, fewer.held, knees)
    locking = as_fewer(walker, fewer, merging.locking[1 - swing], knees)
    seen = seen_by(observer, observer.merged[0], fewer.onto)
    if released and seen.tangent.Phi.shape[1] > 0:
        cross_release(locking, swing, seen.tangent, walk_state, method)
    outcome = walk_merged(bending, terrain, frame, method, method.one, finder, seen, walk_state, stop_passing_after)
    if outcome == GOES_ON:
        cross_lock(locking, swing, seen, walk_state, method)
    hand_back(observer, seen, fewer.onto)
    return outcome


@inlined
def free(walker: ContactWalker, walk_state: WalkState, held: Any) -> OnGround:
    """The walker with both feet free, some of its bodies held and nothing in a stop."""
    has_ground = (walk_state.has_ground[0] != 0, walk_state.has_ground[1] != 0)
    return OnGround(walker, has_ground, held, no_stops(walker.knees))


@inlined
def cross_lock(
    walker: ContactWalker, swing: int, observer: ContactObserver, walk_state: WalkState, method: MethodByKnees
) -> None:
    """The knee of leg `swing` has locked: a plastic impact."""
    y = merged_state(walker.merging.onto, method.y, walker.blank)
    bent, straight = lock_modes(walker, swing, walk_state)
    new, lost = locked(straight, y)
    observer.dissipated[KNEE_STRIKES] += lost
    if observer.tangent.Phi.shape[1] > 0:
        t = method.clock[T]
        carry_over(walker.knees, observer.tangent, t, bent, straight, EXTENSION + swing, y, new, True)
    store_whole(walker.merging, new, method.y)


@inlined
def cross_release(
    walker: ContactWalker, swing: int, tangent: Tangent, walk_state: WalkState, method: MethodByKnees
) -> None:
    """The knee of leg `swing` is released: no velocity jumps, but accelerations do."""
    y = merged_state(walker.merging.onto, method.y, walker.blank)
    bent, straight = lock_modes(walker, swing, walk_state)
    kind = HEIGHT if walker.knees.release_at_touch else VERTICAL_VELOCITY
    event = walk_state.feet[STANCE] * PER_FOOT + kind
    carry_over(walker.knees, tangent, method.clock[T], straight, bent, event, y, y, False)


@inlined
def lock_modes(walker: ContactWalker, swing: int, walk_state: WalkState) -> tuple[OnGround, OnGround]:
    """The walker while the knee of leg `swing` can bend, and while it is locked."""
    always = walker.held.always
    straight = put(always, walker.knees.shanks[swing], True)
    return free(walker, walk_state, always), free(walker, walk_state, straight)


@inlined
def walk_merged(
    walker: ContactWalker,
    terrain: Terrain,
    frame: Frame,
    whole: MethodByKnees,
    method: Any,
    finder: CrossingFinder,
    observer: ContactObserver,
    walk_state: WalkState,
    stop_passing_after: int,
) -> int:
    """Walk with these bodies from where `whole` stands, until other knees are locked or the walk ends."""
    onto = walker.merging.onto
    hip_x = merged_levers(onto, frame.hip_x, walker.tree.arm_x)
    hip_y = merged_levers(onto, frame.hip_y, walker.tree.arm_x)
    own = Frame(frame.leg_length, frame.pendulum_time, hip_x, hip_y, frame.locate_switching)
    t, y = whole.clock[T], merged_state(onto, whole.y, walker.blank)
    system = free(walker, walk_state, always_held(walker.held))
    outcome = walk_part(system, walker, terrain, own, method, finder, observer, walk_state, t, y, stop_passing_after)
    store_whole(walker.merging, end_state(method, system), whole.y)
    return outcome


@inlined
def seen_by(observer: ContactObserver, tangent: Tangent, onto: tuple[int, ...]) -> ContactObserver:
    """The observer of a walk with fewer bodies, with what is known of the tangent."""
    whole, size = observer.tangent.Phi, tangent.Phi.shape[0]
    for i in range(whole.shape[0] - 1, -1, -1):
        for direction in range(whole.shape[1]):
            tangent.Phi[place_of(onto, i, size), direction] = whole[i, direction]
    return ContactObserver(
        observer.track_energy,
        observer.times,
        observer.states,
        observer.has_ground,
        observer.stance,
        observer.knees,
        observer.sampled_dissipation,
        observer.recorded,
        observer.dissipated,
        observer.extremes,
        tangent,
        (),
    )


@inlined
def hand_back(observer: ContactObserver, seen: ContactObserver, onto: tuple[int, ...]) -> None:
    """The tangent of a walk with fewer bodies is that of the whole walker: bodies that are one turn alike."""
    whole, size = observer.tangent.Phi, seen.tangent.Phi.shape[0]
    for i in range(whole.shape[0]):
        for direction in range(whole.shape[1]):
            whole[i, direction] = seen.tangent.Phi[place_of(onto, i, size), direction]
