"""The swing phase of the rigid walker as systems to integrate: alone, and with its variational equations."""

from typing import Any, NamedTuple

from walkerlab.kernels import inlined
from walkerlab.mechanics.rigid_compass import RigidWalker, accelerations, swing_constants
from walkerlab.mechanics.trigonometry import sine_cosine
from walkerlab.solvers.system import State, blank, derivative, jacobian


@blank.case(RigidWalker)
def swing_blank(system: RigidWalker) -> State:
    """Two angles and their velocities."""
    return (0.0, 0.0, 0.0, 0.0)


@derivative.case(RigidWalker)
def swing_derivative(system: RigidWalker, t: float, y: State) -> State:
    """Swing phase (4), (A.58): y = (theta_1, theta_2, dtheta_1, dtheta_2)."""
    alpha_1, alpha_2 = accelerations(system, y[0], y[1], y[2], y[3])
    return (y[2], y[3], alpha_1, alpha_2)


@inlined
def acceleration_gradients(
    walker: RigidWalker, theta_1: float, theta_2: float, omega_1: float, omega_2: float
) -> tuple[tuple[float, float, float, float], tuple[float, float, float, float]]:
    """Derivatives of both accelerations with respect to the state, from D d(ddq) = dr - dD ddq."""
    c = swing_constants(walker)
    s1, c1 = sine_cosine(theta_1)
    s2, c2 = sine_cosine(theta_2)
    sin_d = s2 * c1 - c2 * s1
    cos_d = c2 * c1 + s2 * s1
    alpha_1, alpha_2 = accelerations(walker, theta_1, theta_2, omega_1, omega_2)
    d12 = -c.mLb * cos_d
    scale = 1.0 / (c.d11 * c.d22 - d12 * d12)
    i11, i12, i22 = c.d22 * scale, -d12 * scale, c.d11 * scale
    sigma = walker.c21_sign
    # along the angle between the legs, theta_2 - theta_1
    p1 = -c.mLb * (omega_2 * omega_2 * cos_d + alpha_2 * sin_d)
    p2 = -c.mLb * (sigma * omega_1 * omega_1 * cos_d + alpha_1 * sin_d)
    # gravity, along each leg's own angle
    g1 = -walker.gravity * c.mb * c1
    g2 = walker.gravity * c.K * c2
    # along the angular velocities
    v2 = -2.0 * c.mLb * omega_2 * sin_d
    v1 = -2.0 * sigma * c.mLb * omega_1 * sin_d
    return (
        (i11 * (g1 - p1) - i12 * p2, i11 * p1 + i12 * (p2 + g2), i12 * v1, i11 * v2),
        (i12 * (g1 - p1) - i22 * p2, i12 * p1 + i22 * (p2 + g2), i22 * v1, i12 * v2),
    )


@jacobian.case(RigidWalker)
def swing_jacobian(system: RigidWalker, t: float, y: State, J: Any) -> None:
    """Derivatives of the swing phase's right-hand side."""
    row_1, row_2 = acceleration_gradients(system, y[0], y[1], y[2], y[3])
    for j in range(4):
        J[0, j], J[1, j], J[2, j], J[3, j] = 0.0, 0.0, row_1[j], row_2[j]
    J[0, 2], J[1, 3] = 1.0, 1.0


DIRECTIONS = 3
VARIATION_BLANK = (0.0,) * (4 + 4 * DIRECTIONS)


class SwingVariation(NamedTuple):
    """The swing phase together with how it changes along three directions of its starting state."""

    walker: RigidWalker


@blank.case(SwingVariation)
def variation_blank(system: SwingVariation) -> State:
    """The state and its derivative Phi (4, 3), row by row."""
    return VARIATION_BLANK


@inlined
def rate_row(gradient: State, y: State) -> State:
    """One row of J Phi."""
    g0, g1, g2, g3 = gradient
    return (
        g0 * y[4] + g1 * y[7] + g2 * y[10] + g3 * y[13],
        g0 * y[5] + g1 * y[8] + g2 * y[11] + g3 * y[14],
        g0 * y[6] + g1 * y[9] + g2 * y[12] + g3 * y[15],
    )


@derivative.case(SwingVariation)
def variation_derivative(system: SwingVariation, t: float, y: State) -> State:
    """Variational equations dPhi/dt = J Phi beside the swing phase."""
    walker = system.walker
    alpha_1, alpha_2 = accelerations(walker, y[0], y[1], y[2], y[3])
    row_1, row_2 = acceleration_gradients(walker, y[0], y[1], y[2], y[3])
    rates = (y[2], y[3], alpha_1, alpha_2)
    return rates + y[10:16] + rate_row(row_1, y) + rate_row(row_2, y)
