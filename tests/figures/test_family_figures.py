"""What the figures of families of gaits show."""

import numpy as np
import pytest
from synthetic_families import END, FLIP, families

from walkerlab.figures.canvas import styled
from walkerlab.figures.families import (
    FIGURE_13,
    FIGURE_14,
    FIGURE_16,
    MODELS,
    STYLES,
    Curve,
    curve_of,
    region_kinds,
    stretch_of,
)

FIGURES = [FIGURE_13, FIGURE_14, FIGURE_16]


def plotted(figure):
    with styled():
        return figure.draw(families())[0]


@pytest.mark.parametrize("figure", FIGURES, ids=[figure.name for figure in FIGURES])
def test_the_same_families_give_the_same_bytes(figure):
    assert figure.drawn(families()) == figure.drawn(families())


def test_curves_over_two_parameters_are_left_out_where_none_were_asked_for():
    why = FIGURE_16.why_left_out(families(curves=False), {})
    assert why == "continuation: no curves over two parameters (continuation.second)"


def test_a_branch_is_solid_up_to_its_flip_and_dashed_beyond():
    axes = plotted(FIGURE_13).axes[0]
    solid, dashed = (
        [line for line in axes.lines if line.get_color() == MODELS["rigid"] and line.get_linestyle() == style]
        for style in ("-", "--")
    )
    ends = sorted((float(line.get_xdata()[0]), float(line.get_xdata()[-1])) for line in solid)
    assert ends[0] == (1.0, FLIP)
    assert {ends[1], ends[2]} == {(FLIP, END)}
    assert [(float(line.get_xdata()[0]), float(line.get_xdata()[-1])) for line in dashed] == [(FLIP, END)]
    assert STYLES[True] == "-"


def test_a_doubled_branch_begins_at_its_parents_flip_with_equal_steps():
    group = families()["continuation"]["rigid/branch_1"]
    curve = curve_of(group, "step_period")
    assert curve.value[0] == FLIP
    assert np.ptp(curve.quantity[0]) == 0.0
    assert curve.stable.all()


def test_the_captions_say_where_gaits_change():
    results = families()
    assert "first doubles its period at 4 deg" in FIGURE_13.caption(results)
    assert "a flip at 4." in FIGURE_14.caption(results)
    assert FIGURE_16.caption(results).startswith("Curves of flips of the rigid model's gaits")


def test_the_plane_is_shaded_by_what_walks_settle_on():
    regions = families()["continuation"]["rigid/regions"]
    kinds = {name: where.sum() for _, name, where in region_kinds(regions)}
    assert kinds == {"1 step": 3, "2 steps": 1, "never repeats itself": 1, "no walk goes on": 1}
    assert "1 step in 50 %" in FIGURE_16.caption(families())
    assert len(plotted(FIGURE_16).axes[0].collections) == 1


def test_multipliers_beyond_the_axes_are_told():
    results = families()
    branch = next(group for path, group in results["continuation"].groups.items() if path.endswith("branch_0"))
    assert "beyond the axes" not in FIGURE_14.caption(results)
    branch["multiplier_real"].flags.writeable = True
    branch["multiplier_real"][-1] = -7.25
    assert "Some lie beyond the axes, up to a magnitude of 7.25." in FIGURE_14.caption(results)


def test_gaits_part_from_a_flip_as_the_root_of_the_distance():
    value, parts = np.array([4.0, 4.04, 4.09]), np.array([0.0, 0.2, 0.3])
    quantity = 0.7 + parts[:, None] * np.array([1.0, -1.0])
    born = Curve(value, quantity, np.array([True, True]), ((0, "flip"),))
    x, y = stretch_of(born, 0, 2)
    np.testing.assert_allclose(y, 0.7 + np.sqrt(np.maximum(x - 4.0, 0.0))[:, None] * np.array([1.0, -1.0]), atol=1e-7)
    assert x[0] == 4.0
    assert set(value) <= set(x)
    crossed = Curve(value, quantity, np.array([True, True]), ((1, "flip"),))
    assert stretch_of(crossed, 0, 2)[0].tolist() == value.tolist()
