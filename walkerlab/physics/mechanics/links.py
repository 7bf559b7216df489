"""Bodies that follow others: a locked shank follows its thigh, a torso the bisector of the legs.

If the angles are theta = E z with a constant E, then M alpha = r becomes E^T M E dz = E^T r, where dz holds the
accelerations of z. The system keeps its size: a follower's row and column are added to those of the bodies that it
follows, and its own equation becomes trivial. A follower's row of E holds its weights, with zero on the diagonal; all
other rows are those of the unit matrix. A model has an E for each phase.
"""

from typing import Any, NamedTuple

from walkerlab.physics.kernels import forced_inline


class CountedModel(NamedTuple):
    """Model whose number of bodies is known only at run time, with the fields that the functions below read."""

    # If the type fixes the number, the compiler unrolls the loops, which then take little more than half the time.

    E: Any  # (phases, n, n)
    arm_x: Any  # (n,)


@forced_inline
def expand(model: Any, phase: int, z: Any) -> None:
    """Replace z (n,) by E z: compute each follower's value from those of the bodies it follows."""
    n = len(model.arm_x)
    for c in range(n):
        if model.E[phase, c, c] == 0.0:
            total = 0.0
            for p in range(n):
                total += model.E[phase, c, p] * z[p]
            z[c] = total


@forced_inline
def factor_linked(model: Any, phase: int, M: Any) -> None:
    """Replace M (n, n) by the factors of E^T M E = L D L^T: 1/D on the diagonal, L^T above it."""
    n = len(model.arm_x)
    for c in range(n):
        if model.E[phase, c, c] == 0.0:
            for p in range(n):
                for l in range(n):
                    M[p, l] += model.E[phase, c, p] * M[c, l]
            for p in range(n):
                for l in range(n):
                    M[l, p] += model.E[phase, c, p] * M[l, c]
            for l in range(n):
                M[c, l], M[l, c] = 0.0, 0.0
            M[c, c] = 1.0
    for k in range(n):
        M[k, k] = 1.0 / M[k, k]
        for i in range(k + 1, n):
            M[k, i] = M[i, k] * M[k, k]
            for j in range(k + 1, i + 1):
                M[i, j] -= M[k, i] * M[j, k]


@forced_inline
def solve_linked(model: Any, phase: int, factors: Any, b: Any) -> None:
    """Replace the right-hand side r in b (n,) by the solution E dz, using the factors from `factor_linked`."""
    # A torque on a follower acts on the bodies it follows.
    n = len(model.arm_x)
    for c in range(n):
        if model.E[phase, c, c] == 0.0:
            for p in range(n):
                b[p] += model.E[phase, c, p] * b[c]
            b[c] = 0.0
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= factors[k, i] * b[k]
    for k in range(n - 1, -1, -1):
        b[k] *= factors[k, k]
        for j in range(k + 1, n):
            b[k] -= factors[k, j] * b[j]
    expand(model, phase, b)
