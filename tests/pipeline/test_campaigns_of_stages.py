"""Tests of long campaigns, which run only with `--full`, are kept when complete, and resume after an interruption."""

import pytest

from walkerlab.pipeline.plan.planner import survey
from walkerlab.pipeline.store.artifact import read
from walkerlab.views.cli.stored import state_of


def actions(report):
    return {done.stage.name: done.action for done in report.steps}


def states(toy, *sets):
    config, folder = toy.loaded(*sets)
    return {step.stage.name: state_of(step) for step in survey(config, folder, toy.graph)}


def cut_off(toy, monkeypatch, after, **options):
    """Run the census, and interrupt it after some stones."""
    monkeypatch.setenv("TOY_STONES", str(after))
    with pytest.raises(KeyboardInterrupt):
        toy.execute("census", **options)
    monkeypatch.delenv("TOY_STONES")


def test_campaign_runs_only_with_the_option_full(toy):
    assert actions(toy.execute("survey")) == {"survey": "run"}
    report = toy.execute("survey", full=True)
    assert actions(report) == {"survey": "reuse", "census": "run"}
    assert report.reused
    assert report.summary["census"]["stones"] == [0.1 * number for number in range(4)]


def test_existing_campaign_is_kept(toy):
    toy.execute("survey", full=True)
    before = (toy.runs / "paper" / "census.h5").stat().st_mtime_ns
    assert actions(toy.execute("survey", full=True)) == {"survey": "reuse", "census": "reuse"}
    assert "census" not in actions(toy.execute("page"))
    toy.execute("survey", force=True)
    assert (toy.runs / "paper" / "census.h5").stat().st_mtime_ns == before
    assert "census" in (toy.runs / "paper" / "report.html").read_text().partition("]")[0]


def test_page_without_the_campaign_shows_the_command_that_runs_it(toy):
    toy.execute("page")
    assert (
        "<p>census: it was not requested; `walkerlab survey --full` computes it</p>"
        in (toy.runs / "paper" / "report.html").read_text()
    )
    toy.execute("survey", full=True)
    assert actions(toy.execute("page"))["page"] == "run"


def test_missing_or_outdated_campaign_leaves_other_results_current(toy):
    toy.execute("page")
    assert states(toy)["census"] == "not run"
    toy.execute("survey", full=True)
    assert states(toy)["census"] == "current"
    toy.edit("census", "0.1 * number", "0.2 * number")
    assert states(toy)["census"] == "outdated"


def test_interrupted_campaign_resumes_with_the_same_result(toy, monkeypatch):
    cut_off(toy, monkeypatch, after=3)
    journal = toy.runs / "paper" / "census.parts"
    assert journal.read_bytes().count(b"\n") == 1 + 3
    monkeypatch.setenv("TOY_STONES", "1")  # Three of four stones have been counted.
    toy.execute("census")
    assert not journal.exists()
    monkeypatch.delenv("TOY_STONES")
    toy.execute("census", config="rigid-only", force=True)  # Without `force`, the existing result would be reused.
    undisturbed = read(toy.runs / "rigid-only" / "census.h5")
    assert read(toy.runs / "paper" / "census.h5").digest() == undisturbed.digest()


def test_campaign_parts_stored_under_a_different_key_are_ignored(toy, monkeypatch):
    cut_off(toy, monkeypatch, after=3)
    toy.edit("census", "0.1 * number", "0.2 * number")
    monkeypatch.setenv("TOY_STONES", "3")
    with pytest.raises(KeyboardInterrupt):
        toy.execute("census")


def test_force_option_restarts_the_campaign(toy, monkeypatch):
    cut_off(toy, monkeypatch, after=3)
    cut_off(toy, monkeypatch, after=2, force=True)
    assert (toy.runs / "paper" / "census.parts").read_bytes().count(b"\n") == 1 + 2


def test_dry_run_lists_the_campaign(toy):
    assert actions(toy.preview("survey", full=True)) == {"survey": "run", "census": "run"}
