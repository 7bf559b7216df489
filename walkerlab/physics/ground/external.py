"""Forces of ground and drives for another program that integrates the walker in its own coordinates.

Coordinates: position of a point of the base body along the slope and over it (m), then one angle per link, measured
from the link that it is hinged to (rad), the base's from the slope's normal. Forces are generalised in the same order.
"""

from typing import Any

from walkerlab.physics.ground.hinges import add_torques
from walkerlab.physics.ground.motion import foot_wrench
from walkerlab.physics.ground.walker import OF_BODIES, OF_STATES, OnGround, foot_motion, sines_cosines
from walkerlab.physics.kernels import kernel, kernel_part, vector


@kernel_part
def absolute_state(slope: float, chain: Any, q: Any, v: Any, y: Any) -> None:
    """Write the state in absolute angles into y; `chain` (n, links) is one where an angle is a sum over a joint."""
    n = chain.shape[0]
    for i in range(2):
        y[i], y[2 + n + i] = q[i], v[i]
    for k in range(n):
        y[2 + k], y[4 + n + k] = -slope, 0.0
        for j in range(chain.shape[1]):
            y[2 + k] += chain[k, j] * q[2 + j]
            y[4 + n + k] += chain[k, j] * v[2 + j]


@kernel
def feet_and_forces(system: OnGround, chain: Any, t: float, q: Any, v: Any, feet: Any, forces: Any) -> None:
    """Write the motion of both feet into feet (2, 4), forces of ground, hinges and push-off into forces (2 + links).

    system  with all bodies, its levers of feet and hip from the base's point
    chain   (n, links) whether a joint lies between the base and a body; bodies that move as one share a row
    q, v    (2 + links) coordinates and velocities of the other program
    feet    along (m), height (m), slip (m/s), velocity of the height (m/s)
    """
    # Empty forces are not computed.
    form = system.form
    y, s, c, torques = vector(OF_STATES), vector(OF_BODIES), vector(OF_BODIES), vector(OF_BODIES)
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
    for j in range(chain.shape[1]):
        total = 0.0
        for k in range(chain.shape[0]):
            total += chain[k, j] * torques[k]
        forces[2 + j] = total
