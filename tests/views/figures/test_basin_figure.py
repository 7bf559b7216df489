"""Tests of figure 15 and of the report's section on basins, with a grid set by hand."""

import numpy as np
import pytest
from synthetic_basin import CONFIG, basin

from walkerlab.config.loader import load
from walkerlab.physics.orbits.basin import UNREACHED
from walkerlab.views.figures import stage as plot
from walkerlab.views.figures.maps import FIGURE_15 as FIGURE
from walkerlab.views.figures.maps import attractor_name, sides_of
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.sections.families import basin as section


def test_walks_that_settle_at_once_are_drawn():
    assert FIGURE.render(basin([0, UNREACHED], steps=0)).png.startswith(b"\x89PNG")


def test_caption_states_the_share_that_walks_and_its_attractors():
    results = basin([0, 0, 1, UNREACHED])
    drawing = FIGURE.render(results)
    assert drawing.png.startswith(b"\x89PNG")
    assert "75 % of the starts in the window lead to walking" in drawing.caption
    assert "The gait of 1 step is reached from 6 cells, after a median of 7 steps." in drawing.caption
    for label in ("gait of 1 step", "gait of 2 steps", "fell", "rigid gait of one step"):
        assert label in drawing.svg.decode()
    assert drawing.svg == FIGURE.render(results).svg


def test_unsettled_walks_have_their_own_colour():
    drawing = FIGURE.render(basin([-2, UNREACHED], aperiodic=True))
    assert "aperiodic" in drawing.svg.decode()
    assert "no walk settles on a gait" in drawing.svg.decode()
    assert "6 walks are still going after 300 steps" in drawing.caption


def test_middle_plane_of_three_coordinates_is_drawn():
    config = load(None, ["basin.plane=[theta_2,dtheta_1,dtheta_2]", "basin.cells=[3,3,3]"]).config
    assert "of which the middle plane is shown" in FIGURE.render(basin([0, UNREACHED], config=config)).caption


def test_attractors_of_equal_period_are_told_apart_by_letters():
    rows = [{"period": 1}, {"period": 3}, {"period": 3}]
    assert [attractor_name(number, rows) for number in range(3)] == [
        "gait of 1 step",
        "gait of 3 steps (a)",
        "gait of 3 steps (b)",
    ]


def test_cells_are_drawn_around_their_centres():
    assert sides_of(np.array([0.5, 1.5, 2.5])) == (0.0, 3.0)


def test_figure_without_a_basin_names_the_command_that_computes_it():
    why = FIGURE.why_left_out({}, {"basin": "it was not requested; `walkerlab basin` makes it"})
    assert why == "it needs basin: it was not requested; `walkerlab basin` makes it"


def test_report_lists_shares_and_attractors():
    made = section(Results(CONFIG, basin([0, 0, 1, UNREACHED]), (), ()))
    assert "75 % of the starts in the window lead to walking" in made.blocks[0].text
    assert [row[1].text for row in next(iter(made.blocks[1].groups.values()))] == ["6", "3"]
    assert section(Results(CONFIG, {}, (), ())) is None


@pytest.mark.parametrize("stage", ["plot", "report"])
def test_drawings_include_the_basin_once_it_exists(stage):
    from walkerlab.pipeline.plan.graph import PIPELINE

    assert "basin" in PIPELINE[stage].if_current


def test_basin_command_draws_its_figure_at_once(tmp_path):
    made = basin([0, 0, 1, UNREACHED])["basin"]
    (path,) = plot.draw_at_once("basin", made, tmp_path, anew=True)
    assert path == tmp_path / "figures" / "figure-15.svg"
    assert path.read_bytes() == FIGURE.render({"basin": made}).svg
    path.write_text("as it was")
    assert plot.draw_at_once("basin", made, tmp_path, anew=False) == [path]
    assert path.read_text() == "as it was"
