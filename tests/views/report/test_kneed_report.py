"""Run a kneed walker through the stages: gait, both models, their comparison, and the page."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from html_page import Page

from walkerlab.config.loader import load
from walkerlab.evidence.paper.compare import CONTACT_STEPS, RELEASES
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.views.report.blocks import Player, Results
from walkerlab.views.report.registry import sections_of
from walkerlab.views.report.sections import motion, verdict
from walkerlab.views.report.stage import write_pages

WALKS = ("fixedpoint", "simulate", "contact-sim", "compare")
OTHER_PERIOD = 0.54259  # s, period of the gait whose trailing knee is free in the impact, recomputed independently
PERIOD = 0.564328  # s, period by the published rule


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    loaded = load(Path("kneed"), ["strides=2"])
    folder = RunFolder(tmp_path_factory.mktemp("runs"), loaded.run_name)
    execute(loaded.config, "plot", folder)
    stored = {name: artifact.read(folder.artifact(name)) for name in (*WALKS, "plot")}
    return Results(loaded.config, stored), folder


def test_both_kneed_models_walk_on_plain_ground(run):
    results, _ = run
    compared = results.summary("compare")
    assert results.config.contact.terrain == "plane"
    assert compared["outcomes"] == {"rigid": "walked", "contact": "walked"}
    assert compared["steps"]["rigid"]["period_s"] == pytest.approx(compared["steps"]["gait"]["period_s"], rel=1e-8)
    assert compared["dissipated_J"]["knee_strikes"] > 0.0


def test_knee_strikes_are_stored_and_reported_in_the_same_way_for_both_models(run):
    results, _ = run
    for stage in ("simulate", "contact-sim"):
        times, steps = results.summary(stage)["knee_strike_times_s"], results.group(stage, "steps")
        assert steps["knee_strike_time_s"].tolist() == times
        touches = steps["touch_time_s"]
        assert len(times) == touches.size == 4
        assert (np.append(0.0, touches[:-1]) < times).all()
        assert (times < touches).all()
        within = times[-1] - touches[-2]
        model = results.summary("compare")["steps"]["rigid" if stage == "simulate" else "contact"]
        assert model["knee_strike_s"] == pytest.approx(within, abs=1e-15)
    assert results.summary("contact-sim")["knee_strikes_s"] == times


def test_time_of_release_decides_which_gait_is_walked(run):
    results, _ = run
    releases = results.summary("compare")["releases"]
    assert releases.keys() == RELEASES.keys()
    assert all(walk["steps"] == CONTACT_STEPS for walk in releases.values())
    assert releases["compression"]["period_s"] == pytest.approx(PERIOD, abs=2e-3)
    assert releases["touch"]["period_s"] == pytest.approx(OTHER_PERIOD, abs=2e-3)
    # gaits of the rigid model by both rules
    assert releases["compression"]["rigid"]["period_s"] == pytest.approx(PERIOD, abs=1e-6)
    assert releases["touch"]["rigid"]["period_s"] == pytest.approx(OTHER_PERIOD, abs=1e-5)
    assert "determines the gait" in verdict.departure(results)
    assert "with the same rule the rigid model takes steps of 0.54259" in verdict.departure(results)


def test_verdict_explains_the_difference_of_the_models_in_one_paragraph(run):
    results, _ = run
    said = verdict.departure(results)
    assert [block.text for block in verdict.section(results).blocks if getattr(block, "text", "") == said] == [said]
    for words in ("last step", "slips", "in knee strikes", "knee locks", "20 steps"):
        assert words in said


def test_player_shows_knees_in_both_models(run):
    results, _ = run
    (player,) = (block for block in motion.section(results).blocks if isinstance(block, Player))
    assert [walker.name for walker in player.walkers] == ["Rigid model", "Contact model"]
    assert all({"kx0", "ky0", "kx1", "ky1"} <= set(walker.track.channels) for walker in player.walkers)
    assert player.pads == ()


def test_report_of_a_kneed_walk_has_its_figures_and_shows_no_missing_values(run, tmp_path):
    results, folder = run
    drawn = {figure["number"] for figure in results.summary("plot")["figures"] if "number" in figure}
    assert {2, 6, 7, 8, 9, 10} <= drawn
    pages, _ = write_pages(results.config, results.stored, folder.path)
    page = Page((folder.path / pages[0].file).read_text(encoding="utf-8"))
    assert not {"None", "nan", "inf"} & set(page.text.split())
    assert "Effect of the release instant" in page.text


def test_paragraph_does_not_mention_knees_if_no_release_was_compared(run):
    results, _ = run
    compared = results.stored["compare"]
    summary = {name: value for name, value in compared.summary.items() if name != "releases"}
    stored = {**results.stored, "compare": dataclasses.replace(compared, summary=summary)}
    assert "knee locks" not in verdict.departure(Results(results.config, stored))
    assert sections_of(Results(results.config, stored))
