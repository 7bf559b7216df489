"""Several numbers side by side, one of each walk, in one register of the processor: arithmetic does all at once.

A function on floats compiles for lanes too, as long as it does not branch on them: sums, products, roots, `min`, `max`
and `abs` mean what they mean for floats, lane by lane, and a float beside lanes stands for the same number in each.
Lanes never mix, so that what becomes of a walk does not depend on its neighbours. Systems with shorter registers take
several of them.

They exist in compiled code only.
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

WIDTH = 8  # doubles; what AVX-512 holds

Lanes = Any
"""A number in each lane; for annotations."""


class LanesType(types.Type):  # type: ignore[misc]
    """Type of lanes in compiled code; floats convert to it."""

    def __init__(self) -> None:
        """There is one width only."""
        super().__init__(name="lanes")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:  # noqa: ARG002 - numba calls it so
        """Floats may."""
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None

    def unify(self, typingctx: Any, other: Any) -> Any:  # noqa: ARG002 - numba calls it so
        """A variable that is a float here and lanes there is lanes."""
        return self if isinstance(other, types.Float | types.Integer) else None


LANES = LanesType()
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


def spread_over(builder: Any, value: Any) -> Any:
    """A value as lanes: itself, or the same number in each."""
    if value.type == VECTOR:
        return value
    nothing = ir.Constant(VECTOR, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, nothing, everywhere)


def _as_lanes(context: Any, builder: Any, value: Any, kind: Any) -> Any:
    if holds_lanes(kind):
        return value
    return spread_over(builder, context.cast(builder, value, kind, types.float64))


@lower_cast(types.Float, LanesType)
@lower_cast(types.Integer, LanesType)
def _cast(context: Any, builder: Any, kind: Any, _to: Any, value: Any) -> Any:
    return _as_lanes(context, builder, value, kind)


def holds_lanes(kind: Any) -> bool:
    """Whether a type of numba's is that of lanes, or of a tuple of them."""
    return isinstance(kind, LanesType) or (isinstance(kind, types.UniTuple) and isinstance(kind.dtype, LanesType))


def _number(kind: Any) -> bool:
    return isinstance(kind, LanesType | types.Float | types.Integer)


def _define(function: Callable[..., Any], build: Callable[..., Any], arguments: Any) -> None:
    """Have a function of numbers work on lanes; `build` gets the builder and the arguments, all of them lanes."""

    class LaneTemplate(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, given: Any, named: Any) -> Any:
            if named or not all(_number(kind) for kind in given) or LANES not in given:
                return None
            return signature(LANES, *(LANES for _ in given))

    infer_global(function)(LaneTemplate)

    def generate(_context: Any, builder: Any, _signature: Any, lanes: Any) -> Any:
        return build(builder, *lanes)

    lower_builtin(function, *arguments)(generate)


def _instruction_of(name: str) -> Callable[..., Any]:
    """One of LLVM's own instructions."""
    return lambda builder, one, other: getattr(builder, name)(one, other)


def _called(name: str) -> Callable[..., Any]:
    """An intrinsic of LLVM on lanes."""

    def build(builder: Any, *lanes: Any) -> Any:
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(lanes))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
        return builder.call(function, lanes)

    return build


def _pairwise(name: str) -> Callable[..., Any]:
    """An intrinsic of two arguments, for as many as there are."""
    both = _called(name)

    def build(builder: Any, first: Any, *rest: Any) -> Any:
        for lanes in rest:
            first = both(builder, first, lanes)
        return first

    return build


def multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    """a b + c rounded once, of floats or of lanes."""
    return _called("fma")(builder, a, b, c) if a.type == VECTOR else builder.fma(a, b, c)


@functools.cache
def teach_arithmetic() -> None:
    """Register arithmetic on lanes with numba, before the first kernel that does any is compiled.

    Operators are registered for all that a process compiles, so not by an import alone.
    """
    one, two, some = (LANES,), (LANES, LANES), (types.VarArg(LANES),)
    for plain, in_place, instruction in (
        (operator.add, operator.iadd, "fadd"),
        (operator.sub, operator.isub, "fsub"),
        (operator.mul, operator.imul, "fmul"),
        (operator.truediv, operator.itruediv, "fdiv"),
    ):
        for each in (plain, in_place):
            _define(each, _instruction_of(instruction), two)
    _define(operator.neg, lambda builder, a: builder.fneg(a), one)
    _define(abs, _called("fabs"), one)
    _define(math.sqrt, _called("sqrt"), one)
    _define(min, _pairwise("minnum"), some)
    _define(max, _pairwise("maxnum"), some)


@intrinsic
def nearest(context: Any, x: Any) -> Any:
    """The nearest whole number in each lane."""
    if not isinstance(x, LanesType):
        return None

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return _called("rint")(builder, arguments[0])

    return LANES(LANES), generate


@intrinsic
def choose(context: Any, sign: Any, one: Any, other: Any) -> Any:
    """`one` in lanes where `sign` is positive, `other` in the others, also where `sign` is not a number."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        sign, one, other = (
            _as_lanes(context, builder, value, kind) for value, kind in zip(arguments, sig.args, strict=True)
        )
        positive = builder.fcmp_ordered(">", sign, ir.Constant(VECTOR, [0.0] * WIDTH))
        return builder.select(positive, one, other)

    return LANES(sign, one, other), generate


@intrinsic
def any_positive(context: Any, x: Any) -> Any:
    """Whether a lane is positive."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        positive = builder.fcmp_ordered(">", arguments[0], ir.Constant(VECTOR, [0.0] * WIDTH))
        mask = builder.bitcast(positive, ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", mask, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(LANES), generate


def _place(context: Any, builder: Any, array_type: Any, array: Any, row: Any) -> Any:
    """Address of a row of a contiguous array (rows, WIDTH)."""
    data = context.make_array(array_type)(context, builder, array).data
    element = builder.gep(data, [builder.mul(row, ir.Constant(row.type, WIDTH))])
    return builder.bitcast(element, VECTOR.as_pointer())


@intrinsic
def load_lanes(context: Any, array: Any, row: Any) -> Any:
    """Row `row` of a contiguous array (rows, WIDTH)."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, sig.args[0], *arguments), align=8)

    return LANES(array, types.intp), generate


@intrinsic
def store_lanes(context: Any, value: Any, array: Any, row: Any) -> Any:
    """Write lanes into row `row` of a contiguous array (rows, WIDTH)."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        lanes = _as_lanes(context, builder, arguments[0], sig.args[0])
        builder.store(lanes, _place(context, builder, sig.args[1], *arguments[1:]), align=8)
        return context.get_dummy_value()

    return types.void(value, array, types.intp), generate
