"""A basin of attraction with values set by hand, in the layout of the stage."""

from types import SimpleNamespace

import numpy as np
from synthetic_walks import stored

from walkerlab.config.loader import load
from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.basin import UNREACHED, WalkEnds
from walkerlab.pipeline.stages.basin import group_of, summary, window_of

CONFIG = load(None, ["basin.cells=[4,3]"]).config
Z = [0.17, -0.6, -0.86]


def basin(attractor, aperiodic=False, config=CONFIG, steps=7):
    """Return a basin in which cells walk if they have an attractor, or -2 for a walk that does not settle. All others
    fall.
    """
    window = window_of(config, Z)
    attractor = np.resize(attractor, window.size)
    walks = attractor != UNREACHED
    found = WalkEnds(
        np.where(walks, Outcome.WALKED, Outcome.FELL), np.maximum(attractor, UNREACHED), np.where(walks, steps, 1)
    )
    question = SimpleNamespace(attractor_rows=lambda: [{"period": 1}, {"period": 2}], aperiodic=aperiodic)
    said = summary(config.basin, window, found, walks.astype(float).reshape(window.cells), question)
    return {"basin": stored("basin", {"basin": group_of(config.basin, window, found, walks)}, said)}
