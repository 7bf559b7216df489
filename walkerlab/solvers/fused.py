"""A product and a sum rounded once, where it is written and nowhere else.

A general licence to contract would let the compiler choose, and code compiled twice could differ in the last bits.
"""

from collections.abc import Callable
from typing import Any

from numba import types
from numba.extending import intrinsic, overload

from walkerlab.kernels import PART_FLAGS
from walkerlab.solvers.lanes import LANES, multiply_add


def fused(a: float, b: float, c: float) -> float:
    """a b + c, rounded once in compiled code and twice in Python."""
    return a * b + c


@intrinsic
def _fma(context: Any, a: Any, b: Any, c: Any) -> Any:
    number = LANES if LANES in (a, b, c) else types.float64

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return multiply_add(builder, *arguments)

    return number(number, number, number), generate


@overload(fused, jit_options=PART_FLAGS)
def _compiled(a: Any, b: Any, c: Any) -> Callable[..., Any]:
    def rounded_once(a: Any, b: Any, c: Any) -> Any:
        return _fma(a, b, c)

    return rounded_once
