"""Compare the kneed walker on compliant ground with another program, balances and a plain integration."""

import contact_walks
import numpy as np
import plain_walk
import pytest
from contact_walks import settings
from kneed_walks import (
    ANGLES,
    AT_TOUCH,
    GRAVITY,
    HIP_MASS,
    MASS,
    PAPER_MASS,
    PERIOD,
    RATES,
    RIGID_ANGLES,
    RIGID_RATES,
    SHANK,
    SLOPE,
    STEP,
    THIGH,
    scene_of,
    walked,
)  # fmt: skip
from system_rates import gradient_of, rate_of

from walkerlab.outcome import Outcome
from walkerlab.physics.ground.compliant import KneeRules, contact_walker
from walkerlab.physics.ground.knees import lock_knee
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.ground.walker import LOCKED, RELEASED, STOPPING, feet_motion, place_on_ground
from walkerlab.physics.hybrid.contact_loop import walk_in_form
from walkerlab.physics.hybrid.contact_result import losses_by_channel
from walkerlab.physics.mechanics.parts import Assembly, Particle
from walkerlab.physics.orbits.contact_gait import find_gait_from, section_points
from walkerlab.physics.orbits.contact_map import coordinates_of, state_on_section, step_from_section
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import start_state
from walkerlab.scene.parts import Arc, Limb, straight_legs

KNEE_STRIKE = 0.348612  # s after heel strike, of the rigid gait
BENT_STATE = (0.1, 0.9, -0.2, 0.25, -0.6, 0.25, 0.3, -0.1, 1.4, -0.9, 2.5, -0.9)


def exchanged(walk):
    """Return the energy (J) lost to the ground and to the knees."""
    return float(walk.dissipated_J.sum())


def plain(release_at_touch=False):
    legs = plain_walk.kneed_legs(
        THIGH.length_m, THIGH.mass_below_m, THIGH.mass_kg, SHANK.length_m, SHANK.mass_below_m, SHANK.mass_kg, HIP_MASS,
        0.0,
    )  # fmt: skip
    stiffness, damping = 1e5 * 1000.0**2.2 * MASS / PAPER_MASS, 9e4 * MASS / PAPER_MASS
    return plain_walk.Plain(
        *legs, 1.0, GRAVITY, SLOPE, stiffness, 2.2, damping, 1e-4, 0.9, 0.7, 0.1, 1.0, plain_walk.PLANE, STEP,
        release_at_touch,
    )  # fmt: skip


def test_release_by_compression_allows_twenty_steps_near_the_rigid_gait():
    walk = walked(steps=20)
    assert walk.outcome is Outcome.WALKED
    assert walk.periods_s[-1] == pytest.approx(PERIOD, abs=0.01)
    assert walk.knee_strike_time_s[0] == pytest.approx(KNEE_STRIKE, abs=5e-3)
    assert walk.energy_balance_residual_J < 1e-6 * exchanged(walk)


def test_friction_with_less_creep_tracks_the_rigid_gait():
    walk = walked(steps=12, stiction_velocity=0.01, friction_velocity=0.1)
    assert walk.outcome is Outcome.WALKED
    assert walk.periods_s[-1] == pytest.approx(PERIOD, abs=3e-3)


def test_release_at_touch_gives_a_different_walk():
    walk = walked(steps=20, rules=AT_TOUCH)
    steps = walk.periods_s
    assert walk.outcome in (Outcome.FELL, Outcome.BENT_KNEE) or steps[-1] < PERIOD - 0.01


@pytest.mark.parametrize(("rules", "steps"), [(None, 4), (AT_TOUCH, 3)], ids=["compression", "touch"])
def test_independent_integration_has_the_same_lock_release_and_touch_times(rules, steps):
    other = plain_walk.walk(plain(rules is AT_TOUCH), plain_walk.start(plain(), ANGLES, RATES), steps, 2e-5)
    walk = walked(steps=steps, rules=rules, tolerance=1e-10)
    assert other.outcome == walk.outcome == Outcome.WALKED
    np.testing.assert_allclose(walk.touch_time_s, other.times, atol=1e-6)
    np.testing.assert_allclose(walk.touch_along_m, other.places, atol=1e-6)
    np.testing.assert_allclose(walk.slip_m, other.slips, atol=1e-6)
    np.testing.assert_allclose(walk.knee_strike_time_s, other.locks, atol=1e-6)
    # In the time by which both differ, the fastest body turns at a few rad/s.
    np.testing.assert_allclose(walk.end_state[2:6], other.end[2:6], atol=5e-6)


def masses_of(state, slope=SLOPE):
    """Return (mass, position, velocity) of all point masses, computed from hip, thighs and shanks."""
    x, h, *rest = state
    angles, (v_x, v_h), rates = rest[:4], rest[4:6], rest[6:]
    up = [np.array([-np.sin(a + slope), np.cos(a + slope)]) for a in angles]
    turn = [w * np.array([-np.cos(a + slope), -np.sin(a + slope)]) for a, w in zip(angles, rates, strict=True)]
    points = [(HIP_MASS, np.zeros(2), np.zeros(2))]
    for leg in range(2):
        knee, knee_v = -THIGH.length_m * up[leg], -THIGH.length_m * turn[leg]
        points.append((THIGH.mass_kg, -THIGH.mass_below_m * up[leg], -THIGH.mass_below_m * turn[leg]))
        points.append(
            (SHANK.mass_kg, knee - SHANK.mass_below_m * up[2 + leg], knee_v - SHANK.mass_below_m * turn[2 + leg])
        )
    centre, drift = (sum(m * p[k] for m, *p in points) / MASS for k in range(2))
    return [(m, r - centre + (x, h), v - drift + (v_x, v_h)) for m, r, v in points]


def turning(arm, momentum):
    return arm[0] * momentum[1] - arm[1] * momentum[0]


def spin(points, about, drift):
    return sum(m * turning(r - about, v - drift) for m, r, v in points)


def test_knee_lock_conserves_total_momentum_and_that_of_the_swing_leg():
    """Sum the momentum of all masses, and the angular momentum of the leg whose knee locks about the hip."""
    scene = scene_of()
    state = (*BENT_STATE[:4], BENT_STATE[2], *BENT_STATE[5:])  # The knee has just become straight.
    after, lost, _ = lock_knee(scene.walker.whole, scene.walker.forms[0, 3], state)
    before_points, after_points = masses_of(state), masses_of(after)
    assert after[10] == pytest.approx(after[8], abs=1e-14)
    np.testing.assert_allclose(after[:8], state[:8], atol=0.0)
    assert spin(after_points, np.zeros(2), np.zeros(2)) == pytest.approx(
        spin(before_points, np.zeros(2), 0.0 * np.zeros(2))
    )
    energy = [sum(0.5 * m * v @ v for m, _, v in points) for points in (before_points, after_points)]
    assert lost == pytest.approx(energy[0] - energy[1], rel=1e-12)
    assert lost > 0.0
    # The hip transmits no torque, so about the hip the angular momentum changes only because the velocity of the hip
    # jumps.
    hip, jump = before_points[0][1], after_points[0][2] - before_points[0][2]
    leg = slice(1, 3)
    change = sum(
        m * turning(r - hip, w - v) for (m, r, v), (_, _, w) in zip(before_points[leg], after_points[leg], strict=True)
    )
    assert change == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(jump) > 1e-6


def test_equations_of_a_locked_knee_equal_those_of_one_leg():
    """Compare with a compass whose legs have thigh and shank as one body."""

    scene = scene_of()
    legs = straight_legs(Limb(1.0, THIGH.mass_kg, THIGH.mass_below_m), HIP_MASS, Arc())
    shanks = tuple(
        Particle(f"s{k}", SHANK.mass_kg, f"leg {k}", (0.0, -THIGH.length_m - SHANK.mass_below_m)) for k in (1, 2)
    )
    one = contact_walker(
        Assembly(legs.bodies, legs.joints, (*legs.particles, *shanks), legs.feet, legs=legs.legs),
        scene.walker.normal, scene.walker.friction, GRAVITY, SLOPE,
    )  # fmt: skip
    two = place_on_ground(scene_of(KneeRules(Impact(1e3, 1.5, 5.0, 1e-2))).walker, (True, True), (LOCKED, LOCKED))
    y = (0.1, 0.7, -0.3, 0.2, 0.3, -0.1, -0.5, -0.9)
    straight = (*y[:4], *y[2:4], *y[4:], *y[6:])
    expected = rate_of(place_on_ground(one, (True, True)), y)
    found = rate_of(two, straight)
    np.testing.assert_allclose(found[:4] + found[6:10], expected, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(found[10:], found[8:10], rtol=0.0, atol=0.0)


@pytest.mark.parametrize(
    "knee",
    [(RELEASED, RELEASED), (STOPPING, RELEASED), (RELEASED, LOCKED), (STOPPING, LOCKED), (LOCKED, LOCKED)],
)
def test_exact_derivatives_equal_finite_differences(knee):
    rules = KneeRules(Impact(1e3, 1.5, 5.0, 1e-2))
    scene = scene_of(rules)
    y = np.array(BENT_STATE)
    y[4] = y[2] + 5e-3
    system = place_on_ground(scene.walker, (False, False), knee)
    J = gradient_of(system, y)
    differences = np.zeros((12, 12))
    for j in range(12):
        step = np.zeros(12)
        step[j] = 1e-6
        ahead, behind = (np.array(rate_of(system, y + sign * step)) for sign in (1, -1))
        differences[:, j] = (ahead - behind) / 2e-6
    np.testing.assert_allclose(J, differences, atol=1e-5 * np.abs(differences).max())


def test_scaled_copy_of_a_kneed_walker_takes_the_same_steps():
    one, other = walked(steps=3, tolerance=1e-9), walked(steps=3, tolerance=1e-9, scale=4.0)
    np.testing.assert_allclose(other.touch_time_s / 2.0, one.touch_time_s, atol=1e-6)
    np.testing.assert_allclose(other.touch_along_m / 4.0, one.touch_along_m, atol=1e-6)


def test_straight_legs_knees_and_a_pinned_step_share_one_compiled_walk():
    contact_walks.walked(steps=1)
    compiled = set(walk_in_form.signatures)
    contact_walks.walked("contact.stance=pinned", steps=1)
    walked(steps=1)
    assert set(walk_in_form.signatures) == compiled


def test_scipy_method_gives_the_same_kneed_contact_walk():
    scene = scene_of()
    start = start_state(scene, (*RIGID_ANGLES, *RIGID_RATES))
    walk = scene.walk(start, 2, Tolerances("scipy-radau", 1e-6, 1e-8, 10**6), 0.01)
    ours = walked(steps=2)
    np.testing.assert_allclose(walk.touch_time_s, ours.touch_time_s, atol=1e-5)
    np.testing.assert_allclose(walk.knee_strike_time_s, ours.knee_strike_time_s, atol=1e-5)
    assert walk.energy_balance_residual_J < 1e-4 * exchanged(walk)


def test_walk_with_a_stiffer_knee_stop_is_closer_to_that_with_an_ideal_lock():
    ideal = walked(steps=3)
    stopped = [walked(steps=3, rules=KneeRules(Impact(k, 1.0, 1e-3 * k, 1e-5))) for k in (1e3, 1e5)]
    for walk in stopped:
        assert walk.outcome is Outcome.WALKED
        assert walk.energy_balance_residual_J < 1e-6 * exchanged(walk)
        assert losses_by_channel(scene_of().walker, walk.dissipated_J)["knee_strikes"] < 1e-9
        assert losses_by_channel(scene_of().walker, walk.dissipated_J)["knee_stop"] > 1e-3
    apart = [np.abs(walk.touch_time_s - ideal.touch_time_s).max() for walk in stopped]
    assert apart[1] < 0.3 * apart[0]


def test_error_of_a_knee_stop_falls_with_the_square_root_of_its_stiffness():
    """The damping ratio is constant, and damping is full far below the compression. Compare the times of locks and of
    step ends.
    """
    ideal, stiffnesses = walked(steps=3), (1e3, 1e5, 1e7)
    laws = [Impact(k, 1.0, 0.3 * k**0.5, 1e-7) for k in stiffnesses]
    stopped = [walked(steps=3, rules=KneeRules(law)) for law in laws]
    for times in ("knee_strike_time_s", "touch_time_s"):
        apart = [np.abs(getattr(walk, times) - getattr(ideal, times)).max() for walk in stopped]
        orders = -np.diff(np.log(apart)) / np.diff(np.log(stiffnesses))
        assert orders == pytest.approx([0.5, 0.5], abs=0.05)


def test_long_kneed_walk_settles_on_the_contact_gait():
    scene, walk = scene_of(), walked(steps=40, tolerance=1e-9)
    start = start_state(scene, (*RIGID_ANGLES, *RIGID_RATES))
    answer = find_gait_from(scene.walker, scene.ground, settings(1e-10), start)
    assert answer.gait is not None, answer.reason
    gait = answer.gait
    assert gait.z.size == 8  # coordinates: height, two angles, two velocities, three angular velocities
    assert gait.step.period_s == pytest.approx(walk.periods_s[-1], abs=1e-6)
    assert gait.step.length_m == pytest.approx(walk.lengths_m[-1], abs=1e-6)
    assert gait.step.slip_m == pytest.approx(walk.slip_m[-2], abs=1e-6)
    assert gait.stable
    assert gait.step.dissipated_J.sum() == pytest.approx(gait.step.driven.gravity, rel=1e-6)
    # The multipliers are close to those of the rigid gait.
    assert abs(gait.multipliers[0]) == pytest.approx(abs(0.35257 + 0.55221j), abs=0.1)


def test_step_derivative_through_lock_and_release_equals_finite_differences():
    scene, stance = scene_of(), 1
    methods = settings(1e-11)
    start = start_state(scene, (*RIGID_ANGLES, *RIGID_RATES))
    z = next(section_points(scene.walker, scene.ground, settings(1e-10), start))[1]
    at = step_from_section(scene, methods, z, STEP)
    assert at.outcome is Outcome.WALKED
    back = coordinates_of(scene.walker, np.array(state_on_section(scene.walker, z, stance)), stance)
    np.testing.assert_allclose(back, z, atol=1e-15)
    for column, step in ((1, 3e-5), (2, 3e-5), (5, 3e-4), (6, 3e-4), (7, 3e-5)):
        ahead, behind = (
            step_from_section(scene, methods, z + sign * step * np.eye(z.size)[column], STEP).z for sign in (1, -1)
        )
        slope = (ahead - behind) / (2.0 * step)
        np.testing.assert_allclose(at.DP[:, column], slope, atol=2e-4 * np.abs(at.DP).max())


def test_walk_starts_with_a_round_stance_foot_rolling_on_the_ground():
    scene = scene_of(radius=0.2)
    y = start_state(scene, (*RIGID_ANGLES, *RIGID_RATES))
    stance = feet_motion(scene.walker.whole, y)[1]
    np.testing.assert_allclose((stance.slip, stance.vertical_velocity, stance.height), 0.0, atol=1e-14)
