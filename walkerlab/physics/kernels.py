"""Compiled functions, and functions whose bodies are chosen by the type of their first argument."""

import functools
import hashlib
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir
from numba import extending
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.np.arrayobj import make_array, populate_array

from walkerlab.physics.compiler import FLAGS, Kernel, bodies
from walkerlab.physics.compiler import PART_FLAGS as PART_FLAGS
from walkerlab.physics.compiler import classes_named_by as classes_named_by

# inlined, because passing lanes through memory costs as much as the arithmetic on them
ALWAYS_INLINE_FLAGS: dict[str, Any] = {**PART_FLAGS, "forceinline": True}
F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)


def kernel(function: F) -> F:
    """Compile `function` on its first call and keep the machine code on disk. Other kernels can also call it."""
    if numba.config.DISABLE_JIT:
        return function
    return cast(F, Kernel(function, targetoptions={"nopython": True, **FLAGS}))


def kernel_part(function: F) -> F:
    """Leave `function` as it is in Python, and compile it into the kernels that call it."""
    compile_as(function, lambda *_: (function, PART_FLAGS))
    return function


def forced_inline(function: F) -> F:
    """Declare a `kernel_part` whose code is copied into every caller, however large."""
    compile_as(function, lambda *_: (function, ALWAYS_INLINE_FLAGS))
    return function


def compile_as(function: Any, body_for: Callable[..., tuple[Callable[..., Any], dict[str, Any]]]) -> None:
    """Let compiled calls of `function` use a body chosen from the argument types. Each body is compiled once."""
    # `body_for` receives numba's types of the arguments, and returns the body and the compiler flags for it.
    parts: dict[Any, Any] = {}
    compiled: dict[Any, Any] = {}

    class Template(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, arguments: Any, keywords: Any) -> Any:
            body, flags = body_for(*arguments)
            if body not in parts:
                parts[body] = numba.njit(**flags)(body)
            called: Any = types.Dispatcher(parts[body]).get_call_type(self.context, arguments, keywords)
            compiled[called.args] = parts[body].get_overload(called.args)
            return called

        def get_impl_key(self, called: Any) -> Any:
            return compiled[called.args]

    infer_global(function, types.Function(Template))


def uncompiled(compiled: F) -> F:
    """Return the Python function of a kernel, for integration methods that are not compiled."""
    return getattr(compiled, "py_func", compiled)


class ByType:
    """Function whose body is chosen by the type of its first argument, in Python and in compiled code."""

    __name__: str

    def __init__(self, declaration: Callable[..., Any]) -> None:
        functools.update_wrapper(self, declaration)
        self._bodies: dict[type, Callable[..., Any]] = {}
        self._forced_inline: set[type] = set()
        self.default: Callable[..., Any] | None = None

    def __call__(self, chooser: Any, *rest: Any) -> Any:
        return self._body_for(type(chooser), str(type(chooser)))(chooser, *rest)

    def __contains__(self, chosen: type) -> bool:
        return chosen in self._bodies

    def case(self, chosen: type, forced_inline: bool = False) -> Callable[[F], F]:
        """Register a body for first arguments of type `chosen`. With `forced_inline` every caller gets a copy of it."""

        def register(body: F) -> F:
            self._bodies[chosen] = body
            bodies.setdefault(chosen, []).append(body)
            if forced_inline:
                self._forced_inline.add(chosen)
            return body

        return register

    def compiled_body(self, kind: Any, *_: Any) -> tuple[Callable[..., Any], dict[str, Any]]:
        # Numba's types of numbers and arrays have no `instance_class`. NoneType stands for them: no case is registered
        # for it, so they get the default body.
        chosen = getattr(kind, "instance_class", type(None))
        return self._body_for(chosen, str(kind)), ALWAYS_INLINE_FLAGS if chosen in self._forced_inline else PART_FLAGS

    def _body_for(self, chosen: type, label: str) -> Callable[..., Any]:
        body = self._bodies.get(chosen, self.default)
        if body is None:
            name = chosen.__name__ if hasattr(chosen, "_fields") else label
            # Numba rewrites only errors of its own classes, so the user sees this one unchanged.
            raise TypeError(f"{self.__name__} has no case for {name}: register one with @{self.__name__}.case(...)")
        return body


def dispatch_by_type(declaration: Callable[..., Any]) -> ByType:
    """Declare a function with one body per type of its first argument (a NamedTuple class)."""
    # The choice is made while compiling, so variants that a scene does not use cost nothing.
    chosen = ByType(declaration)
    compile_as(chosen, chosen.compiled_body)
    return chosen


def dispatch_by_type_or_default(declaration: Callable[..., Any]) -> ByType:
    """Declare a function as `dispatch_by_type` does. Other types use the body of the declaration."""
    chosen = dispatch_by_type(declaration)
    chosen.default = declaration
    return chosen


class LawKind(NamedTuple):
    """Force laws that a config key can select."""

    key: str  # last part of the key
    laws: dict[str, Any]  # classes of the built-in laws, by name in a config
    protocol: type
    required: tuple[ByType, ...]  # functions that need a case for each law
    together: tuple[ByType, ...] = ()  # a law must have a case in all of these functions or in none
    derived: bool = False  # whether a law's class must derive from `protocol`, whose fields it then has


class ByAddress(types.Type):
    """Numba's type of a NamedTuple that is passed by its address: see `pass_by_reference`."""

    def __init__(self, held: Any) -> None:
        self.held = held
        self.instance_class = held.instance_class
        super().__init__(f"reference to {held.name}")

    @property
    def mangling_args(self) -> tuple[str, tuple[()]]:
        """Short symbol name, because the full one, with all field types, would be longer than most functions."""
        return f"{self.instance_class.__name__}_{hashlib.sha256(self.name.encode()).hexdigest()[:16]}", ()


def pass_by_reference(chosen: C) -> C:
    """Let kernels pass values of a NamedTuple class by address. Python creates them, and kernels only read them."""
    # Otherwise numba turns a record of twenty arrays into a hundred arguments, and most of the compile time goes into
    # packing and unpacking them.

    def reference(value: Any, purpose: Any) -> ByAddress:
        fields = [extending.typeof_impl(field, purpose) for field in value]
        return ByAddress(types.containers.BaseTuple.from_types(fields, chosen))

    extending.typeof_impl.register(chosen)(reference)
    return chosen


@extending.register_model(ByAddress)
class _ReferenceModel(extending.models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: ByAddress) -> None:
        super().__init__(manager, kind, manager.lookup(kind.held).get_value_type().as_pointer())


@infer_getattr
class _ReferencedFields(AttributeTemplate):  # type: ignore[misc]
    key = ByAddress

    def generic_resolve(self, kind: ByAddress, name: str) -> Any:
        return kind.held[kind.held.fields.index(name)] if name in kind.held.fields else None


@extending.lower_getattr_generic(ByAddress)  # type: ignore[untyped-decorator]
def _load_field(_context: Any, builder: Any, kind: ByAddress, value: Any, name: str) -> Any:
    return builder.load(cgutils.gep_inbounds(builder, value, 0, kind.held.fields.index(name)))


@extending.unbox(ByAddress)  # type: ignore[untyped-decorator]
def _unbox_reference(kind: ByAddress, value: Any, c: Any) -> Any:
    held = c.unbox(kind.held, value)
    return extending.NativeValue(cgutils.alloca_once_value(c.builder, held.value), held.is_error, held.cleanup)


def vector(like: Any) -> Any:
    """Allocate scratch memory (n,) for the calling function, where n is the length of `like`, a tuple or an array."""
    # In Python it is filled with NaN, so that reading an entry before writing it shows up.
    return np.full(len(like), np.nan)


def matrix(like: Any) -> Any:
    """Allocate scratch memory (n, n), as `vector` does."""
    return np.full((len(like), len(like)), np.nan)


def zeros(like: Any) -> Any:
    """Return a tuple of len(like) zeros. Compiled code without reference counts cannot return arrays."""
    return (0.0,) * len(like)


@functools.cache
def _zeros(length: int) -> Callable[..., Any]:
    constant = (0.0,) * length
    return lambda _: constant


compile_as(zeros, lambda like: (_zeros(like.shape[0]), PART_FLAGS))


def _stack_memory(function: Callable[..., Any], dimensions: int) -> None:
    """Make compiled calls of `function(like)` return memory in the caller's stack frame."""
    # An intrinsic called through an overload would return memory in the overload's frame.

    class Scratch(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, arguments: Any, keywords: Any) -> Any:  # noqa: ARG002 - numba calls it so
            return signature(types.Array(types.float64, dimensions, "C"), *arguments)

    infer_global(function)(Scratch)

    def generate(context: Any, builder: Any, called: Any, _arguments: Any) -> Any:
        like = called.args[0]
        length = like.count if isinstance(like, types.containers.BaseTuple) else like.shape[0]
        number = functools.partial(context.get_constant, types.intp)
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

    extending.lower_builtin(function, types.Any)(generate)


_stack_memory(vector, 1)
_stack_memory(matrix, 2)
