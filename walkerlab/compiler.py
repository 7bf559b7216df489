"""Numba's compiler as kernels use it: parts without machine code of their own, and each kernel compiled by one process.

All of this leans on numba's inner parts; if one is not there, `absent` says so and numba's usual ways do.
"""

import functools
import gc
import hashlib
import importlib
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba import types

from walkerlab.kernel_cache import PACKAGE, cache_folder, lock_of, watchers

# thresholds of the garbage collector while compiling, which makes objects by the million and leaves few behind: at the
# usual ones a quarter of the time goes into looking them through
SELDOM = (100_000, 50, 100)

# passes of numba's for closures, array expressions and functions put into others by numba: kernels have none
NEEDLESS = {
    "DumpParforDiagnostics", "FindLiterallyCalls", "InlineClosureLikes", "InlineInlinables", "InlineOverloads",
    "LiteralPropagationSubPipelinePass", "LiteralUnroll", "MakeFunctionToJitFunction", "NopythonRewrites",
    "WithLifting",
}  # fmt: skip

compiling: list[tuple["KernelCache", str]] = []
"""The kernels that this process is compiling, with their signatures; each is called by the one before it."""
absent: list[str] = []
"""What of numba's inner parts is not as it is here: without it everything is compiled as numba itself does it."""


def inner_part(name: str, *members: str) -> Any:
    """A class from within numba, which any version may change; noted in `absent` if it or a member is not there."""
    module, _, kind = name.rpartition(".")
    try:
        found = getattr(importlib.import_module(module), kind)
    except (ImportError, AttributeError):
        absent.append(name)
        return object
    absent.extend(f"{name}.{member}" for member in members if not hasattr(found, member))
    return found


CompileResultCacheImpl = inner_part("numba.core.caching.CompileResultCacheImpl", "_locator_classes", "locator")
FunctionCache = inner_part("numba.core.caching.FunctionCache", "_impl_class", "load_overload", "save_overload")
IndexDataCacheFile = inner_part("numba.core.caching.IndexDataCacheFile", "_load_index")
IPythonCacheLocator = inner_part("numba.core.caching.IPythonCacheLocator", "from_function")
UserProvidedCacheLocator = inner_part(
    "numba.core.caching.UserProvidedCacheLocator", "from_function", "get_suitable_cache_subpath"
)
inner_part("numba.core.codegen.CPUCodegen", "_function_pass_manager")
JITCodeLibrary = inner_part(
    "numba.core.codegen.JITCodeLibrary",
    "codegen",
    "get_pointer_to_function",
    "_optimize_functions",
    "_ensure_finalized",
    "_optimize_final_module",
    "_finalize_final_module",
    "_finalize_dynamic_globals",
)
Compiler = inner_part("numba.core.compiler.Compiler", "compile_extra")
CompilerBase = inner_part("numba.core.compiler.CompilerBase", "define_pipelines")
Flags = inner_part("numba.core.compiler.Flags", "_values")
DefaultPassBuilder = inner_part("numba.core.compiler.DefaultPassBuilder", "define_nopython_pipeline")
Record = inner_part("numba.core.types.npytypes.Record", "mangling_args")


def named_by_layout(record: Any) -> tuple[str, tuple[str, ...]]:
    """What names a record in the symbols of machine code, in every process the same.

    Numba takes a number that it counts up in each: parts of kernels that two processes compiled for records of two
    layouts may then have one name, and a third that loads both runs one for the other.
    """
    return "Record", (hashlib.sha256(record.name.encode()).hexdigest()[:16],)


if hasattr(Record, "mangling_args"):
    Record.mangling_args = property(named_by_layout)

# With its first kernel numba loads scipy.linalg to see whether it is there, which takes longer than all of the kernels'
# code. It is; numba looks again, and loads it, where a function multiplies matrices, which those here do not.
BLAS = "scipy.linalg.cython_blas"
if BLAS not in sys.modules:
    sys.modules[BLAS] = None  # type: ignore[assignment]
    try:
        importlib.import_module("numba.np.arraymath")._HAVE_BLAS = True  # type: ignore[attr-defined]
    except ImportError:
        absent.append("numba.np.arraymath")
    finally:
        del sys.modules[BLAS]

if absent:
    warnings.warn(
        f"numba {numba.__version__} is without {', '.join(absent)}: compiling takes longer than it could, and is not "
        "told of. Results are the same; a version of numba that pyproject.toml allows compiles faster.",
        RuntimeWarning,
        stacklevel=2,
    )


class KernelLocator(UserProvidedCacheLocator):  # type: ignore[misc, valid-type]
    """Numba's locator for `cache_folder`, for kernels alone, by what their files say and not when or where they lie."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        """The folder of a function's file: for those of the package the same wherever that is installed."""
        super().__init__(py_func, py_file)
        file = Path(py_file)
        own = file.is_relative_to(PACKAGE)
        below = file.relative_to(PACKAGE).parent if own else self.get_suitable_cache_subpath(py_file)
        self._cache_path = str(cache_folder() / below)

    def get_source_stamp(self) -> str:
        """What the stored code was compiled from."""
        return hashlib.sha256(Path(self._py_file).read_bytes()).hexdigest()

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """A locator for a function in a file, whether or not a folder was chosen for all of Numba."""
        return super(UserProvidedCacheLocator, cls).from_function(py_func, py_file)


class KernelCacheImpl(CompileResultCacheImpl):  # type: ignore[misc, valid-type]
    """Results of compiling in `cache_folder`; those of a notebook's cells, which have no file, where IPython says."""

    _locator_classes = (KernelLocator, IPythonCacheLocator)


class KernelIndex(IndexDataCacheFile):  # type: ignore[misc, valid-type]
    """A kernel's stored code, begun anew where it was stored for types that this process cannot import.

    Numba reads the types of all that is stored with a kernel; those of another program's own systems may be unknown.
    """

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except (ImportError, AttributeError):
            return {}


class StoredKernel(FunctionCache):  # type: ignore[misc, valid-type]
    """A kernel's machine code on disk."""

    _impl_class = KernelCacheImpl

    def __init__(self, py_func: Any) -> None:
        """Of a Python function; makes the folder that it is in."""
        super().__init__(py_func)
        locator = self._impl.locator
        self._cache_file = KernelIndex(self._cache_path, self._impl.filename_base, locator.get_source_stamp())


class KernelCache:
    """What numba asks for a kernel's stored code: of several processes that call it at once, one compiles it."""

    def __init__(self, py_func: Any) -> None:
        """Of a Python function; nothing is opened before its first call."""
        self._function = py_func
        self.kernel = py_func.__name__
        self._held: dict[str, Any] = {}

    @functools.cached_property
    def stored(self) -> StoredKernel:
        """The code on disk."""
        return StoredKernel(self._function)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """The stored code; None if this process is to compile it, once no other does."""
        found = self.stored.load_overload(signature, context)
        if found is not None or str(signature) in self._held:
            return found
        for tell in watchers:
            tell(self.kernel)
        lock = lock_of(f"{self.kernel} {signature}")
        lock.acquire()
        found = self.stored.load_overload(signature, context)
        if found is None:
            self._held[str(signature)] = lock
            compiling.append((self, str(signature)))
        else:
            _finished(lock)
        return found

    def save_overload(self, signature: Any, data: Any) -> None:
        """Store what was compiled."""
        try:
            with lock_of(self.kernel):  # one index for all signatures
                self.stored.save_overload(signature, data)
        finally:
            self.finish(str(signature))

    def finish(self, signature: str) -> None:
        """The kernel is compiled, or cannot be."""
        lock = self._held.pop(signature, None)
        if lock is not None:
            compiling.remove((self, signature))
        _finished(lock)


def _finished(lock: Any) -> None:
    """Give a kernel's lock back, if it was held, and say which one is compiled on: the one that called it, or none."""
    if lock is not None:
        lock.release()
    for tell in watchers:
        tell(compiling[-1][0].kernel if compiling else "")


class QuickFlags(Flags):  # type: ignore[misc, valid-type]
    """How a function is compiled, told apart by what was set.

    Numba goes by flags wherever an operator is looked up, and compares all that could be set.
    """

    def __eq__(self, other: object) -> bool:
        """Whether the same was set."""
        return isinstance(other, QuickFlags) and self._values == other._values

    def __hash__(self) -> int:
        """By what was set, to whatever value."""
        return hash(frozenset(self._values))


class KernelCompiler(Compiler):  # type: ignore[misc, valid-type]
    """Numba's own compiler, with garbage collected seldom meanwhile, and loops of few turns left as they are."""

    def __init__(self, *given: Any) -> None:
        """With what numba's own is given."""
        super().__init__(*given)
        self.state.flags = QuickFlags(self.state.flags)

    def define_pipelines(self) -> list[Any]:
        """Numba's own."""
        return with_what_is_needed(super().define_pipelines())

    def compile_extra(self, func: Any) -> Any:
        """The compiled function."""
        usual, vectorized = gc.get_threshold(), numba.config.LOOP_VECTORIZE
        gc.set_threshold(*SELDOM)
        numba.config.LOOP_VECTORIZE = 0
        try:
            return super().compile_extra(func)
        except BaseException:  # whatever stops it goes on to the caller; the kernel's lock and name do not stay behind
            if compiling and compiling[-1][0].kernel == func.__name__:
                cache, signature = compiling[-1]
                cache.finish(signature)
            raise
        finally:
            gc.set_threshold(*usual)
            numba.config.LOOP_VECTORIZE = vectorized


def with_what_is_needed(pipelines: list[Any]) -> list[Any]:
    """Numba's pipelines without passes that do nothing to kernels but take time."""
    for pipeline in pipelines:
        pipeline.passes = [(each, said) for each, said in pipeline.passes if each.__name__ not in NEEDLESS]
        pipeline.finalize()
    return pipelines


class _Refreshed:
    """A context of numba's as it is: what a kernel is compiled in knows all that its parts can use."""

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def refresh(self) -> None:
        """Leave the context as the compiler of the kernel has refreshed it."""


class _TypingOfNumbers(_Refreshed):
    """A context that looks up only once what an operator or a function makes of numbers.

    Numba tries all that an operator can do with arrays, sets and strings at every place where it stands.
    """

    found: dict[Any, Any] = {}  # noqa: RUF012 - one for all parts

    def resolve_function_type(self, function: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """The signature."""
        if named or not all(isinstance(each, types.Number) for each in given):
            return self._context.resolve_function_type(function, given, named)
        if (function, given) not in self.found:
            found = self._context.resolve_function_type(function, given, named)
            if found is None:
                return None
            self.found[function, given] = found
        return self.found[function, given]


class _WithoutEnvironment:
    """A code generator that has no place for the environment of a function whose machine code nobody asks for."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Leave the environment out."""


class _PartLibrary(JITCodeLibrary):  # type: ignore[misc, valid-type]
    """The code of a part: linked into kernels, which are optimised as wholes, and no machine code of its own.

    To optimise and emit every part for itself too, as numba does, takes a third of the time that compiling takes.
    """

    @property
    def codegen(self) -> Any:
        return _WithoutEnvironment(self._codegen)

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002
        self._ensure_finalized()
        return 0

    def _optimize_functions(self, module: Any) -> None:
        """A first tidying is enough, since the kernel is optimised as a whole."""
        module.data_layout = self._codegen._data_layout
        manager, passes = self._codegen._function_pass_manager(opt=1)
        for function in module.functions:
            manager.run(function, passes)

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class PartCompiler(CompilerBase):  # type: ignore[misc, valid-type]
    """Numba's own passes, into a library of parts."""

    def __init__(self, typing: Any, target: Any, *rest: Any) -> None:
        """In contexts that the kernel's own compiler has refreshed."""
        super().__init__(_Refreshed(typing), _Refreshed(target), *rest)
        self.state.typingctx, self.state.flags = _TypingOfNumbers(typing), QuickFlags(self.state.flags)

    def define_pipelines(self) -> list[Any]:
        """The passes."""
        state = self.state
        if state.library is None:
            state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return with_what_is_needed([DefaultPassBuilder.define_nopython_pipeline(state)])


def cached_plainly(function: Callable[..., Any], flags: dict[str, Any]) -> Any:
    """The function compiled and kept by numba's own means, in the folder of this state of the sources too."""
    compiled = numba.njit(**flags)(function)
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())
    try:
        compiled.enable_caching()
    finally:
        numba.config.CACHE_DIR = usual
    return compiled
