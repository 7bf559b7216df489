"""Tests of the contents of figures, and of the conditions under which they are drawn."""

import functools
import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_hex
from synthetic_methods import everything
from synthetic_walks import both_models, compared, contact, rigid, rigid_alone, stored, without

from walkerlab.evidence.paper.figures import PAPER_ERROR, PHASE_LOOK, TIME_LOOK
from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.views.figures import stick_diagram, walks
from walkerlab.views.figures.canvas import figure_style
from walkerlab.views.figures.illustration import WORDS, Illustration
from walkerlab.views.figures.stage import FIGURES as ALL_FIGURES
from walkerlab.views.figures.style import CONTACT_LOOK, RIGID_LOOK

SVG = "{http://www.w3.org/2000/svg}"
ELSEWHERE = {"tune", "continuation", "basin", "engines", "robustness", "identify", "plan"}
FIGURES = [figure for figure in ALL_FIGURES if ELSEWHERE.isdisjoint(need.stage for need in figure.needs)]
PAPER_FIGURES = [figure for figure in FIGURES if figure.number is not None]
NUMBERED = {figure.number: figure for figure in PAPER_FIGURES}
NAMES = [figure.name for figure in FIGURES]


def why_left_out(results, absent):
    reasons = {figure.number: figure.why_left_out(results, absent) for figure in PAPER_FIGURES}
    return {number: why for number, why in reasons.items() if why is not None}


def drawable(results):
    return [figure.number for figure in PAPER_FIGURES if figure.why_left_out(results, {}) is None]


def plotted(figure, results):
    with figure_style():
        return figure.draw(results)[0]


def caption_of(figure, results):
    with figure_style():
        return figure.say("caption", *figure.draw(results)[1])


def lines_of(axes, look):
    """Return the data lines that have the colour and width of a look."""
    return [
        line
        for line in axes.lines
        if to_hex(line.get_color()).upper() == look.colour and line.get_linewidth() == look.width
    ]


def test_figures_of_both_models_are_those_of_the_paper():
    assert drawable(both_models()) == [2, 6, 7, 8, 9, 10]


def test_figures_of_a_rigid_only_run_are_2_7_9_10():
    assert drawable(rigid_alone()) == [2, 7, 9, 10]


def test_omitted_figure_states_the_reason():
    why = why_left_out(rigid_alone(), {"contact-sim": "the config has no contact block"})
    assert why == {6: "it needs contact-sim: the config has no contact block", 8: "it needs compare"}


def test_energies_are_drawn_even_without_states():
    results = rigid_alone(simulate=without(rigid(), "trajectory", "angle", "velocity"))
    assert drawable(results) == [10]
    assert why_left_out(results, {})[7] == "simulate: 'states' is not among the config's outputs"


def test_motion_is_drawn_even_without_energies():
    results = rigid_alone(simulate=without(rigid(), "trajectory", "kinetic_J"))
    assert drawable(results) == [2, 7, 9]


def test_walk_without_a_step_is_drawn_only_over_time():
    results = rigid_alone(simulate=rigid(1, outcome="no-heel-strike", completed=0))
    assert drawable(results) == [7, 9, 10]
    assert why_left_out(results, {})[2] == "simulate: no step was completed"
    assert NUMBERED[7].render(results).caption.endswith("The rigid model took 0 steps (no-heel-strike).")


@pytest.mark.filterwarnings("error")
def test_walk_of_zero_duration_can_be_drawn():
    results = rigid_alone(simulate=first_sample_of(rigid(1, outcome="rejected", completed=0)))
    for figure in (NUMBERED[7], NUMBERED[9], NUMBERED[10]):
        assert "0 steps (rejected)" in figure.render(results).caption


def first_sample_of(result):
    trajectory = {
        name: Variable(variable.values[:1], variable.dims, variable.units, variable.long_name)
        for name, variable in result["trajectory"].variables.items()
    }
    return stored("simulate", {"trajectory": Group(trajectory)}, result.summary)


def test_models_without_a_common_step_have_no_phase_difference():
    results = both_models(compare=compared(aligned=False))
    assert why_left_out(results, {}) == {8: "compare: no step was completed by both models"}


def test_paper_figures_are_named_after_their_numbers():
    assert [figure.name for figure in PAPER_FIGURES] == [f"figure-{figure.number:02d}" for figure in PAPER_FIGURES]
    assert PAPER_FIGURES[0].reference == "figure 2"
    assert len(set(NAMES)) == len(NAMES)


def test_figures_not_in_the_paper_are_called_by_name():
    assert Illustration("run-time", (), dict.popitem).reference == "figure run-time"


def test_every_figure_has_a_text_and_every_text_a_figure():
    assert [figure.name for figure in ALL_FIGURES if not figure.title or figure.title.endswith(".")] == []
    # texts without a figure of that name, and the words of a sweep
    shared = {"cycle", "counted", "figure-17", "push-off-or-hip", "sweep", "went"}
    files = {path.stem for path in WORDS.folder.glob("*.j2")}
    assert files - shared == {figure.words or figure.name for figure in ALL_FIGURES}


def module_of(figure):
    """Return the module that draws a figure."""
    return getattr(figure.draw, "func", figure.draw).__module__


OF_MODULES = {module_of(figure): figure.name for figure in FIGURES}
"""One figure of each module that draws figures."""


@functools.cache
def drawn_once():
    results = everything()
    return {figure.name: figure.render(results) for figure in FIGURES if figure.name in OF_MODULES.values()}


OWN_SETTINGS = "font.size: 20\nlines.linewidth: 9\nsvg.fonttype: path\naxes.grid: True\nfigure.dpi: 300\n"
DRAW_ELSEWHERE = """
import hashlib, sys
from synthetic_methods import everything
from walkerlab.views.figures.stage import FIGURES
results = everything()
for figure in FIGURES:
    if figure.name in sys.argv:
        drawing = figure.render(results)
        print(figure.name, hashlib.sha256(drawing.svg + drawing.png).hexdigest())
assert "matplotlib.pyplot" not in sys.modules, "pyplot has state, and opens windows"
"""


def test_equal_results_give_equal_bytes_in_any_process_and_style(tmp_path):
    (tmp_path / "matplotlibrc").write_text(OWN_SETTINGS)
    here, package = Path(__file__).parent, Path(__file__).parents[3]
    environment = {
        **os.environ,
        "MATPLOTLIBRC": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(here), str(package)]),
    }
    done = subprocess.run(
        [sys.executable, "-c", DRAW_ELSEWHERE, *OF_MODULES.values()],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    assert done.stdout == drawn_here()


def drawn_here():
    digests = {name: hashlib.sha256(drawing.svg + drawing.png).hexdigest() for name, drawing in drawn_once().items()}
    return "".join(f"{name} {digest}\n" for name, digest in digests.items())


@pytest.mark.parametrize("name", OF_MODULES.values())
def test_svg_keeps_text_as_text_and_has_no_date(name):
    drawing = drawn_once()[name]
    texts = {"".join(text.itertext()) for text in ElementTree.fromstring(drawing.svg).iter(f"{SVG}text")}
    assert any(re.search(r" \((m|mm|s|m/s|rad|rad/s|J|N)\)$", text) for text in texts)
    assert b"<dc:date>" not in drawing.svg
    assert drawing.png.startswith(b"\x89PNG")


@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: figure.name)
def test_captions_are_sentences_with_numbers(figure):
    caption = caption_of(figure, everything())
    assert caption.endswith(".")
    assert any(letter.isdigit() for letter in caption)
    assert "nan" not in caption


def test_heel_strikes_of_both_models_are_marked_on_every_time_axis():
    results = both_models()
    expected = {
        RIGID_LOOK.colour: results["simulate"]["steps"]["touch_time_s"].tolist(),
        CONTACT_LOOK.colour: results["contact-sim"]["steps"]["touch_time_s"].tolist(),
    }
    for figure in (NUMBERED[7], NUMBERED[10]):
        for axes in plotted(figure, results).axes:
            for colour, times in expected.items():
                (uprights,) = [lines for lines in axes.collections if to_hex(lines.get_color()[0]).upper() == colour]
                assert [[tuple(end) for end in line] for line in uprights.get_segments()] == [
                    [(time, 0.0), (time, 1.0)] for time in times
                ]


def test_curves_over_time_show_the_stored_angles_and_velocities():
    results = both_models()
    axes = plotted(NUMBERED[7], results).axes
    for row, (name, leg) in enumerate((("angle", 0), ("angle", 1), ("velocity", 0), ("velocity", 1))):
        for stage, look in (("simulate", RIGID_LOOK), ("contact-sim", CONTACT_LOOK)):
            (line,) = lines_of(axes[row], look)
            trajectory = results[stage]["trajectory"]
            np.testing.assert_array_equal(line.get_xdata(), trajectory["time"])
            np.testing.assert_array_equal(line.get_ydata(), trajectory[name][:, leg])


def test_stance_phases_are_shaded():
    axes = plotted(NUMBERED[7], rigid_alone()).axes
    for leg, one in enumerate(axes[:2]):
        spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in one.patches]
        np.testing.assert_allclose(spans, [(0.7 * step, 0.7 * (step + 1)) for step in range(1 - leg, 10, 2)], atol=1e-9)


def test_long_walk_shows_five_strides_and_says_so():
    results = rigid_alone(simulate=rigid(24))
    figure = plotted(NUMBERED[7], results)
    (line,) = lines_of(figure.axes[0], RIGID_LOOK)
    assert line.get_xdata()[-1] == pytest.approx(10 * 0.7)
    caption = caption_of(NUMBERED[7], results)
    assert "(the first 5 strides)" in caption
    assert caption.endswith("The rigid model walked 24 steps.")


def test_caption_mentions_a_fall():
    results = both_models(**{"contact-sim": contact(3, outcome="fell")})
    assert "the contact model took 3 steps (fell)" in caption_of(NUMBERED[7], results)


def test_errors_are_plotted_over_time_and_phase():
    results = both_models()
    axes = plotted(NUMBERED[8], results).axes
    (raw,) = lines_of(axes[0], TIME_LOOK)
    np.testing.assert_array_equal(raw.get_ydata(), np.abs(results["compare"]["errors"]["raw_angle_error_rad"][:, 0]))
    steps = lines_of(axes[3], PHASE_LOOK)
    aligned = results["compare"]["aligned"]["aligned_velocity_error_rad_s"]
    assert len(steps) == 10
    for step, line in enumerate(steps):
        assert line.get_xdata()[0] == pytest.approx(0.7 * step)
        assert line.get_xdata()[-1] == pytest.approx(0.7 * (step + 1))
        np.testing.assert_array_equal(line.get_ydata(), np.abs(aligned[step, :, 1]))


def test_error_bound_of_the_paper_is_a_visible_line():
    for axes in plotted(NUMBERED[8], both_models()).axes:
        (line,) = lines_of(axes, PAPER_ERROR)
        bottom, top = axes.get_ylim()
        assert axes.get_yscale() == "log"
        assert set(line.get_ydata()) == {1e-4}
        assert bottom < 1e-4 < top


def test_limit_cycles_of_both_legs_have_equal_scales():
    one, other = plotted(NUMBERED[9], both_models()).axes
    assert one.get_xlim() == other.get_xlim()
    assert one.get_ylim() == other.get_ylim()


def test_last_stride_has_the_style_of_its_model_and_the_rest_is_thin():
    results = both_models()
    axes = plotted(NUMBERED[9], results).axes[0]
    (last,) = lines_of(axes, RIGID_LOOK)
    trajectory = results["simulate"]["trajectory"]
    shown = trajectory["time"] >= 8 * 0.7
    np.testing.assert_array_equal(last.get_xdata(), trajectory["angle"][shown, 0])
    assert any(line.get_xdata().size == trajectory["time"].size for line in axes.lines)


def test_axis_of_a_constant_energy_spans_more_than_half_a_joule():
    axes = plotted(NUMBERED[10], rigid_alone()).axes[2]
    bottom, top = axes.get_ylim()
    assert top - bottom > 0.5
    assert bottom < 150.24 < top


def test_markers_do_not_widen_the_axes():
    bottom, top = plotted(NUMBERED[10], rigid_alone()).axes[0].get_ylim()
    assert bottom > 2.5
    assert top < 5.5


def test_energy_peaks_at_impacts_do_not_change_the_axis_limits():
    results = both_models()
    axes = plotted(NUMBERED[10], both_models(**{"contact-sim": with_peak(results["contact-sim"])})).axes
    assert axes[2].get_ylim() == plotted(NUMBERED[10], results).axes[2].get_ylim()


def with_peak(result):
    energy = result["trajectory"]["mechanical_J"].copy()
    energy[100] += 50.0
    trajectory = result["trajectory"]
    variables = {**trajectory.variables, "mechanical_J": Variable(energy, ("time",), "J", "mechanical energy")}
    return stored("contact-sim", {**result.groups, "trajectory": Group(variables)}, result.summary)


def test_cycle_ends_with_its_second_step():
    sticks = stick_diagram.read_sticks(rigid_alone()["simulate"])
    at_strikes, between = sticks.postures()
    np.testing.assert_allclose(sticks.time[at_strikes], [0.0, 0.7, 1.4], atol=1e-12)
    assert sticks.time[between].max() < 1.4


def test_legend_of_limit_cycles_has_the_markers_of_both_models():
    results = both_models()
    figure = plotted(NUMBERED[9], results)
    marks = {(line.get_marker(), line.get_markerfacecolor()) for line in figure.legends[0].get_lines()}
    for look in (RIGID_LOOK, CONTACT_LOOK):
        assert {(look.marker, look.colour), (look.marker, "white")} <= marks


def test_overlaid_runs_have_an_axis_for_each_leg():
    first, second = both_models(), both_models(simulate=rigid(6))
    trajectories = [run["simulate"]["trajectory"] for run in (first, second)]
    with figure_style():
        figure = walks.draw_overlay([("simulate", trajectories)], ("one", "other"))
    for leg, axes in enumerate(figure.axes[:2]):
        assert len({line.get_color() for line in axes.lines}) == len(axes.lines) == 2
        for line, trajectory in zip(axes.lines, trajectories, strict=True):
            np.testing.assert_array_equal(line.get_ydata(), trajectory["angle"][:, leg])
