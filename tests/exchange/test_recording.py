"""Tests of reading columns and quantities from files of other programs and people."""

import math

import numpy as np
import pytest

from walkerlab.config.recording import Recorded
from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import as_walk, parse_pairs, parse_units
from walkerlab.exchange.recording import read_recording

TIMES = np.linspace(0.0, 0.4, 5)
ANGLES = np.stack([0.1 * np.sin(TIMES), -0.2 * np.cos(TIMES)], axis=1)

OWN = "time (s),angle 1 (rad),angle 2 (rad)\n" + "\n".join(
    f"{t!r},{a!r},{b!r}" for t, (a, b) in zip(TIMES.tolist(), ANGLES.tolist(), strict=True)
)
ADAMS_TABLE = "walker\n\nTime\t.walker.Last_Run.leg_1.angle\t.walker.Last_Run.leg_2.angle\n" + "\n".join(
    f"{t:+.12E}\t{a:+.12E}\t{b:+.12E}" for t, (a, b) in zip(TIMES, ANGLES, strict=True)
)
DEGREES = "t;Angle 1 [deg];angle_2 [deg];note\n" + "\n".join(
    f"{t:.6f};{math.degrees(a):.12f};{math.degrees(b):.12f};".replace(".", ",")
    for t, (a, b) in zip(TIMES, ANGLES, strict=True)
)
STO = "walk\nversion=1\nnRows=99\nnColumns=3\ninDegrees=no\nendheader\ntime\tangle_1\tangle_2\n" + "\n".join(
    f"{t}\t{a}\t{b}" for t, (a, b) in zip(TIMES, ANGLES, strict=True)
)
MOT = STO.replace("inDegrees=no", "inDegrees=yes")
# The ids are not in the order of the document, and the second of the two blocks repeats the last sample of the first.
BLOCKS = [(TIMES[:3], ANGLES[:3]), (TIMES[2:], ANGLES[2:])]
RES = (
    '<?xml version="1.0"?><Results xmlns="http://www.mscsoftware.com/:xrf10"><Analysis name="A"><Units angle="rad" '
    'length="millimeter" mass="kilogram" time="sec"/><StepMap name="map_001"><Entity name="leg_2"><Component '
    'name="angle" unitsValue="rad" id="3"/></Entity><Entity name="time"><Component name="TIME" unitsValue="sec" '
    'id="1"/></Entity><Entity name="leg_1"><Component name="angle" unitsValue="rad" id="2"/></Entity></StepMap>'
    '<Data name="modelInput_001" id="1"><Step type="input">0 9\n9</Step></Data>'
    + "".join(
        f'<Data name="dynamic_00{n}" id="{n + 1}">'
        + "".join(f"<Step>{t}\n{a} {b}</Step>" for t, (a, b) in zip(*block, strict=True))
        + "</Data>"
        for n, block in enumerate(BLOCKS, 1)
    )
    + "</Analysis></Results>"
)
MARKERS = {"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"}
FILES = {"own.csv": OWN, "table.txt": ADAMS_TABLE, "degrees.csv": DEGREES, "walk.sto": STO, "walk.res": RES}


def marker_file(times, places, unit="mm"):
    """Return a .trc file of three markers without the blank line below the header, which many files lack."""
    head = "PathFileType\t4\t(X/Y/Z)\twalk.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
    head += f"OrigDataStartFrame\tOrigNumFrames\n100\t100\t{len(times)}\t3\t{unit}\t100\t1\t{len(times)}\n"
    head += "Frame#\tTime\tHIP\t\t\tFOOT1\t\t\tFOOT2\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3\n"
    rows = (
        f"{n}\t{t}\t" + "\t".join(map(repr, row.ravel().tolist()))
        for n, (t, row) in enumerate(zip(times, places, strict=True), 1)
    )
    return head + "\n".join(rows)


def markers():
    """Return positions (frames, marker, axis) in mm of a hip that moves along x and of the ends of two legs, with y
    upwards.
    """
    hip = np.stack([100.0 * TIMES, np.full_like(TIMES, 900.0), np.zeros_like(TIMES)], axis=1)
    feet = [hip + 900.0 * np.stack([np.sin(a), -np.cos(a), 0.0 * a], axis=1) for a in ANGLES.T]
    return np.stack([hip, *feet], axis=1)


def with_column(text, name, cells):
    """Return a table with one more column."""
    return "\n".join(f"{line},{cell}" for line, cell in zip(text.splitlines(), [name, *cells], strict=True))


def written(folder, name, text, encoding="utf-8"):
    path = folder / name
    path.write_text(text, encoding=encoding)
    return path


def read(path, columns=(), units=()):
    return as_walk(read_recording(path), Recorded(columns=dict(columns), units=dict(units)))


@pytest.mark.parametrize("name", FILES)
def test_same_walk_is_read_from_every_format(name, tmp_path):
    units = {} if name == "own.csv" else {"angle": "rad", "time": "s"} if name == "table.txt" else {"time": "s"}
    walk = as_walk(read_recording(written(tmp_path, name, FILES[name])), Recorded(units=units))
    assert walk.time_s == pytest.approx(TIMES, abs=1e-12)
    assert walk.both_legs("angle") == pytest.approx(ANGLES, abs=1e-11)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_delimiter_at_the_end_of_every_row_is_ignored(delimiter, tmp_path):
    rows = "".join(f"{line.replace(',', delimiter)}{delimiter}\n" for line in OWN.splitlines())
    walk = as_walk(read_recording(written(tmp_path, "own.csv", f"Walk of today\n{rows}\n")), Recorded())
    assert walk.both_legs("angle") == pytest.approx(ANGLES, abs=1e-11)


def test_unit_of_one_component_applies_to_it_alone(tmp_path):
    """The component may also be the time."""
    text = RES.replace('"TIME" unitsValue="sec"', '"TIME" unitsValue="millisecond"')
    walk = as_walk(read_recording(written(tmp_path, "walk.res", text)), Recorded())
    assert walk.time_s == pytest.approx(TIMES / 1000.0, abs=1e-12)
    assert walk.both_legs("angle") == pytest.approx(ANGLES, abs=1e-11)


def test_adams_results_begin_with_the_initial_conditions(tmp_path):
    """ADAMS writes the state at time 0 into a separate block. If there is a static solution at the same time, it
    replaces that state.
    """
    initial = '<Data name="initialConditions_001" id="9"><Step type="initialConditions">-0.1\n0.5 0.6</Step></Data>'
    path = written(tmp_path, "walk.res", RES.replace('<Data name="dynamic_001"', f'{initial}<Data name="dynamic_001"'))
    walk = as_walk(read_recording(path), Recorded())
    assert walk.time_s == pytest.approx([-0.1, *TIMES], abs=1e-12)
    assert walk.both_legs("angle")[0].tolist() == [0.5, 0.6]
    path = written(tmp_path, "walk.res", path.read_text(encoding="utf-8").replace("-0.1\n0.5", f"{TIMES[0]}\n0.5"))
    assert as_walk(read_recording(path), Recorded()).both_legs("angle") == pytest.approx(ANGLES, abs=1e-12)


@pytest.mark.parametrize("names", ["T,time", "T,t", "T,sensor.time", "time,t", "t,sensor.time"])
def test_column_t_is_time_only_if_no_other_column_fits(names, tmp_path):
    first, second = ([20.0, 20.0], [0.0, 1.0]) if names.startswith("T,") else ([0.0, 1.0], [20.0, 20.0])
    rows = "\n".join(f"{x},{y}" for x, y in zip(first, second, strict=True))
    recording = read_recording(written(tmp_path, "walk.csv", f"{names}\n{rows}\n"))
    assert recording.columns[recording.time_name].tolist() == [0.0, 1.0]


def test_header_can_state_degrees(tmp_path):
    walk = as_walk(read_recording(written(tmp_path, "walk.mot", MOT)), Recorded())
    assert walk.both_legs("angle") == pytest.approx(np.radians(ANGLES), abs=1e-12)


def test_angles_are_computed_from_pairs_of_markers(tmp_path):
    path = written(tmp_path, "walk.trc", marker_file(TIMES, markers()))
    walk = as_walk(
        read_recording(path),
        Recorded(columns={"angle 1": "HIP>FOOT1", "angle 2": "HIP > FOOT2", "hip_along_m": "HIP.x"}),
    )
    assert walk.both_legs("angle") == pytest.approx(ANGLES, abs=1e-12)
    assert walk.quantities["hip_along_m"] == pytest.approx(0.1 * TIMES, abs=1e-12)


def test_markers_are_read_with_z_upwards_and_a_walk_in_the_negative_direction(tmp_path):
    turned = markers()[:, :, [2, 0, 1]] * [1.0, -1.0, 1.0]
    path = written(tmp_path, "walk.trc", marker_file(TIMES, turned))
    walk = as_walk(read_recording(path), Recorded(columns={"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"}))
    assert walk.both_legs("angle") == pytest.approx(ANGLES, abs=1e-12)


def test_sample_missing_from_a_used_column_is_omitted(tmp_path):
    places = markers()
    text = marker_file(TIMES, places).replace(repr(float(places[2, 2, 0])), "")
    recording = read_recording(written(tmp_path, "walk.trc", text))
    assert np.isnan(recording.columns["FOOT2.x"]).sum() == 1
    assert (
        as_walk(recording, Recorded(columns={"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT1"})).time_s.size == TIMES.size
    )
    walk = as_walk(recording, Recorded(columns={"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"}))
    assert walk.time_s == pytest.approx(np.delete(TIMES, 2))
    assert walk.doubts == ("Gaps are left out: FOOT2.x at sample 3.",)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("walk.req", "x", "unsupported format"),
        ("walk.xlsx", "x", "unsupported format"),
        ("walk", "x", "no extension"),
        ("walk.csv", "", "is empty"),
        ("walk.csv", "1,2,3\n4,5,6\n", "no header"),
        (
            "walk.csv",
            with_column(OWN, "angle 2 (rad)", ["1"] * 5),
            "'angle 2' cannot be used: 2 columns have this name",
        ),
        ("walk.csv", OWN.replace("time (s)", "tempo (s)"), "no time column"),
        ("walk.csv", "\n".join(OWN.splitlines()[:2]), "1 samples"),
        ("walk.csv", OWN.replace(repr(float(ANGLES[1, 0])), "abc"), "line 3: 'abc' is not a number"),
        ("walk.csv", OWN + ",7", "4 values where the header names 3"),
        ("walk.csv", "\n".join([*OWN.splitlines(), OWN.splitlines()[2]]), "time does not increase"),
        ("walk.res", RES[:-40], "not complete XML"),
        ("walk.res", RES.replace('id="3"', 'id="2"'), "not unique"),
        ("walk.res", RES.replace('id="3"', 'id="x"'), "no id"),
        ("walk.res", RES.replace("dynamic_", "modelInput_"), "no simulation steps"),
        ("walk.res", RES.replace(f"{TIMES[1]}\n", f"{TIMES[1]}\n1 "), "step 2 has 4 numbers for 3"),
        ("walk.res", RES.replace(f"{TIMES[1]}\n", "one\n"), "not a number"),
        ("walk.sto", STO.replace("endheader", "end"), "endheader"),
        ("walk.sto", STO.replace("version=1", "DataType=Vec3"), "type vec3"),
        ("walk.sto", STO + "\t4", "4 values where the header names 3"),
        ("walk.trc", "x\n" * 7, "PathFileType"),
        ("walk.trc", "\n".join(marker_file(TIMES, markers()).splitlines()[:5]), "no markers"),
    ],
)
def test_damaged_file_is_rejected_with_the_reason(name, text, message, tmp_path):
    with pytest.raises(ConfigError, match=message) as caught:
        read(written(tmp_path, name, text), MARKERS if name.endswith(".trc") else {}, {"time": "s"})
    assert caught.value.advice


def test_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"walk\.csv cannot be read"):
        read_recording(tmp_path / "walk.csv")


def test_binary_file_is_rejected(tmp_path):
    path = tmp_path / "walk.csv"
    path.write_bytes(b"PK\3\4\0\0" * 30)
    with pytest.raises(ConfigError, match="not a text"):
        read_recording(path)


@pytest.mark.parametrize(
    ("columns", "units", "message", "advice"),
    [
        ({"angle 1": "left"}, {}, "no column 'left'", "Did you mean"),
        ({"angel 1": "angle 1"}, {}, "not a quantity", "angle 1"),
        ({}, {"angle": "gon"}, "is not a known unit", "rad, radian"),
        ({"hip_along_m": "angle 1"}, {}, "stated for 'hip_along_m', is not a known unit", "length"),
    ],
)
def test_unknown_column_or_unit_is_named(columns, units, message, advice, tmp_path):
    recording = read_recording(
        written(tmp_path, "walk.csv", OWN.replace(",angle 2 (rad)", ",angle 2 (gon)") if "angle" in units else OWN)
    )
    with pytest.raises(ConfigError, match=message) as caught:
        as_walk(recording, Recorded(columns=columns, units=units))
    assert advice in caught.value.advice


def test_missing_unit_is_requested(tmp_path):
    recording = read_recording(written(tmp_path, "walk.csv", OWN.replace("angle 2 (rad)", "angle 2")))
    with pytest.raises(ConfigError, match="gives no unit for 'angle 2'") as caught:
        as_walk(recording, Recorded())
    assert "--units angle=rad" in caught.value.advice
    assert as_walk(recording, Recorded(units=parse_units(["rad"]))).both_legs("angle") == pytest.approx(ANGLES)


def test_ambiguous_column_is_rejected_with_the_candidates(tmp_path):
    text = ADAMS_TABLE.replace("leg_2.angle", "leg_2.angle\t.walker.Second.leg_2.angle").replace("\n", "\t0\n")
    recording = read_recording(
        written(
            tmp_path,
            "walk.txt",
            text.replace("walker\t0\n\t0\n", "walker\n\n").replace("Second.leg_2.angle\t0", "Second.leg_2.angle")
            + "\t0",
        )
    )
    with pytest.raises(ConfigError, match="could each be 'angle 2'"):
        as_walk(recording, Recorded(units={"angle": "rad", "time": "s"}))


def test_column_and_unit_options_are_parsed_as_pairs():
    assert parse_pairs("--columns", ["a=b,c = d", "e=f"]) == {"a": "b", "c": "d", "e": "f"}
    assert parse_units(["deg,mm", "time=ms"]) == {"angle": "deg", "length": "mm", "time": "ms"}
    for wrong in ("a", "=b", "a="):
        with pytest.raises(ConfigError, match="not of the form"):
            parse_pairs("--columns", [wrong])
    with pytest.raises(ConfigError, match="not a known unit"):
        parse_units(["furlong"])


def test_recording_keeps_unknown_columns(tmp_path):
    recording = read_recording(written(tmp_path, "degrees.csv", DEGREES))
    assert set(recording.columns) == {"t", "Angle 1", "angle_2", "note"}
    assert np.isnan(recording.columns["note"]).all()
