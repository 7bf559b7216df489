"""`walkerlab identify` from a walk's exported steps to a config, in processes of their own."""

import json
from pathlib import Path

from walkerlab.config.loader import load

WALK = ("--set", "start=[-0.20477, 0.17, -0.35, -0.9]")
FIT = ("--fit", "walker.hip_mass_kg=5:20", "--set", "walker.hip_mass_kg=9")


def test_exported_steps_are_identified_and_written_as_a_config(walker):
    assert walker("simulate", *WALK, "--name", "walk").returncode == 0
    assert walker("export", "walk", "steps", "--model", "simulate", "-o", "steps.csv").stdout.split() == ["steps.csv"]
    data = walker.folder / "steps.csv"
    assert data.read_text().startswith("period_s,length_m\n")

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


def test_a_missing_file_is_refused_as_it_was_typed(walker):
    done = walker("identify", "--data", "nowhere.csv", "--fit", "slope_deg")
    assert done.returncode == 3
    assert done.stderr.startswith(
        "error: --data nowhere.csv: identify.data: nowhere.csv cannot be read: there is no such"
    )
    assert not (walker.folder / "runs").exists()
