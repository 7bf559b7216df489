"""Push-off on compliant ground: a pulse of force at the trailing foot, directed from its contact point to the hip.

The pulse begins when the other foot touches and delivers the push-off's impulse P over a duration D. Its force is
30 u^2 (1 - u)^2 P / D, smooth at both ends, where u is the elapsed fraction of D.
"""

import math
from typing import Any, NamedTuple

from walkerlab.physics.ground.walker import GroundModel, OnGround
from walkerlab.physics.kernels import kernel_part


@kernel_part
def pulse_force(system: OnGround, t: float, foot: int) -> float:
    # A walk starts in the state after a strike, in which the push-off of that strike is over, so the first pulse begins
    # at the first touch.
    if system.form.push_off == 0.0 or system.progress.steps == 0:
        return 0.0
    u = (t - system.progress.last_touch) / system.form.push_off_duration
    if u <= 0.0 or u >= 1.0:
        return 0.0
    # The integral of u^2 (1 - u)^2 is 1/30.
    return 30.0 * (u * (1.0 - u)) ** 2 * system.form.push_offs[foot] / system.form.push_off_duration


@kernel_part
def pulse_left(system: OnGround, t: float) -> float:
    """Return the remaining duration (s) of the current pulse, or 0 if no pulse acts."""
    if system.form.push_off == 0.0 or system.progress.steps == 0:
        return 0.0
    return max(0.0, system.progress.last_touch + system.form.push_off_duration - t)


class Push(NamedTuple):
    along: float  # N
    upward: float  # N
    ahead: float  # m, distance from the foot's contact point to the hip, along the slope
    above: float  # m, the same distance normal to the slope


@kernel_part
def push_on(system: OnGround, t: float, foot: int, s: Any, c: Any) -> Push:
    """Compute the push-off on a foot at time t (s). It is zero outside a pulse and on the stance foot."""
    form = system.form
    force = pulse_force(system, t, foot) if foot != system.progress.stance else 0.0
    if force == 0.0:
        return Push(0.0, 0.0, 0.0, 0.0)
    ahead = 0.0
    above = form.radius[foot]
    for k in range(form.bodies):
        forward, upward = lever_to_hip(form, foot, s, c, k)
        ahead += forward
        above += upward
    over_length = force / math.sqrt(ahead * ahead + above * above)
    return Push(over_length * ahead, over_length * above, ahead, above)


@kernel_part
def lever_to_hip(form: GroundModel, foot: int, s: Any, c: Any, k: int) -> tuple[float, float]:
    """Return a body's contribution (m) to the vector from a foot's centre to the hip, along and normal to the slope."""
    x, y = form.hip_x[k] - form.foot_x[foot, k], form.hip_y[k] - form.foot_y[foot, k]
    return c[k] * x - s[k] * y, s[k] * x + c[k] * y


@kernel_part
def push_gradient(form: GroundModel, push: Push, foot: int, s: Any, c: Any, k: int) -> tuple[float, float]:
    """Compute the derivatives (N/rad) of a push with respect to the angle of body k.

    The push changes its direction, but not its magnitude.
    """
    forward, upward = lever_to_hip(form, foot, s, c, k)
    # Force per length, times the angle by which the line from foot to hip turns for a unit turn of body k.
    turned = (push.along * forward + push.upward * upward) / (push.ahead * push.ahead + push.above * push.above)
    return -turned * push.above, turned * push.ahead
