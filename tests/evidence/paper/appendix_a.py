"""Appendix A of the paper, as printed, and the same matrices from Lagrange's equations."""

from dataclasses import dataclass

import sympy as sp

L, a, m, M_H, g = sp.symbols("L a m M_H g", positive=True)
J = sp.Symbol("J", nonnegative=True)
b = L - a
t = sp.Symbol("t")
theta_1, theta_2, x, y = (sp.Function(name)(t) for name in ("theta_1", "theta_2", "x", "y"))
q = sp.Matrix([theta_1, theta_2])
q_e = sp.Matrix([theta_1, theta_2, x, y])
dq, dq_e = q.diff(t), q_e.diff(t)
w_1, w_2 = dq
PARAMETERS = (L, a, m, M_H, J, g)
K = L * m + a * m + L * M_H


def leg_masses_and_hip(foot):
    """Return the positions of (A.1) to (A.3) with the stance foot at `foot`."""
    stance_mass = foot + sp.Matrix([-a * sp.sin(theta_2), a * sp.cos(theta_2)])
    hip = foot + sp.Matrix([-L * sp.sin(theta_2), L * sp.cos(theta_2)])
    swing_mass = hip + sp.Matrix([b * sp.sin(theta_1), -b * sp.cos(theta_1)])
    return stance_mass, hip, swing_mass


def swing_foot(foot):
    _, hip, _ = leg_masses_and_hip(foot)
    return hip + sp.Matrix([L * sp.sin(theta_1), -L * sp.cos(theta_1)])


@dataclass(frozen=True)
class Equations:
    """Terms of D ddq + bias + G = 0. Here `bias` is C dq, which is the same for every choice of C."""

    D: sp.Matrix
    bias: sp.Matrix
    G: sp.Matrix


def from_lagrange(coordinates, foot):
    """Derive Lagrange's equations (2) for the point masses, with legs of inertia J."""
    rates = coordinates.diff(t)
    stance_mass, hip, swing_mass = leg_masses_and_hip(foot)
    masses = ((m, stance_mass), (M_H, hip), (m, swing_mass))
    kinetic = sum((mass * (p.diff(t).dot(p.diff(t))) for mass, p in masses), J * (w_1**2 + w_2**2)) / 2
    potential = sum(mass * g * p[1] for mass, p in masses)
    D = sp.hessian(sp.expand(kinetic), list(rates))
    G = sp.Matrix([potential.diff(coordinate) for coordinate in coordinates])
    momentum = D * rates
    bias = sp.Matrix(
        [
            momentum[i].diff(t) - (D * rates.diff(t))[i] - kinetic.diff(coordinate)
            for i, coordinate in enumerate(coordinates)
        ]
    )
    return Equations(D, bias, G)


def printed_swing():
    d = theta_2 - theta_1
    D = sp.Matrix(
        [[m * b**2, -m * L * b * sp.cos(d)], [-m * L * b * sp.cos(d), M_H * L**2 + m * (L**2 + a**2)]]
    )  # (A.4)
    C = sp.Matrix([[0, m * L * b * w_2 * sp.sin(d)], [m * L * b * w_1 * sp.sin(d), 0]])  # (A.5)
    G = sp.Matrix([m * g * b * sp.sin(theta_1), -(M_H * L + m * (a + L)) * g * sp.sin(theta_2)])  # (A.6)
    return Equations(D, C * dq, G)


def printed_impact():
    s_1, c_1, s_2, c_2 = sp.sin(theta_1), sp.cos(theta_1), sp.sin(theta_2), sp.cos(theta_2)
    coupling = -m * L * b * sp.cos(theta_2 - theta_1)
    sin_12 = sp.sin(theta_1 - theta_2)
    D = sp.Matrix(
        [
            [m * b**2, coupling, b * m * c_1, b * m * s_1],
            [coupling, L**2 * M_H + L**2 * m + a**2 * m, -c_2 * K, -s_2 * K],
            [b * m * c_1, -c_2 * K, M_H + 2 * m, 0],
            [b * m * s_1, -s_2 * K, 0, M_H + 2 * m],
        ]
    )  # (A.9) to (A.24)
    C = sp.Matrix(
        [
            [0, -m * L * b * w_2 * sin_12, 0, 0],
            [-m * L * b * w_1 * sin_12, 0, 0, 0],
            [-b * w_1 * m * s_1, w_2 * s_2 * K, 0, 0],
            [b * w_1 * m * c_1, -w_2 * c_2 * K, 0, 0],
        ]
    )  # (A.25) to (A.40)
    G = sp.Matrix([b * g * m * s_1, -g * s_2 * (L * m + a * m + L * M_H), 0, g * (M_H + 2 * m)])  # (A.8)
    return Equations(D, C * dq_e, G)


PRINTED_FOOT = sp.Matrix(
    [x + L * (sp.sin(theta_1) + sp.sin(-theta_2)), y + L * (sp.cos(theta_1) - sp.cos(-theta_2))]
)  # (A.55)


def differing(one, other):
    """Return the indices of entries in which two matrices differ, each with the difference."""
    difference = (one - other).applyfunc(lambda entry: sp.simplify(sp.expand_trig(entry)))
    indices = ((i, j) for i in range(one.rows) for j in range(one.cols))
    return {index: difference[index] for index in indices if difference[index] != 0}
