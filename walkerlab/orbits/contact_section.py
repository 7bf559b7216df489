"""The stride map of the contact model, on a section where nothing is touching or lifting.

Section: the swing foot passes the stance foot. One foot then stands, the transients of its touch have died away, and
the other swings freely; just after a touch the state is still in motion on the contact's own time scale, which makes
touch-down a poor section. Coordinates by role, six numbers: height of the centre of mass, the angle of the stance leg,
velocity along and normal to the slope, angular velocities of swing and stance leg. The swing leg's angle follows from
the section; where along the slope it happens does not matter.

One step maps the section to itself with the legs' roles exchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.motion import OnGround
from walkerlab.ground.terrain import Checkerboard
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import PASSING, SIGNALS, feet_motion
from walkerlab.hybrid.contact_observer import ContactObserver
from walkerlab.hybrid.contact_rules import Ledger
from walkerlab.hybrid.contact_run import Ground, MethodSettings, new_ledger, new_observer, walk_free
from walkerlab.hybrid.outcome import Outcome
from walkerlab.solvers.registry import finder_for
from walkerlab.solvers.scipy_methods import right_hand_side
from walkerlab.solvers.stepping import T
from walkerlab.solvers.system import State

Floats = NDArray[np.float64]
COORDINATES = 6
# places in the state of a walker with two legs: along, height, two angles, and the velocities of these
ALONG, HEIGHT, ANGLES, ALONG_RATE, HEIGHT_RATE, RATES = 0, 1, 2, 4, 5, 6


@dataclass(frozen=True)
class SectionStep:
    """One step from the section to the section."""

    outcome: Outcome
    z: Floats  # (6,) where it led
    DP: Floats  # (6, 6) its derivative
    period_s: float
    length_m: float  # how far the walker went
    slip_m: float  # net, from touch to lift: of the foot that lands up to here, and of the other from here on
    books_J: Floats  # (3,) dissipated by damping, by friction, at edges
    height_lost_J: float  # potential energy given up
    work: NDArray[np.int64]  # right-hand sides, accepted, rejected, Jacobians
    touch_s: float  # from the section to the touch
    spacing_m: float  # between the feet at the touch


def state_on_section(z: Floats, stance: int) -> State:
    """The walker's state (8) of section coordinates, with `stance` the standing leg, at along = 0."""
    height, angle, along_rate, height_rate, swing_rate, stance_rate = (float(x) for x in z)
    rates = (swing_rate, stance_rate) if stance == 1 else (stance_rate, swing_rate)
    return (0.0, height, angle, angle, along_rate, height_rate, *rates)


def coordinates_of(state: Floats, stance: int) -> Floats:
    """Section coordinates of a state whose standing leg is `stance`."""
    swing = 1 - stance
    picked = [HEIGHT, ANGLES + stance, ALONG_RATE, HEIGHT_RATE, RATES + swing, RATES + stance]
    return np.asarray(state)[picked]


def directions(stance: int) -> Floats:
    """Derivative (8, 6) of `state_on_section`."""
    swing = 1 - stance
    along = np.zeros((8, COORDINATES))
    along[HEIGHT, 0] = along[ALONG_RATE, 2] = along[HEIGHT_RATE, 3] = 1.0
    along[ANGLES, 1] = along[ANGLES + 1, 1] = 1.0
    along[RATES + swing, 4] = along[RATES + stance, 5] = 1.0
    return along


def pads_for(ground: Ground, walker: ContactWalker, state: State, stance: int, pitch_m: float) -> Ground:
    """The ground with its pads laid for steps of `pitch_m`, the standing foot in the middle of one."""
    if not isinstance(ground.terrain, Checkerboard):
        return ground
    foothold = feet_motion(walker, state)[stance].along
    ahead = foothold + pitch_m
    lanes = (ahead, foothold) if stance == 1 else (foothold, ahead)
    return Ground(Checkerboard(pitch_m, lanes), ground.frame)


def step_from_section(
    walker: ContactWalker, ground: Ground, methods: MethodSettings, z: Floats, pitch_m: float, booked: bool = False
) -> SectionStep:
    """Walk from the section to the section.

    z        (6,) section coordinates
    pitch_m  what the pads are laid for
    booked   whether to keep the energy's books
    """
    stance = STANCE_FOOT
    start = state_on_section(z, stance)
    laid = pads_for(ground, walker, start, stance, pitch_m)
    ledger = new_ledger(walker, laid.terrain, stance, 2, start)
    stand_on_section(ledger, walker, laid, start, stance)
    observer = new_observer(walker, ledger, start, booked=booked, directions=COORDINATES)
    observer.tangent.Phi[:, :] = directions(stance)
    method = methods.new(len(walker.blank))
    finder = finder_for(method, SIGNALS)
    outcome = Outcome(walk_free(walker, laid, method, finder, observer, ledger, 0.0, start, 1))
    end = method.y.copy()
    landed = feet_motion(walker, tuple(end.tolist()))[1 - stance].along - ledger.foothold[1 - stance]
    DP = section_derivative(walker, ledger, observer, end, 1 - stance)
    lost = walker.tree.mass * (walker.gravity_along * (end[ALONG] - start[ALONG]))
    lost -= walker.tree.mass * walker.gravity_down * (end[HEIGHT] - start[HEIGHT])
    return SectionStep(
        outcome,
        coordinates_of(end, 1 - stance),
        DP,
        float(method.clock[T]),
        float(end[ALONG] - start[ALONG]),
        float(ledger.slip[0] + landed),
        observer.books.copy(),
        float(lost),
        method.counts[:4].copy(),
        float(ledger.touch_time[0]),
        float(ledger.touch_along[0] - ledger.foothold[stance] - ledger.slip[0]),
    )


def stand_on_section(ledger: Ledger, walker: ContactWalker, ground: Ground, start: State, stance: int) -> None:
    """Correct a ledger made for a start with both feet down: here one stands and the other swings past it."""
    swing = 1 - stance
    feet = feet_motion(walker, start)
    ledger.at_zero[:] = 0
    ledger.at_zero[PASSING] = 1
    ledger.carried[swing] = 0
    ledger.left_cells[swing] = ledger.cells[swing] - 1
    ledger.foothold[swing] = feet[stance].along - ground.frame.leg_length


def section_derivative(
    walker: ContactWalker, ledger: Ledger, observer: ContactObserver, end: Floats, stance: int
) -> Floats:
    """Derivative (6, 6) of the step: the flow's, less how it shifts the moment at which the feet pass."""
    system = OnGround(walker, (bool(ledger.carried[0]), bool(ledger.carried[1])))
    rate = np.zeros(end.size)
    right_hand_side(system, 0.0, end, rate)
    gradient = np.zeros(end.size)
    for k in range(2):
        tilted = end[ANGLES + k] + walker.slope
        upward = [np.sin(tilted) * foot.lever_x[k] + np.cos(tilted) * foot.lever_y[k] for foot in walker.feet]
        gradient[ANGLES + k] = upward[0] - upward[1]
    Phi = observer.tangent.Phi
    on_section = Phi - np.outer(rate, gradient @ Phi) / (gradient @ rate)
    return np.column_stack([coordinates_of(column, stance) for column in on_section.T])


@dataclass(frozen=True)
class ContactGait:
    """A periodic walk of the contact model."""

    z: Floats  # (6,) section coordinates
    step: SectionStep  # the step from there
    multipliers: NDArray[np.complex128]  # (6,) of the step map, largest first
    residual: float  # largest component of P(z) - z, in the section's units
    iterations: int

    @property
    def stable(self) -> bool:
        """Whether all multipliers are inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)


def find_contact_gait(
    walker: ContactWalker,
    ground: Ground,
    methods: MethodSettings,
    z: Any,
    pitch_m: float,
    tolerance: float = 1e-10,
    most_steps: int = 60,
) -> ContactGait | SectionStep:
    """Newton on the step map with its exact derivative, from section coordinates z (6,).

    pitch_m     the pads' pitch to begin with; each iteration lays them for the step it has just taken
    most_steps  how many steps may be walked in search of it

    Returns the gait, or the last step that could be walked if no gait is near.
    """
    z = np.asarray(z, float).copy()
    step = step_from_section(walker, ground, methods, z, pitch_m, booked=True)
    iteration, walked = 0, 1
    while step.outcome is Outcome.WALKED and walked < most_steps:
        residual = float(np.max(np.abs(step.z - z)))
        if residual <= tolerance:
            multipliers = np.linalg.eigvals(step.DP).astype(np.complex128)
            order = np.argsort(-np.abs(multipliers), kind="stable")
            return ContactGait(z, step, multipliers[order], residual, iteration)
        move = np.linalg.solve(np.eye(COORDINATES) - step.DP, step.z - z)
        z, step, tried = damped(walker, ground, methods, z, move, residual, step)
        iteration, walked = iteration + 1, walked + tried
    return step


def damped(
    walker: ContactWalker,
    ground: Ground,
    methods: MethodSettings,
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
        ahead = step_from_section(walker, ground, methods, candidate, step.length_m, booked=True)
        fine = ahead.outcome is Outcome.WALKED and float(np.max(np.abs(ahead.z - candidate))) < 2.0 * residual
        if fine or scale < 1e-3:
            return candidate, ahead, tried
        scale *= 0.5
