"""The stride map of the contact model, on a section where nothing is touching or lifting.

Section: the swing foot passes the stance foot. One foot then stands, the transients of its touch have died away, and
the other swings freely; just after a touch the state is still in motion on the contact's own time scale, which makes
touch-down a poor section. Coordinates by role: height of the centre of mass, the angles of the legs' bodies but the
uppermost of the swing leg, which follows from the section, velocity along and normal to the slope, and the angular
velocities of all bodies that turn on their own; of two straight legs these are six numbers. A knee of the stance leg is
locked, that of the swing leg is not. Where along the slope it happens does not matter.

One step maps the section to itself with the legs' roles exchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.knees import IdealLock
from walkerlab.ground.terrain import checkerboard, has_ground_in_air
from walkerlab.ground.walker import ContactWalker, feet_motion, folded, on_ground
from walkerlab.hybrid.contact_events import PASSING, JudgedGround, WalkState, material_along
from walkerlab.hybrid.contact_knee import rate_of
from walkerlab.hybrid.contact_observer import ContactObserver
from walkerlab.hybrid.contact_run import new_observer, new_walk_state, walk_on
from walkerlab.hybrid.outcome import Outcome
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import State

Floats = NDArray[np.float64]
# places in the state: along, height, the bodies' angles, and the velocities of these
ALONG, HEIGHT, ANGLES = 0, 1, 2
COORDINATES = 6  # of a walker with two straight legs
NEWTON_STEPS = 20


@dataclass(frozen=True)
class SectionStep:
    """One step from the section to the section."""

    outcome: Outcome
    z: Floats  # (coordinates,) where it led
    DP: Floats  # (coordinates, coordinates) its derivative
    period_s: float
    length_m: float  # how far the walker went
    slip_m: float  # net, from touch to lift: of the foot that lands up to here, and of the other from here on
    rolling_m: float  # likewise
    dissipated_J: Floats  # (5,) dissipated by damping, by friction, at edges, at knees' strikes, in their stops
    height_lost_J: float  # potential energy given up
    work: NDArray[np.int64]  # right-hand sides, accepted, rejected, Jacobians
    touch_s: float  # from the section to the touch
    spacing_m: float  # between the feet at the touch


def turning_bodies(walker: ContactWalker, stance: int) -> tuple[int, ...]:
    """Bodies that turn on their own, the swing leg's first; the shank below the stance leg's locked knee does not."""
    locked = walker.whole.shanks[stance] if walker.kneed else None
    return (*walker.legs[1 - stance], *(body for body in walker.legs[stance] if body != locked))


def angled_bodies(walker: ContactWalker, stance: int) -> tuple[int, ...]:
    """Bodies whose angles are coordinates; a stop that has latched keeps an angle of its own in the stance knee."""
    free = turning_bodies(walker, stance)[1:]
    if walker.kneed and not isinstance(walker.stop, IdealLock):
        return (*free, int(walker.whole.shanks[stance]))
    return free


def with_followers(walker: ContactWalker, stance: int, angles: Floats, given: tuple[int, ...]) -> Floats:
    """Angles (n), or changes of them, with those of bodies that follow others and are not `given`."""
    whole, n = walker.whole, angles.size
    if walker.kneed and whole.shanks[stance] not in given:
        angles[whole.shanks[stance]] = angles[whole.thighs[stance]]
    for body in range(n):
        if whole.E[body, body] == 0.0 and body not in given:
            angles[body] = whole.E[body, :n] @ angles
    return angles


def feet_apart(walker: ContactWalker, angles: Floats) -> tuple[float, Floats]:
    """How far foot 0 is ahead of foot 1 (m), and its derivatives by the bodies' angles (n)."""
    s, c = np.sin(angles + walker.slope), np.cos(angles + walker.slope)
    x, y = ((lever[0] - lever[1])[: angles.size] for lever in (walker.whole.foot_x, walker.whole.foot_y))
    return float(c @ x - s @ y), -(s * x + c * y)


def state_on_section(walker: ContactWalker, z: Floats, stance: int) -> State:
    """The walker's state of section coordinates, with `stance` the standing leg, at along = 0."""
    n = int(walker.whole.bodies)
    turning, angled = turning_bodies(walker, stance), angled_bodies(walker, stance)
    state = np.zeros(4 + 2 * n)
    state[HEIGHT], (state[2 + n], state[3 + n]) = z[0], z[1 + len(angled) : 3 + len(angled)]
    rates = np.zeros(n)
    rates[list(turning)] = z[3 + len(angled) :]
    state[4 + n :] = with_followers(walker, stance, rates, turning)
    angles = np.zeros(n)
    angles[list(angled)] = z[1 : 1 + len(angled)]
    angles[turning[0]] = angles[walker.legs[stance][0]]
    state[ANGLES : ANGLES + n] = feet_abreast(walker, stance, angles)
    return tuple(float(x) for x in state)


def feet_abreast(walker: ContactWalker, stance: int, angles: Floats) -> Floats:
    """The angles (n) with the swing leg's uppermost body turned until the feet pass each other."""
    angled, upper = angled_bodies(walker, stance), turning_bodies(walker, stance)[0]
    turned = with_followers(walker, stance, np.eye(angles.size)[upper], (upper, *angled))
    for _ in range(NEWTON_STEPS):
        angles = with_followers(walker, stance, angles, (upper, *angled))
        apart, gradient = feet_apart(walker, angles)
        move = -apart / float(gradient @ turned)
        angles[upper] += move
        if abs(move) < 1e-15:
            break
    return with_followers(walker, stance, angles, (upper, *angled))


def coordinates_of(walker: ContactWalker, state: Floats, stance: int) -> Floats:
    """Section coordinates of a state whose standing leg is `stance`."""
    n = int(walker.whole.bodies)
    angles = [ANGLES + body for body in angled_bodies(walker, stance)]
    rates = [4 + n + body for body in turning_bodies(walker, stance)]
    return np.asarray(state)[[HEIGHT, *angles, 2 + n, 3 + n, *rates]]


def directions(walker: ContactWalker, state: State, stance: int) -> Floats:
    """Derivative (4 + 2 n, coordinates) of `state_on_section`, at the state it gave."""
    n = int(walker.whole.bodies)
    turning, angled = turning_bodies(walker, stance), angled_bodies(walker, stance)
    along = np.zeros((4 + 2 * n, 3 + len(angled) + len(turning)))
    _, gradient = feet_apart(walker, np.array(state[ANGLES : ANGLES + n]))
    given = (turning[0], *angled)
    upper = with_followers(walker, stance, np.eye(n)[turning[0]], given)
    along[HEIGHT, 0] = 1.0
    for column, body in enumerate(angled, 1):
        turned = with_followers(walker, stance, np.eye(n)[body], given)
        along[ANGLES : ANGLES + n, column] = turned - upper * (gradient @ turned) / (gradient @ upper)
    along[2 + n, 1 + len(angled)] = along[3 + n, 2 + len(angled)] = 1.0
    for column, body in enumerate(turning, 3 + len(angled)):
        along[4 + n :, column] = with_followers(walker, stance, np.eye(n)[body], turning)
    return along


def pads_for(ground: JudgedGround, walker: ContactWalker, state: State, stance: int, pitch_m: float) -> JudgedGround:
    """The ground with its pads laid for steps of `pitch_m`, the standing foot in the middle of one."""
    if not ground.terrain.has_pads:
        return ground
    foothold = feet_motion(walker.whole, state)[stance].along
    ahead = foothold + pitch_m
    lanes = (ahead, foothold) if stance == 1 else (foothold, ahead)
    return JudgedGround(checkerboard(pitch_m, lanes), ground.frame)


def step_from_section(
    walker: ContactWalker, ground: JudgedGround, tolerances: Tolerances, z: Floats, pitch_m: float
) -> SectionStep:
    """Walk from the section to the section.

    z        section coordinates
    pitch_m  what the pads are laid for
    """
    stance = STANCE_FOOT
    start = state_on_section(walker, z, stance)
    laid = pads_for(ground, walker, start, stance, pitch_m)
    walk_state = new_walk_state(walker, laid.terrain, stance, 2, start)
    stand_on_section(walk_state, walker, laid, start, stance)
    observer = new_observer(walker, walk_state, start, directions=z.size)
    observer.tangent.Phi[:, :] = directions(walker, start, stance)
    stopped = walk_on(walker, laid, tolerances, walk_state, observer, start, 1)
    end = np.array(stopped.state)
    slipped, rolled = since_touch(walker, walk_state, stopped.state, 1 - stance)
    DP = section_derivative(walker, walk_state, observer, end, 1 - stance)
    lost = walker.mass * (walker.gravity_along * (end[ALONG] - start[ALONG]))
    lost -= walker.mass * walker.gravity_down * (end[HEIGHT] - start[HEIGHT])
    return SectionStep(
        stopped.outcome,
        coordinates_of(walker, end, 1 - stance),
        DP,
        stopped.time_s,
        float(end[ALONG] - start[ALONG]),
        float(walk_state.slip[0] + slipped),
        float(walk_state.rolling[0] + rolled),
        observer.dissipated.copy(),
        float(lost),
        stopped.work,
        float(walk_state.touch_time[0]),
        float(walk_state.touch_along[0] - walk_state.foothold[stance] - walk_state.slip[0]),
    )


def since_touch(walker: ContactWalker, walk_state: WalkState, y: State, foot: int) -> tuple[float, float]:
    """How far a foot has slipped and rolled since its touch (m)."""
    along = feet_motion(walker.whole, y)[foot].along
    slipped = material_along(walker.whole, foot, along, y) - float(walk_state.touched[foot])
    return slipped, along - float(walk_state.foothold[foot]) - slipped


def stand_on_section(
    walk_state: WalkState, walker: ContactWalker, ground: JudgedGround, start: State, stance: int
) -> None:
    """Correct a walk state made for a start with both feet down: here one stands and the other swings past it."""
    swing = 1 - stance
    feet = feet_motion(walker.whole, start)
    walk_state.at_zero[:] = 0
    walk_state.at_zero[PASSING] = 1
    walk_state.sides[PASSING] = 1 if swing == 1 else -1
    above = feet[swing].height > 0.0
    walk_state.has_ground[swing] = above and has_ground_in_air(
        ground.terrain, bool(walk_state.has_ground[swing]), False, True
    )
    walk_state.left_cells[swing] = walk_state.cells[swing] - 1
    walk_state.foothold[swing] = feet[stance].along - ground.frame.leg_length


def section_derivative(
    walker: ContactWalker, walk_state: WalkState, observer: ContactObserver, end: Floats, stance: int
) -> Floats:
    """Derivative of the step: the flow's, less how it shifts the moment at which the feet pass."""
    system = on_ground(walker, walk_state.has_ground, walk_state.knee)
    rate = rate_of(system, folded(system.form, end), end.size)
    gradient, n = np.zeros(end.size), int(walker.whole.bodies)
    gradient[ANGLES : ANGLES + n] = feet_apart(walker, end[ANGLES : ANGLES + n])[1]
    Phi = observer.tangent.Phi
    on_section = Phi - np.outer(rate, gradient @ Phi) / (gradient @ rate)
    return np.column_stack([coordinates_of(walker, column, stance) for column in on_section.T])


@dataclass(frozen=True)
class ContactGait:
    """A periodic walk of the contact model."""

    z: Floats  # section coordinates
    step: SectionStep  # the step from there
    multipliers: NDArray[np.complex128]  # of the step map, largest first
    residual: float  # largest component of P(z) - z, in the section's units
    iterations: int

    @property
    def stable(self) -> bool:
        """Whether all multipliers are inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)


def find_contact_gait(
    walker: ContactWalker,
    ground: JudgedGround,
    tolerances: Tolerances,
    z: Any,
    pitch_m: float,
    tolerance: float = 1e-10,
    most_steps: int = 60,
) -> ContactGait | SectionStep:
    """Newton on the step map with its exact derivative, from section coordinates z.

    pitch_m     the pads' pitch to begin with; each iteration lays them for the step it has just taken
    most_steps  how many steps may be walked in search of it

    Returns the gait, or the last step that could be walked if no gait is near.
    """
    z = np.asarray(z, float).copy()
    step = step_from_section(walker, ground, tolerances, z, pitch_m)
    iteration, walked = 0, 1
    while step.outcome is Outcome.WALKED and walked < most_steps:
        residual = float(np.max(np.abs(step.z - z)))
        if residual <= tolerance:
            multipliers = np.linalg.eigvals(step.DP).astype(np.complex128)
            order = np.argsort(-np.abs(multipliers), kind="stable")
            return ContactGait(z, step, multipliers[order], residual, iteration)
        move = np.linalg.solve(np.eye(z.size) - step.DP, step.z - z)
        z, step, tried = damped(walker, ground, tolerances, z, move, residual, step)
        iteration, walked = iteration + 1, walked + tried
    return step


def damped(
    walker: ContactWalker,
    ground: JudgedGround,
    tolerances: Tolerances,
    z: Floats,
    move: Floats,
    residual: float,
    step: SectionStep,
) -> tuple[Floats, SectionStep, int]:
    """Take Newton's move, halved until the next step is walked and its residual is no worse than double.

    Returns the new coordinates, the step from there, and how many steps were walked to find them.
    """
    scale, tried = 1.0, 0
    while True:
        tried += 1
        candidate = z + scale * move
        ahead = step_from_section(walker, ground, tolerances, candidate, step.length_m)
        fine = ahead.outcome is Outcome.WALKED and float(np.max(np.abs(ahead.z - candidate))) < 2.0 * residual
        if fine or scale < 1e-3:
            return candidate, ahead, tried
        scale *= 0.5
