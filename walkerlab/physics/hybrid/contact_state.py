"""State of a walk on compliant ground apart from its coordinates: stance, contacts, signs of the event functions.

This module also defines the events and the settings of their criteria. The number of an event is the row of its event
function in the crossing finder: PER_FOOT rows for each foot, then rows for the walker and for its knees. Event
`foot * PER_FOOT + HEIGHT` is a touch or a lift. The numbers are module constants because kernels treat members of an
IntEnum as objects and take a third longer to compile with them.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.knees import MIN_FLEXION, extension, extension_rate
from walkerlab.physics.ground.terrain import Terrain, cell_at, has_ground_in_cell, starts_with_ground
from walkerlab.physics.ground.walker import BENT, LOCKED, RELEASED, ContactWalker, FootMotion, GroundModel, WalkProgress
from walkerlab.physics.hybrid.endings import ON_GROUND, STRAIGHT_KNEE
from walkerlab.physics.kernels import kernel_part, pass_by_reference
from walkerlab.physics.solvers.system import State

# event functions of each foot
HEIGHT, LEFT_EDGE, RIGHT_EDGE, RELEASE, FULL_DAMPING = range(5)
FRICTION_SWITCHES = 5  # first of up to four switching points of the friction law
# position of the foot's material (m), which is not an event function, and rate of HEIGHT (m/s)
MATERIAL, VERTICAL_VELOCITY = 9, 10
PER_FOOT = 11
# event functions of the walker
PASSING, FALL, SLIDE = range(2 * PER_FOOT, 2 * PER_FOOT + 3)
# event functions of the knees, two rows each: angle beyond straight, and its rate
EXTENSION = SLIDE + 1
EXTENSION_RATE = SLIDE + 3
EVENT_FUNCTIONS = SLIDE + 5
# The end of a pulse has no event function, because it is due at a fixed time.
PULSE_END = EVENT_FUNCTIONS
NO_EVENT = -1
# Row of the legs' relative angular velocity, which is not an event function. PULSE_END has no row, so the two may share
# a number.
LEGS_TURN = EVENT_FUNCTIONS
EVENT_ROWS = EVENT_FUNCTIONS + 1
FARTHEST_SLIDE = 0.25  # largest slide of a stance foot's material from where it touched, as a fraction of the pitch


class Frame(NamedTuple):
    """Values that the event criteria use: the walker's scales, and whether to locate the law's switching points."""

    leg_length: float  # m
    pendulum_time: float  # s, sqrt(L/g)
    locate_switching: bool  # whether solver steps end at the switching points of the force law


@pass_by_reference
class JudgedGround(NamedTuple):
    """Ground of a walk, with the criteria for its events."""

    terrain: Terrain
    frame: Frame


@kernel_part
def farthest_slide(terrain: Terrain) -> float:
    return FARTHEST_SLIDE * terrain.pitch


@kernel_part
def is_switching(event: int) -> bool:
    """Whether an event is only a switching point of the force law."""
    return event < 2 * PER_FOOT and RELEASE <= event % PER_FOOT < MATERIAL


# release of the trailing knee: not due, due when the leading foot stops sinking in, due when the push-off ends
NOT_DUE, AT_COMPRESSION, AT_PULSE_END = range(3)
START_ROUNDING = 1e-14  # relative rounding error of a start's coordinates and velocities


@pass_by_reference
class WalkState(NamedTuple):
    """State of a walk apart from its coordinates. Events change it, and the result is gathered from it."""

    ground: JudgedGround
    touch_time: Any  # (steps,) s
    touch_along: Any  # (steps,) m
    touch_height: Any  # (steps,) m, height of the foothold above the slope
    # (steps,) m, net slip of each step's stance foot from touchdown to lift-off, or to the other foot's touchdown if it
    # has not lifted off yet
    slip: Any
    rolling: Any  # (steps,) m, rolling distance of each step's stance foot
    # (steps,) s, time at which each step's stance foot lifted off or, if it has not yet, the other foot touched down
    lift_time: Any
    has_ground: Any  # (2,) whether there is ground under a foot
    level: Any  # (2,) m, height of the ground above the slope, for each foot
    cells: Any  # (2,) number of the cell below each foot, in the foot's lane of pads
    left_cells: Any  # (2,) number of the cell on which each foot last stood
    foothold: Any  # (2,) m, position of each foot's last touch that ended a step
    touched: Any  # (2,) m, `material_along` of each foot at that touch
    slipped: Any  # (2,) m, slip of each foot from that touch to its latest lift
    rolled: Any  # (2,) m, rolling distance of each foot in the same time
    lifted: Any  # (2,) s, time of each foot's latest lift
    leaving: Any  # (2,) whether a foot is the former stance foot and has not lifted yet
    knee: Any  # (2,) state of each knee
    knee_strike: Any  # (steps + 1,) s, time at which the swing leg's knee locked in each step; -1 if it did not
    sides: Any  # (event functions,) side of zero that each event function leaves at its event: 1, -1, or 0 for either
    at_zero: Any  # (event functions,) whether the last event left each event function at zero
    progress: WalkProgress


# fields of a `WalkState` with a value for each step
STEP_FIELDS = ("touch_time", "touch_along", "touch_height", "slip", "rolling", "lift_time")


def new_walk_state(walker: ContactWalker, ground: JudgedGround, stance: int, steps: int, y: State) -> WalkState:
    feet = forms.feet_motion(walker.whole, y)
    terrain = ground.terrain
    cells = np.array([cell_at(terrain, foot, feet[foot].along) for foot in range(2)], np.int64)
    has_ground = np.zeros(2, np.int8)
    sides, at_zero = initial_sides(walker, feet, stance, y)
    for foot in range(2):
        on_pad = has_ground_in_cell(int(cells[foot]))
        # A swing foot that starts above the ground and ahead of the stance foot may land, even if the order of the feet
        # matters.
        coming_down = sides[foot * PER_FOOT + HEIGHT] > 0 and (sides[PASSING] > 0) == (foot == 1)
        has_ground[foot] = on_pad and (starts_with_ground(terrain, foot == stance) or coming_down)
    return WalkState(
        ground=ground,
        **{name: np.zeros(steps) for name in STEP_FIELDS},
        has_ground=has_ground,
        level=np.zeros(2),
        cells=cells,
        left_cells=cells.copy(),
        foothold=np.array([motion.along for motion in feet]),
        touched=np.array([material_along(walker.whole, foot, feet[foot].along, y) for foot in range(2)]),
        slipped=np.zeros(2),
        rolled=np.zeros(2),
        lifted=np.zeros(2),
        knee=knees_at_start(walker, stance, y),
        knee_strike=np.full(steps + 1, -1.0),
        leaving=np.zeros(2, np.int8),
        sides=sides,
        at_zero=at_zero,
        progress=forms.new_progress(stance),
    )


def knees_at_start(walker: ContactWalker, stance: int, y: State) -> NDArray[np.int8]:
    """Return the state of each knee (2,) at the start: locked in the stance leg, released or bent in the swing leg.

    If the swing leg is straight and its foot is not on the ground, its knee has already locked in this swing.
    """
    knee = np.full(2, RELEASED, np.int8)
    swing = 1 - stance
    whole = walker.whole
    if walker.kneed:
        knee[whole.has_knee == 0] = LOCKED
        knee[stance] = LOCKED
        if extension(whole, swing, y) < -MIN_FLEXION:
            knee[swing] = BENT
        straight = max(abs(extension(whole, swing, y)), abs(extension_rate(whole, swing, y))) < STRAIGHT_KNEE
        heights = [foot.height for foot in forms.feet_motion(whole, y)]
        # The longest lever stands for the leg length, which a ContactWalker does not contain.
        if straight and abs(heights[0] - heights[1]) > ON_GROUND * abs(whole.foot_y[0]).max():
            knee[swing] = LOCKED
    return knee


def initial_sides(
    walker: ContactWalker, feet: tuple[FootMotion, FootMotion], stance: int, y: State
) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Return the side of zero of every event function at the start, and whether each is zero to rounding."""
    # A function that is zero takes the side towards which its rate points. If the rate is also zero, a foot on the
    # ground counts as below it, and the stance foot counts as ahead of a foot beside it.
    sides = np.zeros(EVENT_FUNCTIONS, np.int8)
    at_zero = np.zeros(EVENT_FUNCTIONS, np.int8)
    sides[[FALL, SLIDE, EXTENSION_RATE, EXTENSION_RATE + 1]] = 1
    sides[[EXTENSION, EXTENSION + 1]] = -1
    n = int(walker.whole.bodies)
    whole = walker.whole
    size = float(max(np.abs(whole.foot_x[0]).max(), np.abs(whole.foot_y[0]).max()))
    speed = max(abs(float(x)) for x in y[2 + n :])
    for foot in range(2):
        first = foot * PER_FOOT
        sides[[first + LEFT_EDGE, first + RIGHT_EDGE]], sides[first + VERTICAL_VELOCITY] = 1, -1
        signs = (feet[foot].height, feet[foot].vertical_velocity)
        sides[first + HEIGHT], at_zero[first + HEIGHT] = zero_side(signs, (size, speed), -1)
    # velocities of the contact points: slip without the part that the turning ball adds
    rates = [feet[k].slip - float(whole.rolling[k, :n] @ np.array(y[4 + n :])) for k in range(2)]
    order = (feet[1].along - feet[0].along, rates[1] - rates[0])
    sides[PASSING], at_zero[PASSING] = zero_side(order, (size, speed), 1 if stance == 1 else -1)
    return sides, at_zero


def zero_side(value_and_rate: tuple[float, float], scales: tuple[float, float], otherwise: int) -> tuple[int, bool]:
    """Return the side of zero on which a value lies, 1 or -1, and whether the value is zero.

    If it is zero, its rate decides. If the rate is zero, too, the side is `otherwise`.
    """
    for value, scale in zip(value_and_rate, scales, strict=True):
        if abs(value) > START_ROUNDING * scale:
            # The loop gets to the second value only if the first one is zero.
            return (1 if value > 0.0 else -1), value is not value_and_rate[0]
    return otherwise, True


@kernel_part
def material_along(form: GroundModel, foot: int, along: float, y: Any) -> float:
    """Compute the position (m) that a foot at `along` (m) would have without rolling. Its change is slip."""
    # The velocity of the material point at the bottom of the ball is that of the contact point plus radius times
    # angular velocity, so the displacements differ by radius times the change of the angle.
    for k in range(form.bodies):
        along += form.rolling[foot, k] * y[form.places + k]
    return along


@kernel_part
def is_above(walk_state: WalkState, foot: int) -> bool:
    return walk_state.sides[foot * PER_FOOT + HEIGHT] > 0


@kernel_part
def is_ahead(walk_state: WalkState, foot: int) -> bool:
    """Whether a foot is ahead of the other. This is valid only where the order of the feet is watched."""
    return (walk_state.sides[PASSING] > 0) == (foot == 1)


@kernel_part
def has_not_lifted(walk_state: WalkState) -> bool:
    """Whether the foot that carried the last step has not lifted yet."""
    return walk_state.leaving[1 - walk_state.progress.stance] != 0


def steps_with_lift(walk_state: WalkState) -> int:
    """Count the steps whose slip and rolling are final: all, or all but the last if its stance foot has not lifted."""
    return int(walk_state.progress.steps) - int(has_not_lifted(walk_state))
