"""Write a config as YAML, with or without comments. Loading it gives an equal config."""

import json
import math
import re
import textwrap
from collections.abc import Collection, Iterator
from typing import Any, Final

from pydantic.fields import FieldInfo

from walkerlab.config import fields, reader, schema

PUNCTUATION = re.compile(r"""^[^\w./]|[:#,\[\]{}"'\n]|^$""")
"""Pattern of YAML values that need quotes."""
LINE_WIDTH: Final = 110
ELSEWHERE: Final = "left out; `walkerlab schema {}` has its keys"


def to_yaml(config: schema.Config) -> str:
    return "".join(f"{line}\n" for line in _lines(config.model_dump(mode="json"), ""))


def to_extending_yaml(start: str, base: schema.Config, changed: schema.Config, name: str) -> str:
    """Return YAML that extends `start`, the file or built-in name of `base`, by the keys that differ from it."""
    different = _different(base.model_dump(mode="json"), changed.model_dump(mode="json"))
    blocks = {"extends": start, "name": name, **{key: value for key, value in different.items() if key != "name"}}
    degrees = slope_in_degrees(changed.slope_rad)
    if "slope_rad" in blocks and degrees is not None:
        blocks["slope_deg"] = degrees
        del blocks["slope_rad"]
    return "".join(f"{line}\n" for line in _lines(blocks, ""))


def slope_in_degrees(slope_rad: float) -> float | None:
    """Return the slope in degrees if a number with at most 12 digits gives exactly this slope, otherwise None."""
    # More digits would show rounding: the conversion of 3 degrees to rad and back gives 3.0000000000000004.
    degrees = float(f"{math.degrees(slope_rad):.12g}")
    return degrees if math.radians(degrees) == slope_rad else None


def _different(base: dict[str, Any], changed: dict[str, Any]) -> dict[str, Any]:
    different: dict[str, Any] = {}
    for name, value in changed.items():
        below = base.get(name)
        if isinstance(value, dict) and isinstance(below, dict):
            if inner := _different(below, value):
                different[name] = inner
        elif name not in base or value != below:
            different[name] = value
    return different


def to_commented_yaml(config: schema.Config, left_alone: Collection[str] = ()) -> str:
    """Write a config, without the keys `left_alone`, as YAML with meaning, bounds and unit above each key."""
    kept = [name for name in type(config).model_fields if name not in left_alone]
    return commented_keys(config, kept) + "".join(f"# {name}: {ELSEWHERE.format(name)}\n" for name in left_alone)


def commented_keys(config: schema.Config, names: Collection[str]) -> str:
    """Write only some top-level keys of a config, as `to_commented_yaml` does."""
    values = config.model_dump(mode="json", include=set(names))
    return "".join(f"{line}\n" for line in _commented(config, values, ""))


def _commented(block: fields.Block, values: dict[str, Any], indent: str, path: str = "") -> Iterator[str]:
    for name, value in values.items():
        field = type(block).model_fields[name]
        content = getattr(block, name)
        if isinstance(content, fields.Block):
            yield from [""] * (not indent)
            yield from _comment(field.description or "", indent)
            yield f"{indent}{name}:"
            yield from _commented(content, value, f"{indent}  ", f"{path}{name}.")
        elif value is None and fields.block_of(field) is schema.Source:
            continue  # an absent `source` is omitted, because only a config that reproduces a study has one
        elif value is None and fields.block_of(field) is not None:
            yield f"{indent}# {name}: {ELSEWHERE.format(path + name)}"
        elif isinstance(content, tuple) and (listed := fields.block_of(field)) is not None:
            yield from _comment(field.description or "", indent)
            for inner, inner_field in listed.model_fields.items():
                yield from _comment(f"{inner}: {_meaning(inner_field)}", f"{indent}  ")
            yield f"{indent}{name}:" if content else f"{indent}{name}: []"
            for item in value:
                yield f"{indent}  - {{{', '.join(f'{key}: {_value(inner)}' for key, inner in item.items())}}}"
        else:
            yield from _comment(_meaning(field), indent)
            yield f"{indent}{name}: {_value(value)}"


def _meaning(field: FieldInfo) -> str:
    return ": ".join(part for part in (field.description, fields.describe_allowed(field)) if part)


def _comment(text: str, indent: str) -> list[str]:
    return textwrap.wrap(
        text, LINE_WIDTH, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}#   ", break_on_hyphens=False
    )


def _lines(block: dict[str, Any], indent: str) -> Iterator[str]:
    for name, value in block.items():
        if isinstance(value, dict) and value:
            yield f"{indent}{_value(name)}:"
            yield from _lines(value, f"{indent}  ")
        else:
            yield f"{indent}{_value(name)}: {_value(value)}"


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, float):
        # YAML 1.1 readers see a number only if there is a decimal point, even before an exponent.
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    if isinstance(value, str) and reader.value_of(value) == value and not PUNCTUATION.search(value):
        return value
    return json.dumps(value)
