"""Judging a walk from outside: an engine steps, and this project's rules say what touched, on what ground, and when.

An engine gives states at the ends of its steps only. Between two of them a foot's height is taken as the cubic through
its values and velocities, so that a touch is located to the fourth order in the step.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.benchmarks.engines.scenes import EngineScene
from walkerlab.ground.external import feet_and_forces
from walkerlab.ground.knees import FLEXED, lock
from walkerlab.ground.terrain import Terrain, cell_at, cell_edges, has_ground_in_cell
from walkerlab.ground.walker import BENT, LOCKED, RELEASED, FootMotion, locked_knees, on_ground
from walkerlab.hybrid import contact_events, contact_rules
from walkerlab.hybrid.contact_run import new_walk_state
from walkerlab.hybrid.contact_walk import LONGEST_FLIGHT, LONGEST_STEP
from walkerlab.hybrid.outcome import Outcome
from walkerlab.solvers.scipy_methods import entry_point
from walkerlab.solvers.system import State

Floats = NDArray[np.float64]
Feet = tuple[FootMotion, FootMotion]
Bends = list[tuple[float, float]]
HALVINGS = 60
FAR_AWAY = 1e4  # m: where only the feet of a run that has lost its numbers get to


@dataclass
class RuleFollower:
    """The rules of a walk, kept up to date step by step.

    walk state   what the walk remembers
    feet     of the last state
    bends    of the last state: each knee's extension (rad) and its rate (rad/s)
    edges    between which a foot is over the same pad or gap (m), twice
    outcome  how it ended; None while it goes on
    turn     a knee that locks or is released in the step that was just seen, which then counts for nothing
    watches  whether knees are watched
    """

    scene: EngineScene
    look: FeetAndForces
    walk_state: contact_events.WalkState
    feet: Feet
    bends: Bends
    edges: list[tuple[float, float]]
    time_s: float = 0.0
    grounded_s: float = 0.0
    outcome: Outcome | None = None
    turn: Turn | None = None
    watches: bool = True

    def follow(self, time_s: float, q: Floats, v: Floats) -> bool:
        """Take in the state at the end of a step; whether the ground under a foot may have changed."""
        before, now = self.feet, self.look.feet(q, v)
        if not all(-FAR_AWAY < place < FAR_AWAY for foot in now for place in (foot.along, foot.height)):
            self._end(int(Outcome.SOLVER_FAILED))
            return False
        if self.bends:
            bends = bends_of(self.scene, q, v)
            if self.watches:
                self.turn = self._turning(time_s - self.time_s, now, bends)
            if self.turn is not None and self.watches:
                return False
            self.bends = bends
        happened = self._happened(before, now)
        if happened:
            self._let_happen(time_s, before, now, q, v)
        self.feet, self.time_s = now, time_s
        self._judge(now, q, v)
        return happened

    def _happened(self, before: Feet, now: Feet) -> bool:
        """Whether a foot has crossed the ground or a pad's edge, or passed the other."""
        (x0, h0, *_), (x1, h1, *_), (y0, k0, *_), (y1, k1, *_) = *before, *now
        (left0, right0), (left1, right1) = self.edges
        crossed = (h0 < 0.0) != (k0 < 0.0) or (h1 < 0.0) != (k1 < 0.0)
        return crossed or (x0 < x1) != (y0 < y1) or not (left0 <= y0 < right0 and left1 <= y1 < right1)

    def _let_happen(self, time_s: float, before: Feet, now: Feet, q: Floats, v: Floats) -> None:
        """Let everything happen that lies between two states."""
        walk_state, terrain, form = self.walk_state, self.scene.ground.terrain, self.scene.ours.whole
        self._cross_edges(now)
        if (before[0].along < before[1].along) != (now[0].along < now[1].along):
            walk_state.sides[contact_events.PASSING] = 1 if now[1].along > now[0].along else -1
            for foot in range(2):
                contact_rules.find_ground(terrain, walk_state, foot, contact_rules.is_above(walk_state, foot))
        h = time_s - self.time_s
        for foot in range(2):
            above = now[foot].height >= 0.0
            if (before[foot].height >= 0.0) == above:
                continue
            walk_state.sides[foot * contact_events.PER_FOOT + contact_events.HEIGHT] = 1 if above else -1
            share = crossing(*rise_of(before[foot]), *rise_of(now[foot]), h)
            there = between(before, now, share, h)
            y = tuple(self.scene.about_centre(q - (1.0 - share) * h * v, v).tolist())
            if above:
                contact_rules.lift(form, terrain, walk_state, there, foot, y)
            else:
                self._end(contact_rules.touch(form, terrain, walk_state, there, foot, self.time_s + share * h, y))
        taken = walk_state.feet[contact_events.STEPS] == walk_state.touch_time.size
        if taken and not contact_rules.is_to_lift(walk_state):
            self._end(int(Outcome.WALKED))

    def _turning(self, h: float, now: Feet, bends: Bends) -> Turn | None:
        """The first knee to lock or to be released within a step of h (s), if there is one."""
        walk_state, found = self.walk_state, []
        stance = walk_state.feet[contact_events.STANCE]
        if walk_state.releasing[0] and now[stance].vertical_velocity >= 0.0:
            sinking = max(0.0, -self.feet[stance].vertical_velocity)
            share = sinking / (sinking + now[stance].vertical_velocity) if sinking > 0.0 else 0.0
            found.append(Turn(share, int(stance) * contact_events.PER_FOOT + contact_events.VERTICAL_VELOCITY))
        for knee, (old, bend) in enumerate(zip(self.bends, bends, strict=True)):
            if walk_state.knee[knee] == RELEASED and bend[0] < -FLEXED:
                walk_state.knee[knee] = BENT
            elif walk_state.knee[knee] == BENT and bend[0] >= 0.0:
                found.append(Turn(crossing(*old, *bend, h), contact_events.EXTENSION + knee))
        return min(found, default=None)

    def turn_knee(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Let the knee lock or be released in this state; coordinates and velocities of the walker from there on."""
        assert self.turn is not None, "a knee turns"
        walker, walk_state, y = self.scene.ours, self.walk_state, self.scene.about_centre(q, v)
        if self.turn.event >= contact_events.EXTENSION:
            contact_rules.knee_stops(walker.stop, walk_state, self.turn.event, self.time_s)
            y = lock(walker.whole, walker.forms[0, locked_knees(walk_state.knee)], y).state
        else:
            contact_rules.release(walk_state, 1 - int(walk_state.feet[contact_events.STANCE]))
        self.turn = None
        return self._in_next_model(tuple(y.tolist()))

    @property
    def is_outdated(self) -> bool:
        """Whether a knee was released by a touch itself: the engine's model has it locked."""
        return int(np.count_nonzero(self.walk_state.knee == LOCKED)) != len(self.scene.locked)

    def release_knee(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Go on from this state with the knee that a touch has released."""
        return self._in_next_model(tuple(self.scene.about_centre(q, v).tolist()))

    def _in_next_model(self, state: State) -> tuple[Floats, Floats]:
        """Coordinates and velocities of the walker with its knees as they are now."""
        self.scene = self.scene.with_knees_locked(self.walk_state.knee)
        self.look = FeetAndForces(self.scene, self.walk_state.has_ground)
        q, v = self.scene.from_base(state)
        self.feet, self.bends = self.look.feet(q, v), bends_of(self.scene, q, v)
        return q, v

    def _cross_edges(self, now: Feet) -> None:
        """The pads and gaps that the feet are over now."""
        terrain, walk_state = self.scene.ground.terrain, self.walk_state
        if not terrain.has_pads:
            return
        for foot in range(2):
            cell = cell_at(terrain, foot, now[foot].along)
            if cell == walk_state.cells[foot]:
                continue
            walk_state.cells[foot] = cell
            walk_state.has_ground[foot] = has_ground_in_cell(cell)
            self.edges[foot] = edges_at(terrain, foot, cell)
            if walk_state.has_ground[foot] and now[foot].height < 0.0:
                self._end(int(Outcome.OFF_PAD))

    def _end(self, outcome: int) -> None:
        """End the walk with the first outcome there is."""
        if outcome != contact_rules.GOES_ON and self.outcome is None:
            self.outcome = Outcome(outcome)

    def _judge(self, now: Feet, q: Floats, v: Floats) -> None:
        """End the walk that has fallen, slid, flown or taken too long."""
        ground, has_ground = self.scene.ground, self.walk_state.has_ground
        tau, t = ground.frame.pendulum_time, self.time_s
        inside = (now[0].height < 0.0 and has_ground[0] != 0, now[1].height < 0.0 and has_ground[1] != 0)
        if inside[0] or inside[1]:
            self.grounded_s = t
            stance = self.walk_state.feet[contact_events.STANCE]
            far = contact_events.farthest_slide(ground.terrain)
            if inside[stance] and abs(now[stance].along - self.walk_state.foothold[stance]) > far:
                y = tuple(self.scene.about_centre(q, v).tolist())
                material = contact_events.material_along(self.scene.ours.whole, stance, now[stance].along, y)
                if abs(material - self.walk_state.touched[stance]) > far:
                    self._end(int(Outcome.SLID))
        elif t - self.grounded_s > LONGEST_FLIGHT * tau:
            self._end(int(Outcome.LIFTED_OFF))
        if q[1] < contact_events.FALLEN_HIP * ground.frame.leg_length:
            self._end(int(Outcome.FELL))
        elif t - self.walk_state.times[contact_events.LAST_TOUCH] > LONGEST_STEP * tau:
            self._end(int(Outcome.NO_HEEL_STRIKE))


@dataclass(frozen=True, order=True)
class Turn:
    """A knee locks or is released: at what share of a step, and by which event function of a walk."""

    share: float
    event: int


def bends_of(scene: EngineScene, q: Floats, v: Floats) -> Bends:
    """Extension and its rate of each knee, zero of a locked one."""
    return [(float(q[place]), float(v[place])) if place >= 0 else (0.0, 0.0) for place in scene.knee_places]


class FeetAndForces:
    """The compiled function with what stays the same in its calls; coordinates and velocities are contiguous arrays."""

    def __init__(self, scene: EngineScene, has_ground: Any) -> None:
        """Make room for its results; `carried` is the walk state's own array and changes with it."""
        self._fixed = (on_ground(scene.walker, has_ground), scene.chain)
        self._feet, self._forces, self._none = np.zeros((2, 4)), np.zeros(scene.model.size), np.zeros(0)
        q = np.zeros(scene.model.size)
        self._call = entry_point(feet_and_forces, *self._fixed, q, q, self._feet, self._forces)

    def feet(self, q: Floats, v: Floats) -> Feet:
        """How the feet move."""
        self._call(*self._fixed, q, v, self._feet, self._none)
        first, second = self._feet.tolist()
        return FootMotion(*first), FootMotion(*second)

    def forces(self, q: Floats, v: Floats) -> Floats:
        """The generalised forces of the ground, in memory that the next call overwrites."""
        self._call(*self._fixed, q, v, self._feet, self._forces)
        return self._forces


def follower(scene: EngineScene, steps: int, q: Floats, v: Floats) -> RuleFollower:
    """The rules at the start of a walk of at most `steps` steps, both feet on the ground."""
    walk_state = new_walk_state(scene.ours, scene.ground.terrain, scene.stance, steps, scene.start)
    look = FeetAndForces(scene, walk_state.has_ground)
    # both stand on the ground, inside or outside by rounding
    first, second = (foot._replace(height=min(foot.height, -sys.float_info.min)) for foot in look.feet(q, v))
    edges = [edges_at(scene.ground.terrain, foot, int(walk_state.cells[foot])) for foot in range(2)]
    return RuleFollower(scene, look, walk_state, (first, second), bends_of(scene, q, v), edges)


def edges_at(terrain: Terrain, foot: int, cell: int) -> tuple[float, float]:
    """Where a pad or gap begins and ends (m); ordinary ground does nowhere."""
    return cell_edges(terrain, foot, cell) if terrain.has_pads else (-math.inf, math.inf)


def rise_of(foot: FootMotion) -> tuple[float, float]:
    """Height (m) and its rate (m/s)."""
    return foot.height, foot.vertical_velocity


def crossing(x0: float, v0: float, x1: float, v1: float, h: float) -> float:
    """Share of a step of h (s) at which a cubic through values and rates at its ends goes through zero."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if (cubic(x0, v0, x1, v1, h, middle) >= 0.0) == (x0 >= 0.0):
            low = middle
        else:
            high = middle
    return high


def between(before: Feet, now: Feet, share: float, h: float) -> Feet:
    """The feet within a step: heights as cubics, all else by its mean rate."""

    def at(old: FootMotion, new: FootMotion) -> FootMotion:
        straight = FootMotion(*(a + share * (b - a) for a, b in zip(old, new, strict=True)))
        return straight._replace(height=cubic(*rise_of(old), *rise_of(new), h, share))

    return at(before[0], now[0]), at(before[1], now[1])


def cubic(x0: float, v0: float, x1: float, v1: float, h: float, s: float) -> float:
    """The cubic through values and slopes at both ends of a step, at the share s of it."""
    r = 1.0 - s
    return r * r * ((1.0 + 2.0 * s) * x0 + s * h * v0) + s * s * ((3.0 - 2.0 * s) * x1 - r * h * v1)
