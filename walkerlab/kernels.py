"""How physics becomes machine code: compiled functions, bodies chosen by type, and where the code is cached.

Numba's own cache does not notice that a called function in another file changed, so the cache folder is keyed by
a digest of all sources that kernels can be made of: an edited function can never run stale. The folder serves this
package's kernels alone: what another program compiles with Numba stays where that program has it.
"""

import contextlib
import functools
import gc
import hashlib
import importlib
import os
import re
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, overload, register_jitable
from numba.np.arrayobj import make_array, populate_array

# the only packages in which compiled functions may stand (a test says so)
KERNEL_HOMES = ("solvers", "mechanics", "ground", "hybrid", "orbits")
KEPT_GENERATIONS = 8
UNUSED_S = 30 * 86_400.0  # an older generation that no process has begun to use for so long is nobody's
# No licence to contract or reorder: code compiled twice computes the same to the last bit.
# No counting of references (_nrt): kernels allocate nothing and borrow all arrays from their caller, and counting takes
# as long as the arithmetic.
FLAGS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"nsz"}, "_nrt": False}
# parts of a kernel are never entered from outside
PART_FLAGS: dict[str, Any] = {**FLAGS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "nopython": True}
# of what takes lanes: handing them on in memory costs as much as the work
WOVEN_FLAGS: dict[str, Any] = {**PART_FLAGS, "forceinline": True}
# thresholds of the garbage collector while compiling, which makes objects by the million and leaves few behind: at the
# usual ones a quarter of the time goes into looking them through
SELDOM = (100_000, 50, 100)

F = TypeVar("F", bound=Callable[..., Any])

watchers: list[Callable[[str], None]] = []
"""Told the name of the kernel that this process compiles, or waits for, and '' once none is."""
compiling: list[tuple["KernelCache", str]] = []
"""The kernels that this process is compiling, with their signatures; each is called by the one before it."""


PACKAGE = Path(__file__).parent
HOLDS_KERNELS = re.compile(r"walkerlab\.kernels|numba|\.case\(")
IMPORTS = re.compile(
    r"^[ \t]*(?:from|import)[ \t]+walkerlab\.([\w.]+)(?:[ \t]+import[ \t]+(\([^)]*\)|.*))?", re.MULTILINE
)


def kernel_sources() -> list[Path]:
    """The files that kernels can be made of: those that hold any, and what these import from the package."""
    homes = (path for home in KERNEL_HOMES for path in (PACKAGE / home).rglob("*.py"))
    waiting = [
        PACKAGE / "kernels.py",
        *(path for path in homes if HOLDS_KERNELS.search(path.read_text(encoding="utf-8"))),
    ]
    found = set(waiting)
    while waiting:
        new = set(imported_files(waiting.pop())) - found
        found |= new
        waiting.extend(new)
    return sorted(found)


def imported_files(path: Path) -> Iterator[Path]:
    """The files of the package that a source file imports, modules named behind `import` included."""
    for module, names in IMPORTS.findall(path.read_text(encoding="utf-8")):
        base = PACKAGE.joinpath(*module.split("."))
        candidates = (base, base / "__init__", *(base / name for name in re.findall(r"\w+", names)))
        yield from (file for file in (each.with_suffix(".py") for each in candidates) if file.is_file())


def sources_digest() -> str:
    """Digest (hex) of every source file that a kernel can be made of."""
    digest = hashlib.sha256()
    for path in kernel_sources():
        digest.update(str(path.relative_to(PACKAGE)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def compiled_for() -> str:
    """The processor that code is compiled for: its name, and a digest of its features."""
    name = numba.config.CPU_NAME or llvm.get_host_cpu_name()
    features = numba.config.CPU_FEATURES
    if features is None:
        features = llvm.get_host_cpu_features().flatten()
    return f"{name}-{hashlib.sha256(features.encode()).hexdigest()[:8]}"


def cache_root() -> Path:
    """The folder of all compiled code: $WALKERLAB_CACHE, else the user's cache folder, else a temporary one."""
    chosen = os.environ.get("WALKERLAB_CACHE")
    candidates = [Path(chosen)] if chosen else []
    home = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
    candidates.append(Path(home) / "walkerlab")
    for folder in candidates:
        if _writable(folder):
            return folder
    return Path(tempfile.mkdtemp(prefix="walkerlab-cache-"))


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@functools.cache
def cache_folder() -> Path:
    """This processor's folder of this state of the sources, chosen and made when this process first needs it.

    A new one takes the place of what has not been used for long.
    """
    root, host = cache_root(), compiled_for()
    folder = root / f"kernels-{sources_digest()[:16]}-py{sys.version_info.major}{sys.version_info.minor}-{host}"
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        _remove_unused(list(root.glob(f"kernels-*-{host}")))
    os.utime(folder)
    return folder


def _remove_unused(generations: list[Path]) -> None:
    """Remove those that were not used for long, beyond the latest few; a process that has one open compiles anew."""
    latest_first = sorted(((_last_used(folder), folder) for folder in generations), reverse=True)
    for last_used, folder in latest_first[KEPT_GENERATIONS:]:
        if time.time() - last_used > UNUSED_S:
            shutil.rmtree(folder, ignore_errors=True)


def _last_used(folder: Path) -> float:
    """Time (s since the epoch) at which a process last began to use a folder; now for one that has just gone."""
    try:
        return folder.stat().st_mtime
    except OSError:
        return time.time()


def nothing_compiled_yet() -> bool:
    """Whether this state of the sources has no compiled code so far: the first run on a machine, or after a change."""
    return next(cache_folder().rglob("*.nbc"), None) is None


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
JITCodeLibrary = inner_part(
    "numba.core.codegen.JITCodeLibrary",
    "codegen",
    "get_pointer_to_function",
    "_ensure_finalized",
    "_optimize_final_module",
    "_finalize_final_module",
    "_finalize_dynamic_globals",
)
Compiler = inner_part("numba.core.compiler.Compiler", "compile_extra")
CompilerBase = inner_part("numba.core.compiler.CompilerBase", "define_pipelines")
DefaultPassBuilder = inner_part("numba.core.compiler.DefaultPassBuilder", "define_nopython_pipeline")

if absent:
    warnings.warn(
        f"numba {numba.__version__} is without {', '.join(absent)}: compiling takes longer than it could, and is not "
        "told of. Results are the same; a version of numba that pyproject.toml allows compiles faster.",
        RuntimeWarning,
        stacklevel=2,
    )


class KernelLocator(UserProvidedCacheLocator):  # type: ignore[misc, valid-type]
    """Numba's locator for a folder that was chosen, which is `cache_folder`, for kernels alone."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        """The folder of a function's file."""
        super().__init__(py_func, py_file)
        self._cache_path = str(cache_folder() / self.get_suitable_cache_subpath(py_file))

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
        lock = _lock(f"{self.kernel} {signature}")
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
            with _lock(self.kernel):  # one index for all signatures
                self.stored.save_overload(signature, data)
        finally:
            self.finish(str(signature))

    def finish(self, signature: str) -> None:
        """The kernel is compiled, or cannot be."""
        lock = self._held.pop(signature, None)
        if lock is not None:
            compiling.remove((self, signature))
        _finished(lock)


def _lock(name: str) -> Any:
    """A lock between processes in the folder of compiled code."""
    # Imported here: a process that finds everything compiled takes no lock.
    from filelock import FileLock

    return FileLock(cache_folder() / f"{hashlib.sha256(name.encode()).hexdigest()[:16]}.lock")


def _finished(lock: Any) -> None:
    """Give a kernel's lock back, if it was held, and say which one is compiled on: the one that called it, or none."""
    if lock is not None:
        lock.release()
    for tell in watchers:
        tell(compiling[-1][0].kernel if compiling else "")


@contextlib.contextmanager
def watched(tell: Callable[[str], None]) -> Iterator[None]:
    """Have `tell` among the watchers of what is compiled meanwhile."""
    watchers.append(tell)
    try:
        yield
    finally:
        watchers.remove(tell)


def kernel(function: F) -> F:
    """Compile `function` on its first call and keep the machine code on disk for later processes."""
    if absent:
        return cast(F, _cached_plainly(function))
    compiled = numba.njit(pipeline_class=_KernelCompiler, **FLAGS)(function)
    # what enable_caching does, with the kernels' own folder
    compiled._cache = KernelCache(function)
    return cast(F, compiled)


def _cached_plainly(function: Callable[..., Any]) -> Any:
    """The function compiled and kept by numba's own means, in the folder of this state of the sources too."""
    compiled = numba.njit(**FLAGS)(function)
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())
    try:
        compiled.enable_caching()
    finally:
        numba.config.CACHE_DIR = usual
    return compiled


class _KernelCompiler(Compiler):  # type: ignore[misc, valid-type]
    """Numba's own compiler, with garbage collected seldom meanwhile."""

    def compile_extra(self, func: Any) -> Any:
        usual = gc.get_threshold()
        gc.set_threshold(*SELDOM)
        try:
            return super().compile_extra(func)
        except BaseException:  # whatever stops it goes on to the caller; the kernel's lock and name do not stay behind
            if compiling and compiling[-1][0].kernel == func.__name__:
                cache, signature = compiling[-1]
                cache.finish(signature)
            raise
        finally:
            gc.set_threshold(*usual)


class _WithoutEnvironment:
    """A code generator that has no place for the environment of a function whose machine code nobody asks for."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing."""


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

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _PartCompiler(CompilerBase):  # type: ignore[misc, valid-type]
    """Numba's own passes, into a library of parts."""

    def define_pipelines(self) -> list[Any]:
        state = self.state
        if state.library is None:
            state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return [DefaultPassBuilder.define_nopython_pipeline(state)]


if not absent:
    PART_FLAGS["pipeline_class"] = _PartCompiler


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
