"""Where a start stands: both feet on the slope."""

from __future__ import annotations

from typing import Final

from walkerlab.config.numbers import short
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping

MOVED_RAD: Final = 1e-12


def on_the_slope(config: Config, tree: Mapping) -> tuple[Config, tuple[str, ...]]:
    """`config` with theta_1 of its start such that both feet stand on the slope, theta_1 + theta_2 = -2 phi."""
    if isinstance(config.start, str):
        return config, ()
    given, stance, *rates = config.start
    swing = -2 * config.slope_rad - stance
    placed = config.model_copy(update={"start": (swing, stance, *rates)})
    if abs(swing - given) <= MOVED_RAD:
        return placed, ()
    moved = (
        f"{tree.entries['start'].position}: start: theta_1 moved from {short(given)} to {short(swing)} rad, "
        f"so that both feet stand on the slope of {short(config.slope_rad)} rad"
    )
    return placed, (moved,)
