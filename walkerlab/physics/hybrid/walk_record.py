"""Result fields of a walk that both models share."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome

Array = NDArray[np.float64]


class WalkWork(NamedTuple):
    """Cost of a walk, in the order of the methods' counters."""

    rhs_evaluations: int
    accepted: int
    rejected: int
    jacobians: int


class DrivenWork(NamedTuple):
    """Work during the completed steps, and the weight carried."""

    weight: float  # N
    gravity: float  # J, from the first foothold to the last, along the slope and over uneven ground
    push_off: float  # J
    hip: float  # J, of spring, damper and torque
    hip_torque: float  # J, the constant torque's part of that
    hip_torque_positive: float  # J, its positive work alone

    @property
    def net_work(self) -> float:
        """Net work of gravity, push-off and hip (J)."""
        return self.gravity + self.push_off + self.hip

    def per_step(self, steps: int) -> dict[str, float]:
        """Compute the mean work per step (J) by source; the hip torque's are parts of the hip's."""
        return {name: getattr(self, name) / steps for name in self._fields if name != "weight"}

    def cost_of_transport(self, distance: float) -> float:
        """Compute the work spent divided by weight times distance (m) along the slope."""
        # A spring returns the energy it stores; work against gravity is already counted in that of the drives.
        return (max(0.0, self.gravity) + self.push_off + self.hip_torque_positive) / (self.weight * distance)


def rough_heights(roughness_m: float, seed: int | tuple[int, ...], steps: int) -> Array:
    """Draw heights (steps + 1,) in m of the footholds of rough ground, independent and normal; the start's is zero."""
    # The first heights do not depend on the number drawn.
    return np.append(0.0, np.random.default_rng(seed).normal(0.0, roughness_m, steps))


@dataclass(frozen=True, eq=False)
class WalkRecord:
    """Steps, outcome and cost of a walk, SI units. A step ends as the swing foot touches the ground."""

    outcome: Outcome
    touch_time_s: Array  # (steps,)
    touch_along_m: Array  # (steps,) along the slope from the first foothold
    knee_strike_time_s: Array | None  # (steps,) of the swing leg's knee, nan if it did not lock; None without knees
    end_time_s: float  # of the walk, which may end after the last touch
    work: WalkWork
    foothold_height_m: Array | None  # (steps,) over the slope, where each touch is; None on even ground
    driven: DrivenWork

    @property
    def advice(self) -> str:
        """Meaning of the outcome and what to try next."""
        even = self.foothold_height_m is None
        return self.outcome.advice if even else self.outcome.advice_on_uneven_ground

    @property
    def steps(self) -> int:
        return int(self.touch_time_s.size)

    @property
    def periods_s(self) -> Array:
        return np.diff(self.touch_time_s, prepend=0.0)

    @property
    def lengths_m(self) -> Array:
        """Distance along the slope of each step from touch to touch, (steps,); the first from the first foothold."""
        return np.diff(self.touch_along_m, prepend=0.0)

    @property
    def ground_m(self) -> Array:
        """Heights over the slope of the footholds, the start's first, (steps + 1,)."""
        heights = np.zeros(self.steps) if self.foothold_height_m is None else self.foothold_height_m
        return np.append(0.0, heights)

    @property
    def knee_strikes_s(self) -> Array:
        """Times at which knees locked, (strikes,)."""
        times = self.knee_strike_time_s
        return np.zeros(0) if times is None else times[~np.isnan(times)]
