"""Knees on compliant ground: their extension, stop and lock."""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.ground.normal_force import Impact, elastic_energy, normal_force
from walkerlab.physics.ground.walker import FIRST_KNEE, GroundModel, half_size
from walkerlab.physics.kernels import kernel_part
from walkerlab.physics.mechanics.hinges import HingeTorque, hinge_energy, hinge_torque
from walkerlab.physics.mechanics.impact import RootedTree, lock
from walkerlab.physics.solvers.system import Floats

# rad, flexion that a released knee must exceed before it can lock again. Without it, the knee would lock at once,
# because it is straight up to rounding when it is released.
MIN_FLEXION = 0.01


class IdealLock(NamedTuple):
    """Lock that stops a knee by a plastic impact as soon as it is straight."""


@kernel_part
def angle_between(form: GroundModel, row: int, y: Any, first: int) -> float:
    """Return the angle (rad) of a hinge's first body relative to its second, or its rate (rad/s).

    first  index in y of the first angle, or of the first rate
    """
    return y[first + form.hinges[row, 0]] - y[first + form.hinges[row, 1]]


@kernel_part
def extension(form: GroundModel, knee: int, y: Any) -> float:
    """Return the angle (rad) of a knee beyond straight: negative while it is bent, zero for a leg without a knee."""
    return angle_between(form, FIRST_KNEE + knee, y, form.places)


@kernel_part
def extension_rate(form: GroundModel, knee: int, y: Any) -> float:
    return angle_between(form, FIRST_KNEE + knee, y, half_size(form) + form.places)


@hinge_torque.case(Impact)
def stop_torque(law: Impact, angle: float, rate: float) -> HingeTorque:
    """Compute the torque of a compliant stop, which pushes a knee back when it extends beyond straight."""
    # The law of a stop is in rad and N m instead of m and N.
    if angle <= 0.0:
        return HingeTorque(0.0, 0.0, 0.0, 0.0)
    torque = normal_force(law, angle, rate)
    return HingeTorque(torque.force, torque.spring, torque.by_penetration, torque.by_rate)


@hinge_energy.case(Impact)
def stop_energy(law: Impact, angle: float) -> float:
    return elastic_energy(law, angle)


class Locked(NamedTuple):
    """Result of locking a knee: state of all bodies, and energy lost."""

    state: Floats  # (size,)
    lost: float  # J, kinetic energy lost
    columns: Floats  # (size, columns) variational columns just after the lock


def lock_knee(whole: GroundModel, form: GroundModel, x: Any, columns: Floats | None = None) -> Locked:
    """Project the angular velocities onto those that `form` allows. The root's motion does not change.

    The state x (size,) and the variational columns (size, columns) are those of `whole`, the form with all bodies.
    """
    x = np.array(x, float)
    n = int(whole.bodies)
    p = int(whole.places)
    # The bodies' rates are the last n entries, whether or not the state has root coordinates.
    rates = x.size - n
    after = np.zeros((x.size, 0)) if columns is None else columns.copy()
    E, m = np.zeros((n, n)), int(form.bodies)
    # Bodies of a group have the same row, and the column of a group is that of its first body.
    E[:, form.first[:m]] = form.E[0, form.onto[:n], :m]
    A, B, arm_x, arm_y = whole.A[:n, :n], whole.B[:n, :n], whole.arm_x[:n], whole.arm_y[:n]
    # The impulse in the knee moves neither the centre of mass nor a pinned foot, so the root counts as fixed: radius 0.
    tree = RootedTree(A, B, arm_x, arm_y, whole.mass, 0.0, whole.slope)
    x[rates:], lost, after[rates:] = lock(tree, E, x[p : p + n], x[rates:], after[p : p + n], after[rates:])
    return Locked(x, lost, after)
