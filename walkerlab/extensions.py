"""Extensions: packages that add stages, figures, sections of the page, answers, laws and studies.

The built-in extensions are listed in `walkerlab.EXTENSIONS`. Other packages register theirs through entry points in the
group `walkerlab.extensions`. An extension names its code in quotes, "module:name", which is imported on first use. All
other modules learn from this one what extensions add, so that no module has to name one of a higher layer.
"""

import contextlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import walkerlab
from walkerlab.code_digest import Sources
from walkerlab.errors import ConfigError
from walkerlab.private_files import may_be_foreign

BUILT_IN: Final = walkerlab.__name__
GROUP: Final = "walkerlab.extensions"
INTERFACE: Final = 1
"""Version of the interface, that is, of the fields of `Extension` and `Study`."""
WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    "equations": ("corrected",),
    "walkers": ("compass", "straight-legs", "kneed", "parts"),
    "normal_force": ("impact",),
    "friction": ("coulomb", "none"),
    "hinge_law": ("linear",),
}
"""Built-in values of the config keys to which extensions can add values, by the last part of the key. `walkers` stands
for the key `walker.type`.
"""
SLOTS: Final = ("task", "walks", "evidence", "benchmarks")
"""Names of the positions in the page at which extensions add sections: after the task, the walks, the models, and
the accuracy."""
# A folder that changed less than this long ago may change again without getting a new modification time.
SETTLED_NS: Final = 2_000_000_000
MAX_FOLDERS: Final = 500


@dataclass(frozen=True)
class Study:
    """A published study, with its walker and its equations of motion if they differ from Lagrange's."""

    own_walker: str  # function that returns whether a config has the walker of the study
    # functions that build a rigid model with other equations, by value of the config key `equations`
    equations: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Extension:
    """A package's additions. Code is named as "module:name" and imported on first use."""

    interface: int  # the `INTERFACE` that it was written for
    stages: Sequence[Any] = ()  # of type `pipeline.plan.stage.Stage`
    figures: str = ""  # a tuple of `views.figures.illustration.Illustration`
    sections: Mapping[str, Sequence[str]] = field(default_factory=dict)  # functions that build sections, by `SLOTS`
    answers: Mapping[str, str] = field(default_factory=dict)  # functions that print a stage's answer, by stage
    tables: Mapping[str, str] = field(default_factory=dict)  # tables of a stage's summary for export, by stage
    walkers: Mapping[str, str] = field(default_factory=dict)  # types of walkers, by word
    # classes of normal-force laws, by the word in a config
    normal_force: Mapping[str, str] = field(default_factory=dict)
    friction: Mapping[str, str] = field(default_factory=dict)  # classes of friction laws, by the word in a config
    hinge_law: Mapping[str, str] = field(default_factory=dict)  # classes of hinge laws, by the word in a config
    studies: Sequence[Study] = ()

    def words(self, key: str) -> Mapping[str, str]:
        """Return the code that the extension adds for words of a config key, by word."""
        if key == "equations":
            return {word: code for study in self.studies for word, code in study.equations.items()}
        return dict(getattr(self, key))

    def code(self) -> Iterator[str]:
        """Yield all code that the extension registers, in the form `module:name`."""
        yield from self.drawing_code()
        yield from (code for key in WORDS for code in self.words(key).values())
        yield from (study.own_walker for study in self.studies)
        yield from (f"{stage.module}:run" for stage in self.stages)
        yield from (stage.adds_command for stage in self.stages if stage.adds_command)

    def drawing_code(self) -> Iterator[str]:
        """Yield the code that drawings of results depend on."""
        yield from filter(None, (self.figures, *self.answers.values(), *self.tables.values()))
        for makers in self.sections.values():
            yield from makers


@dataclass(frozen=True)
class Found:
    """An extension with its origin."""

    name: str
    code: str  # module:name
    source: str  # distribution and version; empty for built-in extensions
    extension: Extension | None = None  # None if the extension is left out
    reason: str = ""  # why the extension is left out; empty if it is used

    @property
    def origin(self) -> str:
        return self.source or f"{BUILT_IN} {walkerlab.__version__}"

    @property
    def adds(self) -> dict[str, list[str]]:
        """Names of the added stages, words added for each config key, and code on which figures and page depend."""
        extension = self.extension or Extension(INTERFACE)
        words = {key: [*extension.words(key)] for key in WORDS}
        return {"stages": [stage.name for stage in extension.stages], **words, "views": [*extension.drawing_code()]}


def load(code: str) -> Any:
    """Import the object that "module:name" names."""
    module, _, name = code.partition(":")
    return getattr(import_module(module), name)


def lazy_function(code: str) -> Callable[..., Any]:
    """Return a function that imports the function "module:name" at its first call, and calls it."""
    return lambda *arguments: load(code)(*arguments)


opening: list[str] = []
"""Name of the extension that is being imported."""


@cache
def registry() -> tuple[Found, ...]:
    """Return all extensions, the built-in ones first. For a broken one, `reason` says why it is left out."""
    if opening:
        raise ImportError(f"{opening[0]} imports code that uses extensions; it must name that code in quotes")
    built_in = [Found(name, f"{BUILT_IN}{code}", "") for name, code in walkerlab.EXTENSIONS.items()]
    return tuple(map(open_extension, (*built_in, *(Found(*entry) for entry in announced()))))


def open_extension(found: Found) -> Found:
    opening.append(found.code)
    try:
        extension = load(found.code)
        if found.source:
            check(extension)
    # Code of other packages can do anything when it is imported, even end the process.
    except (Exception, SystemExit) as error:
        if not found.source:
            raise
        return replace(found, reason=f"{type(error).__name__}: {error}")
    finally:
        opening.pop()
    return replace(found, extension=extension)


def check(extension: Any) -> None:
    """Raise an error if an extension does not fit the interface or names a module that does not exist."""
    if not isinstance(extension, Extension):
        raise TypeError(f"it is of type {type(extension).__name__}, not Extension")
    if extension.interface != INTERFACE:
        raise ValueError(f"it was written for interface {extension.interface}, and this version has {INTERFACE}")
    if not {stage.name for stage in extension.stages}.issuperset((*extension.answers, *extension.tables)):
        raise ValueError("it has answers or tables for stages that are not its own")
    if not set(SLOTS).issuperset(extension.sections):
        raise ValueError(f"its sections must be at {', '.join(SLOTS)}")
    for code in extension.code():
        module, _, name = code.partition(":")
        if not name or find_spec(module) is None:
            raise ValueError(f"{code!r} does not have the form module:name, or its module does not exist")


def extensions() -> dict[str, Extension]:
    """Return the extensions that can be used, by name."""
    return {found.name: found.extension for found in registry() if found.extension is not None}


def code_by_word(kind: str) -> dict[str, str]:
    """Return the code that extensions add under `kind`, by name. `kind` is a config key or a field of `Extension`."""
    return {word: code for extension in extensions().values() for word, code in extension.words(kind).items()}


def words(key: str) -> tuple[str, ...]:
    """Return all values that a config key allows: the built-in ones, then those of extensions."""
    return (*WORDS[key], *code_by_word(key))


def external_extensions() -> tuple[Found, ...]:
    """Return the extensions of other packages, including those that are not used."""
    return tuple(found for found in registry() if found.source)


def origin_of(key: str) -> str:
    """Name the values of a config key that come from other packages, or return '' if none do."""
    origins = (
        (found, word) for found in external_extensions() if found.extension for word in found.extension.words(key)
    )
    return "".join(f"; {word}: extension {found.name} ({found.source})" for found, word in origins)


def check_names(warn: Callable[[str], object], commands: Iterable[str] = ()) -> None:
    """Raise ConfigError if two extensions, or an extension and this package, use the same name. Warn of broken
    extensions.

    commands  names of the commands that are not stages
    """
    owners = {("stage", name): BUILT_IN for name in commands}
    owners |= {(key, word): BUILT_IN for key, own in WORDS.items() for word in own}
    for found in registry():
        extension = found.extension or Extension(INTERFACE)
        names = [("extension", found.name), *(("stage", stage.name) for stage in extension.stages)]
        names += [(key, word) for key in WORDS for word in extension.words(key)]
        for name in names:
            if name in owners:
                advice = "Uninstall one of the two, or ask its author for another name."
                raise ConfigError(f"{owners[name]} and {found.origin} both add the {' '.join(name)}.", advice)
            owners[name] = found.origin
        if found.reason:
            warn(f"extension {found.name} ({found.origin}) is left out: {found.reason}")


@cache
def versions() -> str:
    """List the usable extensions of other packages with versions and code digests, or return '' if there are none."""
    sources = Sources()
    described = []
    for found in external_extensions():
        if found.extension is not None:
            modules = {code.partition(":")[0] for code in (found.code, *found.extension.code())}
            described.append(f"{found.name}: {found.origin} (code {sources.code_digest(*modules)[:8]})")
    return ", ".join(described)


def refuse_other_versions(expected: str) -> None:
    """Raise ConfigError if the extensions of this worker differ from those of the caller, `expected` (see
    `versions`)."""
    if expected != versions():
        have = f"this worker has the extensions [{versions()}], and its caller [{expected}]."
        raise ConfigError(have, "Install the same extensions in both environments. `walkerlab extensions` lists them.")


def announced() -> Iterator[tuple[str, str, str]]:
    """Yield name, code and source of the extensions that installed packages announce.

    Importing importlib.metadata and reading all distributions takes longer than many commands, so the entries of a
    folder are read again only after it has changed.
    """
    # `os.path`, because `Path` raises an error if the user has no home.
    cache = os.path.expanduser(os.environ.get("XDG_CACHE_HOME") or "~/.cache")  # noqa: PTH111
    cache_file = Path(cache) / "walkerlab-extensions.json"
    stored = read_scans(cache_file)
    changed = False
    seen: set[tuple[str, str]] = set()
    for folder in dict.fromkeys(map(os.path.abspath, sys.path)):
        if not os.path.isdir(folder):  # noqa: PTH112
            continue
        stamp = os.stat(folder).st_mtime_ns  # noqa: PTH116
        if stored.get(folder, [0])[0] != stamp:
            stored[folder], changed = [stamp, scan(folder)], True
        for distribution, version, name, code in stored[folder][1]:
            # A distribution may be installed twice. Python imports the one whose folder comes first.
            if (distribution, name) not in seen:
                seen.add((distribution, name))
                yield name, code, f"{distribution} {version}"
    if changed and cache_file.is_absolute():
        write_scans(cache_file, stored)


def scan(folder: str) -> list[list[str]]:
    """List the entry points of the distributions in a folder: distribution, version, name and code."""
    if not any(entry.endswith((".dist-info", ".egg-info")) for entry in os.listdir(folder)):  # noqa: PTH208
        return []
    # Imported here, because it takes 40 ms.
    from importlib.metadata import distributions

    entries = []
    for distribution in distributions(path=[folder]):
        with contextlib.suppress(Exception):  # files of other packages may be damaged
            found = distribution.entry_points.select(group=GROUP)
            entries += [[distribution.name, distribution.version, each.name, each.value] for each in found]
    return sorted(entries)


def read_scans(file: Path) -> dict[str, Any]:
    """Read earlier scans by folder. Return {} if the file is missing or another user may have written it."""
    with contextlib.suppress(OSError, ValueError):
        if not may_be_foreign(file):
            stored: dict[str, Any] = json.loads(file.read_text())
            return stored
    return {}


def write_scans(file: Path, scans: Mapping[str, Any]) -> None:
    """Store the latest scans, except those of folders that have just changed. If this fails, the next process scans
    again."""
    now = time.time_ns()
    settled = {folder: entry for folder, entry in scans.items() if now - entry[0] > SETTLED_NS}
    temporary = file.with_name(f"{file.name}.{os.getpid()}")
    with contextlib.suppress(OSError):
        file.parent.mkdir(0o700, parents=True, exist_ok=True)
        temporary.touch(0o600)
        temporary.write_text(json.dumps(dict([*settled.items()][-MAX_FOLDERS:])))
        temporary.replace(file)
