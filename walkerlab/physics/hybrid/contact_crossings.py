"""Event functions of a walk on compliant ground, sampled along a solver step, and their first crossing.

For touch, lift, pad edges, passing feet, slide and fall, the walk state stores the sign of the event function. A change
of that sign is the event, so simultaneous events cannot hide one another. Switching points of the force law are events
because its derivatives jump at them: solver steps that end at these points preserve the method's order.
"""

from typing import Any

from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.friction import sample_switching, switching_count
from walkerlab.physics.ground.knees import extension, extension_rate
from walkerlab.physics.ground.normal_force import release_function, switching_penetration
from walkerlab.physics.ground.terrain import cell_edges
from walkerlab.physics.ground.walker import BENT, BODY_VECTOR, STOPPING, FootMotion, GroundModel, OnGround
from walkerlab.physics.hybrid import contact_state as events
from walkerlab.physics.hybrid.contact_state import WalkState, farthest_slide, material_along
from walkerlab.physics.hybrid.endings import FALLEN_HIP
from walkerlab.physics.kernels import kernel_part, vector
from walkerlab.physics.solvers.events import NO_CROSSING, CrossingFinder, first_crossing, way_from_zero

NO_SIDE = 0  # value in `WalkState.sides` for an event function that may cross zero in either direction
ZERO_ROUNDING = 1e-14  # m, rad or their rates; smaller values of event functions count as zero
CLEARLY_MOVED = 1e-12  # m, rad or their rates; larger changes over a solver step are not rounding


@kernel_part
def hip_height(form: GroundModel, s: Any, c: Any, y: Any) -> float:
    """Compute the height of the hip above the slope (m)."""
    height = y[1] if form.places > 0 else form.root_height
    for k in range(form.bodies):
        height += s[k] * form.hip_x[k] + c[k] * form.hip_y[k]
    return height


@kernel_part
def sample_event_functions(system: OnGround, walk_state: WalkState, y: Any, node: int, finder: CrossingFinder) -> None:
    form = system.form
    ground = walk_state.ground
    values = finder.values
    s, c = vector(BODY_VECTOR), vector(BODY_VECTOR)
    forms.sines_cosines(form, y, s, c)
    values[events.PASSING, node] = 0.0
    for foot in range(2):
        first = foot * events.PER_FOOT
        motion = forms.relative_to_ground(system, foot, forms.foot_motion(form, foot, s, c, y))
        sample_foot(system, motion, cell_edges(ground.terrain, foot, walk_state.cells[foot]), first, node, finder)
        values[first + events.MATERIAL, node] = material_along(form, foot, motion.along, y)
        values[events.PASSING, node] += motion.along if foot == 1 else -motion.along
    stance = walk_state.progress.stance
    hip = hip_height(form, s, c, y) - walk_state.level[stance]
    values[events.FALL, node] = hip - FALLEN_HIP * ground.frame.leg_length
    away = values[stance * events.PER_FOOT + events.MATERIAL, node] - walk_state.touched[stance]
    # The slide is squared, so that one smooth function covers both directions.
    values[events.SLIDE, node] = farthest_slide(ground.terrain) ** 2 - away**2
    for knee in range(2):
        values[events.EXTENSION + knee, node] = extension(form, knee, y)
        values[events.EXTENSION_RATE + knee, node] = extension_rate(form, knee, y)


@kernel_part
def sample_foot(
    system: OnGround, motion: FootMotion, edges: tuple[float, float], first: int, j: int, finder: CrossingFinder
) -> None:
    values = finder.values
    values[first + events.HEIGHT, j] = motion.height
    values[first + events.VERTICAL_VELOCITY, j] = motion.vertical_velocity
    values[first + events.LEFT_EDGE, j] = motion.along - edges[0]
    values[first + events.RIGHT_EDGE, j] = edges[1] - motion.along
    values[first + events.RELEASE, j] = release_function(system.normal, -motion.height, -motion.vertical_velocity)
    # A law with a single formula returns infinity, so this function has no zero.
    values[first + events.FULL_DAMPING, j] = motion.height + switching_penetration(system.normal)
    sample_switching(system.friction, motion.slip, values, first + events.FRICTION_SWITCHES, j)


@kernel_part
def earliest_crossing(
    system: OnGround, walk_state: WalkState, watch_order: bool, finder: CrossingFinder
) -> tuple[float, int]:
    """Return the fraction of the solver step at which the first event occurs (or NO_CROSSING), and the event."""
    ground = walk_state.ground
    progress = walk_state.progress
    first = NO_CROSSING, events.NO_EVENT
    for foot in range(2):
        if foot == system.form.pinned:
            continue
        row = foot * events.PER_FOOT
        # Only a foot on the ground has a force that can switch. After a touch, the next solver step takes care of that.
        inside = walk_state.has_ground[foot] != 0 and walk_state.sides[row + events.HEIGHT] < 0
        # The rows of a foot begin with its height and edges. The switching points follow.
        end = row + events.RELEASE
        if inside and ground.frame.locate_switching and not progress.passes_switching:
            end = row + events.FRICTION_SWITCHES + switching_count(system.friction)
        for event in range(row, end):
            if ground.terrain.has_pads or (event != row + events.LEFT_EDGE and event != row + events.RIGHT_EDGE):
                first = earlier_event(first, walk_state, finder, event)
        if inside and foot == progress.stance:
            first = earlier_event(first, walk_state, finder, events.SLIDE)
    # PASSING is an event only if the order of the feet matters.
    if watch_order:
        first = earlier_event(first, walk_state, finder, events.PASSING)
    for knee in range(2):
        if walk_state.knee[knee] == BENT:
            first = earlier_event(first, walk_state, finder, events.EXTENSION + knee)
        elif walk_state.knee[knee] == STOPPING:
            first = earlier_event(first, walk_state, finder, events.EXTENSION_RATE + knee)
    if progress.release == events.AT_COMPRESSION:
        first = earlier_event(first, walk_state, finder, progress.stance * events.PER_FOOT + events.VERTICAL_VELOCITY)
    return earlier_event(first, walk_state, finder, events.FALL)


@kernel_part
def earlier_event(
    first: tuple[float, int], walk_state: WalkState, finder: CrossingFinder, event: int
) -> tuple[float, int]:
    """Return the earlier of `first` and `event`, as a fraction of the solver step and the number of the event."""
    fraction = leaves_side(finder, event, walk_state.sides[event], walk_state.at_zero[event] != 0)
    return (fraction, event) if fraction < first[0] else first


@kernel_part
def leaves_side(finder: CrossingFinder, event: int, side: int, zero_at_start: bool) -> float:
    """Find the fraction of the solver step at which an event function leaves its side of zero, or NO_CROSSING."""
    # The result is 0 if the function starts on the other side: another event ended the previous solver step beyond this
    # zero or on it. If the function starts at zero, the direction of its change decides, unless that change is
    # rounding: a foot whose pin was just released may still sink in. If the function is at zero because of its own
    # event, its side has already changed, and the result is 0 only if the function is on the other side at all nodes.
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
