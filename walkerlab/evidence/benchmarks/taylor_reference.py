"""Rigid walk by heyoka's Taylor series at machine precision, independent of our solvers.

Optional (extra `reference`). Biscani, Izzo: Revisiting high-order Taylor methods for astrodynamics and celestial
mechanics, MNRAS 504 (2021).
"""

import importlib.util
from typing import Any

import numpy as np

from walkerlab.evidence.paper.appendix_a import RigidWalker, impact
from walkerlab.physics.solvers.system import Floats

TAYLOR_METHOD = "heyoka-taylor"


def is_installed() -> bool:
    return importlib.util.find_spec("heyoka") is not None


def walk_by_taylor(walker: RigidWalker, start: tuple[float, ...], steps: int) -> Floats | None:
    """Return the state after `steps` heel strikes, or None if one of them does not occur."""
    limit = 10.0 * np.sqrt(walker.leg_length / walker.gravity)
    passing, striking = integrators(walker)
    state = np.array(start)
    for _ in range(steps):
        # both feet are on the slope at the start too: look for the heel strike once the legs have passed each other
        for integrator in (passing, striking) if state[0] < state[1] else (striking,):
            integrator.time, integrator.state[:] = 0.0, state
            integrator.reset_cooldowns()
            outcome = integrator.propagate_until(limit)[0]
            if outcome.value >= 0 or abs(integrator.time) >= limit:
                return None
            state = np.array(integrator.state)
        state = np.array(impact(walker, *state.tolist()))
    return state


def integrators(walker: RigidWalker) -> tuple[Any, Any]:
    """Build two Taylor integrators of the swing phase: one stops when the legs pass, the other at heel strike."""
    import heyoka as hy

    th1, th2, w1, w2 = hy.make_vars("th1", "th2", "w1", "w2")
    L, a, m, M = walker.leg_length, walker.foot_to_mass, walker.leg_mass, walker.hip_mass
    b = L - a
    g = walker.gravity
    inertia = walker.leg_inertia
    d11 = m * b * b + inertia
    d22 = M * L * L + m * (L * L + a * a) + inertia
    d12 = -m * L * b * hy.cos(th2 - th1)
    r1 = -m * L * b * w2 * w2 * hy.sin(th2 - th1) - m * g * b * hy.sin(th1)
    r2 = -walker.c21_sign * m * L * b * w1 * w1 * hy.sin(th2 - th1) + (M * L + m * (a + L)) * g * hy.sin(th2)
    determinant = d11 * d22 - d12 * d12
    equations = [
        (th1, w1),
        (th2, w2),
        (w1, (d22 * r1 - d12 * r2) / determinant),
        (w2, (d11 * r2 - d12 * r1) / determinant),
    ]
    upward = hy.event_direction.positive
    downward = hy.event_direction.negative
    passing = hy.t_event(th1 - th2, direction=upward)
    striking = hy.t_event(th1 + th2 + 2.0 * walker.slope, direction=downward)
    return tuple(hy.taylor_adaptive(equations, [0.0] * 4, t_events=[event]) for event in (passing, striking))
