"""Run identity: a config changed by `--set` runs beside the unchanged one, in a folder named after the change."""

import hashlib
from typing import Any, Final

from walkerlab.config.canonical import leaves
from walkerlab.config.fields import block_of
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
    for name, field in Config.model_fields.items():
        block = block_of(field)
        if block is not None and before[name] is None and after[name] is not None:
            before[name] = block().model_dump(mode="json")
            parts.append(f"{name}=added")
    known = dict(leaves(before))
    differing = {key: value for key, value in leaves(after) if key not in known or known[key] != value}
    renamed = differing.pop("name", None)
    whole, _, earlier = (renamed or run or base.name).partition("@")
    if slope_deg is not None and "slope_rad" in differing:
        differing = {"slope_deg" if key == "slope_rad" else key: value for key, value in differing.items()}
        differing["slope_deg"] = slope_deg
    parts = [earlier] * bool(earlier) + parts + [f"{key}={_word(value)}" for key, value in differing.items()]
    change = ",".join(parts)
    if len(change) > MAX_CHANGE:
        digest = hashlib.sha256(change.encode()).hexdigest()[:12]
        change = f"{change[:KEPT_OF_A_LONG_CHANGE].rstrip('.,_=-')}-{digest}"
    return f"{whole}@{change}" if change else whole


def _word(value: Any) -> str:
    if isinstance(value, list):
        return "_".join(_word(item) for item in value) or "none"
    if isinstance(value, int | float):
        return short(value)
    return "none" if value is None else str(value)
