"""Parameters that a stage finds become a config in the run's folder, from Python as from the command line."""

from pathlib import Path

import walkerlab
from walkerlab.config.loader import load

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
