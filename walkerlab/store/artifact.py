"""A stage's result as one HDF5 file: written whole or not at all, accepted only if it is what it says it is."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkerlab.config.canonical import canonical_json
from walkerlab.store import hdf5
from walkerlab.store.content import Attribute, Content, Digest, Group, Variable
from walkerlab.store.files import file_digest, read_bounded, refuse_full_disk, replacing, write_atomically
from walkerlab.store.key import SCHEMA_VERSION, Identity
from walkerlab.store.provenance import Provenance

NOT_THERE = "not there yet"
"""Why a result is made that never was."""

LIMIT_BYTES = 1 << 30
"""No artifact is larger; a file that is, is not read."""

# At the end of the file, after all that HDF5 knows of: a damaged file must be found out before the HDF5 library sees
# it, which frees memory twice on some of them.
SEAL = re.compile(rb"\nwalkerlab sha256 ([0-9a-f]{64})\n")
SEAL_BYTES = 83


ROOT_ATTRIBUTES = frozenset(
    {
        "stage", "stage_key", "schema_version", "config_slice", "input_keys", "code_digest", "config", "command_line",
        "seed", "started_utc", "ended_utc", "platform", "package_version", "library_versions", "git_commit",
        "input_digests", "summary_json", "summary_timed", "content_digest", "complete",
    }
)  # fmt: skip
"""What every artifact says of itself; a content with arrays at the root may say more there."""


class Damaged(Exception):  # noqa: N818 - a finding about a file, not a failure of this program
    """A file is not an artifact that can be trusted; the text says why."""


class OtherLayout(Damaged):
    """A file is an artifact of another version of this program, which nobody need be warned of."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored(Content):
    """The content of an artifact as read back, with what it was determined by and where it comes from.

    complete  False for the partial results of a stage that found no answer
    seal      sha256 of the file, provenance and timings included
    """

    identity: Identity
    provenance: Provenance
    complete: bool
    seal: str


@dataclass(frozen=True)
class Verdict:
    """Whether a file is the artifact that a key asks for.

    reason    in words; empty if accepted
    artifact  what was read, also when it belongs to another key; None if missing or damaged
    damaged   there is a file, and it is not to be trusted
    """

    accepted: bool
    reason: str
    artifact: Stored | None = None
    damaged: bool = False


def write(path: Path, content: Content, identity: Identity, provenance: Provenance, complete: bool = True) -> Stored:
    """Store a result at `path`, replacing what is there in one step.

    Raises StorageError if the system refuses; what was there before is then intact, and nothing else is left.
    """
    root = root_attributes(content, identity, provenance, complete, content.digest())
    own = content.groups[""].attrs if "" in content.groups else {}
    if not own.keys().isdisjoint(ROOT_ATTRIBUTES):
        raise ValueError(f"attributes of the root that say something else: {sorted(own)}")
    image = hdf5.image(content.groups, {**root, **own})
    seal = hashlib.sha256(image).hexdigest()
    write_atomically(path, image, f"\nwalkerlab sha256 {seal}\n".encode())
    return Stored(
        groups=content.groups,
        summary=content.summary,
        timed=content.timed,
        identity=identity,
        provenance=provenance,
        complete=complete,
        seal=seal,
    )


@dataclass(frozen=True)
class InTurn:
    """A content with one group whose variables are made one by one, so that they are never in memory together.

    coordinates  those of the variables that are dimensions' coordinates
    variables    all of them in the order of their names
    size         about how many bytes they take
    """

    summary: Mapping[str, Any]
    attrs: Mapping[str, Attribute]
    coordinates: Mapping[str, Variable]
    variables: Iterable[tuple[str, Variable]]
    size: int


def write_in_turn(
    path: Path, content: InTurn, identity: Identity, provenance: Provenance, complete: bool = True
) -> None:
    """Store what `write` would, but for the order of things in the file, with the memory that one variable takes.

    Raises StorageError if the system refuses; what was there before is then intact, and nothing else is left.
    """
    labelled = Content({}, content.summary)
    digest = Digest(labelled.summary, labelled.timed)
    digest.enter("", content.attrs)

    def told() -> Iterator[tuple[str, Variable]]:
        yield from content.coordinates.items()
        for name, variable in content.variables:
            digest.add(name, variable)
            if name not in content.coordinates:
                yield name, variable

    with replacing(path) as temporary:
        # Where the disk is full an ordinary call has to say so: the HDF5 library cannot close what it cannot write.
        refuse_full_disk(temporary, content.size)
        hdf5.write_in_turn(
            temporary,
            told(),
            lambda: {**root_attributes(labelled, identity, provenance, complete, digest.hex()), **content.attrs},
        )
        seal = file_digest(temporary)
        with temporary.open("ab") as file:
            file.write(f"\nwalkerlab sha256 {seal}\n".encode())


def read(path: Path) -> Stored:
    """The artifact at `path`.

    Raises FileNotFoundError if there is none, and Damaged for whatever is not intact: cut short, altered, hostile.
    """
    try:
        image, seal = unsealed(read_bounded(path, LIMIT_BYTES))
        groups, root = hdf5.parse(image)
        return assembled(groups, root, seal)
    except (FileNotFoundError, Damaged):
        raise
    except OSError as error:
        raise Damaged(f"it cannot be read: {error.strerror or error}") from error
    except Exception as error:
        # Whatever a library makes of bytes that nobody vouches for is a finding about the file.
        raise Damaged(f"it is not an artifact: {error or type(error).__name__}") from error


def check(path: Path, key: str) -> Verdict:
    """Whether the file at `path` is intact and is the artifact for `key`; never raises for what the file may be."""
    try:
        artifact = read(path)
    except (FileNotFoundError, NotADirectoryError):
        return Verdict(False, NOT_THERE)
    except OtherLayout as error:
        return Verdict(False, str(error))
    except Damaged as error:
        return Verdict(False, f"damaged: {error}", damaged=True)
    if artifact.identity.key != key:
        return Verdict(False, "made for another key", artifact)
    return Verdict(True, "", artifact)


def root_attributes(
    content: Content, identity: Identity, provenance: Provenance, complete: bool, digest: str
) -> dict[str, str | int | bool]:
    """What stands at the root of the file: all but the arrays."""
    root: dict[str, str | int | bool] = {
        "stage": identity.stage,
        "stage_key": identity.key,
        "schema_version": identity.schema_version,
        "config_slice": canonical_json(dict(identity.config_slice)),
        "input_keys": canonical_json(dict(identity.input_keys)),
        "code_digest": identity.code_digest,
        "config": provenance.config,
        "command_line": provenance.command_line,
        "seed": provenance.seed,
        "started_utc": provenance.started_utc,
        "ended_utc": provenance.ended_utc,
        "platform": provenance.platform,
        "package_version": provenance.package_version,
        "library_versions": canonical_json(dict(provenance.library_versions)),
        "input_digests": canonical_json(dict(provenance.input_digests)),
        "summary_json": json.dumps(content.summary, ensure_ascii=False, allow_nan=False),
        "summary_timed": canonical_json(content.timed),
        "content_digest": digest,
        "complete": complete,
    }
    if provenance.git_commit is not None:
        root["git_commit"] = provenance.git_commit
    return root


def unsealed(data: bytes) -> tuple[bytes, str]:
    """The HDF5 part of a file's bytes, and its sha256; Damaged if that is not what the seal at the end says."""
    image, end = data[:-SEAL_BYTES], data[-SEAL_BYTES:]
    seal = SEAL.fullmatch(end)
    if seal is None:
        raise Damaged("it does not end with the seal of a finished artifact: cut short, or not written by walkerlab")
    if hashlib.sha256(image).hexdigest().encode() != seal[1]:
        raise Damaged("it was altered after it was finished")
    return image, seal[1].decode()


def assembled(groups: Mapping[str, Group], root: Mapping[str, Any], seal: str) -> Stored:
    """The artifact made of a file's parts; Damaged if they do not agree with its content digest and key."""
    if root.get("schema_version") != SCHEMA_VERSION:
        raise OtherLayout(f"its layout is version {root.get('schema_version')}, this program's is {SCHEMA_VERSION}")
    own = {name: value for name, value in root.items() if name not in ROOT_ATTRIBUTES}
    if "" in groups:
        groups = {**groups, "": Group(groups[""].variables, own)}
    identity = Identity(
        stage=root["stage"],
        config_slice=json.loads(root["config_slice"]),
        input_keys=json.loads(root["input_keys"]),
        code_digest=root["code_digest"],
    )
    provenance = Provenance(
        config=root["config"],
        command_line=root["command_line"],
        seed=root["seed"],
        started_utc=root["started_utc"],
        ended_utc=root["ended_utc"],
        platform=root["platform"],
        package_version=root["package_version"],
        library_versions=json.loads(root["library_versions"]),
        git_commit=root.get("git_commit"),
        input_digests=json.loads(root["input_digests"]),
    )
    artifact = Stored(
        groups=groups,
        summary=json.loads(root["summary_json"]),
        timed=tuple(json.loads(root["summary_timed"])),
        identity=identity,
        provenance=provenance,
        complete=root["complete"],
        seal=seal,
    )
    if artifact.digest() != root["content_digest"]:
        raise Damaged("its content does not have the digest that it was stored with")
    if identity.key != root["stage_key"]:
        raise Damaged("its key is not that of the config, inputs and code it names")
    return artifact
