"""Figure 14: the multipliers of the gaits of one step, in the complex plane and over the parameter."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from walkerlab.figures.bifurcation_diagram import MODELS, NEED, STAGE, DrawnBranch, branches_of, label_of
from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Results
from walkerlab.figures.style import BLACK, GREY

FARTHEST: Final = 1.6
"""Of the complex plane that is shown; an unstable gait's multipliers may be far outside."""


def plot(results: Results) -> Figure:
    """The complex plane on the left, magnitudes over the parameter on the right."""
    figure = blank(3.6)
    left, right = figure.subplots(1, 2)
    drawn = [branch for branch in branches_of(results) if branch.period == 1]
    for branch in drawn:
        in_the_plane(left, branch)
        over_the_parameter(right, branch)
    left.add_patch(Circle((0.0, 0.0), 1.0, fill=False, edgecolor=GREY, linewidth=0.8))
    left.set_xlim(-FARTHEST, FARTHEST)
    left.set_ylim(-FARTHEST, FARTHEST)
    left.set_aspect("equal")
    left.set_xlabel("real part")
    left.set_ylabel("imaginary part")
    left.set_title("(a) in the complex plane")
    right.axhline(1.0, color=GREY, linewidth=0.8)
    right.set_ylim(0.0, 2.0 * FARTHEST)
    right.set_xlabel(label_of(results))
    right.set_ylabel("magnitude")
    right.set_title("(b) over the parameter")
    models = {branch.model for branch in drawn}
    handles = [
        Line2D([], [], color=colour, marker="o", markersize=3, label=f"{model} model")
        for model, colour in MODELS.items() if model in models
    ]  # fmt: skip
    ends = [Line2D([], [], color=BLACK, linestyle="none", marker=">", markersize=4, label="largest value of the span")]
    legend_above(figure, [*handles, *ends])
    return figure


def in_the_plane(axes: Axes, branch: DrawnBranch) -> None:
    """Every multiplier along the branch, its last place marked."""
    real, imag = branch.group["multiplier_real"], branch.group["multiplier_imag"]
    axes.plot(real.ravel(), imag.ravel(), linestyle="none", marker="o", markersize=1.6, color=branch.colour)
    last = int(np.argmax(branch.group["value"]))
    axes.plot(real[last], imag[last], linestyle="none", marker=">", markersize=4, color=branch.colour)


def over_the_parameter(axes: Axes, branch: DrawnBranch) -> None:
    """Magnitudes, largest first, so that each is a line."""
    size = np.hypot(branch.group["multiplier_real"], branch.group["multiplier_imag"])
    axes.plot(branch.group["value"], size, color=branch.colour, linewidth=1.0, marker="o", markersize=1.6)


def caption(results: Results) -> str:
    """What the largest multipliers are where the span begins and ends."""
    said = ["Multipliers of the step map along the gaits of one step; inside the circle a disturbance dies out."]
    summary = results[STAGE].summary
    alone = [one for one in summary["bifurcations"] if one["period"] == 1]
    for model, kind in dict.fromkeys((one["model"], one["kind"]) for one in alone):
        values = [one["value"] for one in alone if (one["model"], one["kind"]) == (model, kind)]
        *others, last = [f"{value:.6g}" for value in sorted(values)]
        at = f"{', '.join(others)} and {last}" if others else last
        said.append(f"The {model} model has {f'a {kind}' if len(values) == 1 else f'{kind}s'} at {at}.")
    return " ".join(said)


SEEN = "Multipliers of the gaits, in the complex plane with the unit circle and as magnitudes over the parameter."
FIGURE = paper_figure(14, "Multipliers over a parameter", (NEED,), caption, plot, SEEN)
