"""Energies of the walker on compliant ground, and the power that its contacts turn into heat."""

from walkerlab.ground.normal_force import elastic_energy
from walkerlab.ground.walker import ContactWalker, foot_force, foot_motion
from walkerlab.kernels import inlined
from walkerlab.mechanics.tree import mass_matrix, sines_cosines
from walkerlab.solvers.system import State


@inlined
def kinetic_energy(walker: ContactWalker, y: State) -> float:
    """Kinetic energy (J)."""
    tree = walker.tree
    n = len(tree.arm_x)
    s, c = sines_cosines(tree, y, 2, walker.slope)
    M = mass_matrix(tree, s, c)
    total = tree.mass * (y[2 + n] * y[2 + n] + y[3 + n] * y[3 + n])
    for k in range(n):
        for l in range(n):
            total += M[k * n + l] * y[4 + n + k] * y[4 + n + l]
    return 0.5 * total


@inlined
def potential_energy(walker: ContactWalker, y: State) -> float:
    """Potential energy of gravity (J) from the slope frame's origin."""
    return walker.tree.mass * (walker.gravity_down * y[1] - walker.gravity_along * y[0])


@inlined
def foot_elastic_energy(walker: ContactWalker, foot: int, y: State) -> float:
    """Elastic energy (J) in the ground under a foot that it carries."""
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    return elastic_energy(-foot_motion(walker, walker.feet[foot], s, c, y).height, walker.normal)


@inlined
def total_energy(walker: ContactWalker, has_ground: tuple[bool, bool], y: State) -> float:
    """Mechanical energy (J) of the energy balance: kinetic, potential from a fixed origin, elastic."""
    total = kinetic_energy(walker, y) + potential_energy(walker, y)
    if has_ground[0]:
        total += foot_elastic_energy(walker, 0, y)
    if has_ground[1]:
        total += foot_elastic_energy(walker, 1, y)
    return total


@inlined
def dissipated_power(walker: ContactWalker, foot: int, y: State) -> tuple[float, float, float]:
    """Power (W) lost under a foot in the normal direction, (F_n - k d^e) d', and to friction; the normal force (N)."""
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    motion = foot_motion(walker, walker.feet[foot], s, c, y)
    if motion.height >= 0.0:
        return 0.0, 0.0, 0.0
    force = foot_force(walker, motion)
    damping = -(force.normal.force - force.normal.spring) * motion.vertical_velocity
    return damping, -force.along * motion.slip, force.normal.force
