"""Tests of commands that start, repeat and remove runs, and of interrupted commands."""

import json
import os
import re
import shlex
import signal
import subprocess
from pathlib import Path

import pytest

from walkerlab.config.loader import load, safe_name
from walkerlab.errors import add_run_options
from walkerlab.views.cli.request import Request, SetByOption


def test_config_written_by_init_loads_and_names_its_schema(walker):
    done = walker("init", "my walker.yaml")
    assert done.returncode == 0
    assert "walkerlab report -c 'my walker.yaml'" in done.stdout
    text = (walker.folder / "my walker.yaml").read_text()
    assert text.startswith("# yaml-language-server: $schema=.walkerlab-schema.json\n")
    assert "# leg length L, from foot to hip: number, from 0.001 to 1000 (m)\n  leg_length_m: 1.0\n" in text
    assert "slope_rad" in json.loads((walker.folder / ".walkerlab-schema.json").read_text())["properties"]
    assert (
        load(walker.folder / "my walker.yaml").config.model_dump()
        == load().config.model_copy(update={"name": "my-walker", "source": None}).model_dump()
    )
    assert walker("init", "my walker.yaml").returncode == 4


def test_init_accepts_every_walker_type(walker):
    done = walker("init", "x.yaml", "--type", "compas")
    assert done.returncode == 3
    assert "Did you mean compass?" in done.stderr


def test_init_explains_what_is_out_of_scope(walker):
    done = walker("init", "x.yaml", "--type", "runner")
    assert done.returncode == 3
    assert "no running: its walkers always have a foot on the ground" in done.stderr
    assert "mean" not in done.stderr


@pytest.mark.parametrize(
    ("walker_type", "config"), [("torso", "torso"), ("parts", "parts"), ("straight-legs", "round-feet")]
)
def test_init_with_a_type_writes_its_built_in_config_to_a_file_named_after_the_type(walker, walker_type, config):
    assert walker("init", "--type", walker_type).returncode == 0
    written = load(walker.folder / f"my-{walker_type}.yaml").config
    assert written.model_copy(update={"name": config}) == load(Path(config)).config


@pytest.mark.parametrize("walker_type", ["compass", "straight-legs", "kneed", "parts", "torso"])
def test_every_key_that_init_writes_has_a_comment_above_it(walker, walker_type):
    assert walker("init", "x.yaml", "--type", walker_type).returncode == 0
    lines = (walker.folder / "x.yaml").read_text().splitlines()
    values = [n for n, line in enumerate(lines) if re.match(r" *\w+: \S", line)]
    assert len(values) > 20
    assert [lines[n] for n in values if not lines[n - 1].lstrip().startswith("#")] == []


@pytest.mark.parametrize(("text", "name"), [("Läufer 2", "Laufer-2"), ("a  b", "a-b"), ("-x.", "x"), ("歩", "run")])
def test_file_name_becomes_a_safe_run_name(text, name, tmp_path):
    assert safe_name(text) == name
    path = tmp_path / f"{text}.yaml"
    path.write_text("extends: paper\n")
    loaded = load(path)
    assert loaded.run_name == name
    assert f"the run is named {name}" in loaded.warnings[0]


def test_longer_leg_with_an_unchanged_mass_position_is_reported():
    (warning,) = load(sets=["walker.leg_length_m=1.2"]).warnings
    assert "walker.foot_to_mass_m is still 0.5 m" in warning
    assert load(sets=["walker.leg_length_m=1.2", "walker.foot_to_mass_m=0.6"]).warnings == ()


def test_moving_a_mass_along_an_unchanged_leg_raises_no_warning(tmp_path):
    assert load(sets=["walker.foot_to_mass_m=0.3"]).warnings == ()
    path = tmp_path / "mine.yaml"
    path.write_text("extends: paper\nwalker: {foot_to_mass_m: 0.3}\n")
    assert load(path).warnings == ()
    assert "walker.foot_to_mass_m is still 0.3 m" in load(path, ["walker.leg_length_m=1.2"]).warnings[0]


def test_run_can_be_used_as_config_and_reruns_in_its_folder(toy):
    toy("roll", "--strides", "3")
    folder = "runs/paper@strides=3"
    for config in (folder, f"{folder}/roll.h5"):
        done = json.loads(toy("roll", "-c", config, "--json").stdout)
        assert done["run_dir"] == folder
        assert done["reused"] is True
    changed = json.loads(toy("roll", "-c", folder, "--set", "slope_deg=2", "--json").stdout)
    assert changed["run_dir"] == "runs/paper@strides=3,slope_deg=2"
    assert not (toy.folder / "runs" / "paper").exists()


def test_folder_without_results_is_not_a_config(toy):
    (toy.folder / "empty").mkdir()
    done = toy("roll", "-c", "empty")
    assert done.returncode == 3
    assert "no result to take a config from" in done.stderr


def test_rerun_says_whether_results_are_reproduced(toy):
    toy("roll")
    artifact = "runs/paper/roll.h5"
    done = toy("rerun", artifact)
    assert done.returncode == 0
    assert "is reproduced bit for bit" in done.stdout
    source = toy.folder.parent / "source" / "toy" / "physics.py"
    source.write_text(source.read_text().replace("math.sqrt(2", "math.sqrt(3"))
    done = toy("rerun", artifact, "--json")
    assert done.returncode == 5
    assert "the code has changed since" in done.stderr
    printed = json.loads(done.stdout)
    assert printed["same"] is False
    assert "is not reproduced" in printed["error"]["message"]


def test_open_without_a_page_names_the_command_that_writes_it(toy):
    for command in (("open",), ("status", "paper"), ("diff", "paper", "kneed")):
        assert toy(*command).stderr.splitlines()[:2] == [
            "error: there is no run paper.",
            "advice: `walkerlab report` creates the run of the paper config.",
        ]
    toy("roll")
    assert "there is no run papr. Did you mean paper?" in toy("open", "papr").stderr
    done = toy("open", "paper")
    assert done.returncode == 5
    assert "walkerlab report -c runs/paper" in done.stderr


def test_explanation_of_a_key_fits_80_columns(walker):
    lines = walker("schema", "contact").stdout.splitlines()
    assert "contact.stiffness" in lines
    assert max(map(len, lines)) < 80
    done = walker("schema", "contact.stifness")
    assert done.returncode == 3
    assert "Did you mean contact.stiffness?" in done.stderr


def test_key_of_one_walker_type_is_found_by_its_config_name(walker):
    lines = walker("schema", "walker.thigh").stdout.splitlines()
    assert "walker(kneed).thigh.length_m" in lines
    assert walker("schema", "walker(kneed).thigh").stdout.splitlines() == lines


def test_schema_of_a_key_lists_only_that_key(walker):
    stiffness = json.loads(walker("schema", "contact.stiffness", "--json").stdout)
    assert (stiffness["default"], stiffness["unit"]) == (1e5, "N/mm^e or N/m^e")
    thigh = json.loads(walker("schema", "walker.thigh", "--json").stdout)
    assert set(thigh["$defs"]) == {"Thigh"}
    assert "mass_below_hip_m" in thigh["$defs"]["Thigh"]["properties"]
    masses = json.loads(walker("schema", "walker.hip_mass_kg", "--json").stdout)["anyOf"]
    assert [one["default"] for one in masses] == [10.0, 0.0, 0.5]
    assert json.loads(walker("schema", "walker(kneed).hip_mass_kg", "--json").stdout)["default"] == 0.5
    done = walker("schema", "contact.stifness", "--json")
    assert done.returncode == 3
    assert "contact.stiffness?" in json.loads(done.stdout)["error"]["message"]


def test_init_creates_the_folder_and_suggests_only_valid_commands(walker):
    assert walker("init", "sub/dir/x.yaml").returncode == 0
    assert load(walker.folder / "sub" / "dir" / "x.yaml").run_name == "x"
    done = walker("init", "sub/dir/x.yaml/y.yaml")
    assert done.returncode == 4
    assert "sub/dir/x.yaml/y.yaml could not be written" in done.stderr
    assert "--runs" not in done.stderr


def test_missing_config_suggests_init(walker):
    done = walker("fixedpoint", "-c", "mine.yaml")
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1] == "advice: `walkerlab init` writes a config to start from"


def test_animate_exits_3_if_the_run_is_missing(walker):
    done = walker("animate", "paper")
    assert done.returncode == 3
    assert "there is no run paper" in done.stderr


def test_suggested_commands_are_valid(toy):
    done = toy("show", "roll", "--strides", "3", "--set", "slope_deg=2")
    assert "advice: `walkerlab roll --set slope_deg=2 --set strides=3` creates it." in done.stderr
    request = Request("simulate", sets=["start=[0, 1, 2, 3]"])
    assert add_run_options("`walkerlab status` or `walkerlab schema`", request.typed_for) == (
        "`walkerlab status --set 'start=[0, 1, 2, 3]'` or `walkerlab schema`"
    )


def test_advice_repeats_only_the_options_that_matter():
    own = SetByOption('identify.data="my steps.csv"', "--data", "my steps.csv")
    request = Request("identify", (own,), sets=["slope_deg=40"])
    assert request.typed_for("identify") == " --set slope_deg=40 --data 'my steps.csv'"
    assert request.typed_for("continuation") == " --set slope_deg=40"
    assert request.typed_for("status") == " --set slope_deg=40 --set 'identify.data=\"my steps.csv\"'"


def test_slope_cannot_be_set_in_both_units(toy):
    done = toy("drop", "--set", "slope_deg=2", "--set", "slope_rad=0.1")
    assert done.returncode == 3
    assert "slope already set by slope_deg" in done.stderr


def test_clean_all_leaves_no_empty_folders(toy):
    toy("roll")
    toy("roll", "--strides", "3")
    (toy.folder / "runs" / "paper" / "notes.txt").write_text("mine")
    removed = json.loads(toy("clean", "--all", "--yes", "--json").stdout)["removed"]
    assert len(removed) == 4
    assert [path.name for path in (toy.folder / "runs").iterdir()] == ["paper"]


def test_termination_exits_like_an_interrupt_and_names_the_run(toy, tmp_path):
    begun = tmp_path / "begun"
    environment = {"TOY_BEGUN": str(begun), "TOY_GO_ON": str(tmp_path / "never")}
    with toy.start("drop", "--json", environment=environment) as process:
        while not begun.exists():
            assert process.poll() is None
        os.kill(process.pid, signal.SIGTERM)
        assert process.wait(timeout=30) == 130
        value = json.loads(process.stdout.read())
    assert value["run_dir"] == "runs/paper"
    assert value["error"]["exit_code"] == 130


def test_command_ends_quietly_if_its_output_pipe_is_closed(walker):
    with walker.start("schema") as process:
        process.stdout.close()
        assert process.wait(timeout=30) in (0, 141)
        assert process.stderr.read() == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device here")
def test_full_output_device_is_reported(walker):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*walker.command, "schema"], cwd=walker.folder, env=walker.environment, stdout=full, stderr=subprocess.PIPE
        )
    assert done.returncode == 4
    assert b"error: the output could not be written" in done.stderr
    assert b"Traceback" not in done.stderr


def test_init_on_a_full_disk_leaves_no_partial_file(walker):
    command = f"ulimit -f 1; exec {shlex.join(walker.command)} init x.yaml"
    done = subprocess.run(["bash", "-c", command], cwd=walker.folder, env=walker.environment, capture_output=True)
    assert done.returncode == 4
    assert b"x.yaml could not be written" in done.stderr
    assert list(walker.folder.iterdir()) == []


def test_output_pipe_is_written_into_and_not_replaced(walker):
    os.mkfifo(walker.folder / "pipe")
    with walker.start("draw", "simplest", "--to", "svg", "-o", "pipe", stdout=subprocess.DEVNULL) as process:
        drawn = (walker.folder / "pipe").read_bytes()
        assert process.wait(timeout=60) == 0
    assert drawn.startswith(b"<?xml")
    assert drawn.rstrip().endswith(b"</svg>")
    assert (walker.folder / "pipe").is_fifo()


def test_output_link_is_followed_and_not_replaced(walker):
    (walker.folder / "link.svg").symlink_to("walker.svg")
    assert walker("draw", "simplest", "-o", "link.svg").returncode == 0
    assert (walker.folder / "link.svg").is_symlink()
    assert (walker.folder / "walker.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("mine.yaml", "mine.yaml is an input of this command"),
        ("base.yaml", "base.yaml is an input of this command"),
        (".", ". is a folder"),
    ],
)
def test_drawing_overwrites_neither_its_source_nor_a_folder(walker, target, said):
    (walker.folder / "base.yaml").write_text("extends: paper\n")
    (walker.folder / "mine.yaml").write_text("extends: base.yaml\n")
    done = walker("draw", "mine.yaml", "--to", "svg", "-o", target)
    assert done.returncode == 3
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert (walker.folder / "mine.yaml").read_text() == "extends: base.yaml\n"
    assert (walker.folder / "base.yaml").read_text() == "extends: paper\n"


def test_undecodable_file_names_are_escaped_in_output(walker):
    odd = os.fsdecode(b"r\xff")
    for command in (("status", "--runs", odd), ("draw", "simplest", "-o", f"{odd}.svg"), ("export", odd, "7")):
        done = walker(*command)
        assert "Traceback" not in done.stderr, done.stderr
        assert "r\\udcff" in done.stdout + done.stderr
    assert (walker.folder / f"{odd}.svg").is_file()


def test_characters_missing_from_the_terminal_are_escaped(walker):
    done = walker("schema", "slope_rad", environment={"PYTHONIOENCODING": "ascii"})
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)


def test_command_with_closed_stdout_ends_quietly(walker):
    command = f"exec {shlex.join(walker.command)} schema >&-"
    done = subprocess.run(["bash", "-c", command], cwd=walker.folder, env=walker.environment, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")


def test_compile_says_how_many_kernels_are_ready(walker):
    done = walker("compile", "-c", "rigid-only", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"\d+ kernels are ready for rigid-only, after \d+ s\.\n", done.stdout)


def test_verbose_version_shows_where_kernels_come_from(walker):
    first, versions, *kernels = walker("--version", "--verbose").stdout.splitlines()
    assert first.startswith("walkerlab ")
    assert {"Python", "numba", "llvmlite", "sources"} <= set(versions.split())
    assert kernels[0].startswith("kernels: ")
