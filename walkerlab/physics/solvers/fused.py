"""Fused multiply-add, used only where the code calls for it.

If the compiler could fuse operations freely, code compiled twice could give results that differ in the last bits.
"""

from typing import Any

from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from walkerlab.physics.solvers.lanes import LANES, multiply_add


def fused(a: float, b: float, c: float) -> float:
    """Compute a b + c, rounded once in compiled code and twice in Python."""
    return a * b + c


class _OneRounding(AbstractTemplate):  # type: ignore[misc]
    key = fused

    def generic(self, given: Any, named: Any) -> Any:  # noqa: ARG002 - numba calls it so
        number = LANES if LANES in given else types.float64
        return signature(number, number, number, number)


infer_global(fused, types.Function(_OneRounding))


@lower_builtin(fused, types.Any, types.Any, types.Any)
def _multiply_add(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
    return multiply_add(builder, *arguments)
