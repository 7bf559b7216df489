"""Reference solutions of the known problems, computed without the contact code.

They are closed forms, or solutions by SciPy with a second implementation of the laws.
"""

import math
from typing import Any


def linear_bounce_period(mass: float, stiffness: float, drop: float, gravity: float) -> float:
    """Return the time (s) between landings of a ball on an undamped linear spring, in closed form.

    Flight takes 2 v / g. Contact obeys x'' = g - w^2 x from x = 0, x' = v. It takes half a period of the spring plus
    twice the phase shift due to gravity.

    drop  height from which the ball falls (m)
    """
    speed = math.sqrt(2.0 * gravity * drop)
    omega = math.sqrt(stiffness / mass)
    contact = (math.pi + 2.0 * math.atan2(gravity, omega * speed)) / omega
    return 2.0 * speed / gravity + contact


def impact_force(depth: float, rate: float, law: tuple[float, float, float, float]) -> float:
    """Return the force (N) of ADAMS's IMPACT law, as written in the manual. `law` is (k, e, c_max, d_max), SI."""
    k, e, c_max, d_max = law
    if depth <= 0.0:
        return 0.0
    share = min(1.0, depth / d_max)
    return max(0.0, k * math.pow(depth, e) + c_max * (3.0 - 2.0 * share) * share**2 * rate)


def restitution(mass: float, speed: float, law: tuple[float, float, float, float], gravity: float) -> float:
    """Compute the coefficient of restitution of a ball that lands at `speed` (m/s), by SciPy's DOP853."""
    from scipy.integrate import solve_ivp

    def motion(_t: float, y: Any) -> tuple[float, float]:
        return y[1], gravity - impact_force(y[0], y[1], law) / mass

    def leave(t: float, y: Any) -> float:
        # The ball is also at the surface when it lands, which must not end the integration.
        return float(y[0]) if t > 0.0 else 1.0

    leave.terminal, leave.direction = True, -1.0  # type: ignore[attr-defined]
    solution = solve_ivp(
        motion, (0.0, 0.05), (0.0, speed), method="DOP853", rtol=1e-11, atol=1e-14, events=leave, max_step=1e-5
    )
    return float(-solution.y[1, -1] / speed)


def creep_speed(slope: float, static: float, stiction_velocity: float) -> float:
    """Return the slip velocity (m/s) at which the cubic friction law balances a block's weight along a slope (rad)."""
    from scipy.optimize import brentq

    def excess(slip: float) -> float:
        share = (slip + stiction_velocity) / (2.0 * stiction_velocity)
        return -static + 2.0 * static * share**2 * (3.0 - 2.0 * share) - math.tan(slope)

    return float(brentq(excess, 0.0, stiction_velocity, xtol=1e-15))


def sliding_acceleration(slope: float, dynamic: float, gravity: float) -> float:
    """Return the acceleration (m/s^2) of a block down a slope (rad) under dynamic friction."""
    return gravity * (math.sin(slope) - dynamic * math.cos(slope))


def wheel_speed(spokes: int, slope: float, gravity: float, inertia: float = 0.0) -> float:
    """Return the angular speed (rad/s) just after impact of a steadily rolling rimless wheel (1 kg, spokes of 1 m).

    inertia  moment of inertia of the hub (kg m^2)

    Source: McGeer, Passive dynamic walking (1990), section 2; Coleman (1998).
    """
    half = math.pi / spokes
    retained_share = (math.cos(2.0 * half) + inertia) / (1.0 + inertia)
    gained = 4.0 * gravity * math.sin(half) * math.sin(slope) / (1.0 + inertia)
    return math.sqrt(retained_share**2 * gained / (1.0 - retained_share**2))


def wheel_upright_speed(spokes: int, slope: float, gravity: float, inertia: float = 0.0) -> float:
    """Return the angular speed (rad/s) at which a spoke passes the normal of the slope.

    It follows from the speed after the impact, because energy is conserved until the next one.
    """
    half = math.pi / spokes
    climbed = 2.0 * gravity * (math.cos(slope) - math.cos(half - slope)) / (1.0 + inertia)
    return math.sqrt(wheel_speed(spokes, slope, gravity, inertia) ** 2 - climbed)


def painleve_growth_rate(angle: float, friction: float, mass: float, stiffness: float) -> float:
    """Return the growth rate (1/s) with which the end of a sliding rod digs into a linear spring.

    angle  between rod and ground (rad)

    A normal force N with friction mu N accelerates the end by A N, m A = 1 + 3 cos(angle) (cos(angle) - mu sin(angle)).
    Above the critical friction A is negative: the force drives the end in, and penetration grows as exp(sqrt(-A k) t).

    Source: Painleve (1895); Champneys, Varkonyi, The Painleve paradox in contact mechanics (2016).
    """
    by_force = (1.0 + 3.0 * math.cos(angle) * (math.cos(angle) - friction * math.sin(angle))) / mass
    return math.sqrt(-by_force * stiffness)
