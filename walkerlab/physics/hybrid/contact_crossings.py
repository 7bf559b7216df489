"""Event functions of a walk on compliant ground, sampled along a step, and their first crossing.

For touch, lift, pad edges, passing feet, slide and fall, the walk state stores the sign of the event function. A change
of that sign is the event, so simultaneous events cannot hide one another. Switching points of the force law are events
because its derivatives jump at them: steps that end at these points preserve the method's order.
"""

from typing import Any

from walkerlab.physics.ground.friction import sample_switching, switching_count
from walkerlab.physics.ground.knees import extension, extension_rate
from walkerlab.physics.ground.normal_force import grip
from walkerlab.physics.ground.terrain import cell_edges
from walkerlab.physics.ground.walker import (
    BENT,
    OF_BODIES,
    STOPPING,
    FootMotion,
    GroundModel,
    OnGround,
    foot_motion,
    over_ground,
    sines_cosines,
)
from walkerlab.physics.hybrid.contact_events import (
    EXTENSION,
    EXTENSION_RATE,
    FALL,
    FRICTION_SWITCHES,
    FULL_DAMPING,
    HEIGHT,
    LEFT_EDGE,
    MATERIAL,
    PASSING,
    PER_FOOT,
    RELEASE,
    RIGHT_EDGE,
    SLIDE,
    VERTICAL_VELOCITY,
    JudgedGround,
    farthest_slide,
)
from walkerlab.physics.hybrid.contact_state import AT_COMPRESSION, WalkState, material_along
from walkerlab.physics.hybrid.endings import FALLEN_HIP
from walkerlab.physics.kernels import kernel_part, vector
from walkerlab.physics.solvers.events import NO_CROSSING, CrossingFinder, first_crossing, way_from_zero

NO_SIDE = 0  # side of an event function that may cross zero in either direction
ZERO_ROUNDING = 1e-14  # m, rad or their rates; smaller values of event functions count as zero
CLEARLY_MOVED = 1e-12  # m, rad or their rates; larger changes over a step are not rounding


@kernel_part
def hip_height(form: GroundModel, s: Any, c: Any, y: Any) -> float:
    """Compute the height of the hip above the slope (m)."""
    height = y[1] if form.places > 0 else form.root_height
    for k in range(form.bodies):
        height += s[k] * form.hip_x[k] + c[k] * form.hip_y[k]
    return height


@kernel_part
def sample_event_functions(
    system: OnGround, ground: JudgedGround, walk_state: WalkState, y: Any, node: int, finder: CrossingFinder
) -> None:
    form, terrain, values = system.form, ground.terrain, finder.values
    s, c = vector(OF_BODIES), vector(OF_BODIES)
    sines_cosines(form, y, s, c)
    values[PASSING, node] = 0.0
    for foot in range(2):
        first, motion = foot * PER_FOOT, over_ground(system, foot, foot_motion(form, foot, s, c, y))
        sample_foot(system, motion, cell_edges(terrain, foot, walk_state.cells[foot]), first, node, finder)
        values[first + MATERIAL, node] = material_along(form, foot, motion.along, y)
        values[PASSING, node] += motion.along if foot == 1 else -motion.along
    stance = walk_state.progress.stance
    values[FALL, node] = hip_height(form, s, c, y) - walk_state.level[stance] - FALLEN_HIP * ground.frame.leg_length
    away = values[stance * PER_FOOT + MATERIAL, node] - walk_state.touched[stance]
    values[SLIDE, node] = farthest_slide(terrain) ** 2 - away**2
    for knee in range(2):
        values[EXTENSION + knee, node] = extension(form, knee, y)
        values[EXTENSION_RATE + knee, node] = extension_rate(form, knee, y)


@kernel_part
def sample_foot(
    system: OnGround, motion: FootMotion, edges: tuple[float, float], first: int, j: int, finder: CrossingFinder
) -> None:
    values = finder.values
    values[first + HEIGHT, j] = motion.height
    values[first + VERTICAL_VELOCITY, j] = motion.vertical_velocity
    values[first + LEFT_EDGE, j] = motion.along - edges[0]
    values[first + RIGHT_EDGE, j] = edges[1] - motion.along
    values[first + RELEASE, j] = grip(-motion.height, -motion.vertical_velocity, system.normal)
    values[first + FULL_DAMPING, j] = motion.height + system.normal.full_damping_penetration
    sample_switching(system.friction, motion.slip, values, first + FRICTION_SWITCHES, j)


@kernel_part
def knee_crossing(walk_state: WalkState, finder: CrossingFinder) -> tuple[float, int]:
    """Return the fraction of the step at which the first knee event occurs (or NO_CROSSING), and the event's number."""
    # a bent knee straightens, a knee in its stop turns back, or the stance foot stops sinking in and releases a knee
    best, event = NO_CROSSING, -1
    for knee in range(2):
        fraction, index = NO_CROSSING, EXTENSION + knee
        if walk_state.knee[knee] == BENT:
            fraction = leaves_side(finder, index, -1, walk_state.at_zero[index] != 0)
        elif walk_state.knee[knee] == STOPPING:
            index = EXTENSION_RATE + knee
            fraction = leaves_side(finder, index, 1, walk_state.at_zero[index] != 0)
        if fraction < best:
            best, event = fraction, index
    if walk_state.progress.release == AT_COMPRESSION:
        index = walk_state.progress.stance * PER_FOOT + VERTICAL_VELOCITY
        fraction = leaves_side(finder, index, -1, walk_state.at_zero[index] != 0)
        if fraction < best:
            best, event = fraction, index
    return best, event


@kernel_part
def earliest_crossing(
    system: OnGround, ground: JudgedGround, walk_state: WalkState, watch_order: bool, finder: CrossingFinder
) -> tuple[float, int]:
    """Return the fraction of the step at which the first event occurs (or NO_CROSSING), and the event's number."""
    sides, at_zero, has_ground = walk_state.sides, walk_state.at_zero, walk_state.has_ground
    best, event = NO_CROSSING, -1
    for foot in range(2):
        if foot == system.form.hinged:
            continue
        first = foot * PER_FOOT
        # a foot in the air has no force to switch; switching after a touch belongs to the next step
        inside = has_ground[foot] != 0 and sides[first + HEIGHT] < 0
        last = RELEASE
        if inside and ground.frame.locate_switching and not walk_state.progress.passes_switching:
            last = FRICTION_SWITCHES + switching_count(system.friction)
        for index in range(first, first + last):
            if not ground.terrain.has_pads and (index == first + LEFT_EDGE or index == first + RIGHT_EDGE):
                continue
            fraction = leaves_side(finder, index, sides[index], at_zero[index] != 0)
            if fraction < best:
                best, event = fraction, index
        if foot == walk_state.progress.stance and sides[first + HEIGHT] < 0 and has_ground[foot] != 0:
            fraction = leaves_side(finder, SLIDE, sides[SLIDE], at_zero[SLIDE] != 0)
            if fraction < best:
                best, event = fraction, SLIDE
    if watch_order:  # PASSING is an event only if the order of the feet matters
        fraction = leaves_side(finder, PASSING, sides[PASSING], at_zero[PASSING] != 0)
        if fraction < best:
            best, event = fraction, PASSING
    fraction, index = knee_crossing(walk_state, finder)
    if fraction < best:
        best, event = fraction, index
    fraction = leaves_side(finder, FALL, sides[FALL], at_zero[FALL] != 0)
    if fraction < best:
        best, event = fraction, FALL
    return best, event


@kernel_part
def leaves_side(finder: CrossingFinder, event: int, side: int, zero_at_start: bool) -> float:
    """Find the fraction of the step at which an event function leaves its side of zero, or NO_CROSSING."""
    # The result is 0 if the function starts on the other side: another event ended the previous step beyond this zero
    # or on it. If the function starts at zero, the direction of its change decides, unless that change is rounding: a
    # foot just released from its hinge may still sink in. If the function is at zero because of its own event, its side
    # has already changed, and the result is 0 only if the function is on the other side at all nodes.
    value = finder.values[event, 0]
    at_zero = zero_at_start or abs(value) < ZERO_ROUNDING
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
