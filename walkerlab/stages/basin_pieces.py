"""The independent pieces of a basin: cells of the window, walked in their middles, and cells at edges, part by part."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.hybrid.outcome import Outcome
from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.basin import ATOL, NONE, RTOL, Attractors, Walker, Window, arrivals, inside_cell
from walkerlab.orbits.scaled_starts import ScaledStarts
from walkerlab.orbits.step_map import on_section
from walkerlab.scene.contact import ContactScene, start_state
from walkerlab.stages.numerical_error import tightened

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
OUTCOMES: Final = 16  # more than there are
ATTRACTORS: Final = 4096


@dataclass(frozen=True)
class WalkEnds:
    """How walks ended: (n,) each; `attractor` is NONE where none was reached, else `steps` says after how many."""

    outcome: Integers
    attractor: Integers
    steps: Integers

    def packed(self) -> list[float]:
        """One number for each."""
        code = self.outcome + OUTCOMES * (self.attractor - NONE + ATTRACTORS * self.steps)
        return [float(number) for number in code]


def unpacked(numbers: Floats) -> WalkEnds:
    """What `packed` made numbers of."""
    rest, outcome = np.divmod(numbers.astype(np.int64), OUTCOMES)
    steps, attractor = np.divmod(rest, ATTRACTORS)
    return WalkEnds(outcome, attractor + NONE, steps)


@dataclass(frozen=True, eq=False)
class RigidQuestion:
    """Starts of the rigid model.

    walker  the unit walker
    scale   (3) units of the section's coordinates: unit walker's over SI
    """

    walker: Walker
    scale: tuple[float, float, float]
    attractors: Attractors
    steps: int
    cells_at_once: int = 10_000
    edges_at_once: int = 1_000
    shared_from: int = 200_000  # walks that take longer than starting another process
    tolerances: tuple[float, float] = (RTOL, ATOL)

    def walked(self, z: Floats) -> WalkEnds:
        """Walk from section coordinates z (n, 3), SI."""
        scaled = z * np.array(self.scale)
        found = arrivals(self.walker, self.attractors, scaled, self.steps, tolerances=self.tolerances)
        return WalkEnds(found.outcome, found.attractor, found.steps)

    def tightened(self) -> RigidQuestion:
        """The same at a hundred times tighter tolerances."""
        rtol, atol = self.tolerances
        return replace(self, tolerances=(rtol / 100.0, atol / 100.0))


@dataclass(frozen=True, eq=False)
class ContactQuestion:
    """Starts of the contact model: those of the rigid one with the stance foot just touching, at rest and rolling."""

    scene: ContactScene
    rigid: Standing
    starts: ScaledStarts
    cells_at_once: int = 100
    edges_at_once: int = 10
    shared_from: int = 500

    def walked(self, z: Floats) -> WalkEnds:
        """Walk from section coordinates z (n, 3), SI."""
        rows = [self.walk((float(a), float(b), float(c))) for a, b, c in z]
        return WalkEnds(*np.array(rows, np.int64).reshape(-1, 3).T)

    def walk(self, z: tuple[float, float, float]) -> tuple[int, int, int]:
        """Outcome, attractor and steps of one walk."""
        state = on_section(self.rigid, z)
        walk = self.starts.walked_from(start_state(self.scene, state))
        settled = self.starts.settled_after(walk) if walk.outcome is Outcome.WALKED else None
        return (walk.outcome, NONE, walk.touch_time_s.size) if settled is None else (walk.outcome, 0, settled)

    def tightened(self) -> ContactQuestion:
        """The same at a hundred times tighter tolerances."""
        return replace(self, starts=replace(self.starts, tolerances=tightened(self.starts.tolerances)[0]))


Question = RigidQuestion | ContactQuestion


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of the window by their numbers, from `first` up to `last`, walked from their middles."""

    name: str
    question: Question
    window: Window
    first: int
    last: int

    @property
    def walks(self) -> int:
        """How many."""
        return self.last - self.first

    def run(self) -> list[float]:
        """One number for each cell, see `unpacked`."""
        return self.question.walked(self.window.starts(np.arange(self.first, self.last))).packed()


@dataclass(frozen=True, eq=False)
class EdgeCells:
    """Cells at edges, walked from the middles of their parts."""

    name: str
    question: Question
    window: Window
    cells: tuple[int, ...]
    refine: int

    @property
    def walks(self) -> int:
        """How many."""
        return len(self.cells) * int(self.refine ** len(self.window.axes))

    def run(self) -> list[float]:
        """The share of each cell that walks."""
        inside = inside_cell(self.refine, len(self.window.axes))
        cells = np.repeat(np.array(self.cells), len(inside))
        found = self.question.walked(self.window.starts(cells, np.tile(inside, (len(self.cells), 1))))
        walking = (found.outcome == Outcome.WALKED).reshape(len(self.cells), -1)
        return [float(share) for share in walking.mean(axis=1)]


Piece = Cells | EdgeCells


def cells_of(question: Question, window: Window) -> list[Piece]:
    """Every cell."""
    many = question.cells_at_once
    return [
        Cells(f"cells {first}", question, window, first, min(first + many, window.size))
        for first in range(0, window.size, many)
    ]


def edges_of(question: Question, window: Window, edges: Integers, refine: int) -> list[Piece]:
    """The cells at edges."""
    many = question.edges_at_once
    return [
        EdgeCells(f"edge {edges[first]}", question, window, tuple(edges[first : first + many].tolist()), refine)
        for first in range(0, len(edges), many)
    ]
