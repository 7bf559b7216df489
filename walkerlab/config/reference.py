"""The reference of all config keys, made from the schema: a table for people, a JSON schema for editors."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from typing import Any, Final

from pydantic.fields import FieldInfo

from walkerlab.config.fields import block_of, bounds_of, extra, kind, leaves, leaves_of_other_kinds
from walkerlab.config.files import builtin_names
from walkerlab.config.numbers import short
from walkerlab.config.problems import nearest
from walkerlab.config.schema import Config, SlopeInDegrees
from walkerlab.errors import ConfigError

COLUMNS: Final = 79
OF_A_KIND: Final = re.compile(r"\([a-z-]+\)")
"""What tells a block's kinds apart in the name of a key; no config has it."""
EXTENDS_MEANING: Final = "config this one inherits from: a file, from this file's folder, or the name of a built-in one"


@dataclass(frozen=True, slots=True)
class KeyReference:
    """What there is to know about one key; every entry is a text."""

    key: str
    type: str
    unit: str
    bounds: str
    default: str
    meaning: str
    source: str


def keys() -> tuple[KeyReference, ...]:
    """Every key of a config file, in the order of the schema."""
    return tuple(_keys())


def _keys() -> Iterator[KeyReference]:
    builtins = ", ".join(builtin_names())
    yield KeyReference("extends", "text", "", f"a file, {builtins}", "none", EXTENDS_MEANING, "this project")
    for path, field in leaves(Config):
        yield _reference(path, field)
        if path == ("slope_rad",):
            yield _reference(("slope_deg",), SlopeInDegrees.model_fields["slope_deg"])
    for path, field in leaves_of_other_kinds(Config):
        yield _reference(path, field)


def _reference(path: tuple[str, ...], field: FieldInfo) -> KeyReference:
    return KeyReference(
        key=".".join(path),
        type=kind(field.annotation),
        unit=extra(field, "unit"),
        bounds=bounds_of(field),
        default=_default(field),
        meaning=field.description or "",
        source=extra(field, "source"),
    )


def _default(field: FieldInfo) -> str:
    spoken = extra(field, "default_in_words")
    if spoken or field.is_required():
        return spoken or "none"
    return _spelled(field.default)


def _spelled(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_spelled(item) for item in value)}]"
    return short(value) if isinstance(value, int | float) else str(value)


def as_text() -> str:
    """Markdown table of every key, aligned so that it reads well in a terminal too."""
    rows = [tuple(field.name for field in fields(KeyReference)), *(astuple(row) for row in keys())]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = [_line(row, widths) for row in rows]
    lines.insert(1, _line(["-" * width for width in widths], widths))
    optional = [name for name, field in Config.model_fields.items() if block_of(field) and field.default is None]
    notes = [f"The block `{name}` may be left out; what needs it is then left out too." for name in optional]
    return "\n".join([*lines, "", *notes, ""])


def as_paragraphs(asked: str = "") -> str:
    """The keys for a terminal, each as a short paragraph; only those of a block or key, if one is asked for.

    Raises ConfigError with the nearest key if there is no such block or key.
    """
    plain = {key: OF_A_KIND.sub("", key.key) for key in keys()}
    found = [key for key in plain if not asked or any(is_in(asked, name) for name in (key.key, plain[key]))]
    if not found:
        names = {".".join(name.split(".")[:depth]) for name in plain.values() for depth in (1, 2, 3)}
        near = nearest(asked, names) or nearest(asked, {name.split(".")[-1] for name in names})
        meant = f" Did you mean {near}?" if near else ""
        raise ConfigError(f"the config has no key {asked}.{meant}", "`walkerlab schema` lists every key")
    return "\n\n".join("\n".join(_paragraph(key)) for key in found)


def is_in(asked: str, key: str) -> bool:
    """Whether a key is the one that was asked for, or in the block that was."""
    return key == asked or key.startswith(f"{asked}.")


def _paragraph(key: KeyReference) -> Iterator[str]:
    yield key.key
    what = [key.type, f"in {key.unit}" if key.unit not in ("", "1") else "", key.bounds]
    facts = [", ".join(part for part in what if part), f"default: {key.default}", key.meaning, f"source: {key.source}"]
    for fact in facts:
        yield from textwrap.wrap(fact, COLUMNS, initial_indent="    ", subsequent_indent="      ")


def _line(cells: tuple[str, ...] | list[str], widths: list[int]) -> str:
    return f"| {' | '.join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True))} |"


def as_json_schema() -> dict[str, Any]:
    """JSON schema of a config file."""
    schema = Config.model_json_schema()
    degrees = SlopeInDegrees.model_json_schema()["properties"]["slope_deg"]
    extends = {"type": "string", "description": EXTENDS_MEANING, "examples": list(builtin_names())}
    schema["properties"] = {"extends": extends, **schema["properties"], "slope_deg": degrees}
    schema["not"] = {"required": ["slope_rad", "slope_deg"]}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
