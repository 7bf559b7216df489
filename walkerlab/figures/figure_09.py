"""Figure 9: limit cycles of both legs in the phase plane."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.in_time import line, model_lines
from walkerlab.figures.needs import Results
from walkerlab.figures.style import GREY
from walkerlab.figures.walks import CONTACT_STATES, RIGID_STATES, Walk, sentence, shown, walks_with

STRIDES = 20
"""A transient is over by then; more lines would only lie on one another."""
LAST_STRIDE = 2
"""Steps of it."""
MARKER_SIZE = 4.5
EARLIER_WIDTH = 0.5
ARROW_LENGTH = 0.06
"""Of an arrow on the cycle, in parts of a step's samples."""


def plot(results: Results) -> Figure:
    """A phase plane for each leg, both on the same scales."""
    walks, _ = shown(walks_with(results, RIGID_STATES, CONTACT_STATES), STRIDES)
    figure = blank(4.2)
    axes = list(figure.subplots(1, 2, sharex=True, sharey=True))
    for leg, one in enumerate(axes):
        for walk in walks:
            show_cycles(one, walk, leg)
            mark_strikes(one, walk, leg)
        show_direction(one, walks[0], leg)
        one.set_title(f"({'ab'[leg]}) leg {leg + 1}")
        one.set_xlabel("angle (rad)")
    axes[0].set_ylabel("angular velocity (rad/s)")
    lines = model_lines(walks)
    if any(walk.strikes.size > LAST_STRIDE for walk in walks):
        lines.append(Line2D([], [], color=GREY, linewidth=EARLIER_WIDTH, label="strides before the last"))
    marks = [strike_entry("heel strike of this leg", GREY), strike_entry("heel strike of the other leg", "white")]
    legend_above(figure, [*lines, *marks])
    return figure


def show_cycles(axes: Axes, walk: Walk, leg: int) -> None:
    """The last stride as the model's look has it, those before as thin lines under it."""
    angle, velocity = walk["angle"][:, leg], walk["velocity"][:, leg]
    axes.plot(angle, velocity, color=walk.look.colour, linewidth=EARLIER_WIDTH, zorder=walk.look.order - 2)
    last = walk.time >= (walk.strikes[-1 - LAST_STRIDE] if walk.strikes.size > LAST_STRIDE else 0.0)
    line(axes, angle[last], velocity[last], walk.look)


def mark_strikes(axes: Axes, walk: Walk, leg: int) -> None:
    """Mark the state just before each heel strike of the last stride: filled if the leg's own, open if not."""
    before = np.maximum(np.searchsorted(walk.time, walk.strikes[-LAST_STRIDE:]) - 1, 0)
    own = walk["stance_leg"][before] != leg
    for rows, face in ((before[own], walk.look.colour), (before[~own], "white")):
        axes.plot(
            walk["angle"][rows, leg],
            walk["velocity"][rows, leg],
            linestyle="none",
            marker=walk.look.marker,
            markersize=MARKER_SIZE,
            markerfacecolor=face,
            markeredgecolor=walk.look.colour,
            zorder=walk.look.order + 2,
        )


def show_direction(axes: Axes, walk: Walk, leg: int) -> None:
    """Arrowheads in the middle of the first swing and the first stance of a leg."""
    carries = walk["stance_leg"] == leg
    for phase in (carries, ~carries):
        rows = np.flatnonzero(phase)
        first = rows[: np.argmax(np.diff(rows, append=rows[-1] + 2) > 1) + 1] if rows.size else rows
        if first.size < 3:
            continue
        middle, ahead = first[first.size // 2], first[first.size // 2 + max(1, int(ARROW_LENGTH * first.size))]
        tail, head = (tuple(walk[name][row, leg] for name in ("angle", "velocity")) for row in (middle, ahead))
        arrow = {"arrowstyle": "-|>", "color": walk.look.colour, "mutation_scale": 13.0, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", xy=head, xytext=tail, arrowprops=arrow, zorder=7)


def strike_entry(label: str, face: str) -> Artist:
    """Legend entry of a marker, of whichever model."""
    entry = Line2D([], [], linestyle="none", marker="o", markersize=MARKER_SIZE, label=label, color=GREY)
    entry.set_markerfacecolor(face)
    return entry


def caption(results: Results) -> str:
    """What is shown, and how the walks went."""
    walks = walks_with(results, RIGID_STATES, CONTACT_STATES)
    extent = shown(walks, STRIDES)[1]
    return (
        f"Angle and angular velocity of each leg{extent}, the last stride drawn thick; at heel strikes the velocities "
        f"jump. {sentence(walks)}"
    )


SEEN = (
    "Two phase portraits, one a leg: a closed loop, round above for the swing, notched below for the "
    "stance, with jumps at the heel strikes."
)
FIGURE = paper_figure(9, "Limit cycles of the legs", (RIGID_STATES,), caption, plot, SEEN)
