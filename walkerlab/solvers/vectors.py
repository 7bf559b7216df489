"""Small state vectors held in registers: tuples of floats, and the combinations that Runge-Kutta steps are made of.

With arrays every stage of a step waits for memory: measured, three times the time a right-hand side takes.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from walkerlab.solvers.lanes import VECTOR, multiply_add, spread_over


def _sums(builder: Any, weights: Any, vectors: Any, length: int) -> list[Any]:
    """Components of the sum of weights[j] vectors[j], as chains of fused multiply-adds."""
    columns = [cgutils.unpack_tuple(builder, vector) for vector in cgutils.unpack_tuple(builder, vectors)]
    factors = [like(builder, factor, columns[0][0]) for factor in cgutils.unpack_tuple(builder, weights)]
    sums = []
    for i in range(length):
        total = builder.fmul(factors[0], columns[0][i])
        for factor, column in zip(factors[1:], columns[1:], strict=True):
            total = multiply_add(builder, factor, column[i], total)
        sums.append(total)
    return sums


def like(builder: Any, number: Any, other: Any) -> Any:
    """A number as it is, or in each lane where `other` is lanes."""
    return spread_over(builder, number) if other.type == VECTOR else number


@intrinsic
def combine(context: Any, weights: Any, vectors: Any) -> Any:
    """Sum of weights[j] vectors[j], both tuples, as a tuple of the vectors' length."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        sums = _sums(builder, arguments[0], arguments[1], vectors.dtype.count)
        return context.make_tuple(builder, signature.return_type, sums)

    return vectors.dtype(weights, vectors), generate


@intrinsic
def shifted(context: Any, y: Any, h: Any, weights: Any, vectors: Any) -> Any:
    """The state y + h times the sum of weights[j] vectors[j]: a stage of a Runge-Kutta step."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        state, step, factors, columns = arguments
        sums = _sums(builder, factors, columns, y.count)
        start = cgutils.unpack_tuple(builder, state)
        step = like(builder, step, start[0])
        moved = [multiply_add(builder, step, total, value) for total, value in zip(sums, start, strict=True)]
        return context.make_tuple(builder, signature.return_type, moved)

    return y(y, y.dtype, weights, vectors), generate


def _element(context: Any, builder: Any, array_type: Any, array: Any, row: Any, length: int, i: int) -> Any:
    """Address of number i of row `row` in a contiguous array whose rows hold `length` numbers."""
    data = context.make_array(array_type)(context, builder, array).data
    offset = builder.mul(row, ir.Constant(row.type, length))
    return builder.gep(data, [builder.add(offset, ir.Constant(row.type, i))])


@intrinsic
def load(context: Any, array: Any, row: Any, like: Any) -> Any:
    """Row `row` of a contiguous array as a tuple; of the tuple `like` only the length matters."""
    length = like.count

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source = (context, builder, signature.args[0], arguments[0], arguments[1], length)
        items = [builder.load(_element(*source, i)) for i in range(length)]
        return context.make_tuple(builder, signature.return_type, items)

    return types.UniTuple(types.float64, length)(array, types.int64, like), generate


@intrinsic
def store(context: Any, vector: Any, array: Any, row: Any) -> Any:
    """Write a tuple into row `row` of a contiguous array."""
    length = vector.count

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target = (context, builder, signature.args[1], arguments[1], arguments[2], length)
        for i, item in enumerate(cgutils.unpack_tuple(builder, arguments[0])):
            builder.store(item, _element(*target, i))
        return context.get_dummy_value()

    return types.void(vector, array, types.int64), generate
