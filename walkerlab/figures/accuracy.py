"""Error against run time and against right-hand sides of every method, a figure for each scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import Illustration
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, PURPLE, VERMILLION, Look

HEIGHT = 3.9  # in
DASHED, DOTTED = (0.0, (3.2, 1.4)), (0.0, (1.0, 1.2))
LOOKS = {
    "dop853": Look("dop853", BLUE, "-", 1.8, "o", order=5),
    "radau5": Look("radau5", VERMILLION, "-", 1.8, "s", order=5),
    "scipy-rk45": Look("scipy-rk45", GREEN, DASHED, 1.0, "v"),
    "scipy-dop853": Look("scipy-dop853", BLUE, DASHED, 1.0, "o"),
    "scipy-lsoda": Look("scipy-lsoda", ORANGE, DASHED, 1.0, "^"),
    "scipy-radau": Look("scipy-radau", VERMILLION, DASHED, 1.0, "s"),
    "scipy-bdf": Look("scipy-bdf", PURPLE, DASHED, 1.0, "D"),
    "cvode-bdf": Look("cvode-bdf", PURPLE, DOTTED, 1.0, "d"),
    "cvode-adams": Look("cvode-adams", GREEN, DOTTED, 1.0, "<"),
    "scipy-dop853-numpy": Look("scipy-dop853-numpy", GREY, DOTTED, 1.2, "P"),
}
OTHERS = Look("", BLACK, DOTTED, 1.0, "*")
VARIABLES = ("method", "tolerance", "reached", "error", "wall_s", "rhs_evaluations", "outcome")
SMALLEST = 1e-17  # below any floor
FAILED = 30.0  # where failures are drawn, in terms of the largest error


@dataclass(frozen=True)
class MethodSeries:
    """One method's runs on a scene, from loose to tight tolerance."""

    look: Look
    error: NDArray[np.float64]
    reached: NDArray[np.bool_]
    wall_s: NDArray[np.float64]
    rhs: NDArray[np.float64]
    outcome: tuple[str, ...]
    tolerance: NDArray[np.float64]


def series_of(scene: str, results: Results) -> Iterator[MethodSeries]:
    """The methods in the order in which they were measured."""
    rows = results["accuracy"].groups[f"{scene}/rows"]
    methods = [str(method) for method in rows["method"]]
    for name in dict.fromkeys(methods):
        mine = np.array([method == name for method in methods])
        look = LOOKS.get(name, Look(name, OTHERS.colour, OTHERS.style, OTHERS.width, OTHERS.marker))
        yield MethodSeries(
            look,
            np.asarray(rows["error"])[mine],
            np.asarray(rows["reached"])[mine] != 0,
            np.asarray(rows["wall_s"])[mine],
            np.asarray(rows["rhs_evaluations"])[mine].astype(float),
            tuple(str(outcome) for outcome, here in zip(rows["outcome"], mine, strict=True) if here),
            np.asarray(rows["tolerance"])[mine],
        )


def agreement(scene: str, results: Results) -> float:
    """How far the reference is from a second one: errors below mean nothing."""
    return float(results["accuracy"].summary["reference"][scene]["agreement"])


def plot(scene: str, results: Results) -> Figure:
    """Run time on the left, right-hand sides on the right, one line for each method."""
    every = list(series_of(scene, results))
    floor = max(agreement(scene, results), SMALLEST)
    failed = FAILED * max([floor, *(float(one.error[one.reached].max()) for one in every if one.reached.any())])
    figure = blank(HEIGHT)
    left, right = figure.subplots(1, 2, sharey=True)
    panels: tuple[tuple[Axes, str, Callable[[MethodSeries], NDArray[Any]]], ...] = (
        (left, "run time (s)", lambda one: one.wall_s),
        (right, "right-hand sides (1)", lambda one: one.rhs),
    )
    for axes, label, cost in panels:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.axhspan(SMALLEST, floor, color=PALE, zorder=0)
        for one in every:
            draw(axes, one, cost(one), floor, failed)
        axes.set_xlabel(label)
        axes.yaxis.set_major_locator(LogLocator(numticks=20))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set_ylim(0.3 * floor, 4.0 * failed)
    left.set_ylabel("error of the end state (SI)")
    left.set_title("(a) against run time")
    right.set_title("(b) against right-hand sides")
    legend_above(figure, entries(every, floor))
    return figure


def draw(axes: Axes, one: MethodSeries, cost: NDArray[Any], floor: float, failed: float) -> None:
    """The runs that reached the end as a line, the others as crosses above everything."""
    look, there = one.look, one.reached
    shown = np.maximum(one.error[there], floor)
    filled = look.colour if look.style == "-" else "none"
    axes.plot(
        cost[there],
        shown,
        color=look.colour,
        linestyle=look.style,
        linewidth=look.width,
        marker=look.marker,
        markersize=4.0,
        markerfacecolor=filled,
        zorder=look.order,
    )
    axes.plot(
        cost[~there],
        np.full(int((~there).sum()), failed),
        color=look.colour,
        linestyle="none",
        marker="x",
        markersize=5.0,
        zorder=look.order,
    )


def entries(every: list[MethodSeries], floor: float) -> list[Line2D]:
    """The legend: methods, failures, and what is below the reference's own uncertainty."""
    methods = [
        Line2D(
            [],
            [],
            color=one.look.colour,
            linestyle=one.look.style,
            linewidth=one.look.width,
            marker=one.look.marker,
            markersize=4.0,
            markerfacecolor=one.look.colour if one.look.style == "-" else "none",
            label=one.look.label,
        )
        for one in every
    ]
    cross = Line2D([], [], color=BLACK, linestyle="none", marker="x", markersize=5.0, label="end not reached")
    known = Line2D([], [], color=PALE, linewidth=6.0, label=f"reference unsure, {floor:.0e}")
    crosses = [] if all(one.reached.all() for one in every) else [cross]
    return [*methods, *crosses, known]


def caption(scene: str, results: Results) -> str:
    """The conclusion, the reference, and what did not reach the end."""
    summary = results["accuracy"].summary
    reference = summary["reference"][scene]
    failures = [
        f"{one.look.label} at {tolerance:.0e} ({outcome})"
        for one in series_of(scene, results)
        for tolerance, outcome, reached in zip(one.tolerance, one.outcome, one.reached, strict=True)
        if not reached
    ]
    itself = any(one.look.label == reference["method"] for one in series_of(scene, results))
    own = f" {reference['method']} itself is measured by {reference['second_method']}." if itself else ""
    missed = f" The end was not reached by {', '.join(failures)}." if failures else ""
    return (
        f"Largest error of the end state, tolerance by tolerance, warm, medians. {summary['conclusions'][scene]} "
        f"The reference is {reference['method']}, from which {reference['second_method']} differs by "
        f"{reference['agreement']:.1e}; smaller errors are drawn there.{own}{missed}"
    )


SEEN = (
    "Two plots of error on logarithmic axes, against run time and against evaluations of the right-hand side: "
    "a falling line for each method."
)


def figure_for(scene: str, title: str) -> Illustration:
    """The figure of one scene."""
    need = Need("accuracy", f"{scene}/rows", VARIABLES, f"it did not measure the scene {scene}")
    return Illustration(f"accuracy-{scene}", title, (need,), partial(caption, scene), partial(plot, scene), seen=SEEN)


FIGURES = (
    figure_for("rigid", "Error against run time: the rigid model"),
    figure_for("contact", "Error against run time: the contact model"),
    figure_for("contact-near-rigid", "Error against run time: contact near the rigid limit"),
)
