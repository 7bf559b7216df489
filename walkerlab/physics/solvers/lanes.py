"""Walks side by side: a vector type of compiled code with one number per walk.

One instruction serves several walks. A function of floats also compiles for lanes if it does not branch on them:
arithmetic, square roots, `min`, `max` and `abs` act on each lane, and a float combined with lanes is the same in each
lane. Lanes never mix, so a walk does not depend on its neighbours. Processors with shorter registers use several
registers for the lanes.

States are tuples of lanes, which stay in registers. `dop853` has stages for them, and `events` finds crossings on the
quintic through the ends of a step, which a repeated step then refines.

Multiply-add is fused only where the code calls for it. If the compiler could fuse operations freely, code compiled
twice could give results that differ in the last bits.
"""

import functools
import math
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

from walkerlab.physics.kernels import dispatch_by_type
from walkerlab.physics.solvers.system import State

WIDTH = 8  # doubles in a register of AVX-512

Lanes = Any
"""Annotation for a value with a number in each lane."""


class LanesType(types.Type):  # type: ignore[misc]
    """Numba's type of lanes. Floats convert to it."""

    def __init__(self) -> None:
        super().__init__(name="lanes")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:  # noqa: ARG002 - numba calls it so
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None

    def unify(self, typingctx: Any, other: Any) -> Any:  # noqa: ARG002 - numba calls it so
        """Give a variable the lanes type if it is a float on one branch and lanes on another."""
        return self if isinstance(other, types.Float | types.Integer) else None


LANES = LanesType()
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


def spread_over(builder: Any, value: Any) -> Any:
    """Return lanes unchanged, or a number repeated in every lane."""
    if value.type == VECTOR:
        return value
    undefined = ir.Constant(VECTOR, ir.Undefined)
    # LLVM's way to repeat a number: put it into one element, then shuffle.
    first = builder.insert_element(undefined, value, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, undefined, mask)


def _as_lanes(context: Any, builder: Any, value: Any, kind: Any) -> Any:
    if holds_lanes(kind):
        return value
    return spread_over(builder, context.cast(builder, value, kind, types.float64))


@lower_cast(types.Float, LanesType)
@lower_cast(types.Integer, LanesType)
def _cast(context: Any, builder: Any, kind: Any, _to: Any, value: Any) -> Any:
    return _as_lanes(context, builder, value, kind)


def holds_lanes(kind: Any) -> bool:
    return isinstance(kind, LanesType) or (isinstance(kind, types.UniTuple) and isinstance(kind.dtype, LanesType))


def _is_number(kind: Any) -> bool:
    return isinstance(kind, LanesType | types.Float | types.Integer)


def _define(function: Callable[..., Any], build: Callable[..., Any], *arguments: Any) -> None:
    """Extend a scalar function to lanes. `build` receives the IR builder and the arguments as lanes."""

    class LaneTemplate(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, given: Any, named: Any) -> Any:
            if named or not all(_is_number(kind) for kind in given) or LANES not in given:
                # None leaves all other arguments to numba's definitions.
                return None
            return signature(LANES, *(LANES for _ in given))

    infer_global(function)(LaneTemplate)

    def generate(_context: Any, builder: Any, _signature: Any, lanes: Any) -> Any:
        return build(builder, *lanes)

    lower_builtin(function, *arguments)(generate)


def _intrinsic(name: str) -> Callable[..., Any]:
    """Return a function that builds calls of an LLVM vector intrinsic."""

    def build(builder: Any, *lanes: Any) -> Any:
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(lanes))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
        return builder.call(function, lanes)

    return build


def _pairwise(name: str) -> Callable[..., Any]:
    """Extend an intrinsic of two arguments to any number of arguments."""
    both = _intrinsic(name)

    def build(builder: Any, first: Any, *rest: Any) -> Any:
        for lanes in rest:
            first = both(builder, first, lanes)
        return first

    return build


def multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    """Build a b + c, rounded once, for floats or lanes."""
    return _intrinsic("fma")(builder, a, b, c) if a.type == VECTOR else builder.fma(a, b, c)


@functools.cache
def teach_arithmetic() -> None:
    """Register arithmetic on lanes with numba. This is needed before the first kernel with lanes is compiled."""
    # This is not done on import, because it affects everything that the process compiles.
    for plain, in_place, instruction in (
        (operator.add, operator.iadd, ir.IRBuilder.fadd),
        (operator.sub, operator.isub, ir.IRBuilder.fsub),
        (operator.mul, operator.imul, ir.IRBuilder.fmul),
        (operator.truediv, operator.itruediv, ir.IRBuilder.fdiv),
    ):
        for each in (plain, in_place):
            _define(each, instruction, LANES, LANES)
    _define(operator.neg, ir.IRBuilder.fneg, LANES)
    _define(abs, _intrinsic("fabs"), LANES)
    _define(math.sqrt, _intrinsic("sqrt"), LANES)
    _define(min, _pairwise("minnum"), types.VarArg(LANES))
    _define(max, _pairwise("maxnum"), types.VarArg(LANES))


@intrinsic
def nearest(context: Any, x: Any) -> Any:
    if not isinstance(x, LanesType):
        return None

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return _intrinsic("rint")(builder, arguments[0])

    return LANES(LANES), generate


@intrinsic
def choose(context: Any, sign: Any, if_positive: Any, otherwise: Any) -> Any:
    """Select `if_positive` in lanes where `sign` is positive, and `otherwise` in all others, including NaN."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        sign, if_positive, otherwise = (
            _as_lanes(context, builder, value, kind) for value, kind in zip(arguments, sig.args, strict=True)
        )
        positive = builder.fcmp_ordered(">", sign, ir.Constant(VECTOR, [0.0] * WIDTH))
        return builder.select(positive, if_positive, otherwise)

    return LANES(sign, if_positive, otherwise), generate


@intrinsic
def any_positive(context: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        positive = builder.fcmp_ordered(">", arguments[0], ir.Constant(VECTOR, [0.0] * WIDTH))
        # One bit per lane, read as an integer.
        mask = builder.bitcast(positive, ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", mask, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(LANES), generate


def _row_pointer(context: Any, builder: Any, array_type: Any, array: Any, row: Any) -> Any:
    data = context.make_array(array_type)(context, builder, array).data
    element = builder.gep(data, [builder.mul(row, ir.Constant(row.type, WIDTH))])
    return builder.bitcast(element, VECTOR.as_pointer())


@intrinsic
def load(context: Any, array: Any, row: Any) -> Any:
    """Load row `row` of a contiguous array (rows, WIDTH)."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        # NumPy guarantees only the alignment of a double, so a load that assumes a vector's alignment could crash.
        return builder.load(_row_pointer(context, builder, sig.args[0], *arguments), align=8)

    return LANES(array, types.intp), generate


@intrinsic
def store(context: Any, value: Any, array: Any, row: Any) -> Any:
    """Store lanes in row `row` of a contiguous array (rows, WIDTH)."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        lanes = _as_lanes(context, builder, arguments[0], sig.args[0])
        builder.store(lanes, _row_pointer(context, builder, sig.args[1], *arguments[1:]), align=8)
        return context.get_dummy_value()

    return types.void(value, array, types.intp), generate


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


@dispatch_by_type
def derivative(system: Any, t: float, y: State) -> State:
    """Return dy/dt of `system` at time t (s) and state y, both tuples of numbers or lanes."""


def _sums(builder: Any, weights: Any, vectors: Any, length: int) -> list[Any]:
    """Build the sum over j of weights[j] * vectors[j], each component a chain of fused multiply-adds."""
    columns = [cgutils.unpack_tuple(builder, vector) for vector in cgutils.unpack_tuple(builder, vectors)]
    factors = [match_lanes(builder, factor, columns[0][0]) for factor in cgutils.unpack_tuple(builder, weights)]
    sums = []
    for i in range(length):
        total = builder.fmul(factors[0], columns[0][i])
        for factor, column in zip(factors[1:], columns[1:], strict=True):
            total = multiply_add(builder, factor, column[i], total)
        sums.append(total)
    return sums


def match_lanes(builder: Any, number: Any, partner: Any) -> Any:
    """Repeat a number in each lane if `partner` holds lanes."""
    return spread_over(builder, number) if partner.type == VECTOR else number


@intrinsic
def combine(context: Any, weights: Any, vectors: Any) -> Any:
    """Return the sum over j of weights[j] * vectors[j], where all vectors are tuples."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        sums = _sums(builder, arguments[0], arguments[1], vectors.dtype.count)
        return context.make_tuple(builder, signature.return_type, sums)

    return vectors.dtype(weights, vectors), generate


@intrinsic
def stage_state(context: Any, y: Any, h: Any, weights: Any, vectors: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        state, step, factors, columns = arguments
        sums = _sums(builder, factors, columns, y.count)
        start = cgutils.unpack_tuple(builder, state)
        step = match_lanes(builder, step, start[0])
        moved = [multiply_add(builder, step, total, value) for total, value in zip(sums, start, strict=True)]
        return context.make_tuple(builder, signature.return_type, moved)

    return y(y, y.dtype, weights, vectors), generate
