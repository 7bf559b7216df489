"""Read tables in the forms in which spreadsheets, tracking programs and other countries write them."""

import codecs
import os
import re
from time import process_time

import numpy as np
import pytest

import walkerlab
from walkerlab.config.recording import Recorded
from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import as_walk, parse_units
from walkerlab.exchange.recording import read_recording

TIMES = np.linspace(0.0, 0.5, 6)
ANGLES = np.stack([0.1 * np.sin(TIMES), -0.2 * np.cos(TIMES)], axis=1)
HEADER = "time (s)", "angle 1 (rad)", "angle 2 (rad)"
ROWS = [[f"{value:.9f}" for value in row] for row in np.column_stack((TIMES, ANGLES))]
LINES = {"angle 1": "HIP>F1", "angle 2": "HIP>F2"}


def table(rows=ROWS, header=HEADER, delimiter=",", above=(), below=()):
    """Return a table with some lines above and below its header."""
    lines = (delimiter.join(cells) for cells in (header, *below, *rows))
    return "\n".join([*above, *lines]) + "\n"


def with_commas(rows=ROWS, quote=""):
    return [[quote + cell.replace(".", ",") + quote for cell in row] for row in rows]


def with_column(cells, rows=ROWS):
    return [[*row, cell] for row, cell in zip(rows, cells, strict=True)]


def read(folder, name, text, columns=(), units=(), encoding="utf-8"):
    """Write a file and read its walk."""
    path = folder / name
    path.write_text(text, encoding=encoding)
    return as_walk(read_recording(path), Recorded(columns=dict(columns), units=dict(units)))


def holds_the_walk(walk, part=slice(None)):
    return walk.time_s == pytest.approx(TIMES[part], abs=1e-8) and walk.both_legs("angle") == pytest.approx(
        ANGLES[part], abs=1e-8
    )


def positions():
    """Return positions (samples, 9) of a hip and two feet in mm. The y axis points up, and the hip moves along x."""
    hip = np.stack([100.0 * TIMES, np.full_like(TIMES, 900.0), np.zeros_like(TIMES)], axis=1)
    feet = [hip + 900.0 * np.stack([np.sin(a), -np.cos(a), 0.0 * a], axis=1) for a in ANGLES.T]
    return np.hstack([hip, *feet])


def trc(names=("HIP", "F1", "F2"), values=None, count=None, units="mm", comma=False):
    """Return a .trc file whose header states `count` as the number of markers."""
    values = positions() if values is None else values
    texts = [[f"{number:.7f}".replace("nan", "") for number in row] for row in np.column_stack((TIMES, values))]
    axes = "\t".join(f"X{n}\tY{n}\tZ{n}" for n in range(1, len(names) + 1))
    lines = [
        "PathFileType\t4\t(X/Y/Z)\twalk.trc",
        "DataRate\tCameraRate\tNumFrames\tUnits\tNumMarkers\tOrigDataRate",
        f"100\t100\t{len(TIMES)}\t{units}\t{len(names) if count is None else count}\t100",
        "Frame#\tTime\t" + "\t".join(f"{name}\t\t" for name in names),
        f"\t\t{axes}",
        *("\t".join((str(n), *row)) for n, row in enumerate(with_commas(texts) if comma else texts, 1)),
    ]
    return "\n".join(lines) + "\n"


def opensim(rows=ROWS, labels=("time", "angle_1", "angle_2"), settings="version=1\ninDegrees=no\n", delimiter="\t"):
    lines = (delimiter.join(cells) for cells in (labels, *rows))
    return f"walk\n{settings}endheader\n" + "\n".join(lines) + "\n"


def quoted(row):
    return ",".join(f'"{cell}"' for cell in row)


DECIMAL_COMMAS = {
    "tabs.txt": table(with_commas(), delimiter="\t"),
    "semicolons.csv": table(with_commas(), delimiter=";"),
    "quotes.csv": table(with_commas(quote='"')),
    "quoted-tabs.tsv": table(with_commas(quote='"'), delimiter="\t"),
    "blanks.txt": table(with_commas(), delimiter="  "),
    "walk.sto": opensim(with_commas()),
    "blanks.mot": opensim(with_commas(), delimiter="  "),
    "quotes.mot": opensim(with_commas(quote='"')),
    "walk.trc": trc(comma=True),
}


@pytest.mark.parametrize("name", DECIMAL_COMMAS)
def test_decimal_commas_are_read(name, tmp_path):
    assert holds_the_walk(read(tmp_path, name, DECIMAL_COMMAS[name], LINES if name.endswith("trc") else {}))


@pytest.mark.parametrize("cell", ["1.000,0", "1,000.0", "1.000.0", "0,1,2"])
def test_cell_that_is_not_a_number_is_quoted(cell, tmp_path):
    rows = [*with_commas()[:2], [with_commas()[2][0], cell, "0,1"], *with_commas()[3:]]
    with pytest.raises(ConfigError, match=rf"line 4: '{re.escape(cell)}' is not a number"):
        read(tmp_path, "walk.csv", table(rows, delimiter=";"))


def test_decimal_commas_in_a_comma_separated_file_are_rejected_with_advice(tmp_path):
    with pytest.raises(ConfigError, match="no header") as caught:
        read(tmp_path, "walk.csv", table(with_commas()))
    assert "decimal commas need semicolons, tabs or quotes" in caught.value.advice


def test_comma_that_may_separate_thousands_is_rejected(tmp_path):
    """1,200 is one and a fifth in some countries and twelve hundred in others."""
    rows = [[f"{k}.5", f"{k + 1},200", "0.1"] for k in range(6)]
    with pytest.raises(ConfigError, match="line 2: '1,200' has a comma, but other numbers have points"):
        read(tmp_path, "walk.txt", table(rows, delimiter="\t"))
    rows = [[f"{k},5", f"{k + 1},200", "0,1"] for k in range(6)]
    walk = read(tmp_path, "walk.txt", table(rows, delimiter="\t"))
    assert walk.quantities["angle 1"][0] == 1.2


def test_mixed_decimal_marks_in_one_column_are_rejected(tmp_path):
    rows = [*ROWS[:3], *with_commas(ROWS[3:])]
    with pytest.raises(ConfigError, match="has a comma, but other numbers have points"):
        read(tmp_path, "walk.csv", table(rows, delimiter=";"))


UNUSED_COLUMNS = {
    "text": ("phase", ["swing"] * 6),
    "some text": ("note", ["", "", "start", "", "", ""]),
    "long text": ("image", ["x" * 200_000] * 6),
    "gaps": ("spare", ["", "1", "", "", "2", ""]),
    "empty": ("spare", [""] * 6),
    "no name": ("", ["1"] * 6),
    "thousands": ("count", ["1,200"] * 6),
    "dates": ("date", ["12.05.2026"] * 6),
    "of a walker, with gaps": ("kinetic_J", ["1", "", "1", "1", "1", "1"]),
    "of a walker, text": ("velocity 1 (rad/s)", ["fast"] * 6),
    "of a walker, without a unit": ("hip height", ["1"] * 6),
}


@pytest.mark.parametrize("kind", UNUSED_COLUMNS)
def test_bad_value_in_an_unused_column_is_ignored(kind, tmp_path):
    name, cells = UNUSED_COLUMNS[kind]
    assert holds_the_walk(read(tmp_path, "walk.txt", table(with_column(cells), (*HEADER, name), "\t")))


def test_unreadable_optional_quantity_is_omitted_with_the_reason(tmp_path):
    text = table(with_column(["1", "", "1", "1", "1", "1"]), (*HEADER, "kinetic_J (J)"))
    walk = read(tmp_path, "walk.csv", text)
    assert "kinetic_J" not in walk.quantities
    assert "lacks 1 of 6 values, the first at sample 2" in walk.left_out["kinetic_J"]
    named = read(tmp_path, "walk.csv", text, {"kinetic_J": "kinetic_J"})
    assert named.time_s.size == 5
    assert named.doubts == ("Gaps are left out: kinetic_J at sample 2.",)


@pytest.mark.parametrize("name", ["spare", ""])
def test_unused_labels_may_be_repeated_or_empty(name, tmp_path):
    rows = with_column(["2"] * 6, with_column(["1"] * 6))
    assert holds_the_walk(read(tmp_path, "walk.csv", table(rows, (*HEADER, name, name))))
    within = [[row[0], *row[3:], *row[1:3]] for row in rows]
    assert holds_the_walk(read(tmp_path, "walk.mot", opensim(within, ("time", name, name, "angle_1", "angle_2"))))


def test_index_without_a_name_can_be_the_time(tmp_path):
    """The index of a data frame has an empty header cell."""
    text = table(header=("", *HEADER[1:]))
    with pytest.raises(ConfigError, match=r"no time column\. Its first columns are column 1, angle 1"):
        read(tmp_path, "walk.csv", text)
    assert holds_the_walk(read(tmp_path, "walk.csv", text, {"time": "column 1"}, {"time": "s"}))
    counted = table([[str(n), *row] for n, row in enumerate(ROWS)], ("", *HEADER))
    assert holds_the_walk(read(tmp_path, "walk.csv", counted))


@pytest.mark.parametrize("units", [("s", "rad", "rad"), ("[s]", "[rad]", "[rad]"), ("Seconds", "radians", "Radians")])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_row_of_units_is_read(units, delimiter, tmp_path):
    text = table(header=("time", "angle 1", "angle 2"), delimiter=delimiter, below=[units], above=["Walk of today"])
    assert holds_the_walk(read(tmp_path, "walk.txt", text))


def test_row_of_units_may_have_unknown_units_and_gaps(tmp_path):
    rows = with_column(["7"] * 6, with_column(["1"] * 6))
    text = table(rows, ("time", "angle 1", "angle 2", "load", "n"), below=[("s", "rad", "rad", "%", "")])
    assert holds_the_walk(read(tmp_path, "walk.csv", text))


def test_rows_of_delimiters_alone_are_skipped(tmp_path):
    assert holds_the_walk(read(tmp_path, "walk.csv", table([*ROWS, ["", "", ""]]) + ",,\n"))


@pytest.mark.parametrize(
    ("header", "columns", "units"),
    [
        ("TimeStamp", {"time": "TimeStamp"}, {"time": "s"}),
        ("t", {"time": "t"}, {"time": "s"}),
        ("clock", {"time": "clock"}, {"time": "s"}),
        ("clock (s)", {"time": "clock (s)"}, {}),
        ("time_s", {}, {}),
        ("Time Stamp [s]", {}, {}),
    ],
)
def test_time_column_can_be_chosen_by_its_name(header, columns, units, tmp_path):
    assert holds_the_walk(read(tmp_path, "walk.csv", table(header=(header, *HEADER[1:])), columns, units))


@pytest.mark.parametrize(
    ("header", "scale"),
    [("time (us)", 1e6), ("time [ns]", 1e9), ("time_us", 1e6), ("time (\u00b5s)", 1e6), ("time (Microseconds)", 1e6)],
)
def test_times_in_micro_and_nanoseconds_are_read(header, scale, tmp_path):
    rows = [[f"{scale * float(row[0]):.0f}", *row[1:]] for row in ROWS]
    assert holds_the_walk(read(tmp_path, "walk.csv", table(rows, (header, *HEADER[1:]))))
    assert parse_units(["us"]) == {"time": "us"}


def test_unit_that_contradicts_the_file_is_an_error(tmp_path):
    for units in ({"angle": "deg"}, {"angle 1": "deg"}):
        with pytest.raises(ConfigError, match=r"states that 'angle 1' .* is in rad, but --units says deg"):
            read(tmp_path, "walk.csv", table(), units=units)
    assert holds_the_walk(read(tmp_path, "walk.csv", table(), units={"angle": "Radians", "time": "s"}))
    with pytest.raises(ConfigError, match="is in mm, but"):
        read(tmp_path, "walk.trc", trc(), LINES, {"length": "m"})
    with pytest.raises(ConfigError, match="is in deg, but"):
        read(tmp_path, "walk.mot", opensim(settings="version=1\ninDegrees=yes\n"), units={"angle": "rad"})


@pytest.mark.parametrize(
    ("units", "near"), [({"angel": "rad"}, "'angle'"), ({"angle 3": "rad"}, "'angle "), ({"x": "m"}, "Kinds")]
)
def test_unit_for_an_unknown_quantity_is_an_error(units, near, tmp_path):
    with pytest.raises(ConfigError, match="is neither a kind, a quantity nor a column of") as caught:
        read(tmp_path, "walk.csv", table(), units=units)
    assert near in caught.value.advice
    with pytest.raises(ConfigError, match="'furlong', stated for 'length', is not a known unit of length"):
        read(tmp_path, "walk.csv", table(), units={"length": "furlong"})


# Markers


PLANAR = {
    "dots": ("{}.x (m)", "{}.y (m)"),
    "blanks": ("{} X", "{} Y"),
    "underscores": ("{}_x", "{}_y"),
    "positions": ("{}.PosX", "{}.PosY"),
    "pixels": ("{}.x [px]", "{}.y [px]"),
    "x and z": ("{}.x", "{}.z"),
}


@pytest.mark.parametrize("style", PLANAR)
def test_planar_markers_give_line_angles(style, tmp_path):
    names = [pattern.format(marker) for marker in ("HIP", "F1", "F2") for pattern in PLANAR[style]]
    places = positions()[:, [0, 1, 3, 4, 6, 7]] / 1000.0
    rows = [[row[0], *(f"{place:.12f}" for place in each)] for row, each in zip(ROWS, places, strict=True)]
    assert holds_the_walk(read(tmp_path, "walk.csv", table(rows, ("time (s)", *names)), LINES))


def test_marker_with_a_repeated_coordinate_is_rejected(tmp_path):
    names = "HIP.x", "HIP X", "HIP.y", "F1.x", "F1.y", "F2.x", "F2.y"
    rows = [[row[0], *"1234567"] for row in ROWS]
    with pytest.raises(ConfigError, match=r"HIP\.x and HIP X could each be a coordinate of HIP"):
        read(tmp_path, "walk.csv", table(rows, ("time (s)", *names)), LINES)


def test_line_between_markers_in_different_units_is_scaled(tmp_path):
    names = "HIP.x (m)", "HIP.y (m)", "F1.x (mm)", "F1.y (mm)", "F2.x (mm)", "F2.y (mm)"
    places = positions()[:, [0, 1, 3, 4, 6, 7]] / [1000.0, 1000.0, 1.0, 1.0, 1.0, 1.0]
    rows = [[row[0], *(f"{place:.12f}" for place in each)] for row, each in zip(ROWS, places, strict=True)]
    assert holds_the_walk(read(tmp_path, "walk.csv", table(rows, ("time (s)", *names)), LINES))


def with_marker(place, values=7.0):
    return np.insert(positions(), [3 * place] * 3, values, axis=1)


@pytest.mark.parametrize("place", range(4))
def test_unnamed_marker_does_not_shift_the_others(place, tmp_path):
    names = [*("HIP", "F1", "F2")[:place], "", *("HIP", "F1", "F2")[place:]]
    assert holds_the_walk(read(tmp_path, "walk.trc", trc(names, with_marker(place)), LINES))


def test_markers_with_placeholder_names_may_repeat(tmp_path):
    values = np.insert(with_marker(1), [3] * 3, 8.0, axis=1)
    assert holds_the_walk(read(tmp_path, "walk.trc", trc(("HIP", "*12", "*12", "F1", "F2"), values), LINES))
    with pytest.raises(ConfigError, match="2 columns have this name"):
        read(tmp_path, "walk.trc", trc(("HIP", "*12", "*12", "F1", "F2"), values), {**LINES, "angle 2": "HIP>*12"})


@pytest.mark.parametrize("count", [2, 4])
def test_wrong_marker_count_in_the_header_is_rejected(count, tmp_path):
    with pytest.raises(ConfigError, match=f"coordinates for 3, and its NumMarkers is {count}"):
        read(tmp_path, "walk.trc", trc(count=count), LINES)


def test_values_beyond_the_last_marker_are_rejected(tmp_path):
    text = trc(values=with_marker(3))
    with pytest.raises(ConfigError, match="14 values where the header names 11 columns"):
        read(tmp_path, "walk.trc", text, LINES)


def test_empty_marker_unit_in_the_header_is_ignored(tmp_path):
    assert holds_the_walk(read(tmp_path, "walk.trc", trc(units=""), LINES))
    with pytest.raises(ConfigError, match=r"gives no unit for 'HIP\.x'"):
        read(tmp_path, "walk.trc", trc(units=""), {**LINES, "hip_along_m": "HIP.x"})


def test_gaps_at_both_ends_are_cut(tmp_path):
    values = positions()
    values[:1, 3:6] = np.nan
    values[-2:, 6:] = np.nan
    walk = read(tmp_path, "walk.trc", trc(values=values), LINES)
    assert holds_the_walk(walk, slice(1, 4))
    assert walk.left_out["samples"] == "1 at the beginning and 2 at the end, which have gaps"
    values[2, 0] = np.nan
    assert read(tmp_path, "walk.trc", trc(values=values), LINES).doubts == ("Gaps are left out: HIP.x at sample 3.",)
    values[:, 0] = np.nan
    with pytest.raises(ConfigError, match=r"no sample with values of"):
        read(tmp_path, "walk.trc", trc(values=values), LINES)


# OpenSim


def test_columns_whose_labels_contain_spaces_are_split_at_tabs(tmp_path):
    text = opensim(labels=("time", "right thigh", "left thigh"))
    assert holds_the_walk(read(tmp_path, "walk.mot", text, {"angle 1": "right thigh", "angle 2": "left thigh"}))


@pytest.mark.parametrize(
    ("name", "settings", "unit"),
    [
        ("walk.mot", "datacolumns 3\ndatarows 6\n", "deg"),
        ("walk.mot", "nRows=6\n", "deg"),
        ("walk.mot", "inDegrees=yes\n", "deg"),
        ("walk.mot", "version=1\n", "rad"),
        ("walk.mot", "version=1\ninDegrees=yes\n", "deg"),
        ("walk.mot", "DataType=double\nversion=3\n", "rad"),
        ("walk.sto", "datacolumns 3\n", "rad"),
        ("walk.sto", "version=1\ninDegrees=yes\n", "deg"),
    ],
)
def test_motion_file_angles_default_to_the_unit_opensim_assumes(name, settings, unit, tmp_path):
    walk = read(tmp_path, name, opensim(settings=settings))
    assert walk.both_legs("angle") == pytest.approx(ANGLES if unit == "rad" else np.radians(ANGLES), abs=1e-8)


def test_motion_file_without_version_and_degrees_needs_a_unit(tmp_path):
    """OpenSim reads such a file in degrees, whatever its header says."""
    text = opensim(settings="inDegrees=no\n")
    with pytest.raises(ConfigError, match="gives no unit for 'angle_1'"):
        read(tmp_path, "walk.mot", text)
    assert holds_the_walk(read(tmp_path, "walk.mot", text, units={"angle": "rad"}))


# Files of programs that need another kind of export


@pytest.mark.parametrize(
    ("beginning", "program"),
    [
        ("Trajectories\n100\n,,HIP,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n", "Vicon Nexus"),
        ("Devices\n1000\n,,Force\nFrame,Sub Frame,Fx\n,,N\n1,0,1\n", "Vicon Nexus"),
        ("Format Version,1.23,Take Name,walk\n\n,Type,Marker,Marker\n", "Motive"),
        ("NO_OF_FRAMES\t2\nFREQUENCY\t100\nMARKER_NAMES\tHIP\tF1\n1\t2\t3\t4\t5\t6\n", "Qualisys"),
        ("mass_A\nt\tx\ty\n0.0\t1.0\t2.0\n0.1\t1.1\t2.1\n", "Tracker"),
    ],
)
def test_error_for_an_unsupported_table_names_the_program_that_wrote_it(beginning, program, tmp_path):
    with pytest.raises(ConfigError, match=f"is a table of {program}") as caught:
        read(tmp_path, "walk.csv", beginning)
    assert re.search(r"\.c3d|time \(s\)", caught.value.advice)


def test_qualisys_table_with_column_headers_is_read(tmp_path):
    names = [f"{marker} {axis}" for marker in ("HIP", "F1", "F2") for axis in "XYZ"]
    above = ["NO_OF_FRAMES\t6", "NO_OF_CAMERAS\t8", "NO_OF_MARKERS\t3", "FREQUENCY\t10", "MARKER_NAMES\tHIP\tF1\tF2"]
    rows = [[str(n), row[0], *map(str, each)] for n, (row, each) in enumerate(zip(ROWS, positions(), strict=True), 1)]
    text = table(rows, ("Frame", "Time", *names), "\t", above)
    assert holds_the_walk(read(tmp_path, "walk.tsv", text, LINES, {"time": "s"}))


def test_frame_numbers_without_a_frame_rate_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="no time column") as caught:
        read(tmp_path, "walk.csv", table(header=("frame_idx", *HEADER[1:])))
    assert "--fps" in caught.value.advice


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("\n \n", "is empty"),
        ("time (s),angle 1 (rad),angle 2 (rad)\n", "has a header but no rows of numbers"),
        (table(delimiter="|"), "separates its columns by vertical bars"),
        (table(header=("time", "angle_1", "angle_2"), delimiter=" "), "separates its columns by blanks"),
    ],
)
def test_file_without_a_table_gets_an_explanation(text, message, tmp_path):
    with pytest.raises(ConfigError, match=message):
        read(tmp_path, "walk.txt", text)


def test_table_with_two_tracks_is_rejected_with_advice_to_export_each_separately(tmp_path):
    text = "mass_A\t\t\tmass_B\nt\tx\ty\tt\tx\ty\n0.0\t1.0\t2.0\t0.0\t1.5\t2.5\n0.1\t1.1\t2.1\t0.1\t1.6\t2.6\n"
    with pytest.raises(ConfigError, match="Tracker with several tracks") as caught:
        read(tmp_path, "walk.txt", text)
    assert "Export each track by itself" in caught.value.advice


def test_angles_in_milliradians_are_read(tmp_path):
    rows = [[row[0], *(f"{1e3 * float(cell):.9f}" for cell in row[1:])] for row in ROWS]
    assert holds_the_walk(read(tmp_path, "walk.csv", table(rows, ("time (s)", "angle 1 (mrad)", "angle 2 (mrad)"))))


# Encodings, and paths that are not files


RES = (
    '<?xml version="1.0" encoding="{}"?><Results><Analysis name="地"><Units angle="rad" time="sec"/><StepMap>'
    '<Entity name="time"><Component name="TIME" id="1"/></Entity><Entity name="leg_1"><Component name="angle" id="2"/>'
    '</Entity><Entity name="leg_2"><Component name="angle" id="3"/></Entity></StepMap>{}</Analysis></Results>'
)
STEPS = "".join(f"<Step>{' '.join(row)}</Step>" for row in ROWS[1:])
BLOCKS = (
    f"<Data name='modelInput_001'><Step>9 9 9</Step></Data><Data name='initialConditions_001'><Step>{' '.join(ROWS[0])}"
    f"</Step></Data><Data name='dynamic_001'>{STEPS}</Data>"
)


@pytest.mark.parametrize(
    ("declared", "encoding"),
    [
        ("UTF-8", "utf-8"), ("gb2312", "gb2312"), ("Shift_JIS", "shift_jis"), ("big5", "big5"), ("UTF-16", "utf-16"),
        ("utf-16", "utf-8"), ("UTF-8", "gb2312"), ("no-such-encoding", "utf-8"),
    ],
)  # fmt: skip
def test_results_of_adams_are_read_in_any_encoding(declared, encoding, tmp_path):
    """The file has the state at time 0 only among the initial conditions. The first dynamic step is at the first output
    time.
    """
    assert codecs.lookup(encoding)
    assert holds_the_walk(read(tmp_path, "walk.res", RES.format(declared, BLOCKS), encoding=encoding))


@pytest.mark.parametrize("tag", ["Entity", "Data", "Step", "Component"])
def test_deeply_nested_results_are_rejected_quickly(tag, tmp_path):
    depth = 100_000
    path = tmp_path / "deep.res"
    path.write_text(f"<Results>{f'<{tag}>' * depth}{f'</{tag}>' * depth}</Results>", encoding="utf-8")
    begin = process_time()
    with pytest.raises(ConfigError, match="component ids are missing"):
        read_recording(path)
    assert process_time() - begin < 10.0


@pytest.mark.parametrize("suffix", [".csv", ".trc"])
def test_time_to_read_is_linear_in_the_number_of_columns(suffix, tmp_path):
    """Ten times as many columns take far less than a hundred times as long."""
    took = []
    for count in (3_000, 30_000):
        names = [f"m{n}" for n in range(count // 3)]
        path = tmp_path / f"wide{suffix}"
        if suffix == ".trc":
            path.write_text(trc(names, np.ones((6, 3 * len(names)))), encoding="utf-8")
        else:
            path.write_text(table([[*row, *["1"] * len(names)] for row in ROWS], (*HEADER, *names)), encoding="utf-8")
        begin = process_time()
        recording = read_recording(path)
        columns = {} if suffix == ".csv" else {"angle 1": "m1>m2", "angle 2": "m1>m3"}
        as_walk(recording, Recorded(columns=columns))
        took.append(process_time() - begin)
    assert took[1] < 40.0 * took[0]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("name", ["walk.csv", "walk.res", "walk.c3d"])
def test_named_pipe_is_rejected(name, tmp_path):
    os.mkfifo(tmp_path / name)
    with pytest.raises(ConfigError, match="is a pipe or a device, not a file"):
        read_recording(tmp_path / name)


def test_overlong_path_is_shortened_in_the_message(tmp_path):
    with pytest.raises(ConfigError, match=r"a\.\.\. cannot be read") as caught:
        read_recording(tmp_path / ("a" * 5_000 + ".csv"))
    assert len(caught.value.message) < 500


def test_circular_links_are_rejected(tmp_path):
    (tmp_path / "walk.csv").symlink_to(tmp_path / "walk.csv")
    with pytest.raises(ConfigError, match="cannot be read"):
        read_recording(tmp_path / "walk.csv")


def test_file_of_markers_is_refused_unless_the_markers_of_a_leg_are_named(tmp_path):
    path = tmp_path / "markers.csv"
    path.write_text("time (s),PELVIS.x,PELVIS.y,HEEL.x,HEEL.y\n0,0,1,0,0\n0.01,0,1,0,0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="has no column for 'angle 1', but it has markers: PELVIS, HEEL") as refused:
        walkerlab.read_walk(path)
    assert refused.value.advice.endswith('--columns "angle 1=HIP>FOOT"')
