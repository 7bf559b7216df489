"""Compute the fall of a stone."""

import math
import os
from pathlib import Path

import numpy as np

from walkerlab.errors import NoAnswer
from walkerlab.pipeline.store.content import Content, Group, Variable


def run(config, inputs, progress):
    count(config)
    if config.slope_rad > 1.0:
        raise NoAnswer(f"too steep: {config.slope_rad}", "Try less.", Content({}, {"bounces": 0}))
    period = math.sqrt(2.0 / config.gravity_m_s2)
    fall = Group({"period_s": Variable(np.array([period]), ("stone",), "s", "duration of the fall")})
    summary = {
        "period_s": period,
        "speed_m_s": config.gravity_m_s2 * period,
        "bounces": 3,
        "stable": True,
        "state": [config.slope_rad, period],
        "slips_m": [0.1] * (1 + int(10 * config.slope_rad)),
        "losses_J": {"air": 0.25, "ground": config.walker.hip_mass_kg},
        "found_by": ["looking", "asking"],
        "rows": [{"error": 0.5, "wall_s": 3.0}],
        "reason": None,
        "left_out": [],
        "wall_s": 1.0,
    }
    return Content({"fall": fall}, summary)


def count(config):
    """Leave a mark for a computed point if a test has requested it."""
    folder = os.environ.get("TOY_SWEEP_MARKS")
    if folder:
        name = f"{os.getpid()}-{config.gravity_m_s2!r}-{config.slope_rad!r}-{config.walker.hip_mass_kg!r}"
        Path(folder, name).touch()
