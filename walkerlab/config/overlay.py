"""Configs that change a few keys of the paper config, such as stability cases."""

from collections.abc import Mapping
from typing import Any

from walkerlab.config.files import DEFAULT, builtin_config, read_layers
from walkerlab.config.layers import merge_layers
from walkerlab.config.problems import problem_error
from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.config.tree import BlockNode, ListNode, Node, Position, Scalar
from walkerlab.config.validation import align_start, validate_tree


def paper_config_with(lines: Mapping[str, Any], source: str = "the paper's") -> Config:
    """Build the paper config with changes (nested keys with values). Error messages name their `source`.

    Raises ConfigError if the result is invalid; a start is moved onto its constraints without a warning.
    """
    return paper_config_with_tree(tree_of(lines, Position(source, 1, 1)))


def paper_config_with_tree(upper: BlockNode) -> Config:
    """Build the paper config with a block of keys on top.

    Raises ConfigError with positions if the result is invalid.
    """
    # With SI units, keys missing in the contact block keep the paper's physical value, not its number in N, mm, s.
    layers = read_layers(builtin_config(DEFAULT))
    contact = upper.entries.get("contact")
    units = contact.entries.get("units") if isinstance(contact, BlockNode) else None
    if isinstance(units, Scalar) and units.value == "si":
        layers = [layer.without("contact") for layer in layers]
    tree = merge_layers([*layers, upper])
    tree.put("name", Scalar(upper.position, DEFAULT, DEFAULT), upper.position)
    return align_start(validate_tree(tree), tree)[0]


def check_cases(config: Config, tree: BlockNode) -> None:
    """Raise ConfigError with positions if a config's stability cases are invalid or share a name."""
    if not config.stability.cases:
        return
    block = tree.entries["stability"]
    listed = block.entries["cases"] if isinstance(block, BlockNode) else block
    assert isinstance(listed, ListNode), "validated cases are a list"
    places: dict[str, Position] = {}
    for case, node in zip(config.stability.cases, listed.items, strict=True):
        assert isinstance(node, BlockNode), "a validated case is a block"
        if case.name in places:
            raise problem_error(node.keys["name"], f"name: {case.name} is already used at {places[case.name]}")
        places[case.name] = node.keys["name"]
        lines = node.entries.get("config", BlockNode(node.position))
        assert isinstance(lines, BlockNode), "a validated config is a block"
        over = paper_config_with_tree(lines)
        if case.model == "contact":
            check_ground(case, over, lines)


def check_ground(case: Case, config: Config, lines: BlockNode) -> None:
    if config.contact is None:
        where = lines.keys.get("contact", lines.position)
        raise problem_error(where, f"contact: case {case.name} needs a contact block but has none", "model: rigid")
    if not isinstance(config.start, tuple):
        return
    # Steps are judged by the length of the start's step even where it lays no pads, so it must not be 0.
    by_start = config.contact.pad_pitch == "rigid" or config.contact.terrain == "after-mid-swing"
    if by_start and config.start[0] == config.start[1]:
        where = lines.keys.get("start", lines.position)
        text = f"start: case {case.name} starts with its feet together, but its ground needs a step length above 0"
        raise problem_error(where, text, "legs apart, or on a checkerboard contact.pad_pitch: a number")


def tree_of(block: Mapping[str, Any], position: Position) -> BlockNode:
    """Convert plain (or NumPy) values by key to a tree, all at one position."""

    def node(value: Any) -> Node:
        if isinstance(value, Mapping):
            return tree_of(value, position)
        if isinstance(value, list | tuple):
            return ListNode(position, [node(item) for item in value])
        if hasattr(value, "tolist"):  # a NumPy array or number
            return node(value.tolist())
        return Scalar(position, value, str(value))

    tree = BlockNode(position)
    for name, value in block.items():
        tree.put(str(name), node(value), position)
    return tree
