"""Walkers on compliant ground and states built by hand, for tests of the physics."""

import math

import numpy as np
from compass_parts import CompassParts, compass_assembly

import walkerlab.physics.ground.motion  # noqa: F401, the equations, which are found by the system's type
from walkerlab.physics.ground.compliant import contact_walker
from walkerlab.physics.ground.friction import Coulomb, Frictionless
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.mechanics.parts import Assembly, BallFoot, Body

ADAMS = Impact(1e5 * 1000.0**2.2, 2.2, 9e4, 1e-4)
COULOMB = Coulomb(0.9, 0.7, 0.1, 1.0)
SMOOTH = Frictionless()
SLOPE, GRAVITY = 0.0174, 9.81


def parts(radius=0.001, inertia=0.0):
    return CompassParts(1.0, 0.5, 5.0, 10.0, inertia, radius)


def compass(friction=COULOMB, normal=ADAMS, radius=0.001, inertia=0.0, slope=SLOPE, pinned_foot=1):
    assembly = compass_assembly(parts(radius, inertia))
    return contact_walker(assembly, normal, friction, GRAVITY, slope, pinned_foot=pinned_foot)


def sledge(friction=COULOMB, normal=ADAMS, slope=SLOPE, radius=0.01):
    """Return one body on two runners, which acts like a loaded block."""
    body = Body("sledge", 20.0, (0.0, 0.1), 2.0)
    feet = tuple(BallFoot(name, "sledge", (x, radius), radius) for name, x in (("rear", -0.4), ("front", 0.4)))
    return contact_walker(Assembly((body,), (), feet=feet), normal, friction, GRAVITY, slope)


def placed(walker, foot, depth, theta, omega, slip, vertical_velocity, along=0.0):
    """Return the state in which a foot's lowest point is `depth` inside the ground and moves with (slip, climb)."""
    whole, n = walker.whole, len(theta)
    x, y, rolling = (lever[foot, :n] for lever in (whole.foot_x, whole.foot_y, whole.rolling))
    tilted, omega = np.array(theta) + walker.slope, np.array(omega)
    s, c = np.sin(tilted), np.cos(tilted)
    forward, upward = c * x - s * y, s * x + c * y
    position = along - forward.sum(), whole.radius[foot] - depth - upward.sum()
    velocity = slip - omega @ (rolling - upward), vertical_velocity - omega @ forward
    return tuple(map(float, (*position, *theta, *velocity, *omega)))


def masses_of_the_compass(state, slope=SLOPE):
    """Return (mass, position, velocity) of legs and hip in the slope's frame, computed from the centre of mass and the
    two angles.
    """
    x, y, theta_1, theta_2, v_x, v_y, w_1, w_2 = state
    up = [np.array([-math.sin(t + slope), math.cos(t + slope)]) for t in (theta_1, theta_2)]
    turn = [w * np.array([-math.cos(t + slope), -math.sin(t + slope)]) for t, w in ((theta_1, w_1), (theta_2, w_2))]
    # With legs of 5 kg half a metre below a hip of 10 kg, the centre of mass is 1/8 m along each leg from the hip.
    hip = np.array([x, y]) + 0.125 * (up[0] + up[1])
    v_hip = np.array([v_x, v_y]) + 0.125 * (turn[0] + turn[1])
    legs = [(5.0, hip - 0.5 * u, v_hip - 0.5 * t) for u, t in zip(up, turn, strict=True)]
    return [*legs, (10.0, hip, v_hip)]
