"""Small dense linear systems, solved in place without leaving compiled code."""

from typing import Any

from walkerlab.kernels import inlined


@inlined
def factor(A: Any, pivots: Any) -> bool:
    """LU factors of A (n, n) with row exchanges, in place; False if A is singular. Works for real and complex A."""
    n = A.shape[0]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        pivots[k] = best
        if A[best, k] == 0.0:
            return False
        if best != k:
            for j in range(n):
                A[k, j], A[best, j] = A[best, j], A[k, j]
        scale = 1.0 / A[k, k]
        for i in range(k + 1, n):
            A[i, k] *= scale
            multiple = A[i, k]
            if multiple != 0.0:
                for j in range(k + 1, n):
                    A[i, j] -= multiple * A[k, j]
    return True


@inlined
def solve(A: Any, pivots: Any, b: Any) -> None:
    """Solve with the factors from `factor`, overwriting b (n,)."""
    n = A.shape[0]
    for k in range(n):
        best = pivots[k]
        if best != k:
            b[k], b[best] = b[best], b[k]
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= A[i, k] * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]
