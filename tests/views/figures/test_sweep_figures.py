"""Tests of figures of sweeps over two parameters: lines if one has few values, a map if both have many."""

import numpy as np
import pytest

from walkerlab.errors import ConfigError
from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.views.figures.canvas import figure_style
from walkerlab.views.figures.maps import is_logarithmic
from walkerlab.views.figures.sweep import choose, illustration, lines, maps, plot_against
from walkerlab.views.report.sweep_page import check_options

PARAMETERS = ("slope_deg", "hip_mass_kg")


def swept(slopes, masses, answered=True):
    """Return a sweep whose multiplier grows beyond one with the slope, optionally with no answer at its first point."""
    slope, mass = np.linspace(1.0, 5.0, slopes), np.linspace(5.0, 15.0, masses)
    radius = 0.3 * slope[:, None] + 0.01 * mass
    radius[0, 0] = radius[0, 0] if answered else np.nan
    status = np.where(np.isnan(radius), "no answer", "answered").astype(object)
    outcome = np.where(np.isnan(radius), "none", "walked").astype(object)
    return Group(
        {
            "slope_deg": Variable(slope, ("slope_deg",), "deg", "slope"),
            "hip_mass_kg": Variable(mass, ("hip_mass_kg",), "kg", "mass of the hip"),
            "spectral_radius": Variable(radius, PARAMETERS, "1", "largest magnitude of a multiplier", missing=True),
            "status": Variable(status, PARAMETERS, "", "status"),
            "outcome": Variable(outcome, PARAMETERS, "", "outcome"),
        }
    )


def drawn(made, group):
    with figure_style():
        return made(group, PARAMETERS, ["spectral_radius"])


@pytest.mark.parametrize(("slopes", "masses"), [(9, 3), (3, 9)])
def test_each_value_of_a_parameter_with_few_values_becomes_a_line(slopes, masses):
    group = swept(slopes, masses)
    figure = drawn(lines, group)
    curves = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    values = group["spectral_radius"]
    expected = values.T if masses == 3 else values
    np.testing.assert_array_equal([line.get_ydata() for line in curves], expected)
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert said[-1] == "largest multiplier 1"
    assert said[0] == ("hip mass 5 kg" if masses == 3 else "slope 1 deg")


def test_map_covers_the_sampled_range_and_explains_its_white_line():
    figure = drawn(maps, swept(9, 8))
    axes = figure.axes[0]
    assert (axes.get_xlim(), axes.get_ylim()) == ((1.0, 5.0), (5.0, 15.0))
    assert set(np.linspace(1.0, 5.0, 9)) <= {*axes.get_xticks(), *axes.get_xticks(minor=True)}
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["largest multiplier 1"]


def test_caption_explains_missing_cells():
    for masses, said in (
        (3, "Marks at the bottom: no answer."),
        (8, "Grey: no answer."),
    ):
        group = swept(9, masses, answered=False)
        made = illustration(group, "fixedpoint", PARAMETERS, ["spectral_radius"]).render({})
        assert said in made.caption
        assert made.svg.startswith(b"<?xml")


def test_logarithmic_range_has_a_logarithmic_axis():
    for low, high in ((1.0, 3.0), (1.0, 1.001), (1e-3, 1e5)):
        assert is_logarithmic(np.geomspace(low, high, 7), span=1.0)
        assert not is_logarithmic(np.linspace(low, high, 7), span=1.0)


def test_sweep_figures_of_walks_begin_with_period_and_length_of_the_last_step():
    names = ("slip_per_step_m", "max_penetration_m", "last_step_length_m", "last_step_period_s", "outcome")
    group = Group({name: Variable(np.arange(3.0), ("x",), "1", name) for name in names})
    assert choose(group, ["x"])[:2] == ["last_step_period_s", "last_step_length_m"]


def test_unknown_sweep_quantity_is_rejected():
    known = ("steps", "last_step_period_s", "gaits.3.period_s")
    check_options("contact-sim", {f"--show {name}": name for name in known}, ["steps"])
    with pytest.raises(ConfigError, match="--show nonsense is not among the quantities"):
        check_options("contact-sim", {"--show nonsense": "nonsense"}, ["steps"])


def test_quantity_can_be_plotted_over_another():
    x = Variable(np.arange(3.0), ("x",), "1", "x")
    speed, cost = np.array([0.2, 0.5, 0.4]), np.array([0.03, 0.01, 0.02])
    words = Variable(np.array(["answered"] * 3, object), ("x",), "", "status")
    group = Group({
        "x": x, "status": words, "outcome": words,
        "speed_m_s": Variable(speed, ("x",), "m/s", "speed"), "cost_of_transport": Variable(cost, ("x",), "1", "cost"),
    })  # fmt: skip
    with figure_style():
        axes = plot_against(group, ["cost_of_transport"], "speed_m_s").axes[0]
    (curve,) = axes.lines
    np.testing.assert_array_equal((curve.get_xdata(), curve.get_ydata()), (speed, cost))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("speed (m/s)", "cost of transport")
    made = illustration(group, "fixedpoint", ["x"], ["cost_of_transport"], "speed_m_s").render({})
    assert made.caption.startswith("Cost over speed, for values of x: 3 answered.")
