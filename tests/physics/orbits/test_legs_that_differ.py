"""Check gaits of walkers whose legs differ with a plain integration of both swings."""

from dataclasses import replace

import numpy as np
import pytest
from plain_unequal_walk import Leg, Segment, Walker
from unequal_walkers import KINDS, draw_walker, legs_of, model_of

from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.mechanics.hinges import HIP_ROW
from walkerlab.physics.mechanics.rigid_model import change_slope, pair
from walkerlab.physics.orbits.fixed_point import SearchSettings, average_legs, find_gaits
from walkerlab.physics.orbits.gradients import gait_quantities, gradients
from walkerlab.physics.orbits.newton import Effort
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS, RigidMap, states_on_section
from walkerlab.physics.orbits.robustness import (
    DISTURBANCES,
    LARGEST,
    GaitOnMap,
    indicators,
    largest_disturbance,
    sensitivity,
    walk_disturbed,
)
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.orbits.step_map import gait_near, walk_steps

FEW_STARTS = SearchSettings(20, 100)


def best(walker):
    search = find_gaits(walker, settings=FEW_STARTS)
    assert search.gait is not None, search.reason
    return search.gait


@pytest.mark.parametrize(("kind", "seed"), [*((kind, 1) for kind in KINDS), ("round", 2), ("one knee", 2)])
def test_gait_of_unequal_legs_repeats_after_a_stride_of_plain_integration(kind, seed):
    plain = draw_walker(kind, seed)
    gait = best(model_of(plain))
    steps, end = plain.stride(gait.state)
    np.testing.assert_allclose(steps, gait.steps, rtol=1e-10)
    np.testing.assert_allclose(end, legs_of(gait.state), atol=1e-10)


@pytest.mark.parametrize("kind", ["masses", "round", "kneed"])
def test_gait_with_different_push_offs_repeats_after_a_stride(kind):
    plain = draw_walker(kind, 9)
    strength = 0.004 * sum(segment.mass for leg in plain.legs for segment in leg.segments)
    plain = replace(plain, push_offs=(strength, 1.5 * strength))
    gait = best(model_of(plain))
    steps, end = plain.stride(gait.state)
    np.testing.assert_allclose(steps, gait.steps, rtol=1e-10)
    np.testing.assert_allclose(end, legs_of(gait.state), atol=1e-10)
    assert gait.work["push_off"] > 0.0


def test_stride_multipliers_equal_differences_of_plain_integrations():
    plain = draw_walker("straight", 1)
    walker = model_of(plain)
    gait = best(walker)
    size, columns = 1e-5, []
    for rate in (2, 3):
        ends = [plain.stride(legs_of(gait.state) + sign * size * np.eye(4)[rate])[1] for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * size))
    exact = RigidMap(lambda _: walker, 1.0, walker)
    DP = walk_steps(exact, np.array(gait.z), 0.0, 2).DP
    tau = np.sqrt(walker.leg_length / walker.gravity)
    # Rates are in sqrt(g/L), so derivatives of theta_2 by rates have a unit, and those of rates by rates have none.
    scales = np.array([tau, 1.0, 1.0])
    np.testing.assert_allclose(DP[:, 1:] * scales[:, None], np.array(columns)[:, [1, 2, 3]].T, atol=1e-7)
    assert np.abs(np.linalg.eigvals(DP)).max() == pytest.approx(gait.spectral_radius**2)


@pytest.mark.parametrize("kind", ["masses", "round", "kneed"])
def test_exchanged_labels_give_the_same_gait_half_a_stride_later(kind):
    plain = draw_walker(kind, 3)
    gait, later = best(model_of(plain)), best(model_of(replace(plain, legs=plain.legs[::-1])))
    np.testing.assert_allclose(later.steps, gait.steps[::-1], rtol=1e-11)
    assert later.asymmetry["step_length"] == pytest.approx(-gait.asymmetry["step_length"], abs=1e-11)
    halfway = take_walk(model_of(plain), EXACT_STEPS, gait.state, 1).final_state
    np.testing.assert_allclose(later.state, halfway, atol=1e-11)
    np.testing.assert_allclose(later.stride_multipliers, gait.stride_multipliers, atol=1e-9)


@pytest.mark.parametrize("kind", ["round", "kneed and round"])
def test_pair_of_equal_legs_has_the_gait_of_the_symmetric_model_and_its_squared_multipliers(kind):
    plain = draw_walker(kind, 4)
    walker = model_of(replace(plain, legs=(plain.legs[0],) * 2))
    equal = best(walker)
    assert not walker.legs_differ
    different = best(pair(walker, walker))
    np.testing.assert_allclose(different.state, equal.state, atol=1e-12)
    np.testing.assert_allclose(different.steps, [(equal.period, equal.step_length)] * 2, rtol=1e-12)
    np.testing.assert_allclose(different.stride_multipliers, equal.stride_multipliers, atol=1e-10)
    squares = np.sort_complex(np.array(equal.multipliers) ** 2)
    np.testing.assert_allclose(np.sort_complex(equal.stride_multipliers), squares, atol=1e-15)
    assert different.spectral_radius == pytest.approx(equal.spectral_radius, rel=1e-10)
    assert different.multipliers == ()
    assert different.min_normal_force == pytest.approx(equal.min_normal_force, rel=1e-10)
    assert different.energy == pytest.approx(equal.energy, rel=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_energy_is_balanced_over_the_steps_of_both_legs(kind):
    walker = model_of(draw_walker(kind, 5))
    walk = take_walk(walker, EXACT_STEPS, best(walker).state, 3)
    assert walk.steps == 3
    assert walk.energy_balance_residual < 1e-10 * walker.mass * walker.gravity
    assert walk.energy_drift < 1e-10 * walker.mass * walker.gravity or np.any(walker.laws)
    spent = walk.driven.net_work - walk.lost_in_strikes
    whole = take_walk(walker, EXACT_STEPS, best(walker).state, 2)
    assert whole.driven.net_work == pytest.approx(whole.lost_in_strikes, rel=1e-9)
    assert spent != pytest.approx(0.0, abs=1e-6)


def test_work_of_a_knee_damper_is_not_assigned_to_the_hip():
    walker = model_of(draw_walker("one knee", 6))
    gait = best(walker)
    assert gait.work["hip"] == 0.0
    assert gait.work["knees"] < 0.0
    undamped = best(walker.changed(knees=(0.0, 0.0, 0.0)))
    assert "knees" not in undamped.work
    assert not walker.changed(knees=(0.0, 0.0, 0.0)).laws[HIP_ROW + 1 :].any()


def test_averaging_two_legs_gives_equal_legs_in_either_order():
    walker = model_of(draw_walker("round", 7))
    even = average_legs(walker, 0.0)
    assert not even.legs_differ
    assert even == average_legs(walker.exchanged, 0.0)
    np.testing.assert_array_equal(average_legs(walker, 1.0).A, walker.A)


@pytest.mark.parametrize(("damping", "slope", "walks"), [
    (0.0, 0.0225, False), (0.0, 0.0245, True), (0.0, 0.046, True),
    (0.1, 0.0162, False), (0.1, 0.0182, True), (0.1, 0.04, True), (0.1, 0.0495, True),
])  # fmt: skip
def test_one_kneed_and_one_straight_leg_walk_stably_on_the_published_slopes(damping, slope, walks):
    # Miandoab and Beigzadeh, Nonlinear Dynamics 111 (2023): 0.0235 to 0.0470 rad, and 0.0172 to 0.0505 with damping 0.1
    kneed = Leg((Segment(0.379, 8.76, 0.143, 0.0, 0.129), Segment(0.388, 2.70, 0.157, 0.0, 0.032)), 0.0)
    straight = Leg((Segment(0.767, 11.46, 0.235, 0.0, 0.479),), 0.0)
    plain = Walker((kneed, straight), 37.08, slope, knee_damping=(damping, 0.0))
    search = find_gaits(model_of(plain))
    assert (search.gait is not None and search.gait.stable) is walks


# ---- disturbances ----------------------------------------------------------------------------------------------------


def gait_on_map(walker):
    """Return the gait of a walker on its step map, whose parameter is the slope."""
    gait = best(walker)
    unit, units = unit_walker(walker)
    step_map = RigidMap(lambda slope: change_slope(walker, slope), 1.0, walker)
    step_map.stride = 2
    z = np.array(gait.z)
    slope = float(unit.slope)
    return GaitOnMap(step_map, slope, z, walk_steps(step_map, z, slope, 2).DP, units)


@pytest.mark.parametrize("kind", KINDS)
def test_disturbed_steps_of_each_leg_equal_a_plain_integration(kind):
    plain = draw_walker(kind, 8)
    for gait in gait_on_map(model_of(plain)).split_by_leg():
        model = model_of(plain) if gait.leg == 1 else model_of(plain).exchanged
        start = states_on_section(model, np.array(gait.z) / [1.0, *[gait.units.time] * 2])
        rises = (2e-3 * gait.units.length, -5e-4 * gait.units.length)
        walk = gait.step_map.take_disturbed_walk(gait.z, gait.p, np.append(0.0, np.cumsum(rises)), swing=gait.swing)
        steps, end = plain.stride(start, rises, gait.leg - 1)
        np.testing.assert_allclose(np.transpose([walk.durations_s, walk.lengths_m]), steps, rtol=1e-9)
        np.testing.assert_allclose(walk.z / [1.0, *[gait.units.time] * 2], end[1:], atol=1e-9)


@pytest.mark.parametrize("disturbance", ["floor-drop", "hip-push"])
@pytest.mark.parametrize(("kind", "seed"), [("masses", 1), ("round", 1), ("kneed", 1), ("one knee", 2)])
def test_sensitivity_norm_of_each_leg_equals_a_brute_force_sum(kind, seed, disturbance):
    for gait in gait_on_map(model_of(draw_walker(kind, seed))).split_by_leg():
        unit = gait.unit_of(disturbance)
        walks = {k: walk_disturbed(gait, disturbance, k * 1e-5 * unit, 90) for k in (-2, -1, 1, 2)}
        seen = {k: indicators(walk) for k, walk in walks.items()}
        changes = (8.0 * (seen[1] - seen[-1]) - (seen[2] - seen[-2])) / (12e-5 * unit)
        answer = sensitivity(gait, disturbance)
        np.testing.assert_allclose(answer.norm, np.sqrt((changes**2).sum(axis=0)), rtol=1e-5)
        np.testing.assert_allclose(answer.direct, changes[0], rtol=1e-6)


@pytest.mark.parametrize("kind", ["masses", "kneed"])
def test_exchanging_the_legs_exchanges_their_robustness(kind):
    plain = draw_walker(kind, 3)
    gaits = gait_on_map(model_of(plain)).split_by_leg()
    exchanged = gait_on_map(model_of(replace(plain, legs=plain.legs[::-1]))).split_by_leg()
    assert [gait.leg for gait in gaits] == [gait.leg for gait in exchanged] == [1, 2]
    for one, other in zip(gaits, exchanged[::-1], strict=True):
        for disturbance in DISTURBANCES:
            answer = sensitivity(one, disturbance)
            np.testing.assert_allclose(answer.norm, sensitivity(other, disturbance).norm, rtol=1e-6)
        for disturbance, sign in LARGEST.values():
            size = largest_disturbance(one, disturbance, sign, 4)
            assert size == pytest.approx(largest_disturbance(other, disturbance, sign, 4), rel=1e-3)
    first, second = (sensitivity(gait, "floor-drop").norm[0] for gait in gaits)
    assert first != pytest.approx(second, rel=1e-2)
    both = gait_quantities(gaits[0])["gait_sensitivity_norm"]
    assert both == pytest.approx(np.sqrt(0.5 * (first**2 + second**2)))


@pytest.mark.parametrize("kind", ["masses", "round", "one knee"])
def test_gradients_of_a_limping_gait_equal_differences_of_neighbouring_gaits(kind):
    walker = model_of(draw_walker(kind, 1))
    gait = gait_on_map(walker)
    quantities = ("spectral_radius", "cost_of_transport", "gait_sensitivity_norm")
    exact = gradients(gait, gait.p, quantities)
    h = 1e-4 * gait.p

    def beside(change):
        p = gait.p + change
        cycle = gait_near(gait.step_map, gait.z, p, Effort(1e-12), 2)
        return gait_quantities(gait._replace(p=p, z=cycle.z, A=cycle.DP), quantities)

    further, nearer = ((beside(k * h), beside(-k * h)) for k in (2.0, 1.0))
    for name, gradient in exact.items():
        far, near = ((ends[0][name] - ends[1][name]) / (2.0 * h * k) for ends, k in ((further, 2.0), (nearer, 1.0)))
        assert gradient.value == pytest.approx((4.0 * near - far) / 3.0, rel=1e-4), name
    own = best(walker)
    numbers = gait_quantities(gait)
    assert numbers["period_s"] == pytest.approx(own.period, rel=1e-12)
    assert numbers["spectral_radius"] == pytest.approx(own.spectral_radius, rel=1e-9)
    assert numbers["cost_of_transport"] == pytest.approx(own.cost_of_transport, rel=1e-9)
