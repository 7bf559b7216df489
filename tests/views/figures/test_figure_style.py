"""Check every figure: labels with units, nothing clipped or covered, and readable in grey."""

import itertools
import re

import pytest
from drawn_texts import texts_drawn
from howto_figure import FIGURE as OF_THE_DOCS
from matplotlib.colors import to_hex
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text
from synthetic_basin import basin
from synthetic_engines import content as engines
from synthetic_families import families
from synthetic_maps import stability_maps
from synthetic_methods import measured_methods
from synthetic_tune import tuned
from synthetic_walks import both_models, contact, rigid, rigid_alone

from walkerlab.evidence.paper.figures import PAPER_ERROR, PHASE_LOOK, TIME_LOOK
from walkerlab.outcome import OUTCOME_TEXTS, Outcome
from walkerlab.views.figures.canvas import figure_style, settle
from walkerlab.views.figures.maps import ATTRACTOR_COLOURS
from walkerlab.views.figures.stage import FIGURES
from walkerlab.views.figures.style import CONTACT_LOOK, LEGS, POINT, RIGID_LOOK
from walkerlab.views.report.tex import COLUMN_WIDTHS

RESULTS = {
    "both models": both_models(),
    "rigid alone": rigid_alone(),
    "a plane": both_models(**{"contact-sim": contact(pads=False)}),
    "one stride": both_models(simulate=rigid(2), **{"contact-sim": contact(2, 0.72)}),
    "methods measured": measured_methods(),
    "stability mapped": stability_maps(),
    "one step": both_models(**{"contact-sim": contact(1, outcome="fell")}),
    "tuned": tuned(),
    "tuned, far apart": tuned((0.002, 0.02, 0.2, 3.0)),
    "tuned, within less than a decade": tuned((0.022, 0.031, 0.045, 0.083)),
    "families": families(),
    "families without a bifurcation": families(flips=False),
    "a basin": basin([0, 0, 1, -1]),
    "engines": {"engines": engines()},
}
SPECIAL_IN = {
    "rigid alone": ("figure-07", "figure-09", "figure-10"),
    "a plane": ("figure-06",),
    "one stride": ("figure-02", "figure-06", "figure-07", "figure-08", "figure-09", "figure-10"),
    "one step": (
        "figure-06", "figure-07", "figure-09", "figure-10", "ground-forces", "energy-lost", OF_THE_DOCS.name,
    ),
    "tuned, far apart": ("figure-12",),
    "families without a bifurcation": ("figure-13",),
}  # fmt: skip
"""Figures that differ for some special results. All others look as they do for the results above."""
NARROW, _ = COLUMN_WIDTHS.values()
CASES = [
    pytest.param((results, figure, width), id=f"{name}-{figure.name}-{width:g}")
    for name, results in RESULTS.items()
    for figure in (*FIGURES, OF_THE_DOCS)
    if figure.why_left_out(results, {}) is None and figure.name in SPECIAL_IN.get(name, (figure.name,))
    for width in COLUMN_WIDTHS.values()
    if name not in SPECIAL_IN or width == NARROW  # Texts have the least room in the narrow width.
]
WITH_UNIT = re.compile(r".+ \((deg|m|mm|s|m/s|rad|rad/s|kg|J|N|N/m²·²|SI)\)")
PURE = re.compile("error|steps?|right-hand sides|(real|imaginary) part|magnitude|factor on .*")
SMALLEST = 5.0
"""Minimum size of letters (pt)."""
TOLD_APART = 15
"""Minimum difference of two colours in one channel, out of 255."""
VISIBLE = 0.1
"""Minimum difference of brightness between overlapping lines."""


@pytest.fixture(scope="module")
def drawn(request):
    results, figure, width = request.param
    with figure_style(POINT * width):
        made = figure.draw(results)[0]
        settle(made)
        made.texts_drawn = texts_drawn(made)
    return made


for_all = pytest.mark.parametrize("drawn", CASES, indirect=True)


@for_all
def test_every_axis_has_a_label_with_a_unit(drawn):
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            numbered = any(label.get_visible() and label.get_text() for label in axis.get_ticklabels())
            said = " ".join(axis.get_label_text().split())
            assert bool(WITH_UNIT.fullmatch(said) or PURE.fullmatch(said)) == numbered, said


@for_all
def test_legends_do_not_overlap_the_axes(drawn):
    assert all(axes.get_legend() is None for axes in drawn.axes)
    for legend in drawn.legends:
        box = legend.get_window_extent()
        assert not any(box.overlaps(axes.get_tightbbox()) for axes in drawn.axes)


@for_all
def test_colours_have_a_legend(drawn):
    of_lines = {to_hex(line.get_color()) for axes in drawn.axes for line in axes.lines}
    of_areas = {to_hex(patch.get_facecolor()) for axes in drawn.axes for patch in axes.patches}
    assert drawn.legends or len(of_lines) <= 1 >= len(of_areas)


@for_all
def test_no_text_is_clipped(drawn):
    for text, box in drawn.texts_drawn:
        assert box.x0 >= 0.0, text
        assert box.y0 >= 0.0, text
        assert box.x1 <= drawn.bbox.width, text
        assert box.y1 <= drawn.bbox.height, text


@for_all
def test_texts_do_not_overlap(drawn):
    for (text, box), (other, other_box) in itertools.combinations(drawn.texts_drawn, 2):
        assert not box.overlaps(other_box), (text, other)


@for_all
def test_texts_do_not_overlap_axes(drawn):
    for axes in drawn.axes:
        for spine in axes.spines.values():
            if spine.get_visible() and spine.axes.axison:
                line = spine.get_window_extent()
                assert not any(box.overlaps(line) for _, box in drawn.texts_drawn)


@for_all
def test_exponents_are_large_enough_to_be_read(drawn):
    parser = MathTextParser("path")
    for text, _ in drawn.texts_drawn:
        assert text.get_fontsize() >= SMALLEST
        for line in text.get_text().split("\n"):
            glyphs = parser.parse(line, 72, text.get_fontproperties()).glyphs if "$" in line else ()
            assert all(size >= SMALLEST for _, size, *_ in glyphs), line


@for_all
def test_all_figures_have_the_requested_width_and_one_font(drawn):
    assert drawn.get_figwidth() in {POINT * width for width in COLUMN_WIDTHS.values()}
    assert {text.get_fontname() for text in drawn.findobj(Text)} == {"DejaVu Sans"}


@for_all
def test_legend_has_no_duplicates(drawn):
    for legend in drawn.legends:
        names = [text.get_text() for text in legend.get_texts()]
        assert len(set(names)) == len(names)


def test_outcomes_have_distinct_colours_in_every_map():
    failures = [OUTCOME_TEXTS[one].colour for one in Outcome if one is not Outcome.WALKED]
    every = [tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5)) for colour in (*failures, *ATTRACTOR_COLOURS)]
    for one, other in itertools.combinations(every, 2):
        assert max(abs(a - b) for a, b in zip(one, other, strict=True)) > TOLD_APART


def brightness(colour):
    """Return the grey level of a colour '#RRGGBB' on a grey printer, from 0 (black) to 1 (white), as Rec. 601 luma."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return 0.299 * red + 0.587 * green + 0.114 * blue


@pytest.mark.parametrize(
    "looks",
    [(RIGID_LOOK, CONTACT_LOOK), LEGS, (TIME_LOOK, PHASE_LOOK), (PHASE_LOOK, PAPER_ERROR)],
    ids=["models", "legs", "errors", "paper"],
)
def test_overlapping_lines_differ_in_brightness_and_style(looks):
    one, other = looks
    assert abs(brightness(one.colour) - brightness(other.colour)) > VISIBLE
    assert one.style != other.style


def test_brightness_of_a_grey_is_its_grey_value():
    assert brightness("#000000") == 0.0
    assert brightness("#ffffff") == pytest.approx(1.0)
    assert brightness(to_hex("0.5")) == pytest.approx(128 / 255)
