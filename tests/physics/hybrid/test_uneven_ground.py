"""Compare walks over footholds of different heights with a library's integrator, differences and energy."""

from pathlib import Path

import numpy as np
import pytest
from plain_rigid_walk import foot_of, plain_walk

from walkerlab.config.contact import Footholds
from walkerlab.config.loader import load
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS, TANGENT_SCALE, RigidStepper, coordinates_of, strike_section
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.scene.rigid import foothold_heights, rigid_walker

TIGHT = Tolerances("dop853", 1e-12, 1e-13, 10**7)
ON_GROUND = Tolerances("radau5", 1e-8, 1e-10, 10**7)
WALKERS = ("slope-3deg", "kneed", "torso", "round-feet", "kneed-round-feet")


def gait_of(name, *changes):
    config = load(Path(name), changes).config
    walker = rigid_walker(config, config.equations)
    return config, walker, find_gaits(walker).gait


def heights_of(walker, seed, steps, share=2e-4):
    return np.append(0.0, np.random.default_rng(seed).normal(0.0, share * walker.leg_length, steps))


# ---- rigid model ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WALKERS)
def test_rigid_walk_over_random_heights_agrees_with_a_library(name):
    _, walker, gait = gait_of(name)
    heights = heights_of(walker, 5, 5)
    walk = take_walk(walker, TIGHT, gait.state, 5, heights=heights)
    assert walk.outcome is Outcome.WALKED
    plain, outcome, _ = plain_walk(walker, np.array(gait.state), heights)
    assert outcome is Outcome.WALKED
    np.testing.assert_allclose(walk.touch_time_s, plain[:, 0], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(walk.after, plain[:, 1:], rtol=0.0, atol=1e-7)
    assert walk.energy_balance_residual < 1e-8 * walker.mass * walker.gravity * walker.leg_length


ROUND_FEET_UPHILL = (
    "gravity_m_s2=10.366",
    "slope_deg=-0.36498",
    "push_off.impulse_N_s=1.0814",
    "walker={type: straight-legs, leg_length_m: 0.97194, leg_mass_kg: 5.2396, leg_mass_below_hip_m: 0.36637, "
    "leg_mass_ahead_m: -0.0012931, leg_inertia_kg_m2: 0.023407, hip_mass_kg: 0.0, foot_radius_m: 0.17015, "
    "torso: {mass_kg: 4.9067, above_hip_m: 0.29383}, hip: {spring_N_m_per_rad: 6.8532, torque_N_m: 1.332}}",
)
FEET_TOGETHER = (
    -0.12694069585151044,
    0.13968090125936825,
    0.006370102703928905,
    -0.47726602005185587,
    -0.3848651668375102,
    -0.43106559344468304,
)


def test_backward_landing_counts_as_a_fall():
    """The foot lands 2 mm ahead of the other foot, which has rolled back by 8 mm."""
    walker = rigid_walker(load(Path("rigid-only"), ROUND_FEET_UPHILL).config)
    heights = np.array([0.0, 0.403e-3, 0.907e-3])
    plain, _, ahead = plain_walk(walker, np.array(FEET_TOGETHER), heights[:2])
    rolled_back = walker.radius * (plain[0, 1] - FEET_TOGETHER[STANCE])
    assert 0.0 < ahead[0] < 3e-3 < rolled_back
    walk = take_walk(walker, TIGHT, FEET_TOGETHER, 2, heights=heights)
    assert (walk.outcome, walk.steps) == (Outcome.FELL, 0)
    assert walk.end_time_s == pytest.approx(plain[0, 0], abs=1e-8)


@pytest.mark.parametrize(("name", "share", "seed"), [("level", 1e-3, 8), ("level", 1e-3, 47), ("slope-3deg", 8e-3, 14)])
def test_landing_less_than_a_quarter_step_ahead_is_not_a_step(name, share, seed):
    _, walker, gait = gait_of(name)
    heights, nearest = heights_of(walker, seed, 5, share), 0.25 * gait.step_length
    plain, outcome, ahead = plain_walk(walker, np.array(gait.state), heights, nearest)
    assert outcome is Outcome.FELL
    assert 0.0 < ahead[-1] < nearest < min(ahead[:-1])
    walk = take_walk(walker, TIGHT, gait.state, 5, heights=heights, step_length=gait.step_length)
    assert walk.outcome is Outcome.FELL
    np.testing.assert_allclose(walk.touch_time_s, plain[:, 0], rtol=0.0, atol=1e-7)


def test_minimum_landing_distance_does_not_affect_a_walk_on_even_ground():
    _, walker, gait = gait_of("slope-3deg")
    even, judged = (take_walk(walker, TIGHT, gait.state, 3, step_length=length) for length in (None, 1e3))
    np.testing.assert_array_equal(even.after, judged.after)


@pytest.mark.parametrize("name", ["slope-3deg", "kneed", "round-feet"])
def test_tangents_over_uneven_steps_equal_finite_differences(name):
    _, walker, gait = gait_of(name)
    shooting, section = RigidStepper(walker, EXACT_STEPS), strike_section(walker)
    z, d = coordinates_of(walker, gait.state), int(walker.coordinates)
    rises = np.array([0.0, 6e-4, -9e-4, 3e-4]) * walker.leg_length  # The last foothold is at the height of the first.

    def end(z, derived=False):
        return shooting.walk(section, z, 3, derived, (rises, 0.0))

    n = len(walker.arm_x)
    columns = end(z, derived=True).strikes.after[-1].reshape(1 + d, 2 * n)[1:].T / TANGENT_SCALE
    for j in range(d):
        h = 1e-4 * np.eye(d)[j]
        ends = {k: end(z + k * h).strikes.after[-1][: 2 * n] for k in (-2, -1, 1, 2)}
        slope = (8.0 * (ends[1] - ends[-1]) - (ends[2] - ends[-2])) / 12e-4
        np.testing.assert_allclose(columns[:, j], slope, rtol=1e-6, atol=1e-6)


def test_work_of_gravity_on_uneven_ground_includes_height_changes():
    """The cost of transport includes them as well, because descending spends energy."""
    _, walker, gait = gait_of("paper")
    weight = walker.mass * walker.gravity
    for height in (-5e-4, 5e-4):
        walk = take_walk(walker, TIGHT, gait.state, 3, heights=np.array([0.0, 0.0, 0.0, height]))
        along = walk.touch_along_m[-1]
        descended = along * np.sin(walker.slope) - height * np.cos(walker.slope)
        assert walk.driven.gravity == pytest.approx(weight * descended, rel=1e-12)
        assert walk.driven.cost_of_transport(along) == pytest.approx(descended / along, rel=1e-12)


def test_feet_land_at_the_heights_of_their_footholds():
    _, walker, gait = gait_of("slope-3deg")
    heights = np.array([0.0, -4e-3, 1e-3, -2e-3, -2e-3])
    walk = take_walk(walker, TIGHT, gait.state, 4, heights=heights)
    rises = [foot_of(walker, before)[1] for before in walk.before]
    np.testing.assert_allclose(rises, np.diff(heights), atol=1e-12)
    np.testing.assert_array_equal(walk.foothold_height_m, heights[1:])


def test_foothold_heights_of_zero_leave_a_rigid_walk_bitwise_unchanged():
    _, walker, gait = gait_of("kneed")
    even, level = (take_walk(walker, TIGHT, gait.state, 3, heights=heights) for heights in (None, np.zeros(4)))
    np.testing.assert_array_equal(even.after, level.after)
    np.testing.assert_array_equal(even.touch_time_s, level.touch_time_s)


# ---- contact model -------------------------------------------------------------------------------------------------


def on_terrain(name, terrain, heights, *changes, steps=5):
    config, _, gait = gait_of(name, f"contact.terrain={terrain}", *changes)
    scene = contact_scene(config, gait.step_length, gait.step_length)
    return scene, scene.walk(start_state(scene, gait.state), steps, ON_GROUND, 0.01, heights)


CASES = {
    "pads": ("slope-3deg", "checkerboard"),
    "past mid-swing": ("slope-3deg", "after-mid-swing"),
    "round feet past mid-swing": ("round-feet", "after-mid-swing"),
    "knees on a plane": ("kneed", "plane"),
}


@pytest.mark.parametrize("case", CASES)
def test_contact_walk_on_uneven_ground_balances_energy_and_stays_near_the_rigid_walk(case):
    name, terrain = CASES[case]
    _, walker, gait = gait_of(name)
    heights = heights_of(walker, 2, 6)
    scene, walk = on_terrain(name, terrain, heights)
    rigid = take_walk(walker, TIGHT, gait.state, 5, heights=heights[:-1])
    assert walk.outcome is Outcome.WALKED
    np.testing.assert_array_equal(walk.foothold_height_m, heights[1:6])
    assert walk.energy_balance_residual_J < walk.explained_residual_J
    assert walk.driven.gravity == pytest.approx(
        scene.walker.mass
        * (scene.walker.gravity_along * walk.touch_along_m[-1] - scene.walker.gravity_down * heights[5]),
        rel=1e-12,
    )
    np.testing.assert_allclose(walk.periods_s, rigid.periods_s, rtol=0.1)
    depths = np.where(walk.samples.has_ground > 0, walk.samples.level, 0.0)
    assert set(np.unique(depths)) <= {*heights.tolist(), 0.0}


@pytest.mark.parametrize("case", CASES)
def test_contact_walk_over_footholds_of_zero_height_equals_that_on_even_ground(case):
    name, terrain = CASES[case]
    _, even = on_terrain(name, terrain, None, steps=3)
    _, level = on_terrain(name, terrain, np.zeros(1), steps=3)
    np.testing.assert_array_equal(even.samples.states, level.samples.states)


def test_stiffer_uneven_ground_brings_the_contact_walk_closer_to_the_rigid_one():
    """The series is that of `tune`: the stiffness grows, damping grows as its root, and creep slows down."""
    config, walker, gait = gait_of("slope-3deg")
    heights, law = np.array([0.0, -2e-3, 1e-3, -1e-3, -1e-3]), config.contact
    rigid = take_walk(walker, TIGHT, gait.state, 3, heights=heights[:-1])
    off = []
    for factor in (1.0, 10.0, 100.0):
        changed = {
            "stiffness": law.stiffness * factor, "damping": law.damping * factor**0.5,
            "full_damping_penetration": law.full_damping_penetration / factor ** (1.0 / law.exponent),
            "stiction_velocity": law.stiction_velocity / factor, "friction_velocity": law.friction_velocity / factor,
        }  # fmt: skip
        changes = (f"contact.{key}={value!r}" for key, value in changed.items())
        _, walk = on_terrain("slope-3deg", "after-mid-swing", heights, *changes, steps=3)
        off.append(np.abs(walk.periods_s - rigid.periods_s).max())
    assert off[1] < 0.5 * off[0]
    assert off[2] < 0.5 * off[1]


def test_foot_below_its_next_foothold_at_mid_swing_stubs_on_plain_ground():
    _, walk = on_terrain("kneed", "plane", np.array([0.0, 0.0, 0.05]))
    assert (walk.outcome, walk.steps) == (Outcome.STUBBED, 1)


def test_hitting_the_side_of_a_raised_pad_ends_the_walk():
    _, walk = on_terrain("slope-3deg", "checkerboard", np.array([0.0, 0.0, 0.2]))
    assert walk.outcome in (Outcome.OFF_PAD, Outcome.FELL)
    assert walk.steps == 1


def test_walker_falls_if_its_foot_cannot_reach_or_never_clears_a_foothold():
    """The walker falls if a foothold is too deep to be reached in time, and if it is so high that the foot is never
    above it.
    """
    for height in (0.3, -0.4):
        _, walk = on_terrain("slope-3deg", "after-mid-swing", np.array([0.0, 0.0, height]))
        assert (walk.outcome, walk.steps) == (Outcome.FELL, 1)


# ---- feet that pass again, and a foot that the ground releases late
# ---------------------------------------------------

SLIDES_BACK = (
    "walker.leg_length_m=0.54348",
    "walker.foot_to_mass_m=0.29446",
    "walker.leg_mass_kg=1.9927",
    "walker.hip_mass_kg=3.0816",
    "walker.leg_inertia_kg_m2=0.0",
    "walker.torso.mass_kg=3.9275",
    "walker.torso.above_hip_m=0.083685",
    "walker.torso.inertia_kg_m2=0.077183",
    "walker.foot_radius_m=0.0",
    "slope_deg=1.0239",
    "gravity_m_s2=7.1294",
    "contact.units=adams",
    "contact.stiffness=7630.6",
    "contact.exponent=1.7297",
    "contact.damping=2.014",
    "contact.full_damping_penetration=0.028293",
    "contact.friction=coulomb",
    "contact.static_friction=0.43271",
    "contact.dynamic_friction=0.33768",
    "contact.stiction_velocity=83.315",
    "contact.friction_velocity=738.19",
    "contact.terrain=after-mid-swing",
    "contact.stance=free",
    "contact.pad_pitch=0.25256840117250196",
)
SLIDES_BACK_FROM = (
    -0.2523760668588472,
    0.21663521443650732,
    -0.01787042621116994,
    -0.5403676726626706,
    -0.6726384293295232,
    -0.6065030509960969,
)
LETS_GO_LATE = (
    "walker.leg_length_m=0.91916",
    "walker.foot_to_mass_m=0.4834",
    "walker.leg_mass_kg=4.7903",
    "walker.hip_mass_kg=22.624",
    "walker.leg_inertia_kg_m2=0.0",
    "walker.torso.mass_kg=22.695",
    "walker.torso.above_hip_m=0.061144",
    "walker.torso.inertia_kg_m2=0.0",
    "walker.foot_radius_m=0.0",
    "slope_deg=1.8429",
    "gravity_m_s2=5.1229",
    "contact.units=adams",
    "contact.stiffness=16176.0",
    "contact.exponent=1.6127",
    "contact.damping=29.577",
    "contact.full_damping_penetration=0.24202",
    "contact.friction=coulomb",
    "contact.static_friction=1.0917",
    "contact.dynamic_friction=0.77087",
    "contact.stiction_velocity=14.551",
    "contact.friction_velocity=137.92",
    "contact.terrain=after-mid-swing",
    "contact.stance=free",
    "contact.pad_pitch=0.5100936570165115",
)
LETS_GO_LATE_FROM = (
    -0.3133328712460464,
    0.24900352567603942,
    -0.0321646727850035,
    -0.4281380957459881,
    -0.7019139059117369,
    -0.5650260008288625,
)


def walk_from(sets, start, steps, heights, tolerances=ON_GROUND):
    scene = contact_scene(load(None, sets).config, 0.35)
    return scene.walk(start_state(scene, start), steps, tolerances, heights=heights)


@pytest.mark.parametrize("terrain", ["after-mid-swing", "plane"])
def test_foot_that_goes_below_the_ground_again_is_supported_as_on_even_ground(terrain):
    """All footholds are level but one, which is never reached."""
    sets = (*SLIDES_BACK, f"contact.terrain={terrain}")
    heights = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1e-6])
    even, uneven = (walk_from(sets, SLIDES_BACK_FROM, 3, each) for each in (None, heights))
    assert uneven.outcome is even.outcome
    assert uneven.outcome is not Outcome.SOLVER_FAILED
    assert uneven.end_time_s == pytest.approx(even.end_time_s, abs=1e-9)


def test_loss_of_contact_is_found_at_the_same_time_for_all_tight_tolerances():
    heights = np.array([0.0, 5.5611e-05, -0.00097804, 0.00096203])
    walks = (
        walk_from(LETS_GO_LATE, LETS_GO_LATE_FROM, 3, heights, Tolerances("radau5", 1e-11, atol, 10**7))
        for atol in (1e-12, 1e-13, 4.641588833612772e-13)
    )
    first, *others = (walk.end_time_s for walk in walks)
    assert others == pytest.approx([first, first], abs=2e-9)


# ---- heights -------------------------------------------------------------------------------------------------------


def test_last_listed_height_repeats_and_random_heights_do_not_depend_on_their_count():
    np.testing.assert_array_equal(
        foothold_heights(Footholds(heights_m=(1e-3, -2e-3)), 4), [0.0, 1e-3, -2e-3, -2e-3, -2e-3]
    )
    few, many = (foothold_heights(Footholds(roughness_m=1e-3, seed=7), steps) for steps in (3, 300))
    np.testing.assert_array_equal(few, many[:4])
    assert np.std(many[1:]) == pytest.approx(1e-3, rel=0.15)
    assert foothold_heights(Footholds(heights_m=(0.0, 0.0)), 4) is None


@pytest.mark.parametrize("leg", [SWING, STANCE])
def test_fall_is_judged_by_the_hip_height_above_the_foothold(leg):
    """The walker descends stairs by a leg length in all, so only the ground gets lower."""
    _, walker, gait = gait_of("slope-3deg")
    heights = np.append(0.0, -1e-3 * np.arange(1, 701)) if leg == SWING else np.append(0.0, 1e-4 * np.arange(1, 701))
    walk = take_walk(walker, Tolerances("dop853", 1e-9, 1e-11, 10**8), gait.state, 700, heights=heights)
    assert walk.steps == 700
