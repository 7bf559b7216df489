"""Tests of figures of ground forces and losses, with walks set by hand."""

import numpy as np
import pytest
from synthetic_walks import WEIGHT, both_models, contact, stored, without

from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.views.figures.canvas import figure_style
from walkerlab.views.figures.style import CONTACT_LOOK
from walkerlab.views.figures.walks import GROUND, losses, walk_of

FORCES, LOST = GROUND


def plotted(figure, results):
    with figure_style():
        return figure.draw(results)[0]


def test_friction_is_drawn_within_its_cone():
    cone = plotted(FORCES, both_models()).axes[1]
    bounds = [line for line in cone.lines if len(line.get_xdata()) == 2 and line.get_xdata()[0] == 0.0]
    slopes = sorted(float(line.get_ydata()[1] / line.get_xdata()[1]) for line in bounds if line.get_ydata()[1])
    assert slopes == pytest.approx([-0.9, -0.7, 0.7, 0.9])
    dots = [line for line in cone.lines if line.get_marker() == "."]
    assert {float(x) for line in dots for x in line.get_xdata()} == {WEIGHT}
    assert {float(y) for line in dots for y in line.get_ydata()} == {0.2 * WEIGHT}
    assert "at most 0.2 of the normal force" in FORCES.render(both_models()).caption


def test_losses_of_a_step_are_independent_of_the_sampling():
    lost = losses(walk_of(contact(), CONTACT_LOOK))
    assert [label for label, _ in lost] == ["damping of the ground", "friction"]
    (damping, friction) = lost.values()
    np.testing.assert_allclose(damping, [0.0, *[1.0] * 9], atol=1e-12)
    np.testing.assert_allclose(friction, 0.1 * damping, atol=1e-12)
    said = LOST.render(both_models()).caption
    assert "1.1 J on average: 90.9 % to damping of the ground, 9.09 % to friction" in said


def test_work_of_drives_is_not_shown_as_a_loss():
    """A push-off gives back what a step loses, so the energy stays the same. Straight legs have no knees that could
    lose energy.
    """
    walk = contact()
    gone = walk["trajectory"]
    given = Variable(150.0 - gone["total_energy_J"], ("time",), "J", "given")
    level = Variable(np.full(given.values.size, 150.0), ("time",), "J", "energy")
    driven = {**gone.variables, "push_off_J": given, "total_energy_J": level}
    found = losses(
        walk_of(stored("contact-sim", {**walk.groups, "trajectory": Group(driven)}, walk.summary), CONTACT_LOOK)
    )
    passive = losses(walk_of(walk, CONTACT_LOOK))
    assert [*found] == [*passive]
    np.testing.assert_allclose([*found.values()], [*passive.values()], atol=1e-12)


def test_tops_of_stacked_bars_are_the_total_loss():
    (axes,) = plotted(LOST, both_models()).axes
    tops = [bar.get_y() + bar.get_height() for bar in axes.patches]
    assert max(tops) == pytest.approx(1.1)


@pytest.mark.parametrize("steps", [1, 2, 10])
def test_step_axis_has_integer_ticks(steps):
    (axes,) = plotted(LOST, both_models(**{"contact-sim": contact(steps)})).axes
    assert all(float(tick).is_integer() for tick in axes.get_xticks())


def test_figures_of_missing_data_are_left_out_with_the_reason():
    results = both_models(**{"contact-sim": without(contact(), "trajectory", "normal_force_N", "total_energy_J")})
    assert FORCES.why_left_out(results, {}) == "contact-sim: 'forces' is not among the config's outputs"
    assert LOST.why_left_out(results, {}) == "contact-sim: 'energies' is not among the config's outputs"
