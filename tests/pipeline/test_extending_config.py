"""Check that parameters found by a stage become a config in the run's folder, from Python and the command line."""

import json
from pathlib import Path

import walkerlab
from walkerlab.config.loader import load
from walkerlab.pipeline.plan.resolve import resolve
from walkerlab.pipeline.run.runner import execute, write_config

DESIGN = {
    "design.minimise": "spectral_radius", "design.over": {"walker.hip_mass_kg": [8, 12]}, "design.starts": 1,
}  # fmt: skip


def test_design_from_python_writes_its_config_once(tmp_path):
    first, again = (walkerlab.run("design", config="slope-3deg", set=DESIGN, runs=tmp_path).summary for _ in range(2))
    path = Path(first["config"])
    assert path.parent == Path(first["run_dir"])
    assert path.read_text(encoding="utf-8").startswith("extends: slope-3deg\n")
    assert load(path).config.walker.hip_mass_kg == first["best"]["walker.hip_mass_kg"]
    assert (again["config"], again["reused"]) == (first["config"], True)
    assert list(path.parent.glob("*.yaml")) == [path]


def test_written_config_names_the_optimum_even_if_the_extended_file_has_changed_to_it(tmp_path):
    """If the file then changes to the optimum, the written config still names the parameter."""
    start = tmp_path / "start.yaml"
    start.write_text("extends: slope-3deg\nname: start\n")
    run = resolve(str(start), [f"{key}={json.dumps(value)}" for key, value in DESIGN.items()], runs=tmp_path / "runs")
    report = execute(run.loaded.config, "design", run.folder)
    (mass,) = report.summary["best"].values()
    start.write_text(f"extends: slope-3deg\nname: start\nwalker: {{hip_mass_kg: {mass}}}\n")
    text = write_config(run, report, "optimum").read_text()
    assert f"hip_mass_kg: {mass}" in text
    assert "extends: ../../start.yaml" in text
