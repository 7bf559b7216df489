"""Read files written by real programs, for those that are installed."""

import datetime
import math
import warnings

import numpy as np
import pytest
from filmed_walks import SLOPE, all_steps_are_right, places_of, sampled

import walkerlab
from walkerlab.config.recording import Recorded
from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import as_walk
from walkerlab.exchange.recording import read_recording

RATE_HZ = 10.0
TIMES = np.arange(40) / RATE_HZ
ANGLES = np.stack([0.1 * np.sin(TIMES), -0.2 * np.cos(TIMES)], axis=1)
HIP = np.stack([100.0 * TIMES, np.full_like(TIMES, 900.0), np.zeros_like(TIMES)])
FEET = [HIP + 900.0 * np.stack([np.sin(a), -np.cos(a), 0.0 * a]) for a in ANGLES.T]
MARKERS = dict(zip(("HIP", "F1", "F2"), (HIP, *FEET), strict=True))  # (3, samples) mm
LINES = {"angle 1": "HIP>F1", "angle 2": "HIP>F2"}


def walk_of(path, columns=(), units=()):
    return as_walk(read_recording(path), Recorded(columns=dict(columns), units=dict(units)))


# C3D


def write_with_ezc3d(path, markers, units=("mm",), residuals=None):
    ezc3d = pytest.importorskip("ezc3d", reason="ezc3d is not installed")
    content = ezc3d.c3d()
    labels = [label for label, _ in markers]
    for name, value in {"RATE": [RATE_HZ], "LABELS": labels, "UNITS": list(units)}.items():
        content["parameters"]["POINT"][name]["value"] = value
    points = np.ones((4, len(markers), TIMES.size))
    points[:3] = np.stack([values for _, values in markers], axis=1)
    content["data"]["points"] = points
    if residuals is not None:
        content["data"]["meta_points"]["residuals"] = residuals
    content.write(str(path))


@pytest.mark.parametrize("units", [("mm",), ()])
def test_blank_and_repeated_c3d_labels_are_harmless(units, tmp_path):
    path = tmp_path / "walk.c3d"
    spare = [("", 0.0 * HIP), ("*1", HIP), ("", HIP)]
    write_with_ezc3d(path, [*spare, *MARKERS.items(), ("*1", 2.0 * HIP)], units)
    assert walk_of(path, LINES).both_legs("angle") == pytest.approx(ANGLES, abs=1e-6)
    with pytest.raises(ConfigError, match="2 columns have this name"):
        walk_of(path, {**LINES, "angle 2": "HIP>*1"})


@pytest.mark.parametrize("count", [254, 256, 600])
def test_c3d_labels_continue_in_the_next_parameter(count, tmp_path):
    path = tmp_path / "walk.c3d"
    write_with_ezc3d(path, [*((f"M{n}", 0.0 * HIP) for n in range(count)), *MARKERS.items()])
    recording = read_recording(path)
    assert f"M{count - 1}.x" in recording.columns
    assert walk_of(path, LINES).both_legs("angle") == pytest.approx(ANGLES, abs=1e-6)


def gaps_of(path):
    """Return the samples at which the second foot is missing."""
    return np.flatnonzero(np.isnan(read_recording(path).columns["F2.x"])).tolist()


def test_negative_residual_written_by_ezc3d_is_a_gap(tmp_path):
    """The sample is a gap even if the file has a position there."""
    path = tmp_path / "walk.c3d"
    residuals = np.zeros((1, 3, TIMES.size))
    residuals[0, 2, [7, 8]] = -1.0
    values = FEET[1].copy()
    values[:, 20] = np.nan
    write_with_ezc3d(path, [("HIP", HIP), ("F1", FEET[0]), ("F2", values)], residuals=residuals)
    assert gaps_of(path) == [7, 8, 20]


@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_negative_residual_in_a_file_from_c3d_is_read_as_a_gap(scale, tmp_path):
    """The file may store floating-point numbers or, with a positive scale, integers."""
    pytest.importorskip("ezc3d", reason="ezc3d, which reads C3D, is not installed")
    c3d = pytest.importorskip("c3d", reason="c3d is not installed")
    path = tmp_path / "walk.c3d"
    writer = c3d.Writer(point_rate=RATE_HZ, point_scale=scale)
    frames = []
    for sample in range(TIMES.size):
        points = np.zeros((3, 5))
        points[:, :3] = [values[:, sample] for values in MARKERS.values()]
        points[2, 3] = -1.0 if sample in (7, 8) else 0.0
        frames.append((points, np.zeros((0, 0))))
    with warnings.catch_warnings(), path.open("wb") as file:
        warnings.simplefilter("ignore")
        writer.add_frames(frames)
        writer.set_point_labels(list(MARKERS))
        writer.write(file)
    assert gaps_of(path) == [7, 8]
    walk = walk_of(path, {"angle 1": "HIP>F1", "angle 2": "HIP>F1"})
    assert walk.quantities["angle 1"] == pytest.approx(ANGLES[:, 0], abs=1e-6 if scale < 0.0 else 2e-4)


# pandas


def frame(index=None):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    return pandas.DataFrame({"angle 1 (rad)": ANGLES[:, 0], "angle 2 (rad)": ANGLES[:, 1], "phase": "swing"}, index)


@pytest.mark.parametrize("style", [{}, {"sep": ";", "decimal": ","}, {"sep": "\t", "decimal": ","}, {"decimal": ","}])
def test_data_frame_with_a_default_index_is_read(style, tmp_path):
    path = tmp_path / "walk.csv"
    table = frame()
    table.insert(0, "time (s)", TIMES)
    table.to_csv(path, **style)
    assert walk_of(path).both_legs("angle") == pytest.approx(ANGLES, abs=1e-12)


def test_data_frame_with_the_time_as_index_is_read(tmp_path):
    """kineticstoolkit's to_dataframe() writes such a frame. Its header begins with an empty cell."""
    path = tmp_path / "walk.csv"
    frame(TIMES).to_csv(path)
    walk = walk_of(path, {"time": "column 1"}, {"time": "s"})
    assert walk.time_s == pytest.approx(TIMES)
    assert walk.both_legs("angle") == pytest.approx(ANGLES, abs=1e-12)
    frame(TIMES).to_csv(path, index_label="time (s)")
    assert walk_of(path).time_s == pytest.approx(TIMES)


# OpenSim


def opensim():
    module = pytest.importorskip("opensim", reason="opensim is not installed", exc_type=ImportError)
    module.Logger.setLevelString("off")
    return module


def test_opensim_table_with_spaces_in_its_labels_is_read(tmp_path):
    osim = opensim()
    table = osim.TimeSeriesTable()
    table.setColumnLabels(["right leg", "left leg"])
    for time, row in zip(TIMES, np.degrees(ANGLES), strict=True):
        table.appendRow(float(time), osim.RowVector(row.tolist()))
    for in_degrees, name in (("yes", "walk.mot"), ("yes", "walk.sto")):
        table.addTableMetaDataString("inDegrees", in_degrees)
        path = tmp_path / name
        osim.STOFileAdapter.write(table, str(path))
        walk = walk_of(path, {"angle 1": "right leg", "angle 2": "left leg"})
        assert walk.both_legs("angle") == pytest.approx(ANGLES, abs=1e-6)
        table.removeTableMetaDataKey("inDegrees")


def test_missing_opensim_markers_are_gaps(tmp_path):
    osim = opensim()
    table = osim.TimeSeriesTableVec3()
    table.setColumnLabels(list(MARKERS))
    table.addTableMetaDataString("DataRate", str(RATE_HZ))
    table.addTableMetaDataString("Units", "mm")
    for sample, time in enumerate(TIMES):
        places = [values[:, sample] for values in MARKERS.values()]
        if sample == 7:
            places[2] = np.full(3, np.nan)
        table.appendRow(float(time), osim.RowVectorVec3([osim.Vec3(*place.tolist()) for place in places]))
    path = tmp_path / "walk.trc"
    osim.TRCFileAdapter.write(table, str(path))
    assert gaps_of(path) == [7]
    walk = walk_of(path, {"angle 1": "HIP>F1", "angle 2": "HIP>F1"})
    assert walk.quantities["angle 1"] == pytest.approx(ANGLES[:, 0], abs=1e-5)


HEADERS = ["datacolumns 3\ndatarows 2\n", "nRows=2\nnColumns=3\n", *(
    f"version={version}\nnRows=2\nnColumns=3\n{degrees}"
    for version in (1, 2) for degrees in ("", "inDegrees=yes\n", "inDegrees=no\n")
)]  # fmt: skip


@pytest.mark.parametrize("name", ["walk.mot", "walk.sto"])
@pytest.mark.parametrize("header", HEADERS)
def test_opensim_angles_in_degrees_are_converted(name, header, tmp_path):
    osim = opensim()
    path = tmp_path / name
    path.write_text(f"name walk\n{header}endheader\ntime\ta\tb\n0\t1\t2\n1\t3\t4\n", encoding="utf-8")
    unit = "deg" if osim.Storage(str(path)).isInDegrees() else "rad"
    assert read_recording(path).kind_units["angle"] == unit


# Whole walks, whose periods and lengths are read back


FPS = 100.0
LEGS = {"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"}
HEIGHT_PX = 600.0


def walk_right(tmp_path, name, **keys):
    """Read a file, and check that it has the steps of the walk that was written. Return the warnings."""
    summary = walkerlab.read_walk(tmp_path / name, slope_deg=math.degrees(SLOPE), **keys).summary
    assert summary["steps"] == 7
    assert all_steps_are_right(summary, period=1e-4, length=1e-4)
    return summary["doubts"]


def pixels():
    """Return positions (samples, marker, axis) in a picture, with y downwards."""
    return [400.0, 900.0] + places_of(sampled()[1])[:, :, :2] * [HEIGHT_PX, -HEIGHT_PX]


# Sports2D and Pose2Sim


def sports2d():
    process = pytest.importorskip("Sports2D.process", reason="Sports2D is not installed", exc_type=ImportError)
    return process, pytest.importorskip("pandas")


def angles_of_sports2d(process, walks, side):
    """Return the leg angles (samples, 2) in degrees that Sports2D computes, with its corrections, for a walk to the
    right or left.
    """
    from Pose2Sim.common import angle_dict

    across = (pixels() - pixels()[:, :1]) * [1.0 if walks == "right" else -1.0, 1.0]
    names, keypoints = ["right thigh", "left thigh"], ["RHip", "RKnee", "LKnee", "LHip"]
    places = np.stack([across[:, 0], across[:, 1], across[:, 2], across[:, 0]], axis=1)
    about = side, False, list(range(4)), keypoints, names, angle_dict
    angles = np.array([process.compute_angles_for_person(row[:, 0], row[:, 1], *about)[1] for row in places])
    # Sports2D subtracts the angle of the floor that `compute_floor_line` finds in the picture.
    return angles - math.degrees(-SLOPE if walks == "right" else SLOPE)


@pytest.mark.parametrize(("walks", "side"), [("right", "right"), ("right", "none"), ("left", "left"), ("left", "none")])
def test_sports2d_angles_are_measured_from_the_horizontal_and_the_floor(walks, side, tmp_path):
    process, pandas = sports2d()
    table = pandas.DataFrame(angles_of_sports2d(process, walks, side), columns=["right thigh", "left thigh"])
    process.make_mot_with_angles(table, pandas.Series(sampled()[0]), str(tmp_path / "walk.mot"))
    columns = {"angle 1": "right thigh+90deg", "angle 2": "left thigh+90deg"}
    doubts = walk_right(tmp_path, "walk.mot", columns=columns, walks=walks)
    assert doubts[0].startswith("Sports2D (angles) levels the floor")


@pytest.mark.parametrize("level", [True, False])
def test_sports2d_markers_in_metres_are_measured_from_the_floor(level, tmp_path):
    process, pandas = sports2d()
    names, columns = ["RHip", "RAnkle", "LAnkle"], {"angle 1": "RHip>RAnkle", "angle 2": "RHip>LAnkle"}
    parts = []
    for marker, name in enumerate(names):
        part = pandas.DataFrame(np.c_[pixels()[:, marker], np.zeros(len(pixels()))], columns=[name] * 3)
        floor_rad = -SLOPE  # sign as `compute_floor_line` returns it
        size = (1.0, HEIGHT_PX, 10.0, 1920, 1080, 0.0, 900.0, -floor_rad, "none")
        parts.append(process.convert_px_to_meters(part, *size) if level else part)
    table = pandas.concat([pandas.Series(sampled()[0], name="time"), *parts], axis=1)
    name = f"film_Sports2D_{'m' if level else 'px'}_person00.trc"
    process.make_trc_with_trc_data(table, str(tmp_path / name), fps=FPS)
    doubts = walk_right(tmp_path, name, columns=columns)
    assert doubts == (
        ["Sports2D levels the floor, so angles are taken from the floor's normal: state --camera-tilt 0 if its "
         "floor_angle was 0."] if level else []
    )  # fmt: skip
    stated = walkerlab.read_walk(tmp_path / name, columns, slope_deg=math.degrees(SLOPE), camera_tilt_deg="floor")
    assert (stated.summary["doubts"] == []) is level


# DeepLabCut, movement, sleap-io


def poses():
    save_poses = pytest.importorskip("movement.io.save_poses", reason="movement is not installed", exc_type=ImportError)
    load_poses = pytest.importorskip("movement.io.load_poses", exc_type=ImportError)
    places, likelihood = pixels(), np.full((len(pixels()), 3, 1), 0.9)
    places[200:205, 1] += 50.0
    likelihood[200:205, 1] = 0.05
    data = load_poses.from_numpy(
        places.transpose(0, 2, 1)[..., None], likelihood, ["walker"], ["HIP", "FOOT1", "FOOT2"], fps=FPS
    )
    return save_poses, data


@pytest.mark.parametrize("writer", ["to_dlc_file", "to_lp_file"])
def test_poses_written_by_the_movement_package_are_read(writer, tmp_path):
    save_poses, data = poses()
    getattr(save_poses, writer)(data, tmp_path / "film.csv")
    doubts = walk_right(tmp_path, "film_walker.csv", columns=LEGS, fps=FPS, min_likelihood=0.6)
    assert "FOOT1.x, FOOT1.y at samples 201 to 205 (likelihoods below 0.6" in doubts[0]


def test_individual_named_in_poses_from_the_movement_package_is_read(tmp_path):
    save_poses, data = poses()
    save_poses.to_dlc_file(data, tmp_path / "film.csv", split_individuals=False)
    columns = {name: line.replace("HIP", "walker.HIP").replace("FOOT", "walker.FOOT") for name, line in LEGS.items()}
    walk_right(tmp_path, "film.csv", columns=columns, fps=FPS, min_likelihood=0.6)


def test_data_frame_in_deeplabcut_layout_is_read(tmp_path):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    header = [("net", part, axis) for part in ("HIP", "FOOT1", "FOOT2") for axis in ("x", "y", "likelihood")]
    names = pandas.MultiIndex.from_tuples(header, names=["scorer", "bodyparts", "coords"])
    values = np.concatenate((pixels(), np.ones((len(pixels()), 3, 1))), axis=2).reshape(len(pixels()), -1)
    pandas.DataFrame(values, columns=names).to_csv(tmp_path / "film.csv")
    assert walk_right(tmp_path, "film.csv", columns=LEGS, fps=FPS) == []


@pytest.mark.parametrize("style", ["sleap", "instances", "frames"])
def test_predictions_of_sleap_are_read(style, tmp_path):
    sleap = pytest.importorskip("sleap_io", reason="sleap-io is not installed", exc_type=ImportError)
    skeleton, video = sleap.Skeleton(["HIP", "FOOT1", "FOOT2"]), sleap.Video.from_filename("film.mp4")
    frames = [
        sleap.LabeledFrame(video=video, frame_idx=n, instances=[
            sleap.PredictedInstance.from_numpy(row, skeleton=skeleton, point_scores=np.full(3, 0.9), score=0.9)
        ])
        for n, row in enumerate(pixels())
        if n not in (150, 151, 152)
    ]  # fmt: skip
    sleap.save_csv(sleap.Labels(frames), str(tmp_path / "film.csv"), format=style)
    columns = (
        {name: "inst0." + line.replace(">", ">inst0.") for name, line in LEGS.items()} if style == "frames" else LEGS
    )
    assert walk_right(tmp_path, "film.csv", columns=columns, fps=FPS, min_likelihood=0.5) == []


# Kinetics Toolkit, pandas and polars


def time_series():
    toolkit = pytest.importorskip("kineticstoolkit", reason="kineticstoolkit is not installed", exc_type=ImportError)
    time, angle = sampled()
    series = toolkit.TimeSeries(time=time)
    for marker, name in enumerate(("HIP", "FOOT1", "FOOT2")):
        series.data[name] = np.c_[places_of(angle)[:, marker], np.ones(time.size)]
    return toolkit, series


def test_points_of_kineticstoolkit_are_read_from_c3d(tmp_path):
    pytest.importorskip("ezc3d", reason="ezc3d is not installed")
    toolkit, series = time_series()
    toolkit.write_c3d(str(tmp_path / "walk.c3d"), series)
    walk_right(tmp_path, "walk.c3d", columns=LEGS)


def test_points_of_kineticstoolkit_are_read_from_a_table(tmp_path):
    _, series = time_series()
    series.to_dataframe().to_csv(tmp_path / "walk.csv")
    assert walk_right(tmp_path, "walk.csv", columns={"time": "column 1", **LEGS}, units={"time": "s"}) == []


def test_time_deltas_and_dates_of_pandas_are_read_as_seconds(tmp_path):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    time, angle = sampled()
    deltas = pandas.to_timedelta(time, unit="s")
    begin = pandas.Timestamp("2026-03-29 01:59:58", tz="Europe/Berlin")
    for index in (deltas, pandas.Timestamp("2026-12-31 23:59:58") + deltas, begin + deltas):
        pandas.DataFrame(angle, columns=["angle 1 (rad)", "angle 2 (rad)"], index=index).to_csv(
            tmp_path / "walk.csv", index_label="time"
        )
        assert walk_right(tmp_path, "walk.csv") == []


def test_dates_and_times_of_polars_are_read_as_seconds(tmp_path):
    polars = pytest.importorskip("polars", reason="polars is not installed", exc_type=ImportError)
    time, angle = sampled()
    begin = datetime.datetime(2026, 12, 31, 23, 59, 58)
    dates = [begin + datetime.timedelta(seconds=t) for t in time.tolist()]
    for times in (dates, [date.time() for date in dates]):
        frame = polars.DataFrame({"time": times, "angle 1 (rad)": angle[:, 0], "angle 2 (rad)": angle[:, 1]})
        frame.write_csv(tmp_path / "walk.csv")
        assert walk_right(tmp_path, "walk.csv") == []


# C3D and OpenSim


def test_c3d_file_in_millimetres_is_read(tmp_path):
    ezc3d = pytest.importorskip("ezc3d", reason="ezc3d is not installed")
    content = ezc3d.c3d()
    for name, value in {"RATE": [FPS], "LABELS": ["HIP", "FOOT1", "FOOT2"], "UNITS": ["mm"]}.items():
        content["parameters"]["POINT"][name]["value"] = value
    places = places_of(sampled()[1])
    content["data"]["points"] = np.concatenate((1e3 * places.transpose(2, 1, 0), np.ones((1, 3, len(places)))), axis=0)
    content.write(str(tmp_path / "walk.c3d"))
    assert walk_right(tmp_path, "walk.c3d", columns=LEGS) == []


@pytest.mark.parametrize("name", ["walk.mot", "walk.sto"])
def test_states_of_opensim_are_read_in_radians(name, tmp_path):
    osim = opensim()
    table = osim.TimeSeriesTable()
    labels = ["/jointset/hip/leg_1/value", "/jointset/hip/leg_2/value"]
    table.setColumnLabels(labels)
    time, angle = sampled()
    for instant, row in zip(time.tolist(), angle.tolist(), strict=True):
        table.appendRow(instant, osim.RowVector(row))
    table.addTableMetaDataString("inDegrees", "no")
    osim.STOFileAdapter.write(table, str(tmp_path / name))
    assert walk_right(tmp_path, name, columns=dict(zip(("angle 1", "angle 2"), labels, strict=True))) == []
