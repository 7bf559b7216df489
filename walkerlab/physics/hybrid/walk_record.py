"""Fields that results of both models share, and the work of the constant torque at the hip.

Between two reversals of the angle between the legs, the work is the torque times the change of that angle, so no power
is integrated: only the reversals within a solver step are located, like events.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.kernels import kernel, kernel_part
from walkerlab.physics.mechanics.hinges import legs_apart
from walkerlab.physics.solvers.events import CrossingFinder, first_crossing
from walkerlab.physics.solvers.stepping import interpolate

Array = NDArray[np.float64]


class WalkWork(NamedTuple):
    """Computational cost of a walk. The fields are in the order in which the solver methods count them."""

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
        # A spring returns the energy it stores, and work against gravity is already part of the drives' work.
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
        """Heights (steps + 1,) of the footholds above the slope, beginning with the foothold at the start."""
        heights = np.zeros(self.steps) if self.foothold_height_m is None else self.foothold_height_m
        return np.append(0.0, heights)

    @property
    def knee_strikes_s(self) -> Array:
        """Times (strikes,) at which knees locked."""
        times = self.knee_strike_time_s
        return np.zeros(0) if times is None else times[~np.isnan(times)]


ROUNDING = 1e-12  # fraction of a solver step between a reversal and the start of the search for the next one


class TorqueWork(NamedTuple):
    """Work of the hip torque (J)."""

    net: float
    positive: float


@kernel_part
def torque_work(torque: float, method: Any, system: Any, finder: CrossingFinder, row: int, until: float) -> TorqueWork:
    """Compute the work of `torque` (N m) in the last solver step up to fraction `until`.

    row  row of the finder that may be overwritten
    """
    sample_rates(system, finder, row)
    y = finder.states[0, : method.y.size]
    first, _ = legs_apart(system, y)
    angle = first
    positive = 0.0
    fraction = 0.0
    while fraction < until:
        fraction = min(until, first_crossing(finder, row, 0, fraction + ROUNDING if fraction > 0.0 else 0.0, False))
        interpolate(method, system, fraction, y)
        before = angle
        angle, _ = legs_apart(system, y)
        positive += max(0.0, torque * (angle - before))
    return TorqueWork(torque * (angle - first), positive)


@kernel
def sample_rates(system: Any, finder: CrossingFinder, row: int) -> None:
    """Write the legs' relative angular velocity (rad/s) at the nodes of a solver step into `row` of the finder."""
    for node in range(finder.nodes.size):
        _, finder.values[row, node] = legs_apart(system, finder.states[node])
