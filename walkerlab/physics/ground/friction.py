"""Friction laws of the ground: ADAMS's Coulomb friction without true stick, or none.

A law is a class that holds the law's parameters and has the members of `FrictionLaw`. It needs a case of
`friction_coefficient` and, if its coefficient has several formulas, cases of `switching_count` and `sample_switching`.
`FRICTION_LAWS` lists the built-in laws by name, and the `Extension` of a package lists its laws. Apart from the export
for ADAMS, which refuses the laws of packages, no other file depends on the choice of law.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple, Protocol, Self

import numpy as np

from walkerlab.physics.ground.normal_force import smooth_step
from walkerlab.physics.kernels import LawKind, dispatch_by_type, dispatch_by_type_or_default

SLOPE_SAMPLES = 101  # number of slip velocities sampled in each part of the friction coefficient, rising and falling


class FrictionLaw(Protocol):
    """Members that a friction law needs in addition to its coefficient."""

    @classmethod
    def from_contact(cls, contact: Any) -> Self:
        """Create the law from the parameters (SI) of a contact block."""

    @property
    def largest(self) -> float:
        """Maximum of the coefficient."""

    @property
    def rising_until(self) -> float:
        """Slip velocity (m/s) up to which the coefficient grows, or infinity without friction."""

    @property
    def sliding_from(self) -> float:
        """Slip velocity (m/s) above which the coefficient is constant."""

    def scale_creep(self, factor: float) -> Self:
        """Return the law with its slip velocities multiplied by a factor."""

    def describe(self) -> str:
        """Describe the law and its parameters as a phrase that can follow 'there is'."""


@dispatch_by_type
def friction_coefficient(law: Any, slip: float) -> tuple[float, float]:
    """Compute the signed ratio of friction to normal force at a slip velocity (m/s), and its derivative (s/m)."""


@dispatch_by_type_or_default
def switching_count(law: Any) -> int:
    """Return the number of event functions that mark changes of the law's formula: at most four, none by default."""
    return 0


@dispatch_by_type_or_default
def sample_switching(law: Any, slip: float, values: Any, first: int, j: int) -> None:
    """Write the event functions that `switching_count` counts, at a slip velocity (m/s), into values[first:, j]."""


class Coulomb(NamedTuple):
    """ADAMS contact friction with 'Coulomb: on', SI."""

    static: float  # [mu_s] coefficient at the stiction velocity
    dynamic: float  # [mu_d] coefficient at and above the friction velocity
    stiction_velocity: float  # [v_s] m/s
    friction_velocity: float  # [v_d] m/s

    @classmethod
    def from_contact(cls, contact: Any) -> Coulomb:
        return cls(
            contact.static_friction, contact.dynamic_friction, contact.stiction_velocity, contact.friction_velocity
        )

    @property
    def largest(self) -> float:
        return self.static

    @property
    def rising_until(self) -> float:
        return self.stiction_velocity

    @property
    def sliding_from(self) -> float:
        return self.friction_velocity

    def scale_creep(self, factor: float) -> Coulomb:
        v_s, v_d = factor * self.stiction_velocity, factor * self.friction_velocity
        return self._replace(stiction_velocity=v_s, friction_velocity=v_d)

    def describe(self) -> str:
        return (
            f"ADAMS's Coulomb friction, with a coefficient of {self.static:g} at a slip velocity of "
            f"{self.stiction_velocity:g} m/s and {self.dynamic:g} above {self.friction_velocity:g} m/s"
        )


@friction_coefficient.case(Coulomb)
def coulomb_coefficient(law: Coulomb, slip: float) -> tuple[float, float]:
    """Evaluate COULOMB_FRICTION = ON of Adams/Solver: a cubic up to v_s, another down to mu_d at v_d, then constant."""
    # The cubic passes through zero, so under a tangential load T and a normal load N a foot creeps, at about
    # v_s (T/N) / (1.5 mu_s).
    v = abs(slip)
    v_s = law.stiction_velocity
    if v < v_s:
        # One cubic, odd in the slip, covers both directions. It falls from mu_s to -mu_s, because friction opposes
        # slip.
        return smooth_step(slip, -v_s, law.static, v_s, -law.static)
    mu, slope = smooth_step(v, v_s, law.static, law.friction_velocity, law.dynamic)
    # The force and the derivative of |slip| both change sign with the slip, so the derivative of the force is -slope in
    # both directions.
    return (-mu if slip > 0.0 else mu), -slope


@switching_count.case(Coulomb)
def coulomb_switching_count(law: Coulomb) -> int:
    """Return 4: two switching velocities for each direction of slip."""
    return 4


@sample_switching.case(Coulomb)
def sample_coulomb_switching(law: Coulomb, slip: float, values: Any, first: int, j: int) -> None:
    # These are smooth in the slip. |slip| - v_s would have a kink at zero, which the polynomials of events.py cannot
    # follow.
    values[first, j] = slip - law.stiction_velocity
    values[first + 1, j] = slip + law.stiction_velocity
    values[first + 2, j] = slip - law.friction_velocity
    values[first + 3, j] = slip + law.friction_velocity


class Frictionless(NamedTuple):
    """Ground without tangential force."""

    @classmethod
    def from_contact(cls, contact: Any) -> Frictionless:  # noqa: ARG003
        return cls()

    @property
    def largest(self) -> float:
        return 0.0

    @property
    def rising_until(self) -> float:
        return math.inf

    @property
    def sliding_from(self) -> float:
        return 0.0

    def scale_creep(self, factor: float) -> Frictionless:  # noqa: ARG002
        return self

    def describe(self) -> str:
        return "no friction"


@friction_coefficient.case(Frictionless)
def no_coefficient(law: Frictionless, slip: float) -> tuple[float, float]:
    return 0.0, 0.0


FRICTION_LAWS: Final = LawKind(
    "friction",
    {"coulomb": Coulomb, "none": Frictionless},
    FrictionLaw,
    (friction_coefficient,),
    (switching_count, sample_switching),
)
"""Friction laws by their names in `contact.friction` of a config."""


def steepest_change(law: FrictionLaw, slip: float) -> float:
    """Return an upper bound on the change of the coefficient when the slip velocity changes by `slip` (m/s)."""
    if law.largest == 0.0:
        return 0.0
    # The coefficient may fall to its sliding value more steeply than it rises.
    rise = np.linspace(0.0, law.rising_until, SLOPE_SAMPLES)
    fall = np.linspace(law.rising_until, law.sliding_from, SLOPE_SAMPLES)
    steepest = max(abs(friction_coefficient(law, float(v))[1]) for v in (*rise, *fall))
    return float(min(2.0 * law.largest, slip * steepest))
