"""Knees on compliant ground: how far each is bent, the stop that it meets, and its lock."""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.ground.normal_force import NormalLaw, elastic_energy, impact_normal_force
from walkerlab.physics.ground.walker import FIRST_KNEE, GroundModel, half_size
from walkerlab.physics.kernels import kernel_part
from walkerlab.physics.mechanics.hinges import HingeTorque, hinge_energy, hinge_torque
from walkerlab.physics.mechanics.impact import RootedTree, lock
from walkerlab.physics.solvers.system import Floats

FLEXED = 0.01  # rad of flexion from which on a knee that straightens is caught


class IdealLock(NamedTuple):
    """The knee is straight and locks at once: a plastic impact."""


class KneeStop(NamedTuple):
    """A stop by the IMPACT law that turns a knee back beyond straight."""

    stiffness: float  # [k] N m/rad^e
    exponent: float  # [e]
    damping: float  # [c_max] N m s/rad
    full_damping_angle: float  # [d_max] rad


@kernel_part
def impact_law(stop: KneeStop) -> NormalLaw:
    """The IMPACT law with a stop's numbers: of rad and N m in place of m and N."""
    return NormalLaw(stop.stiffness, stop.exponent, stop.damping, stop.full_damping_angle)


@kernel_part
def ahead(form: GroundModel, row: int, y: Any, first: int) -> float:
    """How far a hinge's body is ahead of the other (rad), by the angles that begin at y[first]; or how fast."""
    return y[first + form.hinges[row, 0]] - y[first + form.hinges[row, 1]]


@kernel_part
def extension(form: GroundModel, knee: int, y: Any) -> float:
    """How far a knee is beyond straight (rad): negative while it is bent, zero where there is none."""
    return ahead(form, FIRST_KNEE + knee, y, form.places)


@kernel_part
def extension_rate(form: GroundModel, knee: int, y: Any) -> float:
    """How fast a knee straightens (rad/s)."""
    return ahead(form, FIRST_KNEE + knee, y, half_size(form) + form.places)


@hinge_torque.case(KneeStop)
def stop_torque(law: KneeStop, angle: float, rate: float) -> HingeTorque:
    """The IMPACT law beyond straight."""
    if angle <= 0.0:
        return HingeTorque(0.0, 0.0, 0.0, 0.0)
    torque = impact_normal_force(angle, rate, impact_law(law))
    return HingeTorque(torque.force, torque.spring, torque.by_penetration, torque.by_rate)


@hinge_energy.case(KneeStop)
def stop_energy(law: KneeStop, angle: float) -> float:
    """Elastic energy (J) of a stop."""
    return elastic_energy(angle, impact_law(law))


class Locked(NamedTuple):
    """The state of all bodies about their root after a knee has locked."""

    state: Floats
    lost: float  # J
    columns: Floats  # (size, columns) images of directions of the state before


def lock_knee(whole: GroundModel, form: GroundModel, x: Any, columns: Floats | None = None) -> Locked:
    """Bring the angular velocities to those that a form allows, by a plastic impact that leaves the root as it moves.

    whole    the form of all bodies, about the root
    form     as whose bodies they move from then on
    x        (size,) state of all bodies
    columns  (size, columns) directions of that state; None for none
    """
    x = np.array(x, float)
    n, p, rates = int(whole.bodies), int(whole.places), x.size - int(whole.bodies)
    after = np.zeros((x.size, 0)) if columns is None else columns.copy()
    E, m = np.zeros((1, n, n)), int(form.bodies)
    E[0][:, form.first[:m]] = form.E[0, form.onto[:n], :m]
    pairs, arms = (whole.A[:n, :n], whole.B[:n, :n]), (whole.arm_x[:n], whole.arm_y[:n])
    tree = RootedTree(E, *pairs, *arms, whole.mass, 0.0, whole.slope)
    x[rates:], lost, after[rates:] = lock(tree, x[p : p + n], x[rates:], after[p : p + n], after[rates:])
    return Locked(x, lost, after)
