"""Events of a walk on compliant ground, and the settings of their criteria.

The number of an event is the row of its event function in the crossing finder: PER_FOOT rows for each foot, then rows
for the walker and for its knees. Event `foot * PER_FOOT + HEIGHT` is a touch or a lift. The numbers are module
constants because kernels treat members of an IntEnum as objects and compile a third longer with them.
"""

from typing import NamedTuple

from walkerlab.physics.ground.terrain import Terrain
from walkerlab.physics.kernels import kernel_part, pass_by_reference

# event functions of each foot
HEIGHT, LEFT_EDGE, RIGHT_EDGE, RELEASE, FULL_DAMPING = range(5)
FRICTION_SWITCHES = 5  # first of up to four switching points of the friction law
MATERIAL, VERTICAL_VELOCITY = 9, 10  # position of the foot's material (m), not an event; rate of HEIGHT (m/s)
PER_FOOT = 11
# event functions of the walker
PASSING, FALL, SLIDE = range(2 * PER_FOOT, 2 * PER_FOOT + 3)
# event functions of the knees, two rows each: angle beyond straight, and its rate
EXTENSION = SLIDE + 1
EXTENSION_RATE = SLIDE + 3
EVENT_FUNCTIONS = SLIDE + 5
# It has no event function, because it is due at a fixed time.
PULSE_END = EVENT_FUNCTIONS
NO_EVENT = -1
# Row of the legs' relative angular velocity. It is no event, so it may have the number of PULSE_END, which has no row.
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
