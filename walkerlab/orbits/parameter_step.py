"""The compass's step map with its derivative along a parameter, and iterated with a tangent beside it: compiled."""

from typing import Any

from walkerlab.hybrid.rigid_observer import Unobserved
from walkerlab.hybrid.rigid_walk import slide_onto_slope, swing
from walkerlab.kernels import kernel
from walkerlab.mechanics.heel_strike import impact
from walkerlab.orbits.step_map import SECTION, WALKED, Shooting, on_section, step_with_jacobian
from walkerlab.solvers.stepping import H_NEXT, T, clear_counts, end_state


@kernel
def step_with_parameter(shooting: Shooting, near: Any, weights: Any, method: Any, z: Any, Dp: Any) -> tuple[int, float]:
    """One step from z (3,); its end and derivative are left in `shooting`, that along the parameter in Dp (3,).

    near     walkers at parameter values beside the shooting's own, in one tuple
    weights  (walkers,) of the difference formula, per unit of the parameter
    method   for four equations

    Returns the outcome's number and the step's duration (s).
    """
    clear_counts(shooting.method)
    clear_counts(method)
    status, period = step_with_jacobian(shooting, z)
    for i in range(SECTION):
        Dp[i] = 0.0
    for k in range(len(near)):
        if status != WALKED:
            break
        walker = near[k]
        method.clock[H_NEXT] = 0.0
        status = swing(method, walker, walker, shooting.finder, Unobserved(), 0.0, on_section(walker, z), 0)
        if status == WALKED:
            _, y = slide_onto_slope(walker, method.clock[T], end_state(method, walker))
            new = impact(walker, y[0], y[1], y[2], y[3])
            for i in range(SECTION):
                Dp[i] += weights[k] * new[i + 1]
    return status, period


@kernel
def walk_with_tangent(
    shooting: Shooting, z: Any, tangent: Any, points: Any, lengths: Any, periods: Any
) -> tuple[int, int]:
    """Walk from z (3,), led on in place, until the arrays are full or the walk ends.

    tangent  (3,) a displacement of z, led along by the derivative and brought back to unit length after every step
    points   (steps, 3) where each step led; written
    lengths  (steps,) length of the tangent after each step, one before it; written
    periods  (steps,) duration of each step; written

    Returns the outcome's number and how many steps were taken.
    """
    for step in range(lengths.size):
        clear_counts(shooting.method)
        status, period = step_with_jacobian(shooting, z)
        if status != WALKED:
            return status, step
        total = 0.0
        for i in range(SECTION):
            image = 0.0
            for j in range(SECTION):
                image += shooting.DP[i, j] * tangent[j]
            shooting.move[i] = image
            total += image * image
        length = total**0.5
        for i in range(SECTION):
            tangent[i] = shooting.move[i] / length if length > 0.0 else tangent[i]
            z[i] = shooting.z_next[i]
            points[step, i] = z[i]
        lengths[step], periods[step] = length, period
    return WALKED, lengths.size
