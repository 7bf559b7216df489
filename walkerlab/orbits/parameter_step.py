"""The rigid model's step map with its derivative along a parameter, and iterated with a tangent beside it: compiled."""

from typing import Any

from walkerlab.kernels import kernel
from walkerlab.orbits.step_map import WALKED, Shooting, step_from
from walkerlab.solvers.stepping import clear_counts


@kernel
def step_with_parameter(shooting: Shooting, near: Any, weights: Any, z: Any, Dp: Any) -> tuple[int, float]:
    """One step from z (d,); its end and derivative are left in `shooting`, that along the parameter in Dp (d,).

    near     walkers at parameter values beside the shooting's own, in one tuple
    weights  (walkers,) of the difference formula, per unit of the parameter

    Returns the outcome's number and the step's duration (s).
    """
    clear_counts(shooting.method)
    beside = WALKED
    for i in range(len(z)):
        Dp[i] = 0.0
    for k in range(len(near)):
        if beside == WALKED:
            beside, _, _ = step_from(shooting, near[k], z, False)
            for i in range(len(z)):
                Dp[i] += weights[k] * shooting.z_next[i]
    status, period, _ = step_from(shooting, shooting.walker, z, True)
    return beside if status == WALKED else status, period


@kernel
def walk_with_tangent(
    shooting: Shooting, z: Any, tangent: Any, points: Any, lengths: Any, periods: Any
) -> tuple[int, int]:
    """Walk from z (d,), led on in place, until the arrays are full or the walk ends.

    tangent  (d,) a displacement of z, led along by the derivative and brought back to unit length after every step
    points   (steps, d) where each step led; written
    lengths  (steps,) length of the tangent after each step, one before it; written
    periods  (steps,) duration of each step; written

    Returns the outcome's number and how many steps were taken.
    """
    for step in range(lengths.size):
        clear_counts(shooting.method)
        status, period, _ = step_from(shooting, shooting.walker, z, True)
        if status != WALKED:
            return status, step
        total = 0.0
        for i in range(shooting.move.size):
            image = 0.0
            for j in range(shooting.move.size):
                image += shooting.DP[i, j] * tangent[j]
            shooting.move[i] = image
            total += image * image
        length = total**0.5
        for i in range(shooting.move.size):
            tangent[i] = shooting.move[i] / length if length > 0.0 else tangent[i]
            z[i] = shooting.z_next[i]
            points[step, i] = z[i]
        lengths[step], periods[step] = length, period
    return WALKED, lengths.size
