"""A few lines over the paper config: how cases of a catalogue are written."""

from __future__ import annotations

from collections.abc import Mapping as Keys
from typing import Any

from walkerlab.config.files import builtin, read_layers
from walkerlab.config.layers import stacked
from walkerlab.config.loader import DEFAULT, on_the_slope
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping, Node, Position, Scalar, Sequence
from walkerlab.config.validation import typed


def over_paper(lines: Keys[str, Any], source: str) -> Config:
    """The built-in paper config with `lines` over it.

    lines   keys of a config, nested, as plain values
    source  what messages name as their origin

    Raises ConfigError if they are no config; theta_1 of a start is put on the slope without a word.
    """
    upper = tree_of(dict(lines), Position(source, 1, 1))
    assert isinstance(upper, Mapping)
    tree = stacked([*below(upper), upper])
    tree.put("name", Scalar(upper.position, DEFAULT, DEFAULT), upper.position)
    return on_the_slope(typed(tree), tree)[0]


def below(upper: Mapping) -> list[Mapping]:
    """The layers of the paper config, without its contact block if `upper` has one in SI: its numbers are in N, mm, s.

    What a block in SI leaves out has the paper's physical value all the same.
    """
    layers = read_layers(builtin(DEFAULT))
    contact = upper.entries.get("contact")
    units = contact.entries.get("units") if isinstance(contact, Mapping) else None
    in_si = isinstance(units, Scalar) and units.value == "si"
    return [layer.without("contact") for layer in layers] if in_si else layers


def tree_of(value: Any, position: Position) -> Node:
    """Plain values as a tree, all of it at one position."""
    if isinstance(value, dict):
        block = Mapping(position)
        for name, entry in value.items():
            block.put(str(name), tree_of(entry, position), position)
        return block
    if isinstance(value, list | tuple):
        return Sequence(position, [tree_of(item, position) for item in value])
    return Scalar(position, value, str(value))
