"""A stage's result as one HDF5 file: written whole or not at all, accepted only if it is what it says it is."""

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
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


NESTED = ("config_slice", "input_keys", "library_versions", "input_digests")
"""What of an identity and a provenance is a mapping, which an attribute holds as JSON."""
ROOT_ATTRIBUTES = frozenset(one.name for one in (*fields(Identity), *fields(Provenance))) | {
    "title", "Conventions", "stage_key", "summary_json", "summary_timed", "content_digest", "complete"
}  # fmt: skip
"""What every artifact says of itself; a content with arrays at the root may say more there."""


class Damaged(Exception):  # noqa: N818 - a finding about a file, not a failure of this program
    """A file is not an artifact that can be trusted; the text says why."""


class OtherLayout(Damaged):
    """A file is an artifact of another version of this program, which nobody need be warned of."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored(Content):
    """The content of an artifact as read back, with what it was determined by and where it comes from.

    seal  sha256 of the file, provenance and timings included
    """

    identity: Identity
    provenance: Provenance
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


def write(path: Path, content: Content, identity: Identity, provenance: Provenance) -> Stored:
    """Store a result at `path`, replacing what is there in one step.

    Raises StorageError if the system refuses; what was there before is then intact, and nothing else is left.
    """
    root = root_attributes(content, identity, provenance, content.complete, content.digest())
    own = content.groups[""].attrs if "" in content.groups else {}
    if not own.keys().isdisjoint(ROOT_ATTRIBUTES):
        raise ValueError(f"attributes of the root that say something else: {sorted(own)}")
    image = hdf5.image(content.groups, {**root, **own})
    seal = hashlib.sha256(image).hexdigest()
    write_atomically(path, image, f"\nwalkerlab sha256 {seal}\n".encode())
    parts = content.groups, content.summary, content.timed
    return Stored(*parts, complete=content.complete, identity=identity, provenance=provenance, seal=seal)


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
        data = read_bounded(path, LIMIT_BYTES)
        image, end = data[:-SEAL_BYTES], SEAL.fullmatch(data[-SEAL_BYTES:])
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
        # Whatever a library makes of bytes that nobody vouches for is a finding about the file.
        raise Damaged(f"it is not an artifact: {error or type(error).__name__}") from error


def check(path: Path, key: str | None = None, stage: str | None = None) -> Verdict:
    """Whether the file at `path` is intact, of `stage` and made for `key`, if these are given; never raises."""
    try:
        artifact = read(path)
    except (FileNotFoundError, NotADirectoryError):
        return Verdict(False, NOT_THERE)
    except OtherLayout as error:
        return Verdict(False, str(error))
    except Damaged as error:
        return Verdict(False, f"damaged: {error}", damaged=True)
    if stage not in (None, artifact.identity.stage):
        return Verdict(False, f"damaged: it is a result of {artifact.identity.stage}, not of {stage}", damaged=True)
    if key not in (None, artifact.identity.key):
        return Verdict(False, "made for another key", artifact)
    return Verdict(True, "", artifact)


def root_attributes(
    content: Content, identity: Identity, provenance: Provenance, complete: bool, digest: str
) -> dict[str, Attribute]:
    """What stands at the root of the file: all but the arrays."""
    facts = {name: value for name, value in {**vars(identity), **vars(provenance)}.items() if value is not None}
    return {
        "title": f"walkerlab {identity.stage}",
        "Conventions": hdf5.CONVENTIONS,
        **{name: canonical_json(dict(value)) if name in NESTED else value for name, value in facts.items()},
        "stage_key": identity.key,
        "summary_json": json.dumps(content.summary, ensure_ascii=False, allow_nan=False),
        "summary_timed": canonical_json(content.timed),
        "content_digest": digest,
        "complete": complete,
    }


def assembled(groups: Mapping[str, Group], root: Mapping[str, Any], seal: str) -> Stored:
    """The artifact made of a file's parts; Damaged if they do not agree with its content digest and key."""
    if root.get("schema_version") != SCHEMA_VERSION:
        raise OtherLayout(f"its layout is version {root.get('schema_version')}, this program's is {SCHEMA_VERSION}")
    own = {name: value for name, value in root.items() if name not in ROOT_ATTRIBUTES}
    if "" in groups:
        groups = {**groups, "": Group(groups[""].variables, own)}
    facts = {name: json.loads(value) if name in NESTED else value for name, value in root.items()}
    identity = Identity(**{one.name: facts[one.name] for one in fields(Identity)})
    provenance = Provenance(**{one.name: facts[one.name] for one in fields(Provenance) if one.name in facts})
    artifact = Stored(
        groups,
        json.loads(root["summary_json"]),
        tuple(json.loads(root["summary_timed"])),
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
