"""How physics becomes machine code: compiled functions, and functions whose bodies are chosen by type."""

import functools
import hashlib
from collections.abc import Callable
from types import CodeType
from typing import Any, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import (
    NativeValue,
    intrinsic,
    lower_builtin,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import make_array, populate_array

from walkerlab.compiler import KernelCache, KernelCompiler, PartCompiler, absent, cached_plainly

# No licence to contract or reorder: code compiled twice computes the same to the last bit.
# No counting of references (_nrt): kernels allocate nothing and borrow all arrays from their caller, and counting takes
# as long as the arithmetic.
FLAGS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"nsz"}, "_nrt": False}
# parts of a kernel are never entered from outside
PART_FLAGS: dict[str, Any] = {**FLAGS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
if not absent:
    PART_FLAGS["pipeline_class"] = PartCompiler
# of what takes lanes: handing them on in memory costs as much as the work
ALWAYS_INLINE_FLAGS: dict[str, Any] = {**PART_FLAGS, "forceinline": True}
F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)


def refuse_nested(function: Any) -> None:
    """Refuse a lambda, a comprehension or a function inside another: the passes that would compile it are left out."""
    for inner in getattr(function, "py_func", function).__code__.co_consts:
        if isinstance(inner, CodeType):
            raise TypeError(
                f"{inner.co_filename}:{inner.co_firstlineno}: {inner.co_name} inside {function.__name__}: compiled "
                "functions hold no others and no comprehensions; write a loop, or a function beside it"
            )


def kernel(function: F) -> F:
    """Compile `function` on its first call and keep the machine code on disk for later processes."""
    refuse_nested(function)
    if absent:
        return cast(F, cached_plainly(function, FLAGS))
    compiled = numba.njit(pipeline_class=KernelCompiler, **FLAGS)(function)
    # what enable_caching does, with the kernels' own folder
    compiled._cache = KernelCache(function)
    return cast(F, compiled)


def inlined(function: F) -> F:
    """Leave `function` as it is in Python, and compile it into the kernels that call it."""
    refuse_nested(function)
    compile_as(function, lambda *_: (function, PART_FLAGS))
    return function


def entered(function: F) -> F:
    """As `inlined`, and a kernel for Python: what a walk in Python hands over to compiled code at once."""
    whole = kernel(function)

    @functools.wraps(function)
    def enter(*given: Any) -> Any:
        return whole(*given)

    compile_as(enter, lambda *_: (function, PART_FLAGS))
    return cast(F, enter)


def always_inline(function: F) -> F:
    """As `inlined`, and put into the code of its callers, however large."""
    refuse_nested(function)
    compile_as(function, lambda *_: (function, ALWAYS_INLINE_FLAGS))
    return function


def compile_as(function: Any, body_for: Callable[..., tuple[Callable[..., Any], dict[str, Any]]]) -> None:
    """Have compiled code that calls `function` call another body, once compiled for all its callers.

    body_for  gives the body and how it is compiled, from numba's types of the arguments
    """
    parts: dict[Any, Any] = {}
    compiled: dict[Any, Any] = {}

    class Template(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, given: Any, named: Any) -> Any:
            body, flags = body_for(*given)
            if body not in parts:
                parts[body] = numba.njit(**flags)(body)
            found: Any = types.Dispatcher(parts[body]).get_call_type(self.context, given, named)
            compiled[found.args] = parts[body].get_overload(found.args)
            return found

        def get_impl_key(self, found: Any) -> Any:
            return compiled[found.args]

    infer_global(function, types.Function(Template))


def uncompiled(compiled: F) -> F:
    """The Python function that a kernel was made of: the same source, for methods that are not compiled themselves."""
    return cast(F, cast(Any, compiled).py_func)


class ByType:
    """A function whose body is chosen by the type of its first argument, in Python and in compiled code alike."""

    __name__: str

    def __init__(self, declaration: Callable[..., Any]) -> None:
        """Take name and documentation from `declaration`."""
        functools.update_wrapper(self, declaration)
        self._bodies: dict[type, Callable[..., Any]] = {}
        self._always_inline: set[type] = set()
        self._default: Callable[..., Any] | None = None

    def __call__(self, chooser: Any, *rest: Any) -> Any:
        """Run the body for the type of `chooser`."""
        return self._body_for(type(chooser), str(type(chooser)))(chooser, *rest)

    def __contains__(self, chosen: type) -> bool:
        """Whether a type has a body of its own."""
        return chosen in self._bodies

    def case(self, chosen: type, always_inline: bool = False) -> Callable[[F], F]:
        """Register the decorated function as the body for first arguments of type `chosen`.

        always_inline  it is put into the code of its callers, however large, and never called
        """

        def register(body: F) -> F:
            refuse_nested(body)
            self._bodies[chosen] = body
            if always_inline:
                self._always_inline.add(chosen)
            return body

        return register

    def default(self, body: F) -> F:
        """Register the decorated function as the body for first arguments of all other types."""
        self._default = body
        return body

    def compiled_body(self, kind: Any, *_: Any) -> tuple[Callable[..., Any], dict[str, Any]]:
        """The body for numba's type of a first argument, and how it is compiled."""
        chosen = getattr(kind, "instance_class", type(None))
        return self._body_for(chosen, str(kind)), ALWAYS_INLINE_FLAGS if chosen in self._always_inline else PART_FLAGS

    def _body_for(self, chosen: type, said: str) -> Callable[..., Any]:
        body = self._bodies.get(chosen, self._default)
        if body is None:
            name = chosen.__name__ if hasattr(chosen, "_fields") else said
            # an error that is not one of numba's own leaves its compiler as it is, in one line
            raise TypeError(f"{self.__name__} has no body for {name}: register one with @{self.__name__}.case(...)")
        return body


def by_type(declaration: Callable[..., Any]) -> ByType:
    """Declare a function that has one body per type of its first argument (a NamedTuple class).

    A variant that a scene does not have compiles to nothing: the choice is made while compiling.
    """
    chosen = ByType(declaration)

    compile_as(chosen, chosen.compiled_body)
    return chosen


def by_type_or_default(declaration: Callable[..., Any]) -> ByType:
    """As `by_type`, of a function whose own body runs for all types that have none."""
    chosen = by_type(declaration)
    chosen.default(declaration)
    return chosen


class ByAddress(types.Type):
    """Numba's type of a NamedTuple that is handed on by its address: see `by_reference`."""

    def __init__(self, held: Any) -> None:
        """To a NamedTuple, by numba's type of that."""
        self.held, self.instance_class = held, held.instance_class
        super().__init__(f"reference to {held.name}")

    @property
    def mangling_args(self) -> tuple[str, tuple[()]]:
        """Its name in compiled code: the whole one, with those of all fields, is longer than most functions."""
        return f"{self.instance_class.__name__}_{hashlib.sha256(self.name.encode()).hexdigest()[:16]}", ()


def by_reference(chosen: C) -> C:
    """Have kernels hand on the address of a NamedTuple, not each of its fields' numbers: made in Python, read in them.

    A function with a record of twenty arrays for an argument else takes a hundred more, and most of the time to compile
    goes into taking them apart and together.
    """

    def reference(value: Any, asked: Any) -> ByAddress:
        return ByAddress(types.containers.BaseTuple.from_types([typeof_impl(field, asked) for field in value], chosen))

    typeof_impl.register(chosen)(reference)
    return chosen


@register_model(ByAddress)
class _ReferenceModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: ByAddress) -> None:
        super().__init__(manager, kind, manager.lookup(kind.held).get_value_type().as_pointer())


@infer_getattr
class _ReferencedFields(AttributeTemplate):  # type: ignore[misc]
    key = ByAddress

    def generic_resolve(self, kind: ByAddress, name: str) -> Any:
        return kind.held[kind.held.fields.index(name)] if name in kind.held.fields else None


@lower_getattr_generic(ByAddress)  # type: ignore[untyped-decorator]
def _load_field(_context: Any, builder: Any, kind: ByAddress, value: Any, name: str) -> Any:
    return builder.load(cgutils.gep_inbounds(builder, value, 0, kind.held.fields.index(name)))


@unbox(ByAddress)  # type: ignore[untyped-decorator]
def _unbox_reference(kind: ByAddress, value: Any, c: Any) -> Any:
    held = c.unbox(kind.held, value)
    return NativeValue(cgutils.alloca_once_value(c.builder, held.value), held.is_error, held.cleanup)


def vector(like: Any) -> Any:
    """Scratch (n,) of the function that asks for it, gone when that returns; written before it is read.

    like  of length n, which its type tells: a tuple, or an array inside a structured scalar

    In Python it holds NaN, so that what is read unwritten shows.
    """
    return np.full(len(like), np.nan)


def matrix(like: Any) -> Any:
    """Scratch (n, n), as `vector`."""
    return np.full((len(like), len(like)), np.nan)


@intrinsic  # type: ignore[untyped-decorator]
def zeros(context: Any, like: Any) -> Any:  # noqa: ARG001 - numba calls it so
    """A tuple of as many zeros as `like` is long: compiled code without counted references returns no arrays."""

    def generate(context: Any, builder: Any, called: Any, _arguments: Any) -> Any:
        return context.get_constant_generic(builder, called.return_type, (0.0,) * called.return_type.count)

    return types.containers.UniTuple(types.float64, like.shape[0])(like), generate


def _on_the_stack(function: Callable[..., Any], dimensions: int) -> None:
    """Have a function of `like` give memory of its caller's frame in compiled code.

    An intrinsic behind an overload would give memory of the overload's own frame.
    """

    class Scratch(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, given: Any, named: Any) -> Any:  # noqa: ARG002 - numba calls it so
            return signature(types.Array(types.float64, dimensions, "C"), *given)

    infer_global(function)(Scratch)

    def generate(context: Any, builder: Any, called: Any, _arguments: Any) -> Any:
        like = called.args[0]
        length = like.count if isinstance(like, types.containers.BaseTuple) else like.shape[0]

        def number(value: int) -> Any:
            return context.get_constant(types.intp, value)

        memory = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), length**dimensions))
        array = make_array(called.return_type)(context, builder)
        populate_array(
            array,
            data=builder.bitcast(memory, array.data.type),
            shape=[number(length)] * dimensions,
            strides=[number(8 * length), number(8)][2 - dimensions :],
            itemsize=number(8),
            meminfo=None,
        )
        return array._getvalue()

    lower_builtin(function, types.Any)(generate)


_on_the_stack(vector, 1)
_on_the_stack(matrix, 2)
