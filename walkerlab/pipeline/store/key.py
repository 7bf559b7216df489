"""Identity and key of a result, from its config slice, inputs and code."""

import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from walkerlab.config.canonical import canonical_json

SCHEMA_VERSION = 3
"""Version of the artifacts' layout."""
READABLE: Final = (2, SCHEMA_VERSION)
"""Versions of the layout that can be read; in version 2 text has variable length."""
DIGEST: Final = re.compile("[0-9a-f]{64}")


@dataclass(frozen=True)
class Identity:
    """Everything that determines a stage's result."""

    stage: str  # name of the stage
    config_slice: Mapping[str, Any]  # keys of the config that the stage reads, with their values
    input_keys: Mapping[str, str]  # stage keys of its inputs, by stage
    code_digest: str  # digest of the stage's code, see `walkerlab.code_digest`
    schema_version: int = SCHEMA_VERSION  # version of the artifact's layout

    @property
    def key(self) -> str:
        """Stage key: sha256 of all fields except the name. The order of keys does not matter."""
        parts = [self.schema_version, dict(self.config_slice), dict(self.input_keys), self.code_digest]
        return hashlib.sha256(canonical_json(parts).encode()).hexdigest()


def changed_parts(old: Identity, new: Identity) -> list[str]:
    """Describe the differences between two identities, or return none if their keys are equal."""
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
    """Iterate over the differing values of two config slices, as text such as 'walker.leg_mass_kg 5.0 -> 6.0'."""
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
