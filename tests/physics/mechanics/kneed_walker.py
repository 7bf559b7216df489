"""A walker with a torso and a knee, described by its parts and by the positions of its masses."""

import sympy as sp

from walkerlab.physics.mechanics.parts import Anchor, Assembly, BallFoot, Body, Particle, Revolute

RADIUS = 0.02
# The stance leg extends upwards from its foot point, the torso upwards from the hip, the thigh down from the hip, and
# the shank down from the knee. Every centre of mass is off the axis of its body.
BODIES = (
    Body("stance", 4.0, (0.03, 0.55), 0.20),
    Body("torso", 12.0, (0.05, 0.35), 0.60),
    Body("thigh", 2.5, (-0.02, -0.21), 0.04),
    Body("shank", 1.5, (0.015, -0.19), 0.02),
)
KNEED = Assembly(
    bodies=BODIES,
    # Hinges are not in the order of the chain, and parents are on either side.
    joints=(
        Revolute("knee", "shank", (0.0, 0.0), "thigh", (0.0, -0.45)),
        Revolute("hip of the swing leg", "stance", (0.0, 0.98), "thigh", (0.0, 0.0)),
        Revolute("hip of the torso", "torso", (0.0, 0.0), "stance", (0.0, 0.98)),
    ),
    particles=(Particle("head", 3.0, "torso", (0.1, 0.7)),),
    feet=(
        BallFoot("swing foot", "shank", (0.0, -0.48), RADIUS),
        BallFoot("stance foot", "stance", (0.0, 0.02), RADIUS),
    ),
)
STANCE_POINT = Anchor("stance", (0.0, 0.0))

g = sp.Symbol("g", positive=True)
theta = sp.symbols("theta_1:5")
omega = sp.symbols("omega_1:5")
x, y, dx, dy = sp.symbols("x y dx dy")
q = sp.Matrix([*theta, x, y])
dq = sp.Matrix([*omega, dx, dy])


def turned(angle, across, up):
    return sp.Matrix([across * sp.cos(angle) - up * sp.sin(angle), across * sp.sin(angle) + up * sp.cos(angle)])


def mass_points():
    """Return (mass, position) of all masses, beginning at the point (x, y) of the stance foot."""
    stance, torso, thigh, shank = theta
    foot = sp.Matrix([x, y])
    hip = foot + turned(stance, 0, 0.98)
    knee = hip + turned(thigh, 0, -0.45)
    return (
        (4.0, foot + turned(stance, 0.03, 0.55)),
        (12.0, hip + turned(torso, 0.05, 0.35)),
        (2.5, hip + turned(thigh, -0.02, -0.21)),
        (1.5, knee + turned(shank, 0.015, -0.19)),
        (3.0, hip + turned(torso, 0.1, 0.7)),
    )


def energies():
    """Return kinetic and potential energy."""
    inertias = (0.20, 0.60, 0.04, 0.02)
    kinetic = sum((J * w**2 for J, w in zip(inertias, omega, strict=True)), sp.Integer(0)) / 2
    potential = sp.Integer(0)
    for mass, place in mass_points():
        velocity = place.jacobian(q) * dq
        kinetic += mass * velocity.dot(velocity) / 2
        potential += mass * g * place[1]
    return kinetic, potential


def lagrange_equations():
    """Return (M, bias, weight) of Lagrange's equations as compiled functions."""
    kinetic, potential = energies()
    momentum = sp.Matrix([kinetic.diff(rate) for rate in dq])
    M = momentum.jacobian(dq)
    bias = momentum.jacobian(q) * dq - sp.Matrix([kinetic.diff(coordinate) for coordinate in q])
    weight = sp.Matrix([potential.diff(coordinate) for coordinate in q])
    return sp.lambdify((theta, omega, (dx, dy), g), (M, bias, weight), cse=True)
