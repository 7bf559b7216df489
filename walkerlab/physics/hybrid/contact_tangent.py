"""Tangent of a walk on compliant ground: the variational equations along the solver's steps.

On each solver step the derivative Phi of the state obeys dPhi/dt = J(t) Phi. This equation is solved by three-stage
Radau collocation on the same step, with J at the stages: for radau5 this is the exact derivative of the step itself.
The force law is continuous at its switching points and at touch and lift, so Phi jumps only at the events of
`contact_jumps`. A foot that leaves its pad under load would also need a jump, but that happens in no gait.
"""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.ground.walker import STATE_VECTOR
from walkerlab.physics.kernels import kernel_part, pass_by_reference, vector
from walkerlab.physics.solvers.linear import factor, solve
from walkerlab.physics.solvers.radau5 import RADAU_NODES
from walkerlab.physics.solvers.stepping import T_OLD, T, interpolate
from walkerlab.physics.solvers.system import jacobian

SIDE_OFFSET = 4e-12  # s, a few times the uncertainty of event times
ROOT6 = 6.0**0.5
# coefficients of Radau IIA: Hairer and Wanner II, (5.6)
RADAU_WEIGHTS = np.array(
    [
        [(88.0 - 7.0 * ROOT6) / 360.0, (296.0 - 169.0 * ROOT6) / 1800.0, (-2.0 + 3.0 * ROOT6) / 225.0],
        [(296.0 + 169.0 * ROOT6) / 1800.0, (88.0 + 7.0 * ROOT6) / 360.0, (-2.0 - 3.0 * ROOT6) / 225.0],
        [(16.0 - ROOT6) / 36.0, (16.0 + ROOT6) / 36.0, 1.0 / 9.0],
    ]
)


@pass_by_reference
class Tangent(NamedTuple):
    """Derivative Phi of the state, and workspace. `n` is the size of the free walker's state with all bodies."""

    # If locked knees or a pinned foot reduce the state, only the first rows are used.

    Phi: Any  # (n, directions); no directions unless the tangent is requested
    stages: Any  # (4, n, n) Jacobians at the three stages, and one more for extrapolation
    system: Any  # (3 n, 3 n) matrix of the collocation equations, or its factors
    pivots: Any  # (3 n,)
    rates: Any  # (3 n,) stage derivatives of one direction


def new_tangent(n: int, directions: int) -> Tangent:
    m = n if directions else 0
    return Tangent(
        np.zeros((n, directions)),
        np.zeros((4, m, m)),
        np.zeros((3 * m, 3 * m)),
        np.zeros(3 * m, np.int64),
        np.zeros(3 * m),
    )


@kernel_part
def jacobian_at(method: Any, system: Any, fraction: float, J: Any) -> None:
    y = vector(STATE_VECTOR)[: method.y.size]
    interpolate(method, system, fraction, y)
    jacobian(system, method.clock[T_OLD] + fraction * (method.clock[T] - method.clock[T_OLD]), y, J)


@kernel_part
def carry_tangent(tangent: Tangent, method: Any, system: Any) -> None:
    """Advance Phi over the last solver step."""
    n, h = method.y.size, method.clock[T] - method.clock[T_OLD]
    for i in range(2):
        jacobian_at(method, system, RADAU_NODES[i], tangent.stages[i])
    jacobian_at_end(tangent, method, system)
    for i in range(3):
        for j in range(3):
            for row in range(n):
                for column in range(n):
                    same = 1.0 if i == j and row == column else 0.0
                    tangent.system[i * n + row, j * n + column] = (
                        same - h * RADAU_WEIGHTS[i, j] * tangent.stages[i, row, column]
                    )
    factor(tangent.system, tangent.pivots, 3 * n)
    for direction in range(tangent.Phi.shape[1]):
        carry_direction(tangent, n, direction, h)


@kernel_part
def jacobian_at_end(tangent: Tangent, method: Any, system: Any) -> None:
    """Compute the Jacobian at the solver step's end, extrapolated from two states shortly before the end."""
    # A solver step up to a switching point of the force law may end on either side of it, where the Jacobian jumps.
    near = min(0.25, SIDE_OFFSET / (method.clock[T] - method.clock[T_OLD]))
    for i in range(2):
        jacobian_at(method, system, 1.0 - (1 + i) * near, tangent.stages[2 + i])
    n = method.y.size
    for row in range(n):
        for column in range(n):
            tangent.stages[2, row, column] += tangent.stages[2, row, column] - tangent.stages[3, row, column]


@kernel_part
def carry_direction(tangent: Tangent, n: int, direction: int, h: float) -> None:
    """Advance one column of Phi (n,): solve K = J (Phi + h A K) for the stage derivatives, then add h b K."""
    for i in range(3):
        for row in range(n):
            total = 0.0
            for k in range(n):
                total += tangent.stages[i, row, k] * tangent.Phi[k, direction]
            tangent.rates[i * n + row] = total
    solve(tangent.system, tangent.pivots, tangent.rates, 0, 3 * n)
    for row in range(n):
        change = (
            RADAU_WEIGHTS[2, 0] * tangent.rates[row]
            + RADAU_WEIGHTS[2, 1] * tangent.rates[n + row]
            + RADAU_WEIGHTS[2, 2] * tangent.rates[2 * n + row]
        )
        tangent.Phi[row, direction] += h * change
