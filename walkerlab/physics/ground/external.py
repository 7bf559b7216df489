"""Forces of ground and drives for another program that integrates the walker in its own coordinates.

Coordinates: position (m) of a point of the base body along and normal to the slope, then one angle (rad) per link: the
base's from the slope's normal, any other from the link it is hinged to. Generalised forces have the same order.
"""

from typing import Any

from walkerlab.physics.ground.hinges import add_torques
from walkerlab.physics.ground.motion import foot_wrench
from walkerlab.physics.ground.walker import BODY_VECTOR, STATE_VECTOR, OnGround, foot_motion, sines_cosines
from walkerlab.physics.kernels import kernel, kernel_part, vector


@kernel_part
def absolute_state(slope: float, chain: Any, q: Any, v: Any, y: Any) -> None:
    """Write the state into y. `chain` (n, links) maps the relative angles of the links to the bodies' absolute ones."""
    n = chain.shape[0]
    for i in range(2):
        y[i], y[2 + n + i] = q[i], v[i]
    for k in range(n):
        # The other program measures angles from the slope's normal, but our state measures them from the vertical.
        y[2 + k], y[4 + n + k] = -slope, 0.0
        for j in range(chain.shape[1]):
            y[2 + k] += chain[k, j] * q[2 + j]
            y[4 + n + k] += chain[k, j] * v[2 + j]


@kernel
def feet_and_forces(system: OnGround, chain: Any, t: float, q: Any, v: Any, feet: Any, forces: Any) -> None:
    """Write the motion of both feet into `feet`, and the forces of ground, hinges and push-off into `forces`.

    system  walker in the form with all bodies; the base's point is the root from which levers run to feet and hip
    chain   (n, links) map from relative to absolute angles; bodies that move as one have equal rows
    q, v    (2 + links) coordinates and velocities of the other program
    feet    (2, 4) along (m), height (m), slip (m/s), rate of the height (m/s)
    forces  (2 + links) generalised forces, N and N m; not computed if the array is empty
    """
    form = system.form
    y = vector(STATE_VECTOR)
    s, c = vector(BODY_VECTOR), vector(BODY_VECTOR)
    torques = vector(BODY_VECTOR)
    absolute_state(form.slope, chain, q, v, y)
    sines_cosines(form, y, s, c)
    for foot in range(2):
        motion = foot_motion(form, foot, s, c, y)
        feet[foot, 0], feet[foot, 1] = motion.along, motion.height
        feet[foot, 2], feet[foot, 3] = motion.slip, motion.vertical_velocity
    if forces.size == 0:
        return
    for k in range(chain.shape[0]):
        torques[k] = 0.0
    forces[0], forces[1] = 0.0, 0.0
    for foot in range(2):
        force = foot_wrench(system, t, foot, s, c, y, torques)
        forces[0] += force[0]
        forces[1] += force[1]
    add_torques(system, y, torques)
    # By virtual work, torques on absolute angles act on the relative ones through the transpose of `chain`.
    for j in range(chain.shape[1]):
        total = 0.0
        for k in range(chain.shape[0]):
            total += chain[k, j] * torques[k]
        forces[2 + j] = total
