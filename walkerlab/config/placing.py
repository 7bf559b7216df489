"""Where a start stands: both feet on the slope."""

from __future__ import annotations

from typing import Final

from walkerlab.config.numbers import short
from walkerlab.config.schema import Config
from walkerlab.config.tree import Mapping
from walkerlab.config.walkers import Kneed, PartsWalker

MOVED_RAD: Final = 1e-12


def on_the_slope(config: Config, tree: Mapping) -> tuple[Config, tuple[str, ...]]:
    """`config` with theta_1 of its start such that both feet stand on the slope, theta_1 + theta_2 = -2 phi.

    A start of legs with knees has both straight; a torso is on their bisector.
    """
    if isinstance(config.start, str) or isinstance(config.walker, PartsWalker):
        return config, ()
    given, stance, *others = config.start
    swing = -2 * (config.slope_rad + config.walker.lean_rad) - stance
    bodies = len(config.start) // 2
    shank = (swing,) if isinstance(config.walker, Kneed) else ()
    torso = (0.5 * (swing + stance),) if config.walker.torso is not None else ()
    placed = config.model_copy(update={"start": (swing, stance, *shank, *torso, *others[bodies - 2 :])})
    if abs(swing - given) <= MOVED_RAD:
        return placed, ()
    moved = (
        f"{tree.entries['start'].position}: start: theta_1 moved from {short(given)} to {short(swing)} rad, "
        f"so that both feet stand on the slope of {short(config.slope_rad)} rad"
    )
    return placed, (moved,)
