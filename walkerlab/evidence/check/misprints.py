"""Misprints of a walker's parameters and of printed values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from walkerlab.config.fields import Block
from walkerlab.config.numbers import short_number
from walkerlab.config.reads import RigidConfig
from walkerlab.evidence.check.conventions import GRAVITIES
from walkerlab.evidence.check.gaits import plain_walker
from walkerlab.evidence.check.plain_walker import PlainWalker

SLOPE = "slope_rad"
GRAVITY = "gravity_m_s2"
UNIT = re.compile(r"_(m|kg|kg_m2|rad|m_s2)$")


class Misprint(NamedTuple):
    """A parameter with a value other than the stated one."""

    key: str
    value: float
    how: str
    walker: PlainWalker


class Changed(NamedTuple):
    """A rigid config with some keys changed."""

    walker: Any
    gravity_m_s2: float
    slope_rad: float
    push_off: Any
    equations: str


def parameters(config: RigidConfig) -> dict[str, float]:
    """Return the parameters that are not zero, by dotted key."""
    found = {SLOPE: config.slope_rad, GRAVITY: config.gravity_m_s2, **dict(numbers_in("walker", config.walker))}
    return {key: value for key, value in found.items() if value and UNIT.search(key)}


def numbers_in(prefix: str, block: Block) -> Iterator[tuple[str, float]]:
    for name, value in block:
        if isinstance(value, Block):
            yield from numbers_in(f"{prefix}.{name}", value)
        elif isinstance(value, float):
            yield f"{prefix}.{name}", value


def replace_value(config: RigidConfig, key: str, value: float) -> Changed:
    """Return the config with a new value of one parameter, without validation."""
    scene = Changed(config.walker, config.gravity_m_s2, config.slope_rad, config.push_off, config.equations)
    first, _, rest = key.partition(".")
    changes: dict[str, Any] = {first: replace_inner(config.walker, rest, value) if rest else value}
    return scene._replace(**changes)


def replace_inner(block: Block, key: str, value: float) -> Block:
    first, _, rest = key.partition(".")
    return block.model_copy(update={first: replace_inner(getattr(block, first), rest, value) if rest else value})


def misprints_of(config: RigidConfig) -> Iterator[Misprint]:
    """Yield walkers that differ from the stated one by a possible misprint of one parameter."""
    values = parameters(config)
    for key, value in values.items():
        for other, how in possible_originals(key, value, values):
            changed = vary_walker(config, key, other)
            if changed is not None:
                yield Misprint(key, other, how, changed)


def vary_walker(config: RigidConfig, key: str, value: float) -> PlainWalker | None:
    """Return the plain walker with a new value of one parameter, or None if it cannot be built."""
    walker = plain_walker(replace_value(config, key, value))
    turns = all(part.inertia + part.mass * abs(part.centre) ** 2 > 0.0 for part in walker.parts)
    return walker if turns and walker.leg_length > walker.radius >= 0.0 else None


def possible_originals(key: str, value: float, values: Mapping[str, float]) -> list[tuple[float, str]]:
    """Return the values of which the given value may be a misprint, each with the kind of misprint."""
    same_unit = {name: other for name, other in values.items() if unit_of(name) == unit_of(key)}
    found = {other: f"the value of {name}" for name, other in same_unit.items()}
    found |= dict.fromkeys(transposed(value), "two digits are transposed")
    found |= {float(f"{value * factor:.12g}"): "a factor of ten" for factor in (0.1, 10.0)}
    if key == SLOPE:
        found[math.radians(value)] = "degrees as radians"
    if key == GRAVITY:
        found |= dict.fromkeys(GRAVITIES, "another gravity")
    return [(other, how) for other, how in found.items() if other != value]


def unit_of(key: str) -> str:
    match = UNIT.search(key)
    return match[1] if match else ""


def transposed(value: float) -> Iterator[float]:
    """Yield the values that result from exchanging two neighbouring digits of a number."""
    text = short_number(value)
    for place in range(len(text) - 1):
        first = text[place]
        second = text[place + 1]
        if first.isdigit() and second.isdigit() and first != second:
            yield float(text[:place] + second + first + text[place + 2 :])
