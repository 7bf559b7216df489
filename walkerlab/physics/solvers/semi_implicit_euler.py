"""Semi-implicit Euler with a fixed step, as in game engines: new velocities first, then positions from them.

It is of first order, without error estimate or events, and serves only for comparison.
"""

import math
from typing import Any

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers.system import derivative

DIVERGED = 1e12  # a component of the state beyond this means that the run diverged


@kernel
def semi_implicit_euler(system: Any, y: Any, rate: Any, end: float, h: float, max_steps: int) -> int:
    """Integrate y (n,) in place from time 0 to `end` (s) with steps of h (s), and return the number of steps.

    The first half of y holds positions, the second half their velocities. `rate` (n,) is scratch memory. The last step
    is shortened to end at `end`. The run stops early after `max_steps`, or if the state diverges or is not a number.
    """
    half = y.size // 2
    # Rounding of the quotient must not add a step of almost no length.
    steps = math.ceil(end / h * (1.0 - 1e-12))
    for step in range(min(steps, max_steps)):
        span = min(h, end - step * h)
        derivative(system, step * h, y, rate)
        for i in range(half):
            y[half + i] += span * rate[half + i]
        for i in range(half):
            y[i] += span * y[half + i]
        for i in range(y.size):
            # The comparison is also true for NaN.
            if not abs(y[i]) < DIVERGED:
                return step + 1
    return min(steps, max_steps)
