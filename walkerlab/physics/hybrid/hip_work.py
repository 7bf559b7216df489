"""Work of the constant torque at the hip, for both models.

Between two reversals of the angle between the legs, the work is the torque times the change of that angle, so no power
is integrated: only the reversals within a solver step are located, like events.
"""

from typing import Any, NamedTuple

from walkerlab.physics.kernels import kernel, kernel_part
from walkerlab.physics.mechanics.hinges import legs_apart
from walkerlab.physics.solvers.events import CrossingFinder, first_crossing
from walkerlab.physics.solvers.stepping import interpolate

ROUNDING = 1e-12  # fraction of a solver step between a reversal and the start of the search for the next one


class TorqueWork(NamedTuple):
    """Work of the hip torque (J)."""

    net: float
    positive: float


@kernel_part
def torque_work(torque: float, method: Any, system: Any, finder: CrossingFinder, row: int, until: float) -> TorqueWork:
    """Compute the work of `torque` (N m) in the last solver step up to fraction `until`. This overwrites the `row`."""
    sample_rates(system, finder, row)
    y = finder.states[0, : method.y.size]
    first, _ = legs_apart(system, y)
    angle = first
    positive = 0.0
    fraction = 0.0
    while fraction < until:
        fraction = min(until, first_crossing(finder, row, 0, fraction + ROUNDING if fraction > 0.0 else 0.0, False))
        interpolate(method, system, fraction, y)
        before = angle
        angle, _ = legs_apart(system, y)
        positive += max(0.0, torque * (angle - before))
    return TorqueWork(torque * (angle - first), positive)


@kernel
def sample_rates(system: Any, finder: CrossingFinder, row: int) -> None:
    """Write the legs' relative angular velocity (rad/s) at the nodes of a solver step into `row` of the finder."""
    for node in range(finder.nodes.size):
        _, finder.values[row, node] = legs_apart(system, finder.states[node])
