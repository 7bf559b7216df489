"""Foothold heights of a walk over uneven ground."""

import numpy as np

from walkerlab.config.ground import Footholds
from walkerlab.physics.hybrid.walk_record import rough_heights
from walkerlab.physics.solvers.system import Floats


def foothold_heights(ground: Footholds, steps: int) -> Floats | None:
    """Return the heights (steps + 1,) of the footholds in m above the slope, from the start on, or None if even."""
    if ground.even:
        return None
    if ground.heights_m:
        listed = np.array(ground.heights_m)[:steps]
        return np.concatenate(([0.0], listed, np.full(steps - listed.size, ground.heights_m[-1])))
    return rough_heights(ground.roughness_m, ground.seed, steps)
