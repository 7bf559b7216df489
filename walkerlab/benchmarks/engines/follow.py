"""Judging a walk from outside: an engine steps, and this project's rules say what touched, on what ground, and when.

An engine gives states at the ends of its steps only. Between two of them a foot's height is taken as the cubic through
its values and velocities, so that a touch is located to the fourth order in the step.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.benchmarks.engines.scenes import EngineScene
from walkerlab.ground.external import feet_and_forces, in_arrays
from walkerlab.ground.terrain import carried_in_cell, cell_at, has_pads
from walkerlab.ground.walker import FootMotion
from walkerlab.hybrid.contact_events import FALLEN_HIP, HEIGHT, PASSING, PER_FOOT, farthest_slide, material_along
from walkerlab.hybrid.contact_rules import GOES_ON, LAST_TOUCH, STANCE, STEPS, Ledger, lift, pass_by, touch
from walkerlab.hybrid.contact_run import new_ledger
from walkerlab.hybrid.contact_walk import LONGEST_FLIGHT, LONGEST_STEP
from walkerlab.hybrid.outcome import Outcome

Floats = NDArray[np.float64]
Feet = list[list[float]]
HALVINGS = 60
FAR_AWAY = 1e4  # m or rad: where only a run that has lost its numbers gets to


@dataclass
class Follower:
    """The rules of a walk, kept up to date step by step.

    ledger   what the walk remembers
    feet     of the last state: along (m), height (m), slip (m/s) and velocity of the height (m/s), twice
    outcome  how it ended; None while it goes on
    """

    scene: EngineScene
    look: FeetAndForces
    ledger: Ledger
    feet: Feet
    on_pads: bool
    time_s: float = 0.0
    grounded_s: float = 0.0
    outcome: Outcome | None = None

    def follow(self, time_s: float, q: Floats, v: Floats) -> bool:
        """Take in the state at the end of a step; whether the ground under a foot may have changed."""
        if not (np.isfinite(q).all() and np.abs(q).max() < FAR_AWAY):
            self._end(int(Outcome.SOLVER_FAILED))
            return False
        before, now = self.feet, self.look.feet(q, v)
        happened = self._happened(before, now)
        if happened:
            self._let_happen(time_s, before, now, q, v)
        self.feet, self.time_s = now, time_s
        self._judge(now, q, v)
        return happened

    def _happened(self, before: Feet, now: Feet) -> bool:
        """Whether a foot has crossed the ground or a pad's edge, or passed the other."""
        (x0, h0, _, _), (x1, h1, _, _) = before
        (y0, k0, _, _), (y1, k1, _, _) = now
        if (h0 < 0.0) != (k0 < 0.0) or (h1 < 0.0) != (k1 < 0.0):
            return True
        if (x0 < x1) != (y0 < y1):
            return True
        if not self.on_pads:
            return False
        terrain, cells = self.scene.ground.terrain, self.ledger.cells
        return bool(cell_at(terrain, 0, y0) != cells[0] or cell_at(terrain, 1, y1) != cells[1])

    def _let_happen(self, time_s: float, before: Feet, now: Feet, q: Floats, v: Floats) -> None:
        """Let everything happen that lies between two states."""
        ledger, terrain, walker = self.ledger, self.scene.ground.terrain, self.scene.ours
        if self.on_pads:
            self._cross_edges(now)
        if (before[0][0] < before[1][0]) != (now[0][0] < now[1][0]):
            ledger.sides[PASSING] = 1 if now[1][0] > now[0][0] else -1
            for foot in range(2):
                pass_by(terrain, ledger, foot)
        h = time_s - self.time_s
        for foot in range(2):
            if (before[foot][1] < 0.0) == (now[foot][1] < 0.0):
                continue
            ledger.sides[foot * PER_FOOT + HEIGHT] = 1 if now[foot][1] >= 0.0 else -1
            share = crossing(before[foot], now[foot], h)
            there = between(before, now, share, h)
            y = tuple(self.scene.about_centre(q - (1.0 - share) * h * v, v).tolist())
            if now[foot][1] >= 0.0:
                lift(walker, terrain, ledger, there, foot, y)
            else:
                self._end(touch(walker, terrain, ledger, there, foot, self.time_s + share * h, y))
        if ledger.feet[STEPS] == ledger.touch_time.size:
            self._end(int(Outcome.WALKED))

    def _cross_edges(self, now: Feet) -> None:
        """The pads and gaps that the feet are over now."""
        terrain, ledger = self.scene.ground.terrain, self.ledger
        for foot in range(2):
            cell = cell_at(terrain, foot, now[foot][0])
            if cell == ledger.cells[foot]:
                continue
            ledger.cells[foot] = cell
            ledger.carried[foot] = carried_in_cell(terrain, cell)
            if ledger.carried[foot] and now[foot][1] < 0.0:
                self._end(int(Outcome.OFF_PAD))

    def _end(self, outcome: int) -> None:
        """End the walk with the first outcome there is."""
        if outcome != GOES_ON and self.outcome is None:
            self.outcome = Outcome(outcome)

    def _judge(self, now: Feet, q: Floats, v: Floats) -> None:
        """End the walk that has fallen, slid, flown or taken too long."""
        ground, carried = self.scene.ground, self.ledger.carried
        tau, t = ground.frame.pendulum_time, self.time_s
        inside = (now[0][1] < 0.0 and carried[0] != 0, now[1][1] < 0.0 and carried[1] != 0)
        if inside[0] or inside[1]:
            self.grounded_s = t
            stance = self.ledger.feet[STANCE]
            far = farthest_slide(ground.terrain)
            if inside[stance] and abs(now[stance][0] - self.ledger.foothold[stance]) > far:
                y = tuple(self.scene.about_centre(q, v).tolist())
                material = material_along(self.scene.ours, stance, now[stance][0], y)
                if abs(material - self.ledger.touched[stance]) > far:
                    self._end(int(Outcome.SLID))
        elif t - self.grounded_s > LONGEST_FLIGHT * tau:
            self._end(int(Outcome.LIFTED_OFF))
        if q[1] < FALLEN_HIP * ground.frame.leg_length:
            self._end(int(Outcome.FELL))
        elif t - self.ledger.times[LAST_TOUCH] > LONGEST_STEP * tau:
            self._end(int(Outcome.NO_HEEL_STRIKE))


class FeetAndForces:
    """The compiled function with what stays the same in its calls."""

    def __init__(self, scene: EngineScene, carried: Any) -> None:
        """Make room for its results; `carried` is the ledger's own array and changes with it."""
        n = len(scene.chain)
        like = ((0.0,) * (4 + 2 * n), (0.0,) * n)
        self._fixed = (*in_arrays(scene.walker), *like, scene.chain, carried)
        self._feet, self._forces, self._none = np.zeros((2, 4)), np.zeros(2 + n), np.zeros(0)

    def feet(self, q: Floats, v: Floats) -> Feet:
        """How the feet move."""
        feet_and_forces(*self._fixed, q, v, self._feet, self._none)
        return self._feet.tolist()

    def forces(self, q: Floats, v: Floats) -> Floats:
        """The generalised forces of the ground, in memory that the next call overwrites."""
        feet_and_forces(*self._fixed, q, v, self._feet, self._forces)
        return self._forces


def follower(scene: EngineScene, steps: int, q: Floats, v: Floats) -> Follower:
    """The rules at the start of a walk of at most `steps` steps, both feet on the ground."""
    ledger = new_ledger(scene.ours, scene.ground.terrain, scene.stance, steps, scene.start)
    look = FeetAndForces(scene, ledger.carried)
    feet = look.feet(q, v)
    for row in feet:
        row[1] = min(row[1], -sys.float_info.min)  # both stand on the ground, inside or outside by rounding
    return Follower(scene, look, ledger, feet, has_pads(scene.ground.terrain))


def motions(rows: Feet) -> tuple[FootMotion, FootMotion]:
    """Rows of numbers as the feet's motion."""
    return FootMotion(*rows[0]), FootMotion(*rows[1])


def crossing(before: list[float], now: list[float], h: float) -> float:
    """Share of a step of h (s) at which a foot's height, a cubic, goes through zero."""
    low, high = 0.0, 1.0
    above = before[1] >= 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if (cubic(before[1], before[3], now[1], now[3], h, middle) >= 0.0) == above:
            low = middle
        else:
            high = middle
    return high


def between(before: Feet, now: Feet, share: float, h: float) -> tuple[FootMotion, FootMotion]:
    """The feet within a step: heights as cubics, the place along the slope by its mean velocity."""
    rows = []
    for old, new in zip(before, now, strict=True):
        along = old[0] + share * (new[0] - old[0])
        height = cubic(old[1], old[3], new[1], new[3], h, share)
        rows.append([along, height, *(a + share * (b - a) for a, b in zip(old[2:], new[2:], strict=True))])
    return motions(rows)


def cubic(x0: float, v0: float, x1: float, v1: float, h: float, s: float) -> float:
    """The cubic through values and slopes at both ends of a step, at the share s of it."""
    r = 1.0 - s
    return r * r * ((1.0 + 2.0 * s) * x0 + s * h * v0) + s * s * ((3.0 - 2.0 * s) * x1 - r * h * v1)
