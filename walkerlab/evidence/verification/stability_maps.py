"""Stage `stability-maps`: maps over stiffness, stiction velocity and step size, resumed after an interruption."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from walkerlab.config.reads import MapsConfig
from walkerlab.evidence.verification import maps
from walkerlab.evidence.verification.ordinary import COMPARED_STEPS, FINE_ERROR
from walkerlab.outcome import Outcome
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.run.work import complete
from walkerlab.pipeline.stages.walk import OUTCOMES, count_outcomes
from walkerlab.pipeline.store.checkpoint import Checkpoint
from walkerlab.pipeline.store.content import Content, Group, Variable

STICTION_COLUMNS = {
    "outcome": "how the walk ended, see attribute outcomes",
    "steps": "steps walked",
    "sharper_outcome": "outcome at a ten times tighter tolerance",
    "error": "difference between both runs, in legs, radians and pendulum times; missing if they cannot be compared",
    "rhs_evaluations": "right-hand sides evaluated",
}
"""Values in a cell of the map over stiction velocity and stiffness, in order."""


def run(
    config: MapsConfig, _inputs: Mapping[str, Content], progress: Progress, *, checkpoint: Checkpoint, jobs: int = 1
) -> Content:
    """Compute the missing cells of both maps.

    checkpoint  cells of earlier runs; new cells are added to it
    jobs        number of processes
    """
    cells = config.stability.map_cells
    complete([*maps.units_of(cells)], checkpoint, "stability maps", progress, jobs)
    stiction = stiction_group(cells, checkpoint.kept)
    step = step_group(cells, checkpoint.kept)
    return Content({"stiction": stiction, "step": step}, summary_of(stiction, step))


def stiction_group(cells: int, results: Mapping[str, maps.Numbers]) -> Group:
    """Build the group of outcomes of the default method over stiction velocity and stiffness."""
    cells_by_axis = np.array([[results[f"stiction {i} {j}"] for j in range(cells)] for i in range(cells)])
    columns = dict(zip(STICTION_COLUMNS, np.moveaxis(cells_by_axis, 2, 0), strict=True))
    dims = ("stiction_velocity", "stiffness")
    answered = np.isin(columns["outcome"], [int(outcome) for outcome in Outcome if outcome.answered])
    compared = answered & (columns["error"] != maps.ERROR_MISSING)
    errors = np.where(compared, columns["error"], np.nan)
    variables = {
        name: integer_variable(columns[name], dims, text) for name, text in STICTION_COLUMNS.items() if name != "error"
    }
    variables |= {
        **axis("stiction_velocity", maps.STICTION_RANGE, cells, "m/s", "stiction velocity"),
        **axis("stiffness", maps.STIFFNESS_RANGE, cells, "N/m^2.2", "stiffness of the ground"),
        "compared": integer_variable(
            compared, dims, "1 if both runs have an answer, with the same outcome and step count"
        ),
        "error": Variable(errors, dims, "1", STICTION_COLUMNS["error"], missing=True),
    }
    return Group(variables, {"outcomes": OUTCOMES, "steps_wanted": maps.WALK_STEPS, "budget": maps.CELL_BUDGET})


def step_group(cells: int, results: Mapping[str, maps.Numbers]) -> Group:
    """Build the group of results of semi-implicit Euler over step size and stiffness."""
    # (stiffness, step size, 2): verdict and error
    cells_by_axis = np.array([np.reshape(results[f"step {j}"], (cells, 2)) for j in range(cells)])
    verdicts, errors = cells_by_axis.transpose(2, 1, 0)
    dims = ("step_size", "stiffness")
    text = "error of the final state, in legs, radians and pendulum times"
    variables = {
        **axis("step_size", maps.STEP_RANGE, cells, "s", "step size"),
        **axis("stiffness", maps.STIFFNESS_RANGE, cells, "N/m^2.2", "stiffness of the ground"),
        "verdict": integer_variable(verdicts, dims, "verdict, see attribute verdicts"),
        "error": Variable(np.where(errors == maps.ERROR_MISSING, np.nan, errors), dims, "1", text, missing=True),
    }
    legend = ", ".join(f"{number} {verdict}" for number, verdict in enumerate(maps.VERDICT_NAMES))
    return Group(variables, {"verdicts": legend, "steps_wanted": COMPARED_STEPS, "fine": FINE_ERROR})


def axis(name: str, ends: tuple[float, float], cells: int, unit: str, text: str) -> dict[str, Variable]:
    return {name: Variable(np.geomspace(*ends, cells), (name,), unit, text)}


def integer_variable(values: Any, dims: tuple[str, ...], text: str) -> Variable:
    return Variable(np.asarray(values).astype(np.int64), dims, "1", text)


def summary_of(stiction: Group, step: Group) -> dict[str, Any]:
    errors = stiction["error"][stiction["compared"] == 1]
    verdicts, times = np.unique(step["verdict"], return_counts=True)
    return {
        "cells": int(stiction["outcome"].size + step["verdict"].size),
        "outcomes": count_outcomes(stiction["outcome"]),
        "ends_otherwise_sharper": int(np.count_nonzero(stiction["outcome"] != stiction["sharper_outcome"])),
        "largest_error": float(errors.max()) if errors.size else None,
        "median_error": float(np.median(errors)) if errors.size else None,
        "fixed_step": {
            maps.VERDICT_NAMES[int(verdict)]: int(count) for verdict, count in zip(verdicts, times, strict=True)
        },
    }
