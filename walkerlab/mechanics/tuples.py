"""Tuples as small vectors and matrices that compiled code keeps in registers."""

from typing import Any

import numpy as np
from numba.cpython.unsafe.tuple import tuple_setitem
from numba.extending import overload
from numpy.typing import NDArray

from walkerlab.kernels import PART_FLAGS, inlined
from walkerlab.solvers.lanes import holds_lanes, in_lanes

Vector = tuple[float, ...]


def numbers(values: NDArray[np.float64]) -> Vector:
    """An array as compiled code takes constants."""
    return tuple(float(value) for value in values)


def put(vector: Vector, index: int, value: float) -> Vector:
    """A copy of `vector` with one number replaced."""
    return (*vector[:index], value, *vector[index + 1 :])


@overload(put, jit_options=PART_FLAGS)
def _put(vector: Any, index: Any, value: Any) -> Any:
    def replaced(vector: Any, index: Any, value: Any) -> Any:
        return tuple_setitem(vector, index, value)

    def replaced_in_lanes(vector: Any, index: Any, value: Any) -> Any:
        return tuple_setitem(in_lanes(vector), index, value)

    return replaced_in_lanes if holds_lanes(value) and not holds_lanes(vector) else replaced


@inlined
def solve_symmetric(M: Vector, b: Vector) -> Vector:
    """Solve M x = b for a symmetric positive definite M, given row by row; only its lower half is read."""
    return solve_factored(factored(M, len(b)), b)


@inlined
def factored(M: Vector, n: int) -> Vector:
    """L D L' = M: 1/D on the diagonal, L' above it; only M's lower half is read."""
    for k in range(n):
        scale = 1.0 / M[k * n + k]
        M = put(M, k * n + k, scale)
        for i in range(k + 1, n):
            factor = M[i * n + k] * scale
            M = put(M, k * n + i, factor)
            for j in range(k + 1, i + 1):
                M = put(M, i * n + j, M[i * n + j] - factor * M[j * n + k])
    return M


@inlined
def solve_factored(factors: Vector, b: Vector) -> Vector:
    """Solve M x = b for a matrix that `factored` has taken apart."""
    n = len(b)
    for k in range(n):
        for i in range(k + 1, n):
            b = put(b, i, b[i] - factors[k * n + i] * b[k])
    for k in range(n - 1, -1, -1):
        rest = b[k] * factors[k * n + k]
        for j in range(k + 1, n):
            rest -= factors[k * n + j] * b[j]
        b = put(b, k, rest)
    return b
