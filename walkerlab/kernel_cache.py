"""Where the machine code of kernels is kept: one folder for each state of the sources, version of numba and processor.

Numba's own cache does not notice that a called function in another file changed, so the folder is keyed by a digest of
all sources that kernels can be made of: an edited function can never run stale. It serves this package's kernels alone:
caches of other programs that compile with Numba are untouched.
"""

import contextlib
import functools
import hashlib
import os
import re
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from walkerlab.sources import Sources, digest_of

PACKAGE = Path(__file__).parent
# the only packages in which compiled functions may stand (a test says so)
KERNEL_HOMES = ("solvers", "mechanics", "ground", "hybrid", "orbits")
HOLDS_KERNELS = re.compile(rb"walkerlab\.kernels|numba|\.case\(")
KEPT_GENERATIONS = 8
UNUSED_S = 30 * 86_400.0  # an older generation that no process has begun to use for so long may be deleted


class CacheWarning(RuntimeWarning):
    """Compiled code is not kept where it was meant to be."""


watchers: list[Callable[[str], None]] = []
"""Told the name of the kernel that this process compiles, or waits for, and '' once none is."""


@contextlib.contextmanager
def watched(tell: Callable[[str], None]) -> Iterator[None]:
    """Have `tell` among the watchers of what is compiled meanwhile."""
    watchers.append(tell)
    try:
        yield
    finally:
        watchers.remove(tell)


def sources_digest() -> str:
    """Digest (hex) of every source that a kernel can be made of: files that hold any, and what these import."""
    sources = Sources()
    homes = (path for home in KERNEL_HOMES for path in (PACKAGE / home).rglob("*.py"))
    holding = (path.relative_to(PACKAGE.parent) for path in homes if HOLDS_KERNELS.search(path.read_bytes()))
    names = [".".join(path.with_suffix("").parts) for path in holding]
    made_of = sources.closure(f"{PACKAGE.name}.kernels", *names)
    return digest_of((module.name, module.text) for module in made_of if module.name != PACKAGE.name)


def compiled_for() -> str:
    """The processor that code is compiled for: its name, and a digest of its features."""
    # Imported here and below: who asks only whether the folder can be written loads no compiler.
    import numba
    from llvmlite import binding as llvm

    name = numba.config.CPU_NAME or llvm.get_host_cpu_name()
    features = numba.config.CPU_FEATURES
    if features is None:
        features = llvm.get_host_cpu_features().flatten()
    return f"{name}-{hashlib.sha256(features.encode()).hexdigest()[:8]}"


def cache_root() -> Path:
    """The folder of all compiled code: $WALKERLAB_CACHE, else the user's cache folder, else a temporary one.

    Warns, once in a process, if the first that is meant cannot be written into.
    """
    chosen = os.environ.get("WALKERLAB_CACHE")
    usual = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "walkerlab"
    return _first_usable((Path(chosen), usual) if chosen else (usual,))


@functools.cache
def _first_usable(candidates: tuple[Path, ...]) -> Path:
    for folder in candidates:
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                break
    else:
        folder = Path(tempfile.mkdtemp(prefix="walkerlab-cache-"))
    if folder != candidates[0]:
        lost = "" if folder in candidates else ", which later processes do not find"
        said = f"{candidates[0]} cannot be written into: compiled code is kept in {folder}{lost}"
        warnings.warn(f"{said}. WALKERLAB_CACHE chooses another folder.", CacheWarning, stacklevel=3)
    return folder


@functools.cache
def cache_folder() -> Path:
    """This processor's folder of this state of the sources, chosen and made when this process first needs it.

    A new one takes the place of what has not been used for long.
    """
    import numba

    root, host = cache_root(), compiled_for()
    compiler = f"py{sys.version_info.major}{sys.version_info.minor}-numba{numba.__version__}"
    folder = root / f"kernels-{sources_digest()[:16]}-{compiler}-{host}"
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        _remove_unused(list(root.glob(f"kernels-*-{host}")))
    os.utime(folder)
    return folder


def _remove_unused(generations: list[Path]) -> None:
    """Remove those that were not used for long, beyond the latest few; a process that has one open compiles anew."""
    last_used: dict[Path, float] = {}  # s since the epoch
    for folder in generations:
        with contextlib.suppress(OSError):  # one that has just gone
            last_used[folder] = folder.stat().st_mtime
    for folder in sorted(last_used, key=last_used.__getitem__, reverse=True)[KEPT_GENERATIONS:]:
        if time.time() - last_used[folder] > UNUSED_S:
            shutil.rmtree(folder, ignore_errors=True)


def nothing_compiled_yet() -> bool:
    """Whether this state of the sources has no compiled code so far: the first run on a machine, or after a change."""
    return next(cache_folder().rglob("*.nbc"), None) is None


def lock_of(name: str) -> Any:
    """A lock between processes in the folder of compiled code."""
    # Imported here: a process that finds everything compiled takes no lock.
    from filelock import FileLock

    return FileLock(cache_folder() / f"{hashlib.sha256(name.encode()).hexdigest()[:16]}.lock")
