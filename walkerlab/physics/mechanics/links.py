"""Bodies that follow others: a locked shank its thigh, a torso the bisector of the legs.

Angles theta = E z with a constant E turn M alpha = r into E' M E dz = E' r. The system keeps its size: a follower's
row and column are added to those of the bodies that it follows, and its own equation becomes trivial. The row of E of a
follower has its weights and zero on the diagonal, any other row is that of the unit matrix. A model has an E for each
phase.
"""

from typing import Any, NamedTuple

from walkerlab.physics.kernels import forced_inline


class CountedModel(NamedTuple):
    """Interface of models here, for one whose number of bodies is known only at run time."""

    # A model with tuples takes little more than half the time: the compiler unrolls its loops.

    E: Any  # (phases, n, n)
    arm_x: Any  # (n,)


@forced_inline
def expand(model: Any, phase: int, z: Any) -> None:
    """Replace z (n,) by E z: a follower moves with the bodies it follows."""
    n = len(model.arm_x)
    for c in range(n):
        if model.E[phase, c, c] == 0.0:
            total = 0.0
            for p in range(n):
                total += model.E[phase, c, p] * z[p]
            z[c] = total


@forced_inline
def factor_linked(model: Any, phase: int, M: Any) -> None:
    """Replace M (n, n) by the factors L D L' = E' M E: 1/D on the diagonal, L' above it."""
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
    """Replace the right-hand side b (n,) = r by E dz, with factors from `factor_linked`."""
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
