"""Figure 15: basins of attraction: where starts of a plane come to, and in how many steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, PURPLE, VERMILLION
from walkerlab.hybrid.outcome import Outcome
from walkerlab.store.content import Group

STAGE: Final = "basin"
NEED = Need(STAGE, "basin", ("outcome", "attractor", "steps_to_settle", "walking"), "no start was walked")
LABELS: Final = {
    "theta_2": "angle of the stance leg (rad)",
    "dtheta_1": "velocity of the swing leg (rad/s)",
    "dtheta_2": "velocity of the stance leg (rad/s)",
}
ATTRACTORS: Final = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION)
UNSETTLED: Final = "#56B4E9"
WHITE: Final = "#FFFFFF"
FAILURES: Final = {Outcome.FELL: PALE, Outcome.NO_HEEL_STRIKE: GREY}
OTHER_FAILURE: Final = "#C8C8C8"
NO_ATTRACTOR: Final = -1


def plot(results: Results) -> Figure:
    """Attractors and failures by colour on the left, steps to settle by brightness on the right."""
    cells = results[STAGE]["basin"]
    across, up = plane_of(results)[:2]
    figure = blank(3.9)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    patches = draw_fates(left, cells, (across, up), results[STAGE].summary)
    left.set_title("(a) where walks end")
    settled = np.ma.masked_where(slice_of(cells["attractor"]) == NO_ATTRACTOR, slice_of(cells["steps_to_settle"]))
    right.set_title("(b) steps to the attractor")
    if settled.count():
        least = float(settled.min())
        scale = LogNorm(least, max(float(settled.max()), least + 1.0))
        bar = figure.colorbar(draw(right, cells, (across, up), settled, cmap="viridis_r", norm=scale), ax=right)
        bar.set_label("steps")
        bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        bar.ax.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if value < 1.5 * least else ""))
    else:
        right.text(0.5, 0.9, "no walk settles on a gait", transform=right.transAxes, ha="center")
    marks = [mark_gait(axes, cells, (across, up)) for axes in (left, right)]
    left.set_ylabel(LABELS[up])
    for axes in (left, right):
        axes.set_xlabel(LABELS[across])
    legend_above(figure, [*patches, marks[0]])
    return figure


def plane_of(results: Results) -> list[str]:
    """The coordinates of the grid."""
    return [str(name) for name in results[STAGE].summary["plane"]]


def slice_of(values: NDArray[Any]) -> NDArray[Any]:
    """The plane itself, or of a grid over three coordinates the middle."""
    return values if values.ndim == 2 else values[:, :, values.shape[2] // 2]


def draw(axes: Axes, cells: Group, plane: tuple[str, str], values: NDArray[Any], **how: Any) -> Any:
    """Values of cells, the first coordinate across."""
    sides = [side for name in plane for side in sides_of(cells[name])]
    return axes.imshow(values.T, extent=sides, origin="lower", aspect="auto", interpolation="nearest", **how)


def sides_of(middles: NDArray[np.float64]) -> tuple[float, float]:
    """Where a row of cells with these middles begins and ends."""
    half = 0.5 * float(middles[1] - middles[0])
    return float(middles[0]) - half, float(middles[-1]) + half


def draw_fates(axes: Axes, cells: Group, plane: tuple[str, str], summary: Mapping[str, Any]) -> list[Artist]:
    """Each cell in the colour of its attractor or failure; returns the key to those that occur."""
    attractors = summary["attractors"]
    outcome, attractor = slice_of(cells["outcome"]), slice_of(cells["attractor"])
    kinds: list[tuple[str, str, NDArray[np.bool_]]] = [
        (ATTRACTORS[number % len(ATTRACTORS)], attractor_name(number, attractors), attractor == number)
        for number in range(len(attractors))
    ]
    walked = outcome == Outcome.WALKED
    kinds.append(
        (
            UNSETTLED,
            "never repeats itself" if summary["aperiodic"] else "walks, not settled",
            walked & (attractor == NO_ATTRACTOR),
        )
    )
    kinds += [
        (FAILURES.get(one, OTHER_FAILURE), one.label, outcome == one) for one in Outcome if one is not Outcome.WALKED
    ]
    kinds = [kind for kind in kinds if kind[2].any()]
    numbers = np.zeros(outcome.shape)
    for number, (_, _, where) in enumerate(kinds):
        numbers[where] = number
    colours = ListedColormap([colour for colour, _, _ in kinds])
    draw(axes, cells, plane, numbers, cmap=colours, norm=BoundaryNorm(np.arange(len(kinds) + 1) - 0.5, len(kinds)))
    return [Patch(facecolor=colour, edgecolor=GREY, linewidth=0.3, label=label) for colour, label, _ in kinds]


def attractor_name(number: int, attractors: list[dict[str, Any]]) -> str:
    """An attractor by its period, and a letter where several have the same."""
    period = attractors[number]["period"]
    same = [other for other, row in enumerate(attractors) if row["period"] == period]
    letter = f" ({'abcdefghijklmnopqrstuvwxyz'[same.index(number) % 26]})" if len(same) > 1 else ""
    return f"gait of {period} step{'' if period == 1 else 's'}{letter}"


def mark_gait(axes: Axes, cells: Group, plane: tuple[str, str]) -> Line2D:
    """The gait of one step through which the plane is laid."""
    place = [float(cells.attrs[f"at_{name}"]) for name in plane]
    (mark,) = axes.plot(
        [place[0]], [place[1]], linestyle="", marker="o", markersize=4.5, color=BLACK, markerfacecolor=WHITE,
        label="rigid gait of one step",
    )  # fmt: skip
    axes.set_xlim(*sides_of(cells[plane[0]]))
    axes.set_ylim(*sides_of(cells[plane[1]]))
    return mark


def caption(results: Results) -> str:
    """What is walked, and how much of the window walks."""
    summary = results[STAGE].summary
    cells = " x ".join(f"{number:,}" for number in summary["cells"])
    held = ", ".join(f"{name} = {value:.4g} rad/s" if name != "theta_2" else f"{name} = {value:.4g} rad"
                     for name, value in summary["held"].items())  # fmt: skip
    said = [
        f"Walks of the {summary['model']} model from {cells} starts just after heel strike"
        f"{f', {held}' if held else ', of which the middle plane is shown'}: "
        f"{100.0 * summary['share_walking']:.3g} % of the window walk, and "
        f"{100.0 * summary['share_walking_gaussian']:.3g} % of a normal distribution whose three standard deviations "
        "fill it."
    ]
    said += [
        f"The {attractor_name(number, summary['attractors'])} is reached from {row['cells']:,} cells, after "
        f"{row['median_steps_to_settle']:.3g} steps in the median."
        for number, row in enumerate(summary["attractors"])
        if row["cells"]
    ]
    if summary["unsettled_cells"]:
        said.append(
            f"{summary['unsettled_cells']:,} cells still walk, unsettled, after {summary['steps_wanted']} steps."
        )
    return " ".join(said)


FIGURE = paper_figure(15, "Basins of attraction", (NEED,), caption, plot)
