"""Tests of the stability maps: every cell has its position and colour, and a missing error is not drawn as an error."""

import numpy as np
from matplotlib.colors import to_hex
from synthetic_maps import ENDS, stability_maps

from walkerlab.outcome import OUTCOME_TEXTS, Outcome
from walkerlab.views.figures.canvas import figure_style
from walkerlab.views.figures.maps import STABILITY, VERDICT_COLOURS, edges

STICTION, STEP = STABILITY


def meshes(figure):
    with figure_style():
        left, right, _ = figure.draw(stability_maps())[0].axes
    return [[mesh for mesh in axes.collections if mesh.get_array() is not None] for axes in (left, right)]


def colours(mesh):
    """Return the colour of each cell, or None where nothing is drawn."""
    values = mesh.get_array()
    shown = [to_hex(colour) for colour in mesh.to_rgba(values).reshape(-1, 4)]
    hidden = np.ma.getmaskarray(values).ravel()
    cells = [None if out else colour for colour, out in zip(shown, hidden, strict=True)]
    return np.array(cells, dtype=object).reshape(values.shape)


def test_cells_touch_and_are_centred_on_their_values():
    found = edges(np.array([1.0, 10.0, 100.0]))
    np.testing.assert_allclose(found, 10.0 ** np.array([-0.5, 0.5, 1.5, 2.5]))


def test_outcomes_have_the_same_colours_in_both_maps():
    left, _ = meshes(STICTION)
    expected = [OUTCOME_TEXTS[Outcome(outcome)].colour.lower() for outcome, _, _ in ENDS]
    assert colours(left[0]).tolist() == [expected] * 3


def test_errors_are_drawn_only_for_equal_outcomes():
    _, (errors, unanswered, otherwise) = meshes(STICTION)
    assert [colour is not None for colour in colours(errors)[0]] == [True, False, False]
    assert [colour is not None for colour in colours(unanswered)[0]] == [False, False, True]
    assert [colour is not None for colour in colours(otherwise)[0]] == [False, True, False]


def test_cells_of_diverging_walks_have_no_error_colour():
    (verdicts,), (errors, diverged) = meshes(STEP)
    expected = [VERDICT_COLOURS[name].lower() for name in ("fine", "wrong silently", "diverges")]
    assert colours(verdicts)[:, 0].tolist() == expected
    assert [colour is not None for colour in colours(errors)[:, 0]] == [True, True, False]
    assert [colour is not None for colour in colours(diverged)[:, 0]] == [False, False, True]


def test_captions_state_the_number_of_cells():
    said = STICTION.render(stability_maps()).caption
    assert "walked in 3 cells, off-pad in 3, budget-exhausted in 3" in said
    assert "3 cells have another outcome" in said
    assert "fine in 3 cells, wrong silently in 3, diverges in 3" in STEP.render(stability_maps()).caption


def test_missing_maps_are_omitted_with_the_reason():
    absent = {"stability-maps": "it was not requested"}
    assert STEP.why_left_out({}, absent) == "it needs stability-maps: it was not requested"
