"""Where the gait that walks first doubles its period, as figure and report say it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def first_doubling(summary: Mapping[str, Any], model: str) -> float | None:
    """The least flip at which a model's gait of one step ceases to be stable; None if it has none.

    summary  of the stage `continuation`; unstable gaits of one step, which it has too, may flip before
    """
    alone = [one for one in summary["branches"] if (one["model"], one["period"]) == (model, 1)]
    ends = [end for branch in alone for pair in branch["stable_ranges"] for end in pair]
    flips = [
        one["value"]
        for one in summary["bifurcations"]
        if (one["model"], one["kind"], one["period"]) == (model, "flip", 1)
    ]
    return min((flip for flip in flips if any(math.isclose(flip, end) for end in ends)), default=None)
