"""What a module is made of: its source and that of all it imports from its own package, read without importing it."""

from __future__ import annotations

import hashlib
import importlib.util
import re
from collections.abc import Iterable, Iterator
from functools import cache, cached_property
from itertools import accumulate, chain
from pathlib import Path

PACKAGE = __name__.partition(".")[0]

# Found in the text rather than by importing: the digest must cost milliseconds and load no compiler. Full names in
# quotes count too, since that is how a registry names what it imports late. Each way begins with a letter, which is
# sought three times as fast as a word's beginning.
COMMENT = re.compile(r"#[^\n]*")
IMPORT = re.compile(
    r"from(?<=\bfrom)[ \t]+(?P<origin>\.*[\w.]*)[ \t]+import\b[ \t]*(?P<names>\([^)]*\)|[^\n;]*)"
    r"|import(?<=\bimport)[ \t]+(?P<modules>[\w., \t]+)"
    r"|[\"'](?P<quoted>[^\W\d]\w*(?:\.\w+)+)[\"']"
)

# The built-in configs, which a wheel has in the package, reach a stage through the slice of the config that it reads,
# which is in its key already.
INPUT_FOLDERS = ("config/builtin",)


class Sources:
    """The sources of packages as they are on the disk now; each file is read and scanned once."""

    def __init__(self) -> None:
        """Start with nothing read."""
        self._modules: dict[str, Module | None] = {}

    def code_digest(self, name: str) -> str:
        """The sha256 over the sources of a module and of everything of its own package, or of this one, it imports.

        Data files beside those modules (templates, tables) count as code; this package's `__init__` does not, since a
        new version number alone changes no result. Raises ModuleNotFoundError if there is no such module.
        """
        closure = self.closure(name)
        files = {f"{module.name}:{path.name}": path for module in closure for path in module.data}
        texts = [(module.name, module.text) for module in closure if module.name != PACKAGE]
        return digest_of(texts + [(label, path.read_bytes()) for label, path in sorted(files.items())])

    def closure(self, *names: str) -> list[Module]:
        """The modules and all they import, by whatever way, from their own packages and from this one, by name.

        Raises ModuleNotFoundError if there is no such module.
        """
        found: dict[str, Module] = {}
        for name in names:
            start = self.module(name)
            if start is None:
                raise ModuleNotFoundError(f"no module named {name!r}", name=name)
            found[name] = start
        waiting = list(found.values())
        while waiting:
            for other in waiting.pop().imports:
                module = self.module(other)
                if module is not None and other not in found:
                    found[other] = module
                    waiting.append(module)
        return [found[key] for key in sorted(found)]

    def module(self, name: str) -> Module | None:
        """A module by its full name, or None if there is no file for it."""
        if name not in self._modules:
            self._modules[name] = self._find(name)
        return self._modules[name]

    def _find(self, name: str) -> Module | None:
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
    """A module's source file."""

    def __init__(self, name: str, path: Path) -> None:
        """Nothing is read yet."""
        self.name = name
        self.path = path
        self.is_package = path.name == "__init__.py"

    @cached_property
    def text(self) -> bytes:
        """The source."""
        return self.path.read_bytes()

    @cached_property
    def imports(self) -> list[str]:
        """Names that may be modules it imports, the packages above them and above itself included."""
        return imports_of(self.name, self.is_package, self.text)

    @cached_property
    def data(self) -> list[Path]:
        """Files of a package that are not Python, in its folder and in folders below that are no packages."""
        return sorted(data_files(self.path.parent)) if self.is_package else []


@cache
def imports_of(module: str, is_package: bool, source: bytes) -> list[str]:
    """Names that may be modules a module imports, the packages above them and above itself included."""
    text = COMMENT.sub("", source.decode()).replace("\\\n", " ")
    own = {PACKAGE, module.partition(".")[0]}
    names = {module, *(name for name in imported(module, is_package, text) if name.partition(".")[0] in own)}
    return sorted(set(chain.from_iterable(accumulate(name.split("."), "{}.{}".format) for name in names)))


def imported(module: str, is_package: bool, text: str) -> Iterator[str]:
    """What a module's text without comments imports, by full names, and what it has in quotes that may be one."""
    for found in IMPORT.finditer(text):
        if found["quoted"]:
            yield found["quoted"]
        else:
            origin = None if found["modules"] else absolute(module, is_package, found["origin"])
            yield from [origin] if origin else []
            listed = (found["modules"] or found["names"].strip("() \t\n")).split(",")
            names = [entry.split()[0] for entry in listed if entry.strip()]  # of 'a, b as c'
            yield from (f"{origin}.{name}" if origin else name for name in names)


def absolute(module: str, is_package: bool, origin: str) -> str:
    """The full name of what follows `from` in a module, be it relative."""
    name = origin.lstrip(".")
    levels = len(origin) - len(name)
    if not levels:
        return name
    parts = module.split(".")
    above = parts[: len(parts) - levels + is_package]
    return ".".join([*above, name] if name else above)


def digest_of(parts: Iterable[tuple[str, bytes]]) -> str:
    """The sha256 (hex) over parts, each with its name."""
    digest = hashlib.sha256()
    for name, data in parts:
        digest.update(f"{name}\0{len(data)}\0".encode() + data)
    return digest.hexdigest()


def data_files(folder: Path) -> Iterator[Path]:
    """The files that a package's code may read: all but Python, caches, hidden files and built-in configs."""
    for path in folder.iterdir():
        if path.name.startswith((".", "__pycache__")) or path.as_posix().endswith(INPUT_FOLDERS):
            continue
        if path.is_dir():
            if not (path / "__init__.py").exists():
                yield from data_files(path)
        elif path.suffix not in {".py", ".pyc", ".pyi", ".so", ".md"} and path.name != "py.typed":
            yield path
