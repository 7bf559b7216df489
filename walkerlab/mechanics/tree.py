"""Equations of motion of any planar tree, in absolute angles.

With sines and cosines of the angles, Delta = theta_l - theta_k:

    M_kl = A_kl cos Delta + B_kl sin Delta
    M alpha = torques + sum over l of omega_l^2 (A_kl sin Delta - B_kl cos Delta)
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.kernels import inlined
from walkerlab.mechanics.trigonometry import sine_cosine
from walkerlab.mechanics.tuples import Vector, numbers, put


class Tree(NamedTuple):
    """Constants of a tree of n bodies about its root; see assemble.py."""

    mass: float  # kg
    cosine: Vector  # (n n) A, kg m^2
    sine: Vector  # (n n) B, kg m^2
    arm_x: Vector  # (n) c, kg m: first moments about the root, zero if that is the centre of mass
    arm_y: Vector


@inlined
def sines_cosines(tree: Tree, y: Vector, first: int, tilt: float) -> tuple[Vector, Vector]:
    """Sines and cosines of the angles y[first], y[first + 1], ..., each measured from a frame tilted by -tilt (rad)."""
    s, c = tree.arm_x, tree.arm_x
    for k in range(len(tree.arm_x)):
        sine, cosine = sine_cosine(y[first + k] + tilt)
        s, c = put(s, k, sine), put(c, k, cosine)
    return s, c


@inlined
def mass_matrix(tree: Tree, s: Vector, c: Vector) -> Vector:
    """M (n n), row by row, kg m^2."""
    n = len(s)
    M = tree.cosine
    for k in range(n):
        for l in range(k):
            cos_d, sin_d = c[l] * c[k] + s[l] * s[k], s[l] * c[k] - c[l] * s[k]
            entry = tree.cosine[k * n + l] * cos_d + tree.sine[k * n + l] * sin_d
            M = put(M, k * n + l, entry)
            M = put(M, l * n + k, entry)
    return M


@inlined
def with_centrifugal(tree: Tree, s: Vector, c: Vector, y: Vector, first: int, torques: Vector) -> Vector:
    """Torques (n) and the centrifugal terms of the angular velocities y[first], ...: the right-hand side of M alpha."""
    n = len(s)
    for k in range(n):
        for l in range(k):
            cos_d, sin_d = c[l] * c[k] + s[l] * s[k], s[l] * c[k] - c[l] * s[k]
            of_l = tree.cosine[k * n + l] * sin_d - tree.sine[k * n + l] * cos_d
            of_k = tree.cosine[l * n + k] * sin_d + tree.sine[l * n + k] * cos_d
            torques = put(torques, k, torques[k] + y[first + l] * y[first + l] * of_l)
            torques = put(torques, l, torques[l] - y[first + k] * y[first + k] * of_k)
    return torques


@inlined
def tree_gradients(tree: Tree, s: Vector, c: Vector, y: Vector, first: int, alpha: Vector, J: Any) -> None:
    """Add the derivatives of (centrifugal terms - M alpha) at fixed alpha to the last n rows of J.

    The angles are y[first], y[first + 1], ...; their velocities are the last n numbers of y.
    """
    n = len(s)
    rates = len(y) - n
    for k in range(n):
        row = rates + k
        for l in range(n):
            omega = y[rates + l]
            A, B = tree.cosine[k * n + l], tree.sine[k * n + l]
            cos_d, sin_d = c[l] * c[k] + s[l] * s[k], s[l] * c[k] - c[l] * s[k]
            along = omega * omega * (A * cos_d + B * sin_d) + alpha[l] * (A * sin_d - B * cos_d)
            J[row, first + l] += along
            J[row, first + k] -= along
            J[row, rates + l] += 2.0 * omega * (A * sin_d - B * cos_d)


def merged_tree(tree: Tree, members: NDArray[np.float64]) -> Tree:
    """The tree of fewer bodies: which of them each of the n is says `members` (n, fewer), in ones and zeros."""
    n = len(members)
    A, B = np.reshape(tree.cosine, (n, n)), np.reshape(tree.sine, (n, n))
    return Tree(
        mass=tree.mass,
        cosine=numbers((members.T @ A @ members).ravel()),
        sine=numbers((members.T @ B @ members).ravel()),
        arm_x=numbers(np.array(tree.arm_x) @ members),
        arm_y=numbers(np.array(tree.arm_y) @ members),
    )
