"""Digest of a module's source and of everything it imports, computed without importing it."""

import hashlib
import importlib.util
import re
from collections.abc import Iterable, Iterator
from functools import cache, cached_property
from itertools import accumulate, chain
from pathlib import Path

PACKAGE = __name__.partition(".")[0]

# Imports are found by searching the text, because the digest must be computed in milliseconds, without loading a
# compiler. Each alternative begins with a letter, which `re` finds three times as fast as a word boundary.
COMMENT = re.compile(r"#[^\n]*")
IMPORT = re.compile(
    r"from(?<=\bfrom)[ \t]+(?P<origin>\.*[\w.]*)[ \t]+import\b[ \t]*(?P<names>\([^)]*\)|[^\n;]*)"
    r"|import(?<=\bimport)[ \t]+(?P<modules>[\w., \t]+)"
)

# The files in these folders do not count as data. In a wheel, the built-in configs are inside the package, but the key
# of a stage already contains the part of the config that the stage reads. Machine code gives the same results as its
# sources.
INPUT_FOLDERS = ("config/builtin", "physics/machine_code")


class Sources:
    """Sources of packages on disk. Each file is read and scanned once."""

    def __init__(self) -> None:
        self._modules: dict[str, Module | None] = {}

    def code_digest(self, *names: str) -> str:
        """Return the SHA-256 of modules and of everything they import from their own packages or this one.

        Data files of those packages, such as templates and tables, are included. This package's `__init__` is not,
        since a new version number changes no result. Raises ModuleNotFoundError if there is no such module.
        """
        closure = self.closure(*names)
        files = {f"{module.name}:{path.name}": path for module in closure for path in module.data}
        texts = [(module.name, module.text) for module in closure if module.name != PACKAGE]
        return digest_of(texts + [(label, path.read_bytes()) for label, path in sorted(files.items())])

    def closure(self, *names: str) -> "list[Module]":
        """Return modules and everything they import, directly or not, from their own packages and this one, sorted by
        name.

        Raises ModuleNotFoundError if there is no such module.
        """
        modules: dict[str, Module] = {}
        for name in names:
            start = self.module(name)
            if start is None:
                raise ModuleNotFoundError(f"no module named {name!r}", name=name)
            modules[name] = start
        queue = list(modules.values())
        while queue:
            for imported in queue.pop().imports:
                module = self.module(imported)
                if module is not None and imported not in modules:
                    modules[imported] = module
                    queue.append(module)
        return [modules[name] for name in sorted(modules)]

    def module(self, name: str) -> "Module | None":
        """Return the module that has this full name, or None if it has no file."""
        if name not in self._modules:
            self._modules[name] = self._find(name)
        return self._modules[name]

    def _find(self, name: str) -> "Module | None":
        parent, _, last = name.rpartition(".")
        if not parent:
            spec = importlib.util.find_spec(last)
            path = None if spec is None or spec.origin is None else Path(spec.origin)
            return Module(name, path) if path is not None and path.suffix == ".py" else None
        package = self.module(parent)
        if package is None or not package.is_package:
            return None
        folder = package.path.parent
        for path in (folder / last / "__init__.py", folder / f"{last}.py"):
            if path.is_file():
                return Module(name, path)
        return None


class Module:
    """Source file of a module, read on first use."""

    def __init__(self, name: str, path: Path) -> None:
        self.name = name
        self.path = path
        self.is_package = path.name == "__init__.py"

    @cached_property
    def text(self) -> bytes:
        return self.path.read_bytes()

    @cached_property
    def imports(self) -> list[str]:
        """Full names of the modules that this module may import, as `find_imports` finds them."""
        return find_imports(self.name, self.is_package, self.text)

    @cached_property
    def data(self) -> list[Path]:
        """Data files of a package, in its folder and in subfolders that are not packages themselves."""
        return sorted(data_files(self.path.parent)) if self.is_package else []


@cache
def find_imports(module: str, is_package: bool, source: bytes) -> list[str]:
    """Return the full names of modules that a module may import, with all parent packages and its own name."""
    text = COMMENT.sub("", source.decode()).replace("\\\n", " ")
    packages = {PACKAGE, module.partition(".")[0]}
    names = {module, *(name for name in imported_names(module, is_package, text) if name.partition(".")[0] in packages)}
    return sorted(set(chain.from_iterable(accumulate(name.split("."), "{}.{}".format) for name in names)))


def imported_names(module: str, is_package: bool, text: str) -> Iterator[str]:
    """Yield the full names in the import statements of a module's text, which has no comments."""
    for match in IMPORT.finditer(text):
        origin = None if match["modules"] else absolute_name(module, is_package, match["origin"])
        yield from [origin] if origin else []
        listed = (match["modules"] or match["names"].strip("() \t\n")).split(",")
        names = [entry.split()[0] for entry in listed if entry.strip()]  # without 'as' aliases
        yield from (f"{origin}.{name}" if origin else name for name in names)


def absolute_name(module: str, is_package: bool, origin: str) -> str:
    """Return the full name of the module that `from ... import` names. A relative name starts from `module`."""
    name = origin.lstrip(".")
    levels = len(origin) - len(name)
    if not levels:
        return name
    parts = module.split(".")
    above = parts[: len(parts) - levels + is_package]
    return ".".join([*above, name] if name else above)


def digest_of(parts: Iterable[tuple[str, bytes]]) -> str:
    """Return the SHA-256 (hex) of texts and their names."""
    digest = hashlib.sha256()
    for name, data in parts:
        digest.update(f"{name}\0{len(data)}\0".encode() + data)
    return digest.hexdigest()


def data_files(folder: Path) -> Iterator[Path]:
    """Yield files that a package's code may read: all except Python, caches, hidden files and built-in configs."""
    for path in folder.iterdir():
        if path.name.startswith((".", "__pycache__")) or path.as_posix().endswith(INPUT_FOLDERS):
            continue
        if path.is_dir():
            if not (path / "__init__.py").exists():
                yield from data_files(path)
        elif path.suffix not in {".py", ".pyc", ".pyi", ".so", ".md"} and path.name != "py.typed":
            yield path
