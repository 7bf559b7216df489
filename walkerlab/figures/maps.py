"""Maps of cells: figure 11 starts that walk, 15 basins of attraction, and where methods can be trusted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from walkerlab.config.contact import Contact
from walkerlab.figures.canvas import blank, entry, legend_above
from walkerlab.figures.illustration import Illustration, Need, Results, paper_figure
from walkerlab.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, PURPLE, VERMILLION
from walkerlab.figures.walk_figures import TUNE_STAGE, redoes_the_procedure
from walkerlab.figures.walks import redoes_the_paper
from walkerlab.hybrid.outcome import Outcome
from walkerlab.labels import with_unit
from walkerlab.store.content import Group

WHITE: Final = "#FFFFFF"
SKY: Final = "#56B4E9"
LOG_SPAN: Final = 50.0
"""Ratio of largest to least value from which on an axis of evenly spaced powers is drawn as such."""
Kind = tuple[str, str, NDArray[np.bool_]]
"""Cells of a kind: their colour, what they are, and which they are."""


def discrete(colours: Sequence[str]) -> dict[str, Any]:
    """What matplotlib is told to give each number, from 0 on, its colour."""
    return {
        "cmap": ListedColormap(list(colours)),
        "norm": BoundaryNorm(np.arange(len(colours) + 1) - 0.5, len(colours)),
    }


def draw_kinds(draw: Callable[..., Any], kinds: Sequence[Kind]) -> list[Artist]:
    """Each cell in the colour of its kind, by a function that draws numbers; returns the key."""
    draw(np.argmax(np.array([where for _, _, where in kinds]), axis=0), **discrete([colour for colour, *_ in kinds]))
    return [Patch(facecolor=colour, edgecolor=GREY, linewidth=0.3, label=label) for colour, label, _ in kinds]


def edges(centres: NDArray[Any]) -> NDArray[Any]:
    """Bounds of cells about values, halfway between neighbours, on their own scale."""
    scale = np.log(centres) if is_logarithmic(centres) else centres
    if scale.size == 1:
        found = np.array([scale[0] - 0.5, scale[0] + 0.5])
    else:
        middle = 0.5 * (scale[1:] + scale[:-1])
        found = np.concatenate([[2 * scale[0] - middle[0]], middle, [2 * scale[-1] - middle[-1]]])
    return np.exp(found) if is_logarithmic(centres) else found


def is_logarithmic(values: NDArray[Any]) -> bool:
    """Whether values are evenly spaced powers over a wide range."""
    if values.size < 3 or values.min() <= 0.0 or values.max() / values.min() < LOG_SPAN:
        return False
    gaps = np.diff(np.log(np.sort(values)))
    return bool(gaps.max() < 1.01 * gaps.min())


def axis_of(cells: Group, name: str) -> str:
    """A coordinate of the cells on an axis."""
    variable = cells.variables[name]
    return with_unit(variable.long_name, variable.units.replace("^2.2", "$^{2.2}$"))


SWING, STANCE = "swing_factor", "stance_factor"
MAP = Need(
    TUNE_STAGE, "map", (SWING, STANCE, "outcome", "steps", "rigid_outcome", "rigid_steps"), "no start was walked"
)

COLOURS: Final = {
    Outcome.WALKED: SKY,
    Outcome.FELL: VERMILLION,
    Outcome.OFF_PAD: ORANGE,
    Outcome.LIFTED_OFF: PURPLE,
    Outcome.SLID: GREEN,
    Outcome.NO_HEEL_STRIKE: GREY,
    Outcome.BUDGET_EXHAUSTED: BLACK,
    Outcome.SOLVER_FAILED: BLACK,
    Outcome.REJECTED: PALE,
    Outcome.BENT_KNEE: BLUE,
}
MARKS: Final = (
    ("rigid start", "o", (1.0, 1.0)),
    ("adjusted start", "D", ("adjusted_swing_factor", "adjusted_stance_factor")),
    ("contact gait", "X", ("gait_swing_factor", "gait_stance_factor")),
)
MODELS: Final = (("outcome", "steps", "(a) contact model"), ("rigid_outcome", "rigid_steps", "(b) rigid model"))
STEP_LEVELS: Final = (0.5, 1.5, 2.5, 4.5)


def plot_starts(results: Results) -> Figure:
    """Both models' maps on the same axes, outcome as colour, lines where more steps are walked."""
    cells = results[TUNE_STAGE]["map"]
    figure = blank(3.9)
    both = figure.subplots(1, 2, sharex=True, sharey=True)
    seen: set[Outcome] = set()
    swing, stance = ("link 1", "link 2") if redoes_the_procedure(results) else ("the swing leg", "the stance leg")
    for axes, (outcome, steps, title) in zip(both, MODELS, strict=True):
        seen |= draw_starts(axes, cells, outcome, steps)
        axes.set(title=title, xlabel=f"factor on the velocity of {swing}")
    both[0].set_ylabel(f"factor on the velocity of {stance}")
    marks = [mark for axes in both for mark in draw_marks(axes, cells)]
    unique = {str(mark.get_label()): mark for mark in marks}
    patches: list[Artist] = [Patch(facecolor=COLOURS[one], edgecolor="none", label=one.label) for one in sorted(seen)]
    legend_above(figure, [*patches, *unique.values()])
    return figure


def draw_starts(axes: Axes, cells: Group, outcome: str, steps: str) -> set[Outcome]:
    """One model's cells; returns the outcomes that occur."""
    colours = discrete([COLOURS[one] for one in Outcome])
    axes.pcolormesh(cells[SWING], cells[STANCE], cells[outcome], **colours, rasterized=True)
    most = int(cells[steps].max())
    levels = [level for level in STEP_LEVELS if level < most]
    if levels and cells[steps].min() < levels[-1]:
        axes.contour(cells[SWING], cells[STANCE], cells[steps], levels, colors=BLACK, linewidths=0.4)
    return {Outcome(int(number)) for number in np.unique(cells[outcome])}


def draw_marks(axes: Axes, cells: Group) -> list[Line2D]:
    """The rigid start, the adjusted start and the contact gait, where they lie on the map."""
    drawn: list[Line2D] = []
    for label, marker, place in MARKS:
        where: list[Any] = [cells.attrs.get(one) if isinstance(one, str) else one for one in place]
        if None in where:
            continue
        size, face = (9, "none") if marker == "D" else (6, WHITE)
        drawn += axes.plot(
            [where[0]], [where[1]], linestyle="", marker=marker, markersize=size, color=BLACK, markerfacecolor=face,
            label=label, zorder=5,
        )  # fmt: skip
    axes.set(xlim=cells[SWING][[0, -1]], ylim=cells[STANCE][[0, -1]])
    return drawn


def tell_starts(results: Results) -> tuple[Any, ...]:
    """How many starts walk, and the factors at which the paper's own would lie; none of these for another scene."""
    result = results[TUNE_STAGE]
    coordinates = ("dtheta_1", "dtheta_2") if redoes_the_paper(results) else ()
    rows = [result.summary["table2"][name] for name in coordinates]
    paper = [abs(row["paper_adams"] / row["ours_rigid"]) for row in rows]
    return result.summary["map"], result["map"].attrs["steps_wanted"], paper


FIGURE_11 = paper_figure(11, (MAP,), plot_starts, tell_starts)

BASIN: Final = "basin"
CELLS = Need(BASIN, "basin", ("outcome", "attractor", "steps_to_settle", "walking"), "no start was walked")
ATTRACTORS: Final = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION)
FAILURES: Final = {Outcome.FELL: PALE, Outcome.NO_HEEL_STRIKE: GREY}
OTHER_FAILURE: Final = "#C8C8C8"
NO_ATTRACTOR: Final = -1


def plot_basins(results: Results) -> Figure:
    """Attractors and failures by colour on the left, steps to settle by brightness on the right."""
    cells = results[BASIN]["basin"]
    across, up = (str(name) for name in results[BASIN].summary["plane"][:2])
    figure = blank(3.9)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    patches = draw_kinds(partial(draw_plane, left, cells, (across, up)), kinds_of_fates(cells, results[BASIN].summary))
    left.set_title("(a) where walks end")
    settled = np.ma.masked_where(slice_of(cells["attractor"]) == NO_ATTRACTOR, slice_of(cells["steps_to_settle"]))
    right.set_title("(b) steps to the attractor")
    if settled.count():
        least = float(settled.min())
        scale = LogNorm(least, max(float(settled.max()), least + 1.0))
        bar = figure.colorbar(draw_plane(right, cells, (across, up), settled, cmap="viridis_r", norm=scale), ax=right)
        bar.set_label("steps")
        bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        bar.ax.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if value < 1.5 * least else ""))
    else:
        right.text(0.5, 0.9, "no walk settles on a gait", transform=right.transAxes, ha="center")
    marks = [mark_gait(axes, cells, (across, up)) for axes in (left, right)]
    left.set_ylabel(axis_of(cells, up))
    for axes in (left, right):
        axes.set_xlabel(axis_of(cells, across))
    legend_above(figure, [*patches, marks[0]])
    return figure


def slice_of(values: NDArray[Any]) -> NDArray[Any]:
    """The plane itself, or of a grid over three coordinates the middle."""
    return values if values.ndim == 2 else values[:, :, values.shape[2] // 2]


def draw_plane(axes: Axes, cells: Group, plane: tuple[str, str], values: NDArray[Any], **how: Any) -> Any:
    """Values of cells, the first coordinate across."""
    extent = (*sides_of(cells[plane[0]]), *sides_of(cells[plane[1]]))
    return axes.imshow(values.T, extent=extent, origin="lower", aspect="auto", interpolation="nearest", **how)


def sides_of(middles: NDArray[np.float64]) -> tuple[float, float]:
    """Where a row of cells with these middles begins and ends."""
    half = 0.5 * float(middles[1] - middles[0])
    return float(middles[0]) - half, float(middles[-1]) + half


def kinds_of_fates(cells: Group, summary: Mapping[str, Any]) -> list[Kind]:
    """The attractors and failures that occur."""
    attractors = summary["attractors"]
    outcome, attractor = slice_of(cells["outcome"]), slice_of(cells["attractor"])
    kinds: list[Kind] = [
        (ATTRACTORS[number % len(ATTRACTORS)], attractor_name(number, attractors), attractor == number)
        for number in range(len(attractors))
    ]
    said = "never repeats itself" if summary["aperiodic"] else "walks, not settled"
    kinds.append((SKY, said, (outcome == Outcome.WALKED) & (attractor == NO_ATTRACTOR)))
    failures = [one for one in Outcome if one is not Outcome.WALKED]
    kinds += [(FAILURES.get(one, OTHER_FAILURE), one.label, outcome == one) for one in failures]
    return [kind for kind in kinds if kind[2].any()]


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
    axes.set(xlim=sides_of(cells[plane[0]]), ylim=sides_of(cells[plane[1]]))
    return mark


def tell_basins(results: Results) -> tuple[Any, ...]:
    """What is walked, how much of the window walks, and to which attractors."""
    summary = results[BASIN].summary
    attractors = summary["attractors"]
    reached = [(attractor_name(number, attractors), row) for number, row in enumerate(attractors) if row["cells"]]
    return summary, reached


FIGURE_15 = paper_figure(15, (CELLS,), plot_basins, tell_basins)

MAPS: Final = "stability-maps"
STIFFNESS, VELOCITY, STEP = "stiffness", "stiction_velocity", "step_size"
_LAW: Final = Contact().in_si()
PAPER: Final = {STIFFNESS: _LAW.stiffness_N_per_m_e, VELOCITY: _LAW.stiction_velocity_m_s}
HEIGHT: Final = 3.9  # in
ERROR_LABEL: Final = "error (1)"
SHARP, ROUGH = (1e-10, 1.0), (1e-6, 1.0)  # errors told apart by colour
VERDICT_COLOURS: Final = {
    "fine": SKY,
    "wrong silently": VERMILLION,
    "diverges": BLACK,
    "gives up": ORANGE,
    "no reference": PALE,
}
UNANSWERED: Final = (int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED))


def plot_stiction(results: Results) -> Figure:
    """Outcome on the left, error on the right."""
    cells = results[MAPS]["stiction"]
    figure = blank(HEIGHT)
    left, right = panels(figure, cells, VELOCITY)
    outcomes = cells["outcome"]
    draw_over_stiffness(left, cells, VELOCITY, outcomes, **discrete([COLOURS[one] for one in Outcome]))
    left.set_title("(a) how the walk ends")
    unanswered = np.isin(outcomes, UNANSWERED)
    otherwise = (cells["compared"] == 0) & ~unanswered
    colour_errors(figure, right, cells, VELOCITY, cells["compared"] == 1, SHARP)
    right.set_title("(b) against a tolerance ten times tighter")
    for mask, colour in ((unanswered, BLACK), (otherwise, VERMILLION)):
        overlay(right, cells, VELOCITY, mask, colour)
    for axes in (left, right):
        axes.plot(PAPER[STIFFNESS], PAPER[VELOCITY], marker="o", color=BLACK, markerfacecolor=WHITE, markersize=5.0)
    seen = [Outcome(int(number)) for number in np.unique(outcomes)]
    patches: list[Artist] = [Patch(facecolor=COLOURS[one], label=one.label) for one in seen]
    if otherwise.any():
        patches.append(Patch(facecolor=VERMILLION, label="(b) ends otherwise"))
    mark = entry("paper", linestyle="none", marker="o", color=BLACK, markerfacecolor=WHITE)
    legend_above(figure, [*patches, mark])
    return figure


def plot_step(results: Results) -> Figure:
    """Verdict on the left, error on the right."""
    cells = results[MAPS]["step"]
    names = verdicts_of(cells)
    figure = blank(HEIGHT)
    left, right = panels(figure, cells, STEP)
    draw_over_stiffness(left, cells, STEP, cells["verdict"], **discrete([VERDICT_COLOURS[name] for name in names]))
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
    legend_above(figure, [*patches, entry("the paper's stiffness", color=GREY, linewidth=0.8)])
    return figure


def verdicts_of(cells: Group) -> list[str]:
    """The verdicts' names by their numbers."""
    return [entry.partition(" ")[2] for entry in str(cells.attrs["verdicts"]).split(", ")]


def panels(figure: Figure, cells: Group, up: str) -> tuple[Axes, Axes]:
    """Two panels over stiffness."""
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes in (left, right):
        axes.set(xscale="log", yscale="log", xlabel=axis_of(cells, STIFFNESS))
        axes.set(xlim=edges(cells[STIFFNESS])[[0, -1]], ylim=edges(cells[up])[[0, -1]])
        axes.xaxis.set_major_locator(LogLocator(numticks=7))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_locator(NullLocator())
    left.set_ylabel(axis_of(cells, up))
    return left, right


def draw_over_stiffness(axes: Axes, cells: Group, up: str, values: NDArray[Any], **look: Any) -> Any:
    """Values of cells over stiffness and another coordinate."""
    return axes.pcolormesh(edges(cells[STIFFNESS]), edges(cells[up]), values, **look, rasterized=True)


def colour_errors(
    figure: Figure, axes: Axes, cells: Group, up: str, there: NDArray[np.bool_], ends: tuple[float, float]
) -> None:
    """Errors by brightness, where there are any, with their scale."""
    shown = np.ma.masked_where(~there, np.clip(cells["error"], *ends))
    mesh = draw_over_stiffness(axes, cells, up, shown, cmap="cividis", norm=LogNorm(*ends))
    figure.colorbar(mesh, ax=axes, label=ERROR_LABEL, extend="both")


def overlay(axes: Axes, cells: Group, up: str, mask: NDArray[np.bool_], colour: str) -> None:
    """Some cells in one colour."""
    if mask.any():
        shown = np.ma.masked_where(~mask, np.ones(mask.shape))
        draw_over_stiffness(axes, cells, up, shown, cmap=ListedColormap([colour]))


def tell_maps(which: str, results: Results) -> tuple[Any, ...]:
    """What is walked, and how many cells come out how."""
    return results[MAPS].summary, results[MAPS][which].attrs


NEVER = "it has no such map"
STICTION_NEED = Need(MAPS, "stiction", (STIFFNESS, VELOCITY, "outcome", "sharper_outcome", "compared", "error"), NEVER)
STEP_NEED = Need(MAPS, "step", (STIFFNESS, STEP, "verdict", "error"), NEVER)
STABILITY = (
    Illustration("stability-stiction", (STICTION_NEED,), plot_stiction, partial(tell_maps, "stiction")),
    Illustration("stability-step", (STEP_NEED,), plot_step, partial(tell_maps, "step")),
)
FIGURES = (FIGURE_11, FIGURE_15)
