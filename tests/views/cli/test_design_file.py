"""Check that `walkerlab design` writes a config that extends its start and can walk, and that it overwrites no file."""

import json
from pathlib import Path

import pytest

from walkerlab.config.loader import load

COMMAND = (
    "design", "-c", "slope-3deg", "--minimise", "spectral_radius", "--over", "walker.hip_mass_kg=8:12", "--set",
    "design.starts=1", "--json",
)  # fmt: skip


def design(walker):
    done = walker(*COMMAND)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_optimum_is_written_as_an_extending_config_without_overwriting(walker):
    found = design(walker)
    path = walker.folder / found["config"]
    assert path.name == "optimum.yaml"
    assert path.read_text(encoding="utf-8").startswith("extends: slope-3deg\n")
    config = load(path).config
    assert config.walker.hip_mass_kg == found["best"]["walker.hip_mass_kg"]
    assert config.design == load(Path("slope-3deg")).config.design
    assert design(walker)["config"] == found["config"]
    path.write_text("extends: paper\n", encoding="utf-8")
    assert Path(design(walker)["config"]).name == "optimum-2.yaml"
    assert path.read_text(encoding="utf-8") == "extends: paper\n"


OVER = "--over walker.foot_radius_m=0.1:0.7"


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (
            f"design -c round-feet --minimise period_s {OVER}",
            f"{OVER}: design.over: walker.foot_radius_m cannot be 0.7 m: it must be below leg_length_m, 0.4",
        ),
        (
            "design --minimise period_s --over walker.leg_mass_kg=5:1",
            "--over walker.leg_mass_kg=5:1: design.over: a block has bounds for walker.leg_mass_kg, [5, 1]: "
            "give two numbers, the lower one first",
        ),
        ("continuation --over slope_deg --from 2 --to 1", "--to 1: continuation.to: 1.0 must be above `from`, 2"),
        ("continuation --over foo --from 1 --to 2", "--over foo: continuation.over: foo is not a key of the config"),
        (
            "continuation --over slope_deg --from 2 --to 91",
            "--to 91: continuation.to: slope_deg cannot be 91 deg: it should be between -90 and 90",
        ),
        (
            "robustness --set robustness.to=[walker.hip_mass_kg,foo]",
            "--set robustness.to=[walker.hip_mass_kg,foo]: robustness.to: foo is not a key of the config",
        ),
        (
            "sweep --stage fixedpoint --over slope_deg=1:2:2 --show froude --against=",
            "--against : fixedpoint has no such quantity",
        ),
        ("fixedpoint --set slope_deg=95", "--set slope_deg=95: slope_deg: 95 is out of bounds"),
    ],
)
def test_errors_quote_the_option_as_typed(command, message, walker):
    done = walker(*command.split())
    assert done.returncode == 3
    assert done.stderr.startswith(f"error: {message}"), done.stderr


def test_help_offers_the_models_allowed_by_the_schema(walker):
    for stage, models in (("design", "rigid|contact "), ("robustness", "rigid|contact|both")):
        done = walker(stage, "--help")
        assert done.returncode == 0
        assert f"--model {models}" in done.stdout


def test_config_without_contact_shows_the_block_to_add(walker):
    done = walker("contact-sim", "-c", "kneed", "--set", "contact=null")
    assert done.returncode == 3
    assert "`contact: {stiffness: 8000, damping: 7.2, terrain: plane}`" in done.stderr


@pytest.mark.parametrize("stage", ["robustness", "design", "continuation"])
def test_model_option_works_without_other_options(stage, walker):
    done = walker(stage, "--model", "contact", "--dry-run", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["run_dir"].endswith(f"{stage}.model=contact")
