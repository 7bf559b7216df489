"""Maps of where our default method and a game engine's fixed step can be trusted.

The paper's walk over stiffness and stiction velocity, and over stiffness and the step of semi-implicit Euler.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

import numpy as np

from walkerlab.config.contact import Contact
from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.solvers.registry import Tolerances
from walkerlab.verification.catalogue import config_of
from walkerlab.verification.judge import TIGHTER
from walkerlab.verification.ordinary import REFERENCE, STEPS, arrival_of, fixed, natural_units
from walkerlab.verification.starts import ContactStart, configured, prepared
from walkerlab.verification.verdict import finite

PAPER_STIFFNESS: Final = Contact().in_si().stiffness
STIFFNESS: Final = (1e-6 * PAPER_STIFFNESS, 1e6 * PAPER_STIFFNESS)
STICTION_VELOCITY: Final = (1e-7, 10.0)  # m/s
NONE: Final = -1.0  # in the place of an error in what is kept, whose numbers are finite
PER_STICTION: Final = 10.0  # friction velocity over stiction velocity, as the paper has it
STEP: Final = (1e-6, 1e-2)  # s
WALK_STEPS: Final = 4
BUDGET, TIGHTER_BUDGET, REFERENCE_BUDGET = 600_000, 1_200_000, 20_000_000  # right-hand sides; of the last most take 7e6
MAX_EVALUATIONS: Final = 5_000_000  # of a fixed step: more than any cell needs
VERDICTS: Final = ("fine", "wrong silently", "diverges", "gives up", "no reference")

Numbers = list[float]


def prepared_on_ground(
    stiffness: float, stiction_velocity: float | None, steps: int, budget: int
) -> tuple[Case, Config, ContactStart]:
    """The paper's walk at a stiffness (N/m^e) and, if given, a stiction velocity (m/s)."""
    contact: dict[str, object] = {"units": "si", "stiffness": stiffness}
    if stiction_velocity is not None:
        contact |= {"stiction_velocity": stiction_velocity, "friction_velocity": PER_STICTION * stiction_velocity}
    case = Case(
        name="map", expected=("walked",), reason="a cell", steps=steps, budget=budget, config={"contact": contact}
    )
    config = config_of(case)
    start = prepared(config, case)
    assert isinstance(start, ContactStart), "the paper's slope has a gait"
    return case, config, start


def stiction_cell(stiffness: float, stiction_velocity: float) -> Numbers:
    """Walk with the default method at one stiffness and stiction velocity.

    Returns outcome, steps, outcome at a ten times tighter tolerance, difference of both walks in legs, radians and
    pendulum times (`NONE` if they end differently), right-hand sides.
    """
    case, config, start = prepared_on_ground(stiffness, stiction_velocity, WALK_STEPS, BUDGET)
    walk = again = start.walk(case, configured(start, case))
    if walk.outcome.answered:
        tighter = case.model_copy(update={"budget": TIGHTER_BUDGET})
        again = start.walk(case, configured(start, tighter, TIGHTER))
    error = NONE
    if walk.outcome is again.outcome and walk.touches.size == again.touches.size:
        ends = np.abs(np.subtract(walk.record.end_state, again.record.end_state)) / natural_units(config)
        error = finite(float(np.max(np.concatenate([np.abs(walk.touches - again.touches), ends]))))
    numbers = walk.outcome, walk.touches.size, again.outcome, error, walk.rhs_evaluations
    return [float(number) for number in numbers]


def step_column(stiffness: float, steps_s: tuple[float, ...]) -> Numbers:
    """Walk two steps at one stiffness by semi-implicit Euler with each step size, and by a tight reference.

    Returns verdict and error for each step size.
    """
    case, config, start = prepared_on_ground(stiffness, None, STEPS, REFERENCE_BUDGET)
    walk = start.walk(case, Tolerances(*REFERENCE, case.budget))
    if not walk.outcome.answered:
        return [float(VERDICTS.index("no reference")), NONE] * len(steps_s)
    arrival = arrival_of("map", walk.record, natural_units(config))
    numbers: Numbers = []
    for h in steps_s:
        one = fixed(arrival, start, h, MAX_EVALUATIONS)
        numbers += [float(VERDICTS.index(one.verdict)), NONE if one.error is None else one.error]
    return numbers


def units_of(cells: int) -> Iterator[tuple[str, int, Callable[[], Numbers]]]:
    """Yield the work units of maps with `cells` cells along each axis: name, number of cells, and call."""
    stiffness = np.geomspace(*STIFFNESS, cells)
    steps = tuple(float(h) for h in np.geomspace(*STEP, cells))
    for i, k in enumerate(stiffness):
        yield f"step {i}", cells, partial(step_column, float(k), steps)
    for i, v in enumerate(np.geomspace(*STICTION_VELOCITY, cells)):
        for j, k in enumerate(stiffness):
            yield f"stiction {i} {j}", 1, partial(stiction_cell, float(k), float(v))
