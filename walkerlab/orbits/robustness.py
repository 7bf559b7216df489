"""Robustness of a gait: sensitivity to a floor drop and a push, the largest survivable ones, and rough ground.

Gait sensitivity norm: with z the section's coordinates after a step and e an indicator of it, minus the gait's,

    z' = A z + B d,  e' = C z + D d,  norm = sqrt(D^2 + sum over k >= 0 of (C A^k B)^2)

for a disturbance d of one step. A drop leaves the even section for two steps; the first terms of the sum are therefore
difference quotients of exact walks, and the even section's derivative gives the rest.

Source: Hobbelen and Wisse, A disturbance rejection measure for limit cycle walkers: the gait sensitivity norm, IEEE
Transactions on Robotics 23 (2007).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from walkerlab.hybrid.walk_record import rough_heights
from walkerlab.orbits.similarity import Units
from walkerlab.orbits.step_map import DisturbedWalk, StepMap, multipliers_of
from walkerlab.outcome import Outcome
from walkerlab.solvers.system import Floats

Disturbance = Literal["floor-drop", "hip-push"]
DISTURBANCES: tuple[Disturbance, ...] = ("floor-drop", "hip-push")
INDICATORS = ("step_period", "step_length", "speed")
DIRECT = 2  # steps whose change is a difference quotient
CENTRAL = ((-2, 1.0 / 12.0), (-1, -8.0 / 12.0), (1, 8.0 / 12.0), (2, -1.0 / 12.0))
FORWARD = ((0, -25.0 / 12.0), (1, 4.0), (2, -3.0), (3, 4.0 / 3.0), (4, -0.25))
FORMULAS = (CENTRAL, FORWARD, tuple((-offset, -weight) for offset, weight in FORWARD))
"""Offsets and weights of formulas of fourth order for a first derivative."""
GRID, CLOSE = 1.0 / 5000.0, 1e-6  # in units of the disturbance: its search, and how closely it is bisected
MOST = 0.5  # of a disturbance, in its unit


class Standpoint(NamedTuple):
    """A gait of one step: its step map and parameter, section coordinates, the derivative there, and its units."""

    step_map: StepMap
    p: float
    z: Floats  # (d,)
    A: Floats  # (d, d)
    units: Units

    def unit_of(self, disturbance: Disturbance) -> float:
        """Return the unit of a drop (m) or of a push (N s)."""
        return self.units.length if disturbance == "floor-drop" else self.units.impulse


def slope_of(function: Callable[[float], Floats | None], step: float) -> Floats | None:
    """Differentiate a function at 0 to fourth order; one-sided if one side has no value, None if neither has."""
    for formula in FORMULAS:
        values = [value for offset, _ in formula if (value := function(offset * step)) is not None]
        if len(values) == len(formula):
            return np.asarray(np.tensordot([weight / step for _, weight in formula], values, 1))
    return None


def sensitivity_norm(A: Floats, B: Floats, C: Floats, D: Floats) -> Floats | None:
    """Return norms (indicators,) of e' = C z + D d, z' = A z + B d; None for an unstable gait.

    A  (d, d)
    B  (d,)
    C  (indicators, d)
    D  (steps, indicators) changes of the steps before the section's derivative applies
    """
    if np.abs(multipliers_of(A)).max() >= 1.0:
        return None
    # z z' summed over all steps: X = A X A' + B B'
    d = len(B)
    summed = np.linalg.solve(np.eye(d * d) - np.kron(A, A), np.outer(B, B).ravel()).reshape(d, d)
    later = np.einsum("ij,jk,ik->i", C, summed, C)
    return np.asarray(np.sqrt((D**2).sum(axis=0) + np.maximum(later, 0.0)))


@dataclass(frozen=True)
class Sensitivity:
    """Responses of period, length and speed to a disturbance, SI: (3,) each.

    direct  of the disturbed step itself
    error   of the norm, from two step sizes
    """

    norm: Floats
    direct: Floats
    error: Floats


def indicators(walk: DisturbedWalk) -> Floats:
    """Return period, length and speed (steps, 3)."""
    return np.column_stack((walk.durations_s, walk.lengths_m, walk.lengths_m / walk.durations_s))


def disturbed(at: Standpoint, disturbance: Disturbance, size: float, steps: int) -> DisturbedWalk:
    """Walk from the gait with a disturbed first step: a drop (m) that persists, or a push (N s)."""
    if disturbance == "hip-push":
        return at.step_map.disturbed(at.z, at.p, np.zeros(steps + 1), size)
    return at.step_map.disturbed(at.z, at.p, np.append(0.0, np.full(steps, -size)))


def sensitivity(at: Standpoint, disturbance: Disturbance) -> Sensitivity | None:
    """Return the norms of a gait for a disturbance; None if it is unstable, or neighbouring steps fail."""
    fine, coarse = (response(at, disturbance, times) for times in (1.0, 2.0))
    return None if fine is None or coarse is None else Sensitivity(*fine, np.abs(fine[0] - coarse[0]))


def response(at: Standpoint, disturbance: Disturbance, times: float = 1.0) -> tuple[Floats, Floats] | None:
    """Return the norms and the response of the disturbed step, by differences of `times` the usual step size."""
    d, h = at.z.size, times * at.step_map.probe

    def after(size: float) -> Floats | None:
        walk = disturbed(at, disturbance, size, DIRECT)
        return np.append(indicators(walk), walk.z) if walk.outcome is Outcome.WALKED else None

    def next_step(move: Floats) -> Floats | None:
        walk = at.step_map.disturbed(at.z + move, at.p, np.zeros(2))
        return indicators(walk)[0] if walk.outcome is Outcome.WALKED else None

    changed = slope_of(after, h * at.unit_of(disturbance))
    columns = [slope_of(lambda size, way=way: next_step(size * way), h) for way in np.eye(d)]  # type: ignore[misc]
    if changed is None or any(column is None for column in columns):
        return None
    D = changed[:-d].reshape(DIRECT, len(INDICATORS))
    norm = sensitivity_norm(at.A, changed[-d:], np.column_stack(columns), D)  # type: ignore[arg-type]
    return None if norm is None else (norm, D[0])


def largest(stands: Callable[[float], bool], unit: float) -> float:
    """Return the largest disturbance up to which all smaller ones are survived.

    unit  of the disturbance: the grid is a fraction of it, and the search stops at half of it
    """
    steps = round(MOST / GRID)
    low = next((k - 1 for k in range(1, steps + 1) if not stands(k * GRID * unit)), steps)
    if low == steps:
        return MOST * unit
    below, above = low * GRID * unit, (low + 1) * GRID * unit
    while above - below > CLOSE * unit:
        middle = 0.5 * (below + above)
        below, above = (middle, above) if stands(middle) else (below, middle)
    return below


def largest_disturbance(at: Standpoint, disturbance: Disturbance, sign: float, steps: int) -> float:
    """Return the largest drop (m) or push (N s) of one sign that is followed by `steps` steps."""

    def stands(size: float) -> bool:
        return disturbed(at, disturbance, sign * size, steps + 1).outcome is Outcome.WALKED

    return largest(stands, at.unit_of(disturbance))


def steps_on_rough_ground(at: Standpoint, roughness_m: float, seed: tuple[int, ...], most: int) -> int:
    """Count the steps of a walk from the gait over normally distributed heights, at most `most`."""
    return int(at.step_map.disturbed(at.z, at.p, rough_heights(roughness_m, seed, most)).durations_s.size)


@dataclass(frozen=True)
class RoughWalks:
    """Mean length of walks on rough ground.

    mean_steps, standard_error  as far as the sample allows
    capped                      walks that reached the maximum number of steps
    method                      all-failed: the mean of all; censored: steps over failures; lower-bound: none failed
    """

    mean_steps: float
    standard_error: float | None
    walks: int
    capped: int
    method: Literal["all-failed", "censored", "lower-bound"]


def rough_walks(steps: Floats, most: int) -> RoughWalks:
    """Estimate the mean number of steps from walks (walks,) that were stopped at `most` steps."""
    capped = int(np.count_nonzero(steps >= most))
    failed, total = steps.size - capped, float(steps.sum())
    if failed == 0:
        return RoughWalks(total, None, steps.size, capped, "lower-bound")
    if capped:
        return RoughWalks(total / failed, total / failed / math.sqrt(failed), steps.size, capped, "censored")
    error = float(steps.std(ddof=1)) / math.sqrt(failed) if failed > 1 else None
    return RoughWalks(total / failed, error, steps.size, 0, "all-failed")
