"""How a gait's numbers answer a number of the walker: by the implicit function theorem.

With z the section's coordinates and P the step map, dz/dp = (I - A)^-1 dP/dp; all that follows from the gait changes
along (dz/dp, 1). The derivatives by p are difference quotients of exact steps at two step sizes, which tell their
error; that of a multiplier comes from A's by its left and right eigenvectors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial
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
    "cost_of_transport": "1",
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


def gait_numbers(at: Standpoint, wanted: Collection[str] = QUANTITIES) -> dict[str, float] | None:
    """The numbers of a gait, by name; no norm of an unstable one; None where its step ends.

    wanted  those that are: what a step itself does not tell takes more steps
    """
    step = at.step_map.step(at.z, at.p)
    if step.outcome is not Outcome.WALKED:
        return None
    radius = float(np.abs(multipliers_of(step.DP)).max())
    found = dict(zip(QUANTITIES, (step.period_s, step.length_m, step.length_m / step.period_s, radius), strict=False))
    for name, of in OTHERS.items():
        value = of(at._replace(A=step.DP)) if name in wanted else None
        found |= {} if value is None else {name: value}
    return found


def norm_of(at: Standpoint) -> float | None:
    """The norm of the step period for a drop of the floor; None of an unstable gait."""
    answer = sensitivity(at, "floor-drop")
    return None if answer is None else float(answer.norm[0])


def cost_of(at: Standpoint) -> float | None:
    """The cost of transport, where it is known."""
    return at.step_map.cost_of_transport(at.z, at.p)


OTHERS: Final[Mapping[str, Callable[[Standpoint], float | None]]] = {
    "gait_sensitivity_norm": norm_of,
    "cost_of_transport": cost_of,
}


def gradients(at: Standpoint, scale: float, wanted: Collection[str] = QUANTITIES) -> dict[str, Gradient]:
    """Derivatives of a gait's numbers by the parameter of its step map; empty where steps beside it end.

    scale   magnitude of changes of the parameter that matter
    wanted  the numbers, see `gait_numbers`
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

    def other(off: float, of: Callable[[Standpoint], float | None]) -> Floats | None:
        z, p = at.z + off * along, at.p + off
        step = at.step_map.step(z, p)
        value = None if step.outcome is not Outcome.WALKED else of(at._replace(z=z, p=p, A=step.DP))
        return None if value is None else np.array([value])

    changed = quotient(of_family, h)
    if changed is None:
        return {}
    matrix, off = (part[OWN:].reshape(d, d) for part in changed)
    own = (told(changed.value[k], changed.error[k]) for k in range(OWN))
    found = dict(zip(QUANTITIES, (*own, of_radius(at.A, matrix, off)), strict=False))
    for name, of in OTHERS.items():
        one = quotient(partial(other, of=of), h) if name in wanted else None
        found |= {} if one is None else {name: told(one.value[0], one.error[0])}
    return found


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
