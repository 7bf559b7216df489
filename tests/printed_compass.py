"""Released mass matrix, energies, forces and feet of the compass as Appendix A prints them, for all tests."""

import math

import numpy as np

from walkerlab.evidence.paper.appendix_a import accelerations, swing_constants
from walkerlab.physics.mechanics.trigonometry import sine_cosine


def released_mass_matrix(L, a, m, M_H, theta_1, theta_2):
    """Return D_e from (A.9) to (A.24). Its rows are the angles, then the coordinates of the stance foot."""
    b, K = L - a, L * m + a * m + L * M_H
    s_1, c_1, s_2, c_2 = math.sin(theta_1), math.cos(theta_1), math.sin(theta_2), math.cos(theta_2)
    coupling = -m * L * b * math.cos(theta_2 - theta_1)
    return np.array(
        [
            [m * b**2, coupling, b * m * c_1, b * m * s_1],
            [coupling, L**2 * M_H + L**2 * m + a**2 * m, -c_2 * K, -s_2 * K],
            [b * m * c_1, -c_2 * K, M_H + 2 * m, 0.0],
            [b * m * s_1, -s_2 * K, 0.0, M_H + 2 * m],
        ]
    )


def kinetic_energy(walker, theta_1, theta_2, omega_1, omega_2):
    """Return the kinetic energy (J), half of dq' D dq."""
    c = swing_constants(walker)
    d12 = -c.mLb * math.cos(theta_2 - theta_1)
    return 0.5 * (c.d11 * omega_1 * omega_1 + c.d22 * omega_2 * omega_2) + d12 * omega_1 * omega_2


def potential_energy(walker, theta_1, theta_2):
    """Return the potential energy (J) above the current stance foot."""
    c = swing_constants(walker)
    return walker.gravity * (c.K * math.cos(theta_2) - c.mb * math.cos(theta_1))


def ground_reaction(walker, theta_1, theta_2, omega_1, omega_2):
    """Return the force of the ground on the stance foot (N), along the slope (positive in the walking direction) and
    normal to it.

    Rows 3 and 4 of (6) with the foot held still: (A.11) to (A.16), (A.33) to (A.38).
    """
    c = swing_constants(walker)
    s1, c1 = sine_cosine(theta_1)
    s2, c2 = sine_cosine(theta_2)
    alpha_1, alpha_2 = accelerations(walker, theta_1, theta_2, omega_1, omega_2)
    w1, w2 = omega_1 * omega_1, omega_2 * omega_2
    x = c.mb * (c1 * alpha_1 - s1 * w1) - c.K * (c2 * alpha_2 - s2 * w2)
    y = c.mb * (s1 * alpha_1 + c1 * w1) - c.K * (s2 * alpha_2 + c2 * w2) + walker.gravity * c.mass
    s_phi, c_phi = math.sin(walker.slope), math.cos(walker.slope)
    return c_phi * x - s_phi * y, s_phi * x + c_phi * y


def swing_foot_height(walker, theta_1, theta_2):
    """Return the height of the swing foot above the slope (m), which is negative while it scuffs.

    It is L (cos(theta_2 + phi) - cos(theta_1 + phi)), written as a product to keep its digits near zero.
    """
    half_sum = 0.5 * (theta_1 + theta_2) + walker.slope
    return 2.0 * walker.leg_length * math.sin(half_sum) * math.sin(0.5 * (theta_1 - theta_2))


def feet_on_slope(walker, theta_1, theta_2):
    """Return theta_1 + theta_2 + 2 phi (rad), which is zero with both feet on the slope and falls through zero at heel
    strike.

    (9-2) prints theta_1 = -theta_2, which holds only for angles measured from the slope's normal.
    """
    return theta_1 + theta_2 + 2.0 * walker.slope
