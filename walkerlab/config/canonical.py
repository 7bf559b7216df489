"""Parts of a config: the slice a stage reads, one text for one content, and a view that shows no more than that."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Final, cast

from walkerlab.config.fields import Block, block_of
from walkerlab.config.schema import Config

QUANTITIES: Final = {"slope": "slope_rad", "gravity": "gravity_m_s2"}
"""Names without their unit, as a stage may declare them."""


def slice_of(config: Config, reads: tuple[str, ...]) -> dict[str, Any]:
    """The part of `config` that `reads` names, nested as in the config, of JSON types only.

    reads   dotted keys, e.g. ("walker", "slope", "solver.rigid"); a block that is left out appears as None

    Raises AttributeError if a key is not in the schema.
    """
    everything = config.model_dump(mode="json")
    part: dict[str, Any] = {}
    for path in _paths(reads):
        _copy(everything, part, path)
    return part


def _copy(source: dict[str, Any], target: dict[str, Any], path: tuple[str, ...]) -> None:
    name, rest = path[0], path[1:]
    if not rest or source[name] is None or isinstance(source[name], list):  # of a list's items all or none
        target[name] = source[name]
    else:
        _copy(source[name], target.setdefault(name, {}), rest)


def canonical_json(data: Any) -> str:
    """One text for one content: sorted keys, no blanks, ASCII; floats as the shortest text that reads back the same.

    Raises ValueError if a number is not finite.
    """
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)


def only(config: Config, reads: tuple[str, ...]) -> Config:
    """View of `config` that shows what `reads` names and nothing else.

    A block that is named whole is the block itself; reading any other key raises AttributeError, which is a bug in
    the stage that declared `reads`.
    """
    return cast(Config, _View(config, frozenset(_paths(reads)), ()))


class _View:
    """Stand-in for a block of which a stage reads a part."""

    __slots__ = ("_block", "_path", "_reads")

    def __init__(self, block: Block, reads: frozenset[tuple[str, ...]], path: tuple[str, ...]) -> None:
        self._block = block
        self._reads = reads
        self._path = path

    def __getattr__(self, name: str) -> Any:
        path = (*self._path, name)
        inside = [read for read in self._reads if read[: len(path)] == path]
        if not inside:
            declared = ", ".join(sorted(".".join(read) for read in self._reads))
            raise AttributeError(
                f"config key '{'.'.join(path)}' is not declared by this stage, which reads: {declared}"
            )
        value = getattr(self._block, name)
        return value if path in inside or value is None else _View(value, self._reads, path)

    def __repr__(self) -> str:
        return f"only({', '.join(sorted('.'.join(read) for read in self._reads))})"


def _paths(reads: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    for read in reads:
        path = tuple(QUANTITIES.get(read, read).split("."))
        block: type[Block] | None = Config
        for name in path:
            if block is None or name not in block.model_fields:
                raise AttributeError(f"the config has no key '{read}'")
            block = block_of(block.model_fields[name])
        yield path
