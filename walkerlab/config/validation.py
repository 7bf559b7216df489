"""A tree typed by the schema; whatever does not fit is reported with its position, all at once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from walkerlab.config.fields import Block, allowed, block_of, kinds_of, leaves, words_of
from walkerlab.config.files import DEFAULT, builtin, builtin_names, read_layers
from walkerlab.config.layers import stacked
from walkerlab.config.problems import Problem, nearest, refusal, shown, shown_value
from walkerlab.config.schema import Config, SlopeInDegrees
from walkerlab.config.tree import Mapping, Node, Position, Scalar, Sequence, plain
from walkerlab.config.walkers import PartsWalker

_REASONS: Final = {
    "float_type": "is not a number",
    "int_type": "is not an integer",
    "string_type": "is not a text",
    "tuple_type": "is not a list",
    "model_type": "is not a block of keys",
    "finite_number": "is not finite",
    "literal_error": "is not allowed",
    "greater_than": "is out of bounds",
    "greater_than_equal": "is out of bounds",
    "less_than": "is out of bounds",
    "less_than_equal": "is out of bounds",
    "missing": "has too few values",
    "too_long": "has too many values",
    "string_pattern_mismatch": "is not safe as a name",
    "union_tag_invalid": "is of no known type",
}
MAX_PROBLEMS: Final = 100
_FOLLOWS_FROM_ANOTHER: Final = "default_factory_not_called"


def typed(tree: Mapping) -> Config:
    """The config that a tree describes.

    Raises ConfigError with every problem found.
    """
    problems: list[Problem] = []
    data: dict[str, Any] = {name: plain(node) for name, node in tree.entries.items()}
    if "slope_deg" in data:
        degrees = data.pop("slope_deg")
        try:
            data["slope_rad"] = math.radians(SlopeInDegrees(slope_deg=degrees).slope_deg)
        except ValidationError as error:
            problems += _problems(error, tree, SlopeInDegrees)
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        problems += _problems(error, tree, Config)
    if problems:
        raise refusal(sorted(problems, key=_place))
    refuse_unknown_bodies(config, tree)
    return config


def refuse_unknown_bodies(config: Config, tree: Mapping) -> None:
    """Raise ConfigError with their places for parts that are on bodies that the walker has not, or on the wrong leg."""
    walker = config.walker
    if not isinstance(walker, PartsWalker):
        return
    bodies = [body.name for body in walker.bodies]
    problems = []
    for place, name in bodies_named(walker):
        if name not in bodies:
            text = f"{dotted(place)}: {shown(name)} is not a body"
            problems.append(Problem(_node_at(tree, place)[1], text, ", ".join(bodies), nearest(name, bodies)))
    for k, (foot, leg) in enumerate(zip(walker.feet, walker.legs, strict=True)):
        if foot.body in bodies and foot.body not in leg:
            place = ("walker", "feet", k, "body")
            text = f"{dotted(place)}: {shown(foot.body)} is not of leg {k + 1}, whose foot this is"
            problems.append(Problem(_node_at(tree, place)[1], text, ", ".join(leg)))
    if problems:
        raise refusal(sorted(problems, key=_place), "docs/walkers.md shows a walker described by its parts.")


def bodies_named(walker: PartsWalker) -> Iterator[tuple[tuple[int | str, ...], str]]:
    """Where parts name a body, and which."""
    for k, hinge in enumerate(walker.hinges):
        yield ("walker", "hinges", k, "parent"), hinge.parent
        yield ("walker", "hinges", k, "child"), hinge.child
    for key in ("particles", "feet", "couplings"):
        for k, part in enumerate(getattr(walker, key)):
            yield ("walker", key, k, "body"), part.body
    for k, coupling in enumerate(walker.couplings):
        yield from ((("walker", "couplings", k, "of", n), name) for n, name in enumerate(coupling.of))
    for k, leg in enumerate(walker.legs):
        yield from ((("walker", "legs", k, n), name) for n, name in enumerate(leg))


def dotted(place: tuple[int | str, ...]) -> str:
    """A place in a config as a key, places in lists counted from 0."""
    return ".".join(map(str, place))


def _place(problem: Problem) -> tuple[str, int, int]:
    where = problem.position
    return (where.source, where.line, where.column) if where else ("", 0, 0)


def _problems(error: ValidationError, tree: Mapping, model: type[Block]) -> list[Problem]:
    details = error.errors(include_url=False)[:MAX_PROBLEMS]
    return [_problem(detail, tree, model) for detail in details if detail["type"] != _FOLLOWS_FROM_ANOTHER]


def _problem(detail: ErrorDetails, tree: Mapping, model: type[Block]) -> Problem:
    location = without_kinds(model, detail["loc"])
    if detail["type"] == "union_tag_invalid":
        return _unknown_kind(location, tree, model)
    if detail["type"] == "extra_forbidden":
        return _unknown_key(location, tree)
    path, field = _field_at(model, location, tree)
    node, position = _node_at(tree, location)
    if node is None and detail["type"] == "missing":
        return Problem(position, f"{'.'.join(path)}: is missing", allowed(field))
    value = shown_value(node) if node else f"{detail['input']} (its default)"
    text = f"{'.'.join(path)}: {value} {_REASONS.get(detail['type'], detail['msg'])}"
    word = node.value if isinstance(node, Scalar) and isinstance(node.value, str) else ""
    meant = nearest(word, words_of(field)) if word else ""
    return Problem(position, text, allowed(field) if detail["type"] in _REASONS else "", meant if meant != word else "")


def without_kinds(model: type[Block], location: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """A location without the words that tell a block's kinds apart, which pydantic puts into it."""
    path: list[int | str] = []
    block: type[Block] | None = model
    kinds: dict[str, type[Block]] = {}
    for part in location:
        if part in kinds:
            block, kinds = kinds[str(part)], {}
            continue
        path.append(part)
        if isinstance(part, str) and block is not None and part in block.model_fields:
            field = block.model_fields[part]
            block, kinds = block_of(field), kinds_of(field)
    return tuple(path)


def _kinds_in(tree: Mapping, path: tuple[int | str, ...], field: FieldInfo) -> type[Block] | None:
    """The block that a key holds in this tree, by its `type`."""
    kinds = kinds_of(field)
    node, _ = _node_at(tree, path)
    if not kinds or not isinstance(node, Mapping):
        return block_of(field)
    chosen = node.entries.get("type")
    return kinds.get(str(chosen.value) if isinstance(chosen, Scalar) else "", block_of(field))


def _unknown_kind(location: tuple[int | str, ...], tree: Mapping, model: type[Block]) -> Problem:
    kinds = kinds_of(model.model_fields[str(location[0])])
    node, position = _node_at(tree, (*location, "type"))
    word = str(node.value) if isinstance(node, Scalar) else ""
    text = f"{location[0]}.type: {shown(word)} is of no known type"
    return Problem(position, text, f"one of {', '.join(kinds)}", nearest(word, kinds))


def _unknown_key(location: tuple[int | str, ...], tree: Mapping) -> Problem:
    path = tuple(part for part in location if isinstance(part, str))  # without places in lists
    block: type[Block] = Config
    for depth, above in enumerate(path[:-1]):
        if above in block.model_fields:
            field = block.model_fields[above]
            block = _kinds_in(tree, path[: depth + 1], field) or block
            if depth == len(path) - 2 and any(path[-1] in kind.model_fields for kind in kinds_of(field).values()):
                return _key_of_another_kind(path, tree, block, kinds_of(field))
    name = path[-1]
    parent, _ = _node_at(tree, location[:-1])
    position = parent.keys[name] if isinstance(parent, Mapping) else tree.position
    node, _ = _node_at(tree, location)
    if path == ("extends",):
        return Problem(position, "extends: belongs in a file, not in --set", "-c FILE with `extends` in it")
    siblings = [*block.model_fields, *(("slope_deg", "extends") if block is Config else ())]
    beside = nearest(name, siblings) if "." not in name else ""
    meant = ".".join((*path[:-1], beside)) if beside else _elsewhere(name, exactly=len(path) > 1)
    value = f" ({shown_value(node)})" if node else ""
    text = f"{shown('.'.join(path))}: unknown key{value}"
    return Problem(position, text, ", ".join(siblings), meant)


def _key_of_another_kind(
    path: tuple[str, ...], tree: Mapping, block: type[Block], kinds: dict[str, type[Block]]
) -> Problem:
    """What to say of a key that another type of the block has; the same for all such keys of one source."""
    given, _ = _node_at(tree, path[:-1])
    assert isinstance(given, Mapping), "it holds the key"
    source = given.keys[path[-1]].source
    others = {key for one in kinds.values() for key in one.model_fields} - {*block.model_fields}
    strange = {key: place for key, place in given.keys.items() if key in others and place.source == source}
    where = next(iter(strange.values()))
    chosen = next(kind for kind, one in kinds.items() if one is block)
    other = next(kind for kind, one in kinds.items() if next(iter(strange)) in one.model_fields)
    above, keys = ".".join(path[:-1]), ", ".join(strange)
    type_at = given.keys.get("type", where)
    if source.startswith("--") or type_at.source in (source, builtin(DEFAULT).label):
        text = f"{above}.type is {chosen}, which has no {keys} (of type {other})"
        return Problem(where, text, ", ".join(block.model_fields))
    text = f"{above}.type: {chosen} has no {keys} (of type {other}), given at {where}"
    begin = builtin_of_type(above, chosen)
    instead = f"`-c {begin}`, in a file `extends: {begin}`; or the whole {above} block in a file without `extends`"
    return Problem(type_at, text, instead)


def builtin_of_type(block: str, kind: str) -> str:
    """The first built-in config whose block is of that type."""
    for name in (DEFAULT, *builtin_names()):
        node, _ = _node_at(stacked(read_layers(builtin(name))), (block, "type"))
        if isinstance(node, Scalar) and node.value == kind:
            return name
    raise AssertionError("each type has a built-in config")


def _elsewhere(name: str, exactly: bool) -> str:
    """A key of another block that is like `name`, with its path; of the very same name, if `exactly`."""
    paths = {path[-1]: ".".join(path) for path, _ in reversed(list(leaves(Config)))}
    if "." in name:
        *blocks, last = nearest(name, paths.values()).split(".")
        return f"{': {'.join(blocks)}: {{{last}: …{'}' * len(blocks)}" if blocks else last
    found = name if exactly else nearest(name, paths)
    return paths.get(found, "")


def _field_at(model: type[Block], location: tuple[int | str, ...], tree: Mapping) -> tuple[list[str], FieldInfo]:
    """Key and field that a location is in; what lies deeper (an item of a list, a kind of value) is left away."""
    path = [str(location[0])]
    field = model.model_fields[path[0]]
    for part in location[1:]:
        block = _kinds_in(tree, tuple(path), field)
        if isinstance(part, int) and block is not None:
            continue  # an item of a list of blocks
        if block is None or str(part) not in block.model_fields:
            break
        path.append(str(part))
        field = block.model_fields[str(part)]
    return path, field


def _node_at(tree: Mapping, location: tuple[int | str, ...]) -> tuple[Node | None, Position]:
    """The value at a location and its position; for a key that is not in the tree None and the block it is missing in.

    Parts of the location that are not in the tree, such as the kind of value pydantic tried, are passed over.
    """
    node: Node = tree
    position = tree.position
    for part in location:
        if isinstance(node, Mapping) and isinstance(part, str):
            if part not in node.entries:
                return None, position
            position, node = node.keys[part], node.entries[part]
        elif isinstance(node, Sequence) and isinstance(part, int) and part < len(node.items):
            node = node.items[part]
            position = node.position
    return node, node.position
