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
    NoKnees,
    NoneBends,
    OneBends,
    extension,
)
from walkerlab.ground.normal_force import NormalLaw
from walkerlab.ground.terrain import (
    carried_in_air,
    carried_in_cell,
    has_pads,
    stride_measure,
)
from walkerlab.ground.walker import ContactWalker, FootMotion
from walkerlab.hybrid.contact_events import (
    CLIMB,
    EXTENSION,
    EXTENSION_RATE,
    FALL,
    HEIGHT,
    LEFT_EDGE,
    PASSING,
    PER_FOOT,
    RIGHT_EDGE,
    SLIDE,
    farthest_slide,
    feet_motion,
    material_along,
)
from walkerlab.hybrid.contact_observer import ContactObserver, observe_edge
from walkerlab.hybrid.outcome import Outcome
from walkerlab.kernels import by_type, inlined
from walkerlab.solvers.system import State

AHEAD = 0.25  # of the stride measure: how far ahead a step must land
TRIP = 0.25  # of the stride measure: how far from where it stood a foot must come down to have tripped
FELL, OFF_PAD, SLID = int(Outcome.FELL), int(Outcome.OFF_PAD), int(Outcome.SLID)
BENT_KNEE = int(Outcome.BENT_KNEE)
GOES_ON = -1

# indices into Ledger.times
LAST_TOUCH, AIRBORNE_SINCE = 0, 1
# indices into Ledger.feet
STANCE, STEPS = 0, 1


class Ledger(NamedTuple):
    """What a walk remembers: read by its rules, and in part its result."""

    touch_time: Any  # (steps,) s
    touch_along: Any  # (steps,) m
    slip: Any  # (steps,) m, net slip of the stance foot of each step; of the last one until now, while `is_to_lift`
    rolling: Any  # (steps,) m, how far it rolled
    carried: Any  # (2,) whether there is ground under a foot
    cells: Any  # (2,) which cell of its lane a foot is over
    left_cells: Any  # (2,) the cell where it last stood
    foothold: Any  # (2,) m, where it touched
    touched: Any  # (2,) m, where its material was then
    stood: Any  # (2, 2) m, slip and rolling of each foot from its touch to its latest lift
    leaving: Any  # (2,) whether a foot is still to lift from the step that it carried
    knee: Any  # (2,) what each knee is doing
    releasing: Any  # (1,) whether the trailing knee is still to be released
    knee_strike: Any  # (steps + 1,) s, when the knee of the step's swing leg locked; -1 if it has not
    sides: Any  # (signals,) on which side of zero each signal is known to be
    at_zero: Any  # (signals,) which signals the last event left at zero
    times: Any  # (2,) see the indices above
    feet: Any  # (2,) see the indices above


@inlined
def happen(
    walker: ContactWalker, terrain: Any, observer: ContactObserver, ledger: Ledger, signal: int, t: float, y: State
) -> int:
    """Let an event change the ledger; returns an outcome if it ends the walk."""
    if signal == FALL:
        return FELL
    if signal == SLIDE:
        return SLID
    ledger.at_zero[signal] = 1
    if signal >= EXTENSION:
        knee_stops(walker.knees, ledger, signal, t)
        return GOES_ON
    feet = feet_motion(walker, y)
    if signal == PASSING:
        ledger.sides[PASSING] = -ledger.sides[PASSING]
        for foot in range(2):
            pass_by(terrain, ledger, foot)
        return GOES_ON
    foot = signal // PER_FOOT
    kind = signal % PER_FOOT
    if kind == HEIGHT:
        ledger.sides[signal] = -ledger.sides[signal]
        if is_above(ledger, foot):
            lift(walker, terrain, ledger, feet, foot, y)
        else:
            return touch(walker, terrain, ledger, feet, foot, t, y)
    elif kind == LEFT_EDGE or kind == RIGHT_EDGE:
        ledger.at_zero[signal] = 0
        ledger.at_zero[foot * PER_FOOT + (LEFT_EDGE if kind == RIGHT_EDGE else RIGHT_EDGE)] = 1
        ledger.cells[foot] += 1 if kind == RIGHT_EDGE else -1
        if not carried_in_cell(terrain, ledger.cells[foot]):
            observe_edge(observer, walker, foot, ledger.carried[foot] != 0, y)
            ledger.carried[foot] = 0
        elif is_above(ledger, foot):
            ledger.carried[foot] = 1
        else:
            return OFF_PAD
    elif kind == CLIMB:
        ledger.at_zero[signal] = 0
        release(walker.knees, ledger, 1 - foot)
    return GOES_ON


@inlined
def is_above(ledger: Ledger, foot: int) -> bool:
    """Whether a foot is above the ground."""
    return ledger.sides[foot * PER_FOOT + HEIGHT] > 0


@inlined
def is_to_lift(ledger: Ledger) -> bool:
    """Whether the foot that carried the last step is still to lift from it."""
    return ledger.leaving[1 - ledger.feet[STANCE]] != 0


def steps_with_lift(ledger: Ledger) -> int:
    """How many steps have a slip and a rolling, which end where their foot lifts: all, or all but the last."""
    return int(ledger.feet[STEPS]) - int(is_to_lift(ledger))


@inlined
def is_ahead(ledger: Ledger, foot: int) -> bool:
    """Whether a foot is further along than the other; known where the order of the feet is watched."""
    return (ledger.sides[PASSING] > 0) == (foot == 1)


@inlined
def pass_by(terrain: Any, ledger: Ledger, foot: int) -> None:
    """The feet changed places: one that is in the air may find ground, or lose it."""
    if is_above(ledger, foot):
        stands = foot == ledger.feet[STANCE]
        carried = carried_in_air(terrain, ledger.carried[foot] != 0, stands, is_ahead(ledger, foot))
        ledger.carried[foot] = 1 if carried else 0


@inlined
def lift(
    walker: ContactWalker, terrain: Any, ledger: Ledger, feet: tuple[FootMotion, FootMotion], foot: int, y: State
) -> None:
    """A foot rose above the ground: from its stance, or out of a scuff."""
    stands = foot == ledger.feet[STANCE]
    if stands or ledger.leaving[foot] != 0:
        note_slip(walker, ledger, feet, foot, y)
        if not stands:
            step = ledger.feet[STEPS] - 1
            ledger.slip[step], ledger.rolling[step] = ledger.stood[foot, 0], ledger.stood[foot, 1]
        ledger.leaving[foot] = 0
    carried = carried_in_air(terrain, ledger.carried[foot] != 0, stands, is_ahead(ledger, foot))
    ledger.carried[foot] = 1 if carried else 0


@inlined
def note_slip(walker: ContactWalker, ledger: Ledger, feet: tuple[FootMotion, FootMotion], foot: int, y: State) -> None:
    """How far a foot has slipped and rolled since it touched."""
    slip = material_along(walker, foot, feet[foot].along, y) - ledger.touched[foot]
    ledger.stood[foot, 0] = slip
    ledger.stood[foot, 1] = feet[foot].along - ledger.foothold[foot] - slip


@inlined
def touch(
    walker: ContactWalker,
    terrain: Any,
    ledger: Ledger,
    feet: tuple[FootMotion, FootMotion],
    foot: int,
    t: float,
    y: State,
) -> int:
    """A foot came down on ground.

    It ends the step if it is the swing foot, on another pad than it left and far enough ahead. A swing foot that comes
    down on the pad it left, away from where it stood, has tripped over it: it scuffs.
    """
    stance = ledger.feet[STANCE]
    if foot != stance and ledger.at_zero[PASSING] != 0:
        # it passes the other one at this instant, as equal hinged legs do: it has not been above the ground ahead
        ledger.carried[foot] = carried_in_air(terrain, ledger.carried[foot] != 0, False, False)
    if ledger.carried[foot] == 0:
        return GOES_ON
    material = material_along(walker, foot, feet[foot].along, y)
    if foot == stance:
        return SLID if abs(material - ledger.touched[foot]) > farthest_slide(terrain) else GOES_ON
    measure = stride_measure(terrain)
    if has_pads(terrain) and ledger.cells[foot] == ledger.left_cells[foot]:
        away = abs(feet[foot].along - ledger.foothold[foot] - ledger.stood[foot, 1])
        return OFF_PAD if away > TRIP * measure else GOES_ON
    if feet[foot].along - feet[stance].along < AHEAD * measure:
        return GOES_ON
    if not is_straight(walker.knees, ledger, foot):
        return BENT_KNEE
    step = ledger.feet[STEPS]
    ledger.touch_time[step] = t
    ledger.touch_along[step] = feet[foot].along
    if not is_above(ledger, stance):
        note_slip(walker, ledger, feet, stance, y)
        ledger.leaving[stance] = 1
    ledger.slip[step], ledger.rolling[step] = ledger.stood[stance, 0], ledger.stood[stance, 1]
    ledger.foothold[foot] = feet[foot].along
    ledger.touched[foot] = material
    ledger.left_cells[foot] = ledger.cells[foot]
    ledger.leaving[foot] = 0
    ledger.times[LAST_TOUCH] = t
    ledger.feet[STANCE] = foot
    ledger.feet[STEPS] = step + 1
    pass_by(terrain, ledger, stance)
    follow_strike(walker.knees, ledger, stance)
    return GOES_ON


@by_type
def knee_stops(knees: Any, ledger: Ledger, signal: int, t: float) -> None:
    """A knee got straight, or turned back in its stop."""


@by_type
def release(knees: Any, ledger: Ledger, knee: int) -> None:
    """A knee is free again."""


@by_type
def is_straight(knees: Any, ledger: Ledger, foot: int) -> bool:
    """Whether a foot may come down: its knee is locked."""


@by_type
def follow_strike(knees: Any, ledger: Ledger, trailing: int) -> None:
    """The other foot has touched: the trailing knee is released, or is to be."""


@by_type
def note_flexion(knees: Any, ledger: Ledger, y: State) -> None:
    """A released knee that has bent is caught when it straightens."""


@by_type
def catches(stop: Any) -> bool:
    """Whether a knee that gets straight locks at once."""


@catches.case(IdealLock)
def lock_catches(stop: IdealLock) -> bool:
    """Yes."""
    return True


@catches.case(NormalLaw)
def stop_catches(stop: NormalLaw) -> bool:
    """Its stop turns it back first."""
    return False


@knee_stops.case(NoKnees)
@knee_stops.case(NoneBends)
def nothing_stops(knees: Any, ledger: Ledger, signal: int, t: float) -> None:
    """Nothing."""


@release.case(NoKnees)
def nothing_is_released(knees: NoKnees, ledger: Ledger, knee: int) -> None:
    """Nothing."""


@is_straight.case(NoKnees)
@is_straight.case(NoneBends)
def always_straight(knees: Any, ledger: Ledger, foot: int) -> bool:
    """Yes."""
    return True


@follow_strike.case(NoKnees)
def nothing_follows(knees: NoKnees, ledger: Ledger, trailing: int) -> None:
    """Nothing."""


@note_flexion.case(NoKnees)
@note_flexion.case(NoneBends)
def nothing_flexes(knees: Any, ledger: Ledger, y: State) -> None:
    """Nothing."""


@knee_stops.case(Knees)
def knee_locks(knees: Knees, ledger: Ledger, signal: int, t: float) -> None:
    """It locks, or meets its stop, where it latches when it turns back."""
    if signal < EXTENSION_RATE and not catches(knees.stop):
        ledger.knee[(signal - EXTENSION) % 2] = STOPPING
        return
    note_lock(ledger, signal, t)


@knee_stops.case(OneBends)
def bent_knee_locks(knees: OneBends, ledger: Ledger, signal: int, t: float) -> None:
    """At once."""
    note_lock(ledger, signal, t)


@inlined
def note_lock(ledger: Ledger, signal: int, t: float) -> None:
    """The knee of the step's swing leg is locked from now on."""
    ledger.at_zero[signal] = 0
    ledger.knee[(signal - EXTENSION) % 2] = LOCKED
    ledger.knee_strike[ledger.feet[STEPS]] = t


@release.case(Knees)
@release.case(OneBends)
@release.case(NoneBends)
def knee_is_released(knees: Any, ledger: Ledger, knee: int) -> None:
    """Its shank turns on its own."""
    ledger.releasing[0] = 0
    ledger.knee[knee] = RELEASED


@is_straight.case(Knees)
@is_straight.case(OneBends)
def knee_is_straight(knees: Any, ledger: Ledger, foot: int) -> bool:
    """Its knee is locked."""
    return ledger.knee[foot] == LOCKED


@follow_strike.case(Knees)
@follow_strike.case(OneBends)
@follow_strike.case(NoneBends)
def knee_follows(knees: Any, ledger: Ledger, trailing: int) -> None:
    """At once, or when the leading foot stops sinking in."""
    if knees.release_at_touch:
        release(knees, ledger, trailing)
    else:
        ledger.releasing[0] = 1


@note_flexion.case(Knees)
@note_flexion.case(OneBends)
def knees_flex(knees: Any, ledger: Ledger, y: State) -> None:
    """Those that can bend."""
    for knee in range(2):
        if ledger.knee[knee] == RELEASED and extension(knees, knee, y, 2) < -FLEXED:
            ledger.knee[knee] = BENT
