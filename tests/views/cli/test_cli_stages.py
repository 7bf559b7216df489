import json
import os
import pty
import re
import signal

import pytest

COMMON = {"stage", "run_dir", "artifact", "reused", "wall_s", "left_out"}


def one_object(done):
    """Return the one JSON object on stdout."""
    value, end = json.JSONDecoder().raw_decode(done.stdout)
    assert done.stdout[end:] == "\n"
    assert set(value) >= COMMON
    return value


def test_results_go_to_stdout_and_messages_to_stderr(toy):
    first = toy("roll")
    assert first.returncode == 0
    assert "duration_s" in first.stdout
    assert "ran" not in first.stdout
    told = [line.split()[:2] for line in first.stderr.splitlines()]
    assert told == [["drop:", "starts"], ["drop:", "ran"], ["roll:", "starts"], ["roll:", "ran"]]
    assert "drop: starts (1 of 2)\n" in first.stderr
    assert re.search(r"^drop: ran in [\d.]+ s; still to run: roll$", first.stderr, re.MULTILINE)
    assert "not there yet" not in first.stderr
    second = toy("roll")
    assert second.stdout == first.stdout
    assert [line.split()[:2] for line in second.stderr.splitlines()] == [["drop:", "reused"], ["roll:", "reused"]]


def test_rerun_stage_states_its_reason(toy):
    assert toy("drop").stderr.startswith("drop: starts\n")
    changed = toy("drop", "--force").stderr
    assert changed.startswith("drop: starts (--force)\n")
    assert "--force" not in changed.splitlines()[1]


def test_json_is_one_object_with_the_fixed_keys(toy):
    first = one_object(toy("roll", "--json", "--strides", "3"))
    assert first["stage"] == "roll"
    assert first["run_dir"] == "runs/paper@strides=3"
    assert first["artifact"] == "runs/paper@strides=3/roll.h5"
    assert first["reused"] is False
    assert first["steps"] == 6
    assert first["left_out"] == [{"what": "forces", "why": "a stone has none", "saves": ""}]
    assert [(done["stage"], done["action"]) for done in first["stages"]] == [("drop", "run"), ("roll", "run")]
    assert one_object(toy("roll", "--json", "--strides", "3"))["reused"] is True


def test_quiet_prints_no_messages_and_verbose_prints_details(toy):
    assert toy("roll", "--quiet").stderr == ""
    loud = toy("roll", "--verbose", "--force").stderr
    assert "runs/paper" in loud
    assert "dropping (1)" in loud


def test_warnings_are_printed_even_with_quiet(toy):
    toy("drop")
    (toy.folder / "runs" / "paper" / "drop.h5").write_bytes(b"broken")
    done = toy("drop", "-q")
    assert done.returncode == 0
    assert done.stderr.startswith("warning: runs/paper/drop.h5 is damaged")


def test_dry_run_explains_its_plan_without_changing_anything(toy):
    done = toy("page", "--config", "rigid-only", "--dry-run")
    assert done.returncode == 0
    assert [line.split()[:2] for line in done.stdout.splitlines()[1:-1]] == [
        ["drop", "run"],
        ["roll", "run"],
        ["bounce", "leave"],
        ["survey", "run"],
        ["picture", "run"],
        ["page", "run"],
    ]
    assert "no contact block" in done.stdout
    assert not list(toy.folder.iterdir())
    plan = one_object(toy("page", "--config", "rigid-only", "--dry-run", "--json"))
    assert plan["dry_run"] is True
    (entry,) = plan["left_out"]
    assert (entry["what"], entry["why"]) == ("bounce", "the config has no contact block")
    assert "compiling" in entry["saves"]
    assert {step["reason"] for step in plan["stages"]} == {"not there yet", "the config has no contact block"}


def test_dry_run_after_a_run_reuses_everything(toy):
    toy.alone("page")
    plan = one_object(toy("page", "--dry-run", "--json"))
    assert plan["reused"] is True
    assert {step["action"] for step in plan["stages"]} == {"reuse"}


def test_missing_answer_exits_4_and_keeps_partial_results(toy):
    done = toy("drop", "--set", "slope_rad=1.2", "--json")
    assert done.returncode == 4
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-2:] == ["error: the slope is too steep", "advice: Try one below 1 rad."]
    value = one_object(done)
    assert value["slope_rad"] == 1.2
    assert value["error"]["exit_code"] == 4
    assert (toy.folder / value["artifact"]).exists()


@pytest.mark.parametrize("stage", ["drop", "roll"])
def test_reason_and_advice_for_a_missing_answer_appear_once(toy, stage):
    toy("drop", "--set", "slope_rad=1.2")
    done = toy(stage, "--set", "slope_rad=1.2")
    for said in ("the slope is too steep", "Try one below 1 rad."):
        assert (done.stdout + done.stderr).count(said) == 1


def test_contact_stages_exit_3_without_a_contact_block(toy):
    done = toy("bounce", "--config", "rigid-only", "--json")
    assert done.returncode == 3
    assert "contact block" in one_object(done)["error"]["message"]
    assert not list(toy.folder.iterdir())


def test_bad_config_with_json_prints_one_object(toy):
    done = toy("drop", "--set", "slop_rad=1", "--json")
    assert done.returncode == 3
    assert one_object(done)["error"]["exit_code"] == 3


def test_case_with_a_built_in_name_is_rejected_before_anything_runs(toy):
    (toy.folder / "own.yaml").write_text(
        "extends: paper\nstability: {cases: [{name: moon, expected: [walked], reason: mine}]}\n"
    )
    done = toy("drop", "-c", "own.yaml")
    assert done.returncode == 3
    assert "The catalogue already has cases named moon." in done.stderr
    assert not (toy.folder / "runs").exists()


def test_result_that_cannot_be_stored_exits_4(toy):
    (toy.folder / "runs").write_text("a file stands where the folder belongs")
    done = toy("drop")
    assert done.returncode == 4
    assert done.stderr.splitlines()[-2].startswith("error: runs/paper could not be stored")
    assert done.stderr.splitlines()[-1].startswith("advice: ")


def test_bug_keeps_its_traceback_and_exits_1(toy, tmp_path):
    source = tmp_path / "source" / "toy" / "drop.py"
    source.write_text(source.read_text().replace("progress.start(", "progress.begin("))
    done = toy("drop")
    assert done.returncode == 1
    assert "Traceback" in done.stderr
    assert "AttributeError" in done.stderr


@pytest.fixture
def caught(toy, tmp_path):
    """Start a process, and return it in the middle of a stage."""
    begun, go_on = tmp_path / "begun", tmp_path / "go-on"
    process = toy.start("drop", "--json", environment={"TOY_BEGUN": str(begun), "TOY_GO_ON": str(go_on)})
    with process:
        while not begun.exists():
            assert process.poll() is None, process.communicate()
        process.go_on = go_on.touch
        yield process
        process.kill()


def test_no_wait_exits_6_while_another_process_works(toy, caught):
    done = toy("drop", "--no-wait", "--json")
    assert done.returncode == 6
    assert one_object(done)["error"]["exit_code"] == 6
    os.kill(caught.pid, signal.SIGINT)
    assert caught.wait(timeout=30) == 130
    assert "Traceback" not in caught.stderr.read()
    assert json.loads(caught.stdout.read())["error"]["exit_code"] == 130
    assert toy("drop", "--no-wait").returncode == 0


@pytest.mark.parametrize(("force", "then"), [([], "; its results will be reused"), (["--force"], "")])
def test_waiting_process_names_the_command_it_waits_for(toy, caught, force, then):
    with toy.start("drop", "--json", *force) as second:
        message = second.stderr.readline()
        assert re.fullmatch(
            rf"waiting: `walkerlab drop --json` \(process {caught.pid}, since [\d-]{{10}} [\d:]{{8}}\) is working in "
            rf"runs/paper \(`--name NAME` chooses another folder\){then}\n",
            message,
        ), message
        caught.go_on()
        assert json.loads(second.stdout.read())["reused"] is not bool(force)
    assert json.loads(caught.stdout.read())["reused"] is False


def test_status_shows_the_command_that_is_running(toy, caught):
    for run in ([], ["--set", "strides=5"]):
        lines = toy("status", *run).stdout.splitlines()
        assert lines[0].startswith(f"running in runs/paper: `walkerlab drop --json` (process {caught.pid}, since ")
    (running,) = json.loads(toy("status", "--json").stdout)["running"]
    assert (running["run_dir"], running["command"]) == ("runs/paper", "walkerlab drop --json")
    caught.kill()
    caught.wait()
    assert json.loads(toy("status", "--json").stdout)["running"] == []
    assert toy("status").stdout.startswith("runs/paper:\n")
    assert toy("drop", "--no-wait").returncode == 0
    assert not list((toy.folder / "runs" / "paper").glob(".worker*"))


def test_runs_option_selects_the_folder(toy, tmp_path):
    toy("drop", "--runs", tmp_path / "elsewhere")
    assert (tmp_path / "elsewhere" / "paper" / "drop.h5").exists()
    assert not (toy.folder / "runs").exists()


def read_all(terminal):
    """Return what a process wrote on a terminal until it closed it."""
    text = b""
    while True:
        try:
            text += os.read(terminal, 4096)
        except OSError:
            return text.decode()


def test_progress_bar_appears_only_on_a_terminal(toy):
    ours, theirs = pty.openpty()
    with toy.start("drop", stderr=theirs, environment={"TERM": "xterm"}) as process:
        os.close(theirs)
        drawn = read_all(ours)
        assert process.wait(timeout=30) == 0
    os.close(ours)
    assert "\x1b[" in drawn
    assert "dropping" in drawn
    assert "drop: ran in" in drawn
    off_terminal = toy("drop", "--force", environment={"TERM": "xterm"}).stderr
    assert "\x1b" not in off_terminal
    assert "dropping" not in off_terminal


def test_continuation_over_a_key_needs_its_span(walker):
    done = walker("continuation", "--over", "slope_deg")
    assert done.returncode == 2
    assert "--from and --to" in done.stderr


@pytest.mark.parametrize(
    ("asked", "refused"),
    {
        "continuation --over strides --from 1 --to 2": "strides affects no model",
        "robustness --set robustness.to=[strides]": "strides affects no model",
        "design --minimise period_s --over contact.damping=1:2": "does not affect the rigid model",
    }.items(),
)
def test_invalid_options_are_rejected_before_anything_runs(walker, asked, refused):
    done = walker(*asked.split(), "--json")
    assert done.returncode == 3
    assert refused in json.loads(done.stdout)["error"]["message"]
    assert not list(walker.folder.iterdir())


def test_omissions_are_listed_on_request(toy):
    assert "left out" not in toy.alone("page", "--config", "rigid-only").stdout
    assert (
        "left out: bounce (the config has no contact block)" in toy.alone("page", "--config", "rigid-only", "-v").stdout
    )


def test_plot_prints_paths_relative_to_the_current_folder(walker):
    done = walker("plot", "-c", "rigid-only", "--set", "strides=1", "--runs", "results", "--name", "one")
    assert done.returncode == 0, done.stderr
    paths = [line.split()[0] for line in done.stdout.splitlines() if ".svg" in line]
    assert "results/one/figures/figure-02.svg" in paths
    assert all((walker.folder / path).is_file() for path in paths)
