"""Simulate a step of a kneed walker whose torso bisects the legs, with nothing but Lagrange's equations and SciPy.

The position of a mass, measured from the stance foot, is a sum of arms times exp(i theta) in the complex plane. Feet
are points, which may lie ahead of the line of the shank. Bodies: swing
thigh, stance leg, swing shank and torso. Section: stance angle, rates of swing and stance leg just after heel strike.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

# maps the free rates to the rates of the bodies
BENT = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0]])
STRAIGHT = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.5, 0.5]])
ARMED_S = 0.01  # s; a knee cannot strike within this time after its release
FIRST_STEP_S = 1e-3


class Walker(NamedTuple):
    """Masses, arms (masses, bodies) from the stance foot, inertias of the bodies, leg length and lean of the feet, in
    SI units.
    """

    masses: np.ndarray
    arms: np.ndarray
    inertias: np.ndarray
    leg: float
    gravity: float
    slope: float
    lean: float


def walker_of(thigh, shank, hip_mass, torso, gravity, slope, foot_ahead=0.0):
    """Build a walker from (length, mass, below, ahead, inertia) of thigh and shank and (mass, above, inertia) of the
    torso.
    """
    upper, _, below_hip, thigh_ahead, _ = thigh
    lower, _, below_knee, shank_ahead, _ = shank
    leg = upper + lower
    arms = np.zeros((6, 4), complex)
    arms[0:2, 1] = -foot_ahead
    arms[0:2, 1] += [1j * (leg - below_hip) + thigh_ahead, 1j * (lower - below_knee) + shank_ahead]
    arms[2:, 1] = 1j * leg - foot_ahead  # the hip and all bodies attached to it
    arms[3, 3] = 1j * torso[1]
    arms[4, 0], arms[5, 0] = -1j * below_hip + thigh_ahead, -1j * upper
    arms[5, 2] = -1j * below_knee + shank_ahead
    masses = np.array([thigh[1], shank[1], hip_mass, torso[0], thigh[1], shank[1]])
    inertias = np.array([thigh[4], thigh[4] + shank[4], shank[4], torso[2]])
    return Walker(masses, arms, inertias, leg, gravity, slope, np.arctan2(foot_ahead, leg))


def mass_matrix(walker, theta):
    """Return the mass matrix for the angles (4,) of the bodies, and the velocities of the masses per unit rate."""
    J = 1j * walker.arms * np.exp(1j * theta)
    return (J.conj().T * walker.masses @ J).real + np.diag(walker.inertias), J


def accelerations(walker, free, theta, omega):
    """Return the accelerations of the bodies, whose rates are `free` times the rates of the free ones."""
    M, J = mass_matrix(walker, theta)
    turning = 1j * J @ omega**2
    forces = (J.conj().T @ (walker.masses * (-1j * walker.gravity - turning))).real
    return free @ np.linalg.solve(free.T @ M @ free, free.T @ forces)


def swung(walker, free, y, t, event, longest=10.0):
    """Return time and state at an event, integrating y (8,) from t."""

    def rates(_t, y):
        return np.concatenate((y[4:], accelerations(walker, free, y[:4], y[4:])))

    walk = solve_ivp(
        rates, (t, t + longest), y, method="DOP853", rtol=1e-11, atol=1e-13, events=event, max_step=0.05,
        first_step=FIRST_STEP_S,
    )  # fmt: skip
    return walk.t[-1], walk.y[:, -1]


def step(walker, z):
    """Return the end of the step from z (3,), its duration, and the time of the knee strike (s)."""
    tilt = 2.0 * (walker.slope + walker.lean)
    swing, stance = -tilt - z[0], z[0]
    y = np.array([swing, stance, swing, -0.5 * tilt, z[1], z[2], z[1], 0.5 * (z[1] + z[2])])

    def knee(_t, y):
        return y[2] - y[0]

    def heel(_t, y):
        return y[0] + y[1] + tilt if y[0] > y[1] else 1.0

    knee.terminal = heel.terminal = True
    knee.direction, heel.direction = 1.0, -1.0
    t, y = swung(walker, BENT, y, 0.0, None, ARMED_S)
    struck, y = swung(walker, BENT, y, t, knee)
    M, _ = mass_matrix(walker, y[:4])
    y[4:] = STRAIGHT @ np.linalg.solve(STRAIGHT.T @ M @ STRAIGHT, STRAIGHT.T @ M @ y[4:])
    t, y = swung(walker, STRAIGHT, y, struck, heel)
    return strike(walker, y), t, struck


def strike(walker, y):
    """Return the section coordinates after a heel strike from y (8,). The legs change roles, and momenta are
    projected.
    """
    _, J = mass_matrix(walker, y[:4])
    velocity, spin = J @ y[4:], y[4:]
    # the same masses and bodies, measured from the other foot
    masses, bodies = [4, 5, 2, 3, 0, 1], [1, 0, 1, 3]
    theta = y[:4][bodies]
    M, J = mass_matrix(walker, theta)
    momentum = (J.conj().T @ (walker.masses * velocity[masses])).real + walker.inertias * spin[bodies]
    omega = np.linalg.solve(STRAIGHT.T @ M @ STRAIGHT, STRAIGHT.T @ momentum)
    return np.array([theta[1], omega[0], omega[1]])
