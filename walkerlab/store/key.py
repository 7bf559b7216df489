"""What a result is determined by, as a key: config slice, inputs, code."""

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from walkerlab.config.canonical import canonical_json

SCHEMA_VERSION = 2
"""Of the artifacts' layout: raise it when files written before must not be read any more."""


@dataclass(frozen=True)
class Identity:
    """All that a stage's result is determined by.

    stage           name
    config_slice    the keys of the config that the stage reads, with their values
    input_keys      the stage keys of its inputs, by stage
    code_digest     see `sources`
    schema_version  of the artifact's layout
    """

    stage: str
    config_slice: Mapping[str, Any]
    input_keys: Mapping[str, str]
    code_digest: str
    schema_version: int = SCHEMA_VERSION

    @property
    def key(self) -> str:
        """The stage key: the sha256 of it all but the name; equal for equal values, whatever their order."""
        parts = [self.schema_version, dict(self.config_slice), dict(self.input_keys), self.code_digest]
        return hashlib.sha256(canonical_json(parts).encode()).hexdigest()


def changed_parts(old: Identity, new: Identity) -> list[str]:
    """What differs between two identities, in words; empty if their keys are equal."""
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
    """The leaves in which two config slices differ, as 'walker.leg_mass_kg 5.0 -> 6.0'."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for name in sorted({*old, *new}):
            yield from differences(f"{where}.{name}" if where else name, old.get(name), new.get(name))
    elif canonical_json(old) != canonical_json(new):
        yield f"{where} {shown(old)} -> {shown(new)}"


def shown(value: Any) -> str:
    """A config value in few words."""
    if value is None:
        return "none"
    return "{...}" if isinstance(value, Mapping) else str(value)
