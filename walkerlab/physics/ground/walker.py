"""Walker on compliant ground: a tree of bodies with ball feet.

The form of the walker depends on which knees are locked and on whether a foot is pinned.

The state is (along, height, theta_1 .. theta_n) and their rates: the position (m) of the centre of mass along the slope
(positive downhill) and above it, and the bodies' absolute angles (rad) from the vertical. While an ideal lock holds a
knee, thigh and shank are one body: theta = S z with a column of S for each group of bodies that turn together. The
tree's constants become S^T A S, S^T B S and S^T c, every lever and radius S^T d, and the form is an ordinary walker of
fewer bodies. While the first stance foot is pinned, the root is the hinge and the state is the angles and their rates.
"""

import math
from typing import Any, NamedTuple, cast

import numpy as np

from walkerlab.physics.ground.friction import friction_coefficient
from walkerlab.physics.ground.normal_force import NormalForce, NormalLaw, normal_force
from walkerlab.physics.kernels import kernel_part, pass_by_reference, vector
from walkerlab.physics.mechanics import tree
from walkerlab.physics.mechanics.hinges import HIP_ROW
from walkerlab.physics.mechanics.tree import lever_motion
from walkerlab.physics.solvers.system import Floats, Integers, State

MAX_BODIES = 8
# Kernels read the length of scratch arrays from these tuples, since it must be known at compile time.
BODY_VECTOR = (0.0,) * MAX_BODIES
STATE_VECTOR = (0.0,) * (4 + 2 * MAX_BODIES)
NO_FOOT = -1
FIRST_KNEE = HIP_ROW + 1  # row of the first knee in `hinges` and `laws`
# states of a knee
RELEASED, BENT, STOPPING, LOCKED = range(4)


@tree.fast_fields
class GroundModel(tree.Mechanism):  # type: ignore[misc]  # as for Mechanism
    """Structured scalar with the constants (SI) of the walker in one form: free or pinned, some knees locked."""

    # The arrays have room for MAX_BODIES, so that one compiled walk serves all walkers. Only n entries are used. The
    # rows of `hinges` are the hip (uppermost body of the first leg, then of the second) and each knee (shank, then
    # thigh). Both indices of a knee are equal while its bodies are merged into one, and in a leg without a knee,
    # which is always locked. E holds a single reduction.

    bodies: int  # [n]
    places: int  # number of root coordinates before the angles: 2, or 0 for a pinned form
    pinned: int  # index of the pinned foot; NO_FOOT in a free form
    kneed: bool
    has_knee: Integers  # (2,) whether each leg has a knee
    release_at_touch: bool  # whether the trailing knee is released at the touch, before the leading foot has sunk in
    foot_x: Floats  # (2, n) m, levers from the root to the centres of the ball feet, in the bodies' frames
    foot_y: Floats
    rolling: Floats  # (2, n) m, radius of each ball in the column of its body, zero in all others
    radius: Floats  # (2,) m, radii of the balls
    hip_x: Floats  # (n,) m, levers from the root to the hip
    hip_y: Floats
    push_offs: Floats  # (2,) N s, impulse of each foot's pulse; `push_off` is the larger one
    push_off_duration: float  # s
    onto: Integers  # (bodies of the walker,) index of the body of this form that contains each of the walker's bodies
    first: Integers  # (n,) for each body of this form, index of the first of the walker's bodies that make it up
    root_height: float  # m, height of the hinge above the slope

    @property
    def knees(self) -> Integers:
        """Indices (2, 2) of the shank and thigh of each leg."""
        return np.asarray(self.hinges[FIRST_KNEE:])


FORM_SHAPES: dict[str, tuple[int, ...]] = {
    **tree.mechanism_shapes(MAX_BODIES, 1, 3),
    **dict.fromkeys(("hip_x", "hip_y", "onto", "first"), (MAX_BODIES,)),
    **dict.fromkeys(("foot_x", "foot_y", "rolling"), (2, MAX_BODIES)),
    **dict.fromkeys(("radius", "push_offs", "has_knee"), (2,)),
}


class ContactWalker(NamedTuple):
    forms: Any  # (2, 4) records: row 0 with both feet free, row 1 with a foot pinned; columns by `locked_knees`
    normal: NormalLaw
    friction: Any  # a FrictionLaw
    stop: Any  # stop of both knees: IdealLock, or the Impact law (rad, N m) of a compliant stop
    legs: Integers  # (2, bodies of a leg) indices of each leg's bodies from the hip down

    @property
    def whole(self) -> GroundModel:
        """Free form with all bodies and no knee locked."""
        return cast(GroundModel, self.forms[0, 0])

    @property
    def size(self) -> int:
        return int(4 + 2 * self.whole.bodies)

    @property
    def mass(self) -> float:
        return float(self.whole.mass)

    @property
    def slope(self) -> float:
        return float(self.whole.slope)

    @property
    def gravity_along(self) -> float:
        """Gravity along the slope, m/s^2."""
        return float(self.whole.gravity_along)

    @property
    def gravity_down(self) -> float:
        """Component of gravity normal to the slope, positive into the ground, m/s^2."""
        return float(self.whole.gravity_down)

    @property
    def driven(self) -> bool:
        return self.whole.driven

    @property
    def gravity(self) -> float:
        return math.hypot(self.gravity_along, self.gravity_down)

    @property
    def kneed(self) -> bool:
        return bool(self.whole.kneed)


def changed_forms(walker: ContactWalker, **fields: Any) -> ContactWalker:
    forms = walker.forms.copy()
    tree.write_fields(forms, fields)
    return walker._replace(forms=forms)


@tree.fast_fields
class WalkProgress(np.record):  # type: ignore[misc]  # NumPy's stubs call one of its bases final
    stance: int  # stance foot of the present step
    steps: int  # number of completed steps
    last_touch: float  # s, time of the touch that began the present step
    airborne_since: float  # s, last time at which a foot was on the ground
    stopped_at: float  # s, time that the integration has reached
    release: int  # event that will release the trailing knee, as numbered in hybrid/contact_state.py
    passes_switching: bool  # whether the present solver step may pass switching points


PROGRESS = tree.record_type(WalkProgress, {})


def new_progress(stance: int = 1, steps: int = 0, last_touch: float = 0.0) -> WalkProgress:
    """Create the progress record of a walk after `steps` steps, with the walker on foot `stance`.

    last_touch  s, time at which the last step ended
    """
    return cast(WalkProgress, tree.new_record(PROGRESS, stance=stance, steps=steps, last_touch=last_touch))


@pass_by_reference
class OnGround(NamedTuple):
    """Walker in one form on the ground, with variables that the walk may change without changing the form."""

    form: GroundModel
    normal: NormalLaw
    friction: Any
    stop: Any
    has_ground: Any  # (2,) whether there is ground under each foot
    knee: Any  # (2,) state of each knee
    level: Any  # (2,) m, height of the ground under each foot, above the slope
    progress: WalkProgress


def place_on_ground(
    walker: ContactWalker,
    has_ground: Any,
    knee: Any = (RELEASED, RELEASED),
    pinned: bool = False,
    level: Any = (0.0, 0.0),
    progress: WalkProgress | None = None,
) -> OnGround:
    """Return the walker on the ground, by default standing on foot 1, in the form that fits the states of its knees.

    level  (2,) m, height of the ground under each foot
    """
    # Convert to arrays of fixed types, because kernels would be compiled again for others.
    memory = np.asarray(has_ground, np.int8), np.asarray(knee, np.int8), np.asarray(level, float)
    form = walker.forms[int(pinned), locked_knees(knee)]
    progress = new_progress() if progress is None else progress
    return OnGround(form, walker.normal, walker.friction, walker.stop, *memory, progress)


@kernel_part
def locked_knees(knee: Any) -> int:
    """Return the index of the form in which these knees are locked: 0 for none, 1 or 2 for one, 3 for both."""
    return (1 if knee[0] == LOCKED else 0) + (2 if knee[1] == LOCKED else 0)


class FootMotion(NamedTuple):
    along: float  # m, position along the slope
    height: float  # m, above the slope (after `relative_to_ground`: above the foot's ground, negative inside it)
    slip: float  # m/s, velocity of the ball's material at its lowest point, along the slope
    vertical_velocity: float  # m/s, rate of the height


@kernel_part
def half_size(form: GroundModel) -> int:
    return form.places + form.bodies


@kernel_part
def sines_cosines(form: GroundModel, y: Any, s: Any, c: Any) -> None:
    """Write sines and cosines (n,) of the bodies' angles from the slope's normal into s and c."""
    tree.sines_cosines(form, form.bodies, y[form.places : half_size(form)], s, c)


@kernel_part
def root_position(form: GroundModel, y: Any) -> tuple[float, float]:
    """Return the position of the root along the slope and above it (m). Along the slope, a pinned hinge is at 0."""
    return (y[0], y[1]) if form.places > 0 else (0.0, form.root_height)


@kernel_part
def foot_motion(form: GroundModel, foot: int, s: Any, c: Any, y: Any) -> FootMotion:
    """Compute the motion of a ball foot's lowest point, with the slip of the ball's material at that point."""
    n = form.bodies
    half = half_size(form)
    along, height = root_position(form, y)
    slip, vertical_velocity = (y[half], y[half + 1]) if form.places > 0 else (0.0, 0.0)
    omega = y[half + form.places : 2 * half]
    ahead, above, ahead_rate, above_rate = lever_motion(form.foot_x[foot], form.foot_y[foot], n, s, c, omega)
    for k in range(n):
        # Turning counter-clockwise moves the material at the bottom of the ball downhill relative to its centre.
        slip += omega[k] * form.rolling[foot, k]
    height += above - form.radius[foot]
    return FootMotion(along + ahead, height, slip + ahead_rate, vertical_velocity + above_rate)


@kernel_part
def one_foot_motion(form: GroundModel, foot: int, y: Any) -> FootMotion:
    s, c = vector(BODY_VECTOR), vector(BODY_VECTOR)
    sines_cosines(form, y, s, c)
    return foot_motion(form, foot, s, c, y)


@kernel_part
def feet_motion(form: GroundModel, y: Any) -> tuple[FootMotion, FootMotion]:
    s, c = vector(BODY_VECTOR), vector(BODY_VECTOR)
    sines_cosines(form, y, s, c)
    return foot_motion(form, 0, s, c, y), foot_motion(form, 1, s, c, y)


@kernel_part
def relative_to_ground(system: OnGround, foot: int, motion: FootMotion) -> FootMotion:
    return FootMotion(motion.along, motion.height - system.level[foot], motion.slip, motion.vertical_velocity)


class FootForce(NamedTuple):
    along: float  # N, friction
    normal: NormalForce
    by_slip: float  # N s/m, derivative of the friction with respect to slip
    coefficient: float  # signed ratio of friction to normal force


@kernel_part
def foot_force(laws: Any, motion: FootMotion) -> FootForce:
    """Compute the force of the ground on a penetrating foot. `laws` is a ContactWalker or an OnGround."""
    normal = normal_force(laws.normal, -motion.height, -motion.vertical_velocity)
    mu, mu_slope = friction_coefficient(laws.friction, motion.slip)
    return FootForce(mu * normal.force, normal, mu_slope * normal.force, mu)


def to_form(form: GroundModel, x: Any) -> Floats:
    """Convert a full state (of all bodies), or variational columns, to the state of a form with the same root."""
    # Merged bodies have equal angles and rates up to rounding. Use those of the first.
    p = int(form.places)
    half = len(x) // 2
    first = form.first[: form.bodies]
    return np.asarray(x)[[*range(p), *(p + first), *range(half, half + p), *(half + p + first)]]


def to_full(form: GroundModel, y: Any, size: int) -> Floats:
    """Convert a form's state to the full state (size,) of all bodies, with the same root."""
    p = int(form.places)
    n = int(form.bodies)
    onto = form.onto[: size // 2 - p]
    return np.asarray(y)[[*range(p), *(p + onto), *range(p + n, 2 * p + n), *(2 * p + n + onto)]]


@kernel_part
def store_whole(form: GroundModel, y: Any, whole: Any) -> None:
    """Convert a form's state y to the state of the free walker with all bodies, and write it into `whole`."""
    n = form.bodies
    p = form.places
    half = half_size(form)
    middle = whole.size // 2
    for i in range(2, middle):
        body = form.onto[i - 2]
        whole[i], whole[middle + i] = y[p + body], y[half + p + body]
    if p > 0:
        whole[0], whole[1], whole[middle], whole[middle + 1] = y[0], y[1], y[half], y[half + 1]
        return
    s, c = vector(BODY_VECTOR), vector(BODY_VECTOR)
    sines_cosines(form, y, s, c)
    along, height, speed, vertical_velocity = lever_motion(form.arm_x, form.arm_y, n, s, c, y[half : half + n])
    # The arms are first moments. Divided by the mass, they are the vector from the hinge to the centre of mass.
    whole[0], whole[1] = along / form.mass, form.root_height + height / form.mass
    whole[middle], whole[middle + 1] = speed / form.mass, vertical_velocity / form.mass


def floating_state(form: GroundModel, y: Any, size: int) -> State:
    """Convert a form's state y to the state (size,) of the free walker with all bodies."""
    whole = np.zeros(size)
    store_whole(form, y, whole)
    return tuple(whole.tolist())
