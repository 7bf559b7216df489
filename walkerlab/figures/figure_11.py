"""Figure 11: which scaled starts walk, in the contact model and in the rigid one."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.figure_05 import TUNE_STAGE
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, PURPLE, VERMILLION
from walkerlab.figures.walks import redoes_the_paper
from walkerlab.hybrid.outcome import Outcome
from walkerlab.store.content import Group

SWING, STANCE = "swing_factor", "stance_factor"
MAP = Need(
    TUNE_STAGE, "map", (SWING, STANCE, "outcome", "steps", "rigid_outcome", "rigid_steps"), "no start was walked"
)

WHITE: Final = "#FFFFFF"
COLOURS: Final = {
    Outcome.WALKED: "#56B4E9",
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


def plot(results: Results) -> Figure:
    """Both models' maps on the same axes, outcome as colour, lines where more steps are walked."""
    cells = results[TUNE_STAGE]["map"]
    figure = blank(3.9)
    both = figure.subplots(1, 2, sharex=True, sharey=True)
    seen: set[Outcome] = set()
    of_the_compass = "paper_start" in results[TUNE_STAGE].summary
    swing, stance = ("link 1", "link 2") if of_the_compass else ("the swing leg", "the stance leg")
    for axes, (outcome, steps, title) in zip(both, MODELS, strict=True):
        seen |= draw_map(axes, cells, outcome, steps)
        axes.set_title(title)
        axes.set_xlabel(f"factor on the velocity of {swing}")
    both[0].set_ylabel(f"factor on the velocity of {stance}")
    marks = [mark for axes in both for mark in draw_marks(axes, cells)]
    unique = {str(mark.get_label()): mark for mark in marks}
    patches: list[Artist] = [Patch(facecolor=COLOURS[one], edgecolor="none", label=one.label) for one in sorted(seen)]
    legend_above(figure, [*patches, *unique.values()])
    return figure


def draw_map(axes: Axes, cells: Group, outcome: str, steps: str) -> set[Outcome]:
    """One model's cells; returns the outcomes that occur."""
    colours = ListedColormap([COLOURS[one] for one in Outcome])
    norm = BoundaryNorm(np.arange(len(Outcome) + 1) - 0.5, len(Outcome))
    axes.pcolormesh(cells[SWING], cells[STANCE], cells[outcome], cmap=colours, norm=norm, rasterized=True)
    most = int(cells[steps].max())
    levels = [level for level in STEP_LEVELS if level < most]
    if levels and cells[steps].min() < levels[-1]:
        axes.contour(cells[SWING], cells[STANCE], cells[steps], levels, colors=BLACK, linewidths=0.4)
    return {Outcome(int(number)) for number in np.unique(cells[outcome])}


def draw_marks(axes: Axes, cells: Group) -> list[Line2D]:
    """The rigid start, the adjusted start and the contact gait, where they lie on the map."""
    drawn = []
    for label, marker, place in MARKS:
        where: list[Any] = [cells.attrs.get(one) if isinstance(one, str) else one for one in place]
        if None in where:
            continue
        size = 9 if marker == "D" else 6
        face = "none" if marker == "D" else WHITE
        (mark,) = axes.plot(
            [where[0]],
            [where[1]],
            linestyle="",
            marker=marker,
            markersize=size,
            color=BLACK,
            markerfacecolor=face,
            label=label,
            zorder=5,
        )
        drawn.append(mark)
    axes.set_xlim(cells[SWING][0], cells[SWING][-1])
    axes.set_ylim(cells[STANCE][0], cells[STANCE][-1])
    return drawn


def caption(results: Results) -> str:
    """How many starts walk, and where the paper's own lies."""
    summary = results[TUNE_STAGE].summary
    cells, wanted = summary["map"], results[TUNE_STAGE]["map"].attrs["steps_wanted"]
    rigid = cells["rigid"].get("walked", 0) / cells["cells"]
    return (
        f"How walks of {wanted} steps end when the velocities of the rigid start are scaled: of {cells['cells']} "
        f"starts {100 * cells['walks_share']:.3g} % walk and settle in the contact model, {100 * rigid:.3g} % walk in "
        f"the rigid one. "
        f"Thin lines separate 1, 2, 3 and 5 steps.{papers_start(results)}"
    )


def papers_start(results: Results) -> str:
    """Where the paper's start would lie; nothing for another scene."""
    if not redoes_the_paper(results):
        return ""
    table = results[TUNE_STAGE].summary["table2"]
    factors = [abs(table[name]["paper_adams"] / table[name]["ours_rigid"]) for name in ("dtheta_1", "dtheta_2")]
    return f" The paper's ADAMS start would lie at {factors[0]:.3g} and {factors[1]:.3g}."


SEEN = (
    "Two maps of scaled starts, one a model, coloured by how the walk from each ends, with marks for the rigid start, "
    "the adjusted one and the contact gait."
)
FIGURE = paper_figure(11, "Starts that walk", (MAP,), caption, plot, SEEN)
