import json
import os
import pty


def states(done):
    return {row["stage"]: row["state"] for row in json.loads(done.stdout)["stages"]}


def test_status_distinguishes_missing_current_stale_damaged_and_omitted(toy):
    assert set(states(toy("status", "--json")).values()) == {"missing", "not run"}
    assert "drop     missing\n" in toy("status").stdout
    assert not list(toy.folder.iterdir())
    toy.alone("page")
    runs = toy.folder / "runs"
    assert set(states(toy("status", "--json")).values()) == {"current", "not run"}
    (runs / "paper@strides=3").mkdir()
    (runs / "paper@strides=3" / "roll.h5").write_bytes((runs / "paper" / "roll.h5").read_bytes())
    (runs / "paper@strides=3" / "drop.h5").write_bytes(b"broken")
    found = states(toy("status", "--json", "--strides", "3"))
    assert found == {
        "drop": "damaged",
        "roll": "stale",
        "bounce": "missing",
        "survey": "missing",
        "census": "not run",
        "picture": "missing",
        "page": "missing",
    }
    assert "strides 5 -> 3" in toy("status", "--strides", "3").stdout
    assert states(toy("status", "--json", "--config", "rigid-only"))["bounce"] == "left out"


def test_status_marks_stages_that_found_no_answer(toy):
    steep = ("--set", "slope_rad=1.2")
    toy.alone("page", *steep)
    found = toy("status", "--check", "--json", *steep)
    assert states(found)["drop"] == "no answer"
    assert states(found)["roll"] == "left out"
    assert found.returncode == 0


def test_status_check_exits_5_unless_everything_is_current(toy):
    toy("roll")
    done = toy("status", "--check", "--json")
    assert done.returncode == 5
    assert json.loads(done.stdout)["current"] is False
    assert "error: not every result is up to date: 4 missing." in done.stderr
    assert toy("status").returncode == 0
    toy.alone("page")
    assert toy("status", "--check").returncode == 0


def test_show_prints_summary_arrays_and_origin(toy):
    toy("drop")
    text = toy("show", "drop").stdout
    for word in ("period_s", "height of the stone", "(time 5)", "numpy", "drop"):
        assert word in text
    value = json.loads(toy("show", "drop", "--json").stdout)
    assert value["current"] is True
    assert value["groups"]["fall"]["variables"]["height"] == {
        "dims": ["time"],
        "shape": [5],
        "units": "m",
        "long_name": "height of the stone",
    }
    assert value["provenance"]["config"].startswith("name: paper")


def test_show_exits_3_without_a_run_and_5_without_a_result(toy):
    done = toy("show", "drop")
    assert done.returncode == 3  # The run does not exist.
    assert "advice: `walkerlab drop` creates it." in done.stderr
    toy("drop")
    assert toy("show", "roll").returncode == 5  # The run exists, but has no such result.
    source = toy.folder.parent / "source" / "toy" / "physics.py"
    source.write_text(source.read_text() + "# changed\n")
    done = toy("show", "drop")
    assert done.returncode == 0
    assert "warning: runs/paper/drop.h5 is out of date: code changed" in done.stderr


def test_clean_removes_only_results(toy):
    toy.alone("page")
    run = toy.folder / "runs" / "paper"
    (run / "notes.txt").write_text("mine")
    (run / ".drop.h5.12345678.tmp").touch()
    would = json.loads(toy("clean", "--dry-run", "--json").stdout)["removed"]
    assert (run / "page.h5").exists()
    done = toy("clean", "--yes", "--json")
    assert json.loads(done.stdout)["removed"] == would
    assert sorted(path.name for path in run.iterdir()) == [".lock", "notes.txt"]
    assert "nothing removed" in toy("clean", "--yes").stdout


def test_clean_removes_nothing_without_confirmation(toy):
    toy("drop")
    done = toy("clean")
    assert done.returncode == 2
    assert "--yes" in done.stderr
    assert (toy.folder / "runs" / "paper" / "drop.h5").exists()


def test_clean_asks_for_confirmation_on_a_terminal(toy):
    toy("drop")
    artifact = toy.folder / "runs" / "paper" / "drop.h5"
    for answer, left in ((b"n\n", True), (b"y\n", False)):
        ours, theirs = pty.openpty()
        with toy.start("clean", stdin=theirs) as process:
            os.write(ours, answer)
            assert process.wait(timeout=30) == 0, process.stderr.read()
        os.close(ours)
        os.close(theirs)
        assert artifact.exists() == left


def test_status_states_a_repeated_reason_once(toy):
    toy.alone("page", "--set", "slope_rad=1.2")
    lines = toy("status", "--set", "slope_rad=1.2").stdout.splitlines()
    reasons = [line.split(maxsplit=3)[3] for line in lines[3:] if "left out" in line]
    assert reasons == ["it needs drop", "as roll"]
