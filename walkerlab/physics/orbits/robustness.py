"""Robustness of a gait: sensitivity to a floor drop and a push, the largest of each that it survives, and rough ground.

The gait sensitivity norm measures the response to a disturbance d of one step. With the section coordinates z after a
step and an indicator e of the step, both minus the gait's values,

    z' = A z + B d,  e' = C z + D d,  norm = sqrt(D^2 + sum over k >= 0 of (C A^k B)^2)

If the legs differ, A is the derivative of a stride, e' holds the indicators of both its steps, and the norm depends on
the leg whose step is disturbed.

A drop takes the state off the section of even ground for two steps, so the first terms of the sum are difference
quotients of exact walks, and the derivative on even ground gives the rest.

Source: Hobbelen and Wisse, A disturbance rejection measure for limit cycle walkers: the gait sensitivity norm, IEEE
Transactions on Robotics 23 (2007).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.walk_record import rough_heights
from walkerlab.physics.orbits.similarity import Units
from walkerlab.physics.orbits.step_map import Cycle, DisturbedWalk, StepMap, multipliers_of, walk_steps
from walkerlab.physics.solvers.system import Floats

Disturbance = Literal["floor-drop", "hip-push"]
DISTURBANCES: tuple[Disturbance, ...] = ("floor-drop", "hip-push")
LARGEST: Final[Mapping[str, tuple[Disturbance, float]]] = {
    "largest_step_down_m": ("floor-drop", 1.0),
    "largest_step_up_m": ("floor-drop", -1.0),
    "largest_push_forward_N_s": ("hip-push", 1.0),
    "largest_push_backward_N_s": ("hip-push", -1.0),
}
"""Kind and sign of each largest survived disturbance."""
INDICATORS = ("step_period", "step_length", "speed")
# For this many steps (a stride, if the legs differ), responses are difference quotients of simulated walks. Those of
# later steps follow from the linearised stride.
DIRECT_STEPS = 2
# offsets and weights of fourth-order formulas for a first derivative, the most accurate first
CENTRAL_4TH = ((-2, 1.0 / 12.0), (-1, -8.0 / 12.0), (1, 8.0 / 12.0), (2, -1.0 / 12.0))
FORWARD_4TH = ((0, -25.0 / 12.0), (1, 4.0), (2, -3.0), (3, 4.0 / 3.0), (4, -0.25))
FORMULAS = (CENTRAL_4TH, FORWARD_4TH, tuple((-offset, -weight) for offset, weight in FORWARD_4TH))
# grid of the search and accuracy of its bisection, as multiples of `unit_of`
SEARCH_GRID = 1.0 / 5000.0
BISECTION_WIDTH = 1e-6
MAX_DISTURBANCE = 0.5  # largest disturbance tried, as a multiple of `unit_of`


class GaitOnMap(NamedTuple):
    """A gait that repeats after one stride, with its step map. If the legs are equal, a stride is a single step."""

    step_map: StepMap
    p: float  # value of the parameter
    z: Floats  # (d,) section coordinates at the start
    A: Floats  # (d, d) derivative of a stride
    units: Units  # length, mass and time of the walker, by which states are scaled
    swing: int = 0  # number of steps of the gait before z, as in `Stepper.step`

    @property
    def leg(self) -> int:
        """Leg (1 or 2) that swings in the first step that a disturbance can affect."""
        return 1 + (self.swing + self.step_map.disturbs_after) % 2

    def stride(self, z: Floats, p: float, derived: bool = True) -> Cycle:
        """Take the steps of a stride from another start and at another value of the parameter."""
        return walk_steps(self.step_map, z, p, self.step_map.stride, derived, self.swing)

    def split_by_leg(self) -> list[GaitOnMap]:
        """Return the gait once for each step of its stride, beginning with that step, sorted by `leg`.

        For equal legs, a stride is a single step.
        """
        if self.step_map.stride == 1:
            return [self]
        first, second = (step for step in self.stride(self.z, self.p).steps)
        # If the gait starts from the next section, its second step comes first.
        other = self._replace(z=first.z, A=first.DP @ second.DP, swing=self.swing + 1)
        return sorted((self, other), key=lambda gait: gait.leg)

    def unit_of(self, disturbance: Disturbance) -> float:
        """Return the unit of a drop (m) or of a push (N s)."""
        return self.units.length if disturbance == "floor-drop" else self.units.impulse


def derivative(function: Callable[[float], Floats | None], step: float) -> Floats | None:
    """Differentiate a function at 0 to fourth order, from one side if the function has no values on the other.

    Returns None if it lacks values on both sides.
    """
    for formula in FORMULAS:
        values = [value for offset, _ in formula if (value := function(offset * step)) is not None]
        if len(values) == len(formula):
            return np.asarray(np.tensordot([weight / step for _, weight in formula], values, 1))
    return None


def sensitivity_norm(A: Floats, B: Floats, C: Floats, D: Floats) -> Floats | None:
    """Return norms (indicators,) of e' = C z + D d, z' = A z + B d, or None for an unstable gait.

    A  (d, d)
    B  (d,)
    C  (steps of a stride x indicators, d)
    D  (steps, indicators) responses of the first steps
    """
    if np.abs(multipliers_of(A)).max() >= 1.0:
        return None
    # X, the sum of z z^T over all steps, satisfies X = A X A^T + B B^T
    d = len(B)
    summed = np.linalg.solve(np.eye(d * d) - np.kron(A, A), np.outer(B, B).ravel()).reshape(d, d)
    later = np.einsum("ij,jk,ik->i", C, summed, C).reshape(-1, D.shape[1]).sum(axis=0)
    return np.asarray(np.sqrt((D**2).sum(axis=0) + np.maximum(later, 0.0)))


@dataclass(frozen=True)
class Sensitivity:
    """Responses of step period, step length and speed to a disturbance, (3,) each, in SI units."""

    norm: Floats
    direct: Floats  # response of the disturbed step itself
    error: Floats  # error of the norm, estimated from two step sizes


def indicators(walk: DisturbedWalk) -> Floats:
    return np.column_stack((walk.durations_s, walk.lengths_m, walk.lengths_m / walk.durations_s))


def walk_disturbed(gait: GaitOnMap, disturbance: Disturbance, size: float, steps: int) -> DisturbedWalk:
    """Walk from the gait with a disturbed first step: a lasting drop (m) of the floor, or a push (N s)."""
    if disturbance == "hip-push":
        return gait.step_map.take_disturbed_walk(gait.z, gait.p, np.zeros(steps + 1), size, gait.swing)
    return gait.step_map.take_disturbed_walk(gait.z, gait.p, np.append(0.0, np.full(steps, -size)), swing=gait.swing)


def sensitivity(gait: GaitOnMap, disturbance: Disturbance) -> Sensitivity | None:
    """Return a gait's sensitivity to a disturbance, or None if it is unstable or a slightly disturbed step fails."""
    fine, coarse = (response(gait, disturbance, times) for times in (1.0, 2.0))
    return None if fine is None or coarse is None else Sensitivity(*fine, np.abs(fine[0] - coarse[0]))


def response(gait: GaitOnMap, disturbance: Disturbance, times: float = 1.0) -> tuple[Floats, Floats] | None:
    """Return the norms and the response of the disturbed step, or None if a walk fails or the gait is unstable.

    times  factor by which the difference step is multiplied
    """
    d, h = gait.z.size, times * gait.step_map.probe

    def step_after(size: float) -> Floats | None:
        walk = walk_disturbed(gait, disturbance, size, DIRECT_STEPS)
        return np.append(indicators(walk), walk.z) if walk.outcome is Outcome.WALKED else None

    def next_stride(move: Floats) -> Floats | None:
        even = np.zeros(gait.step_map.stride + 1)
        walk = gait.step_map.take_disturbed_walk(gait.z + move, gait.p, even, swing=gait.swing)
        return indicators(walk).ravel() if walk.outcome is Outcome.WALKED else None

    changed = derivative(step_after, h * gait.unit_of(disturbance))
    columns = [derivative(lambda size, unit=unit: next_stride(size * unit), h) for unit in np.eye(d)]  # type: ignore[misc]
    if changed is None or any(column is None for column in columns):
        return None
    D = changed[:-d].reshape(DIRECT_STEPS, len(INDICATORS))
    norm = sensitivity_norm(gait.A, changed[-d:], np.column_stack(columns), D)  # type: ignore[arg-type]
    return None if norm is None else (norm, D[0])


def largest_survived(stands: Callable[[float], bool], unit: float, width: float = BISECTION_WIDTH) -> float:
    """Return the size up to which every disturbance is survived, at most MAX_DISTURBANCE times `unit`."""
    steps = round(MAX_DISTURBANCE / SEARCH_GRID)
    # Sizes are tried in increasing order, so that the gait survives every size below the result.
    low = next((k - 1 for k in range(1, steps + 1) if not stands(k * SEARCH_GRID * unit)), steps)
    if low == steps:
        return MAX_DISTURBANCE * unit
    below = low * SEARCH_GRID * unit
    above = (low + 1) * SEARCH_GRID * unit
    while above - below > width * unit:
        middle = 0.5 * (below + above)
        below, above = (middle, above) if stands(middle) else (below, middle)
    return below


def largest_disturbance(
    gait: GaitOnMap, disturbance: Disturbance, sign: float, steps: int, width: float = BISECTION_WIDTH
) -> float:
    """Return the largest disturbance of the given sign after which a walk still takes `steps` steps.

    width  accuracy, as a multiple of `unit_of`
    """

    def stands(size: float) -> bool:
        return walk_disturbed(gait, disturbance, sign * size, steps + 1).outcome is Outcome.WALKED

    return largest_survived(stands, gait.unit_of(disturbance), width)


def steps_on_rough_ground(gait: GaitOnMap, roughness_m: float, seed: tuple[int, ...], max_steps: int) -> int:
    """Count the steps, up to `max_steps`, of a walk that starts on the gait, over normally distributed heights."""
    heights = rough_heights(roughness_m, seed, max_steps)
    return int(gait.step_map.take_disturbed_walk(gait.z, gait.p, heights, swing=gait.swing).durations_s.size)


@dataclass(frozen=True)
class RoughWalks:
    mean_steps: float  # mean number of steps, or a lower bound of it, depending on `method`
    standard_error: float | None  # None if it cannot be estimated
    walks: int
    capped: int  # walks that reached the maximum number of steps
    # all-failed: mean over all walks. censored: total steps per failure. lower-bound: total steps, if no walk failed
    method: Literal["all-failed", "censored", "lower-bound"]


def rough_walks(steps: Floats, max_steps: int) -> RoughWalks:
    """Estimate the mean number of steps from walks (walks,) that were stopped at `max_steps` steps."""
    capped = int(np.count_nonzero(steps >= max_steps))
    failed = steps.size - capped
    total = float(steps.sum())
    if failed == 0:
        return RoughWalks(total, None, steps.size, capped, "lower-bound")
    if capped:
        # Maximum likelihood for a constant probability of failing in each step: total steps per failure.
        return RoughWalks(total / failed, total / failed / math.sqrt(failed), steps.size, capped, "censored")
    error = float(steps.std(ddof=1)) / math.sqrt(failed) if failed > 1 else None
    return RoughWalks(total / failed, error, steps.size, 0, "all-failed")
