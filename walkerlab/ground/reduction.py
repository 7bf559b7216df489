"""Bodies that follow others, on compliant ground: E' M E of the form of the moment, whose bodies are counted.

`mechanics.links` has the same for a model whose number of bodies is known while compiling: with loops that the compiler
can count, walks of three bodies take little more than half the time.
"""

from typing import Any

from walkerlab.kernels import woven


@woven
def gathered(E: Any, n: int, r: Any) -> None:
    """E' r in place of r (n,), zero for the followers: what acts on a follower acts on those it follows."""
    for c in range(n):
        if E[c, c] == 0.0:
            for p in range(n):
                r[p] += E[c, p] * r[c]
            r[c] = 0.0


@woven
def spread(E: Any, n: int, z: Any) -> None:
    """E z in place of z (n,): a follower moves with those it follows."""
    for c in range(n):
        if E[c, c] == 0.0:
            total = 0.0
            for p in range(n):
                total += E[c, p] * z[p]
            z[c] = total


@woven
def factor_linked(E: Any, n: int, M: Any, r: Any) -> None:
    """E' r in place of r (n,), and L D L' = E' M E in place of M (n, n): 1/D on the diagonal, L' above it."""
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
    gathered(E, n, r)
    for k in range(n):
        M[k, k] = 1.0 / M[k, k]
        for i in range(k + 1, n):
            M[k, i] = M[i, k] * M[k, k]
            for j in range(k + 1, i + 1):
                M[i, j] -= M[k, i] * M[j, k]


@woven
def solve_linked(E: Any, n: int, factors: Any, b: Any) -> None:
    """E dz in place of b (n,) = E' r, of a matrix that `factor_linked` has taken apart."""
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= factors[k, i] * b[k]
    for k in range(n - 1, -1, -1):
        b[k] *= factors[k, k]
        for j in range(k + 1, n):
            b[k] -= factors[k, j] * b[j]
    spread(E, n, b)
