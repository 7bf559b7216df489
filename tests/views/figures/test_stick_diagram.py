"""Check the geometry of stick diagrams: legs keep their length, and stance feet do not move."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from synthetic_walks import LEG_LENGTH, SLOPE, STEP_LENGTH, both_models, contact, rigid, rigid_alone

from walkerlab.views.figures.canvas import figure_style
from walkerlab.views.figures.stick_diagram import (
    FIGURES,
    FILM_NEEDS,
    entries,
    film_times,
    pictures,
    read_sticks,
    stick_diagram,
)
from walkerlab.views.figures.style import LEGS, VERMILLION

ROUNDING = 1e-12
FIGURE_2, FIGURE_6 = FIGURES


@pytest.fixture(params=["simulate", "contact-sim"])
def sticks(request):
    return read_sticks(both_models()[request.param])


def test_drawn_legs_keep_their_length(sticks):
    lengths = np.linalg.norm(sticks.feet - sticks.hip[:, None], axis=-1)
    np.testing.assert_allclose(lengths, LEG_LENGTH, atol=ROUNDING)


def test_hip_does_not_jump_when_legs_change_roles(sticks):
    apart = np.linalg.norm(np.diff(sticks.hip, axis=0), axis=1)
    at_once = np.diff(sticks.time) < 1e-9
    assert apart[at_once].max(initial=0.0) < ROUNDING
    assert apart.max() < 0.05


def test_feet_land_one_step_length_ahead(sticks):
    for step, strike in enumerate(sticks.strikes[:2]):
        row = np.searchsorted(sticks.time, strike)
        landed = sticks.feet[row, step % 2]
        np.testing.assert_allclose(landed, [(step + 1) * STEP_LENGTH, 0.0], atol=1e-9)


def test_plane_descends_in_walking_direction():
    sticks = read_sticks(rigid_alone()["simulate"])
    x, y = sticks.project(np.array([STEP_LENGTH, 0.0]))
    assert np.arctan2(-y, x) == pytest.approx(SLOPE)
    assert np.hypot(x, y) == pytest.approx(STEP_LENGTH)


def test_stick_diagram_of_an_incomplete_cycle_ends_where_the_walk_ends():
    results = rigid_alone(simulate=rigid(2, outcome="fell", completed=1))
    sticks = read_sticks(results["simulate"])
    at_strikes, between = sticks.postures()
    assert sticks.time[at_strikes].tolist() == pytest.approx([0.0, 0.7])
    assert sticks.time[between].max() == sticks.time[-1]
    assert "not completed" in FIGURE_2.render(results).caption


def test_slope_label_is_above_the_torso():
    bare = read_sticks(rigid_alone()["simulate"])
    sticks = replace(bare, head=bare.hip + np.array([0.0, 0.4 * LEG_LENGTH]))
    with figure_style():
        figure, axes = stick_diagram(sticks)
        figure.draw_without_rendering()
    (label,) = [text for text in axes.texts if text.get_text().startswith("walking direction")]
    bottom = axes.transData.inverted().transform(label.get_window_extent())[0, 1]
    assert bottom > sticks.project(sticks.head)[:, 1].max()
    assert axes.get_ylim()[1] > axes.transData.inverted().transform(label.get_window_extent())[1, 1]


def test_legend_names_a_torso_only_if_there_is_one():
    bare = read_sticks(rigid_alone()["simulate"])
    sticks = replace(bare, head=bare.hip + np.array([0.0, 0.4 * LEG_LENGTH]))
    assert "torso" in [entry.get_label() for entry in entries(sticks)]
    assert "torso" not in [entry.get_label() for entry in entries(bare)]


def drawn(figure, results):
    with figure_style():
        return figure.draw(results)[0].axes[0]


def test_lengths_are_drawn_to_scale():
    assert drawn(FIGURE_2, rigid_alone()).get_aspect() == 1.0


def test_both_legs_of_every_posture_have_their_colours():
    axes = drawn(FIGURE_2, rigid_alone())
    at_strikes, between = read_sticks(rigid_alone()["simulate"]).postures()
    for look in LEGS:
        assert sum(line.get_color() == look.colour for line in axes.lines) == at_strikes.size + between.size


def test_visible_pads_have_the_colour_of_their_leg():
    axes = drawn(FIGURE_6, both_models())
    left, right = axes.get_xlim()
    pads = both_models()["contact-sim"]["terrain"]
    for leg, look in enumerate(LEGS):
        outlines = [patch.get_path().vertices for patch in axes.patches if patch.get_hatch() and of(patch, look)]
        expected = [
            pad_left
            for pad_left, pad_right, owner in zip(pads["left_m"], pads["right_m"], pads["leg"], strict=True)
            if owner == leg + 1 and pad_right > left and pad_left < right
        ]
        assert [outline[0, 0] for outline in outlines] == pytest.approx(expected, abs=1e-3)


def of(patch, look):
    return to_hex(patch.get_edgecolor()).upper() == look.colour


def test_ground_without_pads_is_drawn_as_a_plane_and_the_caption_explains_it():
    results = both_models(**{"contact-sim": contact(pads=False)})
    assert not [patch for patch in drawn(FIGURE_6, results).patches if patch.get_hatch()]
    assert "after it has passed the stance foot" in FIGURE_6.render(results).caption
    assert "lane of pads" in FIGURE_6.render(both_models()).caption


def coloured(picture, look):
    """Return the number of pixels of a picture that have the colour of a leg."""
    return int((picture == np.round(255.0 * np.array(to_rgb(look.colour))).astype(np.uint8)).all(axis=2).sum())


def film_frame(result, pads=None, **changed):
    (picture,) = pictures(replace(read_sticks(result), **changed), np.array([0.3]), pads)
    return picture


def test_film_shows_the_arcs_of_round_feet():
    flat, round_feet = (film_frame(rigid(), radii=(radius, radius)) for radius in (0.0, 0.2))
    for look in LEGS:
        assert coloured(round_feet, look) > coloured(flat, look) + 50


def test_film_of_a_walk_on_pads_shows_pads_instead_of_a_plane():
    result = contact()
    plane, on_pads = film_frame(result), film_frame(result, result.groups["terrain"])
    tinted = [int((np.ptp(picture, axis=2) > 10).sum()) for picture in (plane, on_pads)]
    assert tinted[1] > tinted[0] + 200


def test_film_of_both_models_shows_the_rigid_walk_behind_the_contact_walk():
    walks = both_models()
    contact_sticks, rigid_sticks = read_sticks(walks["contact-sim"]), read_sticks(walks["simulate"])
    (alone,) = pictures(contact_sticks, np.array([0.3]))
    (both,) = pictures(contact_sticks, np.array([0.3]), None, rigid_sticks)
    for look in LEGS:
        assert coloured(both, look) > 0.9 * coloured(alone, look)

    def grey(picture):
        return int(((np.ptp(picture, axis=2) < 3) & (picture[:, :, 0] > 140) & (picture[:, :, 0] < 200)).sum())

    assert grey(both) > grey(alone) + 500


def test_film_holds_the_fall_for_a_second():
    walk = read_sticks(contact(1, outcome="fell"))
    late = replace(walk, time=walk.time * 1.5)  # The walk goes on after the last landing.
    times = film_times(late, None, 25, 1.0)
    assert times[-25:].tolist() == [late.time[-1]] * 25
    assert film_times(late, 1, 25, 1.0)[-1] < late.strikes[0]  # Only the first step was requested.
    assert film_times(replace(late, ending=""), None, 25, 1.0)[-1] < late.time[-1]
    falling, fallen = pictures(late, late.time[-1:] * np.array([0.999, 1.0]))
    assert (falling != fallen).any()  # The clock shows that the walker fell.


@pytest.mark.parametrize("landings", [1, 4, 5, 10])
def test_film_of_a_fall_shows_the_last_four_steps(landings):
    period = 0.5
    walk = replace(read_sticks(rigid(landings + 1, period, completed=landings)), ending="fell")
    times = film_times(walk, None, 25, 1.0)
    assert times[0] == pytest.approx(period * max(0, landings - 4))
    assert times[-1] == walk.time[-1] > period * landings


def test_walk_that_falls_in_its_first_step_has_a_film():
    fall = rigid(1, outcome="fell", completed=0)
    assert FILM_NEEDS["simulate"].missing_in({"simulate": fall}, {}) is None
    walk = read_sticks(fall)
    times = film_times(walk, None, 25, 1.0)
    assert (times[0], times[-1]) == (0.0, walk.time[-1])
    assert len([*pictures(walk, times[-1:])]) == 1


def test_film_also_exaggerates_rough_ground():
    begins, rough = np.array([-1.0, 0.2, 0.6]), np.array([0.0, 0.002, -0.001])
    even, uneven = (film_frame(rigid(), ground=np.column_stack((begins, heights))) for heights in (0.0 * rough, rough))
    red = np.round(255.0 * np.array(to_rgb(VERMILLION))).astype(np.uint8)
    rows = [np.flatnonzero((picture == red).all(axis=2).any(axis=1)) for picture in (even, uneven)]
    assert rows[0].size == 0
    assert np.ptp(rows[1]) > 20


def test_trailing_leg_pushes_off_just_after_each_landing():
    driven = replace(read_sticks(both_models()["simulate"]), pushes=True)
    for strike in driven.strikes[:-1]:
        behind = driven.feet[np.searchsorted(driven.time, strike), :, 0].argmin()
        assert [driven.pushing(strike + late) for late in (0.0, 0.05, 0.2)] == [behind, behind, None]
    assert driven.pushing(0.0) is None
    assert replace(driven, pushes=False).pushing(driven.strikes[0]) is None


def test_film_shows_the_push_off():
    walk = read_sticks(both_models()["simulate"])
    at = np.array([walk.strikes[0] + 0.02])
    (still,), (pushed,) = (list(pictures(replace(walk, pushes=pushes), at)) for pushes in (False, True))
    changed = np.any(still != pushed, axis=2)
    assert 100 < changed.sum() < 0.01 * changed.size
