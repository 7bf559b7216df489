"""Effects of Appendix A's misprints. The heel strike solves the six equations of (A.57) as printed."""

import math

import numpy as np
from scipy.optimize import root

from walkerlab.evidence.paper.appendix_a import RigidWalker, assembled
from walkerlab.evidence.paper.measured import TIGHT
from walkerlab.physics.hybrid.comparison import Array
from walkerlab.physics.hybrid.recorded_walk import as_state, take_walk
from walkerlab.physics.solvers.system import State

RIGHT, MISPRINTED = 1.0, -1.0  # sign of the second row of P and E
ROOT_TOLERANCE = 1e-9


def inertia_at_impact(walker: RigidWalker, theta_1: float, theta_2: float) -> Array:
    """Mass matrix D_e of (A.9) to (A.24), for velocities of (theta_1, theta_2, x, y)."""
    L = walker.leg_length
    a = walker.foot_to_mass
    m = walker.leg_mass
    M_H = walker.hip_mass
    b = L - a
    K = L * m + a * m + L * M_H
    coupling = -m * L * b * math.cos(theta_2 - theta_1)
    s1 = math.sin(theta_1)
    c1 = math.cos(theta_1)
    s2 = math.sin(theta_2)
    c2 = math.cos(theta_2)
    total = M_H + 2.0 * m
    return np.array(
        [
            [m * b**2, coupling, b * m * c1, b * m * s1],
            [coupling, L**2 * M_H + L**2 * m + a**2 * m, -c2 * K, -s2 * K],
            [b * m * c1, -c2 * K, total, 0.0],
            [b * m * s1, -s2 * K, 0.0, total],
        ]
    )


def swing_foot(walker: RigidWalker, theta_1: float, theta_2: float, row_2: float) -> Array:
    """Position P (m) of the swing foot, (A.55), with the stance foot at the origin. `row_2` is RIGHT or MISPRINTED."""
    L = walker.leg_length
    rise = L * (math.cos(theta_2) - math.cos(theta_1))
    return np.array([L * (math.sin(theta_1) - math.sin(theta_2)), row_2 * rise])


def height_over_slope(walker: RigidWalker, theta_1: float, theta_2: float, row_2: float) -> float:
    """Height (m) above the slope at which P places the swing foot."""
    along, up = swing_foot(walker, theta_1, theta_2, row_2)
    return float(along * math.sin(walker.slope) + up * math.cos(walker.slope))


def swing_foot_gradient(walker: RigidWalker, theta_1: float, theta_2: float, row_2: float) -> Array:
    """Matrix E of (A.56), the derivative of `swing_foot` with respect to (theta_1, theta_2, x, y)."""
    L = walker.leg_length
    return np.array(
        [
            [L * math.cos(theta_1), -L * math.cos(theta_2), 1.0, 0.0],
            [row_2 * L * math.sin(theta_1), -row_2 * L * math.sin(theta_2), 0.0, 1.0],
        ]
    )


def velocities_after_impact(walker: RigidWalker, before: State, row_2: float) -> Array:
    """Solve (A.57): velocities of (theta_1, theta_2, x, y) after the impact, before the change of roles."""
    D = inertia_at_impact(walker, before[0], before[1])
    E = swing_foot_gradient(walker, before[0], before[1], row_2)
    system = np.block([[D, -E.T], [E, np.zeros((2, 2))]])
    velocities = np.array([before[2], before[3], 0.0, 0.0])
    return np.asarray(np.linalg.solve(system, np.concatenate((D @ velocities, np.zeros(2))))[:4])


def foothold_speed_after_impact(walker: RigidWalker, before: State, row_2: float) -> float:
    """Speed (m/s) of the new stance foot after the impact, which (7) requires to be zero."""
    after = velocities_after_impact(walker, before, row_2)
    return float(np.linalg.norm(swing_foot_gradient(walker, before[0], before[1], RIGHT) @ after))


def step(walker: RigidWalker, start: State, row_2: float) -> State | None:
    """Return the state after one step with the impact of (A.57), or None if no heel strike occurs."""
    walk = take_walk(assembled(walker), TIGHT, start, 1)
    if walk.steps == 0:
        return None
    before = as_state(walk.before[0])
    after = velocities_after_impact(walker, before, row_2)
    return before[1], before[0], float(after[1]), float(after[0])


def fixed_point(walker: RigidWalker, guess: State, row_2: float) -> State | None:
    """Find the fixed point, near `guess`, of the step map with the impact of (A.57), or return None if the search
    fails.
    """

    def state(z: Array) -> State:
        return -2.0 * walker.slope - float(z[0]), float(z[0]), float(z[1]), float(z[2])

    def mismatch(z: Array) -> Array:
        after = step(walker, state(z), row_2)
        return np.full(3, 1.0) if after is None else np.array(after[1:]) - z

    solution = root(mismatch, np.array(guess[1:]), tol=ROOT_TOLERANCE)
    return state(solution.x) if np.abs(mismatch(solution.x)).max() < 1e3 * ROOT_TOLERANCE else None
