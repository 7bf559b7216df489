"""Check energy, momentum, mirror images and scaling of random walkers of each type, without compiling."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigid_physics import heel_strike, knee_strike, rates, state_linked, total_energy
from scipy.integrate import solve_ivp

from walkerlab.config.walkers import CompassWalker, Kneed, PartsWalker, StraightLegs, Torso
from walkerlab.physics.mechanics.parts import Assembly
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.mechanics.rigid_model import (
    BENT,
    STANCE,
    STRAIGHT,
    Mode,
    ground_reaction,
    kinetic_energy,
    swing_foot,
)
from walkerlab.scene.parts import assembly_of

G = 9.81
EXAMPLES = 12

share, ahead = st.floats(0.2, 0.8), st.floats(-0.05, 0.05)
mass, inertia, radius = st.floats(0.05, 5.0), st.floats(0.001, 0.1), st.floats(0.0, 0.3)
torsos = st.none() | st.builds(Torso, mass_kg=mass, above_hip_m=share, inertia_kg_m2=inertia)
slopes = st.floats(0.001, 0.15)
numbers = st.lists(st.floats(-0.7, 0.7), min_size=6, max_size=6)

compasses = st.builds(
    CompassWalker, foot_to_mass_m=share, leg_mass_kg=mass, hip_mass_kg=mass, leg_inertia_kg_m2=inertia, torso=torsos
)
straight = st.builds(
    StraightLegs,
    type=st.just("straight-legs"),
    leg_length_m=st.just(0.9),
    leg_mass_kg=mass,
    leg_mass_below_hip_m=share,
    leg_mass_ahead_m=ahead,
    leg_inertia_kg_m2=inertia,
    hip_mass_kg=mass,
    foot_radius_m=radius,
    foot_centre_ahead_m=ahead,
    torso=torsos,
)
limbs = st.builds(
    lambda length, mass_kg, at, ahead_m, turning: {
        "length_m": length, "mass_kg": mass_kg, "below": at, "mass_ahead_m": ahead_m, "inertia_kg_m2": turning
    },
    st.floats(0.35, 0.6), mass, share, ahead, inertia,
)  # fmt: skip


def kneed_of(upper, lower, hip_mass_kg, foot_radius_m, foot_ahead_m, torso):
    thigh, shank = dict(upper), dict(lower)
    thigh["mass_below_hip_m"] = thigh.pop("below") * thigh["length_m"]
    shank["mass_below_knee_m"] = shank.pop("below") * shank["length_m"]
    return Kneed(
        type="kneed",
        thigh=thigh,
        shank=shank,
        hip_mass_kg=hip_mass_kg,
        foot_radius_m=foot_radius_m,
        foot_centre_ahead_m=foot_ahead_m,
        torso=torso,
    )


kneed = st.builds(kneed_of, limbs, limbs, mass, radius, ahead, torsos)
TYPES = {"compass": compasses, "straight-legs": straight, "kneed": kneed}
each_type = pytest.mark.parametrize("kind", TYPES)


def for_each_type(test):
    """Run the test for random walkers, slopes and states of one type at a time."""

    @each_type
    @settings(max_examples=EXAMPLES)
    @given(data=st.data(), slope=slopes, free=numbers)
    def for_type(kind, data, slope, free):
        walker = data.draw(TYPES[kind])
        test(assembly_of(walker, rigid=True), slope, free)

    for_type.__name__, for_type.__doc__ = test.__name__, test.__doc__
    return for_type


def state_of(model, phase, free):
    """Return angles and velocities of a swing, with followers placed by their coupling."""
    n = len(model.arm_x)
    padded = (*free[:3], 0.0)
    return state_linked(model, phase, (*padded[:n], *(*(3.0 * x for x in free[3:]), 0.0)[:n]))


def both_feet_down(model, free):
    """Return a state at heel strike, with straight legs and both feet on the slope."""
    swing = -2.0 * (model.slope + model.lean) - free[0]
    return state_of(model, STRAIGHT, (swing, free[0], swing, *free[3:]))


def in_motion(assembly, model, y, centre):
    """Return (mass, position, velocity) and (inertia, angular velocity) of all parts, and the swing foot's centre,
    measured from the stance foot's centre.
    """
    n = len(y) // 2
    place_of = dict.fromkeys(assembly.legs[0], 0) | dict.fromkeys(assembly.legs[1], STANCE)
    if len(assembly.legs[0]) > 1:
        place_of[assembly.legs[0][1]] = 2
    place_of |= {body.name: n - 1 for body in assembly.bodies if body.name not in place_of}
    psi = {name: y[k] + model.slope for name, k in place_of.items()}
    spin = {name: y[n + k] for name, k in place_of.items()}

    def lever(name, at):
        (x, up), s, c = at, np.sin(psi[name]), np.cos(psi[name])
        arm = np.array((c * x - s * up, s * x + c * up))
        return arm, spin[name] * np.array((-arm[1], arm[0]))

    foot = assembly.feet[STANCE]
    arm, turning = lever(foot.body, foot.centre_m)
    origins = {foot.body: (centre - arm, np.array((-model.radius * y[n + STANCE], 0.0)) - turning)}

    def point(name, at):
        arm, turning = lever(name, at)
        return origins[name][0] + arm, origins[name][1] + turning

    while len(origins) < len(assembly.bodies):
        for hinge in assembly.joints:
            ends = [(hinge.parent, hinge.parent_point_m), (hinge.child, hinge.child_point_m)]
            for (known, at), (new, of) in (ends, ends[::-1]):
                if known in origins and new not in origins:
                    (place, velocity), (arm, turning) = point(known, at), lever(new, of)
                    origins[new] = (place - arm, velocity - turning)
    points = [(body.mass_kg, *point(body.name, body.centre_m)) for body in assembly.bodies]
    points += [(each.mass_kg, *point(each.body, each.at_m)) for each in assembly.particles]
    spins = [(body.inertia_kg_m2, spin[body.name]) for body in assembly.bodies]
    return points, spins, point(assembly.feet[0].body, assembly.feet[0].centre_m)[0]


def angular_momentum(points, spins, about):
    turning = sum(m * float((r - about)[0] * v[1] - (r - about)[1] * v[0]) for m, r, v in points)
    return turning + sum(inertia * rate for inertia, rate in spins)


def energy_of(points, spins):
    return 0.5 * sum(m * float(v @ v) for m, _, v in points) + 0.5 * sum(i * rate**2 for i, rate in spins)


def walkers_differ_by(one, other):
    return np.abs(np.subtract(one, other)).max() / (1.0 + np.abs(other).max())


@for_each_type
def test_energy_is_constant_in_a_swing(assembly, slope, free):
    model = rigid_on_slope(assembly, G, slope)
    y, n = state_of(model, BENT, free), len(model.arm_x)
    swing = solve_ivp(
        lambda _, x: (*x[n:], *rates(model, BENT, tuple(x))), (0.0, 0.1), y, "DOP853", rtol=1e-10, atol=1e-12
    )
    energies = [total_energy(model, tuple(x)) for x in swing.y.T]
    scale = abs(kinetic_energy(model, y)) + model.mass * G
    assert max(energies) - min(energies) < 1e-8 * scale


@for_each_type
def test_kinetic_energy_is_the_sum_over_masses(assembly, slope, free):
    model = rigid_on_slope(assembly, G, slope)
    y = state_of(model, BENT, free)
    points, spins, _ = in_motion(assembly, model, y, np.zeros(2))
    assert kinetic_energy(model, y) == pytest.approx(energy_of(points, spins), rel=1e-10, abs=1e-12)


@for_each_type
def test_heel_strike_conserves_angular_momentum_and_gains_no_energy(assembly, slope, free):
    model = rigid_on_slope(assembly, G, slope)
    y = both_feet_down(model, free)
    after = heel_strike(model, y)
    points, spins, foot = in_motion(assembly, model, y, np.zeros(2))
    new_points, new_spins, trailing = in_motion(assembly, model, after, foot)
    assert trailing == pytest.approx(np.zeros(2), abs=1e-12)  # The foot that stood has not moved.
    contact = foot - (0.0, model.radius)
    scale = 1.0 + energy_of(points, spins)
    assert angular_momentum(new_points, new_spins, contact) == pytest.approx(
        angular_momentum(points, spins, contact), abs=1e-9 * scale
    )
    assert energy_of(new_points, new_spins) <= energy_of(points, spins) + 1e-9 * scale


@settings(max_examples=EXAMPLES)
@given(walker=kneed, slope=slopes, free=numbers)
def test_knee_strike_conserves_angular_momentum_and_gains_no_energy(walker, slope, free):
    assembly = assembly_of(walker, rigid=True)
    model = rigid_on_slope(assembly, G, slope)
    y = state_of(model, BENT, (*free[:2], free[0], *free[3:]))
    parts = [in_motion(assembly, model, state, np.zeros(2)) for state in (y, knee_strike(model, y))]
    contact = np.array((0.0, -model.radius))
    before, after = (angular_momentum(points, spins, contact) for points, spins, _ in parts)
    energy, left = (energy_of(points, spins) for points, spins, _ in parts)
    assert after == pytest.approx(before, abs=1e-9 * (1.0 + energy))
    assert left <= energy * (1.0 + 1e-9)


def mapped(assembly: Assembly, place, of_mass=lambda m: m, of_inertia=lambda i: i, of_radius=lambda r: r) -> Assembly:
    """Return the assembly with every point mapped by `place`, and with masses, inertias and radii changed."""
    return replace(
        assembly,
        bodies=tuple(
            replace(
                body,
                mass_kg=of_mass(body.mass_kg),
                centre_m=place(body.name, body.centre_m),
                inertia_kg_m2=of_inertia(body.inertia_kg_m2),
            )
            for body in assembly.bodies
        ),
        joints=tuple(
            replace(
                hinge,
                parent_point_m=place(hinge.parent, hinge.parent_point_m),
                child_point_m=place(hinge.child, hinge.child_point_m),
            )
            for hinge in assembly.joints
        ),
        particles=tuple(
            replace(each, mass_kg=of_mass(each.mass_kg), at_m=place(each.body, each.at_m))
            for each in assembly.particles
        ),
        feet=tuple(
            replace(foot, centre_m=place(foot.body, foot.centre_m), radius_m=of_radius(foot.radius_m))
            for foot in assembly.feet
        ),
    )


@for_each_type
def test_mirrored_walker_moves_as_the_mirror_image(assembly, slope, free):
    model = rigid_on_slope(assembly, G, slope)
    mirror = rigid_on_slope(mapped(assembly, lambda _, at: (-at[0], at[1])), G, -slope)
    y, struck = state_of(model, BENT, free), both_feet_down(model, free)
    image, image_struck = (tuple(-x for x in state) for state in (y, struck))
    assert walkers_differ_by(rates(mirror, BENT, image), -np.array(rates(model, BENT, y))) < 1e-9
    assert walkers_differ_by(heel_strike(mirror, image_struck), -np.array(heel_strike(model, struck))) < 1e-9
    along, normal = ground_reaction(Mode(model, BENT), y)
    assert ground_reaction(Mode(mirror, BENT), image) == pytest.approx((-along, normal), rel=1e-8, abs=1e-7)
    height, apart = swing_foot(model, y)
    assert swing_foot(mirror, image) == pytest.approx((height, -apart), abs=1e-12)


@for_each_type
def test_scaled_copy_of_a_walker_takes_the_same_steps(assembly, slope, free):
    long, heavy = 3.7, 0.2
    model = rigid_on_slope(assembly, G, slope)
    twin = rigid_on_slope(
        mapped(
            assembly,
            lambda _, at: (long * at[0], long * at[1]),
            lambda m: heavy * m,
            lambda i: heavy * long**2 * i,
            lambda r: long * r,
        ),
        G,
        slope,
    )
    n, slow = len(model.arm_x), long**-0.5

    def of_twin(state):
        return (*state[:n], *(slow * x for x in state[n:]))

    y, struck = state_of(model, BENT, free), both_feet_down(model, free)
    found, wanted = rates(twin, BENT, of_twin(y)), np.array(rates(model, BENT, y)) / long
    assert walkers_differ_by(found, wanted) < 1e-9
    assert walkers_differ_by(heel_strike(twin, of_twin(struck)), of_twin(heel_strike(model, struck))) < 1e-9
    force = heavy * np.array(ground_reaction(Mode(model, BENT), y))
    assert ground_reaction(Mode(twin, BENT), of_twin(y)) == pytest.approx(force, rel=1e-8, abs=1e-7)


def by_parts(assembly, radius_m, leg_length_m):
    """Return the assembly in the form of a config of type `parts`."""
    locking = {(knee.thigh, knee.shank) for knee in assembly.knees}
    return PartsWalker(
        type="parts",
        leg_length_m=leg_length_m,
        bodies=[
            {"name": b.name, "mass_kg": b.mass_kg, "centre_m": b.centre_m, "inertia_kg_m2": b.inertia_kg_m2}
            for b in assembly.bodies
        ],
        hinges=[vars(hinge) | {"locks": (hinge.parent, hinge.child) in locking} for hinge in assembly.joints],
        particles=[vars(each) for each in assembly.particles],
        feet=[{"body": foot.body, "centre_m": foot.centre_m, "radius_m": radius_m} for foot in assembly.feet],
        couplings=[vars(each) for each in assembly.couplings],
        legs=[list(leg) for leg in assembly.legs],
    )


@for_each_type
def test_walker_listed_as_parts_moves_like_the_same_walker_given_by_its_type(assembly, slope, free):
    model = rigid_on_slope(assembly, G, slope)
    # Equal bodies of both legs are shifted equally.
    shifts = dict(
        zip(("leg", "thigh", "shank", "torso"), ((0.1, 0.3), (-0.2, 0.1), (0.3, -0.4), (0.0, 0.5)), strict=True)
    )
    moved = mapped(assembly, lambda name, at: tuple(np.add(at, shifts[name.split()[0]])))
    listed = rigid_on_slope(assembly_of(by_parts(moved, model.radius, model.leg_length)), G, slope)
    y, struck = state_of(model, BENT, free), both_feet_down(model, free)
    assert walkers_differ_by(rates(listed, BENT, y), rates(model, BENT, y)) < 1e-9
    assert walkers_differ_by(heel_strike(listed, struck), heel_strike(model, struck)) < 1e-9
    assert ground_reaction(Mode(listed, BENT), y) == pytest.approx(
        ground_reaction(Mode(model, BENT), y), rel=1e-8, abs=1e-7
    )
