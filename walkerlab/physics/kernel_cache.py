"""Files of machine code: those that the package's build compiled, and the user's cache.

The cache has a folder for each state of the sources, version of numba and processor. A digest of all sources that
kernels can use is part of the folder's name, so stale code never runs. The files of the package are used only if they
were compiled from the current sources, with the installed numba, and for a processor like this one.

Compiled code is loaded only from the package, and from folders and files that no other user may have written.
"""

import contextlib
import functools
import hashlib
import json
import os
import platform
import re
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from walkerlab.code_digest import Sources, digest_of
from walkerlab.private_files import is_foreign, is_own, make_private, make_private_folder, may_be_foreign

PHYSICS = Path(__file__).parent
PACKAGE = PHYSICS.parent
BUILT = PHYSICS / "machine_code"
"""Folder of the machine code compiled when the package was built."""
REBUILD = "`pip install --no-build-isolation --no-deps .` in the sources builds them for this environment."
ABOUT = "about.json"  # file in that folder with the properties on which the machine code depends
X86_64 = "x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sse4.1", "sse4.2")
# for each platform: the processor that builds are compiled for and the features it must have, as LLVM names them
TARGETS: dict[str, tuple[str, tuple[str, ...]]] = {
    "linux-x86_64": X86_64,
    "win32-amd64": X86_64,
    "linux-aarch64": ("generic", ("neon",)),
    "darwin-arm64": ("apple-m1", ()),
}
# Only these packages may contain compiled functions. A test checks this.
KERNEL_HOMES = ("solvers", "mechanics", "ground", "hybrid", "orbits")
# A file may register a body with `.case(` without importing `kernels`.
HOLDS_KERNELS = re.compile(rb"walkerlab\.physics\.kernels|numba|\.case\(")
KEPT_GENERATIONS = 8
UNUSED_S = 30 * 86_400.0  # older generations are deleted if no process has opened them for this long


class CacheWarning(RuntimeWarning):
    """Warning that compiled code is stored in a folder other than the chosen one."""


watchers: list[Callable[[str], None]] = []
"""Callbacks that receive the name of each kernel that this process begins to compile."""


@contextlib.contextmanager
def watch_compilation(watcher: Callable[[str], None]) -> Iterator[None]:
    """Call `watcher` with the names of kernels that are compiled within the context."""
    watchers.append(watcher)
    try:
        yield
    finally:
        watchers.remove(watcher)


def sources_digest() -> str:
    """Return the digest (hex) of all files that contain kernels and of everything that they import."""
    sources = Sources()
    homes = (path for home in KERNEL_HOMES for path in (PHYSICS / home).rglob("*.py"))
    files = (path.relative_to(PACKAGE.parent) for path in homes if HOLDS_KERNELS.search(path.read_bytes()))
    names = [".".join(path.with_suffix("").parts) for path in files]
    modules = sources.closure(f"{PACKAGE.name}.physics.kernels", *names)
    return digest_of((module.name, module.text) for module in modules if module.name != PACKAGE.name)


def processor_features() -> set[str]:
    """Return LLVM's names of the features that compiled code may use on this processor."""
    # Imported here and below, so that checking whether the folder is writable loads no compiler.
    import numba
    from numba.core.codegen import get_host_cpu_features

    flags = get_host_cpu_features() if numba.config.CPU_FEATURES is None else numba.config.CPU_FEATURES
    return {flag[1:] for flag in flags.split(",") if flag.startswith("+")}


def processor_name() -> str:
    import numba
    from llvmlite import binding as llvm

    name = numba.config.CPU_NAME or llvm.get_host_cpu_name()
    features = ",".join(sorted(processor_features()))
    return f"{name}-{hashlib.sha256(features.encode()).hexdigest()[:8]}"


def build_target() -> tuple[str, tuple[str, ...]] | None:
    """Return the processor and features that builds on this platform are compiled for, or None for other platforms."""
    return TARGETS.get(f"{sys.platform}-{platform.machine().lower()}")


def circumstances() -> dict[str, str]:
    """Return the properties of this installation on which the package's machine code depends."""
    import llvmlite
    import numba

    return {
        "platform": f"{sys.platform}-{platform.machine().lower()}",
        "Python": platform.python_version().rpartition(".")[0],
        "numba": numba.__version__,
        "llvmlite": llvmlite.__version__,
        "sources": sources_digest()[:16],
    }


@functools.cache
def why_not_built() -> str:
    """Return why the package's machine code cannot be used here, or '' if it can."""
    try:
        built = json.loads((BUILT / ABOUT).read_text())
    except (OSError, ValueError):
        return f"this installation has none: it is editable, or was built with WALKERLAB_BUILD_KERNELS=0. {REBUILD}"
    for name, here in circumstances().items():
        if built.get(name) != here:
            return f"{name} differs: {built.get(name)} when the package was built, {here} here. {REBUILD}"
    missing = set(built["features"]) - processor_features()
    return f"this processor lacks {', '.join(sorted(missing))}." if missing else ""


def describe_origin() -> list[str]:
    """Return lines that say where kernels come from, and why."""
    versions = ", ".join(f"{name} {here}" for name, here in circumstances().items())
    reason = why_not_built()
    folder = f"compiled when a run needs them, and kept in {cache_root()}"
    if reason:
        return [versions, f"kernels: {folder}", f"The package's kernels are not used: {reason}"]
    return [versions, f"kernels: {len(list(BUILT.glob('*.kernel')))} from the package; others are {folder}"]


def files_of(name: str) -> Iterator[Path]:
    """Yield the machine-code files with this name: first the package's, then the one in the user's cache."""
    if why_not_built() == "" and (BUILT / name).is_file():
        yield BUILT / name
    kept = cache_folder() / name
    if kept.is_file():
        yield kept


def write_file(path: Path, content: bytes) -> None:
    """Write a file of machine code, so that other processes see all of it or nothing."""
    make_private_folder(path.parent)
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        file.write(content)
    # Replacing is atomic, so no process ever reads half a file.
    Path(file.name).replace(path)


def cache_root() -> Path:
    """Return the folder of compiled code: $WALKERLAB_CACHE or the user's cache if usable, otherwise a temporary one."""
    chosen = os.environ.get("WALKERLAB_CACHE")
    default = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "walkerlab"
    return _first_usable((Path(chosen), default) if chosen else (default,))


@functools.cache
def _first_usable(candidates: tuple[Path, ...]) -> Path:
    refusals = {folder: _refusal(folder) for folder in candidates}
    usable = [folder for folder in candidates if not refusals[folder]]
    folder = usable[0] if usable else Path(tempfile.mkdtemp(prefix="walkerlab-cache-"))
    if folder != candidates[0]:
        lost = "" if usable else ", where later processes do not find it"
        message = f"{candidates[0]} {refusals[candidates[0]]}: compiled code is kept in {folder}{lost}"
        warnings.warn(f"{message}. Set WALKERLAB_CACHE to choose another folder.", CacheWarning, stacklevel=3)
    return folder


def _refusal(root: Path) -> str:
    """Return why compiled code cannot be kept in a folder, or '' if it can. The folder is created if necessary."""
    try:
        make_private_folder(root)
        folder = root.resolve()
        generations = list(folder.glob("kernels-*"))
        # If the folder contains anything else, others may need it, so its permissions must stay as they are.
        if is_own(folder.stat()) and len(generations) == len(list(folder.iterdir())):
            folder.chmod(0o700)
        if may_be_foreign(folder):
            return "is open to other users or belongs to another user"
        if any(map(is_foreign, generations)):
            return "holds compiled code of other users"
        with tempfile.TemporaryFile(dir=folder):
            return ""
    except OSError:
        return "is not writable"


@functools.cache
def cache_folder() -> Path:
    """Return the folder of kernels compiled from the present sources for this processor."""
    # The first call of a process creates it if necessary, and then deletes folders unused for a long time.
    import numba

    root = cache_root()
    host = processor_name()
    compiler = f"py{sys.version_info.major}{sys.version_info.minor}-numba{numba.__version__}"
    folder = root / f"kernels-{sources_digest()[:16]}-{compiler}-{host}"
    existed = os.path.lexists(folder)
    # Closing a folder to other users may delete it, so that `mkdir` must create it again.
    folder = _closed_to_others(folder) if existed else folder
    folder.mkdir(0o700, exist_ok=True)
    # The number of folders grows only when one is created, so it is checked only then.
    if not existed:
        _remove_unused(list(root.glob(f"kernels-*-{host}")))
    # `_remove_unused` takes the folder's modification time as the time of its last use.
    os.utime(folder)
    return folder


def _closed_to_others(folder: Path) -> Path:
    """Close a folder to other users, and delete code that they may have written.

    Returns the folder, or a temporary one if that fails.
    """
    try:
        deleted = make_private(folder)
    except OSError as error:
        refused = error.filename or folder
        folder = Path(tempfile.mkdtemp(prefix="walkerlab-cache-"))
        message = f"{refused} may belong to another user and cannot be deleted: compiled code is kept in {folder}."
    else:
        message = f"{deleted[0]}: other users may have written this code. It is compiled again." if deleted else ""
    if message:
        warnings.warn(message, CacheWarning, stacklevel=3)
    return folder


def _remove_unused(generations: list[Path]) -> None:
    """Delete folders unused for a long time, except the latest few. A process that still needs one compiles again."""
    last_used: dict[Path, float] = {}  # s since the epoch
    for folder in generations:
        with contextlib.suppress(OSError):  # another process may have deleted it
            last_used[folder] = folder.stat().st_mtime
    for folder in sorted(last_used, key=last_used.__getitem__, reverse=True)[KEPT_GENERATIONS:]:
        if time.time() - last_used[folder] > UNUSED_S:
            shutil.rmtree(folder, ignore_errors=True)


def lock_of(name: str) -> Any:
    """Create an interprocess lock, a file in the folder of compiled code."""
    # Imported here, because a process that finds everything compiled needs no lock.
    from filelock import FileLock

    return FileLock(cache_folder() / f"{hashlib.sha256(name.encode()).hexdigest()[:16]}.lock", mode=0o600)
