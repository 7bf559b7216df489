"""Bodies that follow others: a locked shank follows its thigh, a torso the bisector of the legs.

If the angles are theta = E z with a constant E, then M alpha = r becomes E^T M E dz = E^T r, where dz holds the
accelerations of z. The system keeps its size: a follower's row and column are added to those of the bodies that it
follows, and its own equation becomes trivial. A follower's row of E (n, n) holds its weights, with zero on the
diagonal; all other rows are those of the unit matrix. A model has an E for each phase. If the model's type fixes n, the
compiler unrolls the loops below, which then take little more than half the time.
"""

from typing import Any

from walkerlab.physics.kernels import forced_inline


@forced_inline
def expand(E: Any, n: int, z: Any) -> None:
    """Replace z (n,) by E z: compute each follower's value from those of the bodies it follows."""
    for c in range(n):
        if E[c, c] == 0.0:
            total = 0.0
            for p in range(n):
                total += E[c, p] * z[p]
            z[c] = total


@forced_inline
def factor_linked(E: Any, n: int, M: Any) -> None:
    """Replace M (n, n) by the factors of E^T M E = L D L^T: 1/D on the diagonal, L^T above it."""
    for c in range(n):
        if E[c, c] == 0.0:
            for p in range(n):
                for l in range(n):
                    M[p, l] += E[c, p] * M[c, l]
            for p in range(n):
                for l in range(n):
                    M[l, p] += E[c, p] * M[l, c]
            for l in range(n):
                M[c, l], M[l, c] = 0.0, 0.0
            M[c, c] = 1.0
    # M is positive definite, so no row exchanges are needed.
    for k in range(n):
        M[k, k] = 1.0 / M[k, k]
        for i in range(k + 1, n):
            M[k, i] = M[i, k] * M[k, k]
            for j in range(k + 1, i + 1):
                M[i, j] -= M[k, i] * M[j, k]


@forced_inline
def solve_linked(E: Any, n: int, factors: Any, b: Any) -> None:
    """Replace the right-hand side r in b (n,) by the solution E dz, using the factors from `factor_linked`."""
    # A torque on a follower acts on the bodies it follows.
    for c in range(n):
        if E[c, c] == 0.0:
            for p in range(n):
                b[p] += E[c, p] * b[c]
            b[c] = 0.0
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= factors[k, i] * b[k]
    for k in range(n - 1, -1, -1):
        b[k] *= factors[k, k]
        for j in range(k + 1, n):
            b[k] -= factors[k, j] * b[j]
    expand(E, n, b)
