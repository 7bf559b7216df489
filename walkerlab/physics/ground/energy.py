"""Energies of the walker on compliant ground, and the powers dissipated at its contacts."""

from typing import Any

from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.hinges import hinge_energies
from walkerlab.physics.ground.normal_force import elastic_energy
from walkerlab.physics.ground.pulse import push_on
from walkerlab.physics.ground.walker import BODY_VECTOR, GroundModel, OnGround
from walkerlab.physics.kernels import kernel_part, matrix, vector
from walkerlab.physics.mechanics import tree


@kernel_part
def kinetic_energy(form: GroundModel, y: Any) -> float:
    # `add_inertia` also writes to r, which is not used.
    s, c, r, M = vector(BODY_VECTOR), vector(BODY_VECTOR), vector(BODY_VECTOR), matrix(BODY_VECTOR)
    half = forms.half_size(form)
    total = 0.0
    omega = y[half + form.places : 2 * half]
    forms.sines_cosines(form, y, s, c)
    tree.add_inertia(form, form.bodies, s, c, omega, M, r)
    # About the centre of mass, the energies of translation and rotation add without a coupling term. A pinned form has
    # no translation.
    for i in range(form.places):
        total += form.mass * (y[half + i] * y[half + i])
    return 0.5 * total + tree.kinetic_energy(form.bodies, M, omega)


@kernel_part
def potential_energy(form: GroundModel, y: Any) -> float:
    """Compute the potential energy of gravity (J), which is zero at the origin of the slope's frame."""
    s, c, F, U = vector(BODY_VECTOR), vector(BODY_VECTOR), vector(BODY_VECTOR), vector(BODY_VECTOR)
    forms.sines_cosines(form, y, s, c)
    tree.projections(form.arm_x, form.arm_y, form.bodies, s, c, F, U)
    along, height = forms.root_position(form, y)
    return tree.potential_energy(form, form.bodies, along, height, F, U)


@kernel_part
def foot_elastic_energy(system: OnGround, foot: int, y: Any) -> float:
    motion = forms.relative_to_ground(system, foot, forms.one_foot_motion(system.form, foot, y))
    return elastic_energy(system.normal, -motion.height)


@kernel_part
def total_energy(system: OnGround, y: Any) -> float:
    """Compute the mechanical energy (J): kinetic, elastic, and potential relative to a fixed origin."""
    total = kinetic_energy(system.form, y) + potential_energy(system.form, y)
    for foot in range(2):
        # A foot without ground stores no energy, even below the surface, for example when it scuffs.
        if system.has_ground[foot] != 0:
            total += foot_elastic_energy(system, foot, y)
    springs, stops = hinge_energies(system, y)
    return total + stops + springs


@kernel_part
def push_power(system: OnGround, t: float, y: Any) -> float:
    if system.form.push_off == 0.0:
        return 0.0
    s, c = vector(BODY_VECTOR), vector(BODY_VECTOR)
    foot = 1 - system.progress.stance
    forms.sines_cosines(system.form, y, s, c)
    push = push_on(system, t, foot, s, c)
    motion = forms.foot_motion(system.form, foot, s, c, y)
    # The push acts on the foot's material, so its power is computed with the slip velocity, not with the speed of
    # the rolling contact point.
    return push.along * motion.slip + push.upward * motion.vertical_velocity


@kernel_part
def dissipated_power(system: OnGround, foot: int, y: Any) -> tuple[float, float, float]:
    """Compute the powers (W) that a foot loses to damping and to friction, and the normal force (N) on it."""
    motion = forms.relative_to_ground(system, foot, forms.one_foot_motion(system.form, foot, y))
    if motion.height >= 0.0:
        return 0.0, 0.0, 0.0
    force = forms.foot_force(system, motion)
    # Damping takes (F_n - k d^e) d', where d' is the rate of the penetration d.
    damping = -(force.normal.force - force.normal.spring) * motion.vertical_velocity
    return damping, -force.along * motion.slip, force.normal.force
