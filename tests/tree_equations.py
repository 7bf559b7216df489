"""Equations of motion of a tree in all coordinates, as matrices for checks.

The integrated equations eliminate the motion of the root. These do not, and they are plain NumPy.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.mechanics.parts import Anchor, Assembly, tree_about, tree_about_centre

Floats = NDArray[np.float64]


class EquationsOfMotion(NamedTuple):
    """Terms of M ddq + bias + weight = generalised forces, for q = (theta_1 .. theta_n, x, y of the root)."""

    mass_matrix: Floats  # (n + 2, n + 2) M; kg m^2, kg m, kg
    bias: Floats  # (n + 2,) velocity terms C dq; N m, N
    weight: Floats  # (n + 2,) derivatives of the potential energy, G; N m, N


def mass_matrix_and_bias(
    assembly: Assembly, root: Anchor | None, angles: Sequence[float], velocities: Sequence[float], gravity: float
) -> EquationsOfMotion:
    """Return the terms of the equations of motion of an assembly in one state. Gravity acts towards -y.

    root        the material point whose x and y are coordinates; None is the centre of mass
    angles      (n,) absolute angles of the bodies, rad
    velocities  (n,) their angular velocities, rad/s; those of the root do not enter
    gravity     m/s^2

    Raises KeyError for a root on an unknown body, ValueError for a tree that hinges do not hold together.
    """
    tree = tree_about_centre(assembly)[0] if root is None else tree_about(assembly, root)
    n = len(assembly.bodies)
    A, B, arm_x, arm_y = tree.A, tree.B, tree.arm_x, tree.arm_y
    theta, squares = np.array(angles, float), np.array(velocities, float) ** 2
    delta = theta[None, :] - theta[:, None]
    s, c = np.sin(theta), np.cos(theta)
    forward, upward = c * arm_x - s * arm_y, s * arm_x + c * arm_y

    M = np.zeros((n + 2, n + 2))
    M[:n, :n] = A * np.cos(delta) + B * np.sin(delta)
    M[:n, n] = M[n, :n] = -upward
    M[:n, n + 1] = M[n + 1, :n] = forward
    M[n, n] = M[n + 1, n + 1] = tree.mass
    turning = (B * np.cos(delta) - A * np.sin(delta)) @ squares
    bias = np.array([*turning, -forward @ squares, -upward @ squares])
    weight = gravity * np.array([*forward, 0.0, tree.mass])
    return EquationsOfMotion(M, bias, weight)
