"""Torques between the legs on compliant ground: a spring, a damper, and a torque that swings the free leg forward."""

from typing import Any

from walkerlab.ground.walker import OnGround, half_size
from walkerlab.kernels import inlined
from walkerlab.mechanics.hinges import (
    HingeTorque,
    add_hinge_gradients,
    add_hinge_torque,
    hinge_energy,
    hinge_torque,
    hip_law,
)


@inlined
def swing_and_stance(system: OnGround) -> tuple[int, int]:
    """The uppermost bodies of the leg that swings and of that which stands: at a touch they change places."""
    stance = system.feet[0]
    return system.form.uppers[1 - stance], system.form.uppers[stance]


@inlined
def legs_apart(system: OnGround, y: Any, first: int) -> float:
    """How far the swing leg is ahead (rad), of the coordinates that begin at y[first]; or how fast."""
    swing, stance = swing_and_stance(system)
    return y[first + system.form.places + swing] - y[first + system.form.places + stance]


@inlined
def torque_now(system: OnGround, y: Any) -> HingeTorque:
    """The torque between the legs in a state."""
    return hinge_torque(hip_law(system.form), legs_apart(system, y, 0), legs_apart(system, y, half_size(system.form)))


@inlined
def add_hip_torque(system: OnGround, y: Any, r: Any) -> None:
    """Add the torques (N m) on both legs to r (n,)."""
    if system.form.driven_hip:
        swing, stance = swing_and_stance(system)
        add_hinge_torque(torque_now(system, y), swing, stance, r)


@inlined
def add_hip_gradients(system: OnGround, y: Any, by_angle: Any, by_rate: Any) -> None:
    """Add the derivatives of those torques by the angles and their velocities to by_angle and by_rate (n, n)."""
    if system.form.driven_hip:
        swing, stance = swing_and_stance(system)
        add_hinge_gradients(torque_now(system, y), swing, stance, by_angle, by_rate)


@inlined
def hip_energy(system: OnGround, y: Any) -> float:
    """Elastic energy (J) of the spring."""
    return hinge_energy(hip_law(system.form), legs_apart(system, y, 0)) if system.form.driven_hip else 0.0


@inlined
def hip_power(system: OnGround, y: Any) -> tuple[float, float]:
    """Power (W) that torque and damper give, and what of the torque's is positive."""
    if not system.form.driven_hip:
        return 0.0, 0.0
    now, rate = torque_now(system, y), legs_apart(system, y, half_size(system.form))
    return (now.elastic - now.torque) * rate, max(0.0, hip_law(system.form).torque * rate)
