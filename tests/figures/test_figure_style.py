"""What a demanding reader asks of every figure: labels with units, nothing clipped or covered, readable in grey."""

import itertools
import re

import pytest
from matplotlib.colors import to_hex
from matplotlib.text import Text
from synthetic_maps import stability_maps
from synthetic_methods import measured_methods
from synthetic_walks import both_models, contact, rigid, rigid_alone

from walkerlab.figures.canvas import settle, styled
from walkerlab.figures.registry import FIGURES
from walkerlab.figures.style import CONTACT, LEGS, RIGID, WIDTH
from walkerlab.figures.walks import AT_SAME_TIME, IN_PHASE, PAPER

RESULTS = {
    "both models": both_models(),
    "rigid alone": rigid_alone(),
    "a plane": both_models(**{"contact-sim": contact(pads=False)}),
    "one stride": both_models(simulate=rigid(2), **{"contact-sim": contact(2, 0.72)}),
    "methods measured": measured_methods(),
    "stability mapped": stability_maps(),
    "one step": both_models(**{"contact-sim": contact(1, outcome="fell")}),
}
CASES = [
    pytest.param(results, figure, id=f"{name}-{figure.name}")
    for name, results in RESULTS.items()
    for figure in FIGURES
    if figure.why_left_out(results, {}) is None
]
WITH_UNIT = re.compile(r".+ \((m|s|m/s|rad|rad/s|J|N|N/m\$\^\{2\.2\}\$|1|SI)\)")
VISIBLE = 0.1
"""Least difference of brightness between lines that lie on one another."""


@pytest.fixture(scope="module")
def drawn(request):
    results, figure = request.param
    with styled():
        made = figure.draw(results)[0]
        settle(made)
        made.draw_without_rendering()
    return made


for_all = pytest.mark.parametrize("drawn", [param.values for param in CASES], ids=[p.id for p in CASES], indirect=True)


def shown_texts(figure):
    """Every text that is seen, with its box."""
    texts = set(figure.findobj(Text))
    return [
        (text.get_text(), text.get_window_extent())
        for text in texts
        if text.get_visible() and text.get_text().strip() and on_axis(text)
    ]


def on_axis(text):
    """Whether a text belongs to a tick that is drawn."""
    for axes in text.figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for tick in (*axis.majorTicks, *axis.minorTicks):
                if text in (tick.label1, tick.label2):
                    low, high = sorted(axis.get_view_interval())
                    return low <= tick.get_loc() <= high
    return True


@for_all
def test_every_axis_has_a_label_with_a_unit(drawn):
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            numbered = any(label.get_visible() and label.get_text() for label in axis.get_ticklabels())
            assert bool(WITH_UNIT.fullmatch(axis.get_label_text())) == numbered


@for_all
def test_legends_cover_no_axes_and_so_no_data(drawn):
    (legend,) = drawn.legends
    assert all(axes.get_legend() is None for axes in drawn.axes)
    box = legend.get_window_extent()
    assert not any(box.overlaps(axes.get_tightbbox()) for axes in drawn.axes)


@for_all
def test_no_text_is_clipped(drawn):
    width, height = drawn.bbox.width, drawn.bbox.height
    for text, box in shown_texts(drawn):
        assert box.x0 >= 0.0, text
        assert box.y0 >= 0.0, text
        assert box.x1 <= width, text
        assert box.y1 <= height, text


@for_all
def test_no_text_lies_on_another(drawn):
    for (text, box), (other, other_box) in itertools.combinations(shown_texts(drawn), 2):
        assert not box.overlaps(other_box), (text, other)


@for_all
def test_all_figures_have_one_width_and_one_font(drawn):
    assert drawn.get_figwidth() == WIDTH
    assert {text.get_fontname() for text in drawn.findobj(Text)} == {"DejaVu Sans"}


@for_all
def test_legend_names_everything_once(drawn):
    (legend,) = drawn.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert len(set(names)) == len(names)


def brightness(colour):
    """Grey level of a colour '#RRGGBB' on a grey printer, 0 black to 1 white (Rec. 601 luma)."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return 0.299 * red + 0.587 * green + 0.114 * blue


@pytest.mark.parametrize(
    "looks",
    [(RIGID, CONTACT), LEGS, (AT_SAME_TIME, IN_PHASE), (IN_PHASE, PAPER)],
    ids=["models", "legs", "errors", "paper"],
)
def test_lines_on_one_another_differ_in_brightness_and_in_style(looks):
    one, other = looks
    assert abs(brightness(one.colour) - brightness(other.colour)) > VISIBLE
    assert one.style != other.style


def test_brightness_is_that_of_grey():
    assert brightness("#000000") == 0.0
    assert brightness("#ffffff") == pytest.approx(1.0)
    assert brightness(to_hex("0.5")) == pytest.approx(128 / 255)
