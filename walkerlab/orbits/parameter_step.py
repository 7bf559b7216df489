"""The rigid model's step map with its derivative along a parameter, and iterated with a tangent beside it: compiled."""

from typing import Any

from walkerlab.hybrid.rigid_observer import Unobserved
from walkerlab.hybrid.rigid_walk import HEEL_STRIKE, on_event, swing
from walkerlab.kernels import kernel
from walkerlab.mechanics.impact import heel_strike
from walkerlab.mechanics.standing import Mode
from walkerlab.orbits.step_map import WALKED, Shooting, on_section, step_with_jacobian
from walkerlab.solvers.stepping import H_NEXT, clear_counts


@kernel
def step_with_parameter(shooting: Shooting, near: Any, weights: Any, method: Any, z: Any, Dp: Any) -> tuple[int, float]:
    """One step from z (d,); its end and derivative are left in `shooting`, that along the parameter in Dp (d,).

    near     walkers at parameter values beside the shooting's own, in one tuple
    weights  (walkers,) of the difference formula, per unit of the parameter
    method   for the walker's equations

    Returns the outcome's number and the step's duration (s).
    """
    clear_counts(shooting.method)
    clear_counts(method)
    status, period = step_with_jacobian(shooting, z)
    for i in range(shooting.move.size):
        Dp[i] = 0.0
    for k in range(len(near)):
        if status != WALKED:
            break
        walker = near[k]
        method.clock[H_NEXT] = 0.0
        bent, start = Mode(walker, walker.bent), on_section(walker, z)
        status = swing(method, bent, walker, shooting.finder, Unobserved(), 0.0, start, 0, shooting.knee_time)
        if status == WALKED:
            _, y = on_event(method, Mode(walker, walker.straight), HEEL_STRIKE)
            new = heel_strike(walker, y)
            for i in range(shooting.move.size):
                Dp[i] += weights[k] * new[walker.picked[i]]
    return status, period


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
        status, period = step_with_jacobian(shooting, z)
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
