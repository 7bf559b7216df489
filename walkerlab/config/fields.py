"""Declaration and description of config keys (unit, bounds, meaning, source), and the shortest exact notation of
numbers.
"""

import math
import re
import types
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from functools import cache, reduce
from itertools import chain, starmap
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Tag, ValidationInfo, field_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from walkerlab.labels import add_unit

RELATIVE_ROUNDING: Final = 1e-9
"""Numbers count as equal up to this relative difference. It exceeds the rounding of unit conversions."""

DECIMAL_COMMA: Final = re.compile(r"[-+]?\d*,\d*(?:[eE][-+]?\d+)?")


def short_number(number: float) -> str:
    """Return the shortest text that reads back as the finite `number`, e.g. 3, 0.0174, 1e6. Integers have all their
    digits."""
    if isinstance(number, int):
        return str(number)
    plain = repr(number).removesuffix(".0")
    if 1e-4 <= abs(number) < 1e5 or number == 0:
        return plain
    digits, exponent = f"{Decimal(repr(number)).normalize():E}".split("E")
    return min(plain, f"{digits}e{int(exponent)}", key=len)


def are_equal(first: Any, second: Any) -> bool:
    """Whether two values are equal. Numbers may differ by rounding."""
    if isinstance(first, float | int) and isinstance(second, float | int):
        return math.isclose(first, second, rel_tol=RELATIVE_ROUNDING)
    return bool(first == second)


class Block(BaseModel):
    """Base class of all config blocks: frozen and strictly typed. Unknown keys, NaN and infinity are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True)


def key(
    default: Any,
    unit: str,
    meaning: str,
    source: str = "this project",
    *,
    bounds: str = "",
    default_in_words: str = "",
    sequence: bool = False,
    **limits: Any,
) -> Any:
    """Declare a key of a block.

    unit              printed unit; "1" for pure numbers, "" for other values
    meaning           description, one sentence
    source            origin of the default
    bounds            description of the allowed values if `limits` cannot express them
    default_in_words  description of a default that depends on another key
    sequence          whether YAML lists become tuples; implied if the default is a tuple
    limits            pydantic's constraints: gt, ge, lt, le, pattern, ...
    """
    words = {"unit": unit, "source": source, "bounds": bounds, "default_in_words": default_in_words}
    settings: dict[str, Any] = {"default_factory" if callable(default) else "default": default, **limits}
    settings |= {"strict": False} if sequence or isinstance(default, tuple) else {}
    settings["json_schema_extra"] = {name: text for name, text in words.items() if text}
    return Field(description=meaning, **settings)


def meaning_error(reason: str) -> PydanticCustomError:
    """Build the error that a validator raises for a value of the right type that is not allowed."""
    return PydanticCustomError("meaning", reason)


def _storable(text: str) -> str:
    if any(letter == "\0" or "\ud800" <= letter <= "\udfff" for letter in text):
        raise meaning_error("holds a character that no file can store")
    return text


Text = Annotated[str, AfterValidator(_storable)]
"""Text that a user writes, such as a name or a path."""


def check_value(*names: str, why: Callable[[Any], str]) -> Any:
    """Validate keys. `why` returns the reason for an error or ''."""

    def check(value: Any) -> Any:
        if reason := why(value):
            raise meaning_error(reason)
        return value

    return field_validator(*names)(check)


def check_entries(*names: str, why: Callable[[str, Any], str]) -> Any:
    """Validate each entry (name and value) of the keys that hold several entries."""
    return check_value(*names, why=lambda entries: next(filter(None, starmap(why, entries.items())), ""))


def why_not_rising(name: str, bounds: Sequence[float] | None) -> str:
    """Explain why the bounds of `name` are not two numbers in ascending order, or return '' if they are or are None."""
    if bounds is None or (len(bounds) == 2 and bounds[0] < bounds[1]):
        return ""
    return f"has bounds for {name}, [{listed(bounds)}]: give two numbers, the lower one first"


def listed(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:g}" for number in numbers)


def check_against(name: str, other: str, why: Callable[[Any, Any], str]) -> Any:
    """Validate key `name` against key `other`, declared above it. `why` returns the reason for an error or ''."""

    def check(value: Any, info: ValidationInfo) -> Any:
        other_value = info.data.get(other)  # None if the other key is itself invalid
        reason = "" if other_value is None else why(value, other_value)
        if reason:
            raise meaning_error(reason)
        return value

    return field_validator(name)(check)


def block_of(field: FieldInfo) -> type[Block] | None:
    """Return the type of the block that a key holds, or None if the key holds a value. If it can hold several types
    of block, return the first."""
    for candidate in (field.annotation, *get_args(field.annotation)):
        if isinstance(candidate, type) and issubclass(candidate, Block):
            return candidate
    return next(iter(kinds_of(field).values()), None)


def kinds_of(field: FieldInfo) -> dict[str, type[Block]]:
    """Map each value of the key `type` to the type of block that it selects, or return {} if a key holds only one
    type."""
    kinds = {}
    for candidate in get_args(field.annotation):
        for tag in get_args(candidate)[1:]:
            if isinstance(tag, Tag) and isinstance(get_args(candidate)[0], type):
                kinds[tag.tag] = get_args(candidate)[0]
    return {tag: block for tag, block in kinds.items() if issubclass(block, Block)}


def leaves(
    block: type[Block], prefix: tuple[str, ...] = (), held: Any = None
) -> Iterator[tuple[tuple[str, ...], FieldInfo]]:
    """Yield path and field of every value in `block`, in the schema's order.

    held  instance of `block`, whose inner blocks select the kinds to list; by default the first kind of each
    """
    for name, field, inner in keys_with_blocks(block):
        instance = getattr(held, name, None)
        if inner is None:
            yield (*prefix, name), field
        else:
            yield from leaves(type(instance) if isinstance(instance, Block) else inner, (*prefix, name), instance)


@cache
def keys_with_blocks(block: type[Block]) -> tuple[tuple[str, FieldInfo, type[Block] | None], ...]:
    """Return the name, the field and the inner block (see `block_of`) of each key."""
    return tuple((name, field, block_of(field)) for name, field in block.model_fields.items())


def leaves_of_other_kinds(block: type[Block]) -> Iterator[tuple[tuple[str, ...], FieldInfo]]:
    """Yield path and field of the values that `leaves` omits, e.g. `walker(kneed).thigh.length_m`."""
    for name, field in block.model_fields.items():
        for tag, kind in list(kinds_of(field).items())[1:]:
            yield from leaves(kind, (f"{name}({tag})",))


def value_at(config: Any, path: Iterable[str]) -> Any:
    """Return the value at a path of keys, or None if the config lacks a block on the path."""
    return reduce(lambda block, name: getattr(block, name, None), path, config)


def replace_key(block: Any, path: str, value: Any) -> Any:
    """Return a copy of a block in which the value at a path of keys is replaced, without validating the new value."""
    name, _, tail = path.partition(".")
    return block.model_copy(update={name: replace_key(getattr(block, name), tail, value) if tail else value})


def annotation_of(field: FieldInfo, name: str) -> str:
    """Return the annotation `unit`, `source`, `bounds` or `default_in_words` of a key, or '' if it has none."""
    extra = field.json_schema_extra
    return str(extra.get(name, "")) if isinstance(extra, dict) else ""


_KINDS: Final[dict[Any, str]] = {float: "number", int: "integer", str: "text", bool: "true or false"}
_SIGNS: Final = (("ge", "from"), ("gt", "above"), ("le", "up to"), ("lt", "below"))


def describe_type(annotation: Any) -> str:
    """Describe a type: number, integer, text, word, list, or a choice of these."""
    if annotation in _KINDS:
        return _KINDS[annotation]
    origin = get_origin(annotation)
    if origin is Annotated:
        return describe_type(get_args(annotation)[0])
    if origin is Literal:
        return _KINDS[int] if isinstance(get_args(annotation)[0], int) else "word"
    if origin is tuple:
        return "list"
    if origin in (Union, types.UnionType):
        return " or ".join(
            dict.fromkeys(describe_type(part) for part in get_args(annotation) if part is not types.NoneType)
        )
    return "block"


def words_of(annotation: Any) -> tuple[str, ...]:
    """Return, as text, the words and numbers that a type lists as allowed, including those inside a list or union."""
    parts = get_args(annotation)
    if get_origin(annotation) is Literal:
        return tuple(map(str, parts))
    return tuple(chain.from_iterable(map(words_of, parts)))


def bounds_of(field: FieldInfo) -> str:
    """Describe a key's bounds without unit, e.g. `from 0.001 to 1000`, or return '' if it has none."""
    description = annotation_of(field, "bounds")
    what = describe_type(field.annotation)
    if description:
        return description
    if what == _KINDS[bool]:
        return what
    words = words_of(field.annotation)
    if words and what in ("word", _KINDS[int]):
        return ", ".join(words)
    limits = {sign: getattr(item, sign) for item in field.metadata for sign, _ in _SIGNS if hasattr(item, sign)}
    if limits.keys() == {"ge", "le"}:
        return f"from {short_number(limits['ge'])} to {short_number(limits['le'])}"
    return ", ".join(f"{word} {short_number(limits[sign])}" for sign, word in _SIGNS if sign in limits)


def describe_allowed(field: FieldInfo) -> str:
    """Describe the values that a key accepts, with type and unit, for a message."""
    if block_of(field) is not None:
        optional = type(None) in get_args(field.annotation)
        return "a block of keys, or null to leave it out" if optional else "a block of keys"
    bounds = bounds_of(field)
    what = describe_type(field.annotation)
    if what == "word" or bounds == ", ".join(words_of(field.annotation)) != "":
        return f"one of {bounds}" if "," in bounds else bounds
    if what in _KINDS.values():
        bounds = f"{what}, {bounds}" if bounds not in ("", what, f"any {what}") else what
    return add_unit(bounds, annotation_of(field, "unit"))
