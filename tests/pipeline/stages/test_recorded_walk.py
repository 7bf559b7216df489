"""Tests of reading and comparing recorded walks: round trips, and 300 damaged files."""

import contextlib
import functools
import json
import math
import os
import random
import re
from pathlib import Path

import numpy as np
import pytest

import walkerlab
from walkerlab.api.memory import run_in_memory
from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError
from walkerlab.evidence.paper.sections import describe_recorded, recorded_tables
from walkerlab.exchange.walk_in_steps import MAX_STEP_SAMPLES
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.stages import recorded_walk
from walkerlab.pipeline.store.runs import RunFolder

MEMORY = MemoryResults()


@functools.cache
def simulated(model):
    contact = walkerlab.contact(terrain="checkerboard") if model == "contact" else None
    return walkerlab.simulate(contact=contact, strides=3)


def table(walk, scale=1.0, unit="rad", noise=0.0, every=1, delay=0.0, legs=(0, 1)):
    """Return the angles of a walk as CSV, optionally in other units, with noise, fewer samples and another origin of
    time.
    """
    trajectory, draw = walk.content["trajectory"], np.random.default_rng(1)
    time, angle = trajectory["time"], trajectory["angle"][:, legs]
    keep = np.flatnonzero(np.diff(time, prepend=-1.0) > 1e-7)[::every]
    values = scale * (angle[keep] + draw.normal(0.0, noise, angle[keep].shape))
    rows = np.column_stack((time[keep] + delay, values))
    head = f"time (s),angle 1 ({unit}),angle 2 ({unit})\n"
    return head + "\n".join(",".join(f"{value:.12g}" for value in row) for row in rows)


def written(folder, text, name="walk.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("model", "period", "length"), [("rigid", 1e-6, 1e-6), ("contact", 2e-4, 1e-3)])
def test_exported_walk_is_read_back_with_the_same_steps(tmp_path, model, period, length):
    """On compliant ground feet sink in and slip. Touches found from angles are therefore a little late, and step
    lengths short.
    """
    walk = simulated(model)
    read = walkerlab.read_walk(written(tmp_path, table(walk)))
    count = read.summary["steps"]  # The last touch may be too late to be in the recording.
    assert count >= 5
    assert read.summary["step_periods_s"] == pytest.approx(walk.summary["step_periods_s"][:count], abs=period)
    assert read.summary["step_lengths_m"] == pytest.approx(walk.summary["step_lengths_m"][:count], abs=length)
    inside = np.abs(read.content["trajectory"]["velocity"]).max() / np.abs(walk.content["trajectory"]["velocity"]).max()
    assert inside == pytest.approx(1.0, abs=0.02)


def test_walk_is_read_despite_noise_gaps_offsets_and_swapped_legs(tmp_path):
    walk = simulated("rigid")
    text = table(walk, math.degrees(1.0), "deg", noise=5e-4, every=2, delay=12.5, legs=(1, 0))
    read = walkerlab.read_walk(written(tmp_path, text))
    assert read.summary["legs_swapped"]
    assert read.summary["first_heel_strike_s"] == pytest.approx(12.5, abs=0.01)
    assert read.summary["step_periods_s"][1:] == pytest.approx(walk.summary["step_periods_s"][1:6], abs=2e-3)
    assert read.summary["scatter_rad"] == pytest.approx(5e-4, rel=0.5)


@pytest.mark.parametrize("delay", [100.0, 1.7e9])
def test_walk_does_not_depend_on_the_first_time_of_the_recording(tmp_path, delay):
    """The clock of a camera may count from when it was switched on, or from 1970."""
    lines = table(simulated("rigid"), every=4).splitlines()
    rows = [line.split(",", 1) for line in lines[1:]]
    later = [f"{float(time) + delay:.9f},{angles}" for time, angles in rows]
    steps = [
        walkerlab.read_walk(written(tmp_path, "\n".join([lines[0], *body]))).summary for body in (lines[1:], later)
    ]
    assert steps[1]["steps"] == steps[0]["steps"]
    assert steps[1]["step_periods_s"] == pytest.approx(steps[0]["step_periods_s"], abs=1e-5)


@pytest.mark.parametrize("factor", [1e-200, 1e9])
def test_steps_of_impossible_duration_are_rejected(tmp_path, factor):
    lines = table(simulated("rigid")).splitlines()
    rows = [line.split(",", 1) for line in lines[1:]]
    body = [f"{factor * float(time):.12g},{angles}" for time, angles in rows]
    with pytest.raises(ConfigError, match=r"steps of .* s are implausible"):
        walkerlab.read_walk(written(tmp_path, "\n".join([lines[0], *body])))


def test_single_outlier_is_reported_and_omitted(tmp_path):
    lines = table(simulated("rigid")).splitlines()
    time, _, other = lines[200].split(",")
    lines[200] = f"{time},3.0,{other}"
    read = walkerlab.read_walk(written(tmp_path, "\n".join(lines))).summary
    assert read["step_periods_s"] == pytest.approx([0.703597] * 6, abs=1e-5)
    assert read["doubts"] == [f"Angle 1 is off its course at sample 200 (time {float(time):.6g} s), which is left out."]


def test_recording_that_begins_within_a_step_starts_at_its_first_heel_strike(tmp_path):
    walk = simulated("rigid")
    lines = table(walk).splitlines()
    late = [line for line in lines[1:] if float(line.split(",")[0]) > 0.3]
    read = walkerlab.read_walk(written(tmp_path, "\n".join([lines[0], *late])))
    assert read.summary["steps"] == 5
    assert read.summary["legs_swapped"]
    assert read.summary["step_periods_s"] == pytest.approx(walk.summary["step_periods_s"][1:], abs=1e-6)


def test_stored_walk_of_another_run_is_read_with_its_energies(tmp_path):
    folder = RunFolder(tmp_path, "paper")
    config = load(None, ("strides=2",)).config
    execute(config, "simulate", folder)
    read = walkerlab.read_walk(folder.artifact("simulate"))
    assert read.summary["steps"] == 4
    assert "mechanical_J" in read.content["trajectory"].variables
    with pytest.raises(ConfigError, match=r"contains no samples of a walk"):
        walkerlab.read_walk(folder.artifact("fixedpoint"))


def test_walk_of_an_exported_model_in_mujoco_is_read_back(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    path, *_ = walkerlab.export_model(tmp_path / "paper.xml", name="paper", slope_rad=0.0174, strides=3)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    stance, hip = data.qpos[2:4].copy(), model.joint("hip").qposadr[0]
    assert hip == 3, stance
    rows = ["time (s),angle 1 (rad),angle 2 (rad)"]
    slope = 0.0174
    while data.time < 3.0:
        rows.append(f"{data.time:.9g},{data.qpos[2] + data.qpos[3] - slope:.12g},{data.qpos[2] - slope:.12g}")
        mujoco.mj_step(model, data, 20)
    read = walkerlab.read_walk(written(tmp_path, "\n".join(rows)), slope_deg=math.degrees(slope))
    assert read.summary["steps"] >= 3
    assert read.summary["step_periods_s"][-1] == pytest.approx(0.712, abs=0.01)
    assert read.summary["step_lengths_m"][-1] == pytest.approx(0.36, abs=0.02)


def test_comparison_shows_the_recorded_walk_in_a_third_column(tmp_path):
    path = written(tmp_path, table(simulated("rigid")))
    config = load(None, ("strides=2", f"recording.file={json.dumps(str(path))}", "recording.name=mine")).config
    compared = answer_in_memory(config, "compare", MEMORY)
    summary = compared.findings["recorded"]
    assert summary["name"] == "mine"
    assert summary["differences"]["rigid"]["max_angle_error_rad"]["aligned"] < 1e-5
    contact = compared.findings["max_angle_error_rad"]["aligned"]
    assert summary["differences"]["contact"]["max_angle_error_rad"]["aligned"] == pytest.approx(contact, rel=0.05)
    assert compared.findings["table3"]["t_cycle"]["recorded"] == pytest.approx(1.407194, abs=1e-5)
    assert {"recorded/rigid/errors", "recorded/contact/aligned"} <= compared.groups.keys()
    characteristics, differences = recorded_tables(summary)
    assert characteristics.columns[-1].title == "mine"
    assert len(differences.groups[""]) == 4
    assert "mine: the last step takes 0.7036 s" in describe_recorded(summary)


def test_figures_label_the_recorded_walk_with_its_name(tmp_path):
    path = written(tmp_path, table(simulated("rigid")))
    config = load(None, ("strides=2", f"recording.file={json.dumps(str(path))}", "recording.name=mine")).config
    folder = RunFolder(tmp_path / "runs", "drawn")
    figures = execute(config, "plot", folder).summary["figures"]
    captions = {figure["number"]: figure["caption"] for figure in figures if "number" in figure}
    assert captions[7].endswith(", mine walked 6 steps.")
    assert "Dotted: mine minus the rigid model at the same phase; maxima: angle" in captions[8]
    for number in ("07", "08", "09"):
        assert "mine" in (folder.path / "figures" / f"figure-{number}.svg").read_text(encoding="utf-8")


def test_result_becomes_stale_only_if_the_content_of_its_file_changes(tmp_path):
    path = written(tmp_path, table(simulated("rigid")))
    config = load(None, (f"recording.file={json.dumps(str(path))}",)).config
    folder = RunFolder(tmp_path / "runs", "recorded")
    assert not execute(config, "recorded-walk", folder).reused
    path.write_text(path.read_text(), encoding="utf-8")
    assert execute(config, "recorded-walk", folder).reused
    written(tmp_path, table(simulated("rigid"), delay=1.0))
    assert not execute(config, "recorded-walk", folder).reused


@pytest.mark.parametrize(
    ("begin", "end", "why"),
    [
        (1.0, 1.3, "step 2 has no sample"),
        (1.36, 1.46, "step 2 has no sample"),  # rows around a heel strike are missing
        (0.9, 1.7, "step 2 has no sample"),  # so many rows are missing that two steps look like one
    ],
)
def test_missing_rows_are_an_error_with_their_position(tmp_path, begin, end, why):
    head, *rows = table(simulated("rigid")).splitlines()
    kept = [row for row in rows if not begin < float(row.split(",")[0]) < end]
    with pytest.raises(ConfigError, match=why) as refusal:
        walkerlab.read_walk(written(tmp_path, "\n".join([head, *kept])))
    assert "8 samples per step" in refusal.value.advice


def test_short_gap_and_a_jump_in_the_last_time_stamp_are_harmless(tmp_path):
    head, *rows = table(simulated("rigid")).splitlines()
    kept = [row for row in rows if not 1.0 < float(row.split(",")[0]) < 1.05 and float(row.split(",")[0]) < 4.0]
    time, angles = kept[-1].split(",", 1)
    kept[-1] = f"{float(time) + 1e9!r},{angles}"
    read = walkerlab.read_walk(written(tmp_path, "\n".join([head, *kept])))
    assert read.summary["step_periods_s"] == pytest.approx([0.703597] * read.summary["steps"], abs=1e-5)


def test_recording_with_five_samples_per_step_is_rejected(tmp_path):
    """The steps would be wrong by several per cent, and velocities by half."""
    trajectory = simulated("rigid").content["trajectory"]
    time = np.arange(0.0, 4.0, 0.15)
    angle = [np.interp(time, trajectory["time"], leg) for leg in trajectory["angle"].T]
    rows = [
        "time (s),angle 1 (rad),angle 2 (rad)",
        *(",".join(map(str, row)) for row in zip(time, *angle, strict=True)),
    ]
    with pytest.raises(ConfigError, match="has no samples from"):
        walkerlab.read_walk(written(tmp_path, "\n".join(rows)))


def test_dense_recording_is_thinned(tmp_path):
    trajectory = simulated("rigid").content["trajectory"]
    time = np.linspace(0.0, 4.0, 4001)
    angle = [np.interp(time, trajectory["time"], leg) for leg in trajectory["angle"].T]
    rows = [
        "time (s),angle 1 (rad),angle 2 (rad)",
        *(",".join(map(str, row)) for row in zip(time, *angle, strict=True)),
    ]
    read = walkerlab.read_walk(written(tmp_path, "\n".join(rows)))
    assert np.bincount(read.content["trajectory"]["step"]).max() <= MAX_STEP_SAMPLES + 2


def marker_recording(folder):
    """Write the rigid walk as a C3D file with a hip and two feet, in mm."""
    ezc3d = pytest.importorskip("ezc3d")
    trajectory = simulated("rigid").content["trajectory"]
    time = np.arange(0.0, 4.0, 0.005)
    hip = np.stack([500.0 * time, np.zeros_like(time), np.full_like(time, 900.0)])
    angles = [np.interp(time, trajectory["time"], leg) for leg in trajectory["angle"].T]
    feet = [hip + 900.0 * np.stack([np.sin(angle), np.zeros_like(time), -np.cos(angle)]) for angle in angles]
    content = ezc3d.c3d()
    values = {"RATE": [200.0], "LABELS": ("HIP", "FOOT1", "FOOT2"), "UNITS": ["mm"]}
    for name, value in values.items():
        content["parameters"]["POINT"][name]["value"] = value
    points = np.ones((4, 3, time.size))
    points[:3] = np.stack([hip, *feet], axis=1)
    content["data"]["points"] = points
    path = folder / "walk.c3d"
    content.write(str(path))
    return path


LEGS = {"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"}


def test_c3d_markers_are_read_as_a_walk(tmp_path):
    read = walkerlab.read_walk(marker_recording(tmp_path), LEGS)
    assert read.summary["step_periods_s"] == pytest.approx([0.703597] * 5, abs=2e-4)


def test_truncated_c3d_file_is_rejected(tmp_path):
    path = marker_recording(tmp_path)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(ConfigError, match=r"walk\.c3d is not a C3D file"):
        walkerlab.read_walk(path, LEGS)


def test_c3d_file_that_crashes_its_reader_is_rejected(tmp_path):
    path = marker_recording(tmp_path)
    content = bytearray(path.read_bytes())
    content[600] = 255  # This byte is among the parameters. It makes ezc3d 1.7.2 read beyond their end.
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=r"walk\.c3d is not a C3D file"):
        walkerlab.read_walk(path, LEGS)


def test_rejected_recording_stores_nothing(tmp_path):
    path = written(tmp_path, "time (s),angle 1 (rad),angle 2 (rad)\n0,0.1\n")
    config = load(None, (f"recording.file={json.dumps(str(path))}",)).config
    folder = RunFolder(tmp_path / "runs", "refused")
    with pytest.raises(ConfigError):
        execute(config, "recorded-walk", folder)
    assert not list(folder.path.rglob("*.h5*"))


def test_bad_recording_is_rejected_before_anything_is_computed(tmp_path):
    path = written(tmp_path, "time (s),angle 1 (rad)\n0,0.1\n1,0.2\n")
    config = load(None, (f"recording.file={json.dumps(str(path))}",)).config
    folder = RunFolder(tmp_path / "runs", "refused")
    with pytest.raises(ConfigError, match="no column for 'angle 2'"):
        execute(config, "compare", folder)
    assert not list(folder.path.rglob("*.h5*"))


class Notes(Silent):
    """Progress display that keeps the lines it receives."""

    def __init__(self):
        self.lines = []

    def note(self, text):
        self.lines.append(text)


@pytest.mark.parametrize("noise", [0.001, 0.05, 0.3])
def test_noise_that_blurs_heel_strikes_is_reported(tmp_path, noise):
    """The amplitude of each leg is 0.2 rad. With noise of 0.05 rad, periods of single steps vary by a tenth."""
    path = written(tmp_path, table(simulated("rigid"), noise=noise))
    config, notes = load(None, (f"recording.file={json.dumps(str(path))}",)).config, Notes()
    with contextlib.suppress(ConfigError):  # The noise may hide the walk completely.
        recorded_walk.run(restrict(config, PIPELINE["recorded-walk"].takes), {}, notes)
    if noise < 0.01:
        assert notes.lines == []
        return
    (line,) = (line for line in notes.lines if "scatter by" in line)
    assert float(re.search(r"scatter by (\S+) rad", line)[1]) == pytest.approx(noise, rel=0.1)
    assert float(re.search(r"amplitude of (\S+) rad", line)[1]) == pytest.approx(0.2, abs=0.05)


def test_sparse_samples_are_not_mistaken_for_noise(tmp_path):
    lines = table(simulated("rigid")).splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    times = np.arange(0.0, rows[-1, 0], 0.08)
    sparse = np.column_stack((times, *(np.interp(times, rows[:, 0], column) for column in rows.T[1:])))
    text = "\n".join([lines[0], *(",".join(map(repr, row)) for row in sparse.tolist())])
    assert walkerlab.read_walk(written(tmp_path, text)).summary["doubts"] == []


def test_comparison_lists_unused_parts_of_a_recording(tmp_path):
    lines = table(simulated("rigid")).splitlines()
    cells = ["kinetic_J (J)", *("" if n == 5 else "1" for n in range(len(lines) - 1))]
    path = written(tmp_path, "\n".join(f"{line},{cell}" for line, cell in zip(lines, cells, strict=True)))
    read = walkerlab.read_walk(path)
    assert len(read.summary["doubts"]) == 1
    assert "Not used: kinetic_J" in read.summary["doubts"][0]
    assert "lacks 1 of" in read.summary["doubts"][0]
    assert "kinetic_J" not in read.content["trajectory"].variables
    stored = {
        "name": "mine",
        "steps": {"recorded": {"period_s": 0.7, "length_m": 0.37}},
        "doubts": read.summary["doubts"],
    }
    assert "Not used: kinetic_J" in describe_recorded(stored)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_every_stage_that_reads_files_rejects_a_named_pipe(tmp_path):
    os.mkfifo(tmp_path / "walk.csv")
    for name in ("walk.csv", "walk.h5"):
        if name == "walk.h5":
            os.mkfifo(tmp_path / name)
        with pytest.raises(ConfigError, match="is a pipe or a device"):
            walkerlab.read_walk(tmp_path / name)
    for level in ("steps", "angles"):
        with pytest.raises(ConfigError, match="is a pipe or a device"):
            walkerlab.identify(tmp_path / "walk.csv", fit={"slope_deg": None}, level=level)


@pytest.mark.parametrize("name", ["a\0b.csv", "\ud800.csv"])
def test_impossible_path_is_rejected(name):
    with pytest.raises(ConfigError, match=r"recording\.file: .* holds a character that no file can store"):
        walkerlab.read_walk(name)


def damaged(draw, lines):
    """Return a recording with one defect, and the name of the defect."""
    head, *rows = lines
    row, cell = draw.randrange(len(rows)), draw.randrange(3)
    cells = rows[row].split(",")
    kind = draw.randrange(18)
    if kind == 0:
        cells[cell] = draw.choice(["abc", "1..2", "--", "1e", "0x1", "\N{GREEK SMALL LETTER PI}"])
    elif kind == 1:
        cells[cell] = ""
    elif kind == 2:
        cells = cells[: cell or 1]
    elif kind == 3:
        cells.append("1.0")
    elif kind == 4:
        rows[row], rows[row - 1] = rows[row - 1], rows[row]
        return "\n".join([head, *rows])
    elif kind == 5:
        head = head.replace("rad", draw.choice(["furlong", "", "m", "Rad/s"]))
    elif kind == 6:
        head = head.replace("angle 1", draw.choice(["angle 2", "phi", "", "time"]))
    elif kind == 7:
        return "\n".join([head, *rows[: draw.randrange(12)]])
    elif kind == 8:
        return "\n".join([head, *rows])[: draw.randrange(400)]
    elif kind == 9:
        return "\n".join(rows)
    elif kind == 10:
        head = head.replace(",", draw.choice([";", "|", " "]))
    elif kind == 11:
        factor = draw.choice([0.0, -1.0, 1e6, 1e-6])
        rows = [",".join([row.split(",")[0], *(repr(factor * float(x)) for x in row.split(",")[1:])]) for row in rows]
        return "\n".join([head, *rows])
    elif kind == 12:
        cells[cell] = draw.choice(["inf", "-inf", "nan", "1e308", "1e400"])
    elif kind == 13:
        return "\n".join([head, *rows]) + "\0"
    elif kind == 14:
        return "\r\n".join([head, *rows, ""])
    elif kind == 15:
        return "\n".join([f"{line},{'note' if place == 0 else ''}" for place, line in enumerate([head, *rows])])
    elif kind == 16:
        return "\ufeff" + "\n".join([head.upper().replace("(S)", "(s)"), *rows])
    else:
        time = float(cells[0])
        cells[0] = repr(time + draw.choice([-10.0, 10.0, 1e9]))
    rows[row] = ",".join(cells)
    return "\n".join([head, *rows])


def test_three_hundred_damaged_files_are_read_or_rejected(tmp_path):
    draw, lines = random.Random(44), table(simulated("rigid"), every=5).splitlines()
    refusals = []
    for number in range(300):
        ending = draw.choice([".csv", ".csv", ".txt", ".sto", ".trc", ".res"])
        path = written(tmp_path, damaged(draw, lines), f"{number}{ending}")
        try:
            read = walkerlab.read_walk(path)
        except ConfigError as error:
            refusals.append((str(path) in error.message, bool(error.advice)))
            continue
        periods = np.array(read.summary["step_periods_s"])
        assert periods.size
        assert np.isfinite(periods).all()
        assert (periods > 0.0).all()
        assert np.isfinite(read.summary["step_lengths_m"]).all()
    assert 200 < len(refusals) < 295
    assert set(refusals) == {(True, True)}


LIMPING = {
    "a prosthesis": ("prosthesis",),
    "a longer leg": ("round-feet", "walker.leg_2={leg_length_m: 0.4005, foot_radius_m: 0.102}"),
}


@pytest.mark.parametrize("begins", ["at the first step", "in the first step"])
@pytest.mark.parametrize("name", LIMPING)
def test_steps_of_a_simulated_limp_are_recovered_from_its_recording_starting_with_leg_1(name, begins, tmp_path):
    own, *sets = LIMPING[name]
    config = load(Path(own), (*sets, "strides=4")).config
    walk = run_in_memory("simulate", config)
    head, *lines = table(walk).splitlines()
    first = 0 if begins == "at the first step" else 2
    late = [line for line in lines if not first or float(line.split(",")[0]) > 0.2]
    path = written(tmp_path, "\n".join([head, *late]))
    read = run_in_memory("recorded-walk", load(Path(own), (*sets, f"recording={{file: {path}}}")).config)
    periods, lengths = (read.summary[f"step_{quantity}"] for quantity in ("periods_s", "lengths_m"))
    assert len(periods) >= 5
    assert not read.summary["legs_swapped"]
    assert read.summary["doubts"] == []
    assert periods == pytest.approx(walk.summary["step_periods_s"][first : first + len(periods)], abs=2e-6)
    assert lengths == pytest.approx(walk.summary["step_lengths_m"][first : first + len(periods)], abs=2e-6)
    assert abs(periods[1] - periods[0]) > 0.01
