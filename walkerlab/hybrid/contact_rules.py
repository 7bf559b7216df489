"""What a walk on compliant ground remembers, and what an event changes in it: the rules of steps, pads and falls."""

from typing import Any, NamedTuple

from walkerlab.ground.terrain import (
    carried_after_lift,
    carried_in_air,
    carried_in_cell,
    order_matters,
    stride_measure,
)
from walkerlab.ground.walker import ContactWalker, FootMotion
from walkerlab.hybrid.contact_events import (
    FALL,
    HEIGHT,
    LEFT_EDGE,
    PASSING,
    PER_FOOT,
    RIGHT_EDGE,
    SLIDE,
    farthest_slide,
    feet_motion,
)
from walkerlab.hybrid.contact_observer import ContactObserver, observe_edge
from walkerlab.hybrid.outcome import Outcome
from walkerlab.kernels import inlined
from walkerlab.solvers.system import State

AHEAD = 0.25  # of the stride measure: how far ahead a step must land
TRIP = 0.25  # of the stride measure: how far from its foothold a foot must come down to have tripped
FELL, OFF_PAD, SLID = int(Outcome.FELL), int(Outcome.OFF_PAD), int(Outcome.SLID)
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


@inlined
def happen(
    walker: ContactWalker, terrain: Any, observer: ContactObserver, ledger: Ledger, signal: int, t: float, y: State
) -> int:
    """Let an event change the ledger; returns an outcome if it ends the walk."""
    if signal == FALL:
        return FELL
    feet = feet_motion(walker, y)
    ledger.at_zero[signal] = 1
    if signal == SLIDE:
        stance = ledger.feet[STANCE]
        return SLID if ledger.carried[stance] != 0 and feet[stance].height < 0.0 else GOES_ON
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
    if ledger.carried[foot] == 0:
        return GOES_ON
    if foot == stance:
        away = abs(feet[foot].along - ledger.foothold[foot])
        return SLID if away > farthest_slide(terrain) else GOES_ON
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
