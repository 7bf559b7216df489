"""Interface of integration methods: functions whose bodies are chosen by the type of the method.

A method is a NamedTuple that owns its memory, so nothing is allocated while it runs. All methods have these fields:

rtol, atol   tolerances on the error of a step
clock        (3,) start of the last step, its end, and the next step to try, s
y_old, y     (n,) states at start and end of the last step
counts       (5,) see the indices below
dense        (d, n) coefficients of the dense output of degree d; for a library's method, the library's own object
"""

from typing import Any

import numpy as np

from walkerlab.physics.kernels import dispatch_by_type, dispatch_by_type_or_default, kernel_part
from walkerlab.physics.solvers.system import Integers

# indices into `clock`
T_OLD, T, H_NEXT = range(3)
# indices into `counts`
RHS, ACCEPTED, REJECTED, JACOBIANS, BUDGET = range(5)
# results of `advance`
STEP_DONE, OUT_OF_BUDGET, STEP_TOO_SMALL = range(3)
SMALLEST_STEP = 1e-15


@dispatch_by_type
def begin(method: Any, system: Any, t: float, y: Any, h: float) -> None:
    """Start, or start again after an event, from state y (n,) at time t (s). For h = 0 the method chooses its step."""


@dispatch_by_type
def advance(method: Any, system: Any, t_end: float) -> int:
    """Take one accepted step up to t_end (s) at most, keep the previous state in `y_old`, and return a status."""


@dispatch_by_type
def rewind(method: Any, system: Any) -> None:
    """Go back to the start of the last step, to take it again up to an event."""


@dispatch_by_type_or_default
def prepare_dense(method: Any, system: Any) -> None:
    """Prepare the dense output of the last step for `interpolate`.

    Most methods do not implement this, because their steps already store the dense output.
    """


@dispatch_by_type
def interpolate(method: Any, system: Any, fraction: float, y: Any) -> None:
    """Write the state at `fraction` (0 to 1) of the last step, or as many of its components as y holds, into y."""


@dispatch_by_type_or_default
def sample(method: Any, system: Any, fractions: Any, states: Any) -> None:
    """Write the states at fractions (m,) of the last step, or their first components, into the rows of `states`."""
    for k in range(len(fractions)):
        interpolate(method, system, fractions[k], states[k, : method.y.size])


def new_counts(budget: int) -> Integers:
    return np.array([0, 0, 0, 0, budget], np.int64)


@kernel_part
def clear_counts(method: Any) -> None:
    """Reset all counts except the budget."""
    for i in range(BUDGET):
        method.counts[i] = 0
