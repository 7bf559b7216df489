"""Tests of gaits that are hard to find, and of the messages if a search finds none."""

import math

import numpy as np
import pytest
from kneed_by_hand import step, walker_of
from scipy.optimize import fsolve

from walkerlab.config.walkers import Kneed, Torso
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.orbits.fixed_point import MAX_START, MIN_START, SEARCH_TOLERANCES, SearchSettings, find_gaits
from walkerlab.physics.orbits.rigid_map import state_on_section
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.scene.parts import assembly_of

THIGH = {"length_m": 0.5998, "mass_kg": 4.9813, "mass_below_hip_m": 0.36521, "inertia_kg_m2": 0.022104}
SHANK = {"length_m": 0.692, "mass_kg": 0.61014, "mass_below_knee_m": 0.15598, "mass_ahead_m": -0.0016492}
TORSO = {"mass_kg": 6.9449, "above_hip_m": 0.42608}
HIP_MASS, GRAVITY, SLOPE = 5.8002, 8.06, math.radians(3.2811)
STARTS = 3


def with_torso():
    """Return a walker whose only known gait is unstable, and for which few starts lead to walking."""
    walker = Kneed(type="kneed", thigh=THIGH, shank=SHANK, hip_mass_kg=HIP_MASS, torso=Torso(**TORSO))
    return rigid_on_slope(assembly_of(walker, rigid=True), GRAVITY, SLOPE)


def by_hand():
    thigh = (*(THIGH[key] for key in ("length_m", "mass_kg", "mass_below_hip_m")), 0.0, THIGH["inertia_kg_m2"])
    shank = (*(SHANK[key] for key in ("length_m", "mass_kg", "mass_below_knee_m", "mass_ahead_m")), 0.0)
    return walker_of(thigh, shank, HIP_MASS, (*TORSO.values(), 0.0), GRAVITY, SLOPE)


@pytest.fixture(scope="module")
def found():
    return find_gaits(with_torso())


def test_unstable_gait_is_found_even_if_few_starts_walk(found):
    (gait,) = found.gaits
    assert not gait.stable
    assert gait.spectral_radius == pytest.approx(3.664, abs=5e-4)
    # recomputed independently: stance angle from the slope's normal, rates of stance and swing leg
    assert gait.state[1] + SLOPE == pytest.approx(0.3604678333, abs=1e-9)
    assert gait.state[5] == pytest.approx(-0.8207701664, abs=1e-9)
    assert gait.state[4] == pytest.approx(-0.4820404150, abs=1e-9)
    assert gait.period == pytest.approx(1.3290071109, abs=1e-9)


def test_more_starts_are_drawn_only_if_the_first_find_nothing():
    few, enough = (find_gaits(with_torso(), settings=SearchSettings(random_starts=count)) for count in (2, 100))
    assert len(few.gaits) == len(enough.gaits) == 1
    assert (few.random_starts, enough.random_starts) == (1002, 100)


def test_random_starts_with_an_independent_integration_find_the_same_gait(found):
    walker, gait = by_hand(), found.gaits[0]
    z = np.array([gait.state[1], gait.state[4], gait.state[5]])
    generator = np.random.default_rng(0)
    for _ in range(STARTS):
        start = z * (1.0 + 0.01 * generator.uniform(-1.0, 1.0, 3))
        solved = fsolve(lambda z: step(walker, z)[0] - z, start, xtol=1e-11)
        # the tolerance of the integration, magnified by solving for the gait
        np.testing.assert_allclose(solved, z, atol=1e-8)
    after, period, knee = step(walker, z)
    np.testing.assert_allclose(after, z, atol=1e-8)
    assert (period, knee) == pytest.approx((gait.period, gait.knee_strike), abs=1e-8)


def test_point_foot_ahead_of_the_shank_agrees_with_an_independent_integration():
    slope, ahead, torso = math.radians(2.5), 0.03, (1.0, 0.4, 0.01)
    walker = Kneed(
        type="kneed",
        thigh={"length_m": 0.46, "mass_kg": 2.345, "mass_below_hip_m": 0.2, "inertia_kg_m2": 0.02},
        shank={"length_m": 0.54, "mass_kg": 1.013, "mass_below_knee_m": 0.24, "inertia_kg_m2": 0.03},
        hip_mass_kg=10.0,
        torso=Torso(**dict(zip(("mass_kg", "above_hip_m", "inertia_kg_m2"), torso, strict=True))),
        foot_centre_ahead_m=ahead,
    )
    found = find_gaits(rigid_on_slope(assembly_of(walker, rigid=True), 9.81, slope)).gaits
    hand = walker_of(
        (0.46, 2.345, 0.2, 0.0, 0.02), (0.54, 1.013, 0.24, 0.0, 0.03), 10.0, torso, 9.81, slope, ahead
    )  # fmt: skip
    assert found
    for gait in found:
        z = np.array([gait.state[1], gait.state[4], gait.state[5]])
        after, period, knee = step(hand, z)
        np.testing.assert_allclose(after, z, atol=1e-8)
        assert (period, knee) == pytest.approx((gait.period, gait.knee_strike), abs=1e-8)
        assert gait.step_length == pytest.approx(2.0 * math.hypot(1.0, ahead) * math.sin(z[0] + slope + hand.lean))


def test_rounding_does_not_lock_a_knee_released_into_extension(found):
    walker, _ = unit_walker(with_torso())
    starts = np.random.default_rng(1).uniform(MIN_START[:3], MAX_START[:3], (2000, 3))
    starts[:, 0] = 0.5 * starts[:, 0] - walker.slope
    walked = 0
    for z in starts:
        walk = take_walk(walker, SEARCH_TOLERANCES, state_on_section(walker, z), 1)
        if walk.steps:
            walked += 1
            # A swing takes about a pendulum time, and rounding is about 1e-13 of it.
            assert walk.knee_strike_time_s[0] > 1e-3
    assert walked > 10
