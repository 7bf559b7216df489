"""Uneven ground of a stored walk, for drawings."""

import numpy as np
from numpy.typing import NDArray

from walkerlab.pipeline.store.content import Group

Array = NDArray[np.float64]

UNEVEN = "foothold_height_m"  # name of the variable with the foothold heights, stored only on uneven ground
FAR_EDGE_M = 1e6  # m; the first level begins this far behind the first foothold, outside any drawing


def ground_levels(steps: Group) -> tuple[Array, Array] | None:
    """Return where each ground level begins along the slope, and its height (m). Levels meet midway between footholds.

    steps  stored group of the walk's steps

    Returns None on even ground.
    """
    if UNEVEN not in steps.variables:
        return None
    along = np.append(0.0, steps["touch_along_m"])
    return np.append(-FAR_EDGE_M, 0.5 * (along[:-1] + along[1:])), np.append(0.0, steps[UNEVEN])
