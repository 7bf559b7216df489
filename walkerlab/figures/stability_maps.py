"""Where a method can be trusted: the default one over stiffness and stiction velocity, a fixed step over stiffness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.figure_11 import COLOURS, WHITE
from walkerlab.figures.illustration import Illustration
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, GREY, ORANGE, PALE, VERMILLION
from walkerlab.hybrid.outcome import Outcome
from walkerlab.store.content import Group

STAGE: Final = "stability-maps"
STIFFNESS, VELOCITY, STEP = "stiffness", "stiction_velocity", "step_size"
PAPER: Final = {STIFFNESS: 1.0e5 * 1000.0**2.2, VELOCITY: 0.1}  # Table 2
HEIGHT: Final = 3.9  # in
STIFFNESS_LABEL: Final = "stiffness (N/m$^{2.2}$)"
ERROR_LABEL: Final = "error (1)"
SHARP, ROUGH = (1e-10, 1.0), (1e-6, 1.0)  # errors told apart by colour
VERDICT_COLOURS: Final = {
    "fine": "#56B4E9",
    "wrong silently": VERMILLION,
    "diverges": BLACK,
    "gives up": ORANGE,
    "no reference": PALE,
}
UNANSWERED: Final = (int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED))


def edges(centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bounds of cells whose middles are evenly spaced powers."""
    logs = np.log10(centres)
    half = 0.5 * (logs[1] - logs[0])
    return np.asarray(10.0 ** np.append(logs - half, logs[-1] + half))


def plot_stiction(results: Results) -> Figure:
    """Outcome on the left, error on the right."""
    cells = results[STAGE]["stiction"]
    figure = blank(HEIGHT)
    left, right = panels(figure, cells, VELOCITY, "stiction velocity (m/s)")
    outcomes = cells["outcome"]
    colour_cells(left, cells, VELOCITY, outcomes, [COLOURS[one] for one in Outcome])
    left.set_title("(a) how the walk ends")
    unanswered = np.isin(outcomes, UNANSWERED)
    otherwise = (cells["compared"] == 0) & ~unanswered
    colour_errors(figure, right, cells, VELOCITY, cells["compared"] == 1, SHARP)
    right.set_title("(b) against a tenfold tolerance")
    for mask, colour in ((unanswered, BLACK), (otherwise, VERMILLION)):
        overlay(right, cells, VELOCITY, mask, colour)
    for axes in (left, right):
        axes.plot(PAPER[STIFFNESS], PAPER[VELOCITY], marker="o", color=BLACK, markerfacecolor=WHITE, markersize=5.0)
    seen = [Outcome(int(number)) for number in np.unique(outcomes)]
    patches: list[Artist] = [Patch(facecolor=COLOURS[one], label=one.label) for one in seen]
    if otherwise.any():
        patches.append(Patch(facecolor=VERMILLION, label="(b) ends otherwise"))
    mark = Line2D([], [], linestyle="none", marker="o", color=BLACK, markerfacecolor=WHITE, label="paper")
    legend_above(figure, [*patches, mark])
    return figure


def plot_step(results: Results) -> Figure:
    """Verdict on the left, error on the right."""
    cells = results[STAGE]["step"]
    names = verdicts_of(cells)
    figure = blank(HEIGHT)
    left, right = panels(figure, cells, STEP, "step size (s)")
    colour_cells(left, cells, STEP, cells["verdict"], [VERDICT_COLOURS[name] for name in names])
    left.set_title("(a) what becomes of the walk")
    there = np.isin(cells["verdict"], [names.index("fine"), names.index("wrong silently")])
    colour_errors(figure, right, cells, STEP, there, ROUGH)
    right.set_title("(b) error of the state at the end")
    for name in ("diverges", "gives up", "no reference"):
        overlay(right, cells, STEP, cells["verdict"] == names.index(name), VERDICT_COLOURS[name])
    for axes in (left, right):
        axes.axvline(PAPER[STIFFNESS], color=GREY, linewidth=0.8)
    seen = [names[int(number)] for number in np.unique(cells["verdict"])]
    patches: list[Artist] = [Patch(facecolor=VERDICT_COLOURS[name], label=name) for name in seen]
    legend_above(figure, [*patches, Line2D([], [], color=GREY, linewidth=0.8, label="the paper's stiffness")])
    return figure


def verdicts_of(cells: Group) -> list[str]:
    """The verdicts' names by their numbers."""
    return [entry.partition(" ")[2] for entry in str(cells.attrs["verdicts"]).split(", ")]


def panels(figure: Figure, cells: Group, up: str, label: str) -> tuple[Axes, Axes]:
    """Two panels over stiffness."""
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(*edges(cells[STIFFNESS])[[0, -1]])
        axes.set_ylim(*edges(cells[up])[[0, -1]])
        axes.set_xlabel(STIFFNESS_LABEL)
        axes.xaxis.set_major_locator(LogLocator(numticks=7))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_locator(NullLocator())
    left.set_ylabel(label)
    return left, right


def colour_cells(axes: Axes, cells: Group, up: str, numbers: NDArray[Any], colours: Sequence[str]) -> None:
    """Each cell in the colour of its number."""
    norm = BoundaryNorm(np.arange(len(colours) + 1) - 0.5, len(colours))
    axes.pcolormesh(
        edges(cells[STIFFNESS]), edges(cells[up]), numbers, cmap=ListedColormap(colours), norm=norm, rasterized=True
    )


def colour_errors(
    figure: Figure, axes: Axes, cells: Group, up: str, there: NDArray[np.bool_], ends: tuple[float, float]
) -> None:
    """Errors by brightness, where there are any, with their scale."""
    shown = np.ma.masked_where(~there, np.clip(cells["error"], *ends))
    mesh = axes.pcolormesh(
        edges(cells[STIFFNESS]), edges(cells[up]), shown, cmap="cividis", norm=LogNorm(*ends),
        rasterized=True,
    )  # fmt: skip
    figure.colorbar(mesh, ax=axes, label=ERROR_LABEL, extend="both")


def overlay(axes: Axes, cells: Group, up: str, mask: NDArray[np.bool_], colour: str) -> None:
    """Some cells in one colour."""
    if mask.any():
        shown = np.ma.masked_where(~mask, np.ones(mask.shape))
        axes.pcolormesh(
            edges(cells[STIFFNESS]), edges(cells[up]), shown, cmap=ListedColormap([colour]), rasterized=True
        )


def caption_stiction(results: Results) -> str:
    """What is walked, and how many cells come out how."""
    summary, cells = results[STAGE].summary, results[STAGE]["stiction"]
    compared = summary["median_error"] is not None
    otherwise = summary["ends_otherwise_sharper"]
    sizes = f"{summary['median_error']:.0e} in the median, {summary['largest_error']:.0e} at most; " if compared else ""
    return (
        f"{cells.attrs['steps_wanted']} steps of the paper's walk by the default method, at most "
        f"{cells.attrs['budget']:,} right-hand sides, over the ground's stiffness and the stiction velocity (friction "
        f"velocity ten times that), all else the paper's: {counted(summary['outcomes'])}. (b) Difference of touches "
        f"and end from a run at a tenfold tolerance, in legs, radians and pendulum times: {sizes}{otherwise} cells end "
        "otherwise there."
    )


def caption_step(results: Results) -> str:
    """What is walked, and how many cells come out how."""
    summary, cells = results[STAGE].summary, results[STAGE]["step"]
    return (
        f"{cells.attrs['steps_wanted']} steps of the paper's walk by semi-implicit Euler, as game engines integrate, "
        "over the ground's stiffness and the step, all else the paper's, against our implicit method at a sharp "
        f"tolerance: {counted(summary['fixed_step'])}. Fine is an error of the state at the end below "
        f"{cells.attrs['fine']:g} legs, radians and pendulum times; black cells run away."
    )


def counted(cells: Mapping[str, int]) -> str:
    """Cells by name."""
    return ", ".join(f"{name} {many}" for name, many in cells.items()) + " cells"


NEVER = "it has no such map"
FIGURES = (
    Illustration(
        "stability-stiction",
        "Stability over stiffness and stiction velocity",
        (Need(STAGE, "stiction", (STIFFNESS, VELOCITY, "outcome", "sharper_outcome", "compared", "error"), NEVER),),
        caption_stiction,
        plot_stiction,
        seen="A map of small squares, coloured by how each walk ended, and one of its error.",
    ),
    Illustration(
        "stability-step",
        "Stability over stiffness and step size",
        (Need(STAGE, "step", (STIFFNESS, STEP, "verdict", "error"), NEVER),),
        caption_step,
        plot_step,
        seen="A map of small squares, coloured by what became of each walk with a fixed step, and one of its error.",
    ),
)
