"""Check gaits of published walkers to the digits on which independent computations agree."""

import math

import numpy as np
import pytest

from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.newton import Effort
from walkerlab.physics.orbits.rigid_map import RigidMap, RigidStepper, state_on_section, strike_section
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.orbits.step_map import gait_near
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.parts import Arc, Limb, add_torso, kneed_legs, straight_legs

ROUND_FEET = straight_legs(Limb(0.4, 1.0, 0.1, 0.0, 0.01), 0.0, Arc(0.1))
MCGEER = straight_legs(Limb(1.0, 1.0, 0.37, 0.0, 0.32**2), 0.0, Arc(0.3))
SIMPLEST = straight_legs(Limb(1.0, 1e-12, 1.0), 1.0, Arc())
HSU_CHEN = kneed_legs(Limb(0.5, 0.5, 0.325), Limb(0.5, 0.05, 0.125), 0.5, Arc())
# parts, slope, gravity; stance angle from the slope's normal, rates of stance and swing leg; period; multipliers.
# Wisse (2003), MATLAB files; McGeer (1990), section 5; Garcia et al. (1998); Hsu Chen (2007). Digits are recomputed by
# two independent routes. Those that Hsu Chen prints (0.2381, -1.1014, -0.0399) are wrong in the third decimal.
PUBLISHED = {
    "round feet": (
        ROUND_FEET, 0.01, 9.81, (0.2015446889, -1.4051631609, -1.1204588165), 0.450270, (0.65445, 0.21718 + 0.30366j)
    ),
    "McGeer's round feet": (MCGEER, 0.03, 1.0, (0.3084354, -0.4031041, -0.2806883), 2.636366, ()),
    "kneed": (
        HSU_CHEN, 0.0504, 9.81, (0.2385854603, -1.1095873312, -0.0571481063), 0.564328, (0.35257 + 0.55221j, 0.14382)
    ),
    "simplest, long": (
        SIMPLEST, 0.009, 1.0, (0.200310900544, -0.199832473005, None), 3.882464, (-0.1900998 + 0.5575988j,)
    ),
    "simplest, short": (SIMPLEST, 0.009, 1.0, (0.193937369810, -0.203866927442, None), 3.096106, (4.003864, 0.459590)),
}  # fmt: skip


TIGHT = Tolerances("dop853", 1e-13, 1e-16, 10**6)


def solved(model, z):
    """Return the gait near z, in SI units, and its cycle."""
    scale = np.array([1.0, *[unit_walker(model)[1].time] * (z.size - 1)])
    found = gait_near(RigidMap(lambda _: model, 1.0, model, TIGHT), z * scale, 0.0, Effort(1e-13))
    return found.z / scale, found


@pytest.mark.parametrize("name", PUBLISHED)
def test_gait_of_a_published_walker_is_reproduced(name):
    parts, slope, gravity, (angle, stance, swing), period, multipliers = PUBLISHED[name]
    # The angular momentum of the trailing foot about the hip is lost.
    massless = stance * (1.0 - math.cos(2.0 * angle))
    z, gait = solved(
        rigid_on_slope(parts, gravity, slope), np.array([angle - slope, massless if swing is None else swing, stance])
    )
    assert gait.residual < 1e-12
    assert z[0] + slope == pytest.approx(angle, abs=2e-7)
    assert z[2] == pytest.approx(stance, abs=2e-7)
    if swing is not None:
        assert z[1] == pytest.approx(swing, abs=2e-7)
    assert gait.period_s == pytest.approx(period, abs=1e-6)
    eigenvalues = np.linalg.eigvals(gait.DP)
    for wanted in multipliers:
        assert np.abs(eigenvalues - wanted).min() < 1e-5


def test_knee_strike_comes_at_the_published_time():
    parts, slope, gravity, (angle, stance, swing), *_ = PUBLISHED["kneed"]
    model = rigid_on_slope(parts, gravity, slope)
    z, _ = solved(model, np.array([angle - slope, swing, stance]))
    walk = take_walk(model, Tolerances("dop853", 1e-12, 1e-14, 10**6), state_on_section(model, z), 3, sampled=True)
    assert walk.outcome is Outcome.WALKED
    assert walk.knee_strike_time_s[0] == pytest.approx(0.348612, abs=1e-6)
    assert walk.energy_drift < 1e-10
    knee = walk.samples.state[:, 2] - walk.samples.state[:, 0]
    assert knee[walk.samples.bent].min() < -0.1
    assert np.abs(knee[~walk.samples.bent]).max() < 1e-12


@pytest.mark.parametrize("at_strike", ["locked", "free"])
def test_step_derivative_through_the_knee_strike_equals_finite_differences(at_strike):
    model = rigid_on_slope(HSU_CHEN, 9.81, 0.0504, at_strike == "locked")
    shooting = RigidStepper(model, TIGHT)
    z = np.array([0.1881, -0.06, -1.11, -0.06])[: len(model.section_indices)]
    DP, h = shooting.walk(strike_section(model), z).DP[0], 1e-4

    def ahead(offset):
        return shooting.walk(strike_section(model), z + offset).z[0]

    for j, e in enumerate(np.eye(z.size)):
        slope = (8 * (ahead(h * e) - ahead(-h * e)) - (ahead(2 * h * e) - ahead(-2 * h * e))) / (12 * h)
        assert DP[:, j] == pytest.approx(slope, abs=1e-8)


def test_kneed_gait_is_found_without_a_guess():
    search = find_gaits(rigid_on_slope(HSU_CHEN, 9.81, 0.0504))
    assert search.gait is not None
    assert search.gait.state[1] + 0.0504 == pytest.approx(0.2385854603, abs=1e-8)
    assert search.gait.knee_strike == pytest.approx(0.348612, abs=1e-6)


def test_round_footed_gait_is_found_from_small_slopes():
    search = find_gaits(rigid_on_slope(ROUND_FEET, 9.81, 0.01))
    assert search.gait is not None
    assert search.gait.period == pytest.approx(0.450270, abs=1e-6)
    assert any("seed" in by for by in search.gait.found_by)


def test_gait_with_a_light_torso_differs_from_the_compass_gait_in_proportion_to_its_mass():
    compass = find_gaits(rigid_on_slope(straight_legs(Limb(1.0, 5.0, 0.5), 10.0, Arc()), 9.81, 0.0174)).gait
    errors = []
    for mass in (1e-2, 1e-3):
        parts = add_torso(straight_legs(Limb(1.0, 5.0, 0.5), 10.0, Arc()), mass, 0.3, 0.0)
        errors.append(abs(find_gaits(rigid_on_slope(parts, 9.81, 0.0174)).gait.period - compass.period))
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)
