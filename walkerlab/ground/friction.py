"""Tangential force of the ground: ADAMS's Coulomb friction without true stick, or none."""

from typing import Any, NamedTuple

from walkerlab.ground.smooth_step import smooth_step
from walkerlab.kernels import by_type


class Coulomb(NamedTuple):
    """ADAMS's contact friction 'Coulomb: on', SI."""

    static: float  # [mu_s] at the stiction velocity
    dynamic: float  # [mu_d] from the friction velocity on
    stiction_velocity: float  # [v_s] m/s
    friction_velocity: float  # [v_d] m/s


class Frictionless(NamedTuple):
    """A ground that pushes but does not hold."""


@by_type
def friction_coefficient(law: Any, slip: float) -> tuple[float, float]:
    """Tangential over normal force at a slip velocity (m/s), against the slip, and its derivative (s/m)."""


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


@friction_coefficient.case(Frictionless)
def no_coefficient(law: Frictionless, slip: float) -> tuple[float, float]:
    """Nothing."""
    return 0.0, 0.0
