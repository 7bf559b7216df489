"""Measured walks: periods and lengths of steps, or angles of both legs over time."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.solvers.system import Floats

STEP_PERIOD: Final = "step_period_s"
STEP_LENGTH: Final = "step_length_m"
LEG_ANGLE: Final = "angle_rad"


@dataclass(frozen=True, eq=False)
class MeasuredSteps:
    """Quantities of consecutive steps, from heel strike to heel strike."""

    periods_s: Floats  # (steps,)
    lengths_m: Floats | None = None  # (steps,)
    touch_angles_rad: Floats | None = None  # (steps,) angle from the vertical of the leg that touches down

    @property
    def count(self) -> int:
        return int(self.periods_s.size)

    def channels(self) -> dict[str, Floats]:
        """Return the measured values (steps,) by quantity."""
        values = {STEP_PERIOD: self.periods_s, STEP_LENGTH: self.lengths_m, LEG_ANGLE: self.touch_angles_rad}
        return {name: value for name, value in values.items() if value is not None}


@dataclass(frozen=True, eq=False)
class MeasuredAngles:
    """Angles of both legs in consecutive steps, with the phase of each sample in its step."""

    touches_s: Floats  # (steps + 1,) times of heel strikes; the first one starts the walk
    step: NDArray[np.int64]  # (samples,) index of each sample's step
    phase: Floats  # (samples,) fraction of the step's period that has passed
    angles_rad: Floats  # (samples, 2) from the vertical; the leg that swings first comes first
    lengths_m: Floats | None = None  # (steps,)
    # sum of both legs' angles from the slope's normal at heel strikes; not zero if slope or sensors are off
    touch_sum_rad: float = 0.0

    @property
    def count(self) -> int:
        return int(self.touches_s.size) - 1

    @property
    def steps(self) -> MeasuredSteps:
        return MeasuredSteps(np.diff(self.touches_s), self.lengths_m)


def split_into_steps(
    time_s: Floats, angles_rad: Floats, touches_s: Floats, lengths_m: Floats | None = None
) -> MeasuredAngles:
    """Assign samples of angles (samples, 2) to steps between heel strikes (steps + 1,), dropping samples outside."""
    inside = (time_s >= touches_s[0]) & (time_s < touches_s[-1])
    time, angles = time_s[inside], angles_rad[inside]
    step = np.searchsorted(touches_s, time, "right") - 1
    phase = (time - touches_s[step]) / np.diff(touches_s)[step]
    return MeasuredAngles(touches_s, step, phase, angles, lengths_m)
