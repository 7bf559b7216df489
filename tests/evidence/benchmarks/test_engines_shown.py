"""Tests of the figures and the report's section on walks in other engines, from a stored result."""

import numpy as np
import pytest
from synthetic_engines import PERIOD, ROWS, content

from walkerlab.config.loader import load
from walkerlab.evidence.benchmarks.engines.rows import EngineRow
from walkerlab.evidence.benchmarks.engines.section import section
from walkerlab.evidence.benchmarks.figures import COLOURS, FIGURES, engine_series
from walkerlab.labels import labels_of
from walkerlab.views.figures.canvas import as_file, figure_style
from walkerlab.views.report.blocks import Results, Statements
from walkerlab.views.report.tables import Table

ERRORS, PERIODS = (
    next(figure for figure in FIGURES if figure.name == name)
    for name in ("engines-errors-compass", "engines-periods-compass")
)


@pytest.fixture(scope="module")
def results():
    return {"engines": content()}


@pytest.fixture(scope="module")
def made(results):
    return section(Results(load().config, results))


def lines_of(axes):
    return [line for line in axes.lines if len(line.get_xdata()) and line.get_marker() not in ("", "None", None)]


def test_every_finite_error_is_plotted_over_run_time(results):
    with figure_style():
        left, right = ERRORS.draw(results)[0].axes
    for axes, experiment in ((left, "same-law"), (right, "own-law")):
        drawn = sorted((x, y) for line in lines_of(axes) for x, y in zip(*line.get_data(), strict=True))
        there = [(row.wall_s, row.error) for row in ROWS if row.experiment == experiment and row.error is not None]
        np.testing.assert_allclose(drawn, sorted(there))


def test_period_axis_includes_the_adams_law_and_the_rigid_gait(results):
    with figure_style():
        (axes,) = PERIODS.draw(results)[0].axes
    levels = [line.get_ydata()[0] for line in axes.lines if line.get_marker() == "None"]
    assert levels == pytest.approx([PERIOD, 0.7036])
    drawn = sorted(y for line in lines_of(axes) for y in line.get_ydata())
    walked = [row for row in ROWS if row.experiment == "own-law" and row.engine != "walkerlab"]
    assert drawn == pytest.approx(sorted(row.period_s for row in walked if row.outcome == "walked"))


def test_engines_differ_in_colour_and_their_integrators_in_marker(results):
    every = list(engine_series("compass", "same-law", results))
    assert len({one.look.colour for one in every}) == len({one.engine for one in every})
    assert {one.engine for one in every} <= set(COLOURS)


def test_each_panel_has_its_own_legend(results):
    with figure_style():
        drawn = ERRORS.draw(results)[0]
    for axes, legend in zip(drawn.axes, drawn.legends, strict=True):
        assert legend.get_title().get_text() == axes.get_title(loc="left")
        looks = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in legend.get_lines()}
        assert len(looks) == len(legend.get_lines())
        assert looks == {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in lines_of(axes)}


def test_panel_without_a_finished_walk_says_so():
    unfinished = {"engines": content([row for row in ROWS if row.experiment == "same-law" or row.engine == "exudyn"])}
    with figure_style():
        for figure, place in ((ERRORS, 1), (PERIODS, 0)):
            drawn = figure.draw(unfinished)[0]
            assert [text.get_text() for text in drawn.axes[place].texts] == ["no run reached the end"]
            assert as_file(drawn, "svg", figure.name, "")


def test_captions_state_conclusions_and_failed_walks(results):
    assert "Run time for an error of" in ERRORS.render(results).caption
    assert "Incomplete walks: mujoco soft at 0.0005 s" in PERIODS.render(results).caption


def test_figure_and_section_are_omitted_without_the_stage():
    assert ERRORS.why_left_out({}, {}) is not None
    assert section(Results(load().config, {})) is None


def test_scene_without_a_walk_has_no_figure(results):
    reasons = {figure.name: figure.why_left_out(results, {}) for figure in FIGURES if figure.name.startswith("engines")}
    unwalked = "engines: the scene kneed was not walked"
    assert reasons == {
        "engines-errors-compass": None,
        "engines-errors-kneed": unwalked,
        "engines-periods-compass": None,
        "engines-periods-kneed": unwalked,
    }


def test_conclusions_come_first_in_the_section(made):
    assert isinstance(made.blocks[1], Statements)
    assert [item.about for item in made.blocks[1].items] == ["compass, same law", "compass, own contact"]


def test_every_run_has_a_row(made):
    tables = {block.caption: block for block in made.blocks if isinstance(block, Table)}
    for caption, experiment, more in (
        ("ADAMS's law in each engine's integrators", "same-law", 0),
        ("The walk on each engine's own contact", "own-law", 1),
    ):
        (rows,) = tables[caption].groups.values()
        assert len(rows) == more + sum(row.experiment == experiment for row in ROWS)


def test_columns_have_the_same_label_in_file_terminal_and_report(results, made):
    label = labels_of(EngineRow)["step_s"]
    steps = [row.step_s for row in ROWS]
    stored = results["engines"]["rows"].variables["step_s"]
    assert (stored.units, stored.long_name, stored.values.tolist()) == (label.unit, label.text, steps)
    assert [row["step_s"] for row in results["engines"].summary["rows"]] == steps
    table = next(block for block in made.blocks if isinstance(block, Table) and block.caption.startswith("ADAMS"))
    place = [column.title for column in table.columns].index(f"step (µ{label.unit})")
    shown = [float(row[place].text) for row in next(iter(table.groups.values()))]
    assert shown == pytest.approx([1e6 * row.step_s for row in ROWS if row.experiment == "same-law"])


def test_values_of_a_run_are_stored_and_missing_values_become_gaps(results):
    group = results["engines"]["rows"]
    for name in labels_of(EngineRow):
        told = [None if value != value else value for value in group[name].tolist()]
        assert told == [getattr(row, name) for row in ROWS]
    assert {name for name in group.variables if group.variables[name].timing} == {"wall_s"}


def test_residual_of_tuning_is_shown(made):
    table = next(block for block in made.blocks if isinstance(block, Table) and block.caption.startswith("Tuning"))
    assert next(iter(table.groups.values()))[0][-1].text == "-4.3 %"
    assert np.isclose(0.67 / 0.7 - 1.0, -0.043, atol=1e-3)
