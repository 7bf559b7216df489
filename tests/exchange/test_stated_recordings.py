"""Tests of the keys that state what a file does not: tilt, direction, belt, frame rate, part, likelihood, signs,
constants.
"""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from filmed_walks import (
    LENGTH_M,
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
from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import parse_pairs

TILT = math.radians(1.5)


# Columns


@pytest.mark.parametrize(
    ("header", "change", "source"),
    [
        ("right thigh (deg)", lambda a: a - 90.0, "right thigh+90deg"),
        ("right thigh (deg)", lambda a: a - 90.0, "right thigh + 1.5707963267948966 rad"),
        ("q (deg)", lambda a: 90.0 - a, "-q+90deg"),
        ("q-1 (deg)", lambda a: -a, "-q-1"),
        ("q (deg)", lambda a: a + 2.5, "q-2.5deg"),
        ("-q (deg)", lambda a: a, "-q"),
        ("q+90deg", lambda a: a, "q+90deg"),
        ("q+90deg", lambda a: a, '"q+90deg"'),
        ("-q", lambda a: -a, '"-q"'),
    ],
)
def test_sign_and_offset_of_a_column_can_be_stated(header, change, source, tmp_path):
    time, angle = sampled()
    degrees = np.degrees(angle)
    first = change(degrees[:, 0])
    units = {} if "(" in header else {"angle": "deg"}
    summary = read(tmp_path, time, np.stack([first, degrees[:, 1]], axis=1), f"time (s),{header},angle 2 (deg)",
                   columns={"angle 1": source}, units=units)  # fmt: skip
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("angle 1+90grad", "in 'grad', which is not a unit of angle"),
        ("angle 1+5mm", "in 'mm', which is not a unit of angle"),
        ("-nothing", "has no column 'nothing'"),
        ("angle 1+90", r"has no column 'angle 1\+90'"),
    ],
)
def test_constant_offset_without_an_angle_unit_is_refused(source, message, tmp_path):
    time, angle = sampled()
    with pytest.raises(ConfigError, match=message):
        read(tmp_path, time, angle, columns={"angle 1": source})


def test_error_for_angles_from_the_horizontal_suggests_the_offset_to_add(tmp_path):
    time, angle = sampled()
    with pytest.raises(ConfigError, match=r"is about -8[89] degrees") as refused:
        read(tmp_path, time, np.degrees(angle) - 90.0, "time (s),right thigh (deg),angle 2 (deg)",
             columns={"angle 1": "right thigh"})  # fmt: skip
    assert refused.value.advice.endswith('--columns "angle 1=right thigh+90deg".')


def test_quotes_protect_commas_in_options():
    assert parse_pairs("--columns", ['angle 1="left, thigh"+90deg,angle 2=b']) == {
        "angle 1": '"left, thigh"+90deg',
        "angle 2": "b",
    }


def test_angle_of_a_marker_line_may_be_offset_but_not_negated(tmp_path):
    places = places_of(sampled()[1])
    turn = np.array([[math.cos(TILT), -math.sin(TILT)], [math.sin(TILT), math.cos(TILT)]])
    places[:, 1, :2] = places[:, 0, :2] + (places[:, 1, :2] - places[:, 0, :2]) @ turn.T
    lines = {"angle 1": "HIP>FOOT1-1.5deg", "angle 2": "HIP>FOOT2"}
    assert all_steps_are_right(read_places(tmp_path, places, columns=lines), period=1e-4, length=1e-4)
    with pytest.raises(ConfigError, match="changes the sign of a line's angle"):
        read_places(tmp_path, places, columns={**lines, "angle 1": "-HIP>FOOT1"})


# Tilt


@pytest.mark.parametrize("stated", [1.5, "free"])
def test_tilt_of_the_camera_is_subtracted(stated, tmp_path):
    time, angle = sampled()
    exact = stated == 1.5
    summary = read(tmp_path, time, angle + TILT, camera_tilt_deg=stated)
    assert summary["steps"] == 7
    assert all_steps_are_right(summary, *([1e-5, 1e-5] if exact else [1e-3, 1e-3]))
    found = [re.fullmatch(r"The camera's tilt is 1\.(49|50|51) degrees, .*", doubt) for doubt in summary["doubts"]]
    assert len(found) == (0 if exact else 1)
    assert all(found)


def test_angles_from_the_floor_are_turned_by_the_slope(tmp_path):
    time, angle = sampled()
    assert all_steps_are_right(read(tmp_path, time, angle + SLOPE, camera_tilt_deg="floor"))


def test_level_camera_has_no_estimated_tilt(tmp_path):
    summary = read(tmp_path, *sampled(noise=1e-3), camera_tilt_deg="free")
    tilt = float(summary["doubts"][0].split()[4])
    assert abs(tilt) < 0.05


def test_free_tilt_excludes_a_free_offset():
    with pytest.raises(ConfigError, match="camera_tilt_deg: free estimates already"):
        load(Path("paper"), ("identify.camera_tilt_deg=free", "identify.nuisance=[angle_offset_rad]"))
    block = load(Path("paper"), ("identify.camera_tilt_deg=free", "identify.nuisance=[clock_rate]")).config.identify
    assert block.sensors == ("clock_rate", "angle_offset_rad")


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("camera_tilt_deg=46", "is out of bounds"),
        ("camera_tilt_deg=level", "is not allowed"),
        ("from_s=2", "is not after from_s"),
        ("fps=0", "is out of bounds"),
        ("belt_speed_m_s=-1", "is out of bounds"),
    ],
)
@pytest.mark.parametrize("block", ["recording", "identify"])
def test_impossible_values_of_recording_keys_are_refused(block, setting, message):
    with pytest.raises(ConfigError, match=message):
        load(Path("paper"), (f"{block}.to_s=1", f"{block}.{setting}"))


# Frames, clocks and parts


def table(folder, header, rows):
    path = folder / "film.csv"
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


def steps_of(path, **keys):
    return walkerlab.read_walk(path, slope_deg=math.degrees(SLOPE), **keys).summary


@pytest.mark.parametrize("name", ["frame", "Frame#", "frame_idx", "n"])
def test_frame_numbers_are_converted_to_times_by_the_frame_rate(name, tmp_path):
    time, angle = sampled(fps=240.0)
    kept = np.delete(np.arange(time.size), [300, 301])
    path = table(tmp_path, f"{name},angle 1 (rad),angle 2 (rad)", [(17 + n, *angle[n]) for n in kept])
    columns = {"time": name} if name == "n" else {}
    summary = steps_of(path, columns=columns, fps=240.0)
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)
    if name != "n":
        with pytest.raises(ConfigError, match="has no time column") as refused:
            steps_of(path)
        assert "--fps" in refused.value.advice


def test_frame_rate_restores_the_true_times_of_a_slow_motion_film(tmp_path):
    time, angle = sampled(fps=240.0)
    path = table(tmp_path, "time (s),angle 1 (rad),angle 2 (rad)", zip(8.0 * time, *angle.T, strict=True))
    doubts = steps_of(path)["doubts"]
    assert any("would swing 8 times as fast as those in the recording" in doubt for doubt in doubts)
    summary = steps_of(path, fps=240.0)
    assert all_steps_are_right(summary)
    assert summary["doubts"] == ["The file's times, 30 frames/s, are replaced by 240 frames/s."]


def variable_film():
    """Return times (frames,) and noisy angles of a film whose rate falls from 60 to 30 and 24 frames/s and
    rises again.
    """
    times = [0.0]
    while times[-1] < 7.4 * PERIOD_S:
        slow = 24.0 if times[-1] > 3.0 else 30.0
        times.append(times[-1] + 1.0 / (slow if 1.5 <= times[-1] <= 4.5 else 60.0))
    time = np.array(times[:-1])
    return time, angles_at(time) + math.radians(0.15) * np.random.default_rng(0).standard_normal((time.size, 2))


def constant_rate(time, fps):
    """Return the times of a film that ffmpeg converted to a constant rate, and the frame that it shows at each time."""
    converted = np.arange(0.0, time[-1], 1.0 / fps)
    return converted, np.searchsorted(np.floor(fps * time + 0.5), np.arange(converted.size), "right") - 1


def test_film_of_variable_rate_needs_the_time_of_each_frame(tmp_path):
    time, angle = variable_film()

    def error_and_doubts(times, rows):
        summary = read(tmp_path, times, angle[rows])
        return np.sqrt(np.mean((np.array(summary["step_periods_s"]) - PERIOD_S) ** 2)), " ".join(summary["doubts"])

    every = np.arange(time.size)
    error, doubts = error_and_doubts(time, every)
    assert error < 2e-3
    assert not doubts
    error, doubts = error_and_doubts(*constant_rate(time, 60.0))
    assert error > 4e-3
    assert "Heel strikes are uncertain" in doubts
    error, doubts = error_and_doubts(every / 60.0, every)
    assert error > 0.2
    assert "swing 0.57 times as fast" in doubts
    error, doubts = error_and_doubts(every * time[-1] / every[-1], every)
    assert error > 0.2
    assert not doubts


def test_frame_rate_of_a_table_with_one_row_is_refused_with_a_message(tmp_path):
    path = table(tmp_path, "time (s),angle 1 (rad),angle 2 (rad)", [(0.0, 0.1, -0.1)])
    with pytest.raises(ConfigError):
        steps_of(path, fps=100.0)


def test_angles_that_would_overflow_are_refused_with_a_message(tmp_path):
    path = table(tmp_path, "time (s),angle 1 (rad),angle 2 (rad)", [(0.01 * n, 1e300 * n, 0.1) for n in range(200)])
    with pytest.raises(ConfigError):
        steps_of(path)


def test_table_without_times_counts_samples_as_frames(tmp_path):
    _, angle = sampled(fps=60.0)
    path = table(tmp_path, "angle 1 (rad),angle 2 (rad)", angle)
    assert all_steps_are_right(steps_of(path, fps=60.0), period=2e-5, length=2e-5)


def test_time_column_is_rejected_if_it_is_stated_as_frame_numbers(tmp_path):
    time, angle = sampled()
    path = table(tmp_path, "seconds,angle 1 (rad),angle 2 (rad)", zip(time, *angle.T, strict=True))
    with pytest.raises(ConfigError, match="'seconds' does not count frames"):
        steps_of(path, columns={"time": "seconds"}, fps=100.0)


CLOCKS = {
    "clock": lambda t: f"23:59:{58 + t:09.6f}" if t < 2.0 else f"00:00:{t - 2.0:09.6f}",
    "minutes": lambda t: f"12:{t:09.6f}",
    "comma": lambda t: f'"10:00:{t:09.6f}"'.replace(".", ","),
    "time delta of pandas": lambda t: f"0 days 00:00:{t:09.6f}",
    "duration of polars": lambda t: f"PT{t:.6f}S",
    "date": lambda t: f"2026-03-29 01:59:{t:09.6f}",
    "date with zone": lambda t: f"2026-03-29T01:59:{t:09.6f}+01:00",
}


@pytest.mark.parametrize("style", CLOCKS)
def test_clock_times_are_converted_to_seconds(style, tmp_path):
    time, angle = sampled()
    rows = [(CLOCKS[style](t), *each) for t, each in zip(time.tolist(), angle, strict=True)]
    summary = steps_of(table(tmp_path, "time,angle 1 (rad),angle 2 (rad)", rows))
    assert summary["steps"] == 7
    assert all_steps_are_right(summary)


def test_part_of_a_recording_can_be_read(tmp_path):
    time, angle = sampled()
    summary = read(tmp_path, time, angle, from_s=1.0, to_s=4.0)
    assert summary["first_heel_strike_s"] == pytest.approx(2.0 * PERIOD_S, abs=1e-4)
    assert summary["steps"] == 3
    with pytest.raises(ConfigError, match=r"no sample from 9 to inf s: its times go from 0 to 5\.27 s") as refused:
        read(tmp_path, time, angle, from_s=9.0)
    assert "--from-s" in refused.value.advice


def test_table_without_rows_has_no_samples(tmp_path):
    path = tmp_path / "walk.mot"
    path.write_text("Coordinates\nversion=1\ninDegrees=yes\nendheader\ntime\tangle 1\tangle 2\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="has no sample with values of"):
        steps_of(path)


def test_values_whose_squares_overflow_are_gaps(tmp_path):
    places = places_of(sampled()[1])
    places[300:303, 1] = 1e200
    summary = read_places(tmp_path, places)
    assert all_steps_are_right(summary)
    assert "FOOT1.x, FOOT1.y, FOOT1.z at samples 301 to 303" in summary["doubts"][0]


# Treadmill


def test_step_lengths_follow_from_the_belt_speed(tmp_path):
    """The leg is 10 % shorter than in the config."""
    speed = 0.9 * LENGTH_M / PERIOD_S
    summary = read(tmp_path, *sampled(), belt_speed_m_s=speed)
    assert summary["step_lengths_m"] == pytest.approx([0.9 * LENGTH_M] * 7, abs=1e-5)
    assert any("0.9 times the one that follows from the leg angles" in doubt for doubt in summary["doubts"])
    drift = 0.1 * LENGTH_M / PERIOD_S
    on_belt = read_places(tmp_path, places_of(sampled()[1], speed), belt_speed_m_s=speed)
    assert drift > 0.0
    assert on_belt["step_lengths_m"] == pytest.approx([LENGTH_M] * 7, rel=1e-3)
    assert on_belt["doubts"] == []


def test_lengths_follow_from_periods_and_belt_speed(tmp_path):
    path = table(tmp_path, "period_s", [(p,) for p in (0.70, 0.71, 0.69, 0.70, 0.705)])
    result = walkerlab.identify(path, fit=["slope_deg"], belt_speed_m_s=0.52)
    assert "step_length_m" in result.summary["noise"]["measurement"]


def test_frame_rate_is_rejected_for_a_table_of_steps(tmp_path):
    path = table(tmp_path, "period_s", [(0.7,), (0.71,), (0.69,)])
    with pytest.raises(ConfigError, match=r"identify\.fps: a table of steps has no samples"):
        walkerlab.identify(path, fit=["slope_deg"], fps=240.0)


# Likelihoods


def deeplabcut(places, likelihood, individuals=()):
    """Return a table in DeepLabCut's layout: three header rows, or four with individuals, and frames as the index."""
    names = [f"{part},{part},{part}" for part in ("hip", "foot1", "foot2")]
    head = [f"scorer{',net' * 9}"]
    head += [f"individuals{f',{each}' * 9}" for each in individuals]
    head += [f"bodyparts,{','.join(names)}", f"coords{',x,y,likelihood' * 3}"]
    rows = [
        ",".join([str(n), *(f"{v:.4f}" for marker, p in zip(row, chance, strict=True) for v in (*marker, p))])
        for n, (row, chance) in enumerate(zip(places, likelihood, strict=True))
    ]
    return "\n".join([*head, *rows]) + "\n"


def pixels(fps):
    places = places_of(sampled(fps=fps)[1], fps=fps)[:, :, :2]
    return [400.0, 900.0] + places * [300.0, -300.0]


LEGS = {"angle 1": "hip>foot1", "angle 2": "hip>foot2"}


def test_three_header_rows_and_likelihoods_are_read(tmp_path):
    places = pixels(240.0)
    likelihood = np.full(places.shape[:2], 0.99)
    likelihood[700:712, 1] = 0.1
    places[700:712, 1] += 30.0
    path = tmp_path / "film.csv"
    path.write_text(deeplabcut(places, likelihood), encoding="utf-8")
    summary = steps_of(path, columns=LEGS, fps=240.0, min_likelihood=0.6)
    assert summary["steps"] == 7
    assert all_steps_are_right(summary, period=2e-4, length=2e-4)
    assert "samples 701 to 712 (likelihoods below 0.6 are taken for 'not seen')" in summary["doubts"][0]
    doubts = steps_of(path, columns=LEGS, fps=240.0)["doubts"]
    assert "Likelihoods are below 0.5: foot1 at samples 701 to 712" in doubts[0]
    path.write_text(deeplabcut(places, likelihood, ["walker"]), encoding="utf-8")
    named = {angle: line.replace("hip", "walker.hip").replace("foot", "walker.foot") for angle, line in LEGS.items()}
    assert steps_of(path, columns=named, fps=240.0, min_likelihood=0.6)["steps"] == 7


def test_minimum_likelihood_is_refused_for_data_without_likelihoods(tmp_path):
    with pytest.raises(ConfigError, match="has no likelihoods of markers"):
        read(tmp_path, *sampled(), min_likelihood=0.6)


@pytest.mark.parametrize("tilt", ["floor", "free"])
def test_slope_is_estimated_from_angles_measured_from_the_floors_normal(tilt, tmp_path):
    time, angle = sampled(fps=60.0, noise=2e-4)
    path = table(tmp_path, "time (s),angle 1 (rad),angle 2 (rad)", zip(time, *(angle + SLOPE).T, strict=True))
    result = walkerlab.identify(path, fit=["slope_deg"], level="angles", camera_tilt_deg=tilt)
    (row,) = result.summary["estimates"]
    assert row["value"] == pytest.approx(math.degrees(SLOPE), abs=4.0 * row["standard_error"] + 1e-3)
    assert "angle_offset_rad" in result.summary["nuisance"]


# Sports2D


def test_slope_of_a_sports2d_film_is_estimated_only_if_the_floor_is_stated(tmp_path):
    path = tmp_path / "walk.mot"
    path.write_text(sports2d_angles(angles_at(sampled()[0]) + SLOPE), encoding="utf-8")
    columns = {"angle 1": "right thigh+90deg", "angle 2": "left thigh+90deg"}
    with pytest.raises(ConfigError, match="which rotates its data until the floor is level") as refused:
        walkerlab.identify(path, fit=["slope_deg"], level="angles", columns=columns)
    assert "--camera-tilt floor" in refused.value.advice


def sports2d_angles(angle):
    """Return a table of segment angles from the horizontal, in the layout of Sports2D 0.8.34."""
    head = ["Coordinates", "version=1", f"nRows={len(angle)}", "nColumns=3", "inDegrees=yes", "", "endheader"]
    rows = [f"{n / 100.0}\t" + "\t".join(map(str, row)) for n, row in enumerate(np.degrees(angle) - 90.0)]
    return "\n".join([*head, "time\tright thigh\tleft thigh", *rows]) + "\n"


@pytest.mark.parametrize(("walks", "sign"), [(None, 1.0), ("right", 1.0), ("left", -1.0)])
def test_sports2d_levels_the_floor_and_says_so(walks, sign, tmp_path):
    path = tmp_path / "walk.mot"
    path.write_text(sports2d_angles(angles_at(sampled()[0]) + sign * SLOPE), encoding="utf-8")
    columns = {"angle 1": "right thigh+90deg", "angle 2": "left thigh+90deg"}
    summary = steps_of(path, columns=columns, walks=walks)
    assert all_steps_are_right(summary)
    assert summary["doubts"][0].startswith("Sports2D (angles) levels the floor, so angles are taken from the floor's")
    path.write_text(sports2d_angles(angles_at(sampled()[0])), encoding="utf-8")
    assert steps_of(path, columns=columns, camera_tilt_deg=0)["doubts"] == []


@pytest.mark.parametrize("apart_m", [0.0, 0.05])
def test_legs_that_do_not_meet_at_one_hip_raise_a_doubt(apart_m, tmp_path):
    time, angle = sampled()
    hip, *feet = places_of(angle)[:, :, :2].swapaxes(0, 1)
    other = np.c_[apart_m * np.sin(2.0 * np.pi * time), 0.0 * time]
    # The whole second leg is moved, so its length stays the same.
    markers = {"HIP1": hip, "FOOT1": feet[0], "HIP2": hip + other, "FOOT2": feet[1] + other}
    header = ["time (s)", *(f"{name}.{axis} (m)" for name in markers for axis in "xy")]
    table = np.c_[time, *markers.values()]
    np.savetxt(tmp_path / "walk.csv", table, "%.9f", ",", header=",".join(header), comments="")
    columns = {"angle 1": "HIP1>FOOT1", "angle 2": "HIP2>FOOT2"}
    doubts = walkerlab.read_walk(tmp_path / "walk.csv", columns, slope_deg=math.degrees(SLOPE)).summary["doubts"]
    assert [doubt for doubt in doubts if "meet at one hip" in doubt] == doubts
    assert bool(doubts) is bool(apart_m)
