"""Tests of configs with `leg_2`: the second leg, its contact walk, and the stages that need equal legs."""

import math

import numpy as np
import pytest

from walkerlab.config.drives import drives_of
from walkerlab.config.files import builtin_config
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError
from walkerlab.physics.hybrid.contact_result import sample_feet
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING, swing_foot
from walkerlab.physics.orbits.contact_map import lengths_between_touches
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.step_map import walk_steps
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.resolve import resolve
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import contact_sim, continuation
from walkerlab.scene.contact import contact_gait, scene_on_pads, start_state, tolerances_of
from walkerlab.scene.parameter import SLOPE
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import have_different_legs, rigid_walker
from walkerlab.scene.subject import contact_map

HEAVY = "walker.leg_2={leg_mass_kg: 5.5}"
KNEES = "walker.leg_2={shank: {mass_kg: 0.053}, thigh: {length_m: 0.502}}"
PEG = "{type: straight-legs, leg_length_m: 1.0, leg_mass_kg: 0.55, leg_mass_below_hip_m: 0.35}"


def config_of(name, *settings):
    return resolve(name, list(settings)).loaded.config


def gait_of(config):
    gait = find_gaits(rigid_walker(config)).gait
    assert gait is not None
    return gait


def test_keys_of_leg_2_replace_those_of_leg_1():
    walker = config_of("paper", "walker.leg_2={leg_mass_kg: 5.5, foot_to_mass_m: 0.48}").walker
    second = walker.second
    assert (second.leg_mass_kg, second.foot_to_mass_m, second.leg_length_m) == (5.5, 0.48, 1.0)
    assert walker.total_mass_kg == 5.0 + 5.5 + 10.0
    first, other = assembly_of(walker).bodies
    assert (first.mass_kg, other.mass_kg) == (5.0, 5.5)
    assert (first.centre_m[1], other.centre_m[1]) == (-0.5, -0.52)


def test_keys_omitted_for_a_kneed_leg_2_have_the_values_of_leg_1():
    walker = config_of("kneed", KNEES).walker
    bodies = {body.name: body for body in assembly_of(walker).bodies}
    assert (bodies["shank 1"].mass_kg, bodies["shank 2"].mass_kg) == (0.05, 0.053)
    assert bodies["shank 1"].centre_m == bodies["shank 2"].centre_m
    assert bodies["thigh 1"].mass_kg == bodies["thigh 2"].mass_kg


def test_leg_2_with_the_values_of_leg_1_changes_nothing():
    config = config_of("paper", "walker.leg_2={leg_mass_kg: 5.0}")
    assert not have_different_legs(config)
    assert rigid_walker(config) == rigid_walker(config_of("paper"))


def test_walker_of_parts_with_different_shanks_has_different_legs(tmp_path):
    text = builtin_config("parts").path.read_text()
    heavier = text.replace("name: shank 2, mass_kg: 0.05", "name: shank 2, mass_kg: 0.06")
    assert heavier != text
    file = tmp_path / "mine.yaml"
    file.write_text(heavier)
    assert rigid_walker(config_of(str(file))).legs_differ


@pytest.mark.parametrize(("settings", "reason"), [
    (["walker.leg_2={leg_length_m: 0.5}"], "foot_to_mass_m"),
    (["walker.leg_2={leg_mass_kg: -1}"], "leg_mass_kg"),
    (["walker.leg_2={mass: 1}"], "mass"),
    ([HEAVY, "equations=as-printed"], "compass"),
])  # fmt: skip
def test_invalid_settings_of_leg_2_are_rejected_with_the_reason(settings, reason):
    with pytest.raises(ConfigError, match=reason):
        config_of("paper", *settings)


def test_dampers_at_hip_and_knees_are_refused_together():
    with pytest.raises(ConfigError, match="damper"):
        config_of("kneed", "walker.knee.damping_N_m_s_per_rad=0.1", "walker.hip.damping_N_m_s_per_rad=0.1")


@pytest.mark.parametrize(("name", "leg_2"), [
    ("paper", "{leg_length_m: 1.02}"),
    ("round-feet", "{leg_length_m: 0.41, foot_radius_m: 0.13, foot_centre_ahead_m: 0.01}"),
    ("kneed", "{thigh: {length_m: 0.49}, foot_radius_m: 0.05}"),
])  # fmt: skip
def test_start_of_unequal_legs_is_completed_with_both_feet_on_the_slope(name, leg_2):
    values = 4 if name != "kneed" else 6
    start = ["null", "0.25", *["null"] * (values - 4), "-0.4", "-1.0", *["-0.4"] * (values - 4)]
    start = start if values == 4 else ["null", "0.25", "null", "-0.4", "-1.0", "-0.4"]
    config = config_of(name, f"walker.leg_2={leg_2}", f"start=[{', '.join(start)}]")
    walker = rigid_walker(config)
    assert not walker.alike
    height, ahead = swing_foot(walker, np.array(config.start))
    assert height == pytest.approx(0.0, abs=1e-14)
    assert ahead < 0.0
    assert config.start[SWING] < config.start[STANCE]


@pytest.mark.parametrize("leg_2", ["{leg_mass_kg: 5.5}", "{leg_mass_kg: 5.2, leg_length_m: 1.002}"])
def test_walk_of_unequal_legs_on_pads_settles_on_the_contact_gait(leg_2):
    config = config_of("paper", f"walker.leg_2={leg_2}", "contact.pad_pitch=own", "strides=14")
    rigid = gait_of(config)
    gait = contact_gait(config, rigid.step_length, rigid.state).gait
    scene = scene_on_pads(config, rigid.step_length, rigid.state)
    walk = scene.walk(start_state(scene, rigid.state), 28, tolerances_of(config, 28))
    assert walk.steps == 28
    np.testing.assert_allclose(walk.periods_s[-2:], gait.periods_s, atol=2e-5)
    np.testing.assert_allclose(walk.lengths_m[-2:], lengths_between_touches(gait), atol=2e-5)
    assert abs(np.diff(gait.periods_s)[0]) > 1e-3
    # Each foot lands in the middle of its pads.
    lanes, pitch = scene.ground.terrain.lanes, scene.ground.terrain.pitch
    own = walk.touch_along_m[-2:] - np.array(lanes)
    off = own - 2.0 * pitch * np.round(own / (2.0 * pitch))
    assert np.abs(off - off.mean()).max() < 1e-4


def test_stance_time_is_measured_from_touch_to_lift_of_each_foot():
    config = config_of("paper", HEAVY, "contact.pad_pitch=own")
    rigid = gait_of(config)
    scene = scene_on_pads(config, rigid.step_length, rigid.state)
    interval = 1e-4
    walk = scene.walk(start_state(scene, rigid.state), 6, tolerances_of(config, 6), interval)
    touches = np.append(0.0, walk.touch_time_s)
    inside = sample_feet(scene.walker, walk.samples)[:, :, 1] < 0.0
    for step, stance_s in enumerate(walk.stance_s[:5]):
        foot = (step + 1) % 2  # Leg 2 is the first stance leg.
        after = walk.samples.time_s > touches[step] + 10 * interval
        lift = walk.samples.time_s[after & ~inside[:, foot]][0]
        assert touches[step] + stance_s == pytest.approx(lift, abs=2 * interval)
    numbers = {"asymmetry": {"step_length": 0.0}}
    first, second = walk.stance_s[5], walk.stance_s[4]
    found = contact_sim.add_stance_time(numbers, walk)["asymmetry"]
    assert found == {"step_length": 0.0, "stance_time": pytest.approx(2.0 * (second - first) / (second + first))}
    assert abs(found["stance_time"]) > 1e-3


@pytest.mark.parametrize(("name", "first", "second"), [
    ("paper", "{leg_mass_kg: 5.5, leg_2: {leg_mass_kg: 5.0}}", "{leg_mass_kg: 5.0, leg_2: {leg_mass_kg: 5.5}}"),
    ("kneed", "{type: kneed, leg_2: {shank: {mass_kg: 0.053}}}",
     "{type: kneed, shank: {mass_kg: 0.053}, leg_2: {shank: {mass_kg: 0.05}}}"),
])  # fmt: skip
def test_exchanged_labels_give_the_same_contact_gait_half_a_stride_later(name, first, second):
    gaits = []
    for walker in (first, second):
        config = config_of(name, f"walker={walker}", "strides=2")
        rigid = gait_of(config)
        gaits.append(contact_gait(config, rigid.step_length, rigid.state).gait)
    one, other = gaits
    np.testing.assert_allclose(one.periods_s, other.periods_s[::-1], rtol=1e-7)
    np.testing.assert_allclose(lengths_between_touches(one), lengths_between_touches(other)[::-1], rtol=1e-6)
    assert abs(one.multipliers[0]) == pytest.approx(abs(other.multipliers[0]), rel=1e-4)


def test_damped_knee_dissipates_the_same_energy_in_both_models():
    config = config_of("kneed", "walker.knee.damping_N_m_s_per_rad=0.01", "strides=4")
    rigid = gait_of(config)
    scene = scene_on_pads(config, rigid.step_length, rigid.state)
    walk = scene.walk(start_state(scene, rigid.state), 8, tolerances_of(config, 8))
    assert walk.steps == 8
    assert rigid.work["knees"] < 0.0
    assert walk.driven.work_per_step(8)["knees"] == pytest.approx(rigid.work["knees"], rel=0.05)
    assert walk.driven.hip == 0.0


def test_work_of_the_hip_spring_is_recorded_separately_from_that_of_the_knee_dampers():
    spring = 0.2
    sets = ("walker.knee.damping_N_m_s_per_rad=0.01", f"walker.hip.spring_N_m_per_rad={spring}")
    config = config_of("kneed", *sets, "contact.terrain=plane")
    state = gait_of(config).state
    scene = scene_on_pads(config, 0.4, state)
    # Both feet stand on the slope, but closer together than they land, so the spring takes up energy.
    half = len(state) // 2
    middle = 0.5 * (state[SWING] + state[STANCE])
    closer = (middle + 0.9 * (angle - middle) for angle in state[:half])
    start = start_state(scene, (*closer, *state[half:]))
    walks = [scene.walk(start, 1, tolerances_of(config, 1))]
    walks.append(scene.walk(start, 1, tolerances_of(config, 1), walks[0].touch_time_s))
    walk = walks[1]
    assert walk.steps == 1
    touched = walk.samples.states[-1]
    taken_up = 0.5 * spring * ((touched[2] - touched[3]) ** 2 - (start[2] - start[3]) ** 2)
    assert taken_up > 1e-4
    assert walk.driven.hip == pytest.approx(-taken_up, rel=1e-6)
    assert walk.driven.knees == pytest.approx(walk.samples.driven_J[-1, 1], rel=1e-6)
    assert walk.driven.knees < 0.0


LEVEL = ("slope_deg=0", "walker.hip={spring_N_m_per_rad: 10}")


def test_push_offs_of_both_legs_drive_a_gait_that_limps():
    gait = gait_of(config_of("paper", *LEVEL, "push_off={impulse_N_s: 4, leg_2: {impulse_N_s: 3.9}}"))
    equal = gait_of(config_of("paper", *LEVEL, "push_off.impulse_N_s=3.95"))
    assert np.mean(gait.steps, axis=0) == pytest.approx(equal.steps[0], rel=1e-4)
    # Leg 2 pushes off as leg 1 lands. Its push is weaker, so the step of leg 2 that follows takes longer.
    assert gait.asymmetry["step_period"] > 1e-3


def test_push_off_of_leg_2_equal_to_that_of_leg_1_changes_nothing():
    config = config_of("paper", *LEVEL, "push_off={impulse_N_s: 4, leg_2: {impulse_N_s: 4}}")
    assert not have_different_legs(config)
    assert rigid_walker(config) == rigid_walker(config_of("paper", *LEVEL, "push_off.impulse_N_s=4"))


def test_different_push_offs_count_as_different_legs():
    config = config_of("paper", "push_off={impulse_N_s: 1, leg_2: {impulse_N_s: 2}}")
    assert have_different_legs(config)
    assert PIPELINE["tune"].why_unsuited(config) == "the legs differ"
    assert drives_of(config) == ("a push-off of 1 N s by leg 1 and 2 N s by leg 2",)


@pytest.mark.parametrize(("first", "second"), [(0.3, 0.0), (0.0, 0.3), (0.3, 0.2)])
def test_each_leg_pushes_off_with_its_own_impulse_on_compliant_ground(first, second):
    push = f"push_off={{impulse_N_s: {first}, leg_2: {{impulse_N_s: {second}}}}}"
    config = config_of("paper", push, "contact.terrain=after-mid-swing")
    gait = gait_of(config_of("paper"))
    scene = scene_on_pads(config, gait.step_length, gait.state)
    start = start_state(scene, gait.state)
    one, two = (scene.walk(start, steps, tolerances_of(config, steps)) for steps in (2, 3))
    assert two.steps == 3
    # Leg 1 lands first, so leg 2 is the trailing leg.
    assert (one.driven.push_off > 0.0) == (second > 0.0)
    assert (two.driven.push_off > one.driven.push_off) == (first > 0.0)
    assert two.energy_balance_residual_J < 1e-6


def test_only_tune_needs_equal_legs():
    config = config_of("paper", HEAVY, "recording={file: walk.csv}")
    refused = [stage.name for stage in PIPELINE.stages if stage.why_unsuited(config) == "the legs differ"]
    assert refused == ["tune"]


def test_stage_that_needs_equal_legs_rejects_different_ones():
    tune = PIPELINE["tune"]
    config = config_of("paper", HEAVY)
    assert tune.why_unsuited(config) == "the legs differ"
    with pytest.raises(ConfigError, match="needs two equal legs") as refused:
        tune.refuse_unsuited("tune", config)
    assert "fixedpoint, simulate, contact-sim" in refused.value.advice
    assert tune.why_unsuited(config_of("paper")) is None


def test_family_over_the_mass_of_leg_2_passes_through_equal_legs():
    block = "{over: walker.leg_2.leg_mass_kg, from: 4.9, to: 5.1, model: rigid, periods: 2, points: 30}"
    config = config_of("paper", f"continuation={block}")
    assert config.walker.leg_2 is None
    content = continuation.run(restrict(config, PIPELINE["continuation"].takes), {}, Silent(), again=False)
    rows = content.summary["branches"]
    assert [row["period"] for row in rows] == [2, 2]
    assert sorted(row["stable_range"] is not None for row in rows) == [False, True]
    for row in rows:
        assert sorted((row["from"], row["to"])) == pytest.approx([4.9, 5.1])
    assert content.summary["bifurcations"] == []


def test_flip_curve_of_unequal_legs_has_the_multiplier_minus_one_at_both_ends():
    second = "{over: walker.leg_2.leg_mass_kg, from: 3.95, to: 4.05}"
    block = f"{{over: slope_deg, from: 2.2, to: 2.35, model: rigid, periods: 2, points: 12, second: {second}}}"
    config = config_of("prosthesis", f"continuation={block}")
    content = continuation.run(restrict(config, PIPELINE["continuation"].takes), {}, Silent(), again=False)
    (curve,) = content.summary["curves"]
    assert (curve["kind"], curve["period"]) == ("flip", 2)
    for slope_deg, mass in (curve["begins"], curve["ends"]):
        gait = gait_of(config_of("prosthesis", f"slope_deg={slope_deg}", f"walker.leg_2.leg_mass_kg={mass}"))
        # The last point is interpolated to the edge of the plane.
        assert gait.stride_multipliers[0] == pytest.approx(-1.0, abs=1e-4)


ONE_KNEE_GROUND = (
    "contact={stiffness: 300000, damping: 270, terrain: after-mid-swing, stiction_velocity: 10, friction_velocity: 100}"
)


def test_walker_with_one_knee_and_a_straight_leg_settles_on_its_gait_on_compliant_ground():
    config = config_of("one-knee", ONE_KNEE_GROUND)
    rigid = gait_of(config)
    gait = contact_gait(config, rigid.step_length, rigid.state).gait
    scene = scene_on_pads(config, rigid.step_length, rigid.state)
    walk = scene.walk(start_state(scene, rigid.state), 12, tolerances_of(config, 12))
    assert walk.steps == 12
    np.testing.assert_allclose(walk.periods_s[-2:], gait.periods_s, atol=5e-4)
    np.testing.assert_allclose(gait.periods_s, np.array(rigid.steps)[:, 0], atol=2e-3)
    np.testing.assert_allclose(lengths_between_touches(gait), np.array(rigid.steps)[:, 1], atol=2e-3)
    # The leg with the knee swings in every other step, in which its knee locks once.
    assert np.isfinite(walk.knee_strike_time_s[::2]).all()
    assert np.isnan(walk.knee_strike_time_s[1::2]).all()
    assert walk.energy_balance_residual_J < walk.explained_residual_J
    # If the straight leg swings, the section has two coordinates fewer.
    assert (gait.z.size, gait.steps[0].z.size) == (8, 6)
    assert math.sqrt(abs(gait.multipliers[0])) == pytest.approx(rigid.spectral_radius, rel=0.05)


def test_multipliers_of_a_one_kneed_walker_on_compliant_ground_equal_difference_quotients():
    config = config_of("one-knee", ONE_KNEE_GROUND)
    rigid = gait_of(config)
    gait = contact_gait(config, rigid.step_length, rigid.state).gait
    step_map = contact_map(config, SLOPE, 1.0, float(gait.lengths_m.mean()))
    z = step_map.scale_section(gait.z)
    DP = walk_steps(step_map, z, config.slope_rad, 2).DP
    size, columns = 1e-6, []
    for unit in np.eye(z.size):
        ends = [
            walk_steps(step_map, z + sign * size * unit, config.slope_rad, 2, False).steps[-1].z for sign in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / (2.0 * size))
    np.testing.assert_allclose(np.array(columns).T, DP, atol=1e-3 * np.abs(DP).max())


def test_peg_leg_is_by_default_the_first_leg_with_its_knee_locked():
    walker = rigid_walker(config_of("kneed", "walker.leg_2={type: straight-legs}"))
    assert walker.kneed
    assert not walker.exchanged.kneed
    assert math.hypot(walker.hip_x, walker.hip_y) == pytest.approx(1.0)
    # As a stance leg it is a locked leg, and as a swing leg it has the inertia of one.
    kneed = rigid_walker(config_of("kneed"))
    np.testing.assert_allclose(walker.A, kneed.A, atol=1e-15)
    np.testing.assert_allclose(walker.exchanged.A[:2, :2].sum(), kneed.A.sum(), rtol=1e-12)
    assert walker.exchanged.A[0, 0] == pytest.approx(kneed.A[np.ix_([0, 2], [0, 2])].sum())
