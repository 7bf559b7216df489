"""Gaits of kneed walkers with planted mistakes, by an integration that does not use the package.

The equations are Lagrange's, written out by hand for three bodies and round feet. With a locked knee, a leg is one
body, so the heel strike is that of `mistaken_walks`.
"""

import math
from dataclasses import dataclass, field

import mistaken_walks
import numpy as np
from scipy.integrate import solve_ivp

STANCE, THIGH, SHANK = "stance leg", "swing leg", "swing shank"
BODIES = (THIGH, STANCE, SHANK)
FREE, LOCKED = "while the knee is free", "once the knee is locked"
LOCK = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])


def sign_of(row, column, phase):
    """Return the words that name a wrong sign of this term, and the field of `Knees` that plants it."""
    words = f"the term of the {column}'s squared rate in the equation of the {row} has the wrong sign {phase}"
    return words, {"signs": {(row, column, phase): -1.0}}


MISTAKES = {
    **dict(sign_of(row, column, FREE) for row in BODIES for column in BODIES if row != column),
    **dict(sign_of(row, column, LOCKED) for row, column in ((THIGH, STANCE), (STANCE, THIGH))),
    **mistaken_walks.STRIKE_MISTAKES,
    **mistaken_walks.SIZED_MISTAKES,
}
"""Planted mistakes. The keys are words of the sentence with which a check must name them."""


@dataclass(frozen=True)
class Knees:
    """A kneed walker on a slope, SI units; angles are from the slope's normal, counter-clockwise."""

    thigh_length: float
    thigh_mass: float
    thigh_below: float  # centre of mass below the hip
    thigh_inertia: float
    shank_length: float
    shank_mass: float
    shank_below: float  # centre of mass below the knee
    shank_inertia: float
    hip: float
    radius: float
    gravity: float
    slope: float
    # mistakes
    signs: dict = field(default_factory=dict)
    extra: tuple = (0.0, 0.0)
    keeps_rate: bool = False
    strike_radius: float | None = None
    strike_inertia: float = 1.0  # factor by which the inertia of the parts is multiplied in the strike
    inertia: float = 1.0  # factor on the parts' inertia
    window: float = 0.0
    euler: float = 0.0
    leak: float = 0.0
    drag: float = 0.0
    spring: float = 0.0
    bounce: float = 1.0

    @property
    def length(self):
        return self.thigh_length + self.shank_length

    @property
    def straight(self):
        """Return a locked leg as one body."""
        mass = self.thigh_mass + self.shank_mass
        below_thigh = self.thigh_below
        below_shank = self.thigh_length + self.shank_below
        below = (self.thigh_mass * below_thigh + self.shank_mass * below_shank) / mass
        masses = self.thigh_mass * (below_thigh - below) ** 2 + self.shank_mass * (below_shank - below) ** 2
        parts = self.inertia * (self.thigh_inertia + self.shank_inertia)
        return mistaken_walks.Legs(
            self.length, mass, below, masses + parts, self.hip, self.radius, self.gravity, self.slope,
            extra=self.extra, keeps_rate=self.keeps_rate, strike_radius=self.strike_radius,
            strike_inertia=masses + self.strike_inertia * parts, spin=parts, leak=self.leak, bounce=self.bounce,
        )  # fmt: skip


def mass_matrix_and_forces(legs, angles, omega, phase):
    """Return the mass matrix (3, 3) and the generalised forces (3,) of swing thigh, stance leg and swing shank."""
    a, b, s = angles
    mt, ms, M, R, g = legs.thigh_mass, legs.shank_mass, legs.hip, legs.radius, legs.gravity
    ct, cs, l = legs.thigh_below, legs.shank_below, legs.thigh_length
    d = legs.length - R
    It, Is = legs.inertia * legs.thigh_inertia, legs.inertia * legs.shank_inertia
    upper = mt * ct + ms * l  # first moment about the hip of thigh and shank
    # masses that turn with the stance leg, times their height above the centre of the foot's arc
    heights = [(M + mt + ms, d), (mt, d - ct), (ms, d - l - cs)]
    A_bb = sum(m * (R * R + h * h + 2 * R * h * math.cos(b)) for m, h in heights) + It + Is
    half_slope = -sum(m * R * h for m, h in heights) * math.sin(b)
    A_ab = -upper * (d * math.cos(a - b) + R * math.cos(a))
    A_sb = -ms * cs * (d * math.cos(s - b) + R * math.cos(s))
    A_as = ms * l * cs * math.cos(a - s)
    matrix = np.array(
        [[mt * ct * ct + ms * l * l + It, A_ab, A_as], [A_ab, A_bb, A_sb], [A_as, A_sb, ms * cs * cs + Is]]
    )

    def sign(row, column):
        return legs.signs.get((row, column, phase), 1.0)

    da, db, ds = omega
    by_a = upper * (d * math.sin(a - b) + R * math.sin(a))  # dA_ab/da
    by_s = ms * cs * (d * math.sin(s - b) + R * math.sin(s))
    # A locked shank is part of the swing leg.
    shank = SHANK if phase == FREE else THIGH
    force_b = -sign(STANCE, THIGH) * by_a * da**2 - sign(STANCE, shank) * by_s * ds**2 - half_slope * db**2
    force_a = sign(THIGH, STANCE) * upper * d * math.sin(a - b) * db**2
    force_s = sign(shank, STANCE) * ms * cs * d * math.sin(s - b) * db**2
    # dA_as/ds = m l c sin(a - s), and dA_as/da is its opposite
    together = ms * l * cs * math.sin(a - s)
    force_a -= sign(THIGH, SHANK) * together * ds**2
    force_s += sign(SHANK, THIGH) * together * da**2
    tilt = legs.slope
    force_b += sum(m * g * (h * math.sin(b - tilt) - R * math.sin(tilt)) for m, h in heights)
    force_a -= upper * g * math.sin(a - tilt) + legs.drag * da + legs.spring * (a - b)
    force_b += legs.spring * (a - b)
    force_s -= ms * cs * g * math.sin(s - tilt)
    return matrix, np.array([force_a, force_b, force_s])


def rates(legs, state, phase):
    """Return the derivative of a state: first the angles, then the rates of thigh, stance leg and, while the knee is
    free, shank.
    """
    n = len(state) // 2
    Z = np.eye(3) if n == 3 else LOCK
    matrix, forces = mass_matrix_and_forces(legs, Z @ state[:n], Z @ state[n:], phase)
    return np.concatenate((state[n:], np.linalg.solve(Z.T @ matrix @ Z, Z.T @ forces)))


def swing(legs, state, phase, event, counts):
    """Return time and state when the event function falls to zero while `counts` is true."""
    limit = 12.0 * math.sqrt(legs.length / legs.gravity)
    if legs.euler:
        return mistaken_walks.euler(legs, state, lambda now: rates(legs, now, phase), event, counts, limit)
    watch = lambda _t, now: event(now)  # noqa: E731 - it needs an attribute
    watch.direction = -1
    course = solve_ivp(
        lambda _t, now: rates(legs, now, phase), (0.0, limit), state, method="DOP853", rtol=1e-12, atol=1e-14,
        events=(watch, mistaken_walks.fallen), max_step=limit / 50,
    )  # fmt: skip
    for time, end in zip(course.t_events[0], course.y_events[0], strict=True):
        if counts(end) and time > 1e-9:
            return float(time), end
    raise ValueError("the event does not come")


def step(legs, start):
    """Return the state just after the next heel strike, the period, and the state just before the strike."""
    bent = np.array([start[0], start[1], start[0], start[2], start[3], start[2]])
    locking, state = swing(legs, bent, FREE, lambda now: now[0] - now[2], lambda _: True)
    matrix, _ = mass_matrix_and_forces(legs, state[:3], state[3:], FREE)
    straight_rates = np.linalg.solve(LOCK.T @ matrix @ LOCK, LOCK.T @ matrix @ state[3:])
    straight = np.concatenate((state[:2], straight_rates))
    time, before = swing(legs, straight, LOCKED, lambda now: now[0] + now[1] - legs.window, lambda now: now[0] > now[1])
    return mistaken_walks.strike(legs.straight, before), locking + time, before


def random_knees(generator):
    """Return a random kneed walker. Most of them have a gait."""

    def between(low, high, digits):
        return float(np.round(generator.uniform(low, high), digits))

    return Knees(
        thigh_length=0.5, thigh_mass=between(0.4, 0.6, 2), thigh_below=between(0.28, 0.36, 3),
        thigh_inertia=between(0.002, 0.008, 4), shank_length=0.5, shank_mass=between(0.04, 0.08, 3),
        shank_below=between(0.1, 0.16, 3), shank_inertia=between(0.0005, 0.002, 4), hip=between(0.3, 0.8, 2),
        radius=between(0.05, 0.25, 2), gravity=9.81, slope=between(0.03, 0.06, 3),
    )  # fmt: skip


def config_of(legs):
    """Return the config of the walker without the mistake, as keys."""
    thigh = {"length_m": legs.thigh_length, "mass_kg": legs.thigh_mass, "mass_below_hip_m": legs.thigh_below}
    shank = {"length_m": legs.shank_length, "mass_kg": legs.shank_mass, "mass_below_knee_m": legs.shank_below}
    walker = {
        "type": "kneed", "hip_mass_kg": legs.hip, "foot_radius_m": legs.radius,
        "thigh": {**thigh, "inertia_kg_m2": legs.thigh_inertia},
        "shank": {**shank, "inertia_kg_m2": legs.shank_inertia},
    }  # fmt: skip
    return {"walker": walker, "gravity_m_s2": legs.gravity, "slope_rad": legs.slope}
