"""Figure 7: angles and angular velocities of both legs in time."""

from __future__ import annotations

from matplotlib.figure import Figure

from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.in_time import legend, line, shade_stance, stance_entry, time_axes
from walkerlab.figures.needs import Results
from walkerlab.figures.walks import CONTACT_STATES, RIGID_STATES, sentence, shown, walks_with

ROWS = (
    ("angle", 0, "angle (rad)", "(a1) angle of leg 1"),
    ("angle", 1, "angle (rad)", "(a2) angle of leg 2"),
    ("velocity", 0, "velocity (rad/s)", "(b1) angular velocity of leg 1"),
    ("velocity", 1, "velocity (rad/s)", "(b2) angular velocity of leg 2"),
)


def plot(results: Results) -> Figure:
    """A row for each leg's angle and each leg's angular velocity."""
    walks, _ = shown(walks_with(results, RIGID_STATES, CONTACT_STATES))
    figure, axes = time_axes(4, 1.55, walks)
    for one, (quantity, leg, label, title) in zip(axes, ROWS, strict=True):
        shade_stance(one, walks[0], leg)
        for walk in walks:
            line(one, walk.time, walk[quantity][:, leg], walk.look)
        one.set_ylabel(label)
        one.set_title(title)
    legend(figure, walks, stance_entry(walks[0].look))
    return figure


def caption(results: Results) -> str:
    """What is shown, and how the walks went."""
    walks = walks_with(results, RIGID_STATES, CONTACT_STATES)
    extent = shown(walks)[1]
    return f"Angles from the vertical and angular velocities of both legs{extent}. {sentence(walks)}"


SEEN = (
    "Four plots over time below one another: angle of each leg, rising fast and falling slowly, and its "
    "angular velocity."
)
FIGURE = paper_figure(7, "Angles and angular velocities of the legs", (RIGID_STATES,), caption, plot, SEEN)
