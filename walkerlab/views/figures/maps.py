"""Maps of cells: figure 11 (starts that lead to walking), figure 15 (basins of attraction), and the reliability of
methods.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from walkerlab.config.contact import Contact
from walkerlab.outcome import OUTCOME_TEXTS, Outcome
from walkerlab.pipeline.store.content import Group
from walkerlab.views.figures import canvas, style, walks
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results, paper_figure

WHITE: Final = "#FFFFFF"
SKY: Final = "#56B4E9"
LOG_SPAN: Final = 50.0
"""Ratio of largest to smallest value above which geometrically spaced values get a logarithmic axis."""
Kind = tuple[str, str, NDArray[np.bool_]]
"""A kind of cell: colour, label, and mask of the cells."""


def discrete(colours: Sequence[str]) -> dict[str, Any]:
    """Return a colour map and norm that assign the colours to the integers 0, 1, ... in order."""
    number = len(colours)
    return {"cmap": ListedColormap(list(colours)), "norm": BoundaryNorm(np.arange(number + 1) - 0.5, number)}


def draw_kinds(draw: Callable[..., Any], kinds: Sequence[Kind]) -> list[Artist]:
    """Draw each cell in the colour of its kind, by calling `draw`, and return the legend entries."""
    draw(np.argmax(np.array([where for _, _, where in kinds]), axis=0), **discrete([colour for colour, *_ in kinds]))
    return patches((colour, label) for colour, label, _ in kinds)


def patches(kinds: Iterable[tuple[str, str]]) -> list[Artist]:
    return [Patch(facecolor=colour, edgecolor=style.GREY, linewidth=0.3, label=label) for colour, label in kinds]


def outcome_kinds(outcomes: Any) -> list[tuple[str, str]]:
    """Return colour and label of each outcome that occurs in a map."""
    return [(OUTCOME_TEXTS[item].colour, item.label) for item in map(Outcome, np.unique(outcomes).tolist())]


def edges(centres: NDArray[Any]) -> NDArray[Any]:
    """Return the edges of cells midway between neighbouring values (at the geometric mean if the axis is
    logarithmic)."""
    if centres.size == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    scale = np.log(centres) if is_logarithmic(centres) else centres
    middle = 0.5 * (scale[1:] + scale[:-1])
    scaled = np.concatenate([[2 * scale[0] - middle[0]], middle, [2 * scale[-1] - middle[-1]]])
    return np.exp(scaled) if is_logarithmic(centres) else scaled


def is_logarithmic(values: NDArray[Any], span: float = LOG_SPAN) -> bool:
    """Whether the values are spaced geometrically and the largest is at least `span` times the smallest."""
    if values.size < 3 or values.min() <= 0.0 or values.max() / values.min() < span:
        return False
    gaps = np.diff(np.log(np.sort(values)))
    plain = np.diff(np.sort(values))
    # The logarithms of the values must be evenly spaced, and more evenly than the values themselves.
    return bool(gaps.max() / gaps.min() < min(1.01, plain.max() / plain.min()))


def axis_of(cells: Group, name: str) -> str:
    variable = cells.variables[name]
    return canvas.label_of(variable.long_name, variable.units)


SWING_FACTOR = "swing_factor"
STANCE_FACTOR = "stance_factor"
MAP = Need(
    walks.TUNE_STAGE,
    "map",
    (SWING_FACTOR, STANCE_FACTOR, "outcome", "steps", "rigid_outcome", "rigid_steps"),
    "no walk was computed",
)

OUTCOME_COLOURS: Final = discrete([OUTCOME_TEXTS[item].colour for item in Outcome])
TUNED_MODELS: Final = (("", "(a) contact model"), ("rigid_", "(b) rigid model"))
STEP_LEVELS: Final = (0.5, 1.5, 2.5, 4.5)


def draw_starts(results: Results) -> Drawn:
    """Plot a map of starts for each model, coloured by outcome, with contours of the number of steps."""
    cells = results[walks.TUNE_STAGE]["map"]
    summary = results[walks.TUNE_STAGE].summary
    across = cells[SWING_FACTOR]
    up = cells[STANCE_FACTOR]
    marks: list[tuple[str, str, int, str, tuple[Any, Any]]] = [("rigid start", "o", 6, WHITE, (1.0, 1.0))]
    for name, marker, size, face in (("adjusted", "D", 9, "none"), ("gait", "X", 6, WHITE)):
        place = cells.attrs.get(f"{name}_{SWING_FACTOR}"), cells.attrs.get(f"{name}_{STANCE_FACTOR}")
        if None not in place:
            marks.append(("contact gait" if name == "gait" else "adjusted start", marker, size, face, place))
    figure, both = canvas.panels(3.9, 1, 2, sharex=True, sharey=True)
    swing, stance = ("link 1", "link 2") if walks.redoes_the_procedure(results) else ("the swing leg", "the stance leg")
    for axes, (model, title) in zip(both, TUNED_MODELS, strict=True):
        steps = cells[f"{model}steps"]
        axes.pcolormesh(across, up, cells[f"{model}outcome"], **OUTCOME_COLOURS, rasterized=True)
        levels = [level for level in STEP_LEVELS if level < int(steps.max())]
        if levels and steps.min() < levels[-1]:
            axes.contour(across, up, steps, levels, colors=style.BLACK, linewidths=0.4)
        axes.set(title=title, xlabel=f"factor on the velocity of {swing}")
    both[0].set_ylabel(f"factor on the velocity of {stance}")
    key = patches(outcome_kinds([cells[f"{model}outcome"] for model, _ in TUNED_MODELS]))
    for label, marker, size, face, (x, y) in marks:
        mark: dict[str, Any] = {"linestyle": "", "marker": marker, "markersize": size, "color": style.BLACK}
        for axes in both:
            axes.plot([x], [y], **mark, markerfacecolor=face, zorder=5)
        key.append(canvas.entry(label, **mark, markerfacecolor=face))
    both[0].set(xlim=across[[0, -1]], ylim=up[[0, -1]])
    canvas.add_legend(figure, key)
    rows = [summary["table2"][name] for name in ("dtheta_1", "dtheta_2")] if walks.claims_in(results) else []
    paper = [abs(row["paper_adams"] / row["ours_rigid"]) for row in rows]
    return figure, (summary["map"], cells.attrs["steps_wanted"], paper)


BASIN: Final = "basin"
CELLS = Need(BASIN, "basin", ("outcome", "attractor", "steps_to_settle", "walking"), "no walk was computed")
ATTRACTOR_COLOURS: Final = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.VERMILLION)
NO_ATTRACTOR: Final = -1


def draw_basins(results: Results) -> Drawn:
    """Plot which attractor or failure each start leads to (left), and in how many steps walks settle (right)."""
    summary = results[BASIN].summary
    cells = results[BASIN]["basin"]
    plane = [str(name) for name in summary["plane"][:2]]
    xlim, ylim = (sides_of(cells[name]) for name in plane)
    # If the grid has three coordinates, the figure shows its middle plane.
    middle = tuple(size // 2 for size in cells["outcome"].shape[2:])
    outcome, attractor, to_settle = (cells[name][..., *middle] for name in ("outcome", "attractor", "steps_to_settle"))

    def draw(axes: Axes, values: NDArray[Any], **how: Any) -> Any:
        extent = (*xlim, *ylim)
        return axes.imshow(values.T, extent=extent, origin="lower", aspect="auto", interpolation="nearest", **how)

    figure, (left, right) = canvas.panels(3.9, 1, 2, sharex=True, sharey=True)
    key = draw_kinds(partial(draw, left), kinds_of_cells(outcome, attractor, summary))
    left.set_title("(a) outcome")
    # A logarithmic scale has no zero, so walks that are settled from the start have the colour of one step.
    settled = np.ma.masked_where(attractor == NO_ATTRACTOR, to_settle.clip(min=1))
    right.set_title("(b) steps to the attractor")
    if settled.count():
        least = float(settled.min())
        scale = LogNorm(least, max(float(settled.max()), least + 1.0))
        bar = figure.colorbar(draw(right, settled, cmap="viridis_r", norm=scale), ax=right)
        bar.set_label("steps")
        canvas.label_ticks(bar.ax.yaxis)
    else:
        right.text(0.5, 0.9, "no walk settles on a gait", transform=right.transAxes, ha="center")
    x, y = (float(cells.attrs[f"at_{name}"]) for name in plane)
    gait: dict[str, Any] = {"marker": "o", "markersize": 4.5, "color": style.BLACK, "markerfacecolor": WHITE}
    for axes in (left, right):
        axes.plot([x], [y], linestyle="", **gait)
        axes.set(xlim=xlim, ylim=ylim, xlabel=axis_of(cells, plane[0]))
    left.set_ylabel(axis_of(cells, plane[1]))
    canvas.add_legend(figure, [*key, canvas.entry("rigid gait of one step", linestyle="", **gait)])
    rows = enumerate(summary["attractors"])
    reached = [(attractor_name(number, summary["attractors"]), row) for number, row in rows if row["cells"]]
    return figure, (summary, reached)


def sides_of(middles: NDArray[np.float64]) -> tuple[float, float]:
    """Return the outer edges of a row of evenly spaced cells with these centres."""
    half = 0.5 * float(middles[1] - middles[0])
    return float(middles[0]) - half, float(middles[-1]) + half


def kinds_of_cells(outcome: NDArray[Any], attractor: NDArray[Any], summary: Mapping[str, Any]) -> list[Kind]:
    """Return the kinds of cells that occur: attractors, walks that do not settle, and failures."""
    attractors = summary["attractors"]
    kinds: list[Kind] = [
        (ATTRACTOR_COLOURS[number % len(ATTRACTOR_COLOURS)], attractor_name(number, attractors), attractor == number)
        for number in range(len(attractors))
    ]
    unsettled_label = "aperiodic" if summary["aperiodic"] else "walks, not settled"
    unsettled = (outcome == Outcome.WALKED) & (attractor == NO_ATTRACTOR)
    kinds.append((OUTCOME_TEXTS[Outcome.WALKED].colour, unsettled_label, unsettled))
    failures = [item for item in Outcome if item is not Outcome.WALKED]
    kinds += [(OUTCOME_TEXTS[item].colour, item.label, outcome == item) for item in failures]
    return [kind for kind in kinds if kind[2].any()]


def attractor_name(number: int, attractors: list[dict[str, Any]]) -> str:
    """Label an attractor by its period, and by a letter if several have the same period."""
    period = attractors[number]["period"]
    same = [other for other, row in enumerate(attractors) if row["period"] == period]
    letter = f" ({'abcdefghijklmnopqrstuvwxyz'[same.index(number) % 26]})" if len(same) > 1 else ""
    return f"gait of {period} step{'' if period == 1 else 's'}{letter}"


MAPS: Final = "stability-maps"
STIFFNESS_AXIS = "stiffness"
VELOCITY = "stiction_velocity"
STEP_SIZE = "step_size"
_LAW: Final = Contact().to_si()
PAPER: Final = (_LAW.stiffness, _LAW.stiction_velocity)
SHARP, ROUGH = (1e-10, 1.0), (1e-6, 1.0)  # error ranges of the colour scales: stiction map, step map
VERDICT_COLOURS: Final = {
    "fine": SKY,
    "wrong silently": style.VERMILLION,
    "diverges": style.BLACK,
    "gives up": style.ORANGE,
    "no reference": style.PALE,
}


class OverStiffness:
    """Figure with two maps, of outcomes and of errors, over stiffness and a second coordinate."""

    def __init__(self, cells: Group, up: str, titles: tuple[str, str]) -> None:
        self.cells = cells
        self.edges = (edges(cells[STIFFNESS_AXIS]), edges(cells[up]))
        self.figure, (self.left, self.right) = canvas.panels(3.9, 1, 2, sharex=True, sharey=True)
        xlim, ylim = (ends[[0, -1]] for ends in self.edges)
        across = axis_of(cells, STIFFNESS_AXIS)
        for axes, title in zip((self.left, self.right), titles, strict=True):
            axes.set(xscale="log", yscale="log", xlabel=across, title=title, xlim=xlim, ylim=ylim)
            axes.xaxis.set_major_locator(LogLocator())
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_minor_locator(NullLocator())
                axis.set_major_formatter(canvas.power_of_ten)
        self.left.set_ylabel(axis_of(cells, up))

    def draw(self, axes: Axes, values: NDArray[Any], **look: Any) -> Any:
        return axes.pcolormesh(*self.edges, values, **look, rasterized=True)

    def draw_errors(self, there: NDArray[np.bool_], ends: tuple[float, float], others: Sequence[Kind]) -> None:
        """Shade the cells `there` by their error, clipped to `ends`, and draw the cells of `others` in their fixed
        colours."""
        shown = np.ma.masked_where(~there, np.clip(self.cells["error"], *ends))
        mesh = self.draw(self.right, shown, cmap="cividis", norm=LogNorm(*ends))
        self.figure.colorbar(mesh, ax=self.right, label="error", extend="both")
        for colour, _, where in others:
            if where.any():
                self.draw(self.right, np.ma.masked_where(~where, np.ones(where.shape)), cmap=ListedColormap([colour]))


def draw_stiction(results: Results) -> Drawn:
    """Plot outcomes (left) and errors (right) over stiffness and stiction velocity."""
    cells = results[MAPS]["stiction"]
    maps = OverStiffness(cells, VELOCITY, ("(a) outcome", "(b) difference at a ten times tighter tolerance"))
    outcomes = cells["outcome"]
    compared = cells["compared"] == 1
    maps.draw(maps.left, outcomes, **OUTCOME_COLOURS)
    unanswered = np.isin(outcomes, [int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED)])
    otherwise = (style.VERMILLION, "(b) other outcome", ~compared & ~unanswered)
    maps.draw_errors(compared, SHARP, [(style.BLACK, "", unanswered), otherwise])
    seen = [*outcome_kinds(outcomes), *([otherwise[:2]] if otherwise[2].any() else [])]
    mark: dict[str, Any] = {"marker": "o", "color": style.BLACK, "markerfacecolor": WHITE}
    for axes in (maps.left, maps.right):
        axes.plot(*PAPER, **mark, markersize=5.0)
    canvas.add_legend(maps.figure, [*patches(seen), canvas.entry("paper", linestyle="none", **mark)])
    return maps.figure, (results[MAPS].summary, cells.attrs)


def draw_step(results: Results) -> Drawn:
    """Plot verdicts (left) and errors (right) over stiffness and step size."""
    cells = results[MAPS]["step"]
    names = [item.partition(" ")[2] for item in str(cells.attrs["verdicts"]).split(", ")]
    maps = OverStiffness(cells, STEP_SIZE, ("(a) outcome", "(b) error of the final state"))
    verdict = np.array(names, dtype=object)[cells["verdict"]]
    maps.draw(maps.left, cells["verdict"], **discrete([VERDICT_COLOURS[name] for name in names]))
    errors = ("fine", "wrong silently")
    others = [(VERDICT_COLOURS[name], name, verdict == name) for name in VERDICT_COLOURS if name not in errors]
    maps.draw_errors(np.isin(verdict, errors), ROUGH, others)
    line: dict[str, Any] = {"color": style.GREY, "linewidth": 0.8}
    for axes in (maps.left, maps.right):
        axes.axvline(PAPER[0], **line)
    seen = [names[int(number)] for number in np.unique(cells["verdict"])]
    shown = [Patch(facecolor=VERDICT_COLOURS[name], label=name) for name in seen]
    canvas.add_legend(maps.figure, [*shown, canvas.entry("the paper's stiffness", **line)])
    return maps.figure, (results[MAPS].summary, cells.attrs)


NOT_COMPUTED = "this map was not computed"
STICTION_NEED = Need(
    MAPS, "stiction", (STIFFNESS_AXIS, VELOCITY, "outcome", "sharper_outcome", "compared", "error"), NOT_COMPUTED
)
STEP_NEED = Need(MAPS, "step", (STIFFNESS_AXIS, STEP_SIZE, "verdict", "error"), NOT_COMPUTED)
STABILITY = (
    Illustration("stability-stiction", (STICTION_NEED,), draw_stiction),
    Illustration("stability-step", (STEP_NEED,), draw_step),
)
FIGURE_15 = paper_figure(15, (CELLS,), draw_basins)
FIGURES = (paper_figure(11, (MAP,), draw_starts), FIGURE_15)
