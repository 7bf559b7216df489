"""Appendix A's matrix of the walker that is free in the plane, typed from the paper once for all tests."""

import math

import numpy as np


def released_mass_matrix(L, a, m, M_H, theta_1, theta_2):
    """D_e from (A.9) to (A.24): angles, then the stance foot's coordinates."""
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
