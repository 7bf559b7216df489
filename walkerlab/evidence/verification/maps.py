"""Maps of the conditions under which our default method and a game engine's fixed-step method can be trusted.

A cell is the paper's walk at one stiffness and stiction velocity, or at one stiffness and step of semi-implicit Euler.
"""

from collections.abc import Iterator
from functools import partial
from typing import Final

import numpy as np

from walkerlab.config.contact import Contact
from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.evidence.verification.catalogue import config_of
from walkerlab.evidence.verification.judge import TIGHTER_FACTOR
from walkerlab.evidence.verification.ordinary import (
    COMPARED_STEPS,
    REFERENCE_SETTINGS,
    arrival_of,
    euler,
    natural_units,
)
from walkerlab.evidence.verification.starts import ContactStart, case_tolerances, prepare_start
from walkerlab.evidence.verification.verdict import finite
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.run.work import WorkUnit

PAPER_STIFFNESS: Final = Contact().in_si().stiffness
STIFFNESS_RANGE: Final = (1e-6 * PAPER_STIFFNESS, 1e6 * PAPER_STIFFNESS)
STICTION_RANGE: Final = (1e-7, 10.0)  # m/s
ERROR_MISSING: Final = -1.0  # stands for a missing error in checkpoints, which hold only finite numbers
PER_STICTION: Final = 10.0  # friction velocity / stiction velocity, as in the paper
STEP_RANGE: Final = (1e-6, 1e-2)  # s
WALK_STEPS: Final = 4
# right-hand sides; most references need about 7e6
CELL_BUDGET = 600_000
TIGHTER_CELL_BUDGET = 1_200_000
REFERENCE_CELL_BUDGET = 20_000_000
MAX_FIXED_STEPS: Final = 5_000_000  # steps of semi-implicit Euler, more than any cell needs
VERDICT_NAMES: Final = ("fine", "wrong silently", "diverges", "gives up", "no reference")

Numbers = list[float]


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
    """Walk with the default method at one stiffness and stiction velocity.

    Returns the outcome, the step count, the outcome at a ten times tighter tolerance, the difference of both walks (in
    leg lengths, rad, pendulum times; `ERROR_MISSING` if outcome or step count differ), and the right-hand sides.
    """
    case, config, start = prepare_on_ground(stiffness, stiction_velocity, WALK_STEPS, CELL_BUDGET)
    walk = again = start.walk(case, case_tolerances(start, case))
    if walk.outcome.answered:
        tighter = case.model_copy(update={"budget": TIGHTER_CELL_BUDGET})
        again = start.walk(case, case_tolerances(start, tighter, TIGHTER_FACTOR))
    error = ERROR_MISSING
    if walk.outcome is again.outcome and walk.touches.size == again.touches.size:
        ends = np.abs(np.subtract(walk.record.end_state, again.record.end_state)) / natural_units(config)
        error = finite(float(np.max(np.concatenate([np.abs(walk.touches - again.touches), ends]))))
    numbers = walk.outcome, walk.touches.size, again.outcome, error, walk.rhs_evaluations
    return [float(number) for number in numbers]


def step_column(stiffness: float, steps_s: tuple[float, ...]) -> Numbers:
    """Walk two steps at one stiffness by semi-implicit Euler with each step size (s), and compare them with a tight
    reference.

    Returns, for each step size, the verdict's index in `VERDICT_NAMES` and the error, in the units of `stiction_cell`.
    """
    case, config, start = prepare_on_ground(stiffness, None, COMPARED_STEPS, REFERENCE_CELL_BUDGET)
    walk = start.walk(case, Tolerances(*REFERENCE_SETTINGS, case.budget))
    if not walk.outcome.answered:
        return [float(VERDICT_NAMES.index("no reference")), ERROR_MISSING] * len(steps_s)
    arrival = arrival_of("map", walk.record, config)
    numbers: Numbers = []
    for h in steps_s:
        choice = euler(arrival, start, h, MAX_FIXED_STEPS)
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
