"""Figure 12: how far the contact model is from the rigid one, against what its walk costs, towards the rigid limit."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.figure_05 import TUNE_STAGE
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, GREY, ORANGE, VERMILLION, Look
from walkerlab.figures.walks import redoes_the_paper
from walkerlab.paper.printed import ANGLE_ERROR
from walkerlab.store.content import Group

ALIGNED, VELOCITY, RAW = "angle_error_rad", "velocity_error_rad_s", "raw_angle_error_rad"
NUMERICAL, WALL = "numerical_time_s", "wall_s"
GROUPS: Final = (("limit/all", "(a) feet as they are"), ("limit/all-point-foot", "(b) point feet"))
ERRORS: Final = (
    (RAW, Look("angle at the same time (rad)", VERMILLION, ":", 1.2, "v")),
    (ALIGNED, Look("angle in phase (rad)", BLUE, "-", 1.6, "o")),
    (VELOCITY, Look("angular velocity in phase (rad/s)", ORANGE, "--", 1.4, "s")),
    (NUMERICAL, Look("numerical error, last touch (s)", GREY, "-.", 1.0, "x")),
)
LIMIT = (
    Need(
        TUNE_STAGE, GROUPS[0][0], (WALL, ALIGNED, VELOCITY, RAW, NUMERICAL), "no gait to lead towards the rigid limit"
    ),
)
CLAIM: Final = (0.0, (1.0, 2.0))
LEAST = 1e-14
"""Shown in place of a numerical error of nothing, which has no place on a logarithmic axis."""


def plot(results: Results) -> Figure:
    """Errors over run time, one setting a point, from the config's contact to the most rigid one."""
    figure = blank(3.6)
    found = series(results)
    both = figure.subplots(1, len(found), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (rows, title) in zip(both, found, strict=True):
        draw(axes, rows)
        if redoes_the_paper(results):
            axes.axhline(ANGLE_ERROR.value, color=BLACK, linestyle=CLAIM, linewidth=1.0)
        axes.set_title(title)
        axes.set_xlabel("run time of the walk (s)")
    both[0].set_ylabel("error")
    entries: list[Artist] = [
        Line2D([], [], color=look.colour, linestyle=look.style, marker=look.marker, markersize=4, label=look.label)
        for _, look in ERRORS
    ]
    if redoes_the_paper(results):
        entries.append(Line2D([], [], color=BLACK, linestyle=CLAIM, linewidth=1.0, label="the paper's claim"))
    entries.append(
        Line2D(
            [], [], color=BLACK, linestyle="", marker="o", markersize=9, fillstyle="none", label="the config's contact"
        )
    )
    legend_above(figure, entries)
    return figure


def series(results: Results) -> list[tuple[Group, str]]:
    """The series there are, with their titles: feet that roll in both models too are not made points as well."""
    stored = results[TUNE_STAGE].groups
    there = [(group, title) for group, title in GROUPS if group in stored and ALIGNED in stored[group].variables]
    found = [(stored[group], title) for group, title in there]
    return found if len(found) > 1 else [(found[0][0], "")]


def draw(axes: Axes, rows: Group) -> None:
    """One series."""
    for name, look in ERRORS:
        values = np.maximum(np.abs(rows[name]), LEAST)
        axes.plot(
            rows[WALL],
            values,
            color=look.colour,
            linestyle=look.style,
            linewidth=look.width,
            marker=look.marker,
            markersize=4,
        )
        if name != NUMERICAL:
            axes.plot(rows[WALL][:1], values[:1], "o", markersize=9, color=BLACK, fillstyle="none")
    axes.set_xscale("log")
    axes.set_yscale("log")


def caption(results: Results) -> str:
    """What the config's contact and the most rigid one amount to."""
    found = series(results)
    rows = found[0][0]
    point = "" if len(found) == 1 else f", and by {found[1][0][ALIGNED][-1]:.2g} rad with point feet besides"
    paper = f" The paper claims about {ANGLE_ERROR.text}." if redoes_the_paper(results) else ""
    return (
        f"Largest difference from the rigid walk as stiffness, damping and stiction velocity are led to the rigid "
        f"limit together: in phase, between impacts, angles differ by {rows[ALIGNED][0]:.2g} rad with the config's "
        f"contact, by {rows[ALIGNED][-1]:.2g} rad with the most rigid one{point}.{paper}"
    )


SEEN = "Error against run time on logarithmic axes, for feet as they are and, where they are small balls, for points."
FIGURE = paper_figure(12, "What the rigid limit takes", LIMIT, caption, plot, SEEN)
