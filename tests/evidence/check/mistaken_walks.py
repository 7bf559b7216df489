"""Gaits of straight-legged walkers with planted mistakes, by an integration that does not use the package.

It shares nothing with the code that judges: the equations are Lagrange's, written out by hand for a walker with round
feet, and the heel strike balances the momenta of three bodies with vectors.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from walkerlab.config.loader import tree_of
from walkerlab.config.tree import NOWHERE
from walkerlab.config.validation import validate_tree
from walkerlab.evidence.check.answer import check_gait
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.scene.rigid import rigid_walker

UNITS = np.eye(4)
FALLEN = 1.2  # rad; a walker whose stance leg leans further has fallen
STRIKE_MISTAKES = {
    "−I × (trailing leg's rate − leading leg's rate)": {"extra": (1.0, -1.0)},
    "−I × the trailing leg's rate": {"extra": (1.0, 0.0)},
    "trailing leg keeps its rate": {"keeps_rate": True},
    "leaves out the foot's rolling": {"strike_radius": 0.0},
    "inertia is left out of the heel strike": {"strike_inertia": 0.0},
    "the legs' inertia is left out": {"inertia": 0.0},
    "hip's mass counts once for each leg": {"hip": 2.0},
}
SIZED_MISTAKES = {
    "is within 0.001 rad of it": {"window": 1e-3},
    "Euler's method with a step of 0.002 s": {"euler": 2e-3},
}
MISTAKES = {
    "swing leg's squared rate in the equation of the stance leg": {"stance_sign": -1.0},
    "stance leg's squared rate in the equation of the swing leg": {"swing_sign": -1.0},
    "all velocity terms have the wrong sign": {"velocity_sign": -1.0},
    **STRIKE_MISTAKES,
    **SIZED_MISTAKES,
}
"""Planted mistakes. The keys are words of the sentence with which a check must name them. That of the hip is a factor.
"""
UNLISTED = {"leak": 0.02, "drag": 0.01, "spring": 0.05, "bounce": 0.97}
"""Mistakes that the check does not know."""


@dataclass(frozen=True)
class Legs:
    """A walker with straight legs on a slope, SI units; angles are from the slope's normal, counter-clockwise."""

    length: float
    mass: float
    below: float  # centre of mass below the hip
    inertia: float
    hip: float
    radius: float
    gravity: float
    slope: float
    # mistakes
    stance_sign: float = 1.0  # sign of the swing leg's centripetal term in the equation of the stance leg
    swing_sign: float = 1.0  # sign of the stance leg's centripetal term in the equation of the swing leg
    velocity_sign: float = 1.0  # sign of all velocity terms
    # weights of I times the trailing and the leading rate, which the balance about the hip subtracts
    extra: tuple = (0.0, 0.0)
    keeps_rate: bool = False
    strike_radius: float | None = None  # radius of the foot in the strike only
    strike_inertia: float | None = None
    spin: float | None = None  # inertia in the extra term, if it differs from the leg's
    window: float = 0.0
    euler: float = 0.0
    leak: float = 0.0  # a mistake that the check does not know: fraction of the hip's momentum lost in each strike
    drag: float = 0.0  # another such mistake: torque on the swing leg in proportion to its rate
    spring: float = 0.0  # between the legs
    bounce: float = 1.0  # factor by which the leading leg's rate is multiplied after each strike


def rates(legs, state):
    """Return the derivative of (swing angle, stance angle, their rates) from Lagrange's function, derived by hand."""
    a, b, da, db = state
    m, M, c, I, R, g = legs.mass, legs.hip, legs.below, legs.inertia, legs.radius, legs.gravity
    d = legs.length - R  # from the foot's centre to the hip
    e = d - c  # from the foot's centre to the stance leg's mass
    # kinetic energy: hip and stance leg turn about the rolling contact, v^2 = w^2 (R^2 + h^2 + 2 R h cos b)
    hips, own = M + m, m
    A_bb = hips * (R * R + d * d + 2 * R * d * math.cos(b)) + own * (R * R + e * e + 2 * R * e * math.cos(b)) + I
    half_slope = -(hips * R * d + own * R * e) * math.sin(b)  # half of dA_bb/db
    A_ab = -m * c * (d * math.cos(a - b) + R * math.cos(a))
    A_aa = m * c * c + I
    # Christoffel terms
    by_b = m * c * d * math.sin(a - b)  # dA_ab/db is -m c d sin(a - b)
    by_a = m * c * (d * math.sin(a - b) + R * math.sin(a))  # dA_ab/da
    force_b = -legs.stance_sign * by_a * da * da - half_slope * db * db
    force_a = legs.swing_sign * by_b * db * db
    force_b *= legs.velocity_sign
    force_a *= legs.velocity_sign
    tilt = legs.slope
    force_b += hips * g * (d * math.sin(b - tilt) - R * math.sin(tilt))
    force_b += own * g * (e * math.sin(b - tilt) - R * math.sin(tilt))
    force_a += -m * g * c * math.sin(a - tilt) - legs.drag * da - legs.spring * (a - b)
    force_b += legs.spring * (a - b)
    det = A_aa * A_bb - A_ab * A_ab
    return np.array([da, db, (A_bb * force_a - A_ab * force_b) / det, (A_aa * force_b - A_ab * force_a) / det])


def cross(u, v):
    return u[0] * v[1] - u[1] * v[0]


def strike(legs, before):
    """Return the state after a heel strike. Impulses at the new contact point and at the hip change the momenta of both
    bodies.
    """
    a, b, da, db = before  # a is the swing leg, which lands, and b the stance leg, which trails
    m, M, c = legs.mass, legs.hip, legs.below
    I = legs.inertia if legs.strike_inertia is None else legs.strike_inertia
    R = legs.radius if legs.strike_radius is None else legs.strike_radius
    d = legs.length - legs.radius if legs.strike_radius is None else legs.length - R

    def up(angle):
        return np.array([-math.sin(angle), math.cos(angle)])

    def turn(rate, arm):
        return rate * np.array([-arm[1], arm[0]])

    # velocities before, about the trailing contact point, which rolls
    normal = np.array([0.0, 1.0])
    r = legs.length - legs.radius
    hip_before = turn(db, legs.radius * normal + r * up(b))
    trailing_before = turn(db, legs.radius * normal + (r - c) * up(b))
    landing_before = hip_before + turn(da, -c * up(a))
    to_hip = R * normal + d * up(a)
    landing, trailing, hip = to_hip - c * up(a), to_hip - c * up(b), to_hip

    def momenta(w_lead, w_trail, spins):
        v_hip = turn(w_lead, to_hip)
        v_lead = turn(w_lead, landing)
        v_trail = v_hip + turn(w_trail, -c * up(b))
        whole = m * cross(landing, v_lead) + m * cross(trailing, v_trail) + M * cross(hip, v_hip)
        about_hip = m * cross(trailing - hip, v_trail)
        return np.array([whole + I * (spins * w_lead + spins * w_trail), about_hip + I * spins * w_trail])

    columns = np.array([momenta(1.0, 0.0, 1.0), momenta(0.0, 1.0, 1.0)]).T
    whole = m * cross(landing, landing_before) + m * cross(trailing, trailing_before)
    whole += M * cross(hip, hip_before) * (1.0 - legs.leak) + I * (da + db)
    about_hip = m * cross(trailing - hip, trailing_before) + I * db
    about_hip -= (legs.inertia if legs.spin is None else legs.spin) * (legs.extra[0] * db + legs.extra[1] * da)
    if legs.keeps_rate:
        columns[1], about_hip = [0.0, 1.0], db
    lead, trail = np.linalg.solve(columns, [whole, about_hip])
    return np.array([b, a, trail, legs.bounce * lead])


def fallen(_t, state):
    return abs(state[1]) - FALLEN


fallen.terminal = True


def euler(legs, state, derivative, event, counts, limit):
    """Return time and state when the event function falls to zero while `counts` is true, by Euler's method and a
    straight line.
    """
    before = event(state)
    for count in range(int(limit / legs.euler)):
        old, state = state, state + legs.euler * derivative(state)
        if fallen(0.0, state) > 0.0:
            break
        now = event(state)
        if before > 0.0 >= now and counts(state):
            share = before / (before - now)
            return legs.euler * (count + share), old + share * (state - old)
        before = now
    raise ValueError("the event does not come")


def step(legs, start):
    """Return the state just after the next heel strike, the period, and the state just before the strike."""

    def touch(_t, state):
        return state[0] + state[1] - legs.window

    def ahead(state):
        return state[0] > state[1]

    limit = 12.0 * math.sqrt(legs.length / legs.gravity)
    if legs.euler:
        start = np.array(start)
        time, before = euler(
            legs, start, lambda state: rates(legs, state), lambda state: touch(0.0, state), ahead, limit
        )
        return strike(legs, before), time, before
    touch.direction = -1
    course = solve_ivp(
        lambda _t, state: rates(legs, state), (0.0, limit), start, method="DOP853", rtol=1e-12, atol=1e-14,
        events=(touch, fallen), max_step=limit / 50,
    )  # fmt: skip
    for time, state in zip(course.t_events[0], course.y_events[0], strict=True):
        if ahead(state) and time > 0.0:
            return strike(legs, state), float(time), state
    raise ValueError("no heel strike")


def gait(legs, guess, step=step):
    """Return the state just after the heel strike of the gait near a guess and its period, or None if there is none."""
    state, move, error, slopes = np.array(guess), None, None, None
    for _ in range(25):
        try:
            after, period, _ = step(legs, state)
            last, error = error, after - state
            if np.abs(error).max() < 1e-12:
                return state, period
            if slopes is None:
                columns = [(step(legs, state + 1e-6 * unit)[0] - after) / 1e-6 for unit in UNITS]
                slopes = np.array(columns).T - np.eye(4)
            else:
                # Broyden's update
                slopes += np.outer(error - last - slopes @ move, move) / (move @ move)
        except ValueError:
            return None
        move = -np.linalg.solve(slopes, error)
        move *= min(1.0, 0.05 / np.abs(move).max())
        state = state + move
    return None


def gait_with(legs, start, mistake, step=step):
    """Gait with a mistake, also followed from the right one as the walker's numbers change; None if it is lost.

    mistake  keys of `legs`; the hip's mass is a factor
    """
    ends = {**mistake, **({"hip": mistake["hip"] * legs.hip} if "hip" in mistake else {})}
    begin = {name: getattr(legs, name) for name in ("hip", "inertia", "strike_inertia") if name in mistake}
    begin |= {"strike_inertia": legs.inertia} if begin.get("strike_inertia", 0.0) is None else {}
    signs = mistake.get("signs", {})
    for parts in (1, 4) if begin or signs else (1,):
        found = start, 0.0
        for share in np.arange(1, parts + 1) / parts:
            between = {name: value + share * (ends[name] - value) for name, value in begin.items()}
            between |= {"signs": {term: 1.0 + share * (sign - 1.0) for term, sign in signs.items()}} if signs else {}
            found = found and gait(replace(legs, **{**ends, **between}), found[0], step)
        if found is not None:
            return found
    return None


def random_legs(generator):
    """Return a random walker with round feet and inertia. Most of them have a gait."""
    return Legs(
        length=1.0,
        mass=float(np.round(generator.uniform(0.3, 1.0), 2)),
        below=float(np.round(generator.uniform(0.35, 0.6), 2)),
        inertia=float(np.round(generator.uniform(0.01, 0.04), 3)),
        hip=float(np.round(generator.uniform(0.5, 2.0), 2)),
        radius=float(np.round(generator.uniform(0.1, 0.3), 2)),
        gravity=9.81,
        slope=float(np.round(generator.uniform(0.01, 0.03), 3)),
    )


def config_of(legs):
    """Return the config of the walker without the mistake, as keys."""
    return {
        "walker": {
            "type": "straight-legs",
            "leg_length_m": legs.length,
            "leg_mass_kg": legs.mass,
            "leg_mass_below_hip_m": legs.below,
            "leg_inertia_kg_m2": legs.inertia,
            "hip_mass_kg": legs.hip,
            "foot_radius_m": legs.radius,
        },
        "gravity_m_s2": legs.gravity,
        "slope_rad": legs.slope,
    }


def printed(numbers, digits):
    """Return numbers as texts with this many significant digits."""
    return [f"{number:.{digits - 1 - math.floor(math.log10(abs(number)))}f}" for number in numbers]


def right_gait(config):
    """Return the state of the gait that the package chooses for the config, or None if there is no gait."""
    checked = checked_config(config, {})
    chosen = find_gaits(rigid_walker(checked), 0).gait
    if chosen is None:
        return None
    state = np.array(chosen.state)
    half = len(state) // 2
    return np.array([*(state[:2] + checked.slope_rad), *state[half : half + 2]])


def checked_config(config, check):
    block = {"check": {"angles": {"from": "slope-normal"}, **check}} if check else {}
    return validate_tree(tree_of({**config, "contact": None, **block}, NOWHERE))


def answer_to(config, state, period, digits):
    """Return the check's answer to a gait whose state and period are printed to some digits."""
    values = {"state": printed(state, digits), "period_s": printed([period], digits)[0]}
    return check_gait(checked_config(config, {"printed": values}))


def walkers(seed, random=random_legs, config_of=config_of):
    """Yield random walkers that have a gait, each with the state of the gait."""
    generator = np.random.default_rng(seed)
    while True:
        legs = random(generator)
        state = right_gait(config_of(legs))
        if state is not None:
            yield legs, state
