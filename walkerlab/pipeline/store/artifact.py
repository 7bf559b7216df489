"""Artifacts: results of stages with their identity, as HDF5 files, written atomically and verified on reading."""

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path, PurePosixPath
from typing import Any, Final

import numpy as np

from walkerlab.config.reads import canonical_json
from walkerlab.pipeline.store import hdf5
from walkerlab.pipeline.store.content import Attribute, Content, Digest, Group, Variable
from walkerlab.pipeline.store.files import file_digest, read_bounded, refuse_full_disk, replacing, write_atomically
from walkerlab.pipeline.store.provenance import Provenance

SCHEMA_VERSION = 3
"""Version of the layout of artifacts."""
READABLE: Final = (2, SCHEMA_VERSION)
"""Versions of the layout that can be read. In version 2, text has variable length."""
DIGEST: Final = re.compile("[0-9a-f]{64}")


@dataclass(frozen=True)
class Identity:
    """Everything on which a stage's result depends."""

    stage: str  # name of the stage
    config_slice: Mapping[str, Any]  # keys of the config that the stage reads, with their values
    input_keys: Mapping[str, str]  # stage keys of its inputs, by stage
    code_digest: str  # digest of the stage's code, see `walkerlab.code_digest`
    schema_version: int = SCHEMA_VERSION  # version of the artifact's layout

    @property
    def key(self) -> str:
        """Stage key: the sha256 of all fields but the stage's name. The order of keys does not matter."""
        parts = [self.schema_version, dict(self.config_slice), dict(self.input_keys), self.code_digest]
        return hashlib.sha256(canonical_json(parts).encode()).hexdigest()


def changed_parts(old: Identity, new: Identity) -> list[str]:
    """Describe the differences between two identities. There are none if their keys are equal."""
    changes = list(differences("", old.config_slice, new.config_slice))
    for name in sorted({*old.input_keys, *new.input_keys}):
        if old.input_keys.get(name) != new.input_keys.get(name):
            what = "left out" if name not in new.input_keys else "changed" if name in old.input_keys else "added"
            changes.append(f"input {name} {what}")
    if old.code_digest != new.code_digest:
        changes.append("code changed")
    if old.schema_version != new.schema_version:
        changes.append(f"layout of artifacts {old.schema_version} -> {new.schema_version}")
    return changes


def differences(where: str, old: Any, new: Any) -> Iterator[str]:
    """Yield the differences of two config slices as texts such as 'walker.leg_mass_kg 5.0 -> 6.0'."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for name in sorted({*old, *new}):
            yield from differences(f"{where}.{name}" if where else name, old.get(name), new.get(name))
    elif canonical_json(old) != canonical_json(new):
        yield f"{where} {brief(old)} -> {brief(new)}"


def brief(value: Any) -> str:
    if value is None:
        return "none"
    text = "{...}" if isinstance(value, Mapping) else str(value)
    return f"{text[:8]}..." if DIGEST.fullmatch(text) else text


NOT_THERE = "not there yet"
"""Reason given for running a stage that has no stored result yet."""

LIMIT_BYTES = 1 << 30
"""Maximum size of an artifact. Larger files are not read."""

# The seal follows the HDF5 data. It reveals a damaged file before the HDF5 library reads it, because some damaged files
# make the library free memory twice.
SEAL = re.compile(rb"\nwalkerlab sha256 ([0-9a-f]{64})\n")
SEAL_BYTES = 83


NESTED = ("config_slice", "input_keys", "library_versions", "input_digests")
"""Fields of `Identity` and `Provenance` that are stored as JSON."""
ROOT_ATTRIBUTES = frozenset(one.name for one in (*fields(Identity), *fields(Provenance))) | {
    "title", "Conventions", "stage_key", "summary_json", "summary_timed", "content_digest", "complete"
}  # fmt: skip
"""Names of the attributes at the root of every artifact. Content with arrays at the root may add others."""


class Damaged(Exception):  # noqa: N818 - a finding about a file, not a failure of this program
    """Error for a file that is not a trustworthy artifact. The message gives the reason."""


class OtherLayout(Damaged):
    """Error for an artifact whose layout is that of another version of the program. Callers skip it without a
    warning."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Identified(Content):
    """Content of a result and its identity."""

    identity: Identity


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored(Identified):
    """Content of an artifact with its identity and provenance."""

    provenance: Provenance
    seal: str  # sha256 of the file, provenance and timings included


@dataclass(frozen=True)
class Lookup:
    """Whether a file is the artifact with a given key, and the reason if it is not."""

    accepted: bool
    reason: str  # reason for rejecting the file; empty if it is accepted
    artifact: Stored | None = None  # the file's content, even if the key differs; None if missing or damaged
    damaged: bool = False  # whether the file exists but cannot be trusted


def write(path: Path, content: Content, identity: Identity, provenance: Provenance) -> Stored:
    """Store a result at `path`, atomically replacing the old one.

    Raises StorageError if that fails; the old file is then intact.
    """
    root = root_attributes(content, identity, provenance, content.digest())
    attributes = content.groups[""].attrs if "" in content.groups else {}
    if not attributes.keys().isdisjoint(ROOT_ATTRIBUTES):
        raise ValueError(f"some of these root attributes have reserved names: {sorted(attributes)}")
    image = hdf5.image(content.groups, {**root, **attributes})
    seal = hashlib.sha256(image).hexdigest()
    write_atomically(path, image, f"\nwalkerlab sha256 {seal}\n".encode())
    parts = content.groups, content.summary, content.timed
    return Stored(*parts, complete=content.complete, identity=identity, provenance=provenance, seal=seal)


@dataclass(frozen=True)
class InTurn:
    """Content with a single group, whose variables are built one by one to save memory."""

    summary: Mapping[str, Any]
    attrs: Mapping[str, Attribute]
    coordinates: Mapping[str, Variable]  # variables that are coordinates of dimensions
    variables: Iterable[tuple[str, Variable]]  # all variables, ordered by name
    size: int  # approximate size of all variables, bytes


def write_in_turn(
    path: Path, content: InTurn, identity: Identity, provenance: Provenance, complete: bool = True
) -> None:
    """Store content as `write` does, but one variable at a time.

    Raises StorageError if that fails; the old file is then intact.
    """
    labelled = Content({}, content.summary, complete=complete)
    digest = Digest(labelled.summary, labelled.timed)
    digest.enter("", content.attrs)

    def remaining() -> Iterator[tuple[str, Variable]]:
        yield from content.coordinates.items()
        for name, variable in content.variables:
            digest.add(name, variable)
            if name not in content.coordinates:
                yield name, variable

    def root() -> dict[str, Attribute]:
        return {**root_attributes(labelled, identity, provenance, digest.hex()), **content.attrs}

    with replacing(path) as temporary:
        # Free space is checked first, because the HDF5 library cannot close a file that it cannot write.
        refuse_full_disk(temporary, content.size)
        hdf5.write_in_turn(temporary, remaining(), root)
        seal = file_digest(temporary)
        with temporary.open("ab") as file:
            file.write(f"\nwalkerlab sha256 {seal}\n".encode())


def read(path: Path) -> Stored:
    """Read and verify the artifact at `path`.

    Raises FileNotFoundError if it does not exist, and Damaged if it is truncated, altered or malicious.
    """
    try:
        data = read_bounded(path, LIMIT_BYTES)
        image = data[:-SEAL_BYTES]
        end = SEAL.fullmatch(data[-SEAL_BYTES:])
        if end is None:
            raise Damaged(
                "it does not end with the seal of a finished artifact: cut short, or not written by walkerlab"
            )
        if hashlib.sha256(image).hexdigest().encode() != end[1]:
            raise Damaged("it was altered after it was finished")
        return assembled(*hdf5.parse(image), end[1].decode())
    except (FileNotFoundError, Damaged):
        raise
    except OSError as error:
        raise Damaged(f"it cannot be read: {error.strerror or error}") from error
    except Exception as error:
        # Any error that a library raises on untrusted bytes means that the file is damaged.
        raise Damaged(f"it is not an artifact: {error or type(error).__name__}") from error


def check(path: Path, key: str | None = None, stage: str | None = None) -> Lookup:
    """Return whether the file at `path` is intact and belongs to `key` and `stage`, if given.

    A damaged or missing file raises no error.
    """
    try:
        artifact = read(path)
    except (FileNotFoundError, NotADirectoryError):
        return Lookup(False, NOT_THERE)
    except OtherLayout as error:
        return Lookup(False, str(error))
    except Damaged as error:
        return Lookup(False, f"damaged: {error}", damaged=True)
    if stage not in (None, artifact.identity.stage):
        return Lookup(False, f"damaged: it is a result of {artifact.identity.stage}, not of {stage}", damaged=True)
    if key not in (None, artifact.identity.key):
        return Lookup(False, "made for another key", artifact)
    return Lookup(True, "", artifact)


def root_attributes(content: Content, identity: Identity, provenance: Provenance, digest: str) -> dict[str, Attribute]:
    facts = {name: value for name, value in {**vars(identity), **vars(provenance)}.items() if value is not None}
    return {
        "title": f"walkerlab {identity.stage}",
        "Conventions": hdf5.CONVENTIONS,
        **{name: canonical_json(dict(value)) if name in NESTED else value for name, value in facts.items()},
        "stage_key": identity.key,
        "summary_json": json.dumps(content.summary, ensure_ascii=False, allow_nan=False),
        "summary_timed": canonical_json(content.timed),
        "content_digest": digest,
        "complete": content.complete,
    }


def assembled(groups: Mapping[str, Group], root: Mapping[str, Any], seal: str) -> Stored:
    """Build an artifact from the parts of a file.

    Raises Damaged if its digest or key does not match.
    """
    # The version is checked first, because other layouts may lack the other attributes.
    if root.get("schema_version") not in READABLE:
        raise OtherLayout(f"its layout is version {root.get('schema_version')}, this program's is {SCHEMA_VERSION}")
    attributes = {name: value for name, value in root.items() if name not in ROOT_ATTRIBUTES}
    if "" in groups:
        groups = {**groups, "": Group(groups[""].variables, attributes)}
    facts = {name: json.loads(value) if name in NESTED else value for name, value in root.items()}
    identity = Identity(**{one.name: facts[one.name] for one in fields(Identity)})
    provenance = Provenance(**{one.name: facts[one.name] for one in fields(Provenance) if one.name in facts})
    parts = groups, json.loads(root["summary_json"]), tuple(json.loads(root["summary_timed"]))
    artifact = Stored(*parts, complete=root["complete"], identity=identity, provenance=provenance, seal=seal)
    if artifact.digest() != root["content_digest"]:
        raise Damaged("its content does not match its stored digest")
    if identity.key != root["stage_key"]:
        raise Damaged("its key does not match the config, inputs and code that it records")
    return artifact


FILES_GROUP = "files"


def index_files(folder: Path, files: Iterable[Path]) -> Group:
    """Build the group that lists files below a run folder. It is stored under the name `FILES_GROUP`.

    Raises ValueError for a file outside the folder and FileNotFoundError for a missing one.
    """
    listed = sorted(files)
    names = [path.relative_to(folder).as_posix() for path in listed]
    digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in listed]
    paths = Variable(np.array(names, dtype=object), ("file",), "", "path in the run folder")
    # Figures that plot run times differ between runs, so the content's digest excludes the digests of files.
    sha256 = Variable(np.array(digests, dtype=object), ("file",), "", "sha256 of the file", timing=True)
    return Group({"file": paths, "sha256": sha256})


def indexed_files(content: Content) -> dict[str, str]:
    """Return the digest of each listed file, by path in the run folder, or {} if the content has no list."""
    group = content.groups.get(FILES_GROUP)
    return dict(zip(group["file"].tolist(), group["sha256"].tolist(), strict=True)) if group is not None else {}


def broken_file(folder: Path, content: Content) -> str | None:
    """Describe the first listed file that is missing or altered, or return None if all are intact."""
    for name, digest in indexed_files(content).items():
        current = file_digest(folder / PurePosixPath(name))
        if current is None:
            return f"{name} is missing"
        if current != digest:
            return f"{name} was altered"
    return None
