"""Compute the fall of a stone. There is no answer for slopes above one radian. If a test names a file, wait for it."""

import os
import time
from pathlib import Path

import numpy as np

from toy.physics import fall_time
from walkerlab.errors import NoAnswer
from walkerlab.pipeline.store.content import Content, Group, Variable


def run(config, inputs, progress):
    progress.start("dropping", 1)
    if "TOY_BEGUN" in os.environ:
        Path(os.environ["TOY_BEGUN"]).touch()
        while not Path(os.environ["TOY_GO_ON"]).exists():
            time.sleep(0.01)
    period = fall_time(1.0, config.gravity_m_s2)
    heights = Group(
        {
            "time": Variable(np.linspace(0.0, period, 5), ("time",), "s", "time"),
            "height": Variable(1.0 - np.linspace(0.0, 1.0, 5) ** 2, ("time",), "m", "height of the stone"),
        }
    )
    content = Content({"fall": heights}, {"period_s": period, "slope_rad": config.slope_rad})
    if config.slope_rad > 1.0:
        raise NoAnswer("the slope is too steep", "Try one below 1 rad.", partial=content)
    progress.advance()
    return content
