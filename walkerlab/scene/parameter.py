"""A number of the config as the parameter of a family of walkers: its key, its unit, and the config at a value."""

import math
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from walkerlab.config.fields import Block, block_of, extra, kind, leaves
from walkerlab.config.problems import nearest, shown
from walkerlab.config.reads import ContactConfig, keys_of
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError

SLOPE_DEG, SLOPE_RAD = "slope_deg", "slope_rad"
PHYSICAL = tuple(keys_of(ContactConfig))
"""The keys that a model is made of."""


@dataclass(frozen=True)
class Parameter:
    """A key of the config that changes.

    key   dotted, as it was asked for
    unit  of its values
    """

    key: str
    unit: str
    path: tuple[str, ...]

    def value_in(self, config: ContactConfig) -> float:
        """What the config has there."""
        found: Any = config
        for name in self.path:
            found = getattr(found, name)
        return math.degrees(found) if self.key == SLOPE_DEG else float(found)

    def config_at(self, config: ContactConfig, value: float) -> Config | None:
        """The config with another value there and all that follows from it; None if the schema refuses it."""
        data = {name: _as_given(getattr(config, name)) for name in PHYSICAL}
        block = data
        for name in self.path[:-1]:
            block = block[name]
        block[self.path[-1]] = math.radians(value) if self.key == SLOPE_DEG else value
        try:
            return Config.model_validate(data)
        except ValidationError:
            return None


def _as_given(value: Any) -> Any:
    """A block as the keys that were given, so that defaults which follow from others are made anew."""
    if not isinstance(value, Block):
        return value
    given = value.model_dump(exclude_unset=True)
    return {**given, "type": value.type} if hasattr(value, "type") else given


def parameter_of(key: str, config: ContactConfig) -> Parameter:
    """The parameter of a key; ConfigError if it is no number that a walker is made of."""
    if key == SLOPE_DEG:
        return Parameter(key, "deg", (SLOPE_RAD,))
    path = tuple(key.split("."))
    known = {".".join(path): field for path, field in leaves(Config) if path[0] in PHYSICAL}
    if key not in known:
        every = {".".join(path) for path, _ in leaves(Config)}
        if key in every:
            raise ConfigError(f"continuation.over: {shown(key)} touches no model", _ADVICE)
        blocks = {".".join(path[:depth]) for path in map(tuple, (one.split(".") for one in every)) for depth in (1, 2)}
        if key in blocks:
            raise ConfigError(f"continuation.over: {shown(key)} is a block of keys, not a number", _ADVICE)
        meant = nearest(key, [*numbers_among(known), SLOPE_DEG])
        guess = f"; did you mean {meant}?" if meant else ""
        raise ConfigError(f"continuation.over: {shown(key)} is not a key of the config{guess}", _ADVICE)
    if config.contact is None and path[0] == "contact":
        raise ConfigError(f"continuation.over: {key} belongs to the contact block, and the config has none", _ADVICE)
    if "number" not in kind(known[key].annotation):
        raise ConfigError(f"continuation.over: {key} is not a number", _ADVICE)
    unit = extra(known[key], "unit") or "1"
    return Parameter(key, config.contact.unit_of(unit) if config.contact else unit, path)


_ADVICE = "Name a number that the walker, its slope or its ground is made of; `walkerlab schema` lists every key."


def numbers_among(known: dict[str, Any]) -> list[str]:
    """The keys whose values are numbers."""
    return [name for name, field in known.items() if block_of(field) is None and "number" in kind(field.annotation)]
