"""Stage `stability-maps`: maps over stiffness, stiction velocity and step size. Interrupted runs resume."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np

from walkerlab.config.analyses import Case
from walkerlab.config.contact import Contact
from walkerlab.config.reads import MapsConfig
from walkerlab.config.schema import Config
from walkerlab.evidence.verification import judge
from walkerlab.evidence.verification.catalogue import config_of
from walkerlab.evidence.verification.starts import ContactStart, prepare_start
from walkerlab.evidence.verification.verdict import finite
from walkerlab.outcome import Outcome
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.run.work import WorkUnit, complete
from walkerlab.pipeline.stages.walk import OUTCOMES, count_outcomes
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.pipeline.store.files import Checkpoint, Numbers

PAPER_STIFFNESS: Final = Contact().to_si().stiffness
STIFFNESS_RANGE: Final = (1e-6 * PAPER_STIFFNESS, 1e6 * PAPER_STIFFNESS)
STICTION_RANGE: Final = (1e-7, 10.0)  # m/s
ERROR_MISSING: Final = -1.0  # stands for a missing error in checkpoints, which can store only finite numbers
PER_STICTION: Final = 10.0  # ratio of friction velocity to stiction velocity, as in the paper
STEP_RANGE: Final = (1e-6, 1e-2)  # s
WALK_STEPS: Final = 4
# right-hand sides per cell: for the walk, for the walk at tighter tolerances, and for the reference, which usually
# needs about 7e6
CELL_BUDGET = 600_000
TIGHTER_CELL_BUDGET = 1_200_000
REFERENCE_CELL_BUDGET = 20_000_000
MAX_FIXED_STEPS: Final = 5_000_000  # steps of semi-implicit Euler, more than any cell needs
VERDICT_NAMES: Final = ("fine", "wrong silently", "diverges", "gives up", "no reference")


def prepare_on_ground(
    stiffness: float, stiction_velocity: float | None, steps: int, budget: int
) -> tuple[Case, Config, ContactStart]:
    """Prepare the paper's walk at a stiffness (N/m^e) and, if given, a stiction velocity (m/s)."""
    contact: dict[str, object] = {"units": "si", "stiffness": stiffness}
    if stiction_velocity is not None:
        contact |= {"stiction_velocity": stiction_velocity, "friction_velocity": PER_STICTION * stiction_velocity}
    case = Case(
        name="map", expected=("walked",), reason="a cell", steps=steps, budget=budget, config={"contact": contact}
    )
    config = config_of(case)
    start = prepare_start(config, case)
    assert isinstance(start, ContactStart), "the paper's slope has a gait"
    return case, config, start


def stiction_cell(stiffness: float, stiction_velocity: float) -> Numbers:
    """Simulate a walk with the default method at one stiffness (N/m^e) and stiction velocity (m/s).

    Returns the outcome, the step count, the outcome at a ten times tighter tolerance, the difference between the
    two walks (in leg lengths, rad and pendulum times, or `ERROR_MISSING` if outcome or step count differ), and the
    number of right-hand sides.
    """
    case, config, start = prepare_on_ground(stiffness, stiction_velocity, WALK_STEPS, CELL_BUDGET)
    walk = again = start.walk(case, start.tolerances(case))
    if walk.outcome.answered:
        tighter = case.model_copy(update={"budget": TIGHTER_CELL_BUDGET})
        again = start.walk(case, start.tolerances(tighter, judge.TIGHTER_FACTOR))
    error = ERROR_MISSING
    if walk.outcome is again.outcome and walk.touches.size == again.touches.size:
        ends = np.abs(np.subtract(walk.record.end_state, again.record.end_state)) / judge.natural_units(config)
        error = finite(float(np.max(np.concatenate([np.abs(walk.touches - again.touches), ends]))))
    numbers = walk.outcome, walk.touches.size, again.outcome, error, walk.rhs_evaluations
    return [float(number) for number in numbers]


def step_column(stiffness: float, steps_s: tuple[float, ...]) -> Numbers:
    """Simulate two steps of the walker by semi-implicit Euler, at one stiffness (N/m^e) with each step size (s).

    The result is compared with a reference at a tight tolerance.

    Returns, for each step size, the verdict's index in `VERDICT_NAMES` and the error, in the units of `stiction_cell`.
    """
    case, config, start = prepare_on_ground(stiffness, None, judge.COMPARED_STEPS, REFERENCE_CELL_BUDGET)
    walk = start.walk(case, Tolerances(*judge.REFERENCE_SETTINGS, case.budget))
    if not walk.outcome.answered:
        return [float(VERDICT_NAMES.index("no reference")), ERROR_MISSING] * len(steps_s)
    arrival = judge.arrival_of("map", walk.record, config)
    numbers: Numbers = []
    for h in steps_s:
        choice = judge.euler(arrival, start, h, MAX_FIXED_STEPS)
        numbers += [float(VERDICT_NAMES.index(choice.verdict)), ERROR_MISSING if choice.error is None else choice.error]
    return numbers


def units_of(cells: int) -> Iterator[WorkUnit]:
    """Yield the work units of maps with `cells` cells along each axis."""
    stiffness = np.geomspace(*STIFFNESS_RANGE, cells)
    steps = tuple(float(h) for h in np.geomspace(*STEP_RANGE, cells))
    for i, k in enumerate(stiffness):
        yield WorkUnit(f"step {i}", cells, partial(step_column, float(k), steps))
    for i, v in enumerate(np.geomspace(*STICTION_RANGE, cells)):
        for j, k in enumerate(stiffness):
            yield WorkUnit(f"stiction {i} {j}", 1, partial(stiction_cell, float(k), float(v)))


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

    checkpoint  cells of earlier runs, to which new cells are added
    jobs        number of processes
    """
    cells = config.stability.map_cells
    complete([*units_of(cells)], checkpoint, "stability maps", progress, jobs)
    stiction = stiction_group(cells, checkpoint.kept)
    step = step_group(cells, checkpoint.kept)
    return Content({"stiction": stiction, "step": step}, summary_of(stiction, step))


def stiction_group(cells: int, results: Mapping[str, Numbers]) -> Group:
    """Build the group of outcomes of the default method over stiction velocity and stiffness."""
    cells_by_axis = np.array([[results[f"stiction {i} {j}"] for j in range(cells)] for i in range(cells)])
    columns = dict(zip(STICTION_COLUMNS, np.moveaxis(cells_by_axis, 2, 0), strict=True))
    dims = ("stiction_velocity", "stiffness")
    answered = np.isin(columns["outcome"], [int(outcome) for outcome in Outcome if outcome.answered])
    compared = answered & (columns["error"] != ERROR_MISSING)
    errors = np.where(compared, columns["error"], np.nan)
    variables = {
        name: integer_variable(columns[name], dims, text) for name, text in STICTION_COLUMNS.items() if name != "error"
    }
    variables |= {
        **axis("stiction_velocity", STICTION_RANGE, cells, "m/s", "stiction velocity"),
        **axis("stiffness", STIFFNESS_RANGE, cells, "N/m^2.2", "stiffness of the ground"),
        "compared": integer_variable(
            compared, dims, "1 if both runs have an answer, with the same outcome and step count"
        ),
        "error": Variable(errors, dims, "1", STICTION_COLUMNS["error"], missing=True),
    }
    return Group(variables, {"outcomes": OUTCOMES, "steps_wanted": WALK_STEPS, "budget": CELL_BUDGET})


def step_group(cells: int, results: Mapping[str, Numbers]) -> Group:
    """Build the group of results over step size and stiffness, computed with semi-implicit Euler."""
    # (stiffness, step size, 2): verdict and error
    cells_by_axis = np.array([np.reshape(results[f"step {j}"], (cells, 2)) for j in range(cells)])
    verdicts, errors = cells_by_axis.transpose(2, 1, 0)
    dims = ("step_size", "stiffness")
    text = "error of the final state, in legs, radians and pendulum times"
    variables = {
        **axis("step_size", STEP_RANGE, cells, "s", "step size"),
        **axis("stiffness", STIFFNESS_RANGE, cells, "N/m^2.2", "stiffness of the ground"),
        "verdict": integer_variable(verdicts, dims, "verdict, see attribute verdicts"),
        "error": Variable(np.where(errors == ERROR_MISSING, np.nan, errors), dims, "1", text, missing=True),
    }
    legend = ", ".join(f"{number} {verdict}" for number, verdict in enumerate(VERDICT_NAMES))
    return Group(variables, {"verdicts": legend, "steps_wanted": judge.COMPARED_STEPS, "fine": judge.FINE_ERROR})


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
        "fixed_step": {VERDICT_NAMES[int(verdict)]: int(count) for verdict, count in zip(verdicts, times, strict=True)},
    }
