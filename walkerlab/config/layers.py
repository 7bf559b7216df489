"""Layers of a config: a file on top of the file it extends, and `--set` on top of both."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from walkerlab.config.problems import printable, problem_error
from walkerlab.config.reader import MAX_DEPTH, read
from walkerlab.config.tree import BlockNode, Node, Position, Scalar

SLOPE_KEYS: Final = ("slope_rad", "slope_deg")


@dataclass(frozen=True, slots=True)
class ConfigSetting:
    """A `--set KEY=VALUE` option."""

    path: tuple[str, ...]  # parts of the dotted key
    value: Node  # parsed value, as a tree
    position: Position  # position of the key


def merge_layers(layers: Sequence[BlockNode]) -> BlockNode:
    """Merge layers into one block. Later layers override earlier ones, and only the last one sets the name.

    Raises ConfigError if a layer has more than one slope key.
    """
    merged = layers[0]
    _refuse_two_slopes(merged.keys)
    for layer in layers[1:]:
        _refuse_two_slopes(layer.keys)
        lower = merged.without("name")
        if any(name in layer.entries for name in SLOPE_KEYS):
            lower = lower.without(*SLOPE_KEYS)
        merged = _merge_blocks(lower, layer)
    return merged


def _merge_blocks(lower: BlockNode, upper: BlockNode) -> BlockNode:
    result = lower.without()
    for name, node in upper.entries.items():
        below = lower.entries.get(name)
        if isinstance(below, BlockNode) and isinstance(node, BlockNode):
            node = _merge_blocks(below, node)
        result.put(name, node, upper.keys[name])
    return result


def _refuse_two_slopes(keys: dict[str, Position]) -> None:
    slopes = [(name, place) for name, place in keys.items() if name in SLOPE_KEYS]
    if len(slopes) == len(SLOPE_KEYS):
        (first, first_place), (second, second_place) = slopes
        where = f" at {first_place}" if first_place else ""
        raise problem_error(second_place, f"{second}: slope already set by {first}{where}", "only one of them")


def parse_setting(text: str) -> ConfigSetting:
    """Parse a `--set` option.

    Raises ConfigError if it is not KEY=VALUE with a YAML value.
    """
    # If the text has an attribute `source`, it is the option's name in messages.
    key, equals, value = text.partition("=")
    source = printable(getattr(text, "source", "")) or f"--set {printable(text)}"
    start = Position(source, 1, 1)
    path = tuple(part.strip() for part in key.split("."))
    if not equals or not all(path):
        raise problem_error(start, "is not of the form KEY=VALUE", "e.g. --set slope_deg=3")
    if len(path) > MAX_DEPTH:
        raise problem_error(start, f"nested deeper than {MAX_DEPTH} levels")
    column = len(key) + 2
    node = read(value, source, column)
    return ConfigSetting(path, node or Scalar(Position(source, 1, column), None, ""), start)


def option_setting(key: str, value: int | str) -> ConfigSetting:
    position = Position(f"--{key} {printable(str(value))}", 1, 1)
    return ConfigSetting((key,), Scalar(position, value, str(value)), position)


def apply_settings(tree: BlockNode, settings: Sequence[ConfigSetting]) -> BlockNode:
    """Apply settings in order. Lists and blocks are replaced, not merged.

    Raises ConfigError if a key's parent is no block.
    """
    _refuse_two_slopes({setting.path[0]: setting.position for setting in settings})
    copies: dict[int, BlockNode] = {}
    for setting in settings:
        if setting.path[0] in SLOPE_KEYS:
            tree = tree.without(*SLOPE_KEYS)
        tree = _place_setting(tree, setting, 0, copies)
    return tree


def _place_setting(block: BlockNode, setting: ConfigSetting, depth: int, copies: dict[int, BlockNode]) -> BlockNode:
    """Place a setting in a copy of a block. `copies` holds, by id, the copies that earlier settings made."""
    result = copies.get(id(block)) or block.without()
    copies[id(result)] = result
    name = setting.path[depth]
    if depth == len(setting.path) - 1:
        result.put(name, setting.value, setting.position)
        return result
    inner = block.entries.get(name)
    if inner is None or (isinstance(inner, Scalar) and inner.value is None):
        inner = BlockNode(setting.position)
    if not isinstance(inner, BlockNode):
        above = ".".join(setting.path[: depth + 1])
        full_key = ".".join(setting.path)
        raise problem_error(
            setting.position, f"{printable(full_key)}: {printable(above)} is a value, not a block of keys"
        )
    result.put(name, _place_setting(inner, setting, depth + 1, copies), block.keys.get(name, setting.position))
    return result
