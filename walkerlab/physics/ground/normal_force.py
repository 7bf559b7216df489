"""Normal force of the ground: the IMPACT law of ADAMS."""

from typing import NamedTuple

from walkerlab.physics.ground.smooth_step import smooth_step
from walkerlab.physics.kernels import kernel_part


class NormalLaw(NamedTuple):
    """Parameters of the IMPACT law, SI (see `config.contact` for ADAMS units)."""

    stiffness: float  # [k] N/m^e
    exponent: float  # [e]
    damping: float  # [c_max] N s/m
    full_damping_penetration: float  # [d_max] m


class NormalForce(NamedTuple):
    """Normal force and its derivatives."""

    force: float  # N
    spring: float  # N, the elastic part k d^e
    by_penetration: float  # N/m
    by_rate: float  # N s/m


@kernel_part
def impact_normal_force(penetration: float, penetration_rate: float, law: NormalLaw) -> NormalForce:
    """Compute the normal force of ADAMS's IMPACT law, F = max(0, k d^e + c(d) d'), never adhesive.

    The damping c rises from 0 at first touch to `law.damping` at `full_damping_penetration`. Penetration d (m) and its
    rate d' (m/s) are positive into the ground; the caller skips feet with d <= 0.

    Source: Adams function reference, IMPACT.
    """
    spring = law.stiffness * penetration**law.exponent
    c, c_slope = smooth_step(penetration, 0.0, 0.0, law.full_damping_penetration, law.damping)
    force = spring + c * penetration_rate
    if force <= 0.0:
        return NormalForce(0.0, spring, 0.0, 0.0)
    return NormalForce(force, spring, law.exponent * spring / penetration + c_slope * penetration_rate, c)


@kernel_part
def grip(penetration: float, penetration_rate: float, law: NormalLaw) -> float:
    """Return the normal force before clamping, divided by a power of the penetration. It falls to zero at release."""
    # The divisor is min(d, d_max)^min(e, 2): the result has a finite slope at the surface and is nowhere steeper than
    # the force.
    full = law.full_damping_penetration
    power = min(law.exponent, 2.0)
    d = max(penetration, 0.0)
    if d >= full:
        return (law.stiffness * d**law.exponent + law.damping * penetration_rate) / full**power
    spring = law.stiffness * (d ** (law.exponent - power) if law.exponent > power else 1.0)
    damping = law.damping * (3.0 - 2.0 * d / full) / full**2
    return spring + damping * penetration_rate * (d ** (2.0 - power) if power < 2.0 else 1.0)


@kernel_part
def elastic_energy(penetration: float, law: NormalLaw) -> float:
    """Compute the energy (J) stored in the contact's spring, k d^(e+1) / (e+1)."""
    if penetration <= 0.0:
        return 0.0
    return law.stiffness * penetration ** (law.exponent + 1.0) / (law.exponent + 1.0)
