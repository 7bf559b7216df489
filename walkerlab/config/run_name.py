"""Run identity: a config changed by `--set` runs beside the unchanged one, in a folder named after the change."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any, Final

from walkerlab.config.fields import Block, block_of
from walkerlab.config.numbers import short
from walkerlab.config.schema import Config

MAX_CHANGE: Final = 80
KEPT_OF_A_LONG_CHANGE: Final = 56


def run_name(base: Config, changed: Config, slope_deg: float | None = None, run: str | None = None) -> str:
    """Name of the run folder of `changed`, which `--set` made of `base`: `name`, or `name@key=value,...`.

    The name follows from what differs and not from how the change was typed: one experiment, one folder.

    slope_deg  the slope as the user gave it, if in degrees
    run        the folder that `base` was taken from, which has perhaps a change in its name already
    """
    before, after = base.model_dump(mode="json"), changed.model_dump(mode="json")
    parts = []
    for name, block in _added_blocks(before, after):
        before[name] = block().model_dump(mode="json")
        parts.append(f"{name}=added")
    known = dict(_flat(before))
    differing = [(key, value) for key, value in _flat(after) if key not in known or known[key] != value]
    renamed = [value for key, value in differing if key == "name"]
    parts += [_part(key, value, slope_deg) for key, value in differing if key != "name"]
    whole, _, earlier = (renamed[0] if renamed else run or base.name).partition("@")
    parts = [earlier, *parts] if earlier else parts
    return f"{whole}@{_shortened(','.join(parts))}" if parts else str(whole)


def _added_blocks(before: dict[str, Any], after: dict[str, Any]) -> Iterator[tuple[str, type[Block]]]:
    for name, field in Config.model_fields.items():
        block = block_of(field)
        if block is not None and before[name] is None and after[name] is not None:
            yield name, block


def _flat(block: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in block.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _part(key: str, value: Any, slope_deg: float | None) -> str:
    if key == "slope_rad" and slope_deg is not None:
        return f"slope_deg={short(slope_deg)}"
    return f"{key}={_word(value)}"


def _word(value: Any) -> str:
    if isinstance(value, list):
        return "_".join(_word(item) for item in value) or "none"
    if isinstance(value, int | float):
        return short(value)
    return str(value) if value is not None else "none"


def _shortened(change: str) -> str:
    if len(change) <= MAX_CHANGE:
        return change
    digest = hashlib.sha256(change.encode()).hexdigest()[:12]
    return f"{change[:KEPT_OF_A_LONG_CHANGE].rstrip('.,_=-')}-{digest}"
