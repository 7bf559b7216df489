"""How physics becomes machine code: compiled functions, bodies chosen by type, and where the code is cached.

Numba's own cache does not notice that a called function in another file changed, so the cache folder is keyed by
a digest of all sources that kernels can be made of: an edited function can never run stale.
"""

import functools
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

# the only packages in which compiled functions may stand (a test says so)
KERNEL_HOMES = ("solvers", "mechanics", "ground", "hybrid", "orbits")
KEPT_GENERATIONS = 8
# No licence to contract or reorder: code compiled twice computes the same to the last bit.
# No counting of references (_nrt): kernels allocate nothing and borrow all arrays from their caller, and counting takes
# as long as the arithmetic.
FLAGS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"nsz"}, "_nrt": False}
# parts of a kernel are never entered from outside
PART_FLAGS: dict[str, Any] = {**FLAGS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "nopython": True}
# of what takes lanes: handing them on in memory costs as much as the work
WOVEN_FLAGS: dict[str, Any] = {**PART_FLAGS, "forceinline": True}

F = TypeVar("F", bound=Callable[..., Any])


def sources_digest() -> str:
    """Digest (hex) of every source file that a kernel can be made of."""
    root = Path(__file__).parent
    paths = [Path(__file__), *(path for home in KERNEL_HOMES for path in (root / home).rglob("*.py"))]
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


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
    """The folder of this state of the sources; older generations beyond a few are removed."""
    root = cache_root()
    folder = root / f"kernels-{sources_digest()[:16]}-py{sys.version_info.major}{sys.version_info.minor}"
    folder.mkdir(exist_ok=True)
    os.utime(folder)
    generations = sorted(root.glob("kernels-*"), key=_age, reverse=True)
    for old in generations[KEPT_GENERATIONS:]:
        shutil.rmtree(old, ignore_errors=True)
    return folder


def _age(folder: Path) -> float:
    try:
        return folder.stat().st_mtime
    except OSError:
        return 0.0


CACHE_FOLDER = _open_cache()

import numba  # noqa: E402  (the cache folder is set before anything is compiled)
from numba.extending import overload, register_jitable  # noqa: E402

numba.config.CACHE_DIR = str(CACHE_FOLDER)


def nothing_compiled_yet() -> bool:
    """Whether this state of the sources has no compiled code so far: the first run on a machine, or after a change."""
    return next(CACHE_FOLDER.rglob("*.nbc"), None) is None


def kernel(function: F) -> F:
    """Compile `function` on its first call and keep the machine code on disk for later processes."""
    compiled = numba.njit(cache=True, **FLAGS)(function)
    _forgive_unknown_types(compiled)
    return cast(F, compiled)


def _forgive_unknown_types(compiled: Any) -> None:
    """Begin a kernel's stored code anew where it was stored for types that this process cannot import.

    Numba reads the types of all that is stored with a kernel; those of another program's own systems may be unknown.
    """
    stored = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if stored is None:
        return
    load_index = stored._load_index

    def index() -> Any:
        try:
            return load_index()
        except (ImportError, AttributeError):
            return {}

    stored._load_index = index


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
        self._woven: set[type] = set()

    def __call__(self, chooser: Any, *rest: Any) -> Any:
        """Run the body for the type of `chooser`."""
        return self._bodies[type(chooser)](chooser, *rest)

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

    def body(self, kind: Any, woven: bool) -> Callable[..., Any] | None:
        """The body for numba's type of a first argument, if it is woven or is not; else None."""
        chosen = getattr(kind, "instance_class", type(None))
        return self._bodies.get(chosen) if (chosen in self._woven) == woven else None


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
