"""Files written by the libraries that people use: ezc3d, c3d, pandas and OpenSim, where they are installed."""

import warnings

import numpy as np
import pytest

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
def test_blank_and_repeated_c3d_labels_do_not_matter(units, tmp_path):
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
    """Samples at which a recording has no second foot."""
    return np.flatnonzero(np.isnan(read_recording(path).columns["F2.x"])).tolist()


def test_negative_residual_written_by_ezc3d_is_a_gap(tmp_path):
    """Also where a position stands in the gap."""
    path = tmp_path / "walk.c3d"
    residuals = np.zeros((1, 3, TIMES.size))
    residuals[0, 2, [7, 8]] = -1.0
    values = FEET[1].copy()
    values[:, 20] = np.nan
    write_with_ezc3d(path, [("HIP", HIP), ("F1", FEET[0]), ("F2", values)], residuals=residuals)
    assert gaps_of(path) == [7, 8, 20]


@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_negative_residual_written_by_c3d_is_a_gap(scale, tmp_path):
    """Stored as floating-point numbers or, with a positive scale, as integers."""
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
    """As kineticstoolkit's to_dataframe() makes it; its header begins with an empty cell."""
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
