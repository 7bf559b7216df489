"""Check that figures of error over run time show every run and failure, but no error below the reference's own."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from synthetic_methods import RUNS, SCENES, measured_methods

from walkerlab.evidence.benchmarks import figures as costs
from walkerlab.evidence.benchmarks.figures import LOOKS, legend_entries, method_series
from walkerlab.physics.solvers.registry import METHODS
from walkerlab.views.figures.canvas import figure_style

FIGURES = [figure for figure in costs.FIGURES if figure.name.startswith("accuracy")]
RIGID = FIGURES[0]
AGREEMENT = 9e-16


def drawn_lines(figure=RIGID):
    with figure_style():
        left, right = figure.draw(measured_methods())[0].axes
    return left.lines, right.lines


def points(lines, crosses):
    chosen = [line for line in lines if (line.get_marker() == "x") == crosses]
    return sorted((x, y) for line in chosen for x, y in zip(*line.get_data(), strict=True))


def test_each_scene_has_a_figure():
    assert [figure.name for figure in FIGURES] == [f"accuracy-{scene}" for scene in SCENES]


def test_every_complete_run_is_plotted_over_time_and_work():
    reached = [run for run in RUNS if run[3] is not None]
    for lines, cost in zip(drawn_lines(), (4, 5), strict=True):
        expected = sorted((run[cost], max(run[3], AGREEMENT)) for run in reached)
        np.testing.assert_allclose(points(lines, crosses=False), expected)


def test_incomplete_runs_are_plotted_above_all_others():
    left, _ = drawn_lines()
    failed = points(left, crosses=True)
    assert [x for x, _ in failed] == sorted(run[4] for run in RUNS if run[3] is None)
    assert min(y for _, y in failed) > max(y for _, y in points(left, crosses=False))


def test_legend_has_a_cross_only_for_incomplete_runs():
    every = list(method_series(SCENES[0], measured_methods()))
    whole = [one for one in every if one.runs["reached"].all()]
    assert 0 < len(whole) < len(every)
    for shown, there in ((every, True), (whole, False)):
        assert ("end not reached" in [entry.get_label() for entry in legend_entries(shown, AGREEMENT)]) is there


def test_caption_states_conclusion_reference_and_failures():
    caption = RIGID.render(measured_methods()).caption
    for said in ("at 1e-06, dop853 is fastest", "heyoka-taylor", "scipy-rk45 at 1e-09 (budget-exhausted)", "(slid)"):
        assert said in caption


def test_caption_names_the_method_that_the_reference_method_is_measured_against():
    results = measured_methods()
    assert "itself is measured against" not in RIGID.render(results).caption
    results["accuracy"].summary["reference"]["rigid"] = {
        "method": "radau5",
        "second_method": "dop853",
        "agreement": 1e-12,
    }
    assert "radau5 itself is measured against dop853." in RIGID.render(results).caption


def test_every_method_has_a_distinct_style():
    assert set(METHODS) <= set(LOOKS)
    looks = [(to_hex(look.colour), str(look.style)) for look in LOOKS.values()]
    assert len(set(looks)) == len(looks)


@pytest.mark.parametrize("scene", SCENES)
def test_unmeasured_scene_is_omitted_with_the_reason(scene):
    others = measured_methods([other for other in SCENES if other != scene])
    figure = FIGURES[SCENES.index(scene)]
    assert figure.why_left_out(others, {}) == f"accuracy: the scene {scene} was not measured"
    assert figure.why_left_out({}, {}) == "it needs accuracy"
