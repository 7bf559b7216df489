"""A summary as one level of names: what a point's row is made of."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

NOT_OF_THE_POINT: Final = ("left_out", "no_answer")
UNFIT: Final = re.compile(r"[^A-Za-z0-9_.+-]")


def flat_text(summary: Mapping[str, Any]) -> str:
    """Everything in a summary by name, as JSON."""
    return json.dumps(dict(said_in(summary)), allow_nan=False, separators=(",", ":"))


def said_in(summary: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Name and value of everything in a summary: a number, a text, or a list of numbers in a regular shape.

    What is nested has the names above it in front, with points between: `dissipated_J.friction`, `gaits.0.period_s`.
    """
    for key, value in summary.items():
        if prefix or key not in NOT_OF_THE_POINT:
            yield from said_of(f"{prefix}{UNFIT.sub('_', key)}", value)


def said_of(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The same of one value."""
    if isinstance(value, bool | int | float | str):
        yield name, value
    elif isinstance(value, Mapping):
        yield from said_in(value, f"{name}.")
    elif isinstance(value, list) and value:
        if all(isinstance(item, str) for item in value):
            yield name, "; ".join(value)
        elif is_regular(value):
            yield name, value
        else:
            yield from said_in({str(number): item for number, item in enumerate(value)}, f"{name}.")


def is_regular(value: list[Any]) -> bool:
    """Whether a list holds numbers, or lists of them that are equally long."""
    if all(isinstance(item, bool | int | float) for item in value):
        return True
    lists = [item for item in value if isinstance(item, list) and item]
    return len(lists) == len(value) and len({len(item) for item in lists}) == 1 and all(map(is_regular, lists))
