"""Appendix A of the paper: the compass walker's equations as printed, and with C_21 corrected.

Tests check the rigid model, which is assembled from parts (physics/mechanics), against these equations. The equations
for energies, forces and the height of the foot are only in the tests. The set `as-printed` uses the printed sign.

State (theta_1 swing, theta_2 stance, dtheta_1, dtheta_2): absolute angles from the vertical, counter-clockwise
positive, rad and rad/s. The walker walks in +x, downhill for a positive slope.
"""

import math
from typing import NamedTuple

from walkerlab.config.reads import RigidConfig
from walkerlab.config.schema import Equations
from walkerlab.config.walkers import CompassWalker, is_passive_compass
from walkerlab.evidence.paper.law import as_printed
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.mechanics.trigonometry import sine_cosine
from walkerlab.physics.solvers.lanes import fused
from walkerlab.scene.parts import Arc, Limb, straight_legs

CORRECTED = -1.0
AS_PRINTED = 1.0


class RigidWalker(NamedTuple):
    """Compass walker on a slope, in SI units, with the symbols of the paper in brackets."""

    leg_length: float  # [L] m
    foot_to_mass: float  # [a] m
    leg_mass: float  # [m] kg
    hip_mass: float  # [M_H] kg
    leg_inertia: float  # [J] kg m^2, about the centre of mass of the leg
    gravity: float  # [g] m/s^2
    slope: float  # [phi] rad, positive downhill in +x
    c21_sign: float  # sign of C_21: CORRECTED, or AS_PRINTED in (A.5)


class Swing(NamedTuple):
    """Constants of (A.4) to (A.8)."""

    d11: float  # kg m^2, (A.9)
    d22: float  # kg m^2, (A.14)
    mLb: float  # kg m^2, factor of (A.10)
    mb: float  # kg m, factor of (A.11)
    K: float  # kg m, factor of (A.15)
    mass: float  # kg, (A.19)


def swing_constants(walker: RigidWalker) -> Swing:
    L, a, m, M_H, J = walker[:5]
    b = L - a
    return Swing(
        m * b * b + J, M_H * L * L + m * (L * L + a * a) + J, m * L * b, m * b, (L + a) * m + L * M_H, M_H + 2.0 * m
    )


def accelerations(
    walker: RigidWalker, theta_1: float, theta_2: float, omega_1: float, omega_2: float
) -> tuple[float, float]:
    """Return the accelerations (rad/s^2) of swing and stance leg: D^-1 (-C dq - G), (A.4) to (A.6) and (A.58)."""
    c = swing_constants(walker)
    s1, c1 = sine_cosine(theta_1)
    s2, c2 = sine_cosine(theta_2)
    sin_d = fused(s2, c1, -c2 * s1)
    cos_d = fused(c2, c1, s2 * s1)
    d12 = -c.mLb * cos_d
    r1 = fused(-c.mLb * omega_2 * omega_2, sin_d, -walker.gravity * c.mb * s1)
    r2 = fused(-walker.c21_sign * c.mLb * omega_1 * omega_1, sin_d, walker.gravity * c.K * s2)
    scale = 1.0 / fused(-d12, d12, c.d11 * c.d22)
    return fused(c.d22, r1, -d12 * r2) * scale, fused(c.d11, r2, -d12 * r1) * scale


def step_length(walker: RigidWalker, theta_1: float, theta_2: float) -> float:
    """Return the distance (m) between the feet when both are on the slope: 2 L sin((theta_2 - theta_1)/2)."""
    return 2.0 * walker.leg_length * math.sin(0.5 * (theta_2 - theta_1))


def impact_matrices(walker: RigidWalker, cos_d: float) -> tuple[float, float, float, float, float, float]:
    """Return the entries A_11, A_12, A_22, B_11, B_12, B_22 of A w+ = B w-. Legs keep their numbers in the impact.

    The entries follow from (A.57): the constraint E dq+ = 0 gives dq+ = Z w+, so Z' D_e Z w+ = Z' D_e dq- without the
    impulse. With the right sign in (A.55) they depend only on cos(theta_2 - theta_1). B_21 is 0, because the trailing
    leg keeps its angular momentum about the hip.
    """
    c = swing_constants(walker)
    L = walker.leg_length
    return (
        c.d11 - 2.0 * c.mLb + c.mass * L * L,
        (L * c.K - c.mass * L * L) * cos_d,
        c.d22 - 2.0 * L * c.K + c.mass * L * L,
        c.d11 - c.mLb,
        (L * c.K - c.mLb) * cos_d,
        c.d22 - L * c.K,
    )


def impact(
    walker: RigidWalker, theta_1: float, theta_2: float, omega_1: float, omega_2: float
) -> tuple[float, float, float, float]:
    """Return the state after the heel strike, with the roles of the legs exchanged: theta_2 is the former swing leg."""
    s1, c1 = sine_cosine(theta_1)
    s2, c2 = sine_cosine(theta_2)
    A_11, A_12, A_22, B_11, B_12, B_22 = impact_matrices(walker, c1 * c2 + s1 * s2)
    r1 = B_11 * omega_1 + B_12 * omega_2
    r2 = B_22 * omega_2
    scale = 1.0 / (A_11 * A_22 - A_12 * A_12)
    return theta_2, theta_1, (A_11 * r2 - A_12 * r1) * scale, (A_22 * r1 - A_12 * r2) * scale


def assembled(walker: RigidWalker) -> RigidModel:
    below_hip = walker.leg_length - walker.foot_to_mass
    leg = Limb(walker.leg_length, walker.leg_mass, below_hip, inertia_kg_m2=walker.leg_inertia)
    model = rigid_on_slope(straight_legs(leg, walker.hip_mass, Arc()), walker.gravity, walker.slope)
    return as_printed(model) if walker.c21_sign == AS_PRINTED else model


def compass(config: RigidConfig, equations: Equations) -> RigidWalker:
    """Return a config's passive compass as a walker of Appendix A.

    Raises ValueError for any other walker.
    """
    walker = config.walker
    if not isinstance(walker, CompassWalker) or walker.torso is not None:
        raise ValueError(f"Appendix A does not describe walkers of type {walker.type}")
    return RigidWalker(
        leg_length=walker.leg_length_m,
        foot_to_mass=walker.foot_to_mass_m,
        leg_mass=walker.leg_mass_kg,
        hip_mass=walker.hip_mass_kg,
        leg_inertia=walker.leg_inertia_kg_m2,
        gravity=config.gravity_m_s2,
        slope=config.slope_rad,
        c21_sign=AS_PRINTED if equations == "as-printed" else CORRECTED,
    )


def compass_or_none(config: RigidConfig, equations: Equations) -> RigidWalker | None:
    return compass(config, equations) if is_passive_compass(config) else None
