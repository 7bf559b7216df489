"""The uneven ground of a stored walk, as it is drawn."""

import numpy as np
from numpy.typing import NDArray

from walkerlab.pipeline.store.content import Group

Array = NDArray[np.float64]

UNEVEN = "foothold_height_m"  # stored of each step where the ground is uneven
FAR = 1e6  # m, before everything that is drawn


def ground_levels(steps: Group) -> tuple[Array, Array] | None:
    """Return where each level of a walk's ground begins along the slope, midway between footholds, and its height (m).

    steps  as both models store them

    None on even ground.
    """
    if UNEVEN not in steps.variables:
        return None
    along = np.append(0.0, steps["touch_along_m"])
    return np.append(-FAR, 0.5 * (along[:-1] + along[1:])), np.append(0.0, steps[UNEVEN])
