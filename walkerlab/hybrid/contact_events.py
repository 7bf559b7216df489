"""The event functions whose zeros are the events of a walk on compliant ground, sampled along a step.

Some change what the ground does (touch, lift, a pad's edge, feet passing each other, the fall). Of these the walk knows
on which side of zero they are, and the event is that they leave it: of events at one time none can hide another. The
others are switching points of the force law, where its derivatives jump: a step that ends there keeps the method's
order.
"""

import math
from typing import Any, NamedTuple

from walkerlab.ground.friction import sample_switching, switching_count
from walkerlab.ground.held import (
    BENT,
    LOCKED,
    STOPPING,
    Knees,
    NoneBends,
    OneBends,
    extension,
    extension_rate,
)
from walkerlab.ground.normal_force import grip
from walkerlab.ground.pinned import Pinned, floating_state
from walkerlab.ground.terrain import Terrain, cell_edges
from walkerlab.ground.walker import ContactWalker, FootMotion, foot_motion
from walkerlab.kernels import by_type_or_default, inlined
from walkerlab.mechanics.tree import sines_cosines
from walkerlab.solvers.events import NO_CROSSING, CrossingFinder, first_crossing, way_from_zero
from walkerlab.solvers.system import State

# event functions of each foot
HEIGHT, LEFT_EDGE, RIGHT_EDGE, RELEASE, FULL_DAMPING = range(5)
FRICTION_SWITCHES = 5  # up to four, of the friction law
MATERIAL, VERTICAL_VELOCITY = 9, 10  # no events: where the foot's material is, and how fast its height grows
PER_FOOT = 11
# event functions of the walker
PASSING, FALL, SLIDE = range(2 * PER_FOOT, 2 * PER_FOOT + 3)
# event functions of both knees: how far beyond straight, and how fast it gets there
EXTENSION, EXTENSION_RATE = SLIDE + 1, SLIDE + 3
EVENT_FUNCTIONS = SLIDE + 5
NO_SIDE = 0  # of an event function that may cross zero either way
FARTHEST_SLIDE = 0.25  # of the stride measure, of a stance foot's material from where it touched
FALLEN_HIP = 0.5  # hip height over the slope in leg lengths
ROUNDING = 1e-14  # m, rad or their rates: what event functions are zero to
CLEARLY_MOVED = 1e-12  # the same, over a step: what they move away from zero by, if not by rounding alone


class Frame(NamedTuple):
    """Measures of the walker that events are judged by."""

    leg_length: float  # m
    pendulum_time: float  # s, sqrt(L/g)
    hip_x: tuple[float, ...]  # m, lever of the hip from the centre of mass, body by body
    hip_y: tuple[float, ...]
    locate_switching: bool  # end steps at the switching points of the force law


@by_type_or_default
def walker_state(system: Any, y: State) -> State:
    """The state of the free walker."""
    return y


@walker_state.case(Pinned)
def hinged_state(system: Pinned, y: State) -> State:
    """The hinge gives the rest."""
    return floating_state(system, y)


@by_type_or_default
def is_free(system: Any, foot: int) -> bool:
    """Whether a foot may touch and lift."""
    return True


@is_free.case(Pinned)
def free_other(system: Pinned, foot: int) -> bool:
    """The hinged one may not."""
    return foot != system.foot


@inlined
def feet_motion(walker: ContactWalker, y: State) -> tuple[FootMotion, FootMotion]:
    """Both feet of the free walker's state."""
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    return foot_motion(walker, walker.feet[0], s, c, y), foot_motion(walker, walker.feet[1], s, c, y)


@inlined
def material_along(walker: ContactWalker, foot: int, along: float, y: State) -> float:
    """Where a foot at `along` (m) would be had it not rolled: what this changes by is slip.

    The velocity of the material point at the bottom of the ball is that of the contact point plus radius times angular
    velocity; so is its way the contact point's plus radius times the change of the angle.
    """
    rolling = walker.feet[foot].rolling
    for k in range(len(rolling)):
        along += rolling[k] * y[2 + k]
    return along


@inlined
def hip_height(walker: ContactWalker, frame: Frame, y: State) -> float:
    """Height of the hip over the slope (m)."""
    height = y[1]
    for k in range(len(frame.hip_x)):
        angle = y[2 + k] + walker.slope
        height += math.sin(angle) * frame.hip_x[k] + math.cos(angle) * frame.hip_y[k]
    return height


@inlined
def sample_event_functions(
    system: Any,
    walker: ContactWalker,
    terrain: Terrain,
    frame: Frame,
    cells: Any,
    stance: int,
    touched: float,
    state: State,
    node: int,
    finder: CrossingFinder,
) -> None:
    """Values of all event functions at one node of a step, where the system's state is `state`."""
    y = walker_state(system, state)
    feet = feet_motion(walker, y)
    for foot in range(2):
        first = foot * PER_FOOT
        sample_foot(walker, feet[foot], cell_edges(terrain, foot, cells[foot]), first, node, finder)
        finder.values[first + MATERIAL, node] = material_along(walker, foot, feet[foot].along, y)
    finder.values[PASSING, node] = feet[1].along - feet[0].along
    finder.values[FALL, node] = hip_height(walker, frame, y) - FALLEN_HIP * frame.leg_length
    away = finder.values[stance * PER_FOOT + MATERIAL, node] - touched
    finder.values[SLIDE, node] = farthest_slide(terrain) ** 2 - away**2
    sample_knees(walker.knees, y, node, finder)


@inlined
def farthest_slide(terrain: Terrain) -> float:
    """How far a loaded stance foot may slip (m)."""
    return FARTHEST_SLIDE * terrain.stride_measure


@inlined
def sample_foot(
    walker: ContactWalker, motion: FootMotion, edges: tuple[float, float], first: int, j: int, finder: CrossingFinder
) -> None:
    """One foot's event functions at node j."""
    values = finder.values
    values[first + HEIGHT, j] = motion.height
    values[first + VERTICAL_VELOCITY, j] = motion.vertical_velocity
    values[first + LEFT_EDGE, j] = motion.along - edges[0]
    values[first + RIGHT_EDGE, j] = edges[1] - motion.along
    values[first + RELEASE, j] = grip(-motion.height, -motion.vertical_velocity, walker.normal)
    values[first + FULL_DAMPING, j] = motion.height + walker.normal.full_damping_penetration
    sample_switching(walker.friction, motion.slip, values, first + FRICTION_SWITCHES, j)


@by_type_or_default
def sample_knees(knees: Any, y: State, j: int, finder: CrossingFinder) -> None:
    """The knees' event functions at node j."""


@sample_knees.case(Knees)
@sample_knees.case(OneBends)
def sample_both_knees(knees: Any, y: State, j: int, finder: CrossingFinder) -> None:
    """Extension and its rate."""
    for knee in range(2):
        finder.values[EXTENSION + knee, j] = extension(knees, knee, y, 2)
        finder.values[EXTENSION_RATE + knee, j] = extension_rate(knees, knee, y, 2)


@by_type_or_default
def knee_crossing(
    knees: Any, knee: Any, releasing: bool, stance: int, at_zero: Any, finder: CrossingFinder
) -> tuple[float, int]:
    """Fraction of the step at which a knee locks, latches or is to be released, and which event function's that is.

    knee       (2,) what each knee is doing
    releasing  whether the trailing knee is released when the stance foot stops sinking in
    """
    return NO_CROSSING, -1


@knee_crossing.case(Knees)
def first_knee_crossing(
    knees: Knees, knee: Any, releasing: bool, stance: int, at_zero: Any, finder: CrossingFinder
) -> tuple[float, int]:
    """A bent knee gets straight; one in its stop turns back; the stance foot stops sinking in."""
    best, event = NO_CROSSING, -1
    for k in range(2):
        at, index = NO_CROSSING, EXTENSION + k
        if knee[k] == BENT:
            at = leaves_side(finder, index, -1, at_zero[index] != 0)
        elif knee[k] == STOPPING:
            index = EXTENSION_RATE + k
            at = leaves_side(finder, index, 1, at_zero[index] != 0)
        if at < best:
            best, event = at, index
    at, index = end_of_sinking(releasing, stance, at_zero, finder)
    return (at, index) if at < best else (best, event)


@knee_crossing.case(OneBends)
def only_crossing(
    knees: OneBends, knee: Any, releasing: bool, stance: int, at_zero: Any, finder: CrossingFinder
) -> tuple[float, int]:
    """The bent knee gets straight."""
    index = EXTENSION if knee[0] != LOCKED else EXTENSION + 1
    if knee[index - EXTENSION] != BENT:
        return NO_CROSSING, -1
    return leaves_side(finder, index, -1, at_zero[index] != 0), index


@knee_crossing.case(NoneBends)
def crossing_of_the_foot(
    knees: NoneBends, knee: Any, releasing: bool, stance: int, at_zero: Any, finder: CrossingFinder
) -> tuple[float, int]:
    """The stance foot stops sinking in."""
    return end_of_sinking(releasing, stance, at_zero, finder)


@inlined
def end_of_sinking(releasing: bool, stance: int, at_zero: Any, finder: CrossingFinder) -> tuple[float, int]:
    """Fraction of the step at which the stance foot stops sinking in, if a knee is to be released then."""
    index = stance * PER_FOOT + VERTICAL_VELOCITY
    if not releasing:
        return NO_CROSSING, index
    return leaves_side(finder, index, -1, at_zero[index] != 0), index


@inlined
def earliest_crossing(
    system: Any,
    walker: ContactWalker,
    frame: Frame,
    watch_order: bool,
    has_ground: Any,
    stance: int,
    sides: Any,
    at_zero: Any,
    pads: bool,
    knee: Any,
    releasing: bool,
    finder: CrossingFinder,
) -> tuple[float, int]:
    """Fraction of the sampled step at which the first event lies, and which event function's; NO_CROSSING if none.

    watch_order  whether it matters that the feet pass each other
    has_ground      (2,) whether there is ground under each foot
    stance       the stance foot, which may slide
    sides        (event functions,) on which side of zero each event function is known to be: 1, -1, or NO_SIDE
    at_zero      (event functions,) which event functions the last event left at zero
    pads         whether the ground has edges
    knee         (2,) what each knee is doing
    releasing    whether the trailing knee is released when the stance foot stops sinking in
    """
    best, event = NO_CROSSING, -1
    for foot in range(2):
        if not is_free(system, foot):
            continue
        first = foot * PER_FOOT
        # a foot that an event left on the surface is inside or outside by rounding there
        lowest = finder.values[first + HEIGHT, 0] if at_zero[first + HEIGHT] == 0 else 0.0
        for j in range(1, finder.nodes.size):
            lowest = min(lowest, finder.values[first + HEIGHT, j])
        inside = has_ground[foot] != 0 and lowest < 0.0
        last = RELEASE
        if inside and frame.locate_switching:
            last = FRICTION_SWITCHES + switching_count(walker.friction)
        for index in range(first, first + last):
            if not pads and (index == first + LEFT_EDGE or index == first + RIGHT_EDGE):
                continue
            at = leaves_side(finder, index, sides[index], at_zero[index] != 0)
            if at < best:
                best, event = at, index
        if foot == stance and sides[first + HEIGHT] < 0 and has_ground[foot] != 0:
            at = leaves_side(finder, SLIDE, sides[SLIDE], at_zero[SLIDE] != 0)
            if at < best:
                best, event = at, SLIDE
    if watch_order:
        at = leaves_side(finder, PASSING, sides[PASSING], at_zero[PASSING] != 0)
        if at < best:
            best, event = at, PASSING
    at, index = knee_crossing(walker.knees, knee, releasing, stance, at_zero, finder)
    if at < best:
        best, event = at, index
    at = leaves_side(finder, FALL, sides[FALL], at_zero[FALL] != 0)
    if at < best:
        best, event = at, FALL
    return best, event


@inlined
def leaves_side(finder: CrossingFinder, event: int, side: int, zero_at_start: bool) -> float:
    """Fraction at which an event function crosses to the other side of zero than it is known to be on.

    At once if it is there already: the step before, which ended for another event, went past its zero, or on it. Of one
    that is zero at the start the way it goes tells, and rounding alone, which has not moved it from zero, does not: a
    foot whose hinge is released, say, may still sink in. One that its own event left at zero has gone its way already,
    and is back only where it is on the other side all along.
    """
    value = finder.values[event, 0]
    at_zero = zero_at_start or abs(value) < ROUNDING
    if side != NO_SIDE:
        if at_zero:
            value = way_from_zero(finder, event, CLEARLY_MOVED)
            if value == 0.0:
                return NO_CROSSING
        beyond = side * value < 0.0
        if zero_at_start:
            for j in range(1, finder.nodes.size):
                beyond = beyond and side * finder.values[event, j] < 0.0
        if beyond:
            return 0.0
    return first_crossing(finder, event, -side, 0.0, at_zero)


@inlined
def is_switching(event: int) -> bool:
    """Whether an event is a mere switching point of the force law."""
    return event < 2 * PER_FOOT and RELEASE <= event % PER_FOOT < MATERIAL
