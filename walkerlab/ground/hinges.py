"""Torques at hinges on compliant ground: of the knees' stops, and of what acts between the legs."""

from typing import Any

from walkerlab.ground.knees import extension_rate
from walkerlab.ground.walker import STOPPING, Form, OnGround, half_size
from walkerlab.kernels import inlined
from walkerlab.mechanics.hinges import (
    HingeTorque,
    add_hinge_gradients,
    add_hinge_torque,
    hinge_energy,
    hinge_torque,
    hip_law,
    legs_apart,
)


@inlined
def ahead(form: Form, body: int, other: int, y: Any, first: int) -> float:
    """How far a body is ahead of another (rad), of the coordinates that begin at y[first]; or how fast."""
    return y[first + form.places + body] - y[first + form.places + other]


@inlined
def torque_now(law: Any, form: Form, body: int, other: int, y: Any) -> HingeTorque:
    """The torque of a law between two bodies in a state."""
    return hinge_torque(law, ahead(form, body, other, y, 0), ahead(form, body, other, y, half_size(form)))


@inlined
def swing_and_stance(system: OnGround) -> tuple[int, int]:
    """The uppermost bodies of the leg that swings and of that which stands: at a touch they change places."""
    stance = system.progress.stance
    return system.form.uppers[1 - stance], system.form.uppers[stance]


@inlined
def add_torques(system: OnGround, y: Any, r: Any) -> None:
    """Add the torques (N m) at all hinges to r (n,)."""
    form = system.form
    for knee in range(2):
        if system.knee[knee] == STOPPING:
            shank, thigh = form.shanks[knee], form.thighs[knee]
            add_hinge_torque(torque_now(system.stop, form, shank, thigh, y), shank, thigh, r)
    if form.driven_hip:
        swing, stance = swing_and_stance(system)
        add_hinge_torque(torque_now(hip_law(form), form, swing, stance, y), swing, stance, r)


@inlined
def add_gradients(system: OnGround, y: Any, by_angle: Any, by_rate: Any) -> None:
    """Add the derivatives of those torques by the angles and their velocities to by_angle and by_rate (n, n)."""
    form = system.form
    for knee in range(2):
        if system.knee[knee] == STOPPING:
            shank, thigh = form.shanks[knee], form.thighs[knee]
            add_hinge_gradients(torque_now(system.stop, form, shank, thigh, y), shank, thigh, by_angle, by_rate)
    if form.driven_hip:
        swing, stance = swing_and_stance(system)
        add_hinge_gradients(torque_now(hip_law(form), form, swing, stance, y), swing, stance, by_angle, by_rate)


@inlined
def knee_energy(system: OnGround, y: Any) -> float:
    """Elastic energy (J) in the stops."""
    form, total = system.form, 0.0
    for knee in range(2):
        if system.knee[knee] == STOPPING:
            total += hinge_energy(system.stop, ahead(form, form.shanks[knee], form.thighs[knee], y, 0))
    return total


@inlined
def knee_power(system: OnGround, y: Any) -> float:
    """Power (W) that the stops dissipate."""
    form, total = system.form, 0.0
    for knee in range(2):
        if system.knee[knee] == STOPPING:
            now = torque_now(system.stop, form, form.shanks[knee], form.thighs[knee], y)
            total += (now.torque - now.elastic) * extension_rate(form, knee, y)
    return total


@inlined
def hip_energy(system: OnGround, y: Any) -> float:
    """Elastic energy (J) of what acts between the legs."""
    swing, stance = swing_and_stance(system)
    law = hip_law(system.form)
    return hinge_energy(law, ahead(system.form, swing, stance, y, 0)) if system.form.driven_hip else 0.0


@inlined
def hip_power(system: OnGround, y: Any) -> float:
    """Power (W) that it gives and does not store."""
    form = system.form
    if not form.driven_hip:
        return 0.0
    swing, stance = swing_and_stance(system)
    now = torque_now(hip_law(form), form, swing, stance, y)
    return (now.elastic - now.torque) * ahead(form, swing, stance, y, half_size(form))


@legs_apart.case(OnGround)
def legs_apart_on_ground(system: OnGround, y: Any) -> tuple[float, float]:
    """The uppermost bodies of both legs."""
    form = system.form
    swing, stance = swing_and_stance(system)
    return ahead(form, swing, stance, y, 0), ahead(form, swing, stance, y, half_size(form))
