"""Torques at hinges on compliant ground: spring, damper and drive at each hinge, and a stop at each knee."""

from typing import Any

from walkerlab.physics.ground.knees import angle_between
from walkerlab.physics.ground.walker import FIRST_KNEE, STOPPING, OnGround, half_size
from walkerlab.physics.kernels import kernel_part
from walkerlab.physics.mechanics import hinges


@kernel_part
def hip_sign(system: OnGround, row: int) -> float:
    """Return the sign of the angle at a hinge: -1 at the hip while the first leg is the stance leg, otherwise 1."""
    return -1.0 if row == hinges.HIP_ROW and system.progress.stance == 0 else 1.0


@kernel_part
def angle_at(system: OnGround, row: int, y: Any) -> tuple[float, float]:
    """Return the angle (rad) by which a hinge's first body is ahead of its second, and its rate (rad/s)."""
    # At the hip the first body is that of the swing leg, so it changes when the legs exchange roles at a touch.
    form = system.form
    sign = hip_sign(system, row)
    return sign * angle_between(form, row, y, form.places), sign * angle_between(
        form, row, y, half_size(form) + form.places
    )


@kernel_part
def is_stopping(system: OnGround, row: int) -> bool:
    return row >= FIRST_KNEE and system.knee[row - FIRST_KNEE] == STOPPING


@kernel_part
def torque_at(system: OnGround, row: int, y: Any) -> hinges.HingeTorque:
    """Compute the torque of spring, damper and drive at a hinge, plus the torque of a knee's stop while it acts."""
    angle, rate = angle_at(system, row, y)
    law = hinges.hinge_torque(hinges.hinge_law(system.form, row), angle, rate)
    if not is_stopping(system, row):
        return law
    stop = hinges.hinge_torque(system.stop, angle, rate)
    return hinges.HingeTorque(
        law.resistance + stop.resistance,
        law.elastic + stop.elastic,
        law.by_angle + stop.by_angle,
        law.by_rate + stop.by_rate,
    )


@kernel_part
def bodies_at(system: OnGround, row: int) -> tuple[int, int]:
    """Return the body that a hinge's resistance turns back, and the one that it turns forward."""
    body = system.form.hinges[row, 0]
    other = system.form.hinges[row, 1]
    return (other, body) if hip_sign(system, row) < 0.0 else (body, other)


@kernel_part
def add_torques(system: OnGround, y: Any, r: Any) -> None:
    """Add the torques (N m) at all hinges to r (n,)."""
    for row in range(len(system.form.hinges)):
        if hinges.is_sprung(system.form, row) or is_stopping(system, row):
            body, other = bodies_at(system, row)
            hinges.add_hinge_torque(torque_at(system, row, y), body, other, r)


@kernel_part
def add_gradients(system: OnGround, y: Any, by_angle: Any, by_rate: Any) -> None:
    """Add the derivatives of all hinge torques with respect to angles and rates to by_angle and by_rate (n, n)."""
    for row in range(len(system.form.hinges)):
        if hinges.is_sprung(system.form, row) or is_stopping(system, row):
            body, other = bodies_at(system, row)
            hinges.add_hinge_gradients(torque_at(system, row, y), body, other, by_angle, by_rate)


@kernel_part
def hinge_energies(system: OnGround, y: Any) -> tuple[float, float]:
    """Compute the elastic energy (J) of the springs at all hinges, and the elastic energy (J) of the knees' stops."""
    springs = 0.0
    stops = 0.0
    for row in range(len(system.form.hinges)):
        angle, _ = angle_at(system, row, y)
        if hinges.is_sprung(system.form, row):
            springs += hinges.hinge_energy(hinges.hinge_law(system.form, row), angle)
        if is_stopping(system, row):
            stops += hinges.hinge_energy(system.stop, angle)
    return springs, stops


@kernel_part
def hinge_powers(system: OnGround, y: Any) -> tuple[float, float]:
    """Compute the power (W) supplied by drives and dampers at all hinges, and the power lost in the stops of knees."""
    supplied = 0.0
    lost = 0.0
    for row in range(len(system.form.hinges)):
        angle, rate = angle_at(system, row, y)
        if hinges.is_sprung(system.form, row):
            law = hinges.hinge_torque(hinges.hinge_law(system.form, row), angle, rate)
            # The spring's part is stored, not supplied: `hinge_energies` counts it.
            supplied += (law.elastic - law.resistance) * rate
        if is_stopping(system, row):
            stop = hinges.hinge_torque(system.stop, angle, rate)
            lost += (stop.resistance - stop.elastic) * rate
    return supplied, lost


@hinges.legs_apart.case(OnGround)
def legs_apart_on_ground(system: OnGround, y: Any) -> tuple[float, float]:
    """Return the angle between the legs' uppermost bodies (rad), and its rate (rad/s)."""
    return angle_at(system, hinges.HIP_ROW, y)
