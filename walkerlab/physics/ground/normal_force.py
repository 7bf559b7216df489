"""Normal force of the ground: the IMPACT law of ADAMS, or the law of an extension.

A law is a class that holds the law's parameters and has the members of `NormalLaw`. It needs cases of `normal_force`,
`release_function` and `elastic_energy` and, if its force has two formulas, of `switching_penetration`.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple, Protocol, Self

from walkerlab.physics.ground.resting import RestingFoot, resting_foot
from walkerlab.physics.kernels import LawKind, dispatch_by_type, dispatch_by_type_or_default, kernel_part


@kernel_part
def smooth_step(x: float, x0: float, h0: float, x1: float, h1: float) -> tuple[float, float]:
    """Evaluate STEP(x, x0, h0, x1, h1) and its derivative: h0 before x0, h1 after x1, a cubic in between.

    Source: Adams function reference, STEP.
    """
    s = (x - x0) / (x1 - x0)
    if s <= 0.0:
        return h0, 0.0
    if s >= 1.0:
        return h1, 0.0
    return h0 + (h1 - h0) * s * s * (3.0 - 2.0 * s), 6.0 * (h1 - h0) * s * (1.0 - s) / (x1 - x0)


class NormalLaw(Protocol):
    """Members that a law of the normal force needs in addition to its formulas."""

    @classmethod
    def from_contact(cls, contact: Any) -> Self:
        """Create the law from the parameters (SI) of a contact block."""

    @property
    def exponent(self) -> float:
        """Power of the penetration with which the elastic force grows."""

    def resting_foot(self, weight: float, mass: float) -> RestingFoot:
        """Return the state of a foot that carries a weight (N) and a mass (kg)."""

    def stiffen(self, stiffness: float, damping: float, penetration: float) -> Self:
        """Return the law with its stiffness, damping and switching penetration multiplied by these factors."""


class NormalForce(NamedTuple):
    """Normal force and its derivatives."""

    force: float  # N
    spring: float  # N, the elastic part
    by_penetration: float  # N/m
    by_rate: float  # N s/m


@dispatch_by_type
def normal_force(law: Any, penetration: float, penetration_rate: float) -> NormalForce:
    """Compute the normal force of a law, which is never adhesive.

    Penetration d (m) and its rate d' (m/s) are positive into the ground. Do not call it for feet with d <= 0.
    """


@dispatch_by_type
def release_function(law: Any, penetration: float, penetration_rate: float) -> float:
    """Evaluate the event function of a foot's release: it has the sign of the force before clamping at zero."""


@dispatch_by_type
def elastic_energy(law: Any, penetration: float) -> float:
    """Compute the energy (J) stored in the contact's spring, which is zero above the ground."""


@dispatch_by_type_or_default
def switching_penetration(law: Any) -> float:
    """Return the penetration (m) at which the law's formula changes, or infinity if it has a single one."""
    return math.inf


class Impact(NamedTuple):
    """Parameters of ADAMS's IMPACT law, SI (see `config.contact` for ADAMS units)."""

    stiffness: float  # [k] N/m^e
    exponent: float  # [e]
    damping: float  # [c_max] N s/m
    full_damping_penetration: float  # [d_max] m

    @classmethod
    def from_contact(cls, contact: Any) -> Impact:
        return cls(contact.stiffness, contact.exponent, contact.damping, contact.full_damping_penetration)

    def resting_foot(self, weight: float, mass: float) -> RestingFoot:
        return resting_foot(weight, mass, self.stiffness, self.exponent, self.damping)

    def stiffen(self, stiffness: float, damping: float, penetration: float) -> Impact:
        factors = (stiffness, 1.0, damping, penetration)
        return Impact(*(value * factor for value, factor in zip(self, factors, strict=True)))


@normal_force.case(Impact)
def impact_normal_force(law: Impact, penetration: float, penetration_rate: float) -> NormalForce:
    """Compute the normal force of ADAMS's IMPACT law, F = max(0, k d^e + c(d) d').

    The damping c rises from 0 at first touch to `law.damping` at `full_damping_penetration`.

    Source: Adams function reference, IMPACT.
    """
    spring = law.stiffness * penetration**law.exponent
    c, c_slope = smooth_step(penetration, 0.0, 0.0, law.full_damping_penetration, law.damping)
    force = spring + c * penetration_rate
    if force <= 0.0:
        # The elastic part stays: the energy balance needs it although the foot is released.
        return NormalForce(0.0, spring, 0.0, 0.0)
    return NormalForce(force, spring, law.exponent * spring / penetration + c_slope * penetration_rate, c)


@release_function.case(Impact)
def impact_release_function(law: Impact, penetration: float, penetration_rate: float) -> float:
    """Return the normal force before clamping, divided by a power of the penetration. It falls to zero at release."""
    # The divisor is min(d, d_max)^min(e, 2): the result has a finite slope at the surface and is nowhere steeper than
    # the force.
    full = law.full_damping_penetration
    power = min(law.exponent, 2.0)
    d = max(penetration, 0.0)
    if d >= full:
        return (law.stiffness * d**law.exponent + law.damping * penetration_rate) / full**power
    spring = law.stiffness * (d ** (law.exponent - power) if law.exponent > power else 1.0)
    # STEP is c_max (d / d_max)^2 (3 - 2 d / d_max), so d^2 divides out.
    damping = law.damping * (3.0 - 2.0 * d / full) / full**2
    return spring + damping * penetration_rate * (d ** (2.0 - power) if power < 2.0 else 1.0)


@elastic_energy.case(Impact)
def impact_elastic_energy(law: Impact, penetration: float) -> float:
    """Compute k d^(e+1) / (e+1)."""
    return law.stiffness * max(penetration, 0.0) ** (law.exponent + 1.0) / (law.exponent + 1.0)


@switching_penetration.case(Impact)
def impact_switching_penetration(law: Impact) -> float:
    return law.full_damping_penetration


NORMAL_LAWS: Final = LawKind(
    "normal_force", {"impact": Impact}, NormalLaw, (normal_force, release_function, elastic_energy)
)
"""Laws of the normal force by their names in `contact.normal_force` of a config."""
