"""Tests of runs as configs: what `-c` accepts, where results go, and that results of other configs are not
overwritten.
"""

import json
import os
import re
import shlex
import shutil
from dataclasses import replace

import pytest

from walkerlab.pipeline.store import artifact


def config(toy, path, gravity, name="stone"):
    file = toy.folder / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"extends: paper\nname: {name}\ngravity_m_s2: {gravity}\n")
    return file


def gravity_of(toy, artifact):
    """Return the gravity that a stored fall of one metre implies: t^2 = 2 / g."""
    stored = json.loads(toy("show", "drop", "-c", artifact.parent, "--json").stdout)
    return 2.0 / stored["summary"]["period_s"] ** 2


def names_in(folder):
    return [path.name for path in folder.iterdir()]


def run_dir(done):
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["run_dir"]


def test_run_named_by_its_folder_stays_in_that_folder(toy):
    config(toy, "stone.yaml", 2)
    config(toy, "far/stone.yaml", 8)
    toy("drop", "-c", "stone.yaml")
    toy("drop", "-c", "far/stone.yaml", "--runs", "far/runs")
    mine = (toy.folder / "runs/stone/drop.h5").read_bytes()
    for named in ("far/runs/stone", toy.folder / "far/runs/stone", "far/runs/stone/drop.h5"):
        assert run_dir(toy("roll", "-c", named, "--json")) == str(named).removesuffix("/drop.h5")
    assert run_dir(toy("roll", "-c", "far/runs/stone", "--runs", "elsewhere", "--json")) == "far/runs/stone"
    assert not (toy.folder / "elsewhere").exists()
    assert names_in(toy.folder / "runs") == ["stone"]
    assert (toy.folder / "runs/stone/drop.h5").read_bytes() == mine
    assert not (toy.folder / "runs/stone/roll.h5").exists()


def test_changed_run_goes_to_a_new_folder_next_to_it(toy):
    toy("drop", "--runs", "far")
    assert run_dir(toy("drop", "-c", "far/paper", "--set", "gravity_m_s2=2", "--json")) == "far/paper@gravity_m_s2=2"
    assert not (toy.folder / "runs").exists()


def test_run_name_is_tried_after_files_and_built_in_configs(toy):
    config(toy, "stone.yaml", 2)
    toy("drop", "-c", "stone.yaml", "--runs", "kept")
    assert run_dir(toy("drop", "-c", "stone", "--runs", "kept", "--json")) == "kept/stone"
    toy("drop", "--set", "gravity_m_s2=2", "--runs", ".")
    (toy.folder / "paper@gravity_m_s2=2").rename(toy.folder / "paper")
    assert run_dir(toy("drop", "-c", "paper", "--json")) == "runs/paper"
    assert run_dir(toy("drop", "-c", "./paper", "--json")) == "paper"
    (toy.folder / "paper").rename(toy.folder / "moved")
    config(toy, "paper", 8, name="of-a-file")
    assert run_dir(toy("drop", "-c", "paper", "--json")) == "runs/of-a-file"


@pytest.mark.parametrize(
    "command", [("roll",), ("roll", "--dry-run"), ("sweep", "--stage", "drop", "--over", "strides=[1]", "--jobs", "1")]
)
def test_results_of_another_file_are_not_overwritten(toy, command):
    config(toy, "here/stone.yaml", 2)
    config(toy, "there/stone.yaml", 8)
    toy("drop", "-c", "here/stone.yaml")
    before = {path: path.read_bytes() for path in (toy.folder / "runs").rglob("*") if path.is_file()}
    done = toy(*command, "-c", "there/stone.yaml")
    assert done.returncode == 3, done.stderr
    assert "runs/stone has results of another config, made from ../here/stone.yaml" in done.stderr
    assert "gravity_m_s2 2.0 -> 8.0" in done.stderr
    assert "--name NAME" in done.stderr
    assert {path: path.read_bytes() for path in (toy.folder / "runs").rglob("*") if path.is_file()} == before
    assert toy(*command, "-c", "there/stone.yaml", "--name", "other").returncode == 0


def test_config_file_does_not_overwrite_the_run_of_a_built_in_config_with_the_same_name(toy):
    toy("drop")
    config(toy, "paper.yaml", 2, name="paper")
    assert toy("drop", "-c", "paper.yaml").returncode == 3
    assert gravity_of(toy, toy.folder / "runs/paper/drop.h5") == pytest.approx(9.81)


def test_renamed_run_folder_is_not_overwritten(toy):
    toy("drop", "--set", "gravity_m_s2=2")
    (toy.folder / "runs/paper@gravity_m_s2=2").rename(toy.folder / "runs/paper")
    assert toy("drop").returncode == 3
    assert gravity_of(toy, toy.folder / "runs/paper/drop.h5") == pytest.approx(2.0)
    assert run_dir(toy("roll", "-c", "runs/paper", "--json")) == "runs/paper"


def test_results_of_unknown_origin_are_not_overwritten(toy):
    config(toy, "stone.yaml", 2)
    toy("drop", "-c", "stone.yaml")
    (toy.folder / "runs/stone/.run.json").unlink()
    config(toy, "stone.yaml", 8)
    assert toy("drop", "-c", "stone.yaml").returncode == 3
    assert run_dir(toy("roll", "-c", "runs/stone", "--json")) == "runs/stone"


def test_rerun_of_an_edited_config_file_keeps_its_run_folder(toy):
    file = config(toy, "stone.yaml", 2)
    for gravity in (2, 8, 2):
        config(toy, "stone.yaml", gravity)
        assert run_dir(toy("drop", "-c", file if gravity == 8 else "stone.yaml", "--json")).endswith("runs/stone")
        assert gravity_of(toy, toy.folder / "runs/stone/drop.h5") == pytest.approx(gravity)
        run_dir(toy("roll", "-c", "runs/stone", "--json"))
    for gravity in (2, 8):
        config(toy, "stone.yaml", gravity)
        assert run_dir(toy("drop", "-c", "stone.yaml", "--set", "strides=3", "--json")) == "runs/stone@strides=3"


def test_moved_project_still_works(toy):
    config(toy, "project/stone.yaml", 2)
    toy("drop", "-c", "project/stone.yaml", "--runs", "project/runs")
    (toy.folder / "project").rename(toy.folder / "moved")
    config(toy, "moved/stone.yaml", 8)
    assert toy("drop", "-c", "moved/stone.yaml", "--runs", "moved/runs").returncode == 0


def test_equal_config_in_another_file_is_the_same_run(toy):
    config(toy, "here/stone.yaml", 2)
    config(toy, "there/stone.yaml", 2)
    toy("drop", "-c", "here/stone.yaml")
    assert toy("roll", "-c", "there/stone.yaml").returncode == 0


def test_run_with_reused_results_has_its_own_config(toy):
    toy("drop")
    toy("drop", "--set", "strides=7")
    assert run_dir(toy("roll", "-c", "runs/paper@strides=7", "--json")) == "runs/paper@strides=7"
    assert toy("roll", "--set", "strides=7", "--dry-run").stdout.count("reuse") == 2
    difference = json.loads(toy("diff", "paper", "paper@strides=7", "--json").stdout)
    assert difference["config"] == [{"key": "strides", "first": 5, "second": 7}]


def test_clean_frees_the_run_name(toy):
    config(toy, "here/stone.yaml", 2)
    config(toy, "there/stone.yaml", 8)
    toy("drop", "-c", "here/stone.yaml")
    advice = re.search(r"`walkerlab (clean -c [^`]*)`", toy("drop", "-c", "there/stone.yaml").stderr)[1]
    assert toy(*shlex.split(advice), "--yes").returncode == 0
    assert toy("drop", "-c", "there/stone.yaml").returncode == 0


def test_failed_export_succeeds_after_the_suggested_command(walker):
    there = walker.folder / "here"
    there.mkdir()
    assert walker("fixedpoint", "-c", "rigid-only", "--runs", "r5").returncode == 0
    walker.folder = there
    export = ("export", "../r5/rigid-only", "trajectory", "--to", "csv", "--model", "simulate")
    done = walker(*export)
    assert done.returncode == 5
    advised = re.search(r"`walkerlab ([^`]*)`", done.stderr)[1]
    assert walker(*shlex.split(advised)).returncode == 0
    assert walker(*export).returncode == 0
    assert names_in(there) == ["rigid-only-simulate-trajectory.csv"]


@pytest.mark.parametrize(
    "command",
    [
        ("drop", "-c", "nothing"),
        ("show", "drop", "-c", "runs/nothing"),
        ("status", "nothing"),
        ("status", "-c", "nothing"),
        ("diff", "paper", "nothing"),
        ("diff", "nothing", "paper"),
        ("open", "nothing"),
        ("export", "runs/nothing", "trajectory", "--to", "csv"),
        ("animate", "nothing"),
        ("clean", "-c", "nothing", "--yes"),
        ("rerun", "runs/nothing/drop.h5"),
        ("sweep", "-c", "nothing", "--stage", "drop", "--over", "strides=[1]"),
    ],
)
def test_missing_run_exits_3(toy, command):
    toy("drop")
    done = toy(*command)
    assert done.returncode == 3, done.stderr
    assert "there is no" in done.stderr
    assert names_in(toy.folder / "runs") == ["paper"]


def test_damaged_results_are_reported_once_with_the_command_to_recompute_them(toy):
    toy.alone("page")
    toy("roll", "--set", "strides=7")
    artifacts = [toy.folder / "runs/paper" / name for name in ("drop.h5", "roll.h5")]
    for path in artifacts:
        data = path.read_bytes()
        path.unlink()  # The other run may share the file of a reused result.
        path.write_bytes(data[:-1])
    made = "`walkerlab drop -c runs/paper` and `walkerlab roll -c runs/paper` recompute them."
    done = toy("diff", "paper", "paper@strides=7")
    assert (done.returncode, done.stderr.splitlines()[1]) == (5, f"advice: {made}")
    assert all(f"runs/paper/{path.name} is damaged: it does not end" in done.stderr for path in artifacts)
    for command in (("show", "roll"), ("rerun", "runs/paper/roll.h5")):
        done = toy(*command)
        assert done.returncode == 5, done.stderr
        assert "runs/paper/roll.h5" in done.stderr
        assert "damaged: it does not end" in done.stderr
        assert "Traceback" not in done.stderr
    done = toy("roll", "-c", "runs/paper/roll.h5")
    assert done.returncode == 3
    assert "runs/paper/roll.h5 is damaged, and no config can be taken from it" in done.stderr
    states = json.loads(toy("status", "paper", "--json").stdout)["stages"]
    assert {row["stage"]: row["state"] for row in states if row["state"] == "damaged"} == dict.fromkeys(
        ("drop", "roll"), "damaged"
    )
    assert toy("roll", "-c", "runs/paper").returncode == 0
    assert toy("diff", "paper", "paper@strides=7").returncode == 0


def test_page_reports_that_a_damaged_result_is_omitted(toy):
    toy.alone("survey", "--full")
    census = toy.folder / "runs/paper/census.h5"
    census.write_bytes(census.read_bytes()[:-1])
    assert toy.alone("page").returncode == 0
    page = (toy.folder / "runs/paper/report.html").read_text()
    assert "<p>census: its result is damaged: it does not end" in page
    assert "`walkerlab survey --full` recomputes it</p>" in page


def test_named_run_is_found_by_its_name(toy):
    heavy = ("--set", "gravity_m_s2=2")
    assert run_dir(toy("drop", *heavy, "--name", "moon", "--json")) == "runs/moon"
    assert run_dir(toy("roll", "-c", "moon", "--json")) == "runs/moon"
    shown = json.loads(toy("show", "moon", "drop", "--json").stdout)
    assert shown["artifact"] == "runs/moon/drop.h5"
    assert 2.0 / shown["summary"]["period_s"] ** 2 == pytest.approx(2.0)
    assert json.loads(toy("status", *heavy, "--name", "moon", "--json").stdout)["run_dir"] == "runs/moon"
    swept = toy("sweep", "--stage", "drop", "--over", "strides=[1]", "--jobs", "1", "--name", "moons", "--json")
    assert run_dir(swept) == "runs/moons"


def test_named_run_is_not_overwritten_by_a_run_with_different_settings(toy):
    toy("drop", "--set", "gravity_m_s2=2", "--name", "moon")
    done = toy("drop", "--set", "gravity_m_s2=3", "--name", "moon")
    assert done.returncode == 3
    assert "runs/moon has results of another config, made from built-in paper.yaml with gravity_m_s2=2" in done.stderr
    assert toy("drop", "--set", "gravity_m_s2=2", "--name", "moon").returncode == 0


@pytest.mark.parametrize("name", ["../out", "a/b", "", "a b"])
def test_invalid_run_name_is_rejected(toy, name):
    done = toy("drop", "--name", name)
    assert done.returncode == 3
    assert "--set" not in done.stderr.splitlines()[0], "it is not what was typed"


def test_run_is_listed_under_one_name_only(toy):
    toy("drop")
    assert toy("show", "paper", "drop", "-c", "paper").returncode == 2
    assert toy("show", "paper", "paper", "drop").returncode == 2
    assert toy("show", "nowhere", "drop").returncode == 3
    assert "advice: `walkerlab roll -c paper` computes it." in toy("show", "paper", "roll").stderr


def test_damaged_result_is_reported_once(toy):
    toy("drop")
    (toy.folder / "runs" / "paper" / "drop.h5").write_bytes(b"half a file")
    (line,) = (line for line in toy("status", "paper").stdout.splitlines() if line.startswith("drop"))
    assert line.count("damaged") == 1


LONG = ("--set", "gravity_m_s2=1.62", "--set", "walker.leg_mass_kg=6.25")
LONG_AS_LISTED = ["walker.leg_mass_kg=6.25", "gravity_m_s2=1.62"]


def test_status_lists_changes_that_a_short_name_omits(toy):
    folder = run_dir(toy("drop", *LONG, "--json"))
    assert re.fullmatch(r"runs/paper@walker\.leg_mass_kg-[0-9a-f]{8}", folder)
    toy("drop")
    found = json.loads(toy("status", "--json").stdout)["runs"]
    assert {run["name"]: run["changes"] for run in found} == {"paper": [], folder.removeprefix("runs/"): LONG_AS_LISTED}
    assert "changed: walker.leg_mass_kg=6.25, gravity_m_s2=1.62" in toy("status", folder).stdout
    of_all = toy("status").stdout
    assert "walker.leg_mass_kg=6.25, gravity_m_s2=1.62" in of_all
    further = run_dir(toy("drop", "-c", folder, "--set", "strides=9", "--json"))
    assert json.loads(toy("status", further, "--json").stdout)["changes"] == [*LONG_AS_LISTED, "strides=9"]
    named = run_dir(toy("drop", *LONG, "--name", "moon", "--json"))
    assert json.loads(toy("status", named, "--json").stdout)["changes"] == LONG_AS_LISTED


def test_run_keeps_the_long_name_that_an_older_version_gave_it(toy):
    old = "paper@walker.leg_mass_kg=6.25,gravity_m_s2=1.62,strides=9-cd9cca311320"
    made = run_dir(toy("drop", *LONG, "--json"))
    (toy.folder / made).rename(toy.folder / "runs" / old)
    record = toy.folder / "runs" / old / ".run.json"
    written = {**json.loads(record.read_text()), "run": old}
    del written["changes"]
    record.write_text(json.dumps(written))
    done = json.loads(toy("drop", "-c", old, "--json").stdout)
    assert (done["run_dir"], done["reused"]) == (f"runs/{old}", True)
    assert json.loads(toy("roll", "-c", old, "--json").stdout)["run_dir"] == f"runs/{old}"
    assert "walker.leg_mass_kg=6.25" in toy("status", old).stdout


def test_provenance_keeps_a_command_with_undecodable_names(toy):
    odd = os.fsdecode(b"r\xff")
    assert toy("drop", "--runs", odd, "--json").returncode == 0
    assert "r\\xff" in json.loads(toy("show", "drop", "--runs", odd, "--json").stdout)["provenance"]["command_line"]


@pytest.mark.parametrize("config", ["extends: /etc/hostname\n", "stability: {cases: /etc/hostname}\n"])
def test_stored_config_that_refers_to_a_file_is_rejected(toy, config):
    toy("drop")
    path = toy.folder / "runs/paper/drop.h5"
    stored = artifact.read(path)
    artifact.write(path, stored, stored.identity, replace(stored.provenance, config=config))
    done = toy("drop", "-c", "runs/paper/drop.h5")
    assert done.returncode == 3
    assert "a stored config refers to a file" in done.stderr
    assert "hostname" not in done.stderr


def test_result_of_another_stage_is_not_accepted(toy):
    toy("drop")
    (toy.folder / "runs/paper/drop.h5").rename(toy.folder / "runs/paper/roll.h5")
    rows = json.loads(toy("status", "-c", "paper", "--json").stdout)["stages"]
    roll = next(row for row in rows if row["stage"] == "roll")
    assert (roll["state"], roll["why"]) == ("damaged", "damaged: it is a result of drop, not of roll")
    assert toy("diff", "paper", "paper").returncode == 5


def test_diff_warns_of_a_result_that_belongs_to_another_config(toy):
    toy("drop")
    toy("drop", "--set", "slope_deg=3")
    shutil.copy(toy.folder / "runs/paper@slope_deg=3/drop.h5", toy.folder / "runs/paper/drop.h5")
    done = toy("diff", "paper", "paper@slope_deg=3")
    assert done.returncode == 0
    assert "warning: runs/paper/drop.h5 is out of date: slope_rad" in done.stderr
    assert "warning: runs/paper@slope_deg=3" not in done.stderr
