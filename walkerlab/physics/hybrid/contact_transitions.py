"""Effects of events on the walk state on compliant ground: the rules of steps, pads and falls."""

from typing import Any

from walkerlab.physics.ground import terrain as footholds
from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.knees import MIN_FLEXION, IdealLock, extension
from walkerlab.physics.ground.pulse import pulse_left
from walkerlab.physics.ground.terrain import foothold_height, has_ground_in_air, has_ground_in_cell
from walkerlab.physics.ground.walker import BENT, LOCKED, RELEASED, STOPPING, FootMotion, GroundModel, OnGround
from walkerlab.physics.hybrid import contact_state as events
from walkerlab.physics.hybrid.contact_record import ContactObserver, observe_edge
from walkerlab.physics.hybrid.contact_state import WalkState, farthest_slide, is_above, is_ahead, material_along
from walkerlab.physics.hybrid.endings import BENT_KNEE, FELL, GOES_ON, OFF_PAD, SLID, STUBBED
from walkerlab.physics.kernels import dispatch_by_type_or_default, kernel_part

# A touch ends a step only if the foot is ahead of the other one by at least this fraction of the pitch.
STEP_AHEAD = 0.25
# m; a foot this close to the surface is on it, within the error of an event's time
AT_SURFACE = 1e-11
# A foot has tripped if it touches its old pad further than this fraction of the pitch from where it stood.
TRIP = 0.25


@kernel_part
def apply_event(
    system: OnGround, observer: ContactObserver, walk_state: WalkState, event: int, t: float, y: Any
) -> int:
    """Apply an event to the walk state, and return an outcome if the event ends the walk, otherwise GOES_ON."""
    if event == events.FALL:
        return FELL
    if event == events.SLIDE:
        return SLID
    walk_state.at_zero[event] = 1
    if event >= events.EXTENSION:
        knee_stops(system.stop, walk_state, event, t)
        return GOES_ON
    first, second = forms.feet_motion(system.form, y)
    feet = forms.relative_to_ground(system, 0, first), forms.relative_to_ground(system, 1, second)
    if event == events.PASSING:
        walk_state.sides[events.PASSING] = -walk_state.sides[events.PASSING]
        outcome = GOES_ON
        for foot in range(2):
            # In a pinned step, equal legs pass with both feet at the surface. Rounding must not decide which is above.
            at_surface = abs(feet[foot].height) < AT_SURFACE
            above = feet[foot].vertical_velocity > 0.0 if at_surface else is_above(walk_state, foot)
            find_ground(walk_state, foot, above)
            if (above or walk_state.has_ground[foot] == 0) and next_foothold_counts(walk_state, foot):
                outcome = set_foothold(system, observer, walk_state, feet[foot].height, foot, y)
        return outcome
    foot = event // events.PER_FOOT
    kind = event % events.PER_FOOT
    if kind == events.HEIGHT:
        walk_state.sides[event] = -walk_state.sides[event]
        if is_above(walk_state, foot):
            lift(system.form, walk_state, feet, foot, t, y)
            if next_foothold_counts(walk_state, foot):
                return set_foothold(system, observer, walk_state, feet[foot].height, foot, y)
        else:
            return touch(system.form, walk_state, feet, foot, t, y)
    elif kind == events.LEFT_EDGE or kind == events.RIGHT_EDGE:
        # From now on the row stands for the same edge of the new cell, one pitch away.
        walk_state.at_zero[event] = 0
        # The edge just crossed is the opposite edge of the new cell, whose event function is therefore zero now.
        opposite = events.LEFT_EDGE if kind == events.RIGHT_EDGE else events.RIGHT_EDGE
        walk_state.at_zero[foot * events.PER_FOOT + opposite] = 1
        walk_state.cells[foot] += 1 if kind == events.RIGHT_EDGE else -1
        if not has_ground_in_cell(walk_state.cells[foot]):
            observe_edge(observer, system, foot, y)
            walk_state.has_ground[foot] = 0
            return GOES_ON
        pad = footholds.height_of_pad(walk_state.ground.terrain, foot, walk_state.cells[foot])
        set_level(system, observer, walk_state, feet[foot].height, foot, pad, y)
        if is_above(walk_state, foot):
            walk_state.has_ground[foot] = 1
        else:
            # The foot is below the top of the pad: it has hit the pad's side.
            return OFF_PAD
    elif kind == events.VERTICAL_VELOCITY:
        # This function is not watched again before the next touch, and by then it is no longer zero.
        walk_state.at_zero[event] = 0
        if pulse_left(system, t) > 0.0:
            walk_state.progress.release = events.AT_PULSE_END
        else:
            release(walk_state, 1 - foot)
    return GOES_ON


@kernel_part
def set_level(
    system: OnGround, observer: ContactObserver, walk_state: WalkState, height: float, foot: int, level: float, y: Any
) -> None:
    """Change the ground under a foot to `level` (m). The energy in the ground's spring is lost.

    height  m, height of the foot above its present ground
    """
    if level == walk_state.level[foot]:
        return
    above = height + walk_state.level[foot] - level
    if not is_above(walk_state, foot):
        observe_edge(observer, system, foot, y)
    walk_state.level[foot] = level
    walk_state.sides[foot * events.PER_FOOT + events.HEIGHT] = 1 if above > 0.0 else -1
    walk_state.at_zero[foot * events.PER_FOOT + events.HEIGHT] = 0


@kernel_part
def next_foothold_counts(walk_state: WalkState, foot: int) -> bool:
    """Whether the ground under a swing foot must still be set to the height of its next foothold."""
    terrain = walk_state.ground.terrain
    if terrain.has_pads or not footholds.is_uneven(terrain) or foot == walk_state.progress.stance:
        return False
    level = foothold_height(terrain, walk_state.progress.steps + 1)
    return is_ahead(walk_state, foot) and walk_state.level[foot] != level


@kernel_part
def set_foothold(
    system: OnGround, observer: ContactObserver, walk_state: WalkState, height: float, foot: int, y: Any
) -> int:
    """Set the ground under a swing foot to its next foothold's height.

    On an ordinary plane, a foot that is below that height is stubbed, which ends the walk.
    """
    terrain = walk_state.ground.terrain
    set_level(system, observer, walk_state, height, foot, foothold_height(terrain, walk_state.progress.steps + 1), y)
    # Where the order of the feet matters, a foot below its next foothold passes through the plane. On any other ground,
    # it is stubbed.
    walk_state.has_ground[foot] = 1 if is_above(walk_state, foot) else 0
    return GOES_ON if is_above(walk_state, foot) or terrain.order_matters else STUBBED


@kernel_part
def find_ground(walk_state: WalkState, foot: int, above: bool) -> None:
    """Update `has_ground` of a foot in the air, after the feet have changed places or roles."""
    if above:
        terrain = walk_state.ground.terrain
        stands = foot == walk_state.progress.stance
        has_ground = has_ground_in_air(terrain, walk_state.has_ground[foot] != 0, stands, is_ahead(walk_state, foot))
        walk_state.has_ground[foot] = 1 if has_ground else 0


@kernel_part
def lift(
    form: GroundModel, walk_state: WalkState, feet: tuple[FootMotion, FootMotion], foot: int, t: float, y: Any
) -> None:
    """Handle a foot that rises above the ground, at the end of its stance or of a scuff."""
    stands = foot == walk_state.progress.stance
    if stands or walk_state.leaving[foot] != 0:
        note_slip(form, walk_state, feet, foot, y)
        walk_state.lifted[foot] = t
        # The step that this foot carried is over, but its slip ends only now.
        if not stands:
            step = walk_state.progress.steps - 1
            walk_state.lift_time[step] = t
            walk_state.slip[step], walk_state.rolling[step] = walk_state.slipped[foot], walk_state.rolled[foot]
        walk_state.leaving[foot] = 0
    find_ground(walk_state, foot, True)


@kernel_part
def note_slip(form: GroundModel, walk_state: WalkState, feet: tuple[FootMotion, FootMotion], foot: int, y: Any) -> None:
    slip = material_along(form, foot, feet[foot].along, y) - walk_state.touched[foot]
    walk_state.slipped[foot] = slip
    walk_state.rolled[foot] = feet[foot].along - walk_state.foothold[foot] - slip


@kernel_part
def touch(
    form: GroundModel, walk_state: WalkState, feet: tuple[FootMotion, FootMotion], foot: int, t: float, y: Any
) -> int:
    """Decide whether a touch ends the step, and return an outcome if the walk ends, otherwise GOES_ON."""
    # The step ends if the swing foot comes down far enough ahead, on a pad other than the one it left. A swing foot
    # that comes down on the pad it left, but far from where it stood, scuffs: it has tripped over the pad.
    stance = walk_state.progress.stance
    terrain = walk_state.ground.terrain
    if walk_state.has_ground[foot] == 0:
        return GOES_ON
    material = material_along(form, foot, feet[foot].along, y)
    if foot == stance:
        return SLID if abs(material - walk_state.touched[foot]) > farthest_slide(terrain) else GOES_ON
    pitch = terrain.pitch
    if terrain.has_pads and walk_state.cells[foot] == walk_state.left_cells[foot]:
        # A rolling foot leaves its pad some distance from where it touched down.
        away = abs(feet[foot].along - walk_state.foothold[foot] - walk_state.rolled[foot])
        return OFF_PAD if away > TRIP * pitch else GOES_ON
    if feet[foot].along - feet[stance].along < STEP_AHEAD * pitch:
        return GOES_ON
    if form.kneed and walk_state.knee[foot] != LOCKED:
        return BENT_KNEE
    step = walk_state.progress.steps
    walk_state.touch_time[step] = t
    walk_state.touch_along[step] = feet[foot].along
    walk_state.touch_height[step] = walk_state.level[foot]
    # The old stance foot is still down. Its slip up to now is preliminary, until `lift` completes it.
    if not is_above(walk_state, stance):
        note_slip(form, walk_state, feet, stance, y)
        walk_state.leaving[stance] = 1
        walk_state.lifted[stance] = t
    walk_state.lift_time[step] = walk_state.lifted[stance]
    walk_state.slip[step], walk_state.rolling[step] = walk_state.slipped[stance], walk_state.rolled[stance]
    walk_state.foothold[foot] = feet[foot].along
    walk_state.touched[foot] = material
    walk_state.left_cells[foot] = walk_state.cells[foot]
    walk_state.leaving[foot] = 0
    walk_state.progress.last_touch = t
    walk_state.progress.stance = foot
    walk_state.progress.steps = step + 1
    find_ground(walk_state, stance, is_above(walk_state, stance))
    follow_strike(form, walk_state, stance)
    return GOES_ON


@dispatch_by_type_or_default
def catches(stop: Any) -> bool:
    """Whether a knee locks as soon as it is straight. With a compliant stop, it locks once it turns back."""
    return False


@catches.case(IdealLock)
def lock_catches(stop: IdealLock) -> bool:
    return True


@kernel_part
def knee_stops(stop: Any, walk_state: WalkState, event: int, t: float) -> None:
    """Handle a knee's event: a straight knee locks or enters its stop. A knee that turns back in its stop latches."""
    if event < events.EXTENSION_RATE and not catches(stop):
        walk_state.knee[(event - events.EXTENSION) % 2] = STOPPING
        return
    walk_state.at_zero[event] = 0
    walk_state.knee[(event - events.EXTENSION) % 2] = LOCKED
    walk_state.knee_strike[walk_state.progress.steps] = t


@kernel_part
def release(walk_state: WalkState, knee: int) -> None:
    walk_state.progress.release = events.NOT_DUE
    walk_state.knee[knee] = RELEASED


@kernel_part
def follow_strike(form: GroundModel, walk_state: WalkState, trailing: int) -> None:
    """Release the trailing knee at the touch that ends a step, or note what it waits for.

    It can wait for `AT_COMPRESSION` or `AT_PULSE_END`.
    """
    if form.has_knee[trailing] != 0:
        if form.release_at_touch and form.push_off != 0.0:
            walk_state.progress.release = events.AT_PULSE_END
        elif form.release_at_touch:
            release(walk_state, trailing)
        else:
            walk_state.progress.release = events.AT_COMPRESSION


@kernel_part
def note_flexion(form: GroundModel, walk_state: WalkState, y: Any) -> None:
    """Mark a released knee as bent once it has flexed, so that it locks when it straightens."""
    for knee in range(2):
        if walk_state.knee[knee] == RELEASED and extension(form, knee, y) < -MIN_FLEXION:
            walk_state.knee[knee] = BENT
