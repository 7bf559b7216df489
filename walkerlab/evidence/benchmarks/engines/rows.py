"""Rows of results from other engines."""

from dataclasses import dataclass
from typing import Annotated

from walkerlab.labels import Label

OURS = "walkerlab"
SAME_LAW = "same-law"
OWN_LAW = "own-law"
TOLERANCE = Label("1", "relative tolerance of an adaptive integrator")
RUN_TIME = Label("s", "run time", timing=True)
FROM_REFERENCE = "difference from the reference in the end state (SI) or, on own contact, in the last period (s)"


@dataclass(frozen=True)
class EngineRow:
    """A run of one engine, or of this project for comparison."""

    scene: Annotated[str, Label("1", "scene")]
    engine: Annotated[str, Label("1", "engine")]
    version: Annotated[str, Label("1", "version of the engine")]
    experiment: Annotated[str, Label("1", "experiment")]
    integrator: Annotated[str, Label("1", "integrator, or the engine's own contact model")]
    start: Annotated[float, Label("1", "start velocities relative to the gait's")]
    # if an adaptive run failed, this is the largest step allowed
    step_s: Annotated[float, Label("s", "step size, or its mean for adaptive integrators")]
    tolerance: Annotated[float | None, TOLERANCE]
    error: Annotated[float | None, Label("1", FROM_REFERENCE)]  # the reference is our walk under ADAMS's law
    touch_error_s: Annotated[float | None, Label("s", "largest difference of a touch time from the reference")]
    wall_s: Annotated[float | None, RUN_TIME]  # processor time of the loop, or None if the process failed
    period_s: Annotated[float | None, Label("s", "period of the last step")]
    step_length_m: Annotated[float | None, Label("m", "length of the last step")]
    slip_m: Annotated[float | None, Label("m", "net slip of the last step")]
    steps: Annotated[int, Label("1", "steps walked")]
    outcome: Annotated[str, Label("1", "outcome")]
    why: str = ""  # error message of a failed run


@dataclass(frozen=True)
class SwingRow:
    """Swing of the pinned walker, without ground contact. The first run of an integrator has no observed order."""

    scene: Annotated[str, Label("1", "scene")]
    engine: Annotated[str, Label("1", "engine")]
    integrator: Annotated[str, Label("1", "integrator")]
    promised_order: Annotated[int, Label("1", "nominal order")]
    step_s: Annotated[float, Label("s", "step size, or the maximum step size of an adaptive integrator")]
    tolerance: Annotated[float | None, TOLERANCE]
    error: Annotated[float, Label("1", "largest difference of the end state, rad and rad/s")]
    energy_drift_j: Annotated[float, Label("J", "change of the mechanical energy")]
    order: Annotated[float | None, Label("1", "observed order, from this run and the one with twice the step size")]
    wall_s: Annotated[float, RUN_TIME]


@dataclass(frozen=True)
class TuningRow:
    """A measured property of a tuned contact model, and the target."""

    scene: Annotated[str, Label("1", "scene")]
    engine: Annotated[str, Label("1", "engine")]
    contact: Annotated[str, Label("1", "contact model")]
    settings: dict[str, float]
    quantity: Annotated[str, Label("1", "quantity")]
    unit: Annotated[str, Label("1", "unit of the quantity")]
    target: Annotated[float, Label("1", "target value, in the unit of the row")]
    reached: Annotated[float, Label("1", "measured value, in the unit of the row")]

    @property
    def residual(self) -> float:
        """Relative difference from the target."""
        return self.reached / self.target - 1.0
