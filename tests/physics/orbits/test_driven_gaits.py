"""Tests of driven gaits: published ones, gaits on the level, and passive gaits changed by torques."""

import math
from pathlib import Path

import numpy as np
import pytest
from rigid_physics import heel_strike, potential_energy, rates, torque_work_of_a_step
from scipy.integrate import solve_ivp
from test_step_derivatives import AGREEMENT, NEAR_THE_GAIT, RIGID_STEP, STEPS, slope_of, stepped

from walkerlab.config import loader
from walkerlab.physics.hybrid.recorded_walk import scale_rates, take_walk
from walkerlab.physics.mechanics.impact import push_off_work
from walkerlab.physics.mechanics.rigid_model import STANCE, STRAIGHT, SWING, change_slope, kinetic_energy
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.gradients import gradients
from walkerlab.physics.orbits.newton import Effort
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS, RigidMap, RigidStepper, coordinates_of, strike_section
from walkerlab.physics.orbits.robustness import GaitOnMap
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.orbits.step_map import gait_near
from walkerlab.scene.contact import contact_scene
from walkerlab.scene.rigid import rigid_walker


def walker_of(name, **drives):
    """Return a built-in walker with some parameters changed."""
    config = loader.load(Path(name)).config
    return rigid_walker(config, config.equations).changed(**drives)


# Kuo (2002), recomputed by a complex-step code: push-off over hip mass, spring over (foot mass l^2), slope; stance
# angle from the normal and its rate just after the strike, period, multipliers.
KUO = {
    "normal": (
        (0.1877, 2.5127, 0.0), (0.355459547231, -0.505619296924, 1.740269471592),
        (0.8467907426 + 0.1104214821j, 0.8467907426 - 0.1104214821j),
    ),
    "slow": (
        (0.04, 0.0, 0.0), (0.194588844511, -0.202960538673, 3.827812909213),
        (0.2801872273 + 0.6233069519j, 0.2801872273 - 0.6233069519j),
    ),
    "weak": (
        (0.001, 0.125, 0.0), (0.030700474348, -0.032562552483, 3.525040599575), (0.9647881696, 0.5330053778)
    ),
    "passive": (
        (0.0, 0.0, 0.009), (0.200310900544, -0.199832473005, 3.882463752851),
        (-0.1900998411 + 0.5575987767j, -0.1900998411 - 0.5575987767j),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", KUO)
def test_gaits_of_kuo_are_reproduced(name):
    (push, spring, slope), (angle, rate, period), multipliers = KUO[name]
    simplest = walker_of("simplest", push_off=push)
    foot_mass = float(simplest.A[SWING, SWING])
    walker = change_slope(simplest.changed(hip=(spring * foot_mass, 0.0, 0.0)), slope)
    gait = min(find_gaits(walker).gaits, key=lambda each: abs(each.period - period))
    assert gait.state[STANCE] + slope == pytest.approx(angle, abs=1e-9)
    assert gait.state[2 + STANCE] == pytest.approx(rate, abs=1e-9)
    assert gait.period == pytest.approx(period, abs=1e-9)
    assert gait.multipliers[:2] == pytest.approx(multipliers, abs=1e-9)


LEVEL = (-0.1931536892, 0.1931536892, -0.8881910818, -1.0417279402)


def test_paper_compass_walks_on_level_ground():
    """The push-off is 4 N s, and a spring of 10 N m/rad joins the legs. The expected values are those of an independent
    prototype.
    """
    walker = change_slope(walker_of("paper", push_off=4.0, hip=(10.0, 0.0, 0.0)), 0.0)
    gait = find_gaits(walker).gait
    assert gait.stable
    assert gait.state == pytest.approx(LEVEL, abs=1e-9)
    assert (gait.period, gait.step_length) == pytest.approx((0.5791508912, 0.3839097737), abs=1e-9)


DRIVEN = {
    "torso": {"push_off": 4.0, "hip": (0.0, 0.005, 0.0)},
    "round-feet": {"push_off": 0.12, "hip": (0.3, 0.0, 0.0)},
    "kneed": {"push_off": 0.2, "hip": (0.0, 0.005, 0.15)},
    "kneed-round-feet": {"push_off": 0.2, "hip": (0.0, 0.0, 0.15)},
}


@pytest.mark.parametrize("name", DRIVEN)
def test_derivative_of_a_driven_step_map_equals_finite_differences(name):
    walker, _ = unit_walker(change_slope(walker_of(name, **DRIVEN[name]), 0.0))
    gait = find_gaits(walker).gait
    shooting, section = RigidStepper(walker, EXACT_STEPS), strike_section(walker)
    z = coordinates_of(walker, gait.state)
    DP = shooting.walk(section, z).DP[0]
    differences = slope_of(lambda z: shooting.walk(section, z).z[0], z, [5e-4] * z.size)
    np.testing.assert_allclose(DP, differences, rtol=0.0, atol=AGREEMENT)


NEAR = 0.03  # push-off over m sqrt(g L) with which most walkers have a level gait


@pytest.mark.parametrize("name", ["paper", "rigid-only", "contact-si", "torso", "round-feet", "simplest"])
def test_push_off_gives_a_stable_gait_on_level_ground(name):
    walker = change_slope(walker_of(name), 0.0)
    gait = find_gaits(walker.changed(push_off=NEAR * unit_walker(walker)[1].impulse)).gait
    assert gait.stable
    assert not gait.objections


@pytest.mark.parametrize("slope", [0.0, -0.1])
def test_gravity_shaping_torques_give_the_passive_gait_on_any_slope(slope):
    """This is controlled symmetry (Spong, Bullo 2005)."""
    passive = walker_of("paper")
    gait, turned = find_gaits(passive).gait, change_slope(passive, slope)
    lean = slope - passive.slope
    h, unit = 1e-4, np.eye(2)

    def pull(model, theta, k):
        ends = [potential_energy(model, (*(theta + sign * h * unit[k]), 0.0, 0.0)) for sign in (1.0, -1.0)]
        return (ends[0] - ends[1]) / (2.0 * h)

    def rate(_, x):
        theta = x[:2]
        torques = [pull(turned, theta, k) - pull(passive, theta + lean, k) for k in range(2)]
        both = [kinetic_energy(turned, (*theta, *w)) for w in (unit[0], unit[1], unit[0] + unit[1])]
        M = [[2.0 * both[0], both[2] - both[0] - both[1]], [both[2] - both[0] - both[1], 2.0 * both[1]]]
        return (*x[2:], *(np.array(rates(turned, STRAIGHT, tuple(x))) + np.linalg.solve(M, torques)))

    start = np.array(gait.state) - (lean, lean, 0.0, 0.0)
    swing = solve_ivp(rate, (0.0, gait.period), start, "DOP853", rtol=1e-11, atol=1e-12)
    assert heel_strike(turned, swing.y[:, -1]) == pytest.approx(start, abs=1e-6)
    assert math.fsum(swing.y[:2, -1]) == pytest.approx(-2.0 * slope, abs=1e-6)


@pytest.mark.parametrize("name", ["paper", "round-feet", "torso", "kneed", "kneed-round-feet", "simplest"])
def test_cost_of_transport_of_a_passive_gait_is_the_sine_of_the_slope(name):
    walker = walker_of(name)
    gait = find_gaits(walker).gait
    assert gait.cost_of_transport == pytest.approx(math.sin(walker.slope), rel=1e-10)
    assert gait.work["gravity"] > gait.work["push_off"] == gait.work["hip"] == 0.0


def test_parameter_value_without_a_walker_has_no_cost_of_transport():
    walker = walker_of("paper")
    step_map = RigidMap(lambda _: None, 1.0, walker)
    assert step_map.cost_of_transport(np.array(find_gaits(walker).gait.z), 0.0) is None


def test_push_off_of_kuos_walker_costs_impulse_squared_over_twice_its_mass():
    """In Kuo (2002) the push-off comes before the strike and, as the legs have no mass, moves only the hip."""
    config = loader.load(Path("kuo")).config
    gait = find_gaits(rigid_walker(config)).gait
    assert gait.work["push_off"] == pytest.approx(0.0176156, abs=5e-8)
    assert gait.work["push_off"] == pytest.approx(0.5 * 0.1877**2, rel=1e-11)
    assert gait.cost_of_transport == pytest.approx(0.0253083, abs=5e-8)


def test_work_against_gravity_uphill_is_not_counted_as_input():
    walker = change_slope(walker_of("paper", push_off=4.0), -0.005)
    walk = take_walk(walker, EXACT_STEPS, find_gaits(walker).gait.state, 2)
    assert walk.driven.gravity < 0.0
    spent = walk.driven.push_off / (walk.driven.weight * walk.touch_along_m[-1])
    assert walk.driven.cost_of_transport(walk.touch_along_m[-1]) == pytest.approx(spent, rel=1e-12)


GIVERS = ("gravity", "push_off", "hip")
DRIVES = {**DRIVEN, "paper": {"push_off": 4.0, "hip": (10.0, 0.0, 0.3)}}


@pytest.mark.parametrize("name", DRIVES)
def test_energies_of_a_driven_walk_balance(name):
    """Heel strikes take as much energy as a step is given, and a spring returns what it has stored."""
    walker = change_slope(walker_of(name, **DRIVES[name]), 0.0)
    gait = find_gaits(walker).gait
    weight = walker.mass * walker.gravity * walker.leg_length
    walk = take_walk(walker, EXACT_STEPS, gait.state, 4)
    assert walk.energy_balance_residual < 1e-11 * weight
    assert sum(gait.work[name] for name in GIVERS) == pytest.approx(walk.lost_in_strikes / 4, rel=1e-9)
    off = scale_rates(walker, gait.state, 1.01, 1.02)
    assert take_walk(walker, EXACT_STEPS, off, 2).energy_balance_residual < 1e-11 * weight


def test_hip_damper_dissipates_the_integral_of_its_power():
    walker = change_slope(walker_of("paper", push_off=4.0, hip=(10.0, 0.1, 0.0)), 0.0)
    walk = take_walk(walker, EXACT_STEPS, LEVEL, 1, sampled=True)
    y, t = walk.samples.state[:-1], walk.samples.time_s[:-1]
    spring = 5.0 * float(np.diff((y[[-1, 0], 0] - y[[-1, 0], 1]) ** 2)[0])
    damper = -np.trapezoid(0.1 * (y[:, 2] - y[:, 3]) ** 2, t)
    assert walk.driven.hip - spring == pytest.approx(damper, rel=1e-3)


TURNED = {
    "paper": {"push_off": 4.0, "hip": (10.0, 0.0, 0.3)},
    "kneed": {"push_off": 0.2, "hip": (2.0, 0.0, 0.3)},
    "kneed-round-feet": {"push_off": 0.2, "hip": (0.0, 0.0, 0.15)},
}


@pytest.mark.parametrize("name", TURNED)
def test_positive_work_of_a_hip_torque_is_the_integral_of_positive_power(name):
    """Late in the swing the legs turn back. In a kneed walker the knee strike reverses the relative rate of the thighs
    at once.
    """
    walker = change_slope(walker_of(name, **TURNED[name]), 0.0)
    start = find_gaits(walker).gait.state
    net, positive = torque_work_of_a_step(walker, start, take_walk(walker, EXACT_STEPS, start, 1))
    assert positive > net + 1e-3 * abs(net)
    for steps in (1, 2, 4, 10):
        driven = take_walk(walker, EXACT_STEPS, start, steps).driven
        assert driven.hip_torque / steps == pytest.approx(net, rel=1e-8)
        assert driven.hip_torque_positive / steps == pytest.approx(positive, rel=1e-7)
    assert driven.hip_torque == pytest.approx(driven.hip, rel=1e-9)


def test_cost_derivative_across_a_knee_strike_equals_a_difference_quotient():
    """The parameter is the stiffness of the hip spring, and the knee strike reverses the relative rate of the
    thighs.
    """

    def driven(spring):
        return change_slope(walker_of("kneed", push_off=0.2, hip=(spring, 0.0, 0.3)), 0.0)

    def cost(spring):
        walker = driven(spring)
        start = find_gaits(walker).gait.state
        step = take_walk(walker, EXACT_STEPS, start, 1)
        _, positive = torque_work_of_a_step(walker, start, step)
        return (push_off_work(walker, step.before)[0] + positive) / (walker.mass * walker.gravity * step.lengths_m[0])

    step_map = RigidMap(driven, 1.0, driven(2.0))
    gait = gait_near(step_map, np.array(find_gaits(driven(2.0)).gait.z), 2.0, Effort(1e-13))
    at = GaitOnMap(step_map, 2.0, gait.z, gait.DP, unit_walker(driven(2.0))[1])
    found = gradients(at, 2.0, ["cost_of_transport"])["cost_of_transport"]
    slope = (cost(2.02) - cost(1.98)) / 0.04
    assert found.value == pytest.approx(slope, rel=1e-3)
    assert found.error < 1e-3 * abs(found.value)


HIP = ("walker.hip.spring_N_m_per_rad=10", "walker.hip.damping_N_m_s_per_rad=0.4", "walker.hip.torque_N_m=1.5")


def test_contact_step_derivative_includes_the_switch_of_the_driven_leg_at_touch():
    """At a touch the torque moves from one leg to the other. If the derivative ignored this, the third digit would be
    wrong.
    """
    config = loader.load(Path("paper"), ["slope_deg=0.9", *HIP]).config
    scene = contact_scene(config, RIGID_STEP, RIGID_STEP)
    slope = slope_of(lambda z: stepped(scene, z, 1e-12).z, NEAR_THE_GAIT, STEPS)
    found = stepped(scene, NEAR_THE_GAIT, 1e-12).DP
    np.testing.assert_allclose(found, slope, rtol=0.0, atol=AGREEMENT)


def test_excessive_drive_is_not_reported_as_a_missing_drive():
    walker = walker_of("paper", hip=(0.0, 0.0, 1e8))
    assert "the passive gait at 0.0174 rad is lost at 0% of the way" in find_gaits(walker).reason
