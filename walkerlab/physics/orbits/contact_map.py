"""Step map of the contact model, on a section where no foot is touching down or lifting off.

On the section the swing foot passes the stance foot. By then the fast transients of touchdown have decayed. The
coordinates, ordered by the legs' roles, are the height of the centre of mass, the angles of the bodies except the swing
leg's uppermost one (which the section determines), the velocity along and normal to the slope, and the rates of all
bodies that turn independently: six for two straight legs. The stance knee is locked, the swing knee free.

One step maps the section to itself with the legs' roles exchanged.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.energy_channels import LOSS_ENTRIES
from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.knees import IdealLock
from walkerlab.physics.ground.terrain import STANCE_FOOT, Terrain, after_mid_swing, checkerboard, has_ground_in_air
from walkerlab.physics.ground.walker import ContactWalker, OnGround
from walkerlab.physics.hybrid import contact_state as events
from walkerlab.physics.hybrid.contact_jumps import state_rate
from walkerlab.physics.hybrid.contact_loop import NO_LIMIT
from walkerlab.physics.hybrid.contact_result import Stopped, driven_work, new_observer, present_walker, walk_on
from walkerlab.physics.hybrid.contact_state import PASSING, JudgedGround, WalkState, material_along, new_walk_state
from walkerlab.physics.hybrid.walk_record import DrivenWork
from walkerlab.physics.mechanics.tree import add_inertia, factor_linked, solve_linked
from walkerlab.physics.orbits import step_map as maps
from walkerlab.physics.orbits.step_map import Cycle, DisturbedWalk, MappedStep, Monitor, StepMap, Stepper
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, State

# Indices of the position along the slope, the height and the first body's angle in the state. Velocities follow in the
# same order.
ALONG = 0
HEIGHT = 1
ANGLES = 2
NEWTON_STEPS = 20


@dataclass(frozen=True)
class SectionStep(MappedStep):
    # net slip over a stance: slip of the landing foot before the section, plus slip of the trailing foot after it
    slip_m: float
    rolling_m: float  # rolling distance over a stance, summed in the same way
    spacing_m: float  # distance from the stance foot's position at the section to where the other foot touches
    moved_m: float  # distance that the landing foot moves between its touch and the next section
    dissipated_J: Floats  # (5,) losses to damping, friction, pad edges, knee strikes and knee stops
    driven: DrivenWork
    work: NDArray[np.int64]  # counts of right-hand-side evaluations, accepted steps, rejected steps and Jacobians


@dataclass(frozen=True)
class WalkerOnGround:
    walker: ContactWalker
    ground: JudgedGround


def replace_terrain(site: WalkerOnGround, terrain: Terrain) -> WalkerOnGround:
    return replace(site, ground=site.ground._replace(terrain=terrain))


def turning_bodies(walker: ContactWalker, stance: int) -> tuple[int, ...]:
    """Return the bodies that turn independently, the swing leg's first. The locked stance shank is not among them."""
    # If only one leg has a knee, there is one body fewer while that leg stands.
    locked = locked_shank(walker, stance)
    # `legs` repeats the last body of a leg without a knee, and `dict.fromkeys` drops the repetition.
    bodies = (*walker.legs[1 - stance], *(body for body in walker.legs[stance] if body != locked))
    return tuple(dict.fromkeys(bodies))


def locked_shank(walker: ContactWalker, stance: int) -> int | None:
    """Return the locked shank of the stance leg, or None if that leg has no knee."""
    return int(walker.whole.knees[stance, 0]) if walker.whole.has_knee[stance] else None


def angled_bodies(walker: ContactWalker, stance: int) -> tuple[int, ...]:
    """Return the bodies whose angles are coordinates, the swing leg's first."""
    # After a compliant stop has latched, the stance shank's angle differs from its thigh's.
    free = turning_bodies(walker, stance)[1:]
    shank = None if isinstance(walker.stop, IdealLock) else locked_shank(walker, stance)
    return free if shank is None else (*free, shank)


def fill_followers(walker: ContactWalker, stance: int, angles: Floats, fixed: tuple[int, ...]) -> Floats:
    """Set the entries in `angles` (n,) of coupled bodies that are not `fixed`, and return `angles`.

    The entries may be angles, changes of angles, or rates.
    """
    form = walker.whole
    n = angles.size
    shank, thigh = form.knees[stance]
    if walker.whole.has_knee[stance] and shank not in fixed:
        angles[shank] = angles[thigh]
    for body in range(n):
        if form.E[0, body, body] == 0.0 and body not in fixed:
            angles[body] = form.E[0, body, :n] @ angles
    return angles


def feet_apart(walker: ContactWalker, angles: Floats) -> tuple[float, Floats]:
    """Return how far (m) foot 0 is ahead of foot 1, and the derivatives (n,) with respect to the angles."""
    s, c = np.sin(angles + walker.slope), np.cos(angles + walker.slope)
    x, y = ((lever[0] - lever[1])[: angles.size] for lever in (walker.whole.foot_x, walker.whole.foot_y))
    return float(c @ x - s @ y), -(s * x + c * y)


def state_on_section(walker: ContactWalker, z: Floats, stance: int) -> State:
    """Return the walker's state at section coordinates z, standing on leg `stance`, at position 0 along the slope."""
    n = int(walker.whole.bodies)
    turning = turning_bodies(walker, stance)
    angled = angled_bodies(walker, stance)
    state = np.zeros(4 + 2 * n)
    state[HEIGHT], (state[2 + n], state[3 + n]) = z[0], z[1 + len(angled) : 3 + len(angled)]
    rates = np.zeros(n)
    rates[list(turning)] = z[3 + len(angled) :]
    state[4 + n :] = fill_followers(walker, stance, rates, turning)
    angles = np.zeros(n)
    upper = turning[0]
    angles[list(angled)] = z[1 : 1 + len(angled)]
    angles[upper] = angles[walker.legs[stance][0]]
    turned = fill_followers(walker, stance, np.eye(n)[upper], (upper, *angled))
    for _ in range(NEWTON_STEPS):  # turn the swing leg's uppermost body until the feet pass each other
        angles = fill_followers(walker, stance, angles, (upper, *angled))
        apart, gradient = feet_apart(walker, angles)
        move = -apart / float(gradient @ turned)
        angles[upper] += move
        if abs(move) < 1e-15:
            break
    state[ANGLES : ANGLES + n] = fill_followers(walker, stance, angles, (upper, *angled))
    return tuple(float(x) for x in state)


def stand(walker: ContactWalker, z: Floats, stance: int) -> Floats:
    """Return z changed so that the stance foot rests on the ground at its static penetration."""
    foot = forms.feet_motion(walker.whole, state_on_section(walker, z, stance))[stance]
    depth = walker.normal.resting_foot(walker.mass * walker.gravity_down, walker.mass).depth
    along_rate = 1 + len(angled_bodies(walker, stance))
    moved = z.copy()
    moved[0] -= foot.height + depth
    moved[along_rate : along_rate + 2] -= foot.slip, foot.vertical_velocity
    return moved


def coordinates_of(walker: ContactWalker, state: Floats, stance: int) -> Floats:
    n = int(walker.whole.bodies)
    angles = [ANGLES + body for body in angled_bodies(walker, stance)]
    rates = [4 + n + body for body in turning_bodies(walker, stance)]
    return np.asarray(state)[[HEIGHT, *angles, 2 + n, 3 + n, *rates]]


def section_tangents(walker: ContactWalker, state: State, stance: int) -> Floats:
    """Differentiate `state_on_section` with respect to z at one of its states. The result is (4 + 2 n, coordinates)."""
    n = int(walker.whole.bodies)
    turning = turning_bodies(walker, stance)
    angled = angled_bodies(walker, stance)
    along = np.zeros((4 + 2 * n, 3 + len(angled) + len(turning)))
    _, gradient = feet_apart(walker, np.array(state[ANGLES : ANGLES + n]))
    fixed = (turning[0], *angled)
    upper = fill_followers(walker, stance, np.eye(n)[turning[0]], fixed)
    along[HEIGHT, 0] = 1.0
    for column, body in enumerate(angled, 1):
        turned = fill_followers(walker, stance, np.eye(n)[body], fixed)
        along[ANGLES : ANGLES + n, column] = turned - upper * (gradient @ turned) / (gradient @ upper)
    along[2 + n, 1 + len(angled)] = along[3 + n, 2 + len(angled)] = 1.0
    for column, body in enumerate(turning, 3 + len(angled)):
        along[4 + n :, column] = fill_followers(walker, stance, np.eye(n)[body], turning)
    return along


def stance_of(swing: int) -> int:
    """Return the stance foot of step number `swing`. Steps are counted from 0, and leg 1 swings in step 0."""
    return STANCE_FOOT if swing % 2 == 0 else 1 - STANCE_FOOT


def step_from_section(
    site: WalkerOnGround,
    tolerances: Tolerances,
    z: Floats,
    pitch_m: float,
    derived: bool = True,
    stance: int = STANCE_FOOT,
) -> SectionStep:
    """Walk from section to section on pads of pitch `pitch_m`.

    The outcome is REJECTED if a push-off lasts beyond the section.
    """
    walker = site.walker
    start = state_on_section(walker, z, stance)
    # The stance foot stands in the middle of a pad.
    if site.ground.terrain.has_pads:
        foothold = forms.feet_motion(walker.whole, start)[stance].along
        lanes = (foothold + pitch_m, foothold) if stance == STANCE_FOOT else (foothold, foothold + pitch_m)
        site = replace_terrain(site, checkerboard(pitch_m, lanes))
    walk_state = walk_state_on_section(site, start, 2, stance)
    standing = float(walk_state.foothold[stance])
    observer = new_observer(walker, walk_state, start, directions=z.size if derived else 0)
    if derived:
        observer.tangent.Phi[:, :] = section_tangents(walker, start, stance)
    stopped = walk_on(walker, tolerances, walk_state, observer, start, 1)
    end = np.array(stopped.state)
    landed = 1 - stance
    along = forms.feet_motion(walker.whole, stopped.state)[landed].along
    slipped = material_along(walker.whole, landed, along, stopped.state) - float(walk_state.touched[landed])
    rolled = along - float(walk_state.foothold[landed]) - slipped
    DP = np.zeros((z.size, 0))
    # Project the flow's derivative onto the section, along the flow.
    if derived:
        system = present_walker(walker, walk_state)
        rate = state_rate(system, forms.to_form(system.form, end), end.size, stopped.time_s)
        gradient = np.zeros(end.size)
        n = int(walker.whole.bodies)
        gradient[ANGLES : ANGLES + n] = feet_apart(walker, end[ANGLES : ANGLES + n])[1]
        Phi = observer.tangent.Phi
        on_section = Phi - np.outer(rate, gradient @ Phi) / (gradient @ rate)
        DP = np.column_stack([coordinates_of(walker, column, landed) for column in on_section.T])
    advance, rose = (float(end[index] - start[index]) for index in (ALONG, HEIGHT))
    spacing = float(walk_state.touch_along[0] - walk_state.foothold[stance] - walk_state.slip[0])
    half = min(1.0, max(-1.0, 0.5 * spacing / site.ground.frame.leg_length))
    pulse = walker.whole.push_off_duration if walker.whole.push_off != 0.0 else 0.0
    cut_off = stopped.time_s - walk_state.touch_time[0] < pulse
    return SectionStep(
        Outcome.REJECTED if cut_off and stopped.outcome is Outcome.WALKED else stopped.outcome,
        coordinates_of(walker, end, landed),
        DP,
        stopped.time_s,
        advance,
        math.asin(half) - walker.slope,
        float(walk_state.touch_time[0]),
        float(walk_state.slip[0] + slipped),
        float(walk_state.rolling[0] + rolled),
        float(walk_state.touch_along[0]) - standing,
        along - float(walk_state.foothold[landed]),
        observer.account[LOSS_ENTRIES].copy(),
        driven_work(walker, advance, rose, observer.account),
        stopped.work,
    )


def walk_from_section(
    site: WalkerOnGround, tolerances: Tolerances, z: Floats, heights: Floats, push: float, stance: int
) -> DisturbedWalk:
    """Walk from the section over foothold heights (steps + 1,) (m), with a push (N s) at the hip at the first touch."""
    walker = site.walker
    start = state_on_section(walker, z, stance)
    steps = heights.size - 1
    walk_state = walk_state_on_section(place_footholds(site, heights), start, steps + 1, stance)

    def continue_walk(walk_state: WalkState, state: State, until: int = NO_LIMIT) -> Stopped:
        return walk_on(walker, tolerances, walk_state, new_observer(walker, walk_state, state), state, until)

    stopped = Stopped(Outcome.WALKED, 0.0, start, np.zeros(4, np.int64))
    if push != 0.0:
        # With room for only one touchdown in the record, the walk stops at that touchdown, where the push acts.
        stopped = continue_walk(shorten(walk_state, 1), start)
        system = forms.place_on_ground(walker, walk_state.has_ground, walk_state.knee)
        stopped = replace(stopped, state=push_at_hip(system, walker, stopped.state, push))
    landed = list[float]()
    differ = have_different_soles(walker)
    # If the soles differ, angles do not follow from the footholds. So the walk stops at each touchdown to read them.
    for touches in range(2, steps + 1) if differ else ():
        if stopped.outcome is Outcome.WALKED:
            stopped = continue_walk(shorten(walk_state, touches), stopped.state)
            landed.append(stopped.state[ANGLES + walker.legs[int(walk_state.progress.stance)][0]])
    if stopped.outcome is Outcome.WALKED:
        stopped = continue_walk(walk_state, stopped.state, steps)
    if stopped.outcome is Outcome.WALKED:
        stance = int(walk_state.progress.stance)
        z = coordinates_of(walker, np.array(stopped.state), stance)
        # Heights on the section are measured from the ground of the stance foot.
        z[0] -= walk_state.level[stance]
        stopped = continue_walk(walk_state, stopped.state)
        landed.append(stopped.state[ANGLES + walker.legs[int(walk_state.progress.stance)][0]])
    touched = int(walk_state.progress.steps)
    times = walk_state.touch_time[:touched]
    along = walk_state.touch_along[:touched]
    rises = np.diff(walk_state.touch_height[:touched])
    angles = touch_angles(walker, site.ground.frame.leg_length, np.diff(along), rises)
    if differ:
        angles = np.array(landed[: angles.size])
    return DisturbedWalk(stopped.outcome, np.diff(times), np.diff(along), angles, z)


def have_different_soles(walker: ContactWalker) -> bool:
    """Whether the feet of the straight legs differ in radius or in the position of the centre relative to the hip."""
    whole = walker.whole
    first, second = (
        [whole.radius[k], *((f[k] - f[1 - k])[np.unique(walker.legs[k])].sum() for f in (whole.foot_x, whole.foot_y))]
        for k in range(2)
    )
    return not np.allclose(first, second, rtol=1e-12, atol=1e-12)


def touch_angles(walker: ContactWalker, leg_length: float, along: Floats, up: Floats) -> Floats:
    """Return the angles (steps,) from the vertical at which straight legs land `along` (m) ahead, `up` (m) higher."""
    apart = 0.5 * np.hypot(along, up) / leg_length
    return np.asarray(np.arcsin(np.clip(apart, -1.0, 1.0)) + np.arctan2(up, along) - walker.slope)


def sample_legs_from_section(
    site: WalkerOnGround, tolerances: Tolerances, z: Floats, heights: Floats, times: Floats, stance: int
) -> Floats:
    """Sample the leg angles (times, 2) in a walk like that of `walk_from_section`. The first stance leg is column 0.

    times  s, from the start on the section
    """
    walker = site.walker
    start = state_on_section(walker, z, stance)
    walk_state = walk_state_on_section(place_footholds(site, heights), start, heights.size, stance)
    observer = new_observer(walker, walk_state, start, times, track_energy=False)
    walk_on(walker, tolerances, walk_state, observer, start, NO_LIMIT)
    legs = [ANGLES + walker.legs[foot][0] for foot in (stance, 1 - stance)]
    return np.asarray(observer.samples.states[:, legs])


def place_footholds(site: WalkerOnGround, heights: Floats) -> WalkerOnGround:
    # On the section, the stance foot is at the height of the first touchdown, `heights[0]`.
    over = np.append(heights[0], heights) - heights[0]
    return replace_terrain(site, site.ground.terrain._replace(heights=over)) if over.any() else site


def shorten(walk_state: WalkState, steps: int) -> WalkState:
    # The shorter arrays are views, so steps are recorded in `walk_state` itself.
    return walk_state._replace(**{name: getattr(walk_state, name)[:steps] for name in events.STEP_FIELDS})


def push_at_hip(system: OnGround, walker: ContactWalker, state: State, impulse: float) -> State:
    """Return a state of the free walker just after an impulse (N s) at the hip along the slope."""
    form = system.form
    new = np.array(state)
    y = forms.to_form(form, new)
    n = int(form.bodies)
    half = int(form.places + form.bodies)
    s, c, r = np.zeros((3, n))
    M = np.zeros((n, n))
    forms.sines_cosines(form, y, s, c)
    add_inertia(form, n, s, c, y[half + 2 :], M, r)
    # A forward impulse above the centre of mass turns the walker clockwise.
    r[:] = -impulse * (s * form.hip_x[:n] + c * form.hip_y[:n])
    factor_linked(form.E[0], n, M)
    solve_linked(form.E[0], n, M, r)
    y[half] += impulse / form.mass
    y[half + 2 :] += r
    return tuple(forms.to_full(form, y, walker.size).tolist())


def walk_state_on_section(site: WalkerOnGround, start: State, steps: int, stance: int) -> WalkState:
    """Return the walk state that belongs to a start on the section, with room for `steps` touchdowns."""
    swing = 1 - stance
    walk_state = new_walk_state(site.walker, site.ground, stance, steps, start)
    feet = forms.feet_motion(site.walker.whole, start)
    walk_state.at_zero[:] = 0
    walk_state.at_zero[PASSING] = 1
    walk_state.sides[PASSING] = 1 if swing == 1 else -1
    carried = has_ground_in_air(site.ground.terrain, bool(walk_state.has_ground[swing]), False, True)
    walk_state.has_ground[swing] = feet[swing].height > 0.0 and carried
    # The swing foot is above the gap that follows the pad it left.
    walk_state.left_cells[swing] = walk_state.cells[swing] - 1
    walk_state.foothold[swing] = feet[stance].along - site.ground.frame.leg_length
    return walk_state


def section_units(site: WalkerOnGround, stance: int) -> Floats:
    """Return the units (d,) of the section coordinates while foot `stance` is the stance foot."""
    L = site.ground.frame.leg_length
    tau = site.ground.frame.pendulum_time
    angles, rates = (len(bodies(site.walker, stance)) for bodies in (angled_bodies, turning_bodies))
    return np.array([L, *[1.0] * angles, L / tau, L / tau, *[1.0 / tau] * rates])


class ContactMap(StepMap):
    """Step map of a walker on compliant ground, scaled by leg length and pendulum time.

    For a walker on pads, families are followed on a plane that feet can touch only ahead of the stance foot, so that
    straight legs may scuff. `watch` reports whether pads of the gait's step length would trip the swing foot.
    """

    monitors = (
        Monitor("slip_m", "m", "largest net slip of a foot from touch to lift"),
        Monitor("tripped", "1", "whether the swing foot trips on pads spaced by the gait's own step length", 0.5),
    )
    disturbs_after = 1
    # A probe must be small compared with the penetration of stiff ground, which is below 0.01 mm.
    probe = 1e-6

    def __init__(
        self,
        walker_at: Callable[[float], WalkerOnGround | None],
        scale: float,
        tolerances: Tolerances,
        step_length_m: float,
        like: WalkerOnGround,
        first: int = 0,
    ) -> None:
        """Prepare the map of a family of walkers.

        walker_at      function from the parameter to a walker, or to None if the value gives no valid walker
        scale          size of a typical change of the parameter
        step_length_m  step length of a gait, the pitch of the `after_mid_swing` terrain that replaces pads
        like           walker of the family that gives the units
        first          leg that swings in even steps: 0 for leg 1, 1 for leg 2
        """

        @lru_cache(maps.CACHE_SIZE)
        def site_at(p: float) -> WalkerOnGround | None:
            site = walker_at(p)
            if site is None or not site.ground.terrain.has_pads:
                return site
            return replace_terrain(site, after_mid_swing(step_length_m))

        self._at = site_at
        self.scale = scale
        self.tolerances = tolerances
        self._on_pads = like.ground.terrain.has_pads
        self._first = first
        self._units = [section_units(like, self._stance(swing)) for swing in range(2)]

    def _stance(self, swing: int) -> int:
        return stance_of(self._first + swing)

    def scale_section(self, z: Floats) -> Floats:
        return np.asarray(z / self._units[0])

    def _walk(self, site: WalkerOnGround, z: Floats, derived: bool, swing: int = 0) -> SectionStep:
        z_m = z * self._units[swing % 2]
        return step_from_section(site, self.tolerances, z_m, site.ground.terrain.pitch, derived, self._stance(swing))

    def step(self, z: Floats, p: float, derived: bool = True, swing: int = 0) -> MappedStep:
        site = self._at(p)
        if site is None:
            return maps.failed_step(None, z.size)
        step = self._walk(site, z, derived, swing)
        if step.outcome is not Outcome.WALKED:
            return maps.failed_step(step.outcome, z.size)
        units, ahead = self._units[swing % 2], self._units[(swing + 1) % 2]
        DP = step.DP * units / ahead[:, None] if derived else step.DP
        return replace(step, z=step.z / ahead, DP=DP)

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        site = maps.valid(self._at(p))
        slip = 0.0
        tripped = 0.0
        start = z
        for swing in range(steps):
            step = self._walk(site, start, False, swing)
            slip = max(slip, abs(step.slip_m))
            start = step.z / self._units[(swing + 1) % 2]
            if self._on_pads and steps == 1:
                on_pads = replace_terrain(site, checkerboard(step.length_m, (0.0, 0.0)))
                tripped = float(self._walk(on_pads, z, False).outcome is not Outcome.WALKED)
        return np.array([slip, tripped])

    def take_disturbed_walk(
        self, z: Floats, p: float, heights_m: Floats, push_N_s: float = 0.0, swing: int = 0
    ) -> DisturbedWalk:
        """Simulate a walk over foothold heights (m) from the touchdown after z. The push acts at this touchdown."""
        site = maps.valid(self._at(p))
        endless = replace(self.tolerances, budget=self.tolerances.budget * heights_m.size)
        start = z * self._units[swing % 2]
        walk = walk_from_section(site, endless, start, heights_m, push_N_s, self._stance(swing))
        # If the sections of both legs have different sizes, the size shows which leg stands. Otherwise both have the
        # same units.
        return replace(walk, z=walk.z / next(units for units in self._units if units.size == walk.z.size))

    def rest_on_ground(self, z: Floats, p: float) -> Floats:
        site = self._at(p)
        return z if site is None else stand(site.walker, z * self._units[0], self._stance(0)) / self._units[0]

    def sample_legs(self, z: Floats, p: float, heights_m: Floats, times_s: Floats) -> Floats:
        site = maps.valid(self._at(p))
        touch = self.step(z, p, derived=False)
        endless = replace(self.tolerances, budget=self.tolerances.budget * heights_m.size)
        times = times_s + touch.strike_s
        start = z * self._units[0]
        return sample_legs_from_section(site, endless, start, heights_m, times, self._stance(0))

    def cost_of_transport(self, z: Floats, p: float) -> float | None:
        stride = maps.walk_steps(self, z, p, self.stride, derived=False)
        if stride.outcome is not Outcome.WALKED:
            return None
        works = [step.driven for step in stride.steps if isinstance(step, SectionStep)]
        # The last field, the knees' work, may be None. It does not count in the cost.
        sums = (math.fsum(each) for each in zip(*(work[1:-1] for work in works), strict=True))
        return DrivenWork(works[0].weight, *sums).cost_of_transport(math.fsum(stride.lengths_m))

    def leg_and_pendulum(self, p: float) -> tuple[float, float]:
        site = maps.valid(self._at(p))
        return site.ground.frame.leg_length, site.ground.frame.pendulum_time

    def replace_tolerances(self, tolerances: Tolerances) -> ContactMap:
        changed = copy(self)
        changed.tolerances = tolerances
        return changed


class AdaptivePads(Stepper):
    """Stepper (SI) of a walker on compliant ground. It sets the pitch of the pads to the length of the last step.

    pitches_m  initial pitch for each step of a gait; if the legs differ, one for the steps of each leg
    """

    def __init__(
        self,
        walker_at: Callable[[float], ContactWalker],
        ground: JudgedGround,
        tolerances: Tolerances,
        *pitches_m: float,
    ) -> None:
        self.walker_at = walker_at
        self.ground = ground
        self.tolerances = tolerances
        self.pitches_m = [*pitches_m]

    def step(self, z: Floats, p: float, derived: bool = True, swing: int = 0) -> MappedStep:
        index = swing % len(self.pitches_m)
        site = WalkerOnGround(self.walker_at(p), self.ground)
        step = step_from_section(site, self.tolerances, z, self.pitches_m[index], derived, stance_of(swing))
        if step.outcome is Outcome.WALKED:
            self.pitches_m[index] = step.length_m if len(self.pitches_m) == 1 else step.spacing_m
        return step


def lengths_between_touches(gait: Cycle) -> Floats:
    """Return the lengths (n,) of a gait's steps from touch to touch, in m. `lengths_m` are those between sections."""
    steps = [step for step in gait.steps if isinstance(step, SectionStep)]
    return np.array([steps[k - 1].moved_m + step.spacing_m for k, step in enumerate(steps)])


def contact_step(gait: Cycle) -> SectionStep:
    assert isinstance(gait.step, SectionStep), "the gait must be one of the contact model"
    return gait.step
