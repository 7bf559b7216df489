"""Footholds of a walk over uneven ground."""

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.ground import Footholds


def foothold_heights(ground: Footholds, steps: int) -> NDArray[np.float64] | None:
    """Heights (steps + 1,) in m over the slope of a walk's footholds, its start's first; None where all are zero.

    Those drawn are independent and normal; how many are asked for does not change the first.
    """
    if ground.even:
        return None
    if ground.heights_m:
        listed = np.array(ground.heights_m)[:steps]
        return np.concatenate(([0.0], listed, np.full(steps - listed.size, ground.heights_m[-1])))
    return np.append(0.0, np.random.default_rng(ground.seed).normal(0.0, ground.roughness_m, steps))
