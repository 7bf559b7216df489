"""Tangential force of the ground: ADAMS's Coulomb friction without true stick, or none.

A law is a class of its parameters with what `FrictionLaw` lists, a case of `friction_coefficient`, cases of the two
functions behind it if the coefficient follows different formulas, and a name in `FRICTION_LAWS`. Nothing outside this
file asks which law it is.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple, Protocol, Self

from walkerlab.physics.ground.smooth_step import smooth_step
from walkerlab.physics.kernels import by_type, by_type_or_default


class FrictionLaw(Protocol):
    """What a law declares beside its force."""

    @classmethod
    def of(cls, contact: Any) -> Self:
        """The law with the parameters of a contact block in SI."""

    @property
    def largest(self) -> float:
        """The largest coefficient."""

    @property
    def rising_until(self) -> float:
        """Slip velocity (m/s) up to which the coefficient grows; infinite if there is no friction."""

    @property
    def sliding_from(self) -> float:
        """Slip velocity (m/s) from which on the coefficient is that of a sliding foot."""

    def with_creep(self, factor: float) -> Self:
        """The law whose slip velocities are this many times as large."""

    def in_words(self) -> str:
        """The law with its parameters, as the end of 'there is'."""


@by_type
def friction_coefficient(law: Any, slip: float) -> tuple[float, float]:
    """Tangential over normal force at a slip velocity (m/s), against the slip, and its derivative (s/m)."""


@by_type_or_default
def switching_count(law: Any) -> int:
    """How many event functions tell where the coefficient follows another formula: at most four; none if not said."""
    return 0


@by_type_or_default
def sample_switching(law: Any, slip: float, values: Any, first: int, j: int) -> None:
    """These event functions at a slip velocity (m/s) into values[first:, j]."""


class Coulomb(NamedTuple):
    """ADAMS's contact friction 'Coulomb: on', SI."""

    static: float  # [mu_s] at the stiction velocity
    dynamic: float  # [mu_d] from the friction velocity on
    stiction_velocity: float  # [v_s] m/s
    friction_velocity: float  # [v_d] m/s

    @classmethod
    def of(cls, contact: Any) -> Coulomb:
        """The law with the parameters of a contact block in SI."""
        return cls(
            contact.static_friction,
            contact.dynamic_friction,
            contact.stiction_velocity,
            contact.friction_velocity,
        )

    @property
    def largest(self) -> float:
        """The static coefficient."""
        return self.static

    @property
    def rising_until(self) -> float:
        """The stiction velocity, m/s."""
        return self.stiction_velocity

    @property
    def sliding_from(self) -> float:
        """The friction velocity, m/s."""
        return self.friction_velocity

    def with_creep(self, factor: float) -> Coulomb:
        """The law whose slip velocities are this many times as large."""
        return self._replace(
            stiction_velocity=factor * self.stiction_velocity, friction_velocity=factor * self.friction_velocity
        )

    def in_words(self) -> str:
        """The law with its parameters, as the end of 'there is'."""
        return (
            f"Coulomb friction as ADAMS has it, with a coefficient of {self.static:g} at a slip of "
            f"{self.stiction_velocity:g} m/s and {self.dynamic:g} from {self.friction_velocity:g} m/s on"
        )


@friction_coefficient.case(Coulomb)
def coulomb_coefficient(law: Coulomb, slip: float) -> tuple[float, float]:
    """A cubic through zero up to the stiction velocity, a second down to the dynamic coefficient, constant beyond.

    A loaded foot therefore creeps, at about v_s (T/N) / (1.5 mu_s).

    Source: Adams/Solver, CONTACT statement, COULOMB_FRICTION = ON.
    """
    v, v_s = abs(slip), law.stiction_velocity
    if v < v_s:
        mu, slope = smooth_step(slip, -v_s, law.static, v_s, -law.static)
        return mu, slope
    mu, slope = smooth_step(v, v_s, law.static, law.friction_velocity, law.dynamic)
    return (-mu if slip > 0.0 else mu), -slope


@switching_count.case(Coulomb)
def coulomb_switching_count(law: Coulomb) -> int:
    """Either velocity, in either direction."""
    return 4


@sample_switching.case(Coulomb)
def sample_coulomb_switching(law: Coulomb, slip: float, values: Any, first: int, j: int) -> None:
    """The velocities at which one formula follows another."""
    values[first, j] = slip - law.stiction_velocity
    values[first + 1, j] = slip + law.stiction_velocity
    values[first + 2, j] = slip - law.friction_velocity
    values[first + 3, j] = slip + law.friction_velocity


class Frictionless(NamedTuple):
    """A ground that pushes but does not hold."""

    @classmethod
    def of(cls, contact: Any) -> Frictionless:  # noqa: ARG003
        """No parameters."""
        return cls()

    @property
    def largest(self) -> float:
        """No force at all."""
        return 0.0

    @property
    def rising_until(self) -> float:
        """Never reached."""
        return math.inf

    @property
    def sliding_from(self) -> float:
        """A foot always slides."""
        return 0.0

    def with_creep(self, factor: float) -> Frictionless:  # noqa: ARG002
        """The same: there is no creep."""
        return self

    def in_words(self) -> str:
        """As the end of 'there is'."""
        return "no friction"


@friction_coefficient.case(Frictionless)
def no_coefficient(law: Frictionless, slip: float) -> tuple[float, float]:
    """Zero."""
    return 0.0, 0.0


FRICTION_LAWS: Final[dict[str, type[FrictionLaw]]] = {"coulomb": Coulomb, "none": Frictionless}
"""The laws by the words of the config's contact.friction."""


def law_named(word: str, contact: Any) -> FrictionLaw:
    """The law of that word with the parameters of a contact block in SI.

    TypeError if the law's class is incomplete, saying what it lacks.
    """
    law = FRICTION_LAWS[word]
    missing = lacking(law)
    if missing:
        raise TypeError(f"the friction law {law.__name__} ('{word}') is incomplete: it lacks {', '.join(missing)}")
    return law.of(contact)


def lacking(law: type) -> list[str]:
    """What a law's class does not have of what `FrictionLaw` lists, and the cases that are to be registered for it."""
    asked = [name for name in vars(FrictionLaw) if not name.startswith("_")]
    missing = [name for name in asked if not hasattr(law, name)]
    switching = (switching_count, sample_switching)
    needed = (friction_coefficient, *(switching if any(law in function for function in switching) else ()))
    cases = [f"a body @{function.__name__}.case({law.__name__})" for function in needed if law not in function]
    return missing + cases


def steepest_change(law: FrictionLaw, slip: float) -> float:
    """How far the coefficient may change within a slip velocity (m/s): by its slope where the foot is at rest."""
    return min(law.largest, -slip * float(friction_coefficient(law, 0.0)[1]))
