"""The push-off on compliant ground: a pulse of force at the trailing foot, along the line from there to the hip.

It begins at the touch of the other foot, has the push-off's impulse P, and with u the part of its duration D that has
passed its force is 30 u^2 (1 - u)^2 P / D, smooth where it begins and ends.
"""

import math
from typing import Any, NamedTuple

from walkerlab.ground.walker import OF_BODIES, FootMotion, OnGround, half_size
from walkerlab.kernels import always_inline, inlined, vector
from walkerlab.mechanics.tree import projections

LAST_TOUCH = 0  # index into a walk state's times
STANCE, STEPS = 0, 1  # indices into a walk state's feet


@inlined
def pulse_force(system: OnGround, t: float) -> float:
    """Force (N) of the pulse at a time; 0 where none lasts."""
    if system.form.push_off == 0.0 or system.feet[STEPS] == 0:
        return 0.0
    u = (t - system.times[LAST_TOUCH]) / system.form.push_off_duration
    if u <= 0.0 or u >= 1.0:
        return 0.0
    return 30.0 * (u * (1.0 - u)) ** 2 * system.form.push_off / system.form.push_off_duration


@inlined
def pulse_left(system: OnGround, t: float) -> float:
    """How much longer (s) a pulse lasts; nothing where none does."""
    if system.form.push_off == 0.0 or system.feet[STEPS] == 0:
        return 0.0
    return max(0.0, system.times[LAST_TOUCH] + system.form.push_off_duration - t)


class Push(NamedTuple):
    """A pulse as it acts now."""

    along: float  # N
    upward: float  # N
    over_length: float  # N/m, its force over the distance of foot and hip


@always_inline
def levers_to_hip(system: OnGround, foot: int, s: Any, c: Any, F: Any, U: Any) -> Push:
    """Projections (n,) of the levers from a foot's centre to the hip; the unit force from where it touches to there."""
    form = system.form
    projections(form.hip_x, form.hip_y, form.bodies, s, c, F, U)
    of_foot_F, of_foot_U, ahead, above = vector(OF_BODIES), vector(OF_BODIES), 0.0, form.radius[foot]
    projections(form.foot_x[foot], form.foot_y[foot], form.bodies, s, c, of_foot_F, of_foot_U)
    for k in range(form.bodies):
        F[k] -= of_foot_F[k]
        U[k] -= of_foot_U[k]
        ahead += F[k]
        above += U[k]
    length = math.sqrt(ahead * ahead + above * above)
    return Push(ahead / length, above / length, 1.0 / length)


@always_inline
def add_pulse(system: OnGround, t: float, s: Any, c: Any, r: Any) -> tuple[float, float]:
    """Force of the pulse along and normal to the slope (N); its torques (N m) are added to r (n,)."""
    force = pulse_force(system, t)
    if force == 0.0:
        return 0.0, 0.0
    form, foot = system.form, 1 - system.feet[STANCE]
    F, U = vector(OF_BODIES), vector(OF_BODIES)
    unit = levers_to_hip(system, foot, s, c, F, U)
    projections(form.foot_x[foot], form.foot_y[foot], form.bodies, s, c, F, U)
    for k in range(form.bodies):
        r[k] += force * (unit.along * (form.rolling[foot, k] - U[k]) + unit.upward * F[k])
    return force * unit.along, force * unit.upward


@inlined
def add_pulse_gradients(system: OnGround, t: float, s: Any, c: Any, J: Any) -> None:
    """Add the derivatives of that force and its torques by the angles to the acceleration rows of J."""
    force = pulse_force(system, t)
    if force == 0.0:
        return
    form, foot = system.form, 1 - system.feet[STANCE]
    n, p, half = form.bodies, form.places, half_size(form)
    to_hip_F, to_hip_U, F, U = vector(OF_BODIES), vector(OF_BODIES), vector(OF_BODIES), vector(OF_BODIES)
    unit = levers_to_hip(system, foot, s, c, to_hip_F, to_hip_U)
    projections(form.foot_x[foot], form.foot_y[foot], n, s, c, F, U)
    for j in range(n):
        J[half + p + j, p + j] -= force * (unit.along * F[j] + unit.upward * U[j])
        # the line turns with what of the lever's change is across it
        across = unit.along * to_hip_F[j] + unit.upward * to_hip_U[j]
        turned = force * unit.over_length * across
        along, upward = -turned * unit.upward, turned * unit.along
        if p > 0:
            J[half, p + j] += along
            J[half + 1, p + j] += upward
        for k in range(n):
            J[half + p + k, p + j] += along * (form.rolling[foot, k] - U[k]) + upward * F[k]


@inlined
def pulse_power(system: OnGround, t: float, s: Any, c: Any, motion: FootMotion) -> float:
    """Power (W) of the pulse at the foot that moves so."""
    force = pulse_force(system, t)
    if force == 0.0:
        return 0.0
    unit = levers_to_hip(system, 1 - system.feet[STANCE], s, c, vector(OF_BODIES), vector(OF_BODIES))
    return force * (unit.along * motion.slip + unit.upward * motion.vertical_velocity)
