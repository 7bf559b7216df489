"""Derivatives of gait quantities with respect to a walker parameter, by the implicit function theorem.

With section coordinates z and the derivative A of the step map P, dz/dp = (I - A)^-1 dP/dp, and every quantity of the
gait changes along (dz/dp, 1). Derivatives with respect to p are difference quotients of exact steps in this direction.
The derivative of a multiplier follows from that of A and from the multiplier's left and right eigenvectors. Two step
sizes give an error estimate, and the step is halved as long as this reduces errors that are not yet small.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Final, NamedTuple

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.robustness import GaitOnMap, derivative, response
from walkerlab.physics.orbits.step_map import Cycle, multipliers_of
from walkerlab.physics.solvers.system import Floats

# Differentiable quantities with units. The norms describe how the step period responds to a floor drop. The scaled norm
# measures time in pendulum times and length in leg lengths of the walker.
GAIT_QUANTITIES: Final[Mapping[str, str]] = {
    "period_s": "s",
    "step_length_m": "m",
    "speed_m_s": "m/s",
    "spectral_radius": "1",
    "gait_sensitivity_norm": "s/m",
    "gait_sensitivity_norm_scaled": "1",
    "cost_of_transport": "1",
}
STEP_QUANTITY_COUNT = 3  # number of quantities at the start of this list, which follow from a single stride
# multipliers count as equal if their magnitudes differ by less than this, or if the condition number of the eigenvector
# matrix is above the inverse of this
MIN_EIGENVECTOR_PRODUCT = 1e-6
STEP_FACTOR = 1.5  # step of a difference quotient, as a multiple of the fifth root of the relative tolerance
APPROACH_STEPS = (1e-4, 1e-2)  # multiples of that step, to find the direction of the family
STEP_SIZES = (2.0, 1.0, 0.5, 0.25, 0.125)  # multiples of that step, tried in turn for the derivatives
SMALL_ERROR = 1e-3  # relative error at which no smaller step is needed
LOST_ERROR = 0.1  # relative error above which a derivative is lost in rounding


@dataclass(frozen=True)
class Gradient:
    """Derivative of a quantity, and its error. `why` says why there is none, or warns that rounding dominates it."""

    value: float | None
    error: float | None
    why: str = ""

    @property
    def small(self) -> bool:
        return self.value is None or self.error is None or self.error <= SMALL_ERROR * abs(self.value)

    def halves(self, coarser: Gradient | None) -> bool:
        return coarser is None or (self.error is not None and self.error < 0.5 * (coarser.error or 0.0))


def gait_quantities(gait: GaitOnMap, selection: Collection[str] = GAIT_QUANTITIES) -> dict[str, float] | None:
    """Compute the quantities of a gait by name, without norms if it is unstable, or return None if its step fails."""
    # Compute only the quantities in `selection`, because those that need more than a single step are expensive.
    stride = gait.stride(gait.z, gait.p)
    if stride.outcome is not Outcome.WALKED:
        return None
    # The root turns the multiplier of a stride into that of a step.
    radius = float(np.abs(multipliers_of(stride.DP)).max()) ** (1.0 / gait.step_map.stride)
    quantities = dict(zip(GAIT_QUANTITIES, (*mean_quantities(stride), radius), strict=False))
    for names, of in WALK_QUANTITIES.items():
        values = None if set(names).isdisjoint(selection) else of(gait._replace(A=stride.DP))
        quantities |= {} if values is None else dict(zip(names, values, strict=True))
    return quantities


def mean_quantities(stride: Cycle) -> tuple[float, float, float]:
    """Return the mean period (s) and the mean length (m) of a stride's steps, and the speed (m/s)."""
    steps = len(stride.steps)
    period = stride.period_s
    length = math.fsum(stride.lengths_m)
    return period / steps, length / steps, length / period


def sensitivity_norms(gait: GaitOnMap) -> tuple[float, float] | None:
    """Return the gait sensitivity norm of the step period for a floor drop, in s/m and scaled.

    If the legs differ, it is the root mean square over the drops under each foot. Returns None for an unstable gait.
    """
    responses = [response(each, "floor-drop") for each in gait.split_by_leg()]
    norms = [float(result[0][0]) for result in responses if result is not None]
    if len(norms) < len(responses):
        return None
    norm = math.hypot(*norms) / math.sqrt(len(norms))
    length, time = gait.step_map.leg_and_pendulum(gait.p)
    return norm, norm * length / time


def transport_cost(gait: GaitOnMap) -> tuple[float] | None:
    cost = gait.step_map.cost_of_transport(gait.z, gait.p)
    return None if cost is None else (cost,)


# Functions for quantities that need more than a single step, by the names of the values that they return.
WALK_QUANTITIES: Final[Mapping[tuple[str, ...], Callable[[GaitOnMap], tuple[float, ...] | None]]] = {
    ("gait_sensitivity_norm", "gait_sensitivity_norm_scaled"): sensitivity_norms,
    ("cost_of_transport",): transport_cost,
}


def gradients(gait: GaitOnMap, scale: float, selection: Collection[str] = GAIT_QUANTITIES) -> dict[str, Gradient]:
    """Differentiate the quantities of a gait with respect to the parameter.

    scale  size of a typical change of the parameter

    Returns an empty dictionary if the step map fails at nearby values.
    """
    # A fourth-order quotient errs by h^4 and by rtol / h, which are of the same size at the fifth root of rtol.
    h = STEP_FACTOR * gait.step_map.tolerances.rtol**0.2 * scale
    along = np.zeros(gait.z.size)
    for part in APPROACH_STEPS:
        closer = family_direction(gait, part * h, along)
        if closer is None:
            return {}
        along = closer
    best = dict[str, Gradient]()
    coarse = None
    for size in STEP_SIZES:
        fine = differentiate(gait, size * h, along, selection)
        if fine is not None and coarse is not None:
            better = {
                name: gradient
                for name, gradient in combine_steps(gait, fine, coarse).items()
                if gradient.halves(best.get(name))
            }
            best |= better
            if not better or all(gradient.small for gradient in best.values()):
                break
        coarse = fine
    return best


def combine_steps(gait: GaitOnMap, fine: Derivatives, coarse: Derivatives) -> dict[str, Gradient]:
    combined = {
        name: make_gradient(value, abs(value - coarse.numbers[name]))
        for name, value in fine.numbers.items()
        if name in coarse.numbers
    }
    steps = gait.step_map.stride
    return combined | {"spectral_radius": radius_gradient(gait.A, fine.A, coarse.A - fine.A, steps)}


class Derivatives(NamedTuple):
    numbers: dict[str, float]
    A: Floats


def family_direction(gait: GaitOnMap, h: float, guess: Floats) -> Floats | None:
    """Improve a guess of dz/dp (d,) along the family by difference quotients, or return None if that fails."""
    # On compliant ground a step from z itself fails if the parameter changes the walker's dimensions: its foot would be
    # in the air or deep in the ground.

    def step_from(off: float) -> Floats | None:
        stride = gait.stride(gait.z + off * guess, gait.p + off, derived=False)
        return stride.steps[-1].z if stride.outcome is Outcome.WALKED else None

    moved = derivative(step_from, h)
    # `moved` is gait.A @ guess + dP/dp.
    return None if moved is None else np.asarray(np.linalg.solve(np.eye(guess.size) - gait.A, moved - gait.A @ guess))


def differentiate(gait: GaitOnMap, h: float, guess: Floats, selection: Collection[str]) -> Derivatives | None:
    """Compute difference quotients of step h along the family, near the direction `guess` (d,).

    Returns None if the step map fails at nearby values.
    """
    along = family_direction(gait, h, guess)
    if along is None:
        return None

    @cache
    def neighbour(off: float) -> tuple[GaitOnMap, Cycle]:
        stride = gait.stride(gait.z + off * along, gait.p + off)
        return gait._replace(z=gait.z + off * along, p=gait.p + off, A=stride.DP), stride

    def stride_values(off: float) -> Floats | None:
        _, stride = neighbour(off)
        return np.append(mean_quantities(stride), stride.DP) if stride.outcome is Outcome.WALKED else None

    def walk_values(off: float, of: Callable[[GaitOnMap], tuple[float, ...] | None]) -> Floats | None:
        changed_gait, stride = neighbour(off)
        values = of(changed_gait) if stride.outcome is Outcome.WALKED else None
        return None if values is None else np.array(values)

    changed = derivative(stride_values, h)
    if changed is None:
        return None
    numbers = dict(zip(GAIT_QUANTITIES, changed[:STEP_QUANTITY_COUNT].tolist(), strict=False))
    for names, of in WALK_QUANTITIES.items():
        slopes = None if set(names).isdisjoint(selection) else derivative(partial(walk_values, of=of), h)
        numbers |= {} if slopes is None else dict(zip(names, slopes.tolist(), strict=True))
    return Derivatives(numbers, changed[STEP_QUANTITY_COUNT:].reshape(gait.A.shape))


def make_gradient(value: float, error: float) -> Gradient:
    lost = error > LOST_ERROR * abs(value) and value != 0.0
    return Gradient(float(value), float(error), "lost in rounding" if lost else "")


def radius_gradient(A: Floats, change: Floats, error: Floats, steps: int = 1) -> Gradient:
    """Differentiate the spectral radius per step, where A (d, d) is the derivative of `steps` steps.

    change, error  (d, d) derivative of A with respect to the parameter, and its error
    """
    values, right = np.linalg.eig(A)
    left = np.linalg.inv(right) if np.linalg.cond(right) < 1.0 / MIN_EIGENVECTOR_PRODUCT else None
    largest = int(np.argmax(np.abs(values)))
    # A conjugate has the same magnitude everywhere, so it does not count as another multiplier.
    distinct = [value for value in values if value not in (values[largest], values[largest].conj())]
    meets = any(abs(abs(value) - abs(values[largest])) < MIN_EIGENVECTOR_PRODUCT for value in distinct)
    if left is None or meets or values[largest] == 0.0:
        return Gradient(None, None, "multipliers meet")
    # chain rule of |m|^(1 / steps)
    of_step = float(abs(values[largest])) ** (1.0 / steps - 1.0) / steps
    towards = of_step * (values[largest].conjugate() / abs(values[largest]))
    slope = (towards * (left[largest] @ change @ right[:, largest])).real
    # Use absolute values, because the errors of A's elements might cancel by chance.
    off = of_step * (np.abs(left[largest]) @ np.abs(error) @ np.abs(right[:, largest]))
    return make_gradient(float(slope), float(off))


def relative_gradient(value: float, parameter: float, quantity: float) -> float | None:
    """Return the relative change of a quantity per relative change of the parameter, or None if either is zero."""
    return None if parameter == 0.0 or math.isclose(quantity, 0.0, abs_tol=1e-300) else value * parameter / quantity
