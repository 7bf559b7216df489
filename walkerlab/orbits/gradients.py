"""How a gait's numbers answer a number of the walker: by the implicit function theorem.

With z the section's coordinates and P the step map, dz/dp = (I - A)^-1 dP/dp; all that follows from the gait changes
along (dz/dp, 1). The derivatives by p are difference quotients of exact steps at two step sizes, which tell their
error; that of a multiplier comes from A's by its left and right eigenvectors.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.orbits.robustness import Standpoint, quotient, sensitivity
from walkerlab.orbits.step_map import multipliers_of
from walkerlab.outcome import Outcome

Floats = NDArray[np.float64]

QUANTITIES: Final[Mapping[str, str]] = {
    "period_s": "s",
    "step_length_m": "m",
    "speed_m_s": "m/s",
    "spectral_radius": "1",
    "gait_sensitivity_norm": "s/m",
}
"""What is differentiated, with units; the norm is that of the step period for a drop of the floor."""
OWN = 3  # of them that a step itself has
APART = 1e-6  # |l' r| of the largest multiplier's eigenvectors, below which multipliers meet
STEP = 1.5  # of a difference quotient, in fifth roots of the relative tolerance
LOST = 0.1  # error, relative to a derivative, from which rounding has eaten it


@dataclass(frozen=True)
class Gradient:
    """A derivative; `why` says in words why there is none, or that it is lost."""

    value: float | None
    error: float | None
    why: str = ""


def gait_numbers(at: Standpoint) -> dict[str, float] | None:
    """The numbers of a gait, by name; no norm of an unstable one; None where its step ends."""
    step = at.step_map.step(at.z, at.p)
    if step.outcome is not Outcome.WALKED:
        return None
    radius = float(np.abs(multipliers_of(step.DP)).max())
    found = dict(zip(QUANTITIES, (step.period_s, step.length_m, step.length_m / step.period_s, radius), strict=False))
    answer = sensitivity(at._replace(A=step.DP), "floor-drop")
    return found if answer is None else {**found, "gait_sensitivity_norm": float(answer.norm[0])}


def gradients(at: Standpoint, scale: float) -> dict[str, Gradient]:
    """Derivatives of a gait's numbers by the parameter of its step map; empty where steps beside it end.

    scale  magnitude of changes of the parameter that matter
    """
    d, unity = at.z.size, np.eye(at.z.size)
    h = STEP * at.step_map.tolerances.rtol**0.2 * scale

    def led(off: float) -> Floats | None:
        step = at.step_map.step(at.z, at.p + off, derived=False)
        return step.z if step.outcome is Outcome.WALKED else None

    beside = quotient(led, h)
    if beside is None:
        return {}
    along = np.linalg.solve(unity - at.A, beside.value)

    def of_family(off: float) -> Floats | None:
        step = at.step_map.step(at.z + off * along, at.p + off)
        if step.outcome is not Outcome.WALKED:
            return None
        return np.concatenate(((step.period_s, step.length_m, step.length_m / step.period_s), step.DP.ravel()))

    def norm(off: float) -> Floats | None:
        here = at._replace(z=at.z + off * along, p=at.p + off)
        step = here.step_map.step(here.z, here.p)
        answer = None if step.outcome is not Outcome.WALKED else sensitivity(here._replace(A=step.DP), "floor-drop")
        return None if answer is None else answer.norm[:1]

    changed, of_norm = quotient(of_family, h), quotient(norm, h)
    if changed is None:
        return {}
    own = [told(changed.value[k], changed.error[k]) for k in range(OWN)]
    matrix, off = (part[OWN:].reshape(d, d) for part in changed)
    radius = of_radius(at.A, matrix, off)
    last = Gradient(None, None, "unstable") if of_norm is None else told(of_norm.value[0], of_norm.error[0])
    return dict(zip(QUANTITIES, (*own, radius, last), strict=True))


def told(value: float, error: float) -> Gradient:
    """A derivative, said to be lost if its error is no small part of it."""
    lost = error > LOST * abs(value) and value != 0.0
    return Gradient(float(value), float(error), "lost in rounding" if lost else "")


def of_radius(A: Floats, change: Floats, error: Floats) -> Gradient:
    """The derivative of the spectral radius, by that of A (d, d)."""
    values, right = np.linalg.eig(A)
    left = np.linalg.inv(right) if np.linalg.cond(right) < 1.0 / APART else None
    largest = int(np.argmax(np.abs(values)))
    others = [
        value for value in values if abs(value - values[largest]) > 0.0 and abs(value.conj() - values[largest]) > 0.0
    ]
    meets = any(abs(abs(value) - abs(values[largest])) < APART for value in others)
    if left is None or meets or values[largest] == 0.0:
        return Gradient(None, None, "multipliers meet")
    towards = values[largest].conjugate() / abs(values[largest])
    found, off = ((towards * (left[largest] @ part @ right[:, largest])).real for part in (change, error))
    return told(float(found), abs(float(off)))


def relative(value: float, parameter: float, quantity: float) -> float | None:
    """By how much of itself a quantity changes as the parameter changes by all of itself; None of one at 0."""
    return None if parameter == 0.0 or math.isclose(quantity, 0.0, abs_tol=1e-300) else value * parameter / quantity
