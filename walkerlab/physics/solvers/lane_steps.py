"""Steps of DOP853 on states that are tuples of lanes, which stay in registers. See `dop853`."""

from typing import Any

from numba.core import cgutils
from numba.extending import intrinsic

from walkerlab.physics.kernels import dispatch_by_type, kernel_part
from walkerlab.physics.solvers import dop853_tableau as tableau
from walkerlab.physics.solvers.dop853_tableau import nonzero
from walkerlab.physics.solvers.lanes import VECTOR, multiply_add, spread_over
from walkerlab.physics.solvers.system import State

LANE_NODES = tableau.NODES
A_2 = nonzero(tableau.A_2)
A_3 = nonzero(tableau.A_3)
A_4 = nonzero(tableau.A_4)
A_5 = nonzero(tableau.A_5)
A_6 = nonzero(tableau.A_6)
A_7 = nonzero(tableau.A_7)
A_8 = nonzero(tableau.A_8)
A_9 = nonzero(tableau.A_9)
A_10 = nonzero(tableau.A_10)
A_11 = nonzero(tableau.A_11)
A_12 = nonzero(tableau.A_12)
A_13 = nonzero(tableau.A_13)
LANE_ERROR_5 = nonzero(tableau.ERROR_5)
LANE_ERROR_3 = nonzero(tableau.ERROR_3)


@dispatch_by_type
def derivative(system: Any, t: float, y: State) -> State:
    """Return dy/dt of `system` at time t (s) and state y, both tuples of numbers or lanes."""


def _sums(builder: Any, weights: Any, vectors: Any, length: int) -> list[Any]:
    """Build the sum over j of weights[j] * vectors[j], each component a chain of fused multiply-adds."""
    columns = [cgutils.unpack_tuple(builder, vector) for vector in cgutils.unpack_tuple(builder, vectors)]
    factors = [match_lanes(builder, factor, columns[0][0]) for factor in cgutils.unpack_tuple(builder, weights)]
    sums = []
    for i in range(length):
        total = builder.fmul(factors[0], columns[0][i])
        for factor, column in zip(factors[1:], columns[1:], strict=True):
            total = multiply_add(builder, factor, column[i], total)
        sums.append(total)
    return sums


def match_lanes(builder: Any, number: Any, partner: Any) -> Any:
    """Repeat a number in each lane if `partner` holds lanes."""
    return spread_over(builder, number) if partner.type == VECTOR else number


@intrinsic
def combine(context: Any, weights: Any, vectors: Any) -> Any:
    """Return the sum over j of weights[j] * vectors[j], where all vectors are tuples."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        sums = _sums(builder, arguments[0], arguments[1], vectors.dtype.count)
        return context.make_tuple(builder, signature.return_type, sums)

    return vectors.dtype(weights, vectors), generate


@intrinsic
def stage_state(context: Any, y: Any, h: Any, weights: Any, vectors: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        state, step, factors, columns = arguments
        sums = _sums(builder, factors, columns, y.count)
        start = cgutils.unpack_tuple(builder, state)
        step = match_lanes(builder, step, start[0])
        moved = [multiply_add(builder, step, total, value) for total, value in zip(sums, start, strict=True)]
        return context.make_tuple(builder, signature.return_type, moved)

    return y(y, y.dtype, weights, vectors), generate


@kernel_part
def run_stages(system: Any, t: float, y: State, k1: State, h: float) -> tuple[tuple[State, ...], State, State]:
    """Compute the stages needed for solution and error (k1, k6 to k12), the solution, and its derivative."""
    # Written out, because in compiled code tuples of different lengths are different types: no loop can extend them.
    k2 = derivative(system, t + LANE_NODES[1] * h, stage_state(y, h, A_2, (k1,)))
    k3 = derivative(system, t + LANE_NODES[2] * h, stage_state(y, h, A_3, (k1, k2)))
    k4 = derivative(system, t + LANE_NODES[3] * h, stage_state(y, h, A_4, (k1, k3)))
    k5 = derivative(system, t + LANE_NODES[4] * h, stage_state(y, h, A_5, (k1, k3, k4)))
    k6 = derivative(system, t + LANE_NODES[5] * h, stage_state(y, h, A_6, (k1, k4, k5)))
    k7 = derivative(system, t + LANE_NODES[6] * h, stage_state(y, h, A_7, (k1, k4, k5, k6)))
    k8 = derivative(system, t + LANE_NODES[7] * h, stage_state(y, h, A_8, (k1, k4, k5, k6, k7)))
    k9 = derivative(system, t + LANE_NODES[8] * h, stage_state(y, h, A_9, (k1, k4, k5, k6, k7, k8)))
    k10 = derivative(system, t + LANE_NODES[9] * h, stage_state(y, h, A_10, (k1, k4, k5, k6, k7, k8, k9)))
    k11 = derivative(system, t + LANE_NODES[10] * h, stage_state(y, h, A_11, (k1, k4, k5, k6, k7, k8, k9, k10)))
    k12 = derivative(system, t + h, stage_state(y, h, A_12, (k1, k4, k5, k6, k7, k8, k9, k10, k11)))
    needed = (k1, k6, k7, k8, k9, k10, k11, k12)
    y_new = stage_state(y, h, A_13, needed)
    return needed, y_new, derivative(system, t + h, y_new)


@kernel_part
def error_sums(method: Any, y: State, y_new: State, by_order_5: State, by_order_3: State) -> tuple[float, float]:
    """Compute, for each error estimate, the sum of squares of error over tolerance. `method` holds rtol and atol."""
    error_5 = 0.0
    error_3 = 0.0
    for i in range(len(y)):
        scale = 1.0 / (method.atol + method.rtol * max(abs(y[i]), abs(y_new[i])))
        relative_5 = by_order_5[i] * scale
        relative_3 = by_order_3[i] * scale
        error_5 += relative_5 * relative_5
        error_3 += relative_3 * relative_3
    return error_5, error_3
