"""Annotations of config keys: every key carries unit, bounds, meaning and source, and says in words what it allows."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Block(BaseModel):
    """A block of the config: frozen, typed strictly, unknown keys refused, no NaN and no infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True)


def key(unit: str, meaning: str, source: str, *, bounds: str = "", sequence: bool = False, **limits: float) -> Any:
    """Metadata of one key, to be put into `Annotated`.

    unit      as it is printed, "1" for pure numbers, "" where there is none
    meaning   one sentence
    source    where the default comes from
    bounds    what is allowed in words, where `limits` cannot say it
    sequence  a YAML list is accepted for a tuple
    limits    gt, ge, lt, le as pydantic has them
    """
    extra: dict[str, Any] = {"unit": unit, "source": source}
    if bounds:
        extra["bounds"] = bounds
    settings: dict[str, Any] = {"description": meaning, "json_schema_extra": extra, **limits}
    if sequence:
        settings["strict"] = False
    return Field(**settings)
