"""Parameters of families of walkers, named by config keys: their units, their values, and configs with other values."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from walkerlab.config import fields, reads, writer
from walkerlab.config.problems import nearest, printable
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError

R = TypeVar("R")
Key = tuple[int | str, ...]
SECOND_LEG = "leg_2"
SLOPE_DEG = "slope_deg"
SLOPE_RAD = "slope_rad"
# Top-level config keys that models depend on.
MODEL_KEYS = tuple(reads.keys_of(reads.ContactConfig))


@dataclass(frozen=True)
class Parameter:
    key: str  # dotted key, as requested
    unit: str  # unit of its values
    path: tuple[str, ...]

    def value_in(self, config: reads.ContactConfig) -> float:
        value = stated_value(config, self.path)
        return math.degrees(value) if self.key == SLOPE_DEG else float(value)

    def config_at(self, config: reads.ContactConfig, value: float) -> Config | None:
        """Return the config at another value, with the defaults that depend on it recomputed, or None if the schema
        rejects it."""
        return config_with(config, (self,), (value,))

    def refusal(self, config: reads.ContactConfig, value: float, key: Key) -> ConfigError:
        """Build the error for a value that the schema rejects, with the reason. The config key `key` requests it."""
        why = ""
        try:
            _changed(config, (self,), (value,))
        except ValidationError as error:
            first = error.errors()[0]
            (*_, name), reason = first["loc"], first["msg"]
            # The schema's message would state the limits in radians.
            if self.key == SLOPE_DEG and first["type"] in ("less_than", "greater_than"):
                reason = "Input should be between -90 and 90, both excluded"
            subject = "it" if name == self.path[-1] else name
            why = f": {subject} {reason.replace('Input should', 'should')}"
        advice = f"`walkerlab schema {self.key}` lists the allowed values."
        return ConfigError(f"{dotted(key)}: {self.key} cannot be {value:g} {self.unit}{why}", advice, key)

    def vary(self, config: reads.ContactConfig, make: Callable[[Config], R]) -> Callable[[float], R | None]:
        """Return a function that calls `make` with the config at a value, or returns None if the schema rejects it."""

        def make_at_value(value: float) -> R | None:
            changed = self.config_at(config, value)
            return None if changed is None else make(changed)

        return make_at_value


def config_with(config: reads.ContactConfig, parameters: Sequence[Parameter], values: Sequence[float]) -> Config | None:
    """Return the config at values of several parameters (parameters,), or None if the schema rejects them."""
    try:
        return _changed(config, parameters, values)
    except ValidationError:
        return None


def _changed(config: reads.ContactConfig, parameters: Sequence[Parameter], values: Sequence[float]) -> Config:
    data = {name: _keys_set(getattr(config, name)) for name in MODEL_KEYS}
    for parameter, value in zip(parameters, values, strict=True):
        block = data
        for name in parameter.path[:-1]:
            # A config has no block for a second leg that is like the first.
            block[name] = block.get(name) or {}
            block = block[name]
        block[parameter.path[-1]] = math.radians(value) if parameter.key == SLOPE_DEG else value
    return Config.model_validate(data)


SLOPE = Parameter(SLOPE_RAD, "rad", (SLOPE_RAD,))


def stated_value(config: reads.ContactConfig, path: tuple[str, ...]) -> Any:
    """Return the value at a path of keys. If a key of the second leg is omitted, its value is that of the first leg."""
    value = fields.value_at(config, path)
    return fields.value_at(config, first_leg_path(path)) if value is None else value


def first_leg_path(path: tuple[str, ...]) -> tuple[str, ...]:
    """Return the path of the same key of leg 1 for a key of leg 2, or the path itself for other keys."""
    return tuple(name for name in path if name != SECOND_LEG)


def mass_of_second_leg(config: reads.ContactConfig) -> str | None:
    """Return the first key of a mass of leg 2, or None for a type of walker without such keys."""
    paths = (path for path, _ in fields.leaves(Config, held=config) if SECOND_LEG in path)
    return next((".".join(path) for path in paths if path[-1].endswith("mass_kg")), None)


def _keys_set(value: Any) -> Any:
    if not isinstance(value, fields.Block):
        return value
    keys = value.model_dump(exclude_unset=True)
    # The type is included even if it is the default, because it decides which keys a block has.
    return {**keys, "type": value.type} if hasattr(value, "type") else keys


def dotted(key: Key) -> str:
    """Join the path of a key with dots, for messages. Indices of list items are left out."""
    return ".".join(part for part in key if isinstance(part, str))


def parameter_of(key: str, config: reads.ContactConfig, asker: Key = ()) -> Parameter:
    """Return the parameter that a config key names.

    Raises ConfigError if the key is not a number that a model uses.
    """
    # `asker` is the config key in which this parameter is named, if any
    if key == SLOPE_DEG:
        return Parameter(key, "deg", (SLOPE_RAD,))
    own = {".".join(path): field for path, field in fields.leaves(Config, held=config)}
    reason = explain_non_parameter(key, config, own, stated_value)
    if reason:
        raise ConfigError(f"{f'{dotted(asker)}: ' if asker else ''}{printable(key)} {reason}", _KEY_ADVICE, asker)
    unit = fields.annotation_of(own[key], "unit") or "1"
    return Parameter(key, config.contact.unit_of(unit) if config.contact else unit, tuple(key.split(".")))


_KEY_ADVICE = "Name a parameter of the walker, its slope or its ground; `walkerlab schema` lists every key."


def parameter_keys(config: reads.ContactConfig) -> Iterator[str]:
    """Yield the dotted keys of the parameters of a config. The slope has the unit that the config uses."""
    own = {".".join(path): field for path, field in fields.leaves(Config, held=config)}
    written = {SLOPE_RAD: SLOPE_DEG} if writer.slope_in_degrees(config.slope_rad) is not None else {}
    yield from (written.get(key, key) for key in own if not explain_non_parameter(key, config, own))


def explain_non_parameter(
    key: str, config: reads.ContactConfig, own: Mapping[str, FieldInfo], value_of: Callable[..., Any] = fields.value_at
) -> str:
    """Explain why a key is not a parameter of the config's models, or return '' if it is one."""
    # `own` lists the keys that exist for this config's type of walker.
    if key not in own:
        if any(name.startswith(f"{key}.") for name in own):
            return "is a block of keys, not a number"
        foreign = {".".join(("walker", *path[1:])) for path, _ in fields.leaves_of_other_kinds(Config)}
        if key in foreign | {".".join(path) for path, _ in fields.leaves(Config)}:
            return f"is not a key of this walker, whose type is {config.walker.type}{suggest_key(key, own)}"
        return f"is not a key of the config{suggest_key(key, own)}"
    path = key.split(".")
    if path[0] not in MODEL_KEYS:
        return "affects no model"
    if "number" not in fields.describe_type(own[key].annotation):
        return "is not a number"
    for depth in range(1, len(path) + 1):
        value = value_of(config, tuple(path[:depth]))
        block = ".".join(path[:depth])
        if value is None:
            return f"cannot be used: the config has no block {block}; add it first"
        if isinstance(value, tuple):
            return f"has one value for each of {block}, so it is not a single number"
    return "" if isinstance(value, int | float) else f"is {value!r} in the config, not a number"


def suggest_key(key: str, own: Mapping[str, FieldInfo]) -> str:
    numbers = [
        name
        for name, field in own.items()
        if name.split(".")[0] in MODEL_KEYS
        and fields.block_of(field) is None
        and "number" in fields.describe_type(field.annotation)
    ]
    closest = nearest(key, [*numbers, SLOPE_DEG])
    return f"; did you mean {closest}?" if closest else ""
