"""Figure 8: how far the models differ in time, at the same time and at the same phase of each step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from walkerlab.figures.canvas import legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.in_time import line, line_entry, strike_entry, time_axes
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, GREY, RIGID, VERMILLION, Look
from walkerlab.figures.walks import (
    COMPARE_STAGE,
    NO_STATES,
    RIGID_STAGE,
    STEPS_TAKEN_RIGID,
    Array,
    Walk,
    redoes_the_paper,
    shown,
    walk_of,
)
from walkerlab.paper.printed import ANGLE_ERROR, VELOCITY_ERROR, Printed

AT_SAME_TIME: Final = Look("difference at the same time", VERMILLION, (0.0, (3.2, 1.4)), 1.2, "", order=3)
IN_PHASE: Final = Look("at the same phase of a step", BLACK, "-", 1.2, "", order=4)
PAPER: Final = Look("largest error in the paper", GREY, ":", 1.6, "", order=2)
LOOKS = (AT_SAME_TIME, IN_PHASE, PAPER)

ROOM = 3.0
"""Factor between what is shown of errors and the axis's ends."""
ZERO_CROSSING = 1e-3
"""Part of the largest error below which nothing is shown: where a difference changes its sign it is nothing."""


@dataclass(frozen=True)
class Quantity:
    """What of the legs is compared: variables of the stored errors, and the paper's number."""

    letter: str
    name: str
    unit: str
    raw: str
    aligned: str
    printed: Printed


QUANTITIES = (
    Quantity("a", "angle", "rad", "raw_angle_error_rad", "aligned_angle_error_rad", ANGLE_ERROR),
    Quantity(
        "b", "angular velocity", "rad/s", "raw_velocity_error_rad_s", "aligned_velocity_error_rad_s", VELOCITY_ERROR
    ),
)
RAW, ALIGNED = "errors", "aligned"
RAW_ERRORS = Need(COMPARE_STAGE, RAW, ("time", *(quantity.raw for quantity in QUANTITIES)), NO_STATES)
ALIGNED_ERRORS = Need(
    COMPARE_STAGE,
    ALIGNED,
    ("phase", *(quantity.aligned for quantity in QUANTITIES)),
    "no step was completed by both models",
)


def plot(results: Results) -> Figure:
    """A row for each leg's angle and each leg's angular velocity, on logarithmic scales."""
    rigid = rigid_walk(results)
    figure, axes = time_axes(4, 1.55, [rigid])
    rows = [(quantity, leg) for quantity in QUANTITIES for leg in (0, 1)]
    for one, (quantity, leg) in zip(axes, rows, strict=True):
        draw_errors(one, results, rigid, quantity, leg)
    looks = [look for look in LOOKS if look is not PAPER or redoes_the_paper(results)]
    legend_above(figure, [*map(line_entry, looks), strike_entry(rigid.look)])
    return figure


def draw_errors(axes: Axes, results: Results, rigid: Walk, quantity: Quantity, leg: int) -> None:
    """One quantity's errors of one leg, with the largest error that the paper reports."""
    raw, aligned = results[COMPARE_STAGE][RAW], results[COMPARE_STAGE][ALIGNED]
    early = raw["time"] <= rigid.time[-1]
    raw_error = np.abs(raw[quantity.raw][early, leg])
    steps = min(rigid.strikes.size, aligned[quantity.aligned].shape[0])
    aligned_error = np.abs(aligned[quantity.aligned][:steps, :, leg])
    line(axes, raw["time"][early], raw_error, AT_SAME_TIME)
    for time, error in zip(times_of(rigid, aligned["phase"]), aligned_error, strict=False):
        line(axes, time, error, IN_PHASE)
    least, most = ends_of(max(float(raw_error.max()), float(aligned_error.max())), quantity, results)
    if redoes_the_paper(results):
        axes.axhline(quantity.printed.value, color=PAPER.colour, linestyle=PAPER.style, linewidth=PAPER.width)
    axes.set_yscale("log", subs=[])
    axes.set_ylim(least, most)
    axes.set_ylabel(f"error ({quantity.unit})")
    axes.set_title(f"({quantity.letter}{leg + 1}) {quantity.name} of leg {leg + 1}")


def ends_of(largest: float, quantity: Quantity, results: Results) -> tuple[float, float]:
    """What of an axis is shown: down to the zero crossings, and the paper's number if it is drawn."""
    if not redoes_the_paper(results):
        return ZERO_CROSSING * largest, ROOM * largest
    paper = quantity.printed.value
    return min(paper / ROOM, ZERO_CROSSING * largest), ROOM * max(largest, paper)


def times_of(walk: Walk, phases: Array) -> Array:
    """Times (steps, phases) at which a walk is at the phases of its steps (s)."""
    begins = np.concatenate(([0.0], walk.strikes[:-1]))
    return np.asarray(begins[:, None] + np.outer(walk.strikes - begins, phases))


def rigid_walk(results: Results) -> Walk:
    """The walk over whose steps the errors are shown."""
    walks, _ = shown([walk_of(results[RIGID_STAGE], RIGID, ("time",))])
    return walks[0]


def caption(results: Results) -> str:
    """The largest errors of all that was compared, in both ways."""
    parts = []
    for quantity in QUANTITIES:
        raw = np.abs(results[COMPARE_STAGE][RAW][quantity.raw]).max()
        aligned = np.abs(results[COMPARE_STAGE][ALIGNED][quantity.aligned]).max()
        unit = quantity.unit
        parts.append(f"{quantity.name} {raw:.2g} {unit} at the same time, {aligned:.2g} {unit} in phase")
    paper = f" The paper's largest is about {ANGLE_ERROR.text}." if redoes_the_paper(results) else ""
    return f"Difference of the contact model from the rigid one; largest: {'; '.join(parts)}.{paper}"


FIGURE = paper_figure(
    8,
    "Difference between the models",
    (RAW_ERRORS, ALIGNED_ERRORS, STEPS_TAKEN_RIGID),
    caption,
    plot,
    "Four plots over time on logarithmic axes, one for each leg's angle and velocity: the difference at the same time "
    "and that at the same phase.",
)
