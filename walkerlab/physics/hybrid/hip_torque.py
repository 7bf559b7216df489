"""Work of the constant torque at the hip, for both models.

Between two turns of the legs it is the torque times the angle by which they turned, so no power is integrated: only
the turns within a step are located, as events are.
"""

from typing import Any, NamedTuple

from walkerlab.physics.kernels import callable_kernel, kernel_part
from walkerlab.physics.mechanics.hinges import legs_apart
from walkerlab.physics.solvers.events import CrossingFinder, first_crossing
from walkerlab.physics.solvers.stepping import interpolate

BEYOND = 1e-12  # of a step: the next turn is sought so far behind the last one


class TorqueWork(NamedTuple):
    """Work of the torque (J)."""

    net: float
    positive: float


@kernel_part
def torque_work(torque: float, method: Any, system: Any, finder: CrossingFinder, row: int, until: float) -> TorqueWork:
    """Work of the torque (N m) in the last step up to a fraction of it.

    finder  its states are those of the step; overwritten
    row     of its values that is free for the rate between the legs
    """
    sample_rates(system, finder, row)
    y = finder.states[0, : method.y.size]
    first, _ = legs_apart(system, y)
    angle, positive, at = first, 0.0, 0.0
    while at < until:
        at = min(until, first_crossing(finder, row, 0, at + BEYOND if at > 0.0 else 0.0, False))
        interpolate(method, system, at, y)
        before = angle
        angle, _ = legs_apart(system, y)
        positive += max(0.0, torque * (angle - before))
    return TorqueWork(torque * (angle - first), positive)


@callable_kernel
def sample_rates(system: Any, finder: CrossingFinder, row: int) -> None:
    """The rate between the legs at the nodes of a step."""
    for node in range(finder.nodes.size):
        _, finder.values[row, node] = legs_apart(system, finder.states[node])
