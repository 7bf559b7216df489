"""What a walk on compliant ground remembers, and what an event changes in it: the rules of steps, pads and falls."""

from typing import Any, NamedTuple

from walkerlab.ground.held import (
    BENT,
    FLEXED,
    LOCKED,
    RELEASED,
    STOPPING,
    IdealLock,
    Knees,
    NoneBends,
    OneBends,
    extension,
)
from walkerlab.ground.terrain import Terrain, has_ground_in_air, has_ground_in_cell
from walkerlab.ground.walker import ContactWalker, FootMotion
from walkerlab.hybrid.contact_events import (
    EXTENSION,
    EXTENSION_RATE,
    FALL,
    HEIGHT,
    LEFT_EDGE,
    PASSING,
    PER_FOOT,
    RIGHT_EDGE,
    SLIDE,
    VERTICAL_VELOCITY,
    farthest_slide,
    feet_motion,
    material_along,
)
from walkerlab.hybrid.contact_observer import ContactObserver, observe_edge
from walkerlab.hybrid.outcome import Outcome
from walkerlab.kernels import by_type_or_default, inlined
from walkerlab.solvers.system import State

AHEAD = 0.25  # of the stride measure: how far ahead a step must land
AT_SURFACE = 1e-11  # m: how far off the surface a foot may be, by the error of an event's time, that is at it
TRIP = 0.25  # of the stride measure: how far from where it stood a foot must come down to have tripped
FELL, OFF_PAD, SLID = int(Outcome.FELL), int(Outcome.OFF_PAD), int(Outcome.SLID)
BENT_KNEE = int(Outcome.BENT_KNEE)
GOES_ON = -1

# indices into WalkState.times
LAST_TOUCH, AIRBORNE_SINCE = 0, 1
# indices into WalkState.feet
STANCE, STEPS = 0, 1


class WalkState(NamedTuple):
    """What a walk remembers: read by its rules, and in part its result."""

    touch_time: Any  # (steps,) s
    touch_along: Any  # (steps,) m
    slip: Any  # (steps,) m, net slip of the stance foot of each step; of the last one until now, while `is_to_lift`
    rolling: Any  # (steps,) m, how far it rolled
    has_ground: Any  # (2,) whether there is ground under a foot
    cells: Any  # (2,) which cell of its lane a foot is over
    left_cells: Any  # (2,) the cell where it last stood
    foothold: Any  # (2,) m, where it touched
    touched: Any  # (2,) m, where its material was then
    stood: Any  # (2, 2) m, slip and rolling of each foot from its touch to its latest lift
    leaving: Any  # (2,) whether a foot is still to lift from the step that it carried
    knee: Any  # (2,) what each knee is doing
    releasing: Any  # (1,) whether the trailing knee is still to be released
    knee_strike: Any  # (steps + 1,) s, when the knee of the step's swing leg locked; -1 if it has not
    sides: Any  # (event functions,) on which side of zero each event function is known to be
    at_zero: Any  # (event functions,) which event functions the last event left at zero
    times: Any  # (2,) see the indices above
    feet: Any  # (2,) see the indices above


@inlined
def happen(
    walker: ContactWalker,
    terrain: Terrain,
    observer: ContactObserver,
    walk_state: WalkState,
    event: int,
    t: float,
    y: State,
) -> int:
    """Let an event change the walk state; returns an outcome if it ends the walk."""
    if event == FALL:
        return FELL
    if event == SLIDE:
        return SLID
    walk_state.at_zero[event] = 1
    if event >= EXTENSION:
        knee_stops(walker.knees, walk_state, event, t)
        return GOES_ON
    feet = feet_motion(walker, y)
    if event == PASSING:
        walk_state.sides[PASSING] = -walk_state.sides[PASSING]
        for foot in range(2):
            # equal legs of a hinged step pass each other on the surface: rounding neither lifts a foot nor holds one
            at_surface = abs(feet[foot].height) < AT_SURFACE
            above = feet[foot].vertical_velocity > 0.0 if at_surface else is_above(walk_state, foot)
            find_ground(terrain, walk_state, foot, above)
        return GOES_ON
    foot = event // PER_FOOT
    kind = event % PER_FOOT
    if kind == HEIGHT:
        walk_state.sides[event] = -walk_state.sides[event]
        if is_above(walk_state, foot):
            lift(walker, terrain, walk_state, feet, foot, y)
        else:
            return touch(walker, terrain, walk_state, feet, foot, t, y)
    elif kind == LEFT_EDGE or kind == RIGHT_EDGE:
        walk_state.at_zero[event] = 0
        walk_state.at_zero[foot * PER_FOOT + (LEFT_EDGE if kind == RIGHT_EDGE else RIGHT_EDGE)] = 1
        walk_state.cells[foot] += 1 if kind == RIGHT_EDGE else -1
        if not has_ground_in_cell(walk_state.cells[foot]):
            observe_edge(observer, walker, foot, walk_state.has_ground[foot] != 0, y)
            walk_state.has_ground[foot] = 0
        elif is_above(walk_state, foot):
            walk_state.has_ground[foot] = 1
        else:
            return OFF_PAD
    elif kind == VERTICAL_VELOCITY:
        walk_state.at_zero[event] = 0
        release(walker.knees, walk_state, 1 - foot)
    return GOES_ON


@inlined
def is_above(walk_state: WalkState, foot: int) -> bool:
    """Whether a foot is above the ground."""
    return walk_state.sides[foot * PER_FOOT + HEIGHT] > 0


@inlined
def is_to_lift(walk_state: WalkState) -> bool:
    """Whether the foot that carried the last step is still to lift from it."""
    return walk_state.leaving[1 - walk_state.feet[STANCE]] != 0


def steps_with_lift(walk_state: WalkState) -> int:
    """How many steps have a slip and a rolling, which end where their foot lifts: all, or all but the last."""
    return int(walk_state.feet[STEPS]) - int(is_to_lift(walk_state))


@inlined
def is_ahead(walk_state: WalkState, foot: int) -> bool:
    """Whether a foot is further along than the other; known where the order of the feet is watched."""
    return (walk_state.sides[PASSING] > 0) == (foot == 1)


@inlined
def find_ground(terrain: Terrain, walk_state: WalkState, foot: int, above: bool) -> None:
    """A foot above the surface may find ground, or lose it, as the feet change places or roles."""
    if above:
        stands = foot == walk_state.feet[STANCE]
        has_ground = has_ground_in_air(terrain, walk_state.has_ground[foot] != 0, stands, is_ahead(walk_state, foot))
        walk_state.has_ground[foot] = 1 if has_ground else 0


@inlined
def lift(
    walker: ContactWalker,
    terrain: Terrain,
    walk_state: WalkState,
    feet: tuple[FootMotion, FootMotion],
    foot: int,
    y: State,
) -> None:
    """A foot rose above the ground: from its stance, or out of a scuff."""
    stands = foot == walk_state.feet[STANCE]
    if stands or walk_state.leaving[foot] != 0:
        note_slip(walker, walk_state, feet, foot, y)
        if not stands:
            step = walk_state.feet[STEPS] - 1
            walk_state.slip[step], walk_state.rolling[step] = walk_state.stood[foot, 0], walk_state.stood[foot, 1]
        walk_state.leaving[foot] = 0
    find_ground(terrain, walk_state, foot, True)


@inlined
def note_slip(
    walker: ContactWalker, walk_state: WalkState, feet: tuple[FootMotion, FootMotion], foot: int, y: State
) -> None:
    """How far a foot has slipped and rolled since it touched."""
    slip = material_along(walker, foot, feet[foot].along, y) - walk_state.touched[foot]
    walk_state.stood[foot, 0] = slip
    walk_state.stood[foot, 1] = feet[foot].along - walk_state.foothold[foot] - slip


@inlined
def touch(
    walker: ContactWalker,
    terrain: Terrain,
    walk_state: WalkState,
    feet: tuple[FootMotion, FootMotion],
    foot: int,
    t: float,
    y: State,
) -> int:
    """A foot came down on ground.

    It ends the step if it is the swing foot, on another pad than it left and far enough ahead. A swing foot that comes
    down on the pad it left, away from where it stood, has tripped over it: it scuffs.
    """
    stance = walk_state.feet[STANCE]
    if walk_state.has_ground[foot] == 0:
        return GOES_ON
    material = material_along(walker, foot, feet[foot].along, y)
    if foot == stance:
        return SLID if abs(material - walk_state.touched[foot]) > farthest_slide(terrain) else GOES_ON
    measure = terrain.stride_measure
    if terrain.has_pads and walk_state.cells[foot] == walk_state.left_cells[foot]:
        away = abs(feet[foot].along - walk_state.foothold[foot] - walk_state.stood[foot, 1])
        return OFF_PAD if away > TRIP * measure else GOES_ON
    if feet[foot].along - feet[stance].along < AHEAD * measure:
        return GOES_ON
    if not is_straight(walker.knees, walk_state, foot):
        return BENT_KNEE
    step = walk_state.feet[STEPS]
    walk_state.touch_time[step] = t
    walk_state.touch_along[step] = feet[foot].along
    if not is_above(walk_state, stance):
        note_slip(walker, walk_state, feet, stance, y)
        walk_state.leaving[stance] = 1
    walk_state.slip[step], walk_state.rolling[step] = walk_state.stood[stance, 0], walk_state.stood[stance, 1]
    walk_state.foothold[foot] = feet[foot].along
    walk_state.touched[foot] = material
    walk_state.left_cells[foot] = walk_state.cells[foot]
    walk_state.leaving[foot] = 0
    walk_state.times[LAST_TOUCH] = t
    walk_state.feet[STANCE] = foot
    walk_state.feet[STEPS] = step + 1
    find_ground(terrain, walk_state, stance, is_above(walk_state, stance))
    follow_strike(walker.knees, walk_state, stance)
    return GOES_ON


@by_type_or_default
def knee_stops(knees: Any, walk_state: WalkState, event: int, t: float) -> None:
    """A knee got straight, or turned back in its stop."""


@by_type_or_default
def release(knees: Any, walk_state: WalkState, knee: int) -> None:
    """A knee is free again."""


@by_type_or_default
def is_straight(knees: Any, walk_state: WalkState, foot: int) -> bool:
    """Whether a foot may come down: its knee is locked."""
    return True


@by_type_or_default
def follow_strike(knees: Any, walk_state: WalkState, trailing: int) -> None:
    """The other foot has touched: the trailing knee is released, or is to be."""


@by_type_or_default
def note_flexion(knees: Any, walk_state: WalkState, y: State) -> None:
    """A released knee that has bent is caught when it straightens."""


@by_type_or_default
def catches(stop: Any) -> bool:
    """Whether a knee that gets straight locks at once; a compliant stop turns it back first."""
    return False


@catches.case(IdealLock)
def lock_catches(stop: IdealLock) -> bool:
    """It does."""
    return True


@knee_stops.case(Knees)
def knee_locks(knees: Knees, walk_state: WalkState, event: int, t: float) -> None:
    """It locks, or meets its stop, where it latches when it turns back."""
    if event < EXTENSION_RATE and not catches(knees.stop):
        walk_state.knee[(event - EXTENSION) % 2] = STOPPING
        return
    note_lock(walk_state, event, t)


@knee_stops.case(OneBends)
def bent_knee_locks(knees: OneBends, walk_state: WalkState, event: int, t: float) -> None:
    """At once."""
    note_lock(walk_state, event, t)


@inlined
def note_lock(walk_state: WalkState, event: int, t: float) -> None:
    """The knee of the step's swing leg is locked from now on."""
    walk_state.at_zero[event] = 0
    walk_state.knee[(event - EXTENSION) % 2] = LOCKED
    walk_state.knee_strike[walk_state.feet[STEPS]] = t


@release.case(Knees)
@release.case(OneBends)
@release.case(NoneBends)
def knee_is_released(knees: Any, walk_state: WalkState, knee: int) -> None:
    """Its shank turns on its own."""
    walk_state.releasing[0] = 0
    walk_state.knee[knee] = RELEASED


@is_straight.case(Knees)
@is_straight.case(OneBends)
def knee_is_straight(knees: Any, walk_state: WalkState, foot: int) -> bool:
    """Its knee is locked."""
    return walk_state.knee[foot] == LOCKED


@follow_strike.case(Knees)
@follow_strike.case(OneBends)
@follow_strike.case(NoneBends)
def knee_follows(knees: Any, walk_state: WalkState, trailing: int) -> None:
    """At once, or when the leading foot stops sinking in."""
    if knees.release_at_touch:
        release(knees, walk_state, trailing)
    else:
        walk_state.releasing[0] = 1


@note_flexion.case(Knees)
@note_flexion.case(OneBends)
def knees_flex(knees: Any, walk_state: WalkState, y: State) -> None:
    """Those that can bend."""
    for knee in range(2):
        if walk_state.knee[knee] == RELEASED and extension(knees, knee, y, 2) < -FLEXED:
            walk_state.knee[knee] = BENT
