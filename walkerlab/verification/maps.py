"""Whole planes of parameters: where our default method and where a game engine's fixed step can be trusted.

The paper's walk over stiffness and stiction velocity, and over stiffness and the step of semi-implicit Euler; all else
is the paper's.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.contact import Contact
from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.solvers.registry import Tolerances
from walkerlab.verification.catalogue import config_of
from walkerlab.verification.judge import TENFOLD
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
BUDGET, SHARPER_BUDGET, REFERENCE_BUDGET = 600_000, 1_200_000, 20_000_000  # right-hand sides; of the last most take 7e6
MAX_EVALUATIONS: Final = 5_000_000  # of a fixed step: more than any cell needs
VERDICTS: Final = ("fine", "wrong silently", "diverges", "gives up", "no reference")

Numbers = list[float]


def along(ends: tuple[float, float], cells: int) -> NDArray[np.float64]:
    """Evenly spaced powers."""
    return np.geomspace(*ends, cells)


def on_ground(stiffness: float, stiction_velocity: float | None, steps: int, budget: int) -> tuple[Case, Config]:
    """The paper's walk on ground of another stiffness (N/m^e), and with another stiction velocity (m/s) if given."""
    contact: dict[str, object] = {"units": "si", "stiffness": stiffness}
    if stiction_velocity is not None:
        contact |= {"stiction_velocity": stiction_velocity, "friction_velocity": PER_STICTION * stiction_velocity}
    case = Case(
        name="map", expected=("walked",), reason="a cell", steps=steps, budget=budget, config={"contact": contact}
    )
    return case, config_of(case)


def prepared_on_ground(config: Config, case: Case) -> ContactStart:
    """The start of a cell."""
    start = prepared(config, case)
    assert isinstance(start, ContactStart), "the paper's slope has a gait"
    return start


@dataclass(frozen=True)
class StictionCell:
    """The paper's walk with one stiffness and stiction velocity, by the default method.

    run  outcome, steps, outcome at a tenfold tolerance, error between both in legs, radians and pendulum times (`NONE`
         if they end unlike), right-hand sides
    """

    name: str
    stiffness: float
    stiction_velocity: float
    cells: int = 1

    def run(self) -> Numbers:
        """Walk it twice."""
        case, config = on_ground(self.stiffness, self.stiction_velocity, WALK_STEPS, BUDGET)
        start = prepared_on_ground(config, case)
        walk = again = start.walk(case, configured(start, case))
        if walk.outcome.answered:
            sharper = case.model_copy(update={"budget": SHARPER_BUDGET})
            again = start.walk(case, configured(start, sharper, TENFOLD))
        error = NONE
        if walk.outcome is again.outcome and walk.touches.size == again.touches.size:
            ends = np.abs(np.subtract(walk.record.end_state, again.record.end_state)) / natural_units(config)
            error = finite(float(np.max(np.concatenate([np.abs(walk.touches - again.touches), ends]))))
        numbers = walk.outcome, walk.touches.size, again.outcome, error, walk.rhs_evaluations
        return [float(number) for number in numbers]


@dataclass(frozen=True)
class StepColumn:
    """Two steps of the paper's walk with one stiffness, by semi-implicit Euler with each step.

    run  verdict and error of each step
    """

    name: str
    stiffness: float
    steps_s: tuple[float, ...]

    @property
    def cells(self) -> int:
        """Of the map."""
        return len(self.steps_s)

    def run(self) -> Numbers:
        """Walk it sharply, then with each step."""
        case, config = on_ground(self.stiffness, None, STEPS, REFERENCE_BUDGET)
        start = prepared_on_ground(config, case)
        walk = start.walk(case, Tolerances(*REFERENCE, case.budget))
        if not walk.outcome.answered:
            return [float(VERDICTS.index("no reference")), NONE] * self.cells
        arrival = arrival_of("map", walk.record, natural_units(config))
        numbers: Numbers = []
        for h in self.steps_s:
            one = fixed(arrival, start, h, MAX_EVALUATIONS)
            numbers += [float(VERDICTS.index(one.verdict)), NONE if one.error is None else one.error]
        return numbers


MapPiece = StictionCell | StepColumn


def pieces_of(cells: int) -> list[MapPiece]:
    """Everything there is to compute for maps of `cells` cells along each axis."""
    stiffness = along(STIFFNESS, cells)
    steps = tuple(float(h) for h in along(STEP, cells))
    return [
        *(StepColumn(f"step {i}", float(k), steps) for i, k in enumerate(stiffness)),
        *(
            StictionCell(f"stiction {i} {j}", float(k), float(v))
            for i, v in enumerate(along(STICTION_VELOCITY, cells))
            for j, k in enumerate(stiffness)
        ),
    ]
