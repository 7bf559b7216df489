"""Appendix A in NumPy and SciPy, written independently of the package to check the errata."""

import numpy as np
from scipy.integrate import solve_ivp

L, A, B, LEG, HIP, G = 1.0, 0.5, 0.5, 5.0, 10.0, 9.81


def positions(q, foot=(0.0, 0.0)):
    """Return the positions of stance leg mass, hip, swing leg mass and swing foot, (A.1) to (A.3)."""
    theta_1, theta_2 = q
    up = np.array([-np.sin(theta_2), np.cos(theta_2)])
    down = np.array([np.sin(theta_1), -np.cos(theta_1)])
    hip = np.asarray(foot) + L * up
    return np.asarray(foot) + A * up, hip, hip + B * down, hip + L * down


def swing_rates(sign):
    """Return the right-hand side of (A.58) in which C_21 has the given sign."""

    def rates(_t, x):
        theta_1, theta_2, omega_1, omega_2 = x
        coupling, sine = -LEG * L * B * np.cos(theta_2 - theta_1), LEG * L * B * np.sin(theta_2 - theta_1)
        D = [[LEG * B**2, coupling], [coupling, HIP * L**2 + LEG * (L**2 + A**2)]]
        C = [[0.0, omega_2 * sine], [sign * omega_1 * sine, 0.0]]
        gravity = [LEG * G * B * np.sin(theta_1), -(HIP * L + LEG * (A + L)) * G * np.sin(theta_2)]
        return np.concatenate(([omega_1, omega_2], np.linalg.solve(D, -np.dot(C, x[2:]) - gravity)))

    return rates


def swing(start, sign, slope, longest=2.0):
    """Integrate a swing up to its heel strike, with dense output."""

    def feet(_t, x):
        return x[0] + x[1] + 2.0 * slope if x[0] > x[1] else 1.0

    feet.terminal, feet.direction = True, -1.0
    return solve_ivp(
        swing_rates(sign),
        (0.0, longest),
        start,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
        events=feet,
        dense_output=True,
    )


def fall(start, sign, longest):
    """Integrate the same motion, but ignore heel strikes."""
    return solve_ivp(
        swing_rates(sign), (0.0, longest), start, method="DOP853", rtol=1e-11, atol=1e-13, dense_output=True
    )


def velocities(x, step=1e-6):
    """Return the velocities of the three masses by central differences of their positions."""
    q, rate = np.asarray(x[:2]), np.asarray(x[2:])
    ahead, behind = positions(q + step * rate), positions(q - step * rate)
    return [(one - other) / (2.0 * step) for one, other in zip(ahead[:3], behind[:3], strict=True)]


def energy(x):
    """Return the kinetic energy plus the potential energy above the stance foot."""
    masses = (LEG, HIP, LEG)
    kinetic = sum(0.5 * m * v @ v for m, v in zip(masses, velocities(x), strict=True))
    return kinetic + sum(m * G * p[1] for m, p in zip(masses, positions(x[:2]), strict=False))


def momentum(x):
    """Return the linear momentum of the walker."""
    return sum(m * v for m, v in zip((LEG, HIP, LEG), velocities(x), strict=True))
