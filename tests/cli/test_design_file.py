"""`walkerlab design` ends in a config that extends its start, ready to be walked, and never over a file."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from walkerlab.config.loader import load

COMMAND = (
    "design", "-c", "slope-3deg", "--minimise", "spectral_radius", "--over", "walker.hip_mass_kg=8:12", "--set",
    "design.starts=1", "--json",
)  # fmt: skip


def design(folder):
    done = subprocess.run(
        [sys.executable, "-m", "walkerlab", *COMMAND], cwd=folder, capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


def test_the_optimum_is_a_config_that_extends_the_start_and_is_written_over_nothing(tmp_path):
    found = design(tmp_path)
    path = tmp_path / found["config"]
    assert path.name == "optimum.yaml"
    assert path.read_text(encoding="utf-8").startswith("extends: slope-3deg\n")
    config = load(path).config
    assert config.walker.hip_mass_kg == found["best"]["walker.hip_mass_kg"]
    assert config.design == load(Path("slope-3deg")).config.design
    assert design(tmp_path)["config"] == found["config"]
    path.write_text("extends: paper\n", encoding="utf-8")
    assert Path(design(tmp_path)["config"]).name == "optimum-2.yaml"
    assert path.read_text(encoding="utf-8") == "extends: paper\n"


@pytest.mark.parametrize("stage", ["robustness", "design", "continuation"])
def test_the_model_that_is_asked_about_is_an_option_that_goes_by_itself(stage, tmp_path):
    command = [sys.executable, "-m", "walkerlab", stage, "--model", "contact", "--dry-run", "--json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["run_dir"].endswith(f"{stage}.model=contact")
