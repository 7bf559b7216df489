"""Walking rules that are applied to an engine's walk after each engine step: touches, lifts, pads, knees and outcome.

An engine gives states only at the ends of its steps. Within a step, the height of a foot is taken as the cubic through
the heights and velocities at both ends, which locates a touch to fourth order in the step.
"""

import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from walkerlab.exchange.engine_scene import EngineScene
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.external import feet_and_forces
from walkerlab.physics.ground.knees import MIN_FLEXION, lock_knee
from walkerlab.physics.ground.pulse import pulse_left
from walkerlab.physics.ground.terrain import STANCE_FOOT, Terrain, cell_at, cell_edges, has_ground_in_cell
from walkerlab.physics.ground.walker import BENT, LOCKED, RELEASED, FootMotion, locked_knees, place_on_ground
from walkerlab.physics.hybrid import contact_state, contact_transitions
from walkerlab.physics.hybrid.contact_loop import LONGEST_FLIGHT, LONGEST_STEP
from walkerlab.physics.hybrid.contact_state import WalkState, new_walk_state
from walkerlab.physics.hybrid.endings import FALLEN_HIP, GOES_ON
from walkerlab.physics.solvers.scipy_methods import entry_point
from walkerlab.physics.solvers.system import Floats

Feet = tuple[FootMotion, FootMotion]
CROSSING_HALVINGS = 60  # enough to locate a crossing to rounding
DIVERGED_M = 1e4  # a run with a foot farther away than this has diverged


@dataclass(frozen=True, order=True)
class Turn:
    """Lock or release of a knee within an engine step."""

    share: float  # fraction of the engine step at which it occurs
    event: int  # index of the event function that detects it


Bend = tuple[float, float]
"""Extension (rad) of a knee, and its rate (rad/s)."""


class WalkerProbe:
    """Compiled function for the feet and the forces on the walker, bound to a scene's model and walk state."""

    def __init__(self, scene: EngineScene, ground: Any, walk_state: WalkState) -> None:
        size = scene.model.size
        # The system shares the progress of the walk state, so that each call sees the current one.
        self.system = place_on_ground(scene.walker, ground, progress=walk_state.progress)
        self._fixed = (self.system, scene.model.chain)
        self._motion = np.zeros((2, 4))
        self._forces = np.zeros(size)
        self._none = np.zeros(0)
        self._knees = scene.knee_indices
        self._call = entry_point(
            feet_and_forces, *self._fixed, 0.0, np.zeros(size), np.zeros(size), self._motion, self._forces
        )

    def feet(self, q: Floats, v: Floats) -> Feet:
        """Return the motion of both feet from q and v, which must be contiguous arrays."""
        self._call(*self._fixed, 0.0, q, v, self._motion, self._none)
        first, second = self._motion.tolist()
        return FootMotion(*first), FootMotion(*second)

    def forces(self, time_s: float, q: Floats, v: Floats) -> Floats:
        """Return the generalised forces on the walker, in memory that the next call overwrites."""
        self._call(*self._fixed, time_s, q, v, self._motion, self._forces)
        return self._forces

    def bends(self, q: Floats, v: Floats) -> list[Bend]:
        """Return the extension and the rate of each knee. Both are zero for a locked knee."""
        return [(float(q[place]), float(v[place])) if place >= 0 else (0.0, 0.0) for place in self._knees]


class RuleFollower:
    """State of a walk under the walking rules, updated after each step of the engine.

    scene       scene with the currently locked knees
    walk_state  state of the walk apart from its coordinates
    outcome     outcome of the walk, or None while it continues
    turn        lock or release of a knee within the last engine step, which is then discarded
    watches     whether locks and releases of knees are searched for
    """

    def __init__(self, scene: EngineScene, steps: int, q: Floats, v: Floats, *, carries: bool = True) -> None:
        """Start a walk of at most `steps` steps with both feet on the ground.

        carries  whether our contact law acts. If not, the engine uses native contact, and we apply only drives
        """
        self.walk_state = new_walk_state(scene.ours, scene.ground, STANCE_FOOT, steps, scene.start)
        self._ground = self.walk_state.has_ground if carries else np.zeros(2, np.int8)
        self.time_s = self.grounded_s = 0.0
        self.outcome: Outcome | None = None
        self.turn: Turn | None = None
        self.watches = True
        self._feet: Feet
        self._switch_to(scene, q, v)
        # Both feet stand on the ground. Rounding may put them slightly above it, which would count as a lift.
        first, second = (foot._replace(height=min(foot.height, -sys.float_info.min)) for foot in self._feet)
        self._feet = first, second
        self._edges = [edges_under(scene.ground.terrain, foot, self.walk_state.cells[foot]) for foot in range(2)]

    def _switch_to(self, scene: EngineScene, q: Floats, v: Floats) -> None:
        """Switch to the model of a scene, in the state with coordinates q and velocities v."""
        self.scene = scene
        self.probe = WalkerProbe(scene, self._ground, self.walk_state)
        self._feet = self.probe.feet(q, v)
        self._bends = self.probe.bends(q, v)

    def follow(self, time_s: float, q: Floats, v: Floats) -> bool:
        """Update the walk after an engine step, and return whether the ground under a foot may have changed."""
        before = self._feet
        now = self.probe.feet(q, v)
        if not all(-DIVERGED_M < place < DIVERGED_M for foot in now for place in (foot.along, foot.height)):
            self._end(Outcome.SOLVER_FAILED)
            return False
        if self._bends:
            bends = self.probe.bends(q, v)
            if self.watches:
                stance = self.walk_state.progress.stance
                sinking = before[stance].vertical_velocity, now[stance].vertical_velocity
                pushing_s = pulse_left(self.probe.system, self.time_s)
                knees = zip(self._bends, bends, strict=True)
                self.turn = first_turn(self.walk_state, time_s - self.time_s, pushing_s, sinking, knees)
                if self.turn is not None:
                    return False
            self._bends = bends
        if happened := has_event(before, now, self._edges):
            self._apply_events(time_s, before, now, q, v)
        self._feet = now
        self.time_s = time_s
        self._judge(now, q, v)
        return happened

    def _apply_events(self, time_s: float, before: Feet, now: Feet, q: Floats, v: Floats) -> None:
        walk_state = self.walk_state
        terrain = self.scene.ground.terrain
        form = self.scene.ours.whole
        for foot in range(2) if terrain.has_pads else ():
            cell = cell_at(terrain, foot, now[foot].along)
            if cell == walk_state.cells[foot]:
                continue
            walk_state.cells[foot], walk_state.has_ground[foot] = cell, has_ground_in_cell(cell)
            self._edges[foot] = edges_under(terrain, foot, cell)
            # The foot is below the top of the pad that it has reached, so it has hit the side of the pad.
            if walk_state.has_ground[foot] and now[foot].height < 0.0:
                self._end(Outcome.OFF_PAD)
        if (before[0].along < before[1].along) != (now[0].along < now[1].along):
            walk_state.sides[contact_state.PASSING] = 1 if now[1].along > now[0].along else -1
            for foot in range(2):
                contact_transitions.find_ground(walk_state, foot, contact_state.is_above(walk_state, foot))
        h = time_s - self.time_s
        for foot in range(2):
            above = now[foot].height >= 0.0
            if (before[foot].height >= 0.0) == above:
                continue
            walk_state.sides[foot * contact_state.PER_FOOT + contact_state.HEIGHT] = 1 if above else -1
            old = before[foot]
            new = now[foot]
            share = crossing(old.height, old.vertical_velocity, new.height, new.vertical_velocity, h)
            feet_at_event = foot_within_step(before[0], now[0], share, h), foot_within_step(before[1], now[1], share, h)
            # Engines have no states within a step, so extrapolate back from the end with the velocities there.
            y = tuple(self.scene.about_centre(q - (1.0 - share) * h * v, v).tolist())
            time_at_event = self.time_s + share * h
            if above:
                contact_transitions.lift(form, walk_state, feet_at_event, foot, time_at_event, y)
            else:
                self._end(contact_transitions.touch(form, walk_state, feet_at_event, foot, time_at_event, y))
        if walk_state.progress.steps == walk_state.touch_time.size and not contact_state.has_not_lifted(walk_state):
            self._end(Outcome.WALKED)

    @property
    def is_outdated(self) -> bool:
        """Whether a touch has released a knee that the engine's model still has locked."""
        # A leg without a knee counts as locked, so only the legs with knees are counted.
        knees = self.walk_state.knee[: len(self.scene.assembly.knees)]
        return int(np.count_nonzero(knees == LOCKED)) != len(self.scene.locked)

    def go_on(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Lock or release the knee of `turn`, and return coordinates and velocities of the model with the new locks.

        q, v  coordinates and velocities of the old model at that instant
        """
        walker = self.scene.ours
        walk_state = self.walk_state
        y = self.scene.about_centre(q, v)
        if self.turn is not None and contact_state.EXTENSION <= self.turn.event < contact_state.PULSE_END:
            contact_transitions.knee_stops(walker.stop, walk_state, self.turn.event, self.time_s)
            y = lock_knee(walker.whole, walker.forms[0, locked_knees(walk_state.knee)], y).state
        elif self.turn is not None:
            contact_transitions.release(walk_state, 1 - int(walk_state.progress.stance))
        self.turn = None
        scene = self.scene.lock_knees(walk_state.knee)
        q, v = scene.from_base(tuple(y.tolist()))
        self._switch_to(scene, q, v)
        return q, v

    def _end(self, outcome: int) -> None:
        """Record an outcome unless there already is one."""
        if outcome != GOES_ON and self.outcome is None:
            self.outcome = Outcome(outcome)

    def _judge(self, now: Feet, q: Floats, v: Floats) -> None:
        has_ground = self.walk_state.has_ground
        tau = self.scene.ground.frame.pendulum_time
        inside = (now[0].height < 0.0 and has_ground[0] != 0, now[1].height < 0.0 and has_ground[1] != 0)
        if inside[0] or inside[1]:
            self.grounded_s = self.time_s
            stance = int(self.walk_state.progress.stance)
            if inside[stance] and has_slid(self.scene, self.walk_state, stance, now[stance].along, q, v):
                self._end(Outcome.SLID)
        elif self.time_s - self.grounded_s > LONGEST_FLIGHT * tau:
            self._end(Outcome.LIFTED_OFF)
        if q[1] < FALLEN_HIP * self.scene.ground.frame.leg_length:
            self._end(Outcome.FELL)
        elif self.time_s - self.walk_state.progress.last_touch > LONGEST_STEP * tau:
            self._end(Outcome.NO_HEEL_STRIKE)


def has_event(before: Feet, now: Feet, edges: list[tuple[float, float]]) -> bool:
    """Whether a foot has crossed the ground or an edge (m) of its pad or gap, or passed the other foot."""
    (x0, h0, *_), (x1, h1, *_), (y0, k0, *_), (y1, k1, *_) = *before, *now
    (left0, right0), (left1, right1) = edges
    if (h0 < 0.0) != (k0 < 0.0) or (h1 < 0.0) != (k1 < 0.0) or (x0 < x1) != (y0 < y1):
        return True
    return not (left0 <= y0 < right0 and left1 <= y1 < right1)


def has_slid(scene: EngineScene, walk_state: WalkState, foot: int, along: float, q: Floats, v: Floats) -> bool:
    """Whether a foot on the ground at `along` (m) has slid too far from its foothold."""
    far = contact_state.farthest_slide(scene.ground.terrain)
    if abs(along - walk_state.foothold[foot]) <= far:
        return False
    # A round foot also moves away from its foothold by rolling. It has slid only if its material has moved.
    material = contact_state.material_along(scene.ours.whole, foot, along, tuple(scene.about_centre(q, v).tolist()))
    return bool(abs(material - walk_state.touched[foot]) > far)


def edges_under(terrain: Terrain, foot: int, cell: int) -> tuple[float, float]:
    """Return the edges (m) of the pad or gap under a foot. They are infinite on ground without pads."""
    return cell_edges(terrain, foot, int(cell)) if terrain.has_pads else (-math.inf, math.inf)


def first_turn(
    walk_state: WalkState, h: float, pushing_s: float, sinking: tuple[float, float], knees: Iterable[tuple[Bend, Bend]]
) -> Turn | None:
    """Return the first lock or release of a knee within a step of h (s), or None if no knee locks or is released.

    pushing_s  time (s) for which the push-off continues after the start of the step
    sinking    vertical velocities (m/s) of the stance foot at both ends of the step
    knees      bend of each knee at both ends of the step
    """
    turns = []
    before, now = sinking
    if walk_state.progress.release == contact_state.AT_PULSE_END:
        if pushing_s <= h:
            turns.append(Turn(pushing_s / h, contact_state.PULSE_END))
    elif walk_state.progress.release and now >= 0.0 and pushing_s > h:
        walk_state.progress.release = contact_state.AT_PULSE_END
    elif walk_state.progress.release and now >= 0.0:
        share = -before / (now - before) if before < 0.0 else 0.0
        stance = int(walk_state.progress.stance)
        turns.append(Turn(share, stance * contact_state.PER_FOOT + contact_state.VERTICAL_VELOCITY))
    for knee, (old, bend) in enumerate(knees):
        if walk_state.knee[knee] == RELEASED and bend[0] < -MIN_FLEXION:
            walk_state.knee[knee] = BENT
        elif walk_state.knee[knee] == BENT and bend[0] >= 0.0:
            turns.append(Turn(crossing(*old, *bend, h), contact_state.EXTENSION + knee))
    return min(turns, default=None)


def crossing(x0: float, v0: float, x1: float, v1: float, h: float) -> float:
    """Return the fraction of a step of h (s) at which the cubic through values and rates at its ends crosses zero."""
    low, high = 0.0, 1.0
    for _ in range(CROSSING_HALVINGS):
        middle = 0.5 * (low + high)
        if (cubic(x0, v0, x1, v1, h, middle) >= 0.0) == (x0 >= 0.0):
            low = middle
        else:
            high = middle
    # At this end of the bracket the foot has certainly crossed zero.
    return high


def foot_within_step(old: FootMotion, new: FootMotion, share: float, h: float) -> FootMotion:
    """Interpolate a foot at a fraction of a step: its height by the cubic, all other values linearly."""
    straight = FootMotion(*(a + share * (b - a) for a, b in zip(old, new, strict=True)))
    height = cubic(old.height, old.vertical_velocity, new.height, new.vertical_velocity, h, share)
    return straight._replace(height=height)


def cubic(x0: float, v0: float, x1: float, v1: float, h: float, s: float) -> float:
    """Evaluate a cubic at the fraction s of a step of h (s), from values x and rates v at both ends of the step."""
    r = 1.0 - s
    return r * r * ((1.0 + 2.0 * s) * x0 + s * h * v0) + s * s * ((3.0 - 2.0 * s) * x1 - r * h * v1)
