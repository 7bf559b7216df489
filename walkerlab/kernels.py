"""How physics becomes machine code: compiled functions, bodies chosen by type, and where the code is cached.

Numba's own cache does not notice that a called function in another file changed, so the cache folder is keyed by
a digest of all sources that kernels can be made of: an edited function can never run stale. The folder serves this
package's kernels alone: what another program compiles with Numba stays where that program has it.
"""

import functools
import hashlib
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite import binding as llvm
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    IPythonCacheLocator,
    UserProvidedCacheLocator,
)
from numba.extending import overload, register_jitable

# the only packages in which compiled functions may stand (a test says so)
KERNEL_HOMES = ("solvers", "mechanics", "ground", "hybrid", "orbits")
KEPT_GENERATIONS = 8
# No licence to contract or reorder: code compiled twice computes the same to the last bit.
# No counting of references (_nrt): kernels allocate nothing and borrow all arrays from their caller, and counting takes
# as long as the arithmetic.
FLAGS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"nsz"}, "_nrt": False}
# parts of a kernel are never entered from outside
PART_FLAGS: dict[str, Any] = {**FLAGS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "nopython": True}

F = TypeVar("F", bound=Callable[..., Any])


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


def _open_cache() -> Path:
    """This processor's folder of this state of the sources; its older generations beyond a few are removed."""
    root, host = cache_root(), compiled_for()
    folder = root / f"kernels-{sources_digest()[:16]}-py{sys.version_info.major}{sys.version_info.minor}-{host}"
    folder.mkdir(exist_ok=True)
    os.utime(folder)
    generations = sorted(root.glob(f"kernels-*-{host}"), key=_age, reverse=True)
    for old in generations[KEPT_GENERATIONS:]:
        shutil.rmtree(old, ignore_errors=True)
    return folder


def _age(folder: Path) -> float:
    try:
        return folder.stat().st_mtime
    except OSError:
        return 0.0


CACHE_FOLDER = _open_cache()


def nothing_compiled_yet() -> bool:
    """Whether this state of the sources has no compiled code so far: the first run on a machine, or after a change."""
    return next(CACHE_FOLDER.rglob("*.nbc"), None) is None


class KernelLocator(UserProvidedCacheLocator):  # type: ignore[misc]
    """Numba's locator for a folder that was chosen, which is `CACHE_FOLDER`, for kernels alone."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        """The folder of a function's file."""
        super().__init__(py_func, py_file)
        self._cache_path = str(CACHE_FOLDER / self.get_suitable_cache_subpath(py_file))

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """A locator for a function in a file, whether or not a folder was chosen for all of Numba."""
        return super(UserProvidedCacheLocator, cls).from_function(py_func, py_file)


class KernelCacheImpl(CompileResultCacheImpl):  # type: ignore[misc]
    """Results of compiling in `CACHE_FOLDER`; those of a notebook's cells, which have no file, where IPython says."""

    _locator_classes = (KernelLocator, IPythonCacheLocator)


class KernelIndex(IndexDataCacheFile):  # type: ignore[misc]
    """A kernel's stored code, begun anew where it was stored for types that this process cannot import.

    Numba reads the types of all that is stored with a kernel; those of another program's own systems may be unknown.
    """

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except (ImportError, AttributeError):
            return {}


class KernelCache(FunctionCache):  # type: ignore[misc]
    """A kernel's machine code on disk."""

    _impl_class = KernelCacheImpl

    def __init__(self, py_func: Any) -> None:
        """Of a Python function."""
        super().__init__(py_func)
        locator = self._impl.locator
        self._cache_file = KernelIndex(self._cache_path, self._impl.filename_base, locator.get_source_stamp())


def kernel(function: F) -> F:
    """Compile `function` on its first call and keep the machine code on disk for later processes."""
    compiled = numba.njit(**FLAGS)(function)
    # what enable_caching does, with the kernels' own folder
    compiled._cache = KernelCache(function)
    return cast(F, compiled)


def inlined(function: F) -> F:
    """Leave `function` as it is in Python, and compile it into the kernels that call it."""
    return cast(F, register_jitable(**PART_FLAGS)(function))


def uncompiled(compiled: F) -> F:
    """The Python function that a kernel was made of: the same source, for methods that are not compiled themselves."""
    return cast(F, cast(Any, compiled).py_func)


class ByType:
    """A function whose body is chosen by the type of its first argument, in Python and in compiled code alike."""

    def __init__(self, declaration: Callable[..., Any]) -> None:
        """Take name and documentation from `declaration`, whose own body never runs."""
        functools.update_wrapper(self, declaration)
        self._bodies: dict[type, Callable[..., Any]] = {}

    def __call__(self, chooser: Any, *rest: Any) -> Any:
        """Run the body for the type of `chooser`."""
        return self._bodies[type(chooser)](chooser, *rest)

    def case(self, chosen: type) -> Callable[[F], F]:
        """Register the decorated function as the body for first arguments of type `chosen`."""

        def register(body: F) -> F:
            self._bodies[chosen] = body
            return body

        return register


def by_type(declaration: Callable[..., Any]) -> ByType:
    """Declare a function that has one body per type of its first argument (a NamedTuple class).

    A variant that a scene does not have compiles to nothing: the choice is made while compiling.
    """
    chosen = ByType(declaration)

    def choose(*arguments: Any) -> Callable[..., Any] | None:
        return chosen._bodies.get(getattr(arguments[0], "instance_class", type(None)))

    overload(chosen, strict=False, jit_options=PART_FLAGS)(choose)
    return chosen
