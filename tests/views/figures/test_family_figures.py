"""Tests of the figures of families of gaits."""

import re
from dataclasses import replace

import numpy as np
import pytest
from synthetic_families import END, FLIP, families

from walkerlab.config.fields import leaves, leaves_of_other_kinds
from walkerlab.config.schema import Config
from walkerlab.labels import axis_label
from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.views.figures.canvas import figure_style, settle
from walkerlab.views.figures.families import (
    FIGURE_13,
    FIGURE_14,
    FIGURE_16,
    MODEL_COLOURS,
    STYLES,
    Curve,
    DrawnBranch,
    births_in,
    curve_of,
    interpolate,
    multipliers_of,
    region_kinds,
    stretch_of,
)
from walkerlab.views.figures.style import GREY

FIGURES = [FIGURE_13, FIGURE_14, FIGURE_16]


def plotted(figure):
    with figure_style():
        return figure.draw(families())[0]


@pytest.mark.parametrize("figure", FIGURES, ids=[figure.name for figure in FIGURES])
def test_equal_families_give_equal_bytes(figure):
    assert figure.render(families()) == figure.render(families())


def test_curves_over_two_parameters_are_omitted_unless_requested():
    why = FIGURE_16.why_left_out(families(curves=False), {})
    assert why == "continuation: no curves over two parameters (continuation.second)"


def test_gaits_that_begin_at_a_fold_are_labelled_with_their_number_of_steps():
    results = families()
    branch = results["continuation"].groups["rigid/branch_1"]
    kinds = replace(branch.variables["mark_kind"], values=np.array(["fold"]))
    value = branch.variables["mark_value"]
    moved = replace(value, values=value.values + 0.3)
    born = replace(branch, variables=branch.variables | {"mark_kind": kinds, "mark_value": moved}, attrs={"period": 5})
    assert births_in([DrawnBranch("rigid", born), DrawnBranch("rigid", branch)], (3.0, 5.0)) == [(FLIP + 0.3, 5)]
    assert births_in([DrawnBranch("rigid", born)], (3.0, 4.0)) == []
    results["continuation"] = replace(
        results["continuation"], groups=results["continuation"].groups | {"rigid/branch_1": born}
    )
    with figure_style():
        figure, _ = FIGURE_13.draw(results)
    close = figure.axes[1]
    [above] = close.child_axes
    assert [label.get_text() for label in above.get_xticklabels()] == ["5"]
    assert "5 steps at 4.3 deg." in " ".join(FIGURE_13.render(results).caption.split())


def test_one_column_figure_stacks_its_panels():
    with figure_style(3.5):
        figure, _ = FIGURE_13.draw(families())
    assert {axes.get_subplotspec().colspan.start for axes in figure.axes} == {0}
    assert len(figure.axes) == 4


def test_branch_is_solid_up_to_its_flip_and_dashed_beyond():
    axes = plotted(FIGURE_13).axes[0]
    solid, dashed = (
        [line for line in axes.lines if line.get_color() == MODEL_COLOURS["rigid"] and line.get_linestyle() == style]
        for style in ("-", "--")
    )
    ends = sorted((float(line.get_xdata()[0]), float(line.get_xdata()[-1])) for line in solid)
    assert ends[0] == (1.0, FLIP)
    assert {ends[1], ends[2]} == {(FLIP, END)}
    assert [(float(line.get_xdata()[0]), float(line.get_xdata()[-1])) for line in dashed] == [(FLIP, END)]
    assert STYLES[True] == "-"


def test_steps_of_a_doubled_branch_are_equal_at_the_flip_where_it_begins():
    group = families()["continuation"]["rigid/branch_1"]
    curve = curve_of(group, "step_period")
    assert curve.value[0] == FLIP
    assert np.ptp(curve.quantity[0]) == 0.0
    assert curve.stable.all()


def test_captions_state_where_gaits_change():
    results = families()
    assert "first doubles its period at 4 deg" in FIGURE_13.render(results).caption
    assert "a flip at 4." in FIGURE_14.render(results).caption
    assert FIGURE_16.render(results).caption.startswith("Curves of flips of the rigid model's gaits")


def test_parameter_plane_is_shaded_by_the_attractor_at_each_point():
    regions = families()["continuation"]["rigid/regions"]
    kinds = {name: where.sum() for _, name, where in region_kinds(regions)}
    assert kinds == {"1 step": 3, "2 steps": 1, "aperiodic": 1, "no walking": 1}
    assert "1 step in 50 %" in FIGURE_16.render(families()).caption
    assert len(plotted(FIGURE_16).axes[0].collections) == 1


def test_multipliers_beyond_the_axes_are_mentioned():
    results = families()
    branch = next(group for path, group in results["continuation"].groups.items() if path.endswith("branch_0"))
    assert "outside the axes" not in FIGURE_14.render(results).caption
    branch["multiplier_real"].flags.writeable = True
    branch["multiplier_real"][-1] = -7.25
    assert "Some multipliers lie outside the axes. The largest magnitude is 7.25." in FIGURE_14.render(results).caption


def test_step_periods_split_at_a_flip_like_a_square_root():
    value, parts = np.array([4.0, 4.04, 4.09]), np.array([0.0, 0.2, 0.3])
    quantity = 0.7 + parts[:, None] * np.array([1.0, -1.0])
    born = Curve(value, quantity, np.array([True, True]), ((0, "flip"),))
    x, y = stretch_of(born, 0, 2)
    np.testing.assert_allclose(y, 0.7 + np.sqrt(np.maximum(x - 4.0, 0.0))[:, None] * np.array([1.0, -1.0]), atol=1e-7)
    assert x[0] == 4.0
    assert set(value) <= set(x)
    crossed = Curve(value, quantity, np.array([True, True]), ((1, "flip"),))
    assert stretch_of(crossed, 0, 2)[0].tolist() == value.tolist()


def test_one_step_gaits_have_distinct_styles_labelled_with_their_period():
    results = families()
    result = results["continuation"]
    result.groups["rigid/branch_1"].attrs["period"] = 1
    with figure_style():
        figure = FIGURE_14.draw(results)[0]
    looks = {(line.get_color(), line.get_linestyle()) for line in figure.axes[1].lines} - {(GREY, "-")}
    assert len(looks) == 2
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert said[0] == "rigid model, steps of 0.7 to 0.7 s"
    assert said[1] == "rigid model, steps of 0.6 to 0.8 s"


def test_multipliers_that_meet_become_complex():
    product = np.linspace(0.20, 0.31, 6)
    known = np.array([np.roots([1.0, -1.0, one]) for one in product], dtype=complex)
    group = Group(
        {
            "multiplier_real": Variable(known.real, ("point", "multiplier"), "1", "real"),
            "multiplier_imag": Variable(known.imag, ("point", "multiplier"), "1", "imaginary"),
        }
    )
    found = multipliers_of(DrawnBranch("rigid", group))
    # Both are real up to a product of a quarter. Then they lie on a circle whose radius is the root of the product.
    exact = [np.sort(np.abs(np.roots([1.0, -1.0, one])))[::-1] for one in interpolate(product)]
    np.testing.assert_allclose(np.abs(found), exact, atol=1e-9)


def test_families_without_bifurcations_have_one_panel():
    with figure_style():
        figure = FIGURE_13.draw(families(flips=False))[0]
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["", ""]


def test_ticks_near_a_single_flip_have_few_digits():
    results = families()
    summary = results["continuation"].summary
    summary["to"] = summary["attractors"][0]["to"] = FLIP + 1e-6
    with figure_style():
        figure = FIGURE_13.draw(results)[0]
        settle(figure)
    for axes in figure.axes:
        low, high = axes.get_ylim()
        assert high - low >= 0.04 * abs(high)
        assert all(len(label.get_text()) <= 6 for label in axes.get_yticklabels())


def test_axes_show_keys_as_words():
    result = families()["continuation"]
    for key, unit, said in (
        ("walker.hip_mass_kg", "kg", "hip mass (kg)"),
        ("walker.thigh.mass_below_hip_m", "m", "thigh mass below hip (m)"),
        ("contact.stiffness", "N/mm^e", "contact stiffness (N/mmᵉ)"),
        ("gravity_m_s2", "m/s^2", "gravity (m/s²)"),
        ("contact.exponent", "1", "contact exponent"),
    ):
        result.summary.update(over=key, unit=unit)
        with figure_style():
            for figure in (FIGURE_13, FIGURE_14, FIGURE_16):
                assert said in {axes.get_xlabel() for axes in figure.draw({"continuation": result})[0].axes}
    keys = [path for path, _ in (*leaves(Config), *leaves_of_other_kinds(Config)) if path[0] != "name"]
    assert all(re.fullmatch(r"[a-zA-Z0-9() -]+", axis_label(".".join(path))) for path in keys)
