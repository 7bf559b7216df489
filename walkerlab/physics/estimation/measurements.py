"""Measured walks: periods and lengths of steps, or angles of both legs over time."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.solvers.system import Floats

STEP_PERIOD: Final = "step_period_s"
STEP_LENGTH: Final = "step_length_m"
LEG_ANGLE: Final = "angle_rad"


@dataclass(frozen=True, eq=False)
class MeasuredWalk:
    """Quantities of consecutive steps, from heel strike to heel strike, and samples of the angles of both legs if there
    are any.
    """

    periods_s: Floats  # (steps,)
    lengths_m: Floats | None = None  # (steps,)
    touch_angles_rad: Floats | None = None  # (steps,) angle of the leg that touches down, from the vertical
    # (samples,) index of the step of each sample
    step: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    phase: Floats = field(default_factory=lambda: np.zeros(0))  # (samples,) elapsed fraction of the period of the step
    # (samples, 2) angles from the vertical, beginning with the leg that swings first
    angles_rad: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    # sum of the leg angles from the slope's normal at heel strikes; not zero if slope or sensors have an error
    touch_sum_rad: float = 0.0
    first_leg: int | None = None  # leg (1 or 2) that swings in the first step, or None if unknown
    # one unit in the last decimal place of each quantity, in SI units
    resolution: Mapping[str, float] = field(default_factory=dict)

    @property
    def count(self) -> int:
        return int(self.periods_s.size)

    @property
    def sampled(self) -> bool:
        return bool(self.step.size)

    def channels(self) -> dict[str, Floats]:
        """Return the measured values (steps,) by quantity, without angle samples."""
        values = {STEP_PERIOD: self.periods_s, STEP_LENGTH: self.lengths_m, LEG_ANGLE: self.touch_angles_rad}
        return {name: value for name, value in values.items() if value is not None}


def split_into_steps(time_s: Floats, angles_rad: Floats, touches_s: Floats, touch_sum_rad: float = 0.0) -> MeasuredWalk:
    """Assign samples of angles (samples, 2) to the steps between heel strikes (steps + 1,).

    Samples before the first and after the last heel strike are dropped.
    """
    inside = (time_s >= touches_s[0]) & (time_s < touches_s[-1])
    periods = np.diff(touches_s)
    time = time_s[inside]
    step = np.searchsorted(touches_s, time, "right") - 1
    phase = (time - touches_s[step]) / periods[step]
    return MeasuredWalk(periods, None, None, step, phase, angles_rad[inside], touch_sum_rad)
