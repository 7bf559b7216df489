"""Validate a config tree against the schema, and report all problems together, with positions."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple, TypeAlias

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from walkerlab.config import fields, schema, walkers
from walkerlab.config.contact import BOUNDS_SI
from walkerlab.config.files import DEFAULT, builtin_config, builtin_names, merge_layers, read_layers
from walkerlab.config.problems import (
    Problem,
    explain_missing_feature,
    format_node,
    nearest,
    printable,
    problem_error,
    problems_error,
)
from walkerlab.config.tree import BlockNode, ListNode, Node, Position, Scalar, as_typed, plain
from walkerlab.extensions import WORDS, external_extensions

Location: TypeAlias = tuple[int | str, ...]

_REASONS: Final = {
    "float_type": "is not a number",
    "int_type": "is not an integer",
    "string_type": "is not text",
    **dict.fromkeys(("tuple_type", "list_type"), "is not a list"),
    **dict.fromkeys(("dict_type", "model_type"), "is not a block of keys"),
    "finite_number": "is not finite",
    "literal_error": "is not allowed",
    **dict.fromkeys(("greater_than", "greater_than_equal", "less_than", "less_than_equal"), "is out of bounds"),
    "missing": "has too few values",
    "too_long": "has too many values",
    "string_pattern_mismatch": "is not valid",
    "union_tag_invalid": "is not a known type",
}
MAX_PROBLEMS: Final = 100
NAMES_OF_BODIES: Final = {
    "hinges": ("parent", "child"),
    **dict.fromkeys(("particles", "feet", "couplings"), ("body",)),
}
MOVED_RAD: Final = 1e-12
MAX_START_ERROR: Final = 0.01  # rad or rad/s; a start is rejected if a stated value is off by more than this
BY_UNITS: Final = {"units": "si, and set the other values of the block too"}
JUDGED_BY: Final = {
    **dict.fromkeys(BOUNDS_SI, BY_UNITS),
    "dynamic_friction": {"static_friction": "set contact.dynamic_friction too"},
    "friction_velocity": {"stiction_velocity": "set contact.friction_velocity too", **BY_UNITS},
}
"""Other keys that limit a key of the contact block, and advice if only the other key was changed."""
DIGITS_COUNT: Final = ("printed", "state_before")
"""Keys of the block `check` whose values are kept as typed."""
_FOLLOWS_FROM_ANOTHER: Final = "default_factory_not_called"


def validate_tree(tree: BlockNode) -> schema.Config:
    """Convert a tree to a typed config. Raises ConfigError with every problem found."""
    problems: list[Problem] = []
    data: dict[str, Any] = {name: plain(node) for name, node in tree.entries.items()}
    if isinstance(check := tree.entries.get("check"), BlockNode):
        # Trailing zeros of a printed value count, but would be lost if the text became a number.
        data["check"] |= {name: as_typed(check.entries[name]) for name in DIGITS_COUNT if name in check.entries}
    # The schema has only slope_rad. A slope in degrees is validated by a class of its own and then converted.
    if "slope_deg" in data:
        try:
            data["slope_rad"] = math.radians(schema.SlopeInDegrees(slope_deg=data.pop("slope_deg")).slope_deg)
        except ValidationError as error:
            problems += _problems(error, tree, schema.SlopeInDegrees)
    try:
        config = schema.Config.model_validate(data)
    except ValidationError as error:
        problems += _problems(error, tree, schema.Config)
    if problems:
        raise problems_error(sorted(problems, key=_place))
    check_bodies(config, tree)
    return config


class FollowingValue(NamedTuple):
    """Start value that is computed from other values of the config."""

    name: str
    value: float
    unit: str
    because: str


def align_start(config: schema.Config, tree: BlockNode) -> tuple[schema.Config, tuple[str, ...]]:
    """Compute the start values that the others determine, and describe by how much stated values were changed.

    Raises ConfigError, with the position in the file, if a missing value cannot be computed or a stated one is far off.
    """
    if isinstance(config.start, str):
        return config, ()
    stated: Sequence[float | None] = config.start.state if isinstance(config.start, schema.MidStep) else config.start
    where = tree.entries["start"].position
    start = list(stated)
    adjustments = list[str]()
    following = following_values(config, stated)
    for place, value in enumerate(stated):
        if value is None and place not in following:
            names = " and ".join(each.name for each in following.values()) or "no value"
            raise problem_error(where, f"start: value {place + 1} is null, but only {names} can be computed here")
    for place, (name, value, unit, because) in following.items():
        before, start[place] = stated[place], value
        # A stated value that was only rounded needs no remark.
        if before is None or abs(value - before) <= MOVED_RAD:
            continue
        change = f"start: {name} {{}} {fields.short_number(before)} {{}} {fields.short_number(value)} {unit}, {because}"
        if abs(value - before) > MAX_START_ERROR:
            as_it_is = ", ".join("null" if each is None else fields.short_number(each) for each in stated)
            midway = f", or start: {{instant: mid-step, state: [{as_it_is}]}} to walk this state as it is"
            advice = f"Write null for {name} to compute it{midway if name.startswith('theta_1') else ''}."
            raise problem_error(where, change.format("is", "but must be"), advice=advice)
        adjustments.append(str(Problem(where, change.format("moved from", "to"))))
    if not isinstance(config.start, schema.MidStep):
        return config.model_copy(update={"start": tuple(start)}), tuple(adjustments)
    if isinstance(config.walker, walkers.Kneed) and config.start.state[2] > config.start.state[0] + MOVED_RAD:
        raise problem_error(where, "start: theta_1_shank is above theta_1, but knees do not bend beyond straight")
    midway_start = config.start.model_copy(update={"state": tuple(start)})
    return config.model_copy(update={"start": midway_start}), tuple(adjustments)


def following_values(config: schema.Config, stated: Sequence[float | None]) -> dict[int, FollowingValue]:
    """Return the values of a start that can be computed from others, by index.

    Just after a heel strike, both feet stand on the slope (theta_1 + theta_2 = -2 phi) and knees are straight, except
    for walkers assembled from parts. Coupled bodies, such as a torso on the legs' bisector, always have the angles and
    rates of their coupling.
    """
    walker = config.walker
    bodies = len(stated) // 2
    values = [0.0 if value is None else value for value in stated]
    following = dict[int, FollowingValue]()
    if not isinstance(config.start, schema.MidStep) and not isinstance(walker, walkers.AssembledWalker):
        because = f"so that both feet stand on the slope of {config.slope_rad:.10g} rad"
        values[0] = -2 * (config.slope_rad + walker.lean_rad) - values[1]
        if walker.second is not walker:
            swing = walker.swing_angle(values[1] + config.slope_rad)
            values[0] = values[0] if swing is None else swing - config.slope_rad
        following[0] = FollowingValue("theta_1", values[0], "rad", because)
        if isinstance(walker, walkers.Kneed):
            values[2] = values[0]
            following[2] = FollowingValue("theta_1_shank", values[0], "rad", "so that the leg is straight")
    for place, (name, of) in walkers.followers(walker).items():
        for first, theta, unit in ((0, "theta", "rad"), (bodies, "dtheta", "rad/s")):
            value = sum(weight * values[first + body] for body, weight in of.items())
            because = f"because the {name} follows other bodies"
            following[first + place] = FollowingValue(f"{theta}_{name.split()[0]}", value, unit, because)
    return following


def check_bodies(config: schema.Config, tree: BlockNode) -> None:
    """Raise ConfigError, with the position in the file, if a part is on an unknown body or a foot on the wrong leg."""
    walker = config.walker
    if not isinstance(walker, walkers.AssembledWalker):
        return
    bodies = [body.name for body in walker.bodies]
    problems = []

    def refuse(place: Location, why: str, allowed: Sequence[str], near: str = "") -> None:
        text = f"{'.'.join(map(str, place))}: {why}"
        problems.append(Problem(node_at(tree, place)[1], text, ", ".join(allowed), near))

    for place, name in body_references(walker):
        if name not in bodies:
            refuse(("walker", *place), f"{printable(name)} is not a body", bodies, nearest(name, bodies))
    for k, (foot, leg) in enumerate(zip(walker.feet, walker.legs, strict=True)):
        if foot.body in bodies and foot.body not in leg:
            why = f"{printable(foot.body)} does not belong to leg {k + 1}, although this foot does"
            refuse(("walker", "feet", k, "body"), why, leg)
    if problems:
        raise problems_error(sorted(problems, key=_place), "docs/walkers.md shows a walker described by its parts.")


def body_references(walker: walkers.AssembledWalker) -> Iterator[tuple[Location, str]]:
    for key, names in NAMES_OF_BODIES.items():
        for k, part in enumerate(getattr(walker, key)):
            yield from (((key, k, name), getattr(part, name)) for name in names)
    for k, coupling in enumerate(walker.couplings):
        yield from ((("couplings", k, "of", n), name) for n, name in enumerate(coupling.of))
    for k, leg in enumerate(walker.legs):
        yield from ((("legs", k, n), name) for n, name in enumerate(leg))


def _place(problem: Problem) -> tuple[str, int, int]:
    where = problem.position
    return (where.source, where.line, where.column) if where else ("", 0, 0)


def _problems(error: ValidationError, tree: BlockNode, model: type[fields.Block]) -> list[Problem]:
    details = error.errors(include_url=False)[:MAX_PROBLEMS]
    return [_problem(detail, tree, model) for detail in details if detail["type"] != _FOLLOWS_FROM_ANOTHER]


def _problem(detail: ErrorDetails, tree: BlockNode, model: type[fields.Block]) -> Problem:
    location = detail["loc"]
    what = detail["type"]
    kinds = fields.kinds_of(model.model_fields[str(location[0])]) if location[0] in model.model_fields else {}
    if what == "union_tag_invalid":
        node, position = node_at(tree, (*location, "type"))
        word = str(node.value) if isinstance(node, Scalar) else ""
        beyond = explain_missing_feature(word)
        text = f"{location[0]}.type: {printable(word)} is not a known type{f'; {beyond}' if beyond else ''}"
        allowed = f"one of {', '.join(kinds)}{advise_extensions()}"
        return Problem(position, text, allowed, "" if beyond else nearest(word, kinds))
    # Pydantic inserts the kind of value that it tried into the location, although the config has no such key.
    if len(location) > 1 and location[1] in (*kinds, schema.MID_STEP):
        location = (location[0], *location[2:])
    if what == "extra_forbidden":
        return _unknown_key(location, tree)
    path, field, _ = _locate_key(model, location, tree)
    assert field is not None, "the key of an invalid value is in the schema"
    key = ".".join(path)
    node, position = node_at(tree, location)
    if node is None and what == "missing":
        return Problem(position, f"{key}: is missing", fields.describe_allowed(field))
    value = format_node(node) if node else f"{detail['input']} (its default)"
    reason = _REASONS.get(what, detail["msg"])
    for judge, instead in JUDGED_BY.get(path[-1], {}).items() if what not in _REASONS and path[0] == "contact" else ():
        bound, where = node_at(tree, ("contact", judge))
        if bound is not None and node is None:
            position = where
        elif bound is not None and where.source != position.source and _is_later(where, position):
            text = f"contact.{judge}: {key} is still {value} (from {position.source}) and {reason}"
            return Problem(where, text, instead)
    word = node.value if isinstance(node, Scalar) and isinstance(node.value, str) else ""
    meant = nearest(word, fields.words_of(field.annotation)) if word else ""
    if what == "float_type" and fields.DECIMAL_COMMA.fullmatch(word):
        meant = word.replace(",", ".")
    right = fields.describe_allowed(field) if what in _REASONS else ""
    if path[-1] in WORDS and what == "literal_error":
        right += advise_extensions()
    return Problem(position, f"{key}: {value} {reason}", right, meant if meant != word else "")


def advise_extensions() -> str:
    """Return the last part of an error message: a list of the installed extensions.

    Another extension may add the missing word.
    """
    names = ", ".join(found.name for found in external_extensions() if found.extension) or "none"
    return f", or a word of an extension: install the one that adds it (installed: {names})"


def _is_later(place: Position, earlier: Position) -> bool:
    """Whether the user's value at `place` overrides the value at `earlier`."""
    return place.source.startswith("--") or (bool(place) and earlier.source.startswith("built-in"))


def _locate_key(
    model: type[fields.Block], location: Location, tree: BlockNode
) -> tuple[list[str], FieldInfo | None, type[fields.Block] | None]:
    """Return the path of the key at a location, its field, and the type of block that it holds in this tree.

    Parts of the location below the key (a list item, a kind of value) are ignored.
    """
    path: list[str] = []
    field: FieldInfo | None = None
    block: type[fields.Block] | None = model
    for part in location:
        if isinstance(part, int) and block is not None:
            continue  # an item of a list of blocks
        if block is None or str(part) not in block.model_fields:
            break
        path.append(str(part))
        field = block.model_fields[str(part)]
        node, _ = node_at(tree, tuple(path))
        chosen = node.entries.get("type") if isinstance(node, BlockNode) else None
        kind = str(chosen.value) if isinstance(chosen, Scalar) else ""
        block = fields.kinds_of(field).get(kind) or fields.block_of(field)
    return path, field, block


def _unknown_key(location: Location, tree: BlockNode) -> Problem:
    above, field, inner = _locate_key(schema.Config, location[:-1], tree)
    name = str(location[-1])
    block = inner or schema.Config
    kinds = {} if field is None else fields.kinds_of(field)
    parent, _ = node_at(tree, location[:-1])
    assert isinstance(parent, BlockNode), "the parent holds the key"
    if any(name in kind.model_fields for kind in kinds.values()):
        return _keys_of_another_kind(".".join(above), parent, parent.keys[name].source, block, kinds)
    if location == ("extends",):
        allowed = "put `extends` in a file and pass it with -c"
        return Problem(parent.keys[name], "extends: belongs in a file, not in --set", allowed)
    siblings = [*block.model_fields, *(("slope_deg", "extends") if block is schema.Config else ())]
    text = f"{printable('.'.join((*above, name)))}: unknown key ({format_node(parent.entries[name])})"
    value = parent.entries[name]
    beyond = explain_missing_feature(name) or (
        explain_missing_feature(value.text) if name == "type" and isinstance(value, Scalar) else ""
    )
    if beyond:
        return Problem(parent.keys[name], f"{text}; {beyond}", ", ".join(siblings))
    similar = nearest(name, siblings) if "." not in name else ""
    # A misspelling such as `slope` is as near to slope_rad as to slope_deg, and degrees are the more likely unit.
    if similar == "slope_rad" and "rad" not in name:
        similar = "slope_deg"
    intended = ".".join((*above, similar)) if similar else _find_key_elsewhere(name, exactly=bool(above))
    return Problem(parent.keys[name], text, ", ".join(siblings), intended)


def _keys_of_another_kind(
    above: str, entries: BlockNode, source: str, block: type[fields.Block], kinds: dict[str, type[fields.Block]]
) -> Problem:
    """Build one problem for all keys from a source (file or option) that belong to another type of the block."""
    foreign_keys = {key for kind_block in kinds.values() for key in kind_block.model_fields} - {*block.model_fields}
    strange = {key: place for key, place in entries.keys.items() if key in foreign_keys and place.source == source}
    where = next(iter(strange.values()))
    chosen = next(kind for kind, kind_block in kinds.items() if kind_block is block)
    other_kind = next(kind for kind, kind_block in kinds.items() if next(iter(strange)) in kind_block.model_fields)
    type_at = entries.keys.get("type", where)
    has_no = f"has no {', '.join(strange)} (of type {other_kind})"
    if source.startswith("--") or type_at.source in (source, builtin_config(DEFAULT).label):
        return Problem(where, f"{above}.type is {chosen}, which {has_no}", ", ".join(block.model_fields))
    layers = {name: merge_layers(read_layers(builtin_config(name))) for name in (DEFAULT, *builtin_names())}
    types = {name: node_at(tree, (above, "type"))[0] for name, tree in layers.items()}
    begin = next(name for name, node in types.items() if isinstance(node, Scalar) and node.value == chosen)
    instead = f"`-c {begin}`, in a file `extends: {begin}`; or the whole {above} block in a file without `extends`"
    return Problem(type_at, f"{above}.type: {chosen} {has_no}, given at {where}", instead)


def _find_key_elsewhere(name: str, exactly: bool) -> str:
    """Return the path of the key with the name nearest to `name` (equal to it, if `exactly`) in any block, or ''."""
    paths = {path[-1]: ".".join(path) for path, _ in reversed(list(fields.leaves(schema.Config)))}
    # A dotted name is compared with whole paths.
    if "." in name:
        *blocks, last = nearest(name, paths.values()).split(".")
        return f"{': {'.join(blocks)}: {{{last}: …{'}' * len(blocks)}" if blocks else last
    return paths.get(name if exactly else nearest(name, paths), "")


def node_at(tree: BlockNode, location: Location) -> tuple[Node | None, Position]:
    """Return the value at a location, and its position. For a missing key, return None and the position of its block.

    Parts of the location that are not in the tree, such as the kind of value that pydantic tried, are skipped.
    """
    node: Node = tree
    position = tree.position
    for part in location:
        if isinstance(node, BlockNode) and isinstance(part, str):
            if part not in node.entries:
                return None, position
            position = node.keys[part]
            node = node.entries[part]
        elif isinstance(node, ListNode) and isinstance(part, int) and part < len(node.items):
            node = node.items[part]
            position = node.position
    return node, node.position


def key_at(tree: BlockNode, location: Location) -> Position:
    block, position = node_at(tree, location[:-1])
    return block.keys.get(str(location[-1]), position) if isinstance(block, BlockNode) else position
