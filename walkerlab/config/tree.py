"""Untyped tree of a config text: scalars, lists and blocks, each with its position."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Position:
    """Place in a config text: file or option, with line and column counted from 1. Line 0 means the entire source."""

    source: str
    line: int
    column: int

    def __bool__(self) -> bool:
        """Whether there is a position. Values passed from Python have none."""
        return bool(self.source)

    def __str__(self) -> str:
        """Format as source:line:column, which editors understand. Options have no line and column."""
        without_line = not self.line or self.source.startswith("--")
        return self.source if without_line else f"{self.source}:{self.line}:{self.column}"


NOWHERE = Position("", 0, 0)
"""Position of values passed from Python, which come from neither a file nor an option."""


@dataclass(frozen=True, slots=True)
class Scalar:
    position: Position
    value: str | int | float | bool | None
    text: str


@dataclass(frozen=True, slots=True)
class ListNode:
    position: Position
    items: list["Node"] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class BlockNode:
    """Block of keys. `entries` maps each key to its value, and `keys` to the position of the key itself."""

    position: Position
    entries: dict[str, "Node"] = field(default_factory=dict)
    keys: dict[str, Position] = field(default_factory=dict)

    def put(self, name: str, node: "Node", position: Position) -> None:
        self.entries[name] = node
        self.keys[name] = position

    def copy_without(self, *names: str) -> "BlockNode":
        entries = {name: node for name, node in self.entries.items() if name not in names}
        return BlockNode(self.position, entries, {name: self.keys[name] for name in entries})


Node: TypeAlias = Scalar | ListNode | BlockNode
Data: TypeAlias = "str | int | float | bool | list[Data] | dict[str, Data] | None"


def plain(node: Node, value_of: Callable[[Scalar], Data] = lambda scalar: scalar.value) -> Data:
    """Convert a node to plain data. `value_of` converts its scalars."""
    if isinstance(node, Scalar):
        return value_of(node)
    if isinstance(node, ListNode):
        return [plain(item, value_of) for item in node.items]
    return {name: plain(entry, value_of) for name, entry in node.entries.items()}


def as_typed(node: Node) -> Data:
    """Convert a node as `plain` does, but keep numbers as text, as they were typed."""
    return plain(node, lambda scalar: None if scalar.value is None else scalar.text)
