"""Random walkers whose legs differ, as plain descriptions and as rigid models of the package."""

from dataclasses import replace

import numpy as np
from plain_unequal_walk import Leg, Segment, Walker

from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.mechanics.rigid_model import pair, replace_fields
from walkerlab.scene.parts import Arc, Limb, kneed_legs, replace_second_leg, straight_legs

KINDS = ("masses", "straight", "round", "kneed", "kneed and round", "one knee")


def varied(draw, leg, share):
    """Return the leg with each parameter changed by up to a share of it."""

    def near(value):
        return value * draw.uniform(1.0 - share, 1.0 + share)

    segments = tuple(Segment(*map(near, vars(segment).values())) for segment in leg.segments)
    return Leg(segments, near(leg.radius), leg.centre_ahead)


def draw_walker(kind, seed):
    draw = np.random.default_rng(seed)
    knees = Leg((Segment(0.5, 0.5, 0.325, 0.0, 0.0), Segment(0.5, 0.05, 0.125, 0.0, 0.0)), 0.0)
    if kind == "one knee":  # walker of Miandoab and Beigzadeh
        kneed = Leg((Segment(0.379, 8.76, 0.143, 0.0, 0.129), Segment(0.388, 2.70, 0.157, 0.0, 0.032)), 0.0)
        straight = Leg((Segment(0.767, 11.46, 0.235, 0.0, 0.479),), 0.0)
        legs, hip, slope = (varied(draw, kneed, 2e-3), varied(draw, straight, 2e-3)), 37.08, 0.04
        return Walker(legs, hip, slope, knee_damping=(draw.uniform(0.0, 0.15), 0.0))
    if kind.startswith("kneed"):
        leg, hip, slope = replace(knees, radius=0.1 if "round" in kind else 0.0), 0.5, 0.05
        return Walker((varied(draw, leg, 4e-3), varied(draw, leg, 4e-3)), hip, slope)
    leg = Leg((Segment(1.0, 5.0, 0.5, 0.01 if kind == "round" else 0.0, 0.1),), 0.25 if kind == "round" else 0.0)
    other = varied(draw, leg, 5e-3)
    if kind == "masses":
        (own,) = leg.segments
        other = Leg((replace(own, mass=own.mass * draw.uniform(0.85, 1.15), below=own.below * 1.04),), leg.radius)
    if kind == "round":
        leg, other = replace(leg, centre_ahead=0.02), replace(other, centre_ahead=0.025)
    return Walker((leg, other), 10.0, draw.uniform(0.015, 0.04))


def assembly(leg, hip_mass):
    limbs = [Limb(each.length, each.mass, each.below, each.ahead, each.inertia) for each in leg.segments]
    build = straight_legs if len(limbs) == 1 else kneed_legs
    return build(*limbs, hip_mass, Arc(leg.radius, leg.centre_ahead))


def model_of(plain):
    """Return the rigid model, with a damper at each knee and a push-off of each leg."""
    first, second = (assembly(leg, plain.hip_mass) for leg in plain.legs)
    model = rigid_on_slope(replace_second_leg(first, second), plain.gravity, plain.slope)
    if not any(plain.knee_damping + plain.push_offs):
        return model
    knees = [{"knees": (0.0, damping, 0.0)} if any(plain.knee_damping) else {} for damping in plain.knee_damping]
    drives = [own | {"push_off": push} for own, push in zip(knees, plain.push_offs, strict=True)]
    models = zip((model, model.exchanged), drives, strict=True)
    return pair(*(replace_fields(each, drive) for each, drive in models))


def legs_of(state):
    """Return angles and rates of both legs."""
    n = len(state) // 2
    return np.array([*state[:2], *state[n : n + 2]])
