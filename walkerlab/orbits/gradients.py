"""Derivatives of gait quantities with respect to a walker parameter, by the implicit function theorem.

With z the section's coordinates and P the step map, dz/dp = (I - A)^-1 dP/dp; every quantity of the gait then changes
along (dz/dp, 1). Derivatives by p are difference quotients of exact steps along this direction; that of a multiplier
follows from A's by its left and right eigenvectors. The difference between two step sizes estimates the error, and the
step is halved while that reduces errors that are not yet small.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Final, NamedTuple

import numpy as np

from walkerlab.orbits.robustness import Standpoint, response, slope_of
from walkerlab.orbits.step_map import MappedStep, multipliers_of
from walkerlab.outcome import Outcome
from walkerlab.solvers.system import Floats

QUANTITIES: Final[Mapping[str, str]] = {
    "period_s": "s",
    "step_length_m": "m",
    "speed_m_s": "m/s",
    "spectral_radius": "1",
    "gait_sensitivity_norm": "s/m",
    "gait_sensitivity_norm_scaled": "1",
    "cost_of_transport": "1",
}
"""What is differentiated, with units; the norms are of the step period for a drop of the floor, the scaled one in
pendulum times over leg lengths of the walker itself."""
OWN = 3  # of them that a step itself has
APART = 1e-6  # |l' r| of the largest multiplier's eigenvectors, below which multipliers meet
STEP = 1.5  # of a difference quotient, in fifth roots of the relative tolerance
APPROACH = (1e-4, 1e-2)  # of that: steps by which the direction of the family is found
SIZES = (2.0, 1.0, 0.5, 0.25, 0.125)  # of the steps of difference quotients, one after the other
SMALL = 1e-3  # error, relative to a derivative, that needs no smaller step
LOST = 0.1  # error, relative to a derivative, from which rounding has eaten it


@dataclass(frozen=True)
class Gradient:
    """A derivative; `why` states why there is none, or that rounding dominates it."""

    value: float | None
    error: float | None
    why: str = ""

    @property
    def small(self) -> bool:
        """Whether a smaller step is unnecessary or would not help."""
        return self.value is None or self.error is None or self.error <= SMALL * abs(self.value)

    def halves(self, other: Gradient | None) -> bool:
        """Whether its error is less than half of another one's."""
        return other is None or (self.error is not None and self.error < 0.5 * (other.error or 0.0))


def gait_numbers(at: Standpoint, wanted: Collection[str] = QUANTITIES) -> dict[str, float] | None:
    """Compute the quantities of a gait by name, without norms if it is unstable; None if its step fails.

    wanted  quantities to compute; those that a single step does not give cost more steps
    """
    step = at.step_map.step(at.z, at.p)
    if step.outcome is not Outcome.WALKED:
        return None
    radius = float(np.abs(multipliers_of(step.DP)).max())
    found = dict(zip(QUANTITIES, (*own_numbers(step), radius), strict=False))
    for names, of in OTHERS.items():
        values = None if set(names).isdisjoint(wanted) else of(at._replace(A=step.DP))
        found |= {} if values is None else dict(zip(names, values, strict=True))
    return found


def own_numbers(step: MappedStep) -> tuple[float, float, float]:
    """Return period, length and speed of a step."""
    return step.period_s, step.length_m, step.length_m / step.period_s


def norms_of(at: Standpoint) -> tuple[float, float] | None:
    """Return the norm of the step period for a floor drop, in SI and scaled; None for an unstable gait."""
    answer = response(at, "floor-drop")
    if answer is None:
        return None
    length, time = at.step_map.leg_and_pendulum(at.p)
    return float(answer[0][0]), float(answer[0][0]) * length / time


def cost_of(at: Standpoint) -> tuple[float] | None:
    cost = at.step_map.cost_of_transport(at.z, at.p)
    return None if cost is None else (cost,)


OTHERS: Final[Mapping[tuple[str, ...], Callable[[Standpoint], tuple[float, ...] | None]]] = {
    ("gait_sensitivity_norm", "gait_sensitivity_norm_scaled"): norms_of,
    ("cost_of_transport",): cost_of,
}
"""What takes more than the step itself, by the names of the values."""


def gradients(at: Standpoint, scale: float, wanted: Collection[str] = QUANTITIES) -> dict[str, Gradient]:
    """Differentiate a gait's quantities by the parameter of its step map; empty if neighbouring steps fail.

    scale   magnitude of significant changes of the parameter
    wanted  the quantities, see `gait_quantities`
    """
    h, along = STEP * at.step_map.tolerances.rtol**0.2 * scale, np.zeros(at.z.size)
    for part in APPROACH:
        closer = along_family(at, part * h, along)
        if closer is None:
            return {}
        along = closer
    found, coarse = dict[str, Gradient](), None
    for size in SIZES:
        fine = changes(at, size * h, along, wanted)
        if fine is not None and coarse is not None:
            better = {name: one for name, one in pair(at.A, fine, coarse).items() if one.halves(found.get(name))}
            found |= better
            if not better or all(one.small for one in found.values()):
                break
        coarse = fine
    return found


def pair(A: Floats, fine: Changes, coarse: Changes) -> dict[str, Gradient]:
    """Combine the derivatives at two step sizes: values of the finer one, errors from the difference."""
    found = {
        name: told(value, abs(value - coarse.numbers[name]))
        for name, value in fine.numbers.items()
        if name in coarse.numbers
    }
    return found | {"spectral_radius": of_radius(A, fine.A, coarse.A - fine.A)}


class Changes(NamedTuple):
    """Derivatives of gait quantities and of A (d, d) by the parameter."""

    numbers: dict[str, float]
    A: Floats


def along_family(at: Standpoint, h: float, guess: Floats) -> Floats | None:
    """Return the derivative of the gait's z (d,) by the parameter, from steps near z along a guess of it.

    On compliant ground a step from z itself would not do for a walker of other dimensions: its foot would be in the
    air, or deep in the ground.
    """

    def led(off: float) -> Floats | None:
        step = at.step_map.step(at.z + off * guess, at.p + off, derived=False)
        return step.z if step.outcome is Outcome.WALKED else None

    moved = slope_of(led, h)
    return None if moved is None else np.asarray(np.linalg.solve(np.eye(guess.size) - at.A, moved - at.A @ guess))


def changes(at: Standpoint, h: float, guess: Floats, wanted: Collection[str]) -> Changes | None:
    """Compute difference quotients of step h along the family; None if neighbouring steps fail."""
    along = along_family(at, h, guess)
    if along is None:
        return None

    @cache
    def beside(off: float) -> tuple[Standpoint, MappedStep]:
        step = at.step_map.step(at.z + off * along, at.p + off)
        return at._replace(z=at.z + off * along, p=at.p + off, A=step.DP), step

    def of_step(off: float) -> Floats | None:
        _, step = beside(off)
        return np.append(own_numbers(step), step.DP) if step.outcome is Outcome.WALKED else None

    def other(off: float, of: Callable[[Standpoint], tuple[float, ...] | None]) -> Floats | None:
        here, step = beside(off)
        values = of(here) if step.outcome is Outcome.WALKED else None
        return None if values is None else np.array(values)

    changed = slope_of(of_step, h)
    if changed is None:
        return None
    numbers = dict(zip(QUANTITIES, changed[:OWN].tolist(), strict=False))
    for names, of in OTHERS.items():
        slopes = None if set(names).isdisjoint(wanted) else slope_of(partial(other, of=of), h)
        numbers |= {} if slopes is None else dict(zip(names, slopes.tolist(), strict=True))
    return Changes(numbers, changed[OWN:].reshape(at.A.shape))


def told(value: float, error: float) -> Gradient:
    """Return a derivative, marked as lost if its error is comparable to its value."""
    lost = error > LOST * abs(value) and value != 0.0
    return Gradient(float(value), float(error), "lost in rounding" if lost else "")


def of_radius(A: Floats, change: Floats, error: Floats) -> Gradient:
    """Differentiate the spectral radius, given the derivative of A (d, d)."""
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
    found = (towards * (left[largest] @ change @ right[:, largest])).real
    # errors of A's elements may cancel by chance, which says nothing of the next step
    off = np.abs(left[largest]) @ np.abs(error) @ np.abs(right[:, largest])
    return told(float(found), float(off))


def relative(value: float, parameter: float, quantity: float) -> float | None:
    """Return the relative change of a quantity per relative change of the parameter; None if either is zero."""
    return None if parameter == 0.0 or math.isclose(quantity, 0.0, abs_tol=1e-300) else value * parameter / quantity
