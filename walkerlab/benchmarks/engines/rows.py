"""What is found of the walk in other engines, row by row."""

from dataclasses import dataclass
from typing import Annotated

from walkerlab.labels import Label

OURS = "walkerlab"
SAME_LAW, OWN_LAW = "same-law", "own-law"
TOLERANCE = Label("1", "relative tolerance where steps are adapted")
RUN_TIME = Label("s", "run time", timing=True)
FROM_REFERENCE = "difference of the end state (SI), or of the last period (s) on its own law, from the reference"


@dataclass(frozen=True)
class EngineRow:
    """One run of one engine, or of this project beside it.

    step_s  of a run of adapted steps that did not come to an end, the largest
    error   on its own law, from the period of ADAMS's law
    wall_s  of its loop; an engine has a process of its own, whose processor time it is; None if that was lost
    why     how a run ended that has no outcome of its own
    """

    scene: Annotated[str, Label("1", "scene")]
    engine: Annotated[str, Label("1", "engine")]
    version: Annotated[str, Label("1", "version of the engine")]
    experiment: Annotated[str, Label("1", "experiment")]
    integrator: Annotated[str, Label("1", "integrator, or contact model on its own law")]
    start: Annotated[float, Label("1", "velocities of the start over those of the gait")]
    step_s: Annotated[float, Label("s", "step size, the mean one where steps are adapted")]
    tolerance: Annotated[float | None, TOLERANCE]
    error: Annotated[float | None, Label("1", FROM_REFERENCE)]
    touch_error_s: Annotated[float | None, Label("s", "largest difference of a touch time from the reference")]
    wall_s: Annotated[float | None, RUN_TIME]
    period_s: Annotated[float | None, Label("s", "period of the last step")]
    step_length_m: Annotated[float | None, Label("m", "length of the last step")]
    slip_m: Annotated[float | None, Label("m", "net slip of the last step")]
    steps: Annotated[int, Label("1", "steps walked")]
    outcome: Annotated[str, Label("1", "outcome")]
    why: str = ""


@dataclass(frozen=True)
class SwingRow:
    """A swing without ground; there is no order of the first run."""

    scene: Annotated[str, Label("1", "scene")]
    engine: Annotated[str, Label("1", "engine")]
    integrator: Annotated[str, Label("1", "integrator")]
    promised_order: Annotated[int, Label("1", "order that the integrator promises")]
    step_s: Annotated[float, Label("s", "step size, the largest one where steps are adapted")]
    tolerance: Annotated[float | None, TOLERANCE]
    error: Annotated[float, Label("1", "largest difference of the end state, rad and rad/s")]
    energy_drift_j: Annotated[float, Label("J", "change of the mechanical energy")]
    order: Annotated[float | None, Label("1", "order observed against the run with twice the step")]
    wall_s: Annotated[float, RUN_TIME]


@dataclass(frozen=True)
class TuningRow:
    """An engine's contact model after tuning, against what it was tuned to."""

    scene: Annotated[str, Label("1", "scene")]
    engine: Annotated[str, Label("1", "engine")]
    contact: Annotated[str, Label("1", "contact model")]
    settings: dict[str, float]
    quantity: Annotated[str, Label("1", "quantity")]
    unit: Annotated[str, Label("1", "its unit")]
    target: Annotated[float, Label("1", "what it was tuned to, in the unit named beside it")]
    reached: Annotated[float, Label("1", "what was measured, in the unit named beside it")]

    @property
    def residual(self) -> float:
        """Relative difference."""
        return self.reached / self.target - 1.0
