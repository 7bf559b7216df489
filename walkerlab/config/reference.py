"""Reference of all config keys, generated from the schema: paragraphs, and a JSON schema for editors."""

import json
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from walkerlab.config import fields, files, problems
from walkerlab.config.schema import Config, SlopeInDegrees
from walkerlab.errors import ConfigError

TEXT_WIDTH: Final = 79
SHOWN_KEYS: Final = 4  # largest number of keys that a message suggests
KIND_SUFFIX: Final = re.compile(r"\([a-z-]+\)")
"""Pattern for the kind of block in a key's name, such as `(kneed)`, which says that only blocks of that kind have the
key."""
SCHEMA_REFERENCE: Final = re.compile(r'"#/\$defs/([^"]+)"')
EXTENDS_MEANING: Final = "config to inherit from: a file, relative to this file's folder, or a built-in name"


@dataclass(frozen=True, slots=True)
class KeyReference:
    """Description of one config key. Every field is text."""

    key: str
    type: str
    unit: str
    bounds: str
    default: str
    meaning: str
    source: str


def keys() -> Iterator[KeyReference]:
    """Yield every key of a config file, in the schema's order."""
    extends = fields.key(None, "", EXTENDS_MEANING, bounds=f"a file, {', '.join(files.builtin_names())}")
    yield _reference(("extends",), FieldInfo.from_annotated_attribute(str, extends))
    for path, field in fields.leaves(Config):
        yield _reference(path, field)
        if path == ("slope_rad",):
            yield _reference(("slope_deg",), SlopeInDegrees.model_fields["slope_deg"])
    for path, field in fields.leaves_of_other_kinds(Config):
        yield _reference(path, field)


def _reference(path: tuple[str, ...], field: FieldInfo) -> KeyReference:
    default = field.get_default(call_default_factory=True, validated_data={})
    return KeyReference(
        key=".".join(path),
        type=fields.describe_type(field.annotation),
        unit=fields.annotation_of(field, "unit"),
        bounds=fields.bounds_of(field),
        default=fields.annotation_of(field, "default_in_words") or _format_default(default),
        meaning=field.description or "",
        source=fields.annotation_of(field, "source"),
    )


def _format_default(value: Any) -> str:
    if value in (None, {}, PydanticUndefined):
        return "none"
    if isinstance(value, tuple):
        return f"[{', '.join(_format_default(item) for item in value)}]"
    return fields.short_number(value) if isinstance(value, int | float) else str(value)


def as_paragraphs(selection: str = "") -> str:
    """Describe keys for a terminal, one paragraph each: a block's keys, a single key, or by default all keys.

    Raises ConfigError with the nearest key if there is no such block or key.
    """
    paragraphs = []
    for key in select_keys(selection):
        what = [key.type, f"in {key.unit}" if key.unit not in ("", "1") else "", key.bounds]
        facts = [", ".join(filter(None, what)), f"default: {key.default}", key.meaning, f"source: {key.source}"]
        wrapped = [textwrap.fill(fact, TEXT_WIDTH, initial_indent="    ", subsequent_indent="      ") for fact in facts]
        paragraphs.append("\n".join([key.key, *filter(None, wrapped)]))
    return "\n\n".join(paragraphs)


def select_keys(selection: str) -> list[KeyReference]:
    """Return a block's keys, a single key, or by default all keys.

    Keys that are equal in every kind of a block are listed only once.

    Raises ConfigError with the nearest key if none match.
    """
    plain = {key: KIND_SUFFIX.sub("", key.key) for key in keys()}
    beginning = f"{selection}." if selection else ""
    matches = [key for key in plain if any(f"{name}.".startswith(beginning) for name in (key.key, plain[key]))]
    if not matches:
        names = dict.fromkeys(".".join(name.split(".")[:depth]) for name in plain.values() for depth in (1, 2, 3))
        similar = " or ".join([name for name in names if selection in name.split(".")[-1]][:SHOWN_KEYS])
        by_end = {name.split(".")[-1]: name for name in reversed(names)}
        near = similar or problems.nearest(selection, names) or by_end.get(problems.nearest(selection, by_end), "")
        meant = f" Did you mean {near}?" if near else ""
        raise ConfigError(f"the config has no key {selection}.{meant}", "`walkerlab schema` lists every key")
    everywhere = {key for key in matches if key.key == plain[key]}
    return [key for key in matches if key in everywhere or replace(key, key=plain[key]) not in everywhere]


def as_json_schema(selection: str = "") -> dict[str, Any]:
    """Return the JSON schema of a config file, or of one block or key.

    Raises ConfigError with the nearest key if there is no such block or key.
    """
    schema = Config.model_json_schema()
    degrees = SlopeInDegrees.model_json_schema()["properties"]["slope_deg"]
    extends = {"type": "string", "description": EXTENDS_MEANING, "examples": list(files.builtin_names())}
    schema["properties"] = {"extends": extends, **schema["properties"], "slope_deg": degrees}
    schema["not"] = {"required": ["slope_rad", "slope_deg"]}
    part = schema if not selection else part_of(schema, selection)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **part}


def part_of(schema: dict[str, Any], selection: str) -> dict[str, Any]:
    """Return the part of a JSON schema that describes a block or key, with the definitions it refers to."""
    select_keys(selection)
    definitions = schema["$defs"]
    parts = [schema]
    for name in selection.split("."):
        plain, _, kind = name.rstrip(")").partition("(")
        blocks = [block for part in parts for block in blocks_of(part, definitions)]
        parts = [block["properties"][plain] for block in blocks if plain in block["properties"]]
        if kind:
            of_kinds = [block for part in parts for block in blocks_of(part, definitions)]
            parts = [block for block in of_kinds if block["properties"]["type"].get("const") == kind]
    unlike = list({json.dumps(part): part for part in parts}.values())
    result = unlike[0] if len(unlike) == 1 else {"anyOf": unlike}
    needed: set[str] = set()
    while more := set(SCHEMA_REFERENCE.findall(json.dumps([result, *(definitions[name] for name in needed)]))) - needed:
        needed |= more
    return {**result, "$defs": {name: definitions[name] for name in sorted(needed)}} if needed else result


def blocks_of(part: dict[str, Any], definitions: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if "properties" in part:
        yield part
    choices = [*part.get("anyOf", ()), *part.get("oneOf", ())]
    if "$ref" in part:
        choices.append(definitions[part["$ref"].rpartition("/")[2]])
    for choice in choices:
        yield from blocks_of(choice, definitions)
