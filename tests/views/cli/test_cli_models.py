"""`walkerlab export RUN model` in a process of its own."""

import pytest

from walkerlab.errors import NoAnswer
from walkerlab.exchange.export import ENDINGS
from walkerlab.views.cli import models
from walkerlab.views.cli.target import Target


def test_a_model_of_a_config_without_a_run_computes_its_gait(walker):
    done = walker("export", "paper", "model", "--to", "adm")
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["paper.adm", "paper.acf"]
    assert (walker.folder / "runs" / "paper" / "fixedpoint.h5").is_file()
    assert (walker.folder / "paper.acf").read_text().startswith("paper.adm\npaper\n")
    again = walker("export", "paper", "model", "--to", "adm")
    assert "fixedpoint: reused (up to date)" in again.stderr


def test_files_beside_a_model_have_its_name(walker):
    assert walker("export", "paper", "model", "-o", "mine.adm", "--law", "functions").returncode == 0
    assert (walker.folder / "mine.acf").read_text().startswith("mine.adm\nmine\n")
    assert "STEP" in (walker.folder / "mine.adm").read_text()
    done = walker("export", "level", "model", "--to", "mjcf", "-o", "driven.xml")
    assert done.stdout.split() == ["driven.xml", "driven.py"]
    assert "the script driven.py applies instead" in done.stderr


@pytest.mark.parametrize(("options", "file"), [
    (("--to", "mjcf"), "paper.xml"), (("-o", "a.xml"), "a.xml"), (("-o", "a.mjcf"), "a.mjcf"),
    (("--to", "mjcf", "-o", "b.xml"), "b.xml"), (("--to", "mjcf", "-o", "b.mjcf"), "b.mjcf"),
    (("--to", "c.cmd"), "c.cmd"),
])  # fmt: skip
def test_the_format_is_named_or_follows_the_file(walker, options, file):
    done = walker("export", "paper", "model", *options)
    assert done.stdout.split() == [file]
    first = (walker.folder / file).read_text().splitlines()[0]
    assert first == ("!" if file.endswith("cmd") else "<!--") or first.startswith("! ")


@pytest.mark.parametrize(("arguments", "message"), [
    (("kneed", "--to", "adm"), "Knees that lock cannot be exported"),
    (("round-feet", "--to", "mjcf"), "Set contact.terrain=checkerboard."),
    (("paper", "--to", "pdf"), "a model cannot be written as pdf."),
    (("paper", "--to", "adm", "-o", "x.xml"), "contradicts the ending"),
    (("paper", "--to", "adm", "--law", "hertz"), "--law hertz: unknown contact law."),
    (("paper", "--to", "mjcf", "--law", "functions"), "--law chooses between contact laws of ADAMS."),
    (("rigid-only", "--to", "adm"), "contact"),
    (("nowhere", "--to", "adm"), "there is no config nowhere"),
])  # fmt: skip
def test_a_model_that_cannot_be_written_is_one_message(walker, arguments, message):
    run, *options = arguments
    done = walker("export", run, "model", *options)
    assert done.returncode == 3
    assert message in done.stderr
    assert done.stdout == ""
    assert not [path for path in walker.folder.iterdir() if path.suffix.removeprefix(".") in ENDINGS]


def test_a_walker_without_a_gait_has_no_model(tmp_path, monkeypatch):
    answer = NoAnswer("no gait", "advice")
    monkeypatch.setattr(models, "execute", lambda *_: type("Report", (), {"no_answer": answer})())
    with pytest.raises(NoAnswer):
        models.write_model("paper", tmp_path, Target("adm", tmp_path / "x.adm"), None, None)
    assert not list(tmp_path.glob("x.*"))
