"""Find heel strikes in recordings that begin or end anywhere, are noisy, or have swapped, rotated or biased angles."""

import functools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from filmed_walks import (
    PERIOD_S,
    SLOPE,
    all_steps_are_right,
    angles_at,
    places_of,
    read,
    read_places,
    sampled,
)

import walkerlab
from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import SAMPLE, RecordedWalk
from walkerlab.exchange.leg_angles import mend_angles
from walkerlab.exchange.touches import candidates, merge_repeats
from walkerlab.exchange.walk_in_steps import divide_into_steps
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint, simulate
from walkerlab.scene.rigid import rigid_walker


@pytest.mark.parametrize("fps", [25.0, 60.0, 100.0, 240.0, 1000.0])
@pytest.mark.parametrize("cut_ms", [5, 10, 15, 20, 25])
def test_recording_that_starts_after_a_heel_strike_begins_at_the_next_one(cut_ms, fps, tmp_path):
    summary = read(tmp_path, *sampled(begin=1e-3 * cut_ms, fps=fps))
    assert summary["first_heel_strike_s"] == pytest.approx(PERIOD_S, abs=2e-5)
    assert all_steps_are_right(summary, period=3e-5, length=3e-5)


@pytest.mark.parametrize("fps", [60.0, 100.0, 240.0])
@pytest.mark.parametrize("cut_ms", [10, 15, 20, 25])
def test_noise_does_not_make_the_first_sample_a_heel_strike(cut_ms, fps, tmp_path):
    """With noise of a hundredth of the angles, a heel strike is located to about a millisecond."""
    for seed in range(3):
        summary = read(tmp_path, *sampled(begin=1e-3 * cut_ms, fps=fps, noise=1e-3, seed=seed))
        assert summary["first_heel_strike_s"] == pytest.approx(PERIOD_S, abs=4e-3)
        assert all_steps_are_right(summary, period=5e-3, length=6e-3)


@pytest.mark.parametrize("fps", [25.0, 60.0, 100.0, 240.0, 1000.0])
@pytest.mark.parametrize("noise", [0.0, 2e-4])
def test_recording_that_begins_on_a_heel_strike_keeps_its_first_step(noise, fps, tmp_path):
    summary = read(tmp_path, *sampled(fps=fps, noise=noise, seed=1))
    assert summary["first_heel_strike_s"] == 0.0
    assert summary["steps"] == 7
    assert all_steps_are_right(summary, period=3e-5 + 4.0 * noise, length=3e-5 + 4.0 * noise)


@pytest.mark.parametrize("fps", [25.0, 60.0, 100.0, 240.0])
@pytest.mark.parametrize("after_ms", [-20, -10, -5, -2, 0, 2, 5, 10, 25])
def test_heel_strike_near_the_end_is_correct_or_omitted(after_ms, fps, tmp_path):
    end = 4.0 * PERIOD_S + 1e-3 * after_ms
    count = int((end - 0.3) * fps)
    time = end - np.arange(count, -1, -1) / fps
    summary = read(tmp_path, time, angles_at(time))
    assert all_steps_are_right(summary, period=1e-4, length=1e-4)
    assert summary["steps"] >= (3 if after_ms >= 0 else 2)


def test_recording_that_begins_just_before_a_heel_strike_includes_that_strike(tmp_path):
    summary = read(tmp_path, *sampled(begin=PERIOD_S - 5e-3))
    assert summary["first_heel_strike_s"] == pytest.approx(PERIOD_S, abs=1e-5)
    assert all_steps_are_right(summary)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_standing_before_the_walk_is_not_a_step(noise, tmp_path):
    time, angle = sampled(begin=0.0, noise=noise)
    still = angle[0] + noise * np.random.default_rng(5).standard_normal((75, 2))
    summary = read(tmp_path, np.append(np.arange(75) / 100.0, 0.75 + time), np.concatenate((still, angle)))
    assert max(summary["step_periods_s"]) == pytest.approx(PERIOD_S, abs=1e-4 + 5.0 * noise)
    assert summary["steps"] >= 6


def test_outlier_far_from_a_heel_strike_is_reported_and_harmless(tmp_path):
    time, angle = sampled()
    angle[250, 1] = 0.0
    summary = read(tmp_path, time, angle)
    assert all_steps_are_right(summary)
    assert summary["doubts"] == ["Angle 2 is off its course at sample 251 (time 2.5 s), which is left out."]


def test_three_flipped_samples_are_reported_and_omitted(tmp_path):
    time, angle = sampled()
    angle[290:293, 0] *= -1.0
    summary = read(tmp_path, time, angle)
    assert all_steps_are_right(summary)
    assert summary["doubts"] == [
        "Angle 1 is off its course at samples 291 to 293 (time 2.9 to 2.92 s), which is left out."
    ]


def test_swapped_legs_are_reported_and_corrected(tmp_path):
    time, angle = sampled()
    angle[180:190] = angle[180:190, ::-1]
    summary = read(tmp_path, time, angle)
    assert all_steps_are_right(summary)
    assert summary["doubts"] == [
        "The legs are swapped at samples 181 to 190 (time 1.8 to 1.89 s), and are swapped back there."
    ]


def test_legs_swapped_while_passing_are_corrected(tmp_path):
    """Without the correction, the same leg would seem to strike twice in a row."""
    time, angle = sampled(fps=1000.0)
    rows = time > 4.0 * PERIOD_S
    first = np.flatnonzero(rows & (angle[:, 0] - angle[:, 1] > 0.0))[0]
    angle[first:] = angle[first:, ::-1]
    summary = read(tmp_path, time, angle)
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)
    assert "The legs are swapped at samples 3142 to 5277" in summary["doubts"][0]


@pytest.mark.parametrize("at_s", [0.3, 1.0, 1.8, 2.31])
@pytest.mark.parametrize("fps", [60.0, 100.0, 240.0])
def test_legs_swapped_while_close_together_are_corrected(at_s, fps, tmp_path):
    """As the legs pass each other, one of the two exchanges may be invisible."""
    time, angle = sampled(fps=fps, noise=3e-4)
    first = int(at_s * fps)
    angle[first : first + 3] = angle[first : first + 3, ::-1]
    summary = read(tmp_path, time, angle)
    assert summary["steps"] == 7
    assert all_steps_are_right(summary, period=4e-3, length=3e-3)
    assert len(summary["doubts"]) == 1
    assert f"The legs are swapped at samples {first + 1} to" in summary["doubts"][0]


@pytest.mark.parametrize("fps", [50.0, 100.0, 240.0])
@pytest.mark.parametrize("size", [-0.05, 0.05, 0.1])
@pytest.mark.parametrize("at_s", [1.5, 4.0 * PERIOD_S])
def test_slipping_sensor_is_reported_and_the_longest_part_kept(at_s, size, fps, tmp_path):
    time, angle = sampled(fps=fps, noise=2e-4)
    time, angle = time[time > 0.1], angle[time > 0.1]
    first = int(np.searchsorted(time, at_s))
    if at_s < 2.0:
        angle[:first, 0] += size
    else:
        angle[first:, 0] += size
    summary = read(tmp_path, time, angle)
    assert all_steps_are_right(summary, period=3e-3, length=3e-3)
    (doubt,) = summary["doubts"]
    slip = re.search(r"angle 1 jumps by (\S+) rad from sample (\d+) to (\d+)", doubt)
    assert float(slip[1]) == pytest.approx(-size if at_s < 2.0 else size, abs=0.004)
    assert int(slip[3]) == first + 1


@pytest.mark.parametrize("size", [0.005, 0.02, -0.05])
@pytest.mark.parametrize("beside", [-3, -1, 0, 2])
@pytest.mark.parametrize("leg", [0, 1])
def test_glitch_at_a_heel_strike_is_reported_and_omitted(leg, beside, size, tmp_path):
    time, angle = sampled(noise=2e-4)
    row = int(np.searchsorted(time, 3.0 * PERIOD_S)) + beside
    angle[row, leg] += size
    summary = read(tmp_path, time, angle)
    assert all_steps_are_right(summary, period=2e-3, length=1.5e-3)
    place = f"sample {row + 1} (time {time[row]:.6g} s)"
    assert summary["doubts"] == [f"Angle {leg + 1} is off its course at {place}, which is left out."]


@pytest.mark.parametrize("rows", [[250], [120, 320], [300, 301, 302]])
def test_large_outliers_are_reported_and_omitted(rows, tmp_path):
    time, angle = sampled(noise=5e-4)
    angle[rows, 1] += 0.4
    summary = read(tmp_path, time, angle)
    assert all_steps_are_right(summary, period=4e-3, length=3e-3)
    (doubt,) = summary["doubts"]
    assert all(f"{time[row]:.6g} " in doubt for row in (rows[0], rows[-1]))


def test_angles_from_the_upward_vertical_are_unwrapped_and_reported(tmp_path):
    time, angle = sampled()
    wrapped = np.degrees((angle + 2.0 * math.pi) % (2.0 * math.pi) - math.pi)
    summary = read(tmp_path, time, wrapped, "time (s),angle 1 (deg),angle 2 (deg)")
    assert all_steps_are_right(summary)
    assert summary["steps"] == 7
    assert [doubt.partition(" is measured from the upward vertical")[0] for doubt in summary["doubts"]] == [
        "Angle 1", "Angle 2",
    ]  # fmt: skip


def test_angles_from_zero_to_a_full_turn_are_unwrapped(tmp_path):
    time, angle = sampled()
    summary = read(tmp_path, time, angle % (2.0 * math.pi))
    assert all_steps_are_right(summary)
    assert summary["doubts"] == []


def test_horizontal_leg_is_rejected(tmp_path):
    time, angle = sampled()
    with pytest.raises(ConfigError, match=r"angle 2 is about -9\d degrees from the vertical"):
        read(tmp_path, time, angle - [0.0, 0.5 * math.pi])


@pytest.mark.parametrize(
    ("signs", "words"), [([1, -1], "angle 2"), ([-1, 1], "angle 1"), ([-1, -1], "angle 1 and angle 2")]
)
def test_reversed_signs_are_reported(signs, words, tmp_path):
    time, angle = sampled()
    summary = read(tmp_path, time, angle * signs)
    assert all_steps_are_right(summary)
    assert summary["steps"] == 7
    assert summary["doubts"] == [f"Heel strikes are found with the sign of {words} reversed."]


def test_return_walk_is_reported_and_omitted(tmp_path):
    both = np.concatenate((sampled(end=7.2 * PERIOD_S)[1], -sampled(end=5.0 * PERIOD_S)[1]))
    summary = read(tmp_path, np.arange(len(both)) / 100.0, both)
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)
    assert any("The walk turns round at time" in doubt for doubt in summary["doubts"])


def test_offset_of_one_sensor_is_reported(tmp_path):
    summary = read(tmp_path, *(sampled()[0], sampled()[1] + [0.02, 0.0]))
    offset = re.search(r"before the feet are level; angle 1 is (\S+) degrees too large", summary["doubts"][0])
    assert float(offset[1]) == pytest.approx(math.degrees(0.02), abs=0.1)


@pytest.mark.parametrize("offset", [0.005, 0.02, -0.03])
def test_opposite_offsets_are_reported_if_step_lengths_alternate(offset, tmp_path):
    time, angle = sampled(noise=2e-4)
    summary = read(tmp_path, time, angle + np.array([offset, -offset]))
    (doubt,) = summary["doubts"]
    assert "Step lengths alternate" in doubt
    found = [float(value) for value in re.findall(r"angle \d is (\S+) degrees too large", doubt)]
    assert found == pytest.approx(np.degrees([offset, -offset]), abs=0.05)


@pytest.mark.parametrize("distort", [lambda angle: angle * [0.95, 1.0], lambda angle: np.round(angle, 2)])
def test_gain_error_and_coarse_rounding_are_not_reported_as_tilt_alone(distort, tmp_path):
    time, angle = sampled(noise=2e-4, seed=2)
    (doubt,) = read(tmp_path, time, distort(angle))["doubts"]
    assert "a wrong gain, a tilt or coarse digits may be the cause" in doubt


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.3])
def test_steps_found_in_noise_are_rejected(noise, tmp_path):
    time, angle = sampled()
    noisy = angle + noise * np.random.default_rng(4).standard_normal(angle.shape)
    with pytest.raises(ConfigError, match="would be noise"):
        read(tmp_path, time, noisy)


def test_steps_far_shorter_than_a_leg_swing_are_rejected(tmp_path):
    time, angle = sampled()
    with pytest.raises(ConfigError, match=r"steps of 0\.1\d* s are not credible, because a leg of this walker swings"):
        read(tmp_path, 0.15 * time, angle)


def test_angles_measured_from_the_floor_are_reported_as_a_tilt(tmp_path):
    time, angle = sampled(fps=60.0, noise=2e-4)
    summary = read(tmp_path, time, angle + SLOPE)
    tilt = re.search(r"a tilt explains it, with both angles (\S+) degrees too large", summary["doubts"][0])
    assert float(tilt[1]) == pytest.approx(math.degrees(SLOPE), abs=0.05)


@pytest.mark.parametrize("fps", [25.0, 60.0, 100.0, 240.0])
@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_angles_without_offset_raise_no_warnings(noise, fps, tmp_path):
    assert read(tmp_path, *sampled(begin=0.3, fps=fps, noise=noise))["doubts"] == []


def test_implausibly_large_angles_are_rejected_until_a_unit_is_stated(tmp_path):
    time, angle = sampled()
    wide = 5.0 * (angle + SLOPE)
    rows = "\n".join(f"{t:.9f}\t{a:.12g}\t{b:.12g}" for t, (a, b) in zip(time, wide, strict=True))
    path = tmp_path / "walk.sto"
    path.write_text(f"walk\nversion=1\ninDegrees=no\nendheader\ntime\tangle_1\tangle_2\n{rows}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="the legs are 107 degrees apart at time"):
        walkerlab.read_walk(path, slope_deg=0.0)
    assert walkerlab.read_walk(path, units={"angle": "rad"}, slope_deg=0.0).summary["steps"] == 7


def test_implausibly_small_angles_raise_a_warning(tmp_path):
    """The angles are in radians from the slope's normal, but the header says degrees."""
    time, angle = sampled()
    header = "time (s),angle 1 (deg),angle 2 (deg)"
    rows = "\n".join(f"{t:.9f},{a:.12g},{b:.12g}" for t, (a, b) in zip(time, angle + SLOPE, strict=True))
    path = tmp_path / "walk.csv"
    path.write_text(f"{header}\n{rows}\n", encoding="utf-8")
    doubts = walkerlab.read_walk(path, slope_deg=0.0).summary["doubts"]
    assert any("only 0.37 degrees apart at heel strikes. The file may state" in doubt for doubt in doubts)


@pytest.mark.parametrize("belt_m_s", [0.0, 0.5279, 0.53, 0.56])
def test_walking_direction_follows_the_feet_on_floor_and_treadmill(belt_m_s, tmp_path):
    """On a treadmill the hip drifts forwards, backwards or only sideways."""
    summary = read_places(tmp_path, places_of(sampled()[1], belt_m_s))
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)
    assert summary["doubts"] == []


@pytest.mark.parametrize("degrees", [30.0, 90.0, 200.0])
def test_walk_may_cross_the_floor_in_any_direction(degrees, tmp_path):
    turn = math.radians(degrees)
    around = np.array([[math.cos(turn), 0.0, math.sin(turn)], [0.0, 1.0, 0.0], [-math.sin(turn), 0.0, math.cos(turn)]])
    summary = read_places(tmp_path, places_of(sampled()[1], 0.53) @ around)
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)


def test_stated_walking_direction_is_used(tmp_path):
    places = places_of(sampled()[1], 0.53)
    assert all_steps_are_right(read_places(tmp_path, places, walks="right"))
    for direction in ("left", "away"):
        with pytest.raises(ConfigError, match="holds no complete step"):
            read_places(tmp_path, places, walks=direction)
    assert all_steps_are_right(read_places(tmp_path, places[:, :, [2, 1, 0]] * [1.0, 1.0, -1.0], walks="away"))


def test_walk_there_and_back_is_cut_where_the_hip_turns(tmp_path):
    there = places_of(sampled(end=7.2 * PERIOD_S)[1])
    back = there * [-1.0, 1.0, 1.0] + (there[-1, 0] + there[0, 0]) * [1.0, 0.0, 0.0]
    summary = read_places(tmp_path, np.concatenate((there, back[:400])))
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)
    assert "The walk turns round at time 5.06 s" in summary["doubts"][0]


def test_missing_marker_is_a_gap_but_a_foot_at_the_origin_is_not(tmp_path):
    places = places_of(sampled()[1])
    places -= places[20, 2]
    assert np.abs(places[:70, 2]).max() < 1e-9
    assert all_steps_are_right(read_places(tmp_path, places))
    for missing in (0.0, -9.999):
        places[100:107, 1] = missing
        summary = read_places(tmp_path, places)
        assert all_steps_are_right(summary)
        value = f"({1e3 * missing:g}, {1e3 * missing:g}, {1e3 * missing:g})"
        assert (
            f"FOOT1.x, FOOT1.y, FOOT1.z at samples 101 to 107 ({value} is taken for 'not seen')" in summary["doubts"][0]
        )
    places[100:112, 1] = 0.0
    with pytest.raises(ConfigError, match=r"step 2 has no samples from 0\.99 to 1\.12 s") as zeros:
        read_places(tmp_path, places)
    assert "FOOT1.x, FOOT1.y, FOOT1.z at samples 101 to 112 ((0, 0, 0) is taken for 'not seen')" in zeros.value.message


@pytest.mark.parametrize("marker", [0, 1])
def test_frozen_marker_is_a_gap_and_a_foot_that_stands_still_is_not(marker, tmp_path):
    places = places_of(sampled()[1])
    assert np.ptp(places[75:100, 1], axis=0).max() < 1e-9
    places[150:157, marker] = places[149, marker]
    summary = read_places(tmp_path, places)
    assert all_steps_are_right(summary)
    assert re.search(r"at samples 1(4[5-9]|5[0-4]) to 157", summary["doubts"][0])
    places[150:165, marker] = places[149, marker]
    with pytest.raises(ConfigError, match="has no samples from") as refused:
        read_places(tmp_path, places)
    assert re.search(r"at samples 1(4[5-9]|5[0-4]) to 165", refused.value.message)


def test_frozen_angle_is_a_gap_and_coarse_digits_are_not(tmp_path):
    time, angle = sampled()
    rounded = np.degrees(angle).round(1)
    assert read(tmp_path, time, rounded, "time (s),angle 1 (deg),angle 2 (deg)")["doubts"] == []
    for at in (100, 130, 170):
        frozen = angle.copy()
        frozen[at : at + 7, 0] = frozen[at - 1, 0]
        summary = read(tmp_path, time, frozen)
        assert re.match(
            rf"Gaps are left out: angle 1 at samples \d+ to {at + 7} \(it stands still", summary["doubts"][0]
        )
        assert all_steps_are_right(summary, period=1e-4, length=1e-4)


def test_jump_of_leg_length_is_reported(tmp_path):
    places = places_of(sampled()[1])
    places[250, 1, 1] += 0.1
    summary = read_places(tmp_path, places)
    assert summary["doubts"] == ["The length of HIP>FOOT1 is off at sample 251 (time 2.5 s), which is left out."]
    assert all_steps_are_right(summary)
    places = places_of(sampled()[1])
    places[250:257, 1, 2] += 0.1
    summary = read_places(tmp_path, places)
    assert summary["doubts"][0].startswith("The length of HIP>FOOT1 is off at samples 251 to 257 (time 2.5 to 2.56 s)")
    assert all_steps_are_right(summary)
    places[257:262, 1, 2] += 0.1
    with pytest.raises(ConfigError, match="has no sample") as refused:
        read_places(tmp_path, places)
    assert "The length of HIP>FOOT1 is off at samples 251 to 262" in refused.value.message


def test_leg_whose_length_changes_along_the_walk_is_reported(tmp_path):
    places = places_of(sampled()[1])
    grows = 1.0 + 0.05 * np.linspace(0.0, 1.0, len(places))[:, None]
    places[:, 1] = places[:, 0] + grows * (places[:, 1] - places[:, 0])
    doubts = read_places(tmp_path, places)["doubts"]
    assert any(re.match(r"The length of HIP>FOOT1 changes by [345]\.\d% along the walk", doubt) for doubt in doubts)


@pytest.mark.parametrize("first", [30, 100, 180, 250])
def test_swapped_feet_are_corrected_if_they_are_separated_sideways(first, tmp_path):
    places = places_of(sampled()[1])
    places[first : first + 10, [1, 2]] = places[first : first + 10, [2, 1]]
    summary = read_places(tmp_path, places)
    assert all_steps_are_right(summary)
    assert f"The legs are swapped at samples {first + 1} to {first + 10}" in summary["doubts"][0]


def test_recording_of_a_running_gait_is_rejected(tmp_path):
    """A runner's hip is lowest as the legs pass each other."""
    places = places_of(sampled()[1])
    spread = np.abs(places[:, 1, 0] - places[:, 2, 0])
    places[:, :, 1] += (0.4 * spread)[:, None]
    with pytest.raises(ConfigError, match="this is running, not walking"):
        read_places(tmp_path, places)


@functools.cache
def kneed_walk():
    config = load(Path("kneed"), ("strides=3",)).config
    gait = {"fixedpoint": fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())}
    return simulate.run(restrict(config, PIPELINE["simulate"].takes), gait, Silent()).groups["trajectory"], config


@pytest.mark.parametrize(("name", "count"), [("angle", 0), ("shank_angle", 2)])
def test_shank_angles_of_a_kneed_walker_are_reported(name, count):
    trajectory, config = kneed_walk()
    rising = np.append(True, np.diff(trajectory["time"]) > 1e-9)
    angle = {f"angle {leg}": trajectory[name][rising, leg - 1] for leg in (1, 2)}
    quantities = {**angle, SAMPLE: 1.0 + np.arange(rising.sum())}
    walk = mend_angles(RecordedWalk(trajectory["time"][rising], quantities), "kneed.csv")
    steps = divide_into_steps(walk, rigid_walker(config), "kneed.csv")
    assert sum("as a shank does" in doubt for doubt in steps.doubts) == count
    assert np.diff(steps.touch_time_s) == pytest.approx(np.full(5, steps.touch_time_s[0]), abs=2e-4)


@pytest.mark.parametrize("fps", [25.0, 50.0, 240.0])
def test_95_percent_of_strikes_lie_within_two_standard_errors(fps, tmp_path):
    errors = []
    for seed in range(12):
        summary = read(tmp_path, *sampled(begin=0.2 + 0.03 * seed, fps=fps, noise=1e-3, seed=seed))
        strikes = summary["first_heel_strike_s"] + np.array([0.0, *summary["touch_times_s"]])
        errors += [*((strikes - PERIOD_S * np.round(strikes / PERIOD_S)) / summary["touch_errors_s"])]
    assert np.mean(np.abs(errors) < 2.0) > 0.95 - 2.0 * math.sqrt(0.95 * 0.05 / len(errors))
    assert np.max(np.abs(errors)) < 5.0


@pytest.mark.parametrize(("fps", "noise_deg", "seed"), [(240.0, 0.3, 2), (240.0, 0.7, 3), (120.0, 1.0, 0)])
def test_noise_of_a_film_neither_hides_a_strike_nor_raises_a_doubt_about_the_clock(fps, noise_deg, seed, tmp_path):
    """Rates must not come from a spline that follows the noise: the legs would seem to swing half as fast."""
    summary = read(tmp_path, *sampled(begin=0.1, fps=fps, noise=math.radians(noise_deg), seed=seed))
    assert summary["steps"] == 6
    assert summary["step_periods_s"] == pytest.approx([PERIOD_S] * 6, abs=0.04)
    assert not any("times as fast" in doubt for doubt in summary["doubts"])


def test_heel_strike_of_a_noisy_film_is_found_where_the_foot_comes_down(tmp_path):
    """If the feet stay almost level after a strike, noise makes them cross several times, and the mean of the crossings
    is 0.1 s late.
    """
    time = np.arange(-0.3, 0.3, 1.0 / 120.0)
    noise = 0.01 * np.random.default_rng(0).standard_normal(time.size)
    # The foot of leg 1 falls through height 0 and stays 12 mm below it. The noise is 10 mm.
    fall = np.where(time < 0.0, -0.5 * time, 0.0) - 0.012 * (time > 0.0) + noise
    angle = np.column_stack((0.3 + fall, np.full(time.size, -0.3)))
    crossings = candidates(time, angle, lambda each: each[:, 0] - 0.3)
    assert np.mean([crossing for crossing, *_ in crossings]) > 0.05
    assert merge_repeats(crossings, np.inf)[0][0] == pytest.approx(0.0, abs=0.02)
