"""Selected parts of a config, and canonical JSON, for making the keys of results."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from walkerlab.config.reads import keys_of
from walkerlab.config.schema import Config


def slice_of(config: Config, takes: type | None) -> dict[str, Any]:
    """Return the keys of a config that a type of `config.reads` lists, as nested JSON data. None returns all keys.

    Raises KeyError if a key is not in the schema.
    """

    def part(data: Any, takes: type | None) -> Any:
        return data if takes is None else {name: part(data[name], inner) for name, inner in keys_of(takes).items()}

    selected: dict[str, Any] = part(config.model_dump(mode="json"), takes)
    return selected


def flatten(block: Mapping[str, Any], lists: bool = False, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted names and values of nested objects. `lists` also splits lists into items, named by their index."""
    for name, value in block.items():
        inner = {str(place): item for place, item in enumerate(value)} if lists and isinstance(value, list) else value
        if isinstance(inner, Mapping):
            yield from flatten(inner, lists, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def canonical_json(data: Any) -> str:
    """Serialise so that equal content gives equal text: sorted keys, no blanks, ASCII, shortest floats.

    Raises ValueError if a number is not finite.
    """
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
