"""Maps of stability over stiffness, stiction velocity and step size, made piece by piece: a run may be cut off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from walkerlab.config.reads import MapsConfig
from walkerlab.hybrid.outcome import Outcome
from walkerlab.stages.progress import Progress
from walkerlab.store.content import Content, Group, Variable
from walkerlab.store.parts import Parts
from walkerlab.verification.maps import (
    BUDGET,
    NONE,
    STEP,
    STICTION_VELOCITY,
    STIFFNESS,
    VERDICTS,
    WALK_STEPS,
    Numbers,
    along,
    pieces_of,
)
from walkerlab.verification.ordinary import FINE, STEPS
from walkerlab.workers import in_order

STIFFNESS_DIM, VELOCITY_DIM, STEP_DIM = "stiffness", "stiction_velocity", "step_size"
OF_STICTION = ("outcome", "steps", "sharper_outcome", "error", "rhs_evaluations")


def run(
    config: MapsConfig, _inputs: Mapping[str, Content], progress: Progress, *, parts: Parts, jobs: int = 1
) -> Content:
    """Compute what is not there yet of both maps.

    parts  cells that an earlier run has left, and where new ones are kept
    jobs   processes
    """
    cells = config.stability.map_cells
    pieces = pieces_of(cells)
    waiting = [piece for piece in pieces if piece.name not in parts.kept]
    progress.start("stability maps", sum(piece.cells for piece in pieces))
    progress.advance(sum(piece.cells for piece in pieces if piece.name in parts.kept))
    found = in_order([piece.run for piece in waiting], jobs, (0,))
    for piece, numbers in zip(waiting, found, strict=True):
        parts.keep(piece.name, numbers)
        progress.advance(piece.cells)
    stiction, step = stiction_group(cells, parts.kept), step_group(cells, parts.kept)
    return Content({"stiction": stiction, "step": step}, summary_of(stiction, step))


def stiction_group(cells: int, kept: Mapping[str, Numbers]) -> Group:
    """How the default method's walks end, over stiction velocity and stiffness."""
    found = np.array([[kept[f"stiction {i} {j}"] for j in range(cells)] for i in range(cells)])
    columns = dict(zip(OF_STICTION, np.moveaxis(found, 2, 0), strict=True))
    dims = (VELOCITY_DIM, STIFFNESS_DIM)
    answered = np.isin(columns["outcome"], [int(one) for one in Outcome if one.answered])
    compared = answered & (columns["error"] != NONE)
    return Group(
        {
            STIFFNESS_DIM: stiffness_axis(cells),
            VELOCITY_DIM: Variable(along(STICTION_VELOCITY, cells), (VELOCITY_DIM,), "m/s", "stiction velocity"),
            "outcome": whole(columns["outcome"], dims, "how the walk ended, see attribute outcomes"),
            "steps": whole(columns["steps"], dims, "steps walked"),
            "sharper_outcome": whole(columns["sharper_outcome"], dims, "how it ended at a tenfold tolerance"),
            "compared": whole(compared, dims, "1 if both runs have an answer and end alike after as many steps"),
            "error": error(
                np.where(compared, columns["error"], NONE),
                dims,
                "between both runs, in legs, radians, pendulum times, where they are compared",
            ),
            "rhs_evaluations": whole(columns["rhs_evaluations"], dims, "right-hand sides evaluated"),
        },
        {
            "outcomes": ", ".join(f"{outcome.value} {outcome.label}" for outcome in Outcome),
            "steps_wanted": WALK_STEPS,
            "budget": BUDGET,
        },
    )


def step_group(cells: int, kept: Mapping[str, Numbers]) -> Group:
    """What semi-implicit Euler makes of the walk, over step size and stiffness."""
    found = np.array([np.reshape(kept[f"step {j}"], (cells, 2)) for j in range(cells)])  # stiffness, step, of each
    dims = (STEP_DIM, STIFFNESS_DIM)
    return Group(
        {
            STIFFNESS_DIM: stiffness_axis(cells),
            STEP_DIM: Variable(along(STEP, cells), (STEP_DIM,), "s", "step size"),
            "verdict": whole(found[:, :, 0].T, dims, "what became of it, see attribute verdicts"),
            "error": error(found[:, :, 1].T, dims, "of the state at the end, in legs, radians, pendulum times"),
        },
        {
            "verdicts": ", ".join(f"{number} {verdict}" for number, verdict in enumerate(VERDICTS)),
            "steps_wanted": STEPS,
            "fine": FINE,
        },
    )


def stiffness_axis(cells: int) -> Variable:
    """The axis that both maps share."""
    return Variable(along(STIFFNESS, cells), (STIFFNESS_DIM,), "N/m^2.2", "stiffness of the ground")


def error(values: Any, dims: tuple[str, ...], text: str) -> Variable:
    """A variable of errors, with gaps where there is none."""
    return Variable(np.ascontiguousarray(np.where(values == NONE, np.nan, values)), dims, "1", text, missing=True)


def whole(values: Any, dims: tuple[str, ...], text: str) -> Variable:
    """A variable of whole numbers."""
    return Variable(np.ascontiguousarray(values).astype(np.int64), dims, "1", text)


def summary_of(stiction: Group, step: Group) -> dict[str, Any]:
    """How many cells came out how."""
    errors = stiction["error"][stiction["compared"] == 1]
    numbers, counts = np.unique(stiction["outcome"], return_counts=True)
    verdicts, times = np.unique(step["verdict"], return_counts=True)
    return {
        "cells": int(stiction["outcome"].size + step["verdict"].size),
        "outcomes": {Outcome(int(one)).label: int(many) for one, many in zip(numbers, counts, strict=True)},
        "ends_otherwise_sharper": int(np.count_nonzero(stiction["outcome"] != stiction["sharper_outcome"])),
        "largest_error": float(errors.max()) if errors.size else None,
        "median_error": float(np.median(errors)) if errors.size else None,
        "fixed_step": {VERDICTS[int(one)]: int(many) for one, many in zip(verdicts, times, strict=True)},
    }
