"""Numbers of a state between tuples, which compiled code keeps in registers, and arrays."""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from walkerlab.kernels import PART_FLAGS


def load(array: Any, row: int, like: Any) -> Any:
    """Row `row` of a contiguous array as a tuple; of the tuple `like` only the length matters."""
    return tuple(np.reshape(array, (-1, len(like)))[row].tolist())


def store(vector: Any, array: Any, row: int) -> None:
    """Write a tuple into row `row` of a contiguous array."""
    np.reshape(array, (-1, len(vector)))[row] = vector


def _element(context: Any, builder: Any, array_type: Any, array: Any, row: Any, length: int, i: int) -> Any:
    """Address of number i of row `row` in a contiguous array whose rows hold `length` numbers."""
    data = context.make_array(array_type)(context, builder, array).data
    offset = builder.mul(row, ir.Constant(row.type, length))
    return builder.gep(data, [builder.add(offset, ir.Constant(row.type, i))])


@intrinsic
def _load(context: Any, array: Any, row: Any, like: Any) -> Any:
    length = like.count

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source = (context, builder, signature.args[0], arguments[0], arguments[1], length)
        items = [builder.load(_element(*source, i)) for i in range(length)]
        return context.make_tuple(builder, signature.return_type, items)

    return types.UniTuple(types.float64, length)(array, types.int64, like), generate


@intrinsic
def _store(context: Any, vector: Any, array: Any, row: Any) -> Any:
    length = vector.count

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target = (context, builder, signature.args[1], arguments[1], arguments[2], length)
        for i, item in enumerate(cgutils.unpack_tuple(builder, arguments[0])):
            builder.store(item, _element(*target, i))
        return context.get_dummy_value()

    return types.void(vector, array, types.int64), generate


@overload(load, strict=False, jit_options=PART_FLAGS)
def _compiled_load(array: Any, row: Any, like: Any) -> Callable[..., Any]:
    return lambda array, row, like: _load(array, row, like)


@overload(store, strict=False, jit_options=PART_FLAGS)
def _compiled_store(vector: Any, array: Any, row: Any) -> Callable[..., Any]:
    return lambda vector, array, row: _store(vector, array, row)
