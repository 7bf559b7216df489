"""A whole walk on compliant ground: hinged first step if wanted, then free, with everything observed on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.ground.energy import kinetic_energy, potential_energy, total_energy
from walkerlab.ground.held import (
    BENT,
    FLEXED,
    LOCKED,
    RELEASED,
    Knees,
    extension,
    knee_energy,
    stop_flags,
)
from walkerlab.ground.merged import ByKnees
from walkerlab.ground.pinned import Pinned, floating_state
from walkerlab.ground.terrain import Terrain, cell_at, has_ground_in_cell, starts_with_ground
from walkerlab.ground.walker import ContactWalker, FootMotion, foot_force
from walkerlab.hybrid.contact_events import (
    EVENT_FUNCTIONS,
    FALL,
    FALLEN_HIP,
    HEIGHT,
    LEFT_EDGE,
    PASSING,
    PER_FOOT,
    RIGHT_EDGE,
    SLIDE,
    Frame,
    feet_motion,
    hip_height,
    material_along,
)
from walkerlab.hybrid.contact_observer import (
    AT_HAND,
    CHANNEL_COUNT,
    MAX_PENETRATION,
    RESIDUAL,
    START_ENERGY,
    ContactObserver,
)
from walkerlab.hybrid.contact_phases import method_by_knees, walk_by_knees
from walkerlab.hybrid.contact_rules import AIRBORNE_SINCE, STEPS, WalkState, steps_with_lift
from walkerlab.hybrid.contact_tangent import Tangent, new_tangent
from walkerlab.hybrid.contact_walk import AT_LIFT, walk_part
from walkerlab.hybrid.outcome import Outcome
from walkerlab.kernels import kernel, uncompiled
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.registry import Tolerances, finder_for
from walkerlab.solvers.stepping import T
from walkerlab.solvers.system import State
from walkerlab.solvers.vectors import load

Floats = NDArray[np.float64]
CHANNELS = ("damping", "friction", "edges", "knee_strikes", "knee_stop")
OF_STRAIGHT_LEGS = 3  # channels

NEVER = -1
ROUNDING = 1e-14  # of a start's coordinates and velocities
USUAL_STEP = 3.0  # pendulum times that most steps are shorter than
# Residuals over rtol times energy and work exchanged: random walks leave at most 0.5 by radau5 at any rtol from 1e-2 to
# 1e-9 (scripts/contact_campaign.py prints those of its walks), and 9 by the libraries' multistep methods; cases of the
# stability catalogue, of which ground of 1e14 N/m is the worst, leave at most 9.
UNEXPLAINED = 100.0
FINEST = 1e-10  # rtol below which a walk's rounding, and no longer its tolerance, makes the residual


@dataclass(frozen=True)
class Stopped:
    """Where and at what cost a walk stopped."""

    time_s: float
    state: State
    work: NDArray[np.int64]


class JudgedGround(NamedTuple):
    """What a walk happens on and is judged by."""

    terrain: Terrain
    frame: Frame


@kernel
def walk_free(
    walker: ContactWalker,
    ground: JudgedGround,
    method: Any,
    finder: CrossingFinder,
    observer: ContactObserver,
    walk_state: WalkState,
    t: float,
    y: State,
    stop_passing_after: int,
) -> int:
    """Walk with both feet free from state y at t (s) until the walk state is full or the walk ends.

    With `stop_passing_after` at least zero it also stops when, after that many steps, the feet pass each other; with
    AT_LIFT a walk whose walk state is full goes on until the foot that carried its last step has lifted.
    """
    terrain, frame = ground.terrain, ground.frame
    return walk_by_knees(
        walker.merging, walker, terrain, frame, method, finder, observer, walk_state, t, y, stop_passing_after
    )


@kernel
def walk_hinged(
    pinned: Pinned,
    ground: JudgedGround,
    method: Any,
    finder: CrossingFinder,
    observer: ContactObserver,
    walk_state: WalkState,
    y: State,
) -> int:
    """Walk with the first stance foot hinged, from the angles and velocities y, until the first step or the end."""
    return walk_part(
        pinned, pinned.walker, ground.terrain, ground.frame, method, finder, observer, walk_state, 0.0, y, NEVER
    )


@kernel
def sampled_energies(walker: ContactWalker, states: Any, has_ground: Any, knees: Any, energies: Any) -> None:
    """Kinetic, potential and total energy (J) of every sampled state into energies (samples, 3)."""
    for i in range(states.shape[0]):
        y = load(states, i, walker.blank)
        energies[i, 0] = kinetic_energy(walker, y)
        energies[i, 1] = potential_energy(walker, y)
        energies[i, 2] = total_energy(walker, (has_ground[i, 0] != 0, has_ground[i, 1] != 0), y)
        energies[i, 2] += knee_energy(walker.knees, stop_flags(walker.knees, knees[i]), y, 2)


@kernel
def sampled_feet(walker: ContactWalker, states: Any, has_ground: Any, feet: Any) -> None:
    """Position along, height (m), normal force, friction (N) and slip (m/s) of both feet into feet (samples, 2, 5)."""
    for i in range(states.shape[0]):
        y = load(states, i, walker.blank)
        motions = feet_motion(walker, y)
        for foot in range(2):
            motion = motions[foot]
            feet[i, foot, 0], feet[i, foot, 1], feet[i, foot, 4] = motion.along, motion.height, motion.slip
            feet[i, foot, 2], feet[i, foot, 3] = 0.0, 0.0
            if has_ground[i, foot] != 0 and motion.height < 0.0:
                force = foot_force(walker, motion)
                feet[i, foot, 2], feet[i, foot, 3] = force.normal.force, force.along


@dataclass(frozen=True)
class ContactSamples:
    """A walk at evenly spaced times."""

    time_s: Floats  # (samples,)
    states: Floats  # (samples, 4 + 2 n)
    has_ground: NDArray[np.int8]  # (samples, 2)
    stance: NDArray[np.int64]  # (samples,)
    knees: NDArray[np.int8]  # (samples, 2) what each knee is doing
    dissipated_J: Floats  # (samples, 5) by damping, by friction, at edges, at knees' strikes, in their stops


@dataclass(frozen=True)
class ContactWalkResult:
    """A walk on compliant ground, its fate and its cost."""

    outcome: Outcome
    touch_time_s: Floats  # (steps,)
    touch_along_m: Floats  # (steps,)
    slip_m: Floats  # (steps,) of the stance foot's material; without the last step if its foot did not lift
    rolling_m: Floats  # likewise, how far the stance foot rolled
    end_time_s: float
    end_state: State
    max_penetration_m: float
    energy_balance_residual_J: float
    explained_residual_J: float  # what the tolerance explains of it at most
    dissipated_J: Floats  # (5,)
    knee_strike_s: Floats  # (steps,) when the knee of each step's swing leg locked; of straight legs, none
    work: NDArray[np.int64]  # right-hand sides, accepted, rejected, Jacobians
    samples: ContactSamples | None

    @property
    def advice(self) -> str:
        """What the outcome means and what to try next."""
        if self.energy_balance_residual_J <= self.explained_residual_J:
            return self.outcome.advice
        return (
            f"The energy balance does not close: it is off by {self.energy_balance_residual_J:.3g} J, of which the "
            f"solver's tolerance explains {self.explained_residual_J:.2g} J at most, so the walk is wrong; tighten "
            "solver.contact.rtol or choose another solver.contact.method. If neither helps, the program is at fault."
        )

    @property
    def periods_s(self) -> Floats:
        """Time of each step from touch to touch."""
        return np.diff(self.touch_time_s, prepend=0.0)

    @property
    def lengths_m(self) -> Floats:
        """Distance along the slope of each step from touch to touch; the first from the first foothold."""
        return np.diff(self.touch_along_m, prepend=0.0)


def new_walk_state(walker: ContactWalker, terrain: Terrain, stance: int, steps: int, y: State) -> WalkState:
    """The walk state of a walk of `steps` steps that starts from y with both feet on the ground."""
    feet = feet_motion(walker, y)
    cells = np.array([cell_at(terrain, foot, feet[foot].along) for foot in range(2)], np.int64)
    has_ground = np.zeros(2, np.int8)
    for foot in range(2):
        on_pad = has_ground_in_cell(int(cells[foot]))
        has_ground[foot] = on_pad and starts_with_ground(terrain, foot == stance)
    sides, at_zero = known_sides(walker, feet, stance, y)
    return WalkState(
        touch_time=np.zeros(steps),
        touch_along=np.zeros(steps),
        slip=np.zeros(steps),
        rolling=np.zeros(steps),
        has_ground=has_ground,
        cells=cells,
        left_cells=cells.copy(),
        foothold=np.array([motion.along for motion in feet]),
        touched=np.array([material_along(walker, foot, feet[foot].along, y) for foot in range(2)]),
        stood=np.zeros((2, 2)),
        knee=knees_at_start(walker, stance, y),
        releasing=np.zeros(1, np.int8),
        knee_strike=np.full(steps + 1, -1.0),
        leaving=np.zeros(2, np.int8),
        sides=sides,
        at_zero=at_zero,
        times=np.zeros(2),
        feet=np.array([stance, 0]),
    )


def knees_at_start(walker: ContactWalker, stance: int, y: State) -> NDArray[np.int8]:
    """What each knee is doing (2,): that of the stance leg is locked, the other is not."""
    knee = np.full(2, RELEASED, np.int8)
    if isinstance(walker.knees, Knees):
        knee[stance] = LOCKED
        if extension(walker.knees, 1 - stance, y, 2) < -FLEXED:
            knee[1 - stance] = BENT
    return knee


def known_sides(
    walker: ContactWalker, feet: tuple[FootMotion, FootMotion], stance: int, y: State
) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """On which side of zero every event function is at the start, and which are at zero, by rounding at most.

    Of these the velocity tells the side. A foot on the ground at rest is in it; of feet side by side at rest the stance
    foot is the one ahead.
    """
    sides, at_zero = np.zeros(EVENT_FUNCTIONS, np.int8), np.zeros(EVENT_FUNCTIONS, np.int8)
    sides[[FALL, SLIDE]] = 1
    n = len(walker.tree.arm_x)
    size = max(abs(float(x)) for x in (*walker.feet[0].lever_x, *walker.feet[0].lever_y))
    speed = max(abs(float(x)) for x in y[2 + n :])
    for foot in range(2):
        first = foot * PER_FOOT
        sides[[first + LEFT_EDGE, first + RIGHT_EDGE]] = 1
        signs = (feet[foot].height, feet[foot].vertical_velocity)
        sides[first + HEIGHT], at_zero[first + HEIGHT] = side_of(signs, (size, speed), -1)
    rates = [feet[k].slip - sum(r * w for r, w in zip(walker.feet[k].rolling, y[4 + n :], strict=True)) for k in (0, 1)]
    order = (feet[1].along - feet[0].along, rates[1] - rates[0])
    sides[PASSING], at_zero[PASSING] = side_of(order, (size, speed), 1 if stance == 1 else -1)
    return sides, at_zero


def side_of(value_and_rate: tuple[float, float], scales: tuple[float, float], otherwise: int) -> tuple[int, bool]:
    """On which side of zero something is, or goes to if it is zero to rounding; whether it is zero."""
    for number, scale in zip(value_and_rate, scales, strict=True):
        if abs(number) > ROUNDING * scale:
            return (1 if number > 0.0 else -1), number is not value_and_rate[0]
    return otherwise, True


def new_observer(
    walker: ContactWalker,
    walk_state: WalkState,
    y: State,
    times: Floats | None = None,
    track_energy: bool = True,
    directions: int = 0,
) -> ContactObserver:
    """An observer of a walk from state y.

    times         (samples,) rising, in s; no samples without them
    track_energy  whether to keep the energy balance, by which a walk is judged; ladders of methods do not
    directions    how many directions of the start to carry along as the tangent
    """
    times = np.zeros(0) if times is None else times
    samples = times.size
    extremes = np.zeros(4)
    extremes[START_ENERGY] = total_energy(walker, (bool(walk_state.has_ground[0]), bool(walk_state.has_ground[1])), y)
    extremes[AT_HAND] = extremes[START_ENERGY] + walker.tree.mass * walker.gravity_along * y[0]
    return ContactObserver(
        track_energy,
        times,
        np.zeros((samples, len(walker.blank))),
        np.zeros((samples, 2), np.int8),
        np.zeros(samples, np.int64),
        np.zeros((samples, 2), np.int8),
        np.zeros((samples, CHANNEL_COUNT)),
        np.zeros(1, np.int64),
        np.zeros(CHANNEL_COUNT),
        extremes,
        new_tangent(len(walker.blank), directions),
        merged_tangents(walker, directions),
    )


def merged_tangents(walker: ContactWalker, directions: int) -> tuple[Tangent, ...]:
    """Memory for the tangent while one knee is locked and while both are; none for a walker that keeps its bodies."""
    if not isinstance(walker.merging, ByKnees):
        return ()
    merging = walker.merging
    return tuple(new_tangent(len(fewer.blank), directions) for fewer in (merging.one[0], merging.both))


def walk_contact(
    walker: ContactWalker,
    ground: JudgedGround,
    pinned: Pinned | None,
    stance: int,
    start: State,
    tolerances: Tolerances,
    steps: int,
    sampling: float | Floats | None,
    track_energy: bool = True,
) -> ContactWalkResult:
    """Walk up to `steps` steps.

    pinned        the hinged first step, or None
    stance        the foot that carries the first step
    start         state of the free walker (4 + 2 n); its angles and angular velocities start the hinged one
    tolerances    how to integrate
    sampling      time between samples, their times (samples,), rising, in s, or None for none
    track_energy  whether to keep the energy balance, by which the walk is judged; ladders of methods do without

    The room for samples doubles until the whole walk fits. A start that lies on the ground already is rejected.
    """
    frame = ground.frame
    if hip_height(walker, frame, start) < FALLEN_HIP * frame.leg_length:
        walk_state = new_walk_state(walker, ground.terrain, stance, steps, start)
        here = Stopped(0.0, start, np.zeros(4, np.int64))
        return gather(Outcome.REJECTED, here, walk_state, new_observer(walker, walk_state, start), walker, tolerances)
    room = int(USUAL_STEP * steps * frame.pendulum_time / sampling) + 2 if isinstance(sampling, float) else 0
    while True:
        walk_state = new_walk_state(walker, ground.terrain, stance, steps, start)
        times = sampling * np.arange(room, dtype=np.float64) if isinstance(sampling, float) else sampling
        observer = new_observer(walker, walk_state, start, times, track_energy)
        outcome, stopped = run_parts(walker, ground, pinned, start, tolerances, observer, walk_state)
        if room == 0 or observer.recorded[0] < room:
            return gather(outcome, stopped, walk_state, observer, walker, tolerances)
        room *= 2


def run_parts(
    walker: ContactWalker,
    ground: JudgedGround,
    pinned: Pinned | None,
    start: State,
    tolerances: Tolerances,
    observer: ContactObserver,
    walk_state: WalkState,
) -> tuple[Outcome, Stopped]:
    """The hinged step, if there is one, then the free walk; returns the outcome and where it stopped.

    A walk that took all its steps goes on, unobserved, until the foot that carried the last one has lifted.
    """
    t, y = 0.0, start
    spent = np.zeros(4, np.int64)
    if pinned is not None:
        method = tolerances.new(len(pinned.blank))
        angles = len(pinned.tree.arm_x)
        hinged = (*start[2 : 2 + angles], *start[4 + angles :])
        hinged_walk = walk_hinged if tolerances.compiled else uncompiled(walk_hinged)
        outcome = Outcome(
            hinged_walk(pinned, ground, method, finder_for(method, EVENT_FUNCTIONS), observer, walk_state, hinged)
        )
        t, y = float(method.clock[T]), floating_state(pinned, tuple(method.y.tolist()))
        spent += method.counts[:4]
        release_hinge(walker, pinned.foot, walk_state, y)
        if outcome is not Outcome.WALKED:
            return outcome, Stopped(t, y, spent)
    walk_state.times[AIRBORNE_SINCE] = t
    free_walk, method, finder = free_walk_by(tolerances, walker)
    outcome = Outcome(free_walk(walker, ground, method, finder, observer, walk_state, t, y, NEVER))
    stopped = Stopped(float(method.clock[T]), tuple(method.y.tolist()), spent + method.counts[:4])
    if outcome is Outcome.WALKED:
        unseen = new_observer(walker, walk_state, stopped.state, track_energy=False)
        free_walk(walker, ground, method, finder, unseen, walk_state, stopped.time_s, stopped.state, AT_LIFT)
    return outcome, stopped


def free_walk_by(tolerances: Tolerances, walker: ContactWalker) -> tuple[Callable[..., int], Any, CrossingFinder]:
    """`walk_free`, in Python for a library's method; that method, for as few bodies as the knees allow; its finder."""
    n = len(walker.blank)
    merging = walker.merging
    method = method_by_knees(merging, n, tolerances.new) if isinstance(merging, ByKnees) else tolerances.new(n)
    return walk_free if tolerances.compiled else uncompiled(walk_free), method, finder_for(method, EVENT_FUNCTIONS)


def walk_on(
    walker: ContactWalker,
    ground: JudgedGround,
    tolerances: Tolerances,
    walk_state: WalkState,
    observer: ContactObserver,
    start: State,
    stop_passing_after: int = NEVER,
) -> tuple[Outcome, Stopped]:
    """Walk with both feet free from a walk state that is at hand; the outcome, with its energy balance, and the end.

    start               state (4 + 2 n) at time 0
    stop_passing_after  see `walk_free`
    """
    free_walk, method, finder = free_walk_by(tolerances, walker)
    ended = free_walk(walker, ground, method, finder, observer, walk_state, 0.0, start, stop_passing_after)
    stopped = Stopped(float(method.clock[T]), tuple(method.y.tolist()), method.counts[:4].copy())
    return balanced(ended, observer, tolerances), stopped


def by_channel(walker: ContactWalker, dissipated: Floats) -> dict[str, float]:
    """What was dissipated (J), by name; the knees' channels only where there are knees."""
    count = len(CHANNELS) if isinstance(walker.knees, Knees) else OF_STRAIGHT_LEGS
    return dict(zip(CHANNELS[:count], dissipated[:count].tolist(), strict=True))


def release_hinge(walker: ContactWalker, foot: int, walk_state: WalkState, y: State) -> None:
    """A hinged foot has neither slipped nor rolled until now; it is on the ground, about to leave."""
    steps = walk_state.feet[STEPS]
    walk_state.slip[:steps], walk_state.rolling[:steps] = 0.0, 0.0
    walk_state.touched[foot] = material_along(walker, foot, feet_motion(walker, y)[foot].along, y)
    walk_state.stood[foot] = 0.0
    walk_state.at_zero[foot * PER_FOOT + HEIGHT] = 1


def explained_residual(observer: ContactObserver, tolerances: Tolerances) -> float:
    """How large a residual of the energy balance (J) the tolerance explains; a larger one is a fault.

    It is UNEXPLAINED times rtol times energy and work exchanged: the energy at the start, kinetic, elastic, and
    potential over the slope below, and all that has been dissipated since.
    """
    exchanged = observer.extremes[AT_HAND] + np.abs(observer.dissipated).sum()
    return float(UNEXPLAINED * max(tolerances.rtol, FINEST) * exchanged)


def balanced(ended: int, observer: ContactObserver, tolerances: Tolerances) -> Outcome:
    """How a walk ended: `SOLVER_FAILED`, however it did, if its energy balance does not close.

    This detects faults and estimates no error: a walk may be off by far more than its balance.
    """
    closes = observer.extremes[RESIDUAL] <= explained_residual(observer, tolerances)
    return Outcome(ended) if closes else Outcome.SOLVER_FAILED


def gather(
    outcome: Outcome,
    stopped: Stopped,
    walk_state: WalkState,
    observer: ContactObserver,
    walker: ContactWalker,
    tolerances: Tolerances,
) -> ContactWalkResult:
    """The result of a walk from what was written on the way."""
    done, lifted, seen = int(walk_state.feet[STEPS]), steps_with_lift(walk_state), int(observer.recorded[0])
    samples = None
    if observer.times.size:
        samples = ContactSamples(
            observer.times[:seen],
            observer.states[:seen],
            observer.has_ground[:seen],
            observer.stance[:seen],
            observer.knees[:seen],
            observer.sampled_dissipation[:seen],
        )
    return ContactWalkResult(
        balanced(outcome, observer, tolerances),
        walk_state.touch_time[:done],
        walk_state.touch_along[:done],
        walk_state.slip[:lifted],
        walk_state.rolling[:lifted],
        stopped.time_s,
        stopped.state,
        float(observer.extremes[MAX_PENETRATION]),
        float(observer.extremes[RESIDUAL]),
        explained_residual(observer, tolerances),
        observer.dissipated.copy(),
        walk_state.knee_strike[:done] if isinstance(walker.knees, Knees) else np.zeros(0),
        stopped.work,
        samples,
    )
