"""How physics becomes machine code: compiled functions, and functions whose bodies are chosen by type."""

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, overload, register_jitable
from numba.np.arrayobj import make_array, populate_array

from walkerlab.compiler import KernelCache, KernelCompiler, PartCompiler, absent, cached_plainly

# No licence to contract or reorder: code compiled twice computes the same to the last bit.
# No counting of references (_nrt): kernels allocate nothing and borrow all arrays from their caller, and counting takes
# as long as the arithmetic.
FLAGS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"nsz"}, "_nrt": False}
# parts of a kernel are never entered from outside
PART_FLAGS: dict[str, Any] = {**FLAGS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "nopython": True}
# of what takes lanes: handing them on in memory costs as much as the work
WOVEN_FLAGS: dict[str, Any] = {**PART_FLAGS, "forceinline": True}
F = TypeVar("F", bound=Callable[..., Any])

if not absent:
    PART_FLAGS["pipeline_class"] = PartCompiler


def kernel(function: F) -> F:
    """Compile `function` on its first call and keep the machine code on disk for later processes."""
    if absent:
        return cast(F, cached_plainly(function, FLAGS))
    compiled = numba.njit(pipeline_class=KernelCompiler, **FLAGS)(function)
    # what enable_caching does, with the kernels' own folder
    compiled._cache = KernelCache(function)
    return cast(F, compiled)


def inlined(function: F) -> F:
    """Leave `function` as it is in Python, and compile it into the kernels that call it."""
    return cast(F, register_jitable(**PART_FLAGS)(function))


def woven(function: F) -> F:
    """As `inlined`, and put into the code of its callers, however large."""
    return cast(F, register_jitable(**WOVEN_FLAGS)(function))


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
        self._woven: set[type] = set()
        self._default: Callable[..., Any] | None = None

    def __call__(self, chooser: Any, *rest: Any) -> Any:
        """Run the body for the type of `chooser`."""
        return self._body_for(type(chooser), str(type(chooser)))(chooser, *rest)

    def __contains__(self, chosen: type) -> bool:
        """Whether a type has a body of its own."""
        return chosen in self._bodies

    def case(self, chosen: type, woven: bool = False) -> Callable[[F], F]:
        """Register the decorated function as the body for first arguments of type `chosen`.

        woven  it is put into the code of its callers, however large, and never called
        """

        def register(body: F) -> F:
            self._bodies[chosen] = body
            if woven:
                self._woven.add(chosen)
            return body

        return register

    def default(self, body: F) -> F:
        """Register the decorated function as the body for first arguments of all other types."""
        self._default = body
        return body

    def body(self, kind: Any, woven: bool) -> Callable[..., Any] | None:
        """The body for numba's type of a first argument, if it is woven or is not; else None."""
        chosen = getattr(kind, "instance_class", type(None))
        return self._body_for(chosen, str(kind)) if (chosen in self._woven) == woven else None

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

    def called(*arguments: Any) -> Callable[..., Any] | None:
        return chosen.body(arguments[0], woven=False)

    def woven(*arguments: Any) -> Callable[..., Any] | None:
        return chosen.body(arguments[0], woven=True)

    overload(chosen, strict=False, jit_options=PART_FLAGS)(called)
    overload(chosen, strict=False, jit_options=WOVEN_FLAGS)(woven)
    return chosen


def by_type_or_default(declaration: Callable[..., Any]) -> ByType:
    """As `by_type`, of a function whose own body runs for all types that have none."""
    chosen = by_type(declaration)
    chosen.default(declaration)
    return chosen


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

    class Template(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, given: Any, named: Any) -> Any:  # noqa: ARG002 - numba calls it so
            return signature(types.Array(types.float64, dimensions, "C"), *given)

    infer_global(function)(Template)

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
