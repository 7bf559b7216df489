"""Tests of `walkerlab export RUN model` in a separate process."""

import pytest

from walkerlab.errors import NoAnswer
from walkerlab.exchange.export import ENDINGS
from walkerlab.pipeline.run import runner
from walkerlab.views.cli.exports import Target, write_model
from walkerlab.views.cli.request import Request


def test_exporting_a_model_without_a_run_computes_its_gait(walker):
    done = walker("export", "paper", "model", "--to", "adm")
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["paper.adm", "paper.acf"]
    assert (walker.folder / "runs" / "paper" / "fixedpoint.h5").is_file()
    assert (walker.folder / "paper.acf").read_text().startswith("paper.adm\npaper\n")
    again = walker("export", "paper", "model", "--to", "adm")
    assert "fixedpoint: reused (up to date)" in again.stderr


def test_companion_files_of_a_model_share_its_name(walker):
    assert walker("export", "paper", "model", "-o", "mine.adm", "--law", "functions").returncode == 0
    assert (walker.folder / "mine.acf").read_text().startswith("mine.adm\nmine\n")
    assert "STEP" in (walker.folder / "mine.adm").read_text()
    done = walker("export", "level", "model", "--to", "mjcf", "-o", "driven.xml")
    assert done.stdout.split() == ["driven.xml", "driven.py"]
    assert "the script driven.py applies instead" in done.stderr


def test_exported_model_says_that_its_ground_is_tilted(walker):
    assert walker("export", "paper", "model", "--to", "mjcf", "--slope", "geometry").returncode == 0
    text = (walker.folder / "paper.xml").read_text()
    assert "rad, as tilted ground." in text
    assert 'gravity="0.0 0 -9.81"' in text


@pytest.mark.parametrize(("options", "file"), [
    (("--to", "mjcf"), "paper.xml"), (("-o", "a.xml"), "a.xml"), (("-o", "a.mjcf"), "a.mjcf"),
    (("--to", "mjcf", "-o", "b.xml"), "b.xml"), (("--to", "mjcf", "-o", "b.mjcf"), "b.mjcf"),
    (("--to", "c.cmd"), "c.cmd"),
])  # fmt: skip
def test_model_format_is_stated_or_follows_the_file_name(walker, options, file):
    done = walker("export", "paper", "model", *options)
    assert done.stdout.split() == [file]
    first = (walker.folder / file).read_text().splitlines()[0]
    assert first == ("!" if file.endswith("cmd") else "<!--") or first.startswith("! ")


@pytest.mark.parametrize(("arguments", "message"), [
    (("round-feet", "--to", "mjcf"), "Set contact.terrain=checkerboard."),
    (("paper", "--to", "pdf"), "a model cannot be written as pdf."),
    (("paper", "--to", "adm", "-o", "x.xml"), "contradicts the ending"),
    (("paper", "--to", "adm", "--law", "hertz"), "--law hertz: unknown contact law."),
    (("paper", "--to", "mjcf", "--law", "functions"), "--law chooses between contact laws of ADAMS."),
    (("paper", "--to", "mjcf", "--slope", "steep"), "--slope steep: unknown way to express a slope."),
    (("paper", "--to", "adm", "--slope", "geometry"), "models for ADAMS have tilted gravity."),
    (("rigid-only", "--to", "adm"), "contact"),
    (("nowhere", "--to", "adm"), "there is no config nowhere"),
])  # fmt: skip
def test_model_that_cannot_be_written_gives_one_message(walker, arguments, message):
    run, *options = arguments
    done = walker("export", run, "model", *options)
    assert done.returncode == 3
    assert message in done.stderr
    assert done.stdout == ""
    assert not [path for path in walker.folder.iterdir() if path.suffix.removeprefix(".") in ENDINGS]


def test_walker_without_a_gait_is_not_exported(tmp_path, monkeypatch):
    answer = NoAnswer("no gait", "advice")
    monkeypatch.setattr(runner, "execute", lambda *_: type("Report", (), {"no_answer": answer})())
    with pytest.raises(NoAnswer):
        write_model("paper", Request("export", runs=tmp_path, quiet=True), Target("adm", tmp_path / "x.adm"))
    assert not list(tmp_path.glob("x.*"))


LONG_NAME = "x" * 300
EXPORTS = {
    "a model": ("export", "light", "model", "--to", "mjcf"),
    "a trajectory": ("export", "light", "trajectory", "--model", "simulate"),
    "steps": ("export", "light", "steps", "--model", "simulate"),
    "a figure": ("export", "light", "figure-06", "--to", "svg"),
    "a table": ("export", "light", "table-3", "--to", "tex"),
    "a film": ("animate", "light", "--model", "simulate", "--steps", "1", "--rate", "2"),
}


@pytest.mark.parametrize("what", EXPORTS)
def test_export_of_a_run_warns_if_its_config_was_edited(edited, what):
    done = edited(*EXPORTS[what])
    assert done.returncode == 0, done.stderr
    assert "light.yaml has changed since runs/light was computed (walker.hip_mass_kg 10.0 -> 15.0)" in done.stderr


def test_export_of_a_run_warns_if_its_config_was_moved(walker):
    (walker.folder / "light.yaml").write_text("extends: paper\nstrides: 1\n")
    walker("fixedpoint", "-c", "light.yaml")
    (walker.folder / "light.yaml").rename(walker.folder / "lighter.yaml")
    done = walker("export", "light", "model", "--to", "mjcf")
    assert done.returncode == 0, done.stderr
    assert "light.yaml has changed since runs/light was computed (it is no longer there)" in done.stderr


def test_missing_figure_is_not_replaced_by_another(edited):
    done = edited("export", "light", "figure-3")
    assert done.returncode == 3
    assert "this run has no item figure-03" in done.stderr
    assert "Did you mean" not in done.stderr


def test_export_of_an_edited_config_uses_the_edited_walker(walker):
    (walker.folder / "light.yaml").write_text("extends: paper\nstrides: 1\n")
    walker("fixedpoint", "-c", "light.yaml")
    (walker.folder / "light.yaml").write_text("extends: paper\nstrides: 1\nwalker: {hip_mass_kg: 15}\n")
    done = walker("export", "light.yaml", "model", "--to", "mjcf")
    assert "has changed" not in done.stderr
    assert "under 25 kg" in (walker.folder / "light.xml").read_text()


def test_settings_of_a_run_do_not_count_as_edits_of_its_file(walker):
    (walker.folder / "light.yaml").write_text("extends: paper\nstrides: 1\n")
    walker(
        "fixedpoint", "-c", "light.yaml", "--set", "walker.hip_mass_kg=12", "--set", "slope_deg=1.1", "--name", "own"
    )
    (walker.folder / "light.yaml").write_text("extends: paper\nstrides: 1\nwalker: {hip_mass_kg: 15}\nslope_deg: 2\n")
    done = walker("export", "own", "model", "--to", "mjcf")
    assert done.returncode == 0, done.stderr
    assert "has changed" not in done.stderr


def test_only_model_exports_accept_settings(walker):
    done = walker("export", "paper", "model", "--to", "mjcf", "--set", "walker.hip_mass_kg=15", "-o", "heavy.xml")
    assert done.returncode == 0, done.stderr
    assert "under 25 kg" in (walker.folder / "heavy.xml").read_text()
    refused = walker("export", "paper", "trajectory", "--set", "walker.hip_mass_kg=15")
    assert refused.returncode == 2
    assert "changes only a model" in refused.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("export", LONG_NAME, "model"), ("export", LONG_NAME, "7"), ("animate", LONG_NAME), ("open", LONG_NAME),
        ("status", LONG_NAME), ("fixedpoint", "-c", LONG_NAME), ("fixedpoint", "-c", f"{LONG_NAME}.h5"),
        ("clean", "-c", LONG_NAME, "--yes"), ("init", f"{LONG_NAME}.yaml"), ("status", "--runs", LONG_NAME),
    ],
    ids=lambda arguments: " ".join(arguments).replace(LONG_NAME, "NAME"),
)  # fmt: skip
def test_overlong_file_name_gives_one_message(walker, arguments):
    done = walker(*arguments)
    assert done.returncode == 3
    assert done.stderr.startswith("error: ")
    assert "Traceback" not in done.stderr
