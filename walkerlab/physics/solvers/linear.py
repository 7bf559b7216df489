"""Small dense linear systems, solved in place without leaving compiled code."""

from typing import Any

from numba import types

from walkerlab.physics.kernels import PART_FLAGS, compile_as, kernel_part


def reciprocal(x: Any) -> Any:
    return 1.0 / x


def complex_reciprocal(x: Any) -> Any:
    """Compute 1 / x by Smith's formulas. The result equals Python's to the last bit.

    Numba's own division would be a function call.
    """
    if abs(x.real) >= abs(x.imag):
        ratio = x.imag / x.real
        whole = x.real + x.imag * ratio
        return complex(1.0 / whole, -ratio / whole)
    ratio = x.real / x.imag
    whole = x.real * ratio + x.imag
    return complex(ratio / whole, -1.0 / whole)


compile_as(reciprocal, lambda x: (complex_reciprocal if isinstance(x, types.Complex) else reciprocal, PART_FLAGS))


@kernel_part
def size(x: Any) -> float:
    """Compute |Re x| + |Im x|, which is enough to choose pivots and needs no square root."""
    return abs(x.real) + abs(x.imag)


@kernel_part
def factor(A: Any, pivots: Any, n: int) -> bool:
    """Compute LU factors of real or complex A[:n, :n] in place, with row exchanges.

    Returns False if the matrix is singular.
    """
    # The diagonal holds the pivots' reciprocals.
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if size(A[i, k]) > size(A[best, k]):
                best = i
        pivots[k] = best
        if A[best, k] == 0.0:
            return False
        if best != k:
            for j in range(n):
                A[k, j], A[best, j] = A[best, j], A[k, j]
        A[k, k] = reciprocal(A[k, k])
        for i in range(k + 1, n):
            A[i, k] *= A[k, k]
            multiple = A[i, k]
            if multiple != 0.0:
                for j in range(k + 1, n):
                    A[i, j] -= multiple * A[k, j]
    return True


@kernel_part
def solve(A: Any, pivots: Any, b: Any, first: int, n: int) -> None:
    """Solve A x = b with factors from `factor`. The solution overwrites b[first : first + n]."""
    # All exchanges come first, because `factor` has exchanged whole rows.
    for k in range(n):
        best = pivots[k]
        if best != k:
            b[first + k], b[first + best] = b[first + best], b[first + k]
    for i in range(1, n):
        total = b[first + i]
        for j in range(i):
            total -= A[i, j] * b[first + j]
        b[first + i] = total
    for i in range(n - 1, -1, -1):
        total = b[first + i]
        for j in range(i + 1, n):
            total -= A[i, j] * b[first + j]
        b[first + i] = total * A[i, i]
