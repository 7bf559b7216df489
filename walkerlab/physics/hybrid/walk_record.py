"""Fields that results of both models share."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome

Array = NDArray[np.float64]


class WalkWork(NamedTuple):
    """Computational cost of a walk, in the order of the methods' counts."""

    rhs_evaluations: int
    accepted: int
    rejected: int
    jacobians: int


class DrivenWork(NamedTuple):
    """Work done on the walker during the completed steps, and the walker's weight."""

    weight: float  # N
    gravity: float  # J, work from the first foothold to the last, along the slope and over uneven ground
    push_off: float  # J
    hip: float  # J, work of the hip's spring, damper and torque
    hip_torque: float  # J, part of the hip's work that the constant torque does
    hip_torque_positive: float  # J, positive work of the constant torque
    knees: float | None = None  # J, negative work of the knees' dampers; None without them

    @property
    def net_work(self) -> float:
        """Net work of gravity, push-off, hip and knees (J)."""
        return self.gravity + self.push_off + self.hip + (self.knees or 0.0)

    def work_per_step(self, steps: int) -> dict[str, float]:
        """Compute the mean work per step (J) by source. The hip's work includes the work of its torque."""
        works = {name: getattr(self, name) for name in self._fields if name != "weight"}
        return {name: work / steps for name, work in works.items() if work is not None}

    def cost_of_transport(self, distance: float) -> float:
        """Compute the work spent divided by weight times distance (m) along the slope."""
        # A spring returns the energy it stores; work against gravity is already part of the drives' work.
        return (max(0.0, self.gravity) + self.push_off + self.hip_torque_positive) / (self.weight * distance)


def rough_heights(roughness_m: float, seed: int | tuple[int, ...], steps: int) -> Array:
    """Draw the footholds' heights (steps + 1,) in m on rough ground: the first is 0, the rest normally distributed."""
    # The first heights do not depend on how many are drawn.
    return np.append(0.0, np.random.default_rng(seed).normal(0.0, roughness_m, steps))


@dataclass(frozen=True, eq=False)
class WalkRecord:
    """Steps, outcome and cost of a walk, SI units. A step ends when the swing foot touches the ground."""

    outcome: Outcome
    touch_time_s: Array  # (steps,)
    touch_along_m: Array  # (steps,) along the slope from the first foothold
    knee_strike_time_s: Array | None  # (steps,) when the swing knee locked, nan if it did not; None without knees
    end_time_s: float  # end of the walk, which may be later than the last touch
    work: WalkWork
    foothold_height_m: Array | None  # (steps,) height above the slope of each foothold; None on even ground
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
        """Distances (steps,) along the slope from touch to touch, the first of them from the first foothold."""
        return np.diff(self.touch_along_m, prepend=0.0)

    @property
    def ground_m(self) -> Array:
        """Heights (steps + 1,) of the footholds above the slope, beginning with the start's."""
        heights = np.zeros(self.steps) if self.foothold_height_m is None else self.foothold_height_m
        return np.append(0.0, heights)

    @property
    def knee_strikes_s(self) -> Array:
        """Times (strikes,) at which knees locked."""
        times = self.knee_strike_time_s
        return np.zeros(0) if times is None else times[~np.isnan(times)]
