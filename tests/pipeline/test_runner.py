import json
import os
import subprocess
import sys

import pytest

from walkerlab.config.reads import StartConfig
from walkerlab.errors import ConfigError, LockedError, StorageError
from walkerlab.pipeline.plan.graph import Graph
from walkerlab.pipeline.plan.planner import survey
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.store.artifact import read

EXPLICIT = "start=[null, 0.2, 0.3, 0.4]"
STEEP = "slope_rad=1.2"


def actions(report):
    return {done.stage.name: done.action for done in report.steps}


def reasons(report):
    return {done.stage.name: done.reason for done in report.steps}


def test_stage_runs_and_stores_its_inputs_first(toy):
    report = toy.execute("roll")
    assert actions(report) == {"drop": "run", "roll": "run"}
    assert not report.reused
    assert report.artifact == toy.runs / "paper" / "roll.h5"
    assert report.summary == {"steps": 10, "duration_s": pytest.approx(10 * (2 / 9.81) ** 0.5)}
    assert read(toy.runs / "paper" / "drop.h5").summary["period_s"] == pytest.approx((2 / 9.81) ** 0.5)


def test_current_results_are_reused(toy):
    first = toy.execute("page")
    before = {path: path.stat().st_mtime_ns for path in (toy.runs / "paper").rglob("*") if path.is_file()}
    second = toy.execute("page")
    assert second.reused
    assert set(actions(second).values()) == {"reuse"}
    assert second.summary == first.summary
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_changed_key_reruns_only_the_affected_stages(toy):
    toy.execute("page", config="paper")
    config, folder = toy.loaded("strides=7")
    again = execute(config, "page", type(folder)(folder.runs_dir, "paper"), graph=toy.graph)
    assert actions(again) == {
        "drop": "reuse",
        "roll": "run",
        "bounce": "reuse",
        "survey": "reuse",
        "picture": "run",
        "page": "run",
    }
    assert reasons(again)["roll"] == "strides 5 -> 7"
    assert reasons(again)["picture"] == "input roll changed"


def test_changed_config_does_not_overwrite_another_run(toy):
    toy.execute("roll")
    before = (toy.runs / "paper" / "roll.h5").read_bytes()
    assert toy.execute("roll", "strides=7").run_dir == toy.runs / "paper@strides=7"
    assert (toy.runs / "paper" / "roll.h5").read_bytes() == before


def test_changed_code_reruns_its_stage_and_dependents(toy):
    toy.execute("page")
    toy.edit("physics", "math.sqrt(2 *", "math.sqrt(2.0 *")
    assert {step.stage.name: step.reason for step in toy.plan("page") if step.action == "run"} == {
        "drop": "code changed",
        "roll": "input drop changed",
        "bounce": "input drop changed",
        "picture": "input bounce changed, input drop changed, input roll changed",
        "page": "input bounce changed, input drop changed, input picture changed, input roll changed",
    }


def test_changed_code_of_another_stage_has_no_effect(toy):
    toy.execute("roll")
    toy.edit("bounce", "Compute", "Return")
    assert toy.execute("roll").reused


def test_force_reruns_everything_needed(toy):
    toy.execute("roll")
    report = toy.execute("roll", force=True)
    assert actions(report) == {"drop": "run", "roll": "run"}
    assert set(reasons(report).values()) == {"--force"}


def test_forced_rerun_gives_equal_results_and_redraws(toy):
    toy.execute("page")
    digest = read(toy.runs / "paper" / "roll.h5").digest()
    toy.execute("roll", force=True)
    assert read(toy.runs / "paper" / "roll.h5").digest() == digest
    report = toy.execute("page")
    assert actions(report)["bounce"] == "reuse"
    assert reasons(report)["picture"] == "input drop was recomputed"


def test_lost_input_is_recomputed_and_matching_results_reused(toy):
    toy.execute("roll")
    (toy.runs / "paper" / "drop.h5").unlink()
    assert actions(toy.execute("roll")) == {"drop": "run", "roll": "reuse"}


@pytest.mark.parametrize("damage", [lambda data: data[: len(data) // 2], lambda data: b"", lambda data: data[::-1]])
def test_damaged_artifact_is_recomputed_with_a_warning(toy, listener, damage):
    toy.execute("roll")
    path = toy.runs / "paper" / "drop.h5"
    sound = read(path).digest()
    path.write_bytes(damage(path.read_bytes()))
    report = toy.execute("roll", reporter=listener)
    assert actions(report) == {"drop": "run", "roll": "reuse"}
    assert len(listener.warnings) == 1
    assert str(path) in listener.warnings[0]
    assert "damaged" in listener.warnings[0]
    assert read(path).digest() == sound


def test_altered_drawing_is_redrawn(toy):
    toy.execute("page")
    figure = toy.runs / "paper" / "figures" / "figure-01.svg"
    drawn = figure.read_bytes()
    figure.write_text("scribbled over")
    assert reasons(toy.execute("picture"))["picture"] == "figures/figure-01.svg was altered"
    assert figure.read_bytes() == drawn
    (toy.runs / "paper" / "report.html").unlink()
    assert reasons(toy.execute("page"))["page"].startswith(("report.html is missing", "input picture was recomputed"))
    assert (toy.runs / "paper" / "report.html").exists()


def test_drawing_uses_whatever_results_are_current(toy):
    figure = toy.runs / "paper" / "figures" / "figure-01.svg"
    report = toy.execute("picture")
    assert "survey" not in actions(report)
    why = "no current result; `walkerlab survey` computes one"
    assert ("survey", why) in {(e.what, e.why) for e in report.left_out}
    assert "without ['survey']" in figure.read_text()
    toy.execute("survey")
    assert toy.execute("picture").left_out == ()
    assert "without []" in figure.read_text()
    assert toy.execute("picture", force=True).left_out == ()
    assert toy.execute("picture").reused


def test_contact_stage_fails_and_drawings_omit_it_without_a_contact_block(toy):
    with pytest.raises(ConfigError, match="contact block"):
        toy.execute("bounce", config="rigid-only")
    report = toy.execute("page", config="rigid-only")
    assert actions(report)["bounce"] == "leave out"
    assert [(entry.what, entry.why) for entry in report.left_out] == [("bounce", "the config has no contact block")]
    assert report.no_answer is None
    assert not (report.run_dir / "bounce.h5").exists()


def test_walker_without_a_contact_model_is_not_advised_to_add_contact(toy):
    with pytest.raises(ConfigError, match="next to no mass") as refused:
        toy.execute("bounce", config="simplest")
    assert refused.value.exit_code == 3
    assert "Add" not in refused.value.advice


def test_stage_without_an_answer_stores_the_reason_and_reports_it_again_when_reused(toy):
    first = toy.execute("drop", STEEP)
    again = toy.execute("drop", STEEP)
    for report in (first, again):
        assert report.no_answer is not None
        assert (report.no_answer.message, report.no_answer.advice) == ("the slope is too steep", "Try one below 1 rad.")
        assert report.no_answer.exit_code == 4
        assert report.summary["slope_rad"] == 1.2
    assert (first.reused, again.reused) == (False, True)
    assert not read(first.artifact).complete
    assert read(first.artifact)["fall"]["height"][0] == 1.0


def test_stage_is_left_out_if_a_stage_it_needs_has_no_answer(toy):
    report = toy.execute("roll", STEEP)
    assert actions(report) == {"drop": "run", "roll": "leave out"}
    assert report.artifact is None
    assert report.no_answer is not None
    assert report.no_answer.message == "drop: the slope is too steep"


def test_walk_on_a_slope_without_a_gait_is_simulated_from_a_given_start(toy):
    report = toy.execute("roll", STEEP, EXPLICIT)
    assert actions(report) == {"roll": "run"}
    assert report.no_answer is None


def test_page_is_written_and_gives_the_reason_if_there_is_no_answer(toy):
    report = toy.execute("page", STEEP)
    assert report.artifact is not None
    assert report.no_answer is not None
    assert [entry.what for entry in report.left_out] == ["drop", "roll", "bounce"]
    assert "the slope is too steep" in (report.run_dir / "report.html").read_text()
    assert toy.execute("page", STEEP).reused


def test_complete_result_without_an_answer_is_shown(toy):
    toy.edit("roll", '"steps": 2', '"no_answer": {"message": "one fell", "advice": "see"}, "steps": 2')
    report = toy.execute("roll")
    assert (report.no_answer.message, report.no_answer.exit_code) == ("one fell", 4)
    page = toy.execute("page")
    assert page.no_answer.message == "roll: one fell"
    assert actions(page)["roll"] == "reuse"
    assert "roll" not in [entry.what for entry in page.left_out]


def test_page_is_rewritten_when_the_reason_for_an_omission_changes(toy):
    toy.execute("page", STEEP)
    toy.edit("drop", "too steep", "far too steep")
    for name in ("toy.drop", "toy"):
        sys.modules.pop(name, None)
    report = toy.execute("page", STEEP)
    assert "far too steep" in (report.run_dir / "report.html").read_text()


def test_omissions_of_a_stage_are_reported(toy):
    assert [(entry.what, entry.why) for entry in toy.execute("roll").left_out] == [("forces", "a stone has none")]


def test_stage_sees_only_its_declared_config(toy):
    config, folder = toy.loaded()
    blind = Graph(Stage("drop", "toy.drop", "", StartConfig))
    with pytest.raises(AttributeError, match="no attribute 'gravity_m_s2'"):
        execute(config, "drop", folder, graph=blind)
    assert not folder.artifact("drop").exists()


def test_failing_stage_keeps_earlier_results(toy):
    toy.execute("drop")
    toy.edit("roll", "period = ", "period = 1 / 0 + ")
    with pytest.raises(ZeroDivisionError):
        toy.execute("roll")
    assert actions(toy.execute("drop")) == {"drop": "reuse"}


def test_jobs_option_reaches_stages_that_work_in_units(toy):
    assert toy.execute("survey", jobs=3).summary["jobs_wall_s"] == 3.0


def test_status_changes_nothing(toy):
    for look in (toy.plan, toy.preview):
        look("page")
        assert not toy.runs.exists()
    report = toy.preview("page")
    assert set(actions(report).values()) == {"run"}
    assert report.artifact is None
    toy.execute("page")
    before = sorted((path, path.stat().st_mtime_ns) for path in toy.runs.rglob("*"))
    assert toy.preview("page").reused
    assert set(actions(toy.preview("page", force=True)).values()) == {"run"}
    config, folder = toy.loaded()
    assert [step.action for step in survey(config, folder, toy.graph) if not step.stage.only_by] == ["reuse"] * 6
    assert sorted((path, path.stat().st_mtime_ns) for path in toy.runs.rglob("*")) == before


def test_reusing_a_result_needs_no_lock_or_write_permission(toy):
    folder = toy.execute("page").run_dir
    (folder / ".lock").unlink()
    assert toy.execute("page").reused
    assert not (folder / ".lock").exists()


def test_result_that_cannot_be_stored_is_reported(toy):
    toy.runs.write_text("a file stands where the folder belongs")
    with pytest.raises(StorageError, match="could not be stored"):
        toy.execute("drop")


EXECUTE = """
import json, sys
from pathlib import Path
from toy.pipeline import GRAPH
from walkerlab.config.loader import load
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.store.runs import RunFolder
class Notes(Silent):
    def note(self, text):
        print(text, file=sys.stderr, flush=True)
report = execute(load().config, "drop", RunFolder(Path(sys.argv[1]), "paper"), graph=GRAPH, reporter=Notes())
print(json.dumps({"reused": report.reused}))
"""


def test_second_process_waits_and_reuses_the_result(toy, tmp_path, listener):
    begun, go_on = tmp_path / "begun", tmp_path / "go-on"
    environment = {**toy.environment, "TOY_BEGUN": str(begun), "TOY_GO_ON": str(go_on)}
    command = [sys.executable, "-c", EXECUTE, toy.runs]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as first:
        while not begun.exists():
            assert first.poll() is None
        with pytest.raises(LockedError):
            toy.execute("drop", wait=False)
        second = subprocess.Popen(
            command, env=toy.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert second.stderr.readline().startswith("waiting: `-c ")
        go_on.touch()
        outputs = [json.loads(process.communicate()[0]) for process in (first, second)]
    assert outputs == [{"reused": False}, {"reused": True}]


def test_killed_run_is_continued_by_the_next(toy, tmp_path):
    begun = tmp_path / "begun"
    environment = {**toy.environment, "TOY_BEGUN": str(begun), "TOY_GO_ON": str(tmp_path / "never")}
    with subprocess.Popen([sys.executable, "-c", EXECUTE, toy.runs], env=environment) as first:
        while not begun.exists():
            assert first.poll() is None
        os.kill(first.pid, 9)
    assert actions(toy.execute("drop", wait=False)) == {"drop": "run"}


def test_second_run_imports_no_stage(toy):
    toy.execute("page")
    code = EXECUTE + "print([name for name in ('toy.drop', 'toy.physics', 'filelock') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code, toy.runs], env=toy.environment, capture_output=True, text=True)
    assert done.stdout.splitlines() == ['{"reused": true}', "[]"], done.stderr


def test_result_with_the_same_key_is_reused_from_another_run(toy, listener):
    toy.execute("bounce")
    config, folder = toy.loaded("strides=7")
    assert toy.preview("bounce", "strides=7").reused
    assert not folder.path.exists()
    report = execute(config, "roll", folder, graph=toy.graph, reporter=listener)
    assert actions(report) == {"drop": "reuse", "roll": "run"}
    assert reasons(report)["drop"] == f"the same as in {toy.runs / 'paper'}"
    assert f"drop: reused (the same as in {toy.runs / 'paper'})" in listener.notes
    assert (folder.path / "drop.h5").samefile(toy.runs / "paper" / "drop.h5")
    assert reasons(toy.execute("roll", "strides=7"))["drop"] == "up to date"


def test_result_of_another_run_is_copied_if_links_are_unsupported(toy, monkeypatch):
    toy.execute("drop")
    monkeypatch.setattr(os, "link", lambda *_: (_ for _ in ()).throw(OSError("no links here")))
    report = toy.execute("drop", "strides=7")
    assert report.reused
    assert read(report.artifact).seal == read(toy.runs / "paper" / "drop.h5").seal
    assert not report.artifact.samefile(toy.runs / "paper" / "drop.h5")


def test_damaged_result_of_another_run_is_ignored(toy):
    path = toy.execute("drop").artifact
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert actions(toy.execute("drop", "strides=7")) == {"drop": "run"}


def test_forced_results_and_drawings_are_not_reused_from_other_runs(toy):
    toy.execute("picture")
    report = toy.execute("picture", "strides=7")
    assert actions(report) == {"drop": "reuse", "roll": "run", "bounce": "reuse", "picture": "run"}
    assert actions(toy.execute("drop", "strides=9", force=True)) == {"drop": "run"}
