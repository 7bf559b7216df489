"""Compilation of kernels with numba, and the files that keep their machine code.

A kernel's machine code comes from the package if its build compiled the kernel, or from the user's cache. Otherwise
this process compiles it, while others that need it wait.
"""

import contextlib
import functools
import hashlib
import importlib
import linecache
import pickle
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numba
from llvmlite import binding
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.registry import CPUDispatcher
from numba.core.serialize import dumps
from numba.core.types.npytypes import Record
from numba.np import linalg

from walkerlab.code_digest import PACKAGE, Sources, digest_of
from walkerlab.physics.kernel_cache import cache_folder, files_of, lock_of, watchers, write_file

CHECKSUM_BYTES = 32  # length of the SHA-256 digest that precedes a kernel's stored code
# index of the signature in the stored tuple
SIGNATURE = 3
# The compiler must not contract or reorder arithmetic, so that code compiled twice gives the same results to the last
# bit. `nsz` only lets it ignore the sign of a zero. A division by zero gives an infinity, as in NumPy, so that
# divisions need no test. References are not counted (_nrt), because kernels allocate nothing and borrow arrays from
# their caller, and counting would take as long as the arithmetic.
FLAGS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"nsz"}, "_nrt": False}
bodies: dict[type, list[Callable[..., Any]]] = {}
"""Functions that compiled code calls for each class (see `kernels.ByType`)."""
files_in_use: set[str] = set()
"""Names of the files of machine code that this process has loaded or stored."""


def layout_symbol(record: Any) -> tuple[str, tuple[str, ...]]:
    """Return the name that symbols of machine code use for a record type. It is the same in every process."""
    # Numba uses a counter instead. Two processes can then give the same symbol to code compiled for different records,
    # and a third process that loads both would run the wrong code.
    return "Record", (hashlib.sha256(record.name.encode()).hexdigest()[:16],)


# numba imports scipy.linalg just to see whether it is installed, which takes longer than loading all machine code
ensure_blas = linalg.ensure_blas
linalg.ensure_blas = lambda: None
importlib.import_module("numba.np.arraymath")
linalg.ensure_blas = ensure_blas
Record.mangling_args = property(layout_symbol)  # type: ignore[method-assign, assignment]


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """Compiled function that Python calls, with its machine code in files. It also implements numba's cache interface.

    A kernel that calls another one compiles it again as a part of itself, because stored machine code cannot be linked.
    """

    @functools.cached_property
    def part(self) -> Any:
        return numba.njit(**PART_FLAGS)(self.py_func)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        return self.part.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        return self.part.get_overload(sig)

    def compile(self, sig: Any) -> Any:
        """Return the entry point for these argument types. Processes that compile the same code wait for each other."""
        self._cache = self
        name = self.file_name(sig)
        vectorize = numba.config.LOOP_VECTORIZE
        numba.config.LOOP_VECTORIZE = 0
        try:
            # Only compiling needs the lock. Any number of processes can load stored code.
            with lock_of(name) if next(files_of(name), None) is None else contextlib.nullcontext():
                return super().compile(sig)
        finally:
            numba.config.LOOP_VECTORIZE = vectorize

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Load stored code, or return None if it must be compiled."""
        name = self.file_name(signature)
        for path in files_of(name):
            payload = read_code(path)
            # A class defined in a notebook is a different class in the next process.
            if payload is not None and payload[SIGNATURE].args == tuple(signature):
                files_in_use.add(name)
                # As in numba's own cache: code can be rebuilt only in an initialised context.
                context.refresh()
                return CompileResult._rebuild(context, *payload)
        for notify in watchers:
            notify(self.py_func.__name__)
        return None

    def save_overload(self, signature: Any, code: Any) -> None:
        """Store compiled code, unless it contains addresses of this process."""
        if not code.library.has_dynamic_globals:
            name = self.file_name(signature)
            write_file(cache_folder() / name, pack(code._reduce()))
            files_in_use.add(name)

    def file_name(self, signature: Any) -> str:
        """Return the cached file's name for these argument types, with a hash of what the folder's name leaves out."""
        function = self.py_func
        location = f"{function.__module__}.{function.__qualname__}:{function.__code__.co_firstlineno}"
        cells = dumps([cell.cell_contents for cell in function.__closure__]) if function.__closure__ else b""
        classes = sorted(set(classes_in(signature)), key=str)
        types = repr((signature, classes)).encode()
        identity = digest_of([(location, types), ("closure", cells), *outside_sources(function, classes)])
        return f"{function.__name__}-{identity[:24]}.kernel"


def pack(payload: Any) -> bytes:
    """Convert a kernel's code to the content of a file."""
    data: bytes = dumps(payload)
    return hashlib.sha256(data).digest() + data


def read_code(path: Path) -> Any:
    """Read the code of a kernel.

    Returns None if the file is damaged, unreadable or deleted, or if it needs classes that are gone.
    """
    with contextlib.suppress(OSError, ImportError, AttributeError):
        content = path.read_bytes()
        if hashlib.sha256(content[CHECKSUM_BYTES:]).digest() == content[:CHECKSUM_BYTES]:
            return pickle.loads(content[CHECKSUM_BYTES:])
    return None


def strip_bitcode(path: Path) -> bytes:
    """Return the content of a kernel's file without its LLVM bitcode, of which only the symbol names are kept."""
    # The bitcode is most of the file. Only linking needs it, and stored kernels are never linked.
    (name, kind, (machine_code, bitcode)), *rest = read_code(path)
    module = binding.parse_bitcode(bitcode)
    names = [each.name for each in (*module.functions, *module.global_variables) if not each.is_declaration]
    symbols = "\n".join(f'@"{each}" = global i8 0' for each in names)
    return pack(((name, kind, (machine_code, binding.parse_assembly(symbols).as_bitcode())), *rest))


def classes_named_by(fields: Iterable[str]) -> Iterator[Any]:
    """Yield the classes that are named by fields of a record type, as "module/class"."""
    # The separator is not a colon, because other libraries cannot read NumPy records with a colon in a field's name.
    for module, slash, name in (field.partition("/") for field in fields):
        if slash:
            yield getattr(importlib.import_module(module), name)


def classes_in(kind: Any) -> Iterator[type]:
    """Yield the NamedTuple classes in a Numba type or in a tuple of types, and those named by record types."""
    yield from classes_named_by(getattr(getattr(kind, "dtype", kind), "fields", ()))
    if hasattr(kind, "instance_class"):
        yield kind.instance_class
    held = kind.held if hasattr(kind, "held") else kind
    for inner in held if isinstance(held, tuple) else getattr(held, "types", ()):
        yield from classes_in(inner)


def outside_sources(function: Callable[..., Any], classes: list[type]) -> Iterator[tuple[str, bytes]]:
    """Yield names and texts of code that a kernel uses from outside this package, such as a user's law."""
    functions = [function, *(body for chosen in classes for body in bodies.get(chosen, ()))]
    outside = {each.__module__ for each in (*functions, *classes)}
    outside = {name for name in outside if not name.startswith(f"{PACKAGE}.physics.")}
    if outside:
        importable = [name for name in outside if getattr(sys.modules.get(name), "__spec__", None)]
        sources = Sources()
        known = [name for name in importable if sources.module(name) is not None]
        yield from ((module.name, module.text) for module in sources.closure(*known) if module.name != PACKAGE)
        files = {each.__code__.co_filename for each in functions if each.__module__ in outside.difference(known)}
        # `linecache` also knows the cells of a notebook, which are in no file.
        yield from ((file, "".join(linecache.getlines(file)).encode()) for file in sorted(files))


class _WithoutEnvironment:
    """Code generator whose `set_env` does nothing: kernel parts have no machine code that could use an environment."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


class _PartLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Code of a kernel part. It is linked into kernels, and becomes machine code only together with them."""

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


class PartCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's compiler passes, which put the code into a `_PartLibrary`."""

    def define_pipelines(self) -> list[Any]:
        if self.state.library is None:
            self.state.library = _PartLibrary(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


# Python never calls parts of a kernel
PART_FLAGS: dict[str, Any] = {
    **FLAGS,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": PartCompiler,
}
