"""Compilation and caching of kernels with numba; processes that need the same kernel compile it only once.

The module uses private names of numba. If the installed version lacks some, `absent` lists them, and kernels use only
the public interface, with the same results.
"""

import contextlib
import functools
import gc
import hashlib
import importlib
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType
from typing import Any

import numba

from walkerlab.physics.kernel_cache import PACKAGE, cache_folder, lock_of, watchers
from walkerlab.private_files import make_private_folder

# Compiling makes objects by the million and leaves few behind: at Python's thresholds, looking through them takes a
# twelfth of the time.
RARE_COLLECTION = (300_000, 50, 100)
REWRITING_PASSES = ("InlineClosureLikes", "InlineOverloads", "NopythonRewrites")
compiling: list[tuple["KernelCache", str]] = []
"""Kernels that this process is compiling, with their signatures; each is called by the one before it."""
absent: list[str] = []
"""Private names that the installed numba lacks; if there are any, kernels use only its public interface."""


def private_class(name: str, *members: str) -> Any:
    """Import a private class of numba by its full name; add it, or the `members` that it lacks, to `absent`."""
    module, _, kind = name.rpartition(".")
    try:
        imported = getattr(importlib.import_module(module), kind)
    except (ImportError, AttributeError):
        absent.append(name)
        return object
    absent.extend(f"{name}.{member}" for member in members if not hasattr(imported, member))
    return imported


CompileResultCacheImpl = private_class("numba.core.caching.CompileResultCacheImpl", "_locator_classes", "locator")
FunctionCache = private_class("numba.core.caching.FunctionCache", "_impl_class", "load_overload", "save_overload")
IndexDataCacheFile = private_class("numba.core.caching.IndexDataCacheFile", "_load_index", "_open_for_write")
IPythonCacheLocator = private_class("numba.core.caching.IPythonCacheLocator", "from_function", "get_cache_path")
UserProvidedCacheLocator = private_class(
    "numba.core.caching.UserProvidedCacheLocator", "from_function", "get_suitable_cache_subpath"
)
JITCodeLibrary = private_class(
    "numba.core.codegen.JITCodeLibrary",
    "codegen",
    "get_pointer_to_function",
    "_ensure_finalized",
    "_optimize_final_module",
    "_finalize_final_module",
    "_finalize_dynamic_globals",
)
Compiler = private_class("numba.core.compiler.Compiler", "compile_extra")
CompilerBase = private_class("numba.core.compiler.CompilerBase", "define_pipelines")
Flags = private_class("numba.core.compiler.Flags", "_values")
DefaultPassBuilder = private_class("numba.core.compiler.DefaultPassBuilder", "define_nopython_pipeline")
private_class("numba.core.compiler_machinery.PassManager", "finalize")
Record = private_class("numba.core.types.npytypes.Record", "mangling_args")


def layout_symbol(record: Any) -> tuple[str, tuple[str, ...]]:
    """Return the name of a record type in the symbols of machine code; it is the same in every process."""
    # Numba uses a counter instead. Two processes can then give the same symbol to code compiled for different records,
    # and a third process that loads both would run the wrong code.
    return "Record", (hashlib.sha256(record.name.encode()).hexdigest()[:16],)


if hasattr(Record, "mangling_args"):
    Record.mangling_args = property(layout_symbol)

# For its first kernel, numba imports scipy.linalg just to see whether it is installed; that takes longer than loading
# all compiled kernels. Prevent the import and record that it is installed. Numba needs it only to multiply matrices,
# which no kernel does.
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
        f"numba {numba.__version__} lacks {', '.join(absent)}: compiling takes longer and is not reported. Results are "
        "the same; compiling is faster with a numba version allowed by pyproject.toml.",
        RuntimeWarning,
        stacklevel=2,
    )


class PrivateFolder:
    """Part of a locator that creates its folder for this user alone."""

    def ensure_cache_path(self) -> None:
        make_private_folder(Path(self.get_cache_path()))  # type: ignore[attr-defined]


class KernelLocator(PrivateFolder, UserProvidedCacheLocator):  # type: ignore[misc, valid-type]
    """Locator of kernels in `cache_folder`; it identifies a source file by its content, not by its age or folder."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        file = Path(py_file)
        own = file.is_relative_to(PACKAGE)
        below = file.relative_to(PACKAGE).parent if own else self.get_suitable_cache_subpath(py_file)
        self._cache_path = str(cache_folder() / below)

    def get_source_stamp(self) -> str:
        return hashlib.sha256(Path(self._py_file).read_bytes()).hexdigest()

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        return super(UserProvidedCacheLocator, cls).from_function(py_func, py_file)


class CellLocator(PrivateFolder, IPythonCacheLocator):  # type: ignore[misc, valid-type]
    """Locator of kernels from notebook cells."""

    def get_cache_path(self) -> str:
        return str(cache_folder() / "notebook")


class KernelCacheImpl(CompileResultCacheImpl):  # type: ignore[misc, valid-type]
    """Cache in `cache_folder` for kernels from files and from notebook cells."""

    _locator_classes = (KernelLocator, CellLocator)


class KernelIndex(IndexDataCacheFile):  # type: ignore[misc, valid-type]
    """Index of a kernel's stored code; empty if it holds types that this process cannot import."""

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        with super()._open_for_write(filepath) as file:
            os.fchmod(file.fileno(), 0o600)
            yield file

    # Numba reads the types of all stored versions of a kernel, including types that another program defined.

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except (ImportError, AttributeError):
            return {}


class StoredKernel(FunctionCache):  # type: ignore[misc, valid-type]
    _impl_class = KernelCacheImpl

    def __init__(self, py_func: Any) -> None:
        super().__init__(py_func)
        locator = self._impl.locator
        self._cache_file = KernelIndex(self._cache_path, self._impl.filename_base, locator.get_source_stamp())


class KernelCache:
    """Cache of a kernel, with numba's interface; if several processes need the kernel, only one compiles it."""

    def __init__(self, py_func: Any) -> None:
        self._function = py_func
        self.kernel = py_func.__name__
        self._locks: dict[str, Any] = {}

    @functools.cached_property
    def stored(self) -> StoredKernel:
        return StoredKernel(self._function)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Load stored code after waiting for any process that is compiling it; None if this process must compile it."""
        code = self.stored.load_overload(signature, context)
        if code is not None or str(signature) in self._locks:
            return code
        for notify in watchers:
            notify(self.kernel)
        lock = lock_of(f"{self.kernel} {signature}")
        lock.acquire()
        code = self.stored.load_overload(signature, context)
        if code is None:
            self._locks[str(signature)] = lock
            compiling.append((self, str(signature)))
        else:
            _release(lock)
        return code

    def save_overload(self, signature: Any, data: Any) -> None:
        try:
            with lock_of(self.kernel):  # all signatures share one index
                self.stored.save_overload(signature, data)
        finally:
            self.finish(str(signature))

    def finish(self, signature: str) -> None:
        lock = self._locks.pop(signature, None)
        if lock is not None:
            compiling.remove((self, signature))
        _release(lock)


def _release(lock: Any) -> None:
    """Release a kernel's lock, if any, and notify watchers of the kernel whose compilation continues."""
    if lock is not None:
        lock.release()
    for notify in watchers:
        notify(compiling[-1][0].kernel if compiling else "")


class QuickFlags(Flags):  # type: ignore[misc, valid-type]
    """Compiler flags that are equal if the same flags are set."""

    # Numba looks up operators by their flags, and its own comparison goes through all flags, even those not set.

    def __eq__(self, other: object) -> bool:
        return isinstance(other, QuickFlags) and self._values == other._values

    def __hash__(self) -> int:
        return hash(frozenset(self._values))


def drop_rewriting_passes(pipelines: list[Any], code: CodeType) -> list[Any]:
    """Drop passes that rewrite functions inside a function and array expressions, if `code` holds no functions."""
    # They take a twentieth of the compile time. Array expressions need memory, which kernels cannot allocate.
    if not any(isinstance(constant, CodeType) for constant in code.co_consts):
        for pipeline in pipelines:
            pipeline.passes = [each for each in pipeline.passes if each[0].__name__ not in REWRITING_PASSES]
            pipeline.finalize()
    return pipelines


class KernelCompiler(Compiler):  # type: ignore[misc, valid-type]
    """Numba's compiler without vectorised loops; if compilation fails, it releases the kernel's lock."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags = QuickFlags(self.state.flags)

    def define_pipelines(self) -> list[Any]:
        return drop_rewriting_passes(super().define_pipelines(), self.state.func_id.code)

    def compile_extra(self, func: Any) -> Any:
        thresholds, vectorize = gc.get_threshold(), numba.config.LOOP_VECTORIZE
        gc.set_threshold(*RARE_COLLECTION)
        numba.config.LOOP_VECTORIZE = 0
        try:
            return super().compile_extra(func)
        except BaseException:  # release the kernel's lock before any error or signal goes on to the caller
            if compiling and compiling[-1][0].kernel == func.__name__:
                cache, signature = compiling[-1]
                cache.finish(signature)
            raise
        finally:
            gc.set_threshold(*thresholds)
            numba.config.LOOP_VECTORIZE = vectorize


class _Standin:
    """Stand-in for an object of numba, with the same attributes except for those that a subclass changes."""

    def __init__(self, original: Any) -> None:
        self._original = original

    def __getattr__(self, name: str) -> Any:
        return getattr(self._original, name)


class _ResolvedOnce(_Standin):
    """Typing context that resolves each operator and function only once for the same types of arguments."""

    # Numba itself tries all overloads, even those for arrays, sets and strings, at every call.

    signatures: dict[Any, Any] = {}  # noqa: RUF012 - shared by all parts

    def resolve_function_type(self, function: Any, arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        if keywords:
            return self._original.resolve_function_type(function, arguments, keywords)
        if (function, arguments) not in self.signatures:
            resolved = self._original.resolve_function_type(function, arguments, keywords)
            if resolved is None:
                return None
            self.signatures[function, arguments] = resolved
        return self.signatures[function, arguments]


class _WithoutEnvironment(_Standin):
    """Code generator whose `set_env` does nothing: kernel parts have no machine code that could use an environment."""

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


class _PartLibrary(JITCodeLibrary):  # type: ignore[misc, valid-type]
    """Code of a kernel part; it is linked into kernels, and becomes machine code only together with them."""

    # Numba itself also optimises and emits every part separately, which takes a third of the compile time.

    @property
    def codegen(self) -> Any:
        return _WithoutEnvironment(self._codegen)

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class PartCompiler(CompilerBase):  # type: ignore[misc, valid-type]
    """Numba's compiler passes, which put the code into a `_PartLibrary`."""

    def __init__(self, typing: Any, *rest: Any) -> None:
        super().__init__(typing, *rest)
        self.state.typingctx, self.state.flags = _ResolvedOnce(typing), QuickFlags(self.state.flags)

    def define_pipelines(self) -> list[Any]:
        state = self.state
        if state.library is None:
            state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return drop_rewriting_passes([DefaultPassBuilder.define_nopython_pipeline(state)], state.func_id.code)


def cached_plainly(function: Callable[..., Any], flags: dict[str, Any]) -> Any:
    """Compile a function and cache it in `cache_folder`, using only numba's public interface."""
    compiled = numba.njit(**flags)(function)
    chosen = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())
    try:
        compiled.enable_caching()
    finally:
        numba.config.CACHE_DIR = chosen
    return compiled
