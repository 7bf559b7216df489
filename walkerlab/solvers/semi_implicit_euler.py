"""Semi-implicit Euler with a fixed step, as game engines integrate: velocities first, then positions with the new ones.

No error estimate, no events, first order: here to show what it does where the project's own methods are used.
"""

import math
from typing import Any

from walkerlab.kernels import kernel
from walkerlab.solvers.system import derivative

RUNAWAY = 1e12  # a number of the state beyond which a run has diverged


@kernel
def semi_implicit_euler(system: Any, y: Any, rate: Any, end: float, h: float, most_steps: int) -> int:
    """Integrate y (n,) in place from time 0 to `end` (s) with steps of h (s), the last one shorter.

    rate  (n,) scratch

    The first half of y are positions, the second half their velocities. Returns how many steps were taken: fewer than
    lead to `end` if `most_steps` are used up, or if a number of the state runs away or is none any more.
    """
    half = y.size // 2
    steps = math.ceil(end / h * (1.0 - 1e-12))
    for step in range(min(steps, most_steps)):
        span = min(h, end - step * h)
        derivative(system, step * h, y, rate)
        for i in range(half):
            y[half + i] += span * rate[half + i]
        for i in range(half):
            y[i] += span * y[half + i]
        for i in range(y.size):
            if not abs(y[i]) < RUNAWAY:
                return step + 1
    return min(steps, most_steps)
