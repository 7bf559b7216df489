"""Walks over time: axes below one another, a line a model, heel strikes marked."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from walkerlab.figures.canvas import UprightLine, blank, legend_above
from walkerlab.figures.style import PALE, Look
from walkerlab.figures.walks import Array, Walk

STRIKE_WIDTH = 0.6


def time_axes(rows: int, row_height: float, walks: list[Walk]) -> tuple[Figure, list[Axes]]:
    """A figure of axes that share the time axis, with the walks' heel strikes across all of them."""
    figure = blank(0.85 + rows * row_height)
    axes = list(figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0])
    for one in axes:
        for walk in walks:
            mark_strikes(one, walk)
    end = max(float(walk.time[-1]) for walk in walks)
    if end > 0.0:
        axes[-1].set_xlim(0.0, 1.01 * end)
    axes[-1].set_xlabel("time (s)")
    figure.align_ylabels(axes)
    return figure, axes


def mark_strikes(axes: Axes, walk: Walk) -> None:
    """A thin upright line at each heel strike, in the model's colour and style."""
    look, across = walk.look, axes.get_xaxis_transform()
    axes.vlines(walk.strikes, 0.0, 1.0, look.colour, look.style, transform=across, linewidth=STRIKE_WIDTH, zorder=1.5)


def line(axes: Axes, x: Array, y: Array, look: Look) -> None:
    """A series as its look has it."""
    axes.plot(x, y, color=look.colour, linestyle=look.style, linewidth=look.width, zorder=look.order)


def shade_stance(axes: Axes, walk: Walk, leg: int) -> None:
    """Shade the times in which a leg carries the walker."""
    carries = np.asarray(walk["stance_leg"] == leg, dtype=np.int64)
    edges = np.diff(carries, prepend=0, append=0)
    for begin, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        axes.axvspan(walk.time[begin], walk.time[end - 1], color=PALE, linewidth=0.0, zorder=0.5)


def line_entry(look: Look) -> Artist:
    """Legend entry of a series."""
    return Line2D([], [], color=look.colour, linestyle=look.style, linewidth=look.width, label=look.label)


def model_lines(walks: list[Walk]) -> list[Artist]:
    """Legend entries of the models."""
    return [line_entry(walk.look) for walk in walks]


def strike_entry(look: Look) -> Artist:
    """Legend entry of a model's heel strikes."""
    label = f"heel strike, {look.label.split()[0]}"
    return UprightLine([], [], color=look.colour, linestyle=look.style, linewidth=STRIKE_WIDTH, label=label)


def stance_entry(look: Look) -> Artist:
    """Legend entry of the shading by one model's stance phases."""
    return Patch(facecolor=PALE, edgecolor="none", label=f"stance of the leg, {look.label.split()[0]}")


def legend(figure: Figure, walks: list[Walk], *more: Artist) -> None:
    """The legend of a figure of walks, above all axes."""
    strikes = [strike_entry(walk.look) for walk in walks]
    legend_above(figure, [*model_lines(walks), *strikes, *more])
