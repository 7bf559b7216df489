"""A resolved config as YAML text, as artifacts carry it: it loads back to the same config."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from walkerlab.config.reader import value_of
from walkerlab.config.schema import Config

PUNCTUATION = re.compile(r"""^[^\w./]|[:#,\[\]{}"'\n]|^$""")
"""What YAML may read as more than text in an unquoted value."""


def to_yaml(config: Config) -> str:
    """YAML text of every key of `config`, defaults included."""
    return "".join(f"{line}\n" for line in _lines(config.model_dump(mode="json"), ""))


def _lines(block: dict[str, Any], indent: str) -> Iterator[str]:
    for name, value in block.items():
        if isinstance(value, dict):
            yield f"{indent}{name}:"
            yield from _lines(value, f"{indent}  ")
        else:
            yield f"{indent}{name}: {_value(value)}"


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, str) and value_of(value) == value and not PUNCTUATION.search(value):
        return value
    return json.dumps(value)


def _number(value: float) -> str:
    """With a point even before an exponent, so that readers of YAML 1.1 see a number too."""
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e")
