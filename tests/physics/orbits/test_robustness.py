"""Compare sensitivity norms, largest steps and rough ground with published values, sums and theory."""

import math
from pathlib import Path

import numpy as np
import pytest
from plain_rigid_walk import plain_walk

from walkerlab.config.loader import load
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.walk_record import rough_heights
from walkerlab.physics.mechanics.impact import push_at_hip
from walkerlab.physics.mechanics.rigid_model import energies, equations, momentum
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.gradients import GAIT_QUANTITIES, gait_quantities, gradients
from walkerlab.physics.orbits.newton import Effort
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS, LONG_WALKS, state_on_section
from walkerlab.physics.orbits.robustness import (
    GaitOnMap,
    derivative,
    indicators,
    largest_disturbance,
    largest_survived,
    rough_walks,
    sensitivity,
    sensitivity_norm,
    steps_on_rough_ground,
    walk_disturbed,
)
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.orbits.step_map import gait_near
from walkerlab.scene.contact import gait_off_pads
from walkerlab.scene.parameter import parameter_of
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.subject import contact_map, rigid_map


def standpoint(name, key="slope_rad", tolerances=EXACT_STEPS, changes=()):
    config = load(Path(name), changes).config
    walker = rigid_walker(config, config.equations)
    _, units = unit_walker(walker)
    z = np.array(find_gaits(walker).gait.state)[walker.section[: walker.coordinates]]
    z[1:] *= units.time
    parameter = parameter_of(key, config)
    step_map, p = rigid_map(config, parameter, 1.0).replace_tolerances(tolerances), parameter.value_in(config)
    return GaitOnMap(step_map, p, z, step_map.step(z, p).DP, units)


def on_compliant_ground(name, key="slope_rad", changes=()):
    """Return the same on the section of the contact model, on ground without pads."""
    config = load(Path(name), changes).config
    rigid = standpoint(name, changes=changes)
    walker = rigid_walker(config, config.equations)
    gait = gait_off_pads(config, 0.3 * walker.leg_length, find_gaits(walker).gait.state).gait
    parameter = parameter_of(key, config)
    step_map, p = contact_map(config, parameter, 1.0, gait.step.length_m), parameter.value_in(config)
    z = step_map.scale_section(gait.z)
    return GaitOnMap(step_map, p, z, step_map.step(z, p).DP, rigid.units)


# ---- the norm ------------------------------------------------------------------------------------------------------


def test_sensitivity_norm_of_the_simplest_walker_agrees_with_two_other_codes():
    """Compare the direct part and the norm of the sensitivity of the step period to a floor drop, for gamma = 0.009 and
    l = g = 1.
    """
    answer = sensitivity(standpoint("simplest"), "floor-drop")
    units = standpoint("simplest").units
    to_pure = units.length / units.time
    assert answer.direct[0] * to_pure == pytest.approx(11.56992214, rel=1e-8)
    assert answer.norm[0] * to_pure == pytest.approx(680.1273, rel=1e-7)


@pytest.mark.parametrize("disturbance", ["floor-drop", "hip-push"])
@pytest.mark.parametrize("name", ["slope-3deg", "kneed", "round-feet", "torso"])
def test_sensitivity_norm_equals_a_brute_force_sum(name, disturbance):
    """Disturb a gait slightly in both directions, and sum over every step of the long walks that follow."""
    at = standpoint(name)
    unit, steps = at.unit_of(disturbance), 60
    walks = {k: walk_disturbed(at, disturbance, k * 1e-5 * unit, steps) for k in (-2, -1, 1, 2)}
    seen = {k: indicators(walk) for k, walk in walks.items()}
    changes = (8.0 * (seen[1] - seen[-1]) - (seen[2] - seen[-2])) / (12e-5 * unit)
    answer = sensitivity(at, disturbance)
    np.testing.assert_allclose(answer.norm, np.sqrt((changes**2).sum(axis=0)), rtol=1e-6)
    np.testing.assert_allclose(answer.direct, changes[0], rtol=1e-7)
    assert (answer.error < 1e-6 * answer.norm).all()


@pytest.mark.parametrize("disturbance", ["floor-drop", "hip-push"])
@pytest.mark.parametrize("name", ["paper", "kneed"])
def test_sensitivity_norm_on_compliant_ground_equals_a_brute_force_sum(name, disturbance):
    """For a kneed walker, difference quotients over more than the penetration would be off by 0.5 %."""
    at = on_compliant_ground(name)
    size, steps = 2e-6 * at.unit_of(disturbance), 40
    either = [indicators(walk_disturbed(at, disturbance, sign * size, steps)) for sign in (1.0, -1.0)]
    changes = (either[0] - either[1]) / (2.0 * size)
    answer = sensitivity(at, disturbance)
    np.testing.assert_allclose(answer.norm, np.sqrt((changes**2).sum(axis=0)), rtol=1e-5)
    np.testing.assert_allclose(answer.direct, changes[0], rtol=1e-5)
    assert (answer.error < 1e-5 * answer.norm).all()


def test_sensitivity_norm_equals_the_summed_response_and_is_absent_if_unstable():
    generator = np.random.default_rng(3)
    for d in (1, 3, 5):
        A = generator.normal(size=(d, d))
        A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
        B, C, D = generator.normal(size=d), generator.normal(size=(2, d)), generator.normal(size=(3, 2))
        total, z = (D**2).sum(axis=0), B
        for _ in range(2000):
            total, z = total + (C @ z) ** 2, A @ z
        np.testing.assert_allclose(sensitivity_norm(A, B, C, D), np.sqrt(total), rtol=1e-10)
        assert sensitivity_norm(A / 0.9 * 1.001, B, C, D) is None


def test_hip_push_keeps_the_foot_fixed_and_acts_along_the_hip_lever():
    """The angular momentum about the foot must grow by exactly the impulse times the height of the hip."""
    at = standpoint("slope-3deg")
    walker = at.step_map._unit_at(at.p).walker
    y = np.array(state_on_section(walker, at.z))
    pushed = push_at_hip(walker, y, 1e-3)
    np.testing.assert_array_equal(pushed[: y.size // 2], y[: y.size // 2])
    # The work of an impulse is that impulse times the mean of the hip velocities before and after.
    height = walker.radius + np.cos(y[1] + walker.slope) * walker.hip_y
    hip_velocity = -0.5 * height * (y[3] + pushed[3])
    assert sum(energies(walker, pushed)) - sum(energies(walker, y)) == pytest.approx(1e-3 * hip_velocity, rel=1e-10)
    assert momentum(walker, pushed)[0] > momentum(walker, y)[0]


def test_hip_push_comes_after_the_release_of_the_trailing_knee():
    """The push turns the free shank, whose angular momentum about the knee is conserved. The expected norm is from an
    independent program.
    """
    at = standpoint("kneed")
    walker = at.step_map._unit_at(at.p).walker
    n, y = len(walker.arm_x), np.array(state_on_section(walker, at.z))
    change = (push_at_hip(walker, y, 1e-3) - y)[n:]
    assert abs(change[walker.shank] - change[walker.thigh]) > 1e-4
    M, r, s, c, F, U = np.zeros((n, n)), *np.zeros((5, n))
    equations(walker, y, s, c, F, U, M, r)
    assert abs(M[walker.shank] @ change) < 1e-15
    in_seconds = sensitivity(at, "hip-push").norm[0]
    assert in_seconds == pytest.approx(0.621718267, rel=1e-8)


# ---- large disturbances --------------------------------------------------------------------------------------------


def test_largest_drops_at_three_degrees_match_the_known_values():
    at = standpoint("slope-3deg", tolerances=LONG_WALKS)
    down, up = (largest_disturbance(at, "floor-drop", sign, 50) for sign in (1.0, -1.0))
    assert down == pytest.approx(14.37e-3, rel=5e-3)
    assert up == pytest.approx(5.98e-3, rel=5e-3)


def test_largest_disturbance_is_below_the_first_failing_one():
    assert largest_survived(lambda size: size < 0.0123456 or size > 0.02, 1.0) == pytest.approx(0.0123456, abs=1e-6)
    assert largest_survived(lambda size: True, 2.0) == 1.0


def test_compass_takes_the_known_number_of_steps_on_rough_ground():
    """2 mm at 3 degrees: 18.4 steps."""
    at = standpoint("slope-3deg", tolerances=LONG_WALKS)
    seen = rough_walks(np.array([steps_on_rough_ground(at, 2e-3, (0, walk), 5000) for walk in range(200)]), 5000)
    assert seen.method == "all-failed"
    assert abs(seen.mean_steps - 18.4) < 4.0 * math.hypot(seen.standard_error, 0.7)


def test_foot_that_lands_too_close_ends_a_walk_on_rough_ground():
    """For the level compass and 1 mm, a library's integrator shows that the foot lands too close after the sixth step
    of the fourth walk.
    """
    at = standpoint("level")
    walker, units = at.step_map._unit_at(at.p)[:2]
    length = at.step_map.step(at.z, at.p).length_m / units.length
    heights = rough_heights(1e-3, (0, 3), 8) / units.length
    plain, outcome, ahead = plain_walk(walker, np.array(state_on_section(walker, at.z)), heights, 0.25 * length)
    assert outcome is Outcome.FELL
    assert 0.0 < ahead[-1] < 0.25 * length < min(ahead[:-1])
    assert steps_on_rough_ground(at, 1e-3, (0, 3), 8) == len(plain) == 6


def rimless_wheel(deviation_deg, walks, most, seed=0):
    """Count the steps of the rimless wheel of Byl and Tedrake (2009) on random slopes, with alpha = pi/8 and a mean
    slope of 8 deg.
    """
    generator, alpha, ratio = np.random.default_rng(seed), np.pi / 8, 9.8
    slope = np.deg2rad(8.0)
    steps, alive = np.zeros(walks), np.ones(walks, bool)
    squared = np.full(walks, 2.0)
    for _ in range(most):
        gamma = slope + np.deg2rad(deviation_deg) * generator.normal(size=walks)
        squared = np.cos(2 * alpha) ** 2 * (squared + 2 * ratio * (1 - np.cos(alpha + gamma))) - 2 * ratio * (
            1 - np.cos(alpha - gamma)
        )
        alive &= squared >= 0.0
        squared = np.maximum(squared, 0.0)
        steps += alive
    return steps


@pytest.mark.parametrize(("deviation", "mean"), [(2.5, 412.0), (3.0, 114.0)])
def test_rimless_wheel_takes_the_published_mean_number_of_steps(deviation, mean):
    """Byl and Tedrake, Metastable walking machines, IJRR 28 (2009), by the recomputed map."""
    for most, method in ((20_000, "all-failed"), (round(mean), "censored")):
        seen = rough_walks(rimless_wheel(deviation, 4000, most), most)
        assert seen.method == method
        assert abs(seen.mean_steps - mean) < 4.0 * seen.standard_error + 0.01 * mean


def expected_steps(deviation_deg, cells=300):
    """Return the expected number of steps until the wheel fails, from the second eigenvalue of the transition matrix
    between cells of its squared rate.
    """
    alpha, ratio = np.pi / 8, 9.8
    slope = np.deg2rad(8.0 + deviation_deg * np.linspace(-6.0, 6.0, 601))
    weight = np.exp(-0.5 * np.linspace(-6.0, 6.0, 601) ** 2)
    fastest = 2.5
    squared = np.linspace(0.0, fastest, cells) ** 2
    ahead = np.cos(2 * alpha) ** 2 * (squared[:, None] + 2 * ratio * (1 - np.cos(alpha + slope))) - 2 * ratio * (
        1 - np.cos(alpha - slope)
    )
    place = np.minimum(np.sqrt(np.maximum(ahead, 0.0)) / fastest * (cells - 1), cells - 1.0 - 1e-9)
    below, share = np.floor(place).astype(int), place % 1.0
    going = np.where(ahead >= 0.0, weight / weight.sum(), 0.0)
    transition = np.zeros((cells, cells))
    rows = np.broadcast_to(np.arange(cells)[:, None], place.shape)
    np.add.at(transition, (rows, below), going * (1.0 - share))
    np.add.at(transition, (rows, below + 1), going * share)
    return 1.0 / (1.0 - np.abs(np.linalg.eigvals(transition)).max())


@pytest.mark.parametrize(("deviation", "mean"), [(1.5, 6.54e5), (2.0, 4324.0), (2.5, 412.0), (3.0, 114.0)])
def test_mean_steps_of_the_rimless_wheel_follow_from_the_second_eigenvalue(deviation, mean):
    """Failure is absorbing and has the eigenvalue 1. The next eigenvalue says how long the wheel goes on."""
    assert expected_steps(deviation) == pytest.approx(mean, rel=0.01)


def test_unfinished_walks_give_a_lower_bound_of_the_mean():
    seen = rough_walks(np.full(20, 100.0), 100)
    assert (seen.method, seen.mean_steps, seen.standard_error, seen.capped) == ("lower-bound", 2000.0, None, 20)


# ---- gradients -----------------------------------------------------------------------------------------------------

KEYS = {"slope-3deg": ("slope_rad", "walker.hip_mass_kg", "gravity_m_s2"), "kneed": ("walker.shank.mass_below_knee_m",)}


@pytest.mark.parametrize(("name", "key"), [(name, key) for name, keys in KEYS.items() for key in keys])
def test_gradients_equal_differences_of_converged_gaits(name, key):
    at = standpoint(name, key)
    found = gradients(at, abs(at.p))

    def numbers_at(off):
        p = at.p + off
        gait = gait_near(at.step_map, at.z, p, Effort(1e-12))
        numbers = gait_quantities(at._replace(p=p, z=gait.z, A=gait.DP))
        return np.array([numbers[one] for one in GAIT_QUANTITIES])

    by_difference, sizes = derivative(numbers_at, 3e-3 * abs(at.p)), gait_quantities(at)
    for one, expected in zip(GAIT_QUANTITIES, by_difference, strict=True):
        # Rounding of a difference is proportional to the quantity. Where the derivative is zero, only rounding is left.
        rounding = 1e-9 * max(1.0, sizes[one])
        assert found[one].value == pytest.approx(expected, rel=1e-6, abs=rounding), one
        assert found[one].error < 1e-5 * abs(expected) + rounding


@pytest.mark.parametrize(("name", "key"), [("paper", "walker.foot_to_mass_m"), ("kneed", "walker.hip_mass_kg")])
def test_gradients_on_compliant_ground_equal_differences_of_converged_gaits(name, key):
    """This includes parameters whose change lifts a foot into the air, or pushes it in by millimetres, if section
    coordinates are kept.
    """
    at = on_compliant_ground(name, key)
    wanted = ("period_s", "step_length_m", "speed_m_s", "spectral_radius")
    found = gradients(at, abs(at.p), wanted)
    near, step = 3e-5 * abs(at.p), 3e-3 * abs(at.p)
    along = (gait_near(at.step_map, at.z, at.p + near, Effort(1e-11)).z - at.z) / near

    def numbers_at(off):
        gait = gait_near(at.step_map, at.z + off * along, at.p + off, Effort(1e-11))
        numbers = gait_quantities(at._replace(p=at.p + off, z=gait.z, A=gait.DP), wanted)
        return np.array([numbers[one] for one in wanted])

    for one, expected in zip(wanted, derivative(numbers_at, step), strict=True):
        bound = 4.0 * found[one].error + 1e-6 * abs(expected)
        assert abs(found[one].value - expected) < bound < 1e-2 * abs(expected), one


def test_passive_cost_of_transport_on_compliant_ground_is_the_slope():
    at = on_compliant_ground("kneed")
    assert gait_quantities(at, ("cost_of_transport",))["cost_of_transport"] == pytest.approx(math.sin(at.p), rel=1e-9)


def test_gravity_only_rescales_time():
    at = standpoint("slope-3deg", "gravity_m_s2")
    numbers, found = gait_quantities(at), gradients(at, at.p)
    of_itself = {one: found[one].value * at.p / numbers[one] for one in GAIT_QUANTITIES}
    expected = {"period_s": -0.5, "step_length_m": 0.0, "speed_m_s": 0.5, "spectral_radius": 0.0}
    for one, power in expected.items():
        assert of_itself[one] == pytest.approx(power, abs=1e-7), one
    assert of_itself["gait_sensitivity_norm"] == pytest.approx(-0.5, abs=1e-6)


def test_difference_quotient_has_order_four_and_is_one_sided_at_a_bound():
    for wall in (-np.inf, -1e-12):
        off = [
            derivative(lambda x, wall=wall: np.array([math.exp(x)]) if x > wall else None, h)[0] - 1.0
            for h in (1e-2, 2e-2)
        ]
        assert abs(off[0]) < 3e-8
        assert off[1] == pytest.approx(16.0 * off[0], rel=0.1)
    assert derivative(lambda x: None, 1e-2) is None


def test_failed_walk_ends_early_and_is_reported_as_a_fall():
    at = standpoint("slope-3deg")
    walk = walk_disturbed(at, "floor-drop", 0.2, 3)
    assert walk.outcome is Outcome.FELL
    assert walk.durations_s.size < 3


def test_gradient_uses_a_difference_step_that_keeps_the_error_small():
    """With twice the usual step, the hip mass would leave the range over which the gait of the level compass changes
    smoothly.
    """
    at = on_compliant_ground("level", "walker.hip_mass_kg", ("contact.terrain=after-mid-swing",))
    found = gradients(at, abs(at.p), ("period_s",))["period_s"]
    assert not found.why
    assert found.value == pytest.approx(0.00922006, abs=2e-8)
    assert found.error < 1e-4 * found.value
