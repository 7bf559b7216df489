"""Rigid walk as a user would program it with NumPy and SciPy, for comparison: matrices, a linear solve, an event."""

from typing import Any

import numpy as np

from walkerlab.evidence.paper.appendix_a import RigidWalker, impact
from walkerlab.physics.solvers.system import Floats


class ScriptBudgetError(Exception):
    """The script has exhausted its budget of right-hand sides."""


def walk_as_a_script(
    walker: RigidWalker,
    start: tuple[float, ...],
    steps: int,
    rtol: float,
    atol: float,
    budget: int,
    method: str = "DOP853",
    ends: tuple[Any, ...] = (),
) -> tuple[Floats | None, int]:
    """Simulate a walk with SciPy's solve_ivp, a NumPy right-hand side and terminal events.

    ends  further event functions that end the walk

    Returns the state after the last impact (None if not reached) and the number of right-hand sides.
    """
    from scipy.integrate import solve_ivp

    L, a, m, M = walker.leg_length, walker.foot_to_mass, walker.leg_mass, walker.hip_mass
    b = L - a
    g = walker.gravity
    slope = walker.slope
    used = 0

    def right_hand_side(_t: float, x: Floats) -> Floats:
        nonlocal used
        used += 1
        if used > budget:
            raise ScriptBudgetError
        th1, th2, w1, w2 = x
        sine = np.sin(th2 - th1)
        cosine = np.cos(th2 - th1)
        D = np.array([[m * b**2, -m * L * b * cosine], [-m * L * b * cosine, M * L**2 + m * (L**2 + a**2)]])
        D += walker.leg_inertia * np.eye(2)
        C = np.array([[0.0, m * L * b * w2 * sine], [walker.c21_sign * m * L * b * w1 * sine, 0.0]])
        G = np.array([m * g * b * np.sin(th1), -(M * L + m * (a + L)) * g * np.sin(th2)])
        return np.concatenate([x[2:], np.linalg.solve(D, -C @ x[2:] - G)])

    def heel_strike(_t: float, x: Floats) -> float:
        return float(x[0] + x[1] + 2.0 * slope) if x[0] > x[1] else 1.0

    event: Any = heel_strike
    event.terminal = True
    event.direction = -1.0
    state = np.array(start)
    limit = 10.0 * np.sqrt(L / g)
    try:
        for _ in range(steps):
            swing = solve_ivp(
                right_hand_side, (0.0, limit), state, method=method, rtol=rtol, atol=atol, events=[event, *ends]
            )
            if not swing.t_events[0].size:
                return None, used
            state = np.array(impact(walker, *swing.y[:, -1].tolist()))
    except ScriptBudgetError:
        return None, used
    return state, used
