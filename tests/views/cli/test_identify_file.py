"""Export the steps of a walk and turn them into a config with `walkerlab identify`, in separate processes."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.pipeline.stages.measured_walk import read_steps

WALK = ("--set", "start=[-0.20477, 0.17, -0.35, -0.9]")
FIT = ("--fit", "walker.hip_mass_kg=5:20", "--set", "walker.hip_mass_kg=9")


def test_exported_steps_are_identified_and_written_as_a_config(walker):
    assert walker("simulate", *WALK, "--name", "walk").returncode == 0
    assert walker("export", "walk", "steps", "--model", "simulate", "-o", "steps.csv").stdout.split() == ["steps.csv"]
    data = walker.folder / "steps.csv"
    assert data.read_text().startswith("period_s,length_m,touch_angle_rad\n")

    done = walker("identify", "--data", "steps.csv", *FIT, "--json")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["models"][0]["fit"] == "fits"
    assert abs(summary["estimates"][0]["value"] - 10.0) < 1e-3
    path = walker.folder / summary["config"]
    assert path.name == "identified.yaml"
    assert "extends: paper" in path.read_text()
    config = load(Path(path)).config
    assert config.walker.hip_mass_kg == summary["estimates"][0]["value"]
    assert config.identify is None

    folder = Path(summary["run_dir"])
    assert json.loads(walker("identify", "--data", "steps.csv", *FIT, "--json").stdout)["reused"]
    shown = walker("show", str(folder), "identify")
    assert "walker.hip_mass_kg" in shown.stdout, shown.stderr
    assert (walker.folder / folder / "figures" / "identified-steps.png").is_file()

    lines = data.read_text().splitlines()
    data.write_text("\n".join((*lines[:-1], "0.7036,0.3714")))
    status = walker("status", str(folder), "--check")
    assert status.returncode == 5
    assert "identify" in status.stdout
    assert not json.loads(walker("identify", "--data", "steps.csv", *FIT, "--json").stdout)["reused"]


@pytest.mark.parametrize(
    ("config", "model"), [("paper", "simulate"), ("round-feet", "simulate"), ("paper", "contact-sim")]
)
def test_exported_steps_are_read_back_unchanged(walker, config, model):
    assert walker(model, "-c", config, "--set", "strides=4", "--name", "walk").returncode == 0
    assert walker("export", "walk", "steps", "--model", model, "--to", "csv", "-o", "steps.csv").returncode == 0
    measured = read_steps(walker.folder / "steps.csv", Identify(), 0.0)
    with h5py.File(walker.folder / "runs" / "walk" / f"{model}.h5") as file:
        steps, angle = file["steps"], file["trajectory/angle"][:]
        assert measured.periods_s.tolist() == steps["period_s"][:].tolist()
        assert measured.lengths_m.tolist() == steps["length_m"][:].tolist()
        if "state_after" in steps:
            assert measured.touch_angles_rad == pytest.approx(steps["state_after"][:, 1], abs=1e-12)
        # The nearest sample is up to half an interval away.
        nearest = [int(np.abs(file["trajectory/time"][:] - time).argmin()) for time in steps["touch_time_s"][:]]
        legs = np.arange(len(nearest)) % 2
        assert measured.touch_angles_rad == pytest.approx(angle[nearest, legs], abs=0.01)


@pytest.mark.parametrize(
    "text",
    [
        "period_s;length_m\n0,7036;0,3714\n0,7040;0,3716\n",
        "period_s\tlength_m\n0,7036\t0,3714\n0,7040\t0,3716\n",
        'period_s,length_m\n"0,7036","0,3714"\n"0,7040","0,3716"\n',
        "step,period,length,note\n,s,m,\n1,0.7036,0.3714,first\n2,0.7040,0.3716,second\n",
    ],
)
def test_table_of_steps_from_a_spreadsheet_is_read(tmp_path, text):
    path = tmp_path / "steps.csv"
    path.write_text(text)
    measured = read_steps(path, Identify(), 0.0)
    assert measured.periods_s.tolist() == [0.7036, 0.704]
    assert measured.lengths_m.tolist() == [0.3714, 0.3716]


def test_step_columns_may_have_a_unit_suffix(tmp_path):
    path = tmp_path / "steps.csv"
    path.write_text("duration (ms),step [mm]\n703.6,371.4\n704.0,371.6\n")
    columns = {"period_s": "duration", "length_m": "step [mm]"}
    assert read_steps(path, Identify(columns=columns), 0.0).lengths_m == pytest.approx([0.3714, 0.3716])
    with pytest.raises(ConfigError, match="is in mm, but --units says m"):
        read_steps(path, Identify(columns=columns, units={"length": "m"}), 0.0)
    with pytest.raises(ConfigError, match="'lenght' is neither a kind, a quantity nor a column"):
        read_steps(path, Identify(columns=columns, units={"lenght": "mm"}), 0.0)


def test_missing_file_is_quoted_as_typed(walker):
    done = walker("identify", "--data", "nowhere.csv", "--fit", "slope_deg")
    assert done.returncode == 3
    assert done.stderr.startswith(
        "error: --data nowhere.csv: identify.data: nowhere.csv cannot be read: there is no such"
    )
    assert not (walker.folder / "runs").exists()
