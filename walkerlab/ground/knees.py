"""Knees on compliant ground: what each is doing, the stop that it meets, and what its lock does to the motion.

With absolute angles a shank below a locked knee has the angular velocity of its thigh, omega = Z z with constant Z, and
a lock is a plastic impact: Z'MZ z = Z'M omega.
"""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.ground.normal_force import NormalLaw, elastic_energy, impact_normal_force
from walkerlab.ground.walker import Form, half_size
from walkerlab.kernels import inlined
from walkerlab.mechanics.hinges import HingeTorque, hinge_energy, hinge_torque
from walkerlab.solvers.system import Floats

FLEXED = 0.01  # rad of flexion from which on a knee that straightens is caught


class IdealLock(NamedTuple):
    """The knee is straight and locks at once: a plastic impact."""


@inlined
def extension(form: Form, knee: int, y: Any) -> float:
    """How far a knee is beyond straight (rad): negative while it is bent, zero where there is none."""
    return y[form.places + form.shanks[knee]] - y[form.places + form.thighs[knee]]


@inlined
def extension_rate(form: Form, knee: int, y: Any) -> float:
    """How fast a knee straightens (rad/s)."""
    rates = half_size(form) + form.places
    return y[rates + form.shanks[knee]] - y[rates + form.thighs[knee]]


@hinge_torque.case(NormalLaw)
def stop_torque(law: NormalLaw, angle: float, rate: float) -> HingeTorque:
    """A stop by the IMPACT law, in N m and rad, that acts beyond straight."""
    if angle <= 0.0:
        return HingeTorque(0.0, 0.0, 0.0, 0.0)
    torque = impact_normal_force(angle, rate, law)
    return HingeTorque(torque.force, torque.spring, torque.by_penetration, torque.by_rate)


@hinge_energy.case(NormalLaw)
def stop_energy(law: NormalLaw, angle: float) -> float:
    """Elastic energy (J) of a stop."""
    return elastic_energy(angle, law)


class Lock(NamedTuple):
    """What a lock does to the state of all bodies about its root, whether that is hinged or not."""

    state: Floats  # after it
    lost: float  # J
    derivative: Floats  # of the state after by the state before


def lock(whole: Form, form: Form, x: Any) -> Lock:
    """Project the angular velocities in the metric of M on what a form allows: E'ME z = E'M omega; the root rests.

    whole  the form of all bodies, about the root
    form   as whose bodies they move from then on
    x      state of all bodies
    """
    x = np.array(x, float)
    n, p, rates = int(whole.bodies), int(whole.places), x.size - int(whole.bodies)
    free = [k for k in range(form.bodies) if form.E[0, k, k] != 0.0]
    Z = form.E[0, form.onto[:n]][:, free]
    angles, omega = x[p : p + n] + whole.slope, x[rates:]
    delta = angles[None, :] - angles[:, None]
    A, B = whole.A[:n, :n], whole.B[:n, :n]
    M = A * np.cos(delta) + B * np.sin(delta)
    spread = Z @ np.linalg.inv(Z.T @ M @ Z) @ Z.T
    new = x.copy()
    new[rates:] = spread @ (M @ omega)
    change = omega - new[rates:]
    # dM (omega- - omega+) = (dM/d delta * (d theta_l - d theta_k)) change
    turned = (B * np.cos(delta) - A * np.sin(delta)) * change
    by_state = np.eye(x.size)
    by_state[rates:, rates:] = spread @ M
    by_state[rates:, p : p + n] = spread @ (turned - np.diag(turned.sum(axis=1)))
    return Lock(new, float(0.5 * (M @ omega) @ change), by_state)
