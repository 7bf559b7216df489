"""The heel strike of the rigid walker: guard, impact map (A.57) with the change of roles, and their derivatives."""

from typing import Any

from walkerlab.kernels import inlined
from walkerlab.mechanics.rigid_compass import RigidWalker, swing_constants
from walkerlab.mechanics.trigonometry import sine_cosine


@inlined
def feet_on_slope(walker: RigidWalker, theta_1: float, theta_2: float) -> float:
    """theta_1 + theta_2 + 2 phi (rad): zero with both feet on the slope, falling through zero at heel strike.

    (9-2) prints theta_1 = -theta_2, which holds only for angles measured from the slope's normal.
    """
    return theta_1 + theta_2 + 2.0 * walker.slope


@inlined
def impact_matrices(walker: RigidWalker, cos_d: float) -> tuple[float, float, float, float, float, float]:
    """(A_11, A_12, A_22, B_11, B_12, B_22) of A w+ = B w-, angular velocities (w_1, w_2) before the change of roles.

    (A.57) with the constraint E dq+ = 0 solved first: dq+ = Z w+, so that Z' D_e Z w+ = Z' D_e dq- and the impulse
    drops out. With the right sign in (A.55) everything depends on cos(theta_2 - theta_1) alone, and B_21 = 0: the
    trailing leg keeps its angular momentum about the hip.
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


@inlined
def impact(
    walker: RigidWalker, theta_1: float, theta_2: float, omega_1: float, omega_2: float
) -> tuple[float, float, float, float]:
    """State after the heel strike, roles changed: the leg that was swinging is theta_2 now."""
    s1, c1 = sine_cosine(theta_1)
    s2, c2 = sine_cosine(theta_2)
    A_11, A_12, A_22, B_11, B_12, B_22 = impact_matrices(walker, c1 * c2 + s1 * s2)
    r1 = B_11 * omega_1 + B_12 * omega_2
    r2 = B_22 * omega_2
    scale = 1.0 / (A_11 * A_22 - A_12 * A_12)
    return theta_2, theta_1, (A_11 * r2 - A_12 * r1) * scale, (A_22 * r1 - A_12 * r2) * scale


@inlined
def impact_jacobian(
    walker: RigidWalker, theta_1: float, theta_2: float, omega_1: float, omega_2: float, J: Any
) -> None:
    """Write the derivative of `impact` with respect to the state before it into J (4, 4).

    From A dw+ = dB w- + B dw- - dA w+, with dA and dB along the angle between the legs.
    """
    s1, c1 = sine_cosine(theta_1)
    s2, c2 = sine_cosine(theta_2)
    A_11, A_12, A_22, B_11, B_12, B_22 = impact_matrices(walker, c1 * c2 + s1 * s2)
    _, dA_12, _, _, dB_12, _ = impact_matrices(walker, -(s2 * c1 - c2 * s1))
    _, _, swing_after, stance_after = impact(walker, theta_1, theta_2, omega_1, omega_2)
    scale = 1.0 / (A_11 * A_22 - A_12 * A_12)
    r1 = dB_12 * omega_2 - dA_12 * swing_after
    r2 = -dA_12 * stance_after
    along_swing = (A_11 * r2 - A_12 * r1) * scale
    along_stance = (A_22 * r1 - A_12 * r2) * scale
    for j in range(4):
        J[0, j], J[1, j] = 0.0, 0.0
    J[0, 1], J[1, 0] = 1.0, 1.0
    J[2, 0], J[2, 1] = -along_swing, along_swing
    J[3, 0], J[3, 1] = -along_stance, along_stance
    J[2, 2], J[2, 3] = -A_12 * B_11 * scale, (A_11 * B_22 - A_12 * B_12) * scale
    J[3, 2], J[3, 3] = A_22 * B_11 * scale, (A_22 * B_12 - A_12 * B_22) * scale
