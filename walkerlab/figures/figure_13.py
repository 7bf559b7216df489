"""Figure 13: the bifurcation diagram, step period and stance angle of every gait over a parameter."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from walkerlab.figures.bifurcation_diagram import (
    MODELS,
    NEED,
    STAGE,
    branches_of,
    draw_branch,
    entries,
    label_of,
)
from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Results
from walkerlab.figures.style import BLACK, GREY

QUANTITIES: Final = (("step_period", "step period (s)"), ("stance_angle", "stance angle (rad)"))
ROOM: Final = 0.06
"""Beside what is stable, as a share of it: unstable branches that go far away are cut there."""


def plot(results: Results) -> Figure:
    """Both quantities over the whole span on the left, over the part with bifurcations on the right."""
    figure = blank(5.6)
    panels = figure.subplots(2, 2)
    close = cascade_of(results)
    kinds: set[str] = set()
    for row, (name, label) in enumerate(QUANTITIES):
        for column, axes in enumerate(panels[row]):
            kinds |= draw(axes, results, name)
            axes.set_xlabel(label_of(results))
            if column == 1 and close is not None:
                axes.set_xlim(*close)
            axes.set_ylim(*bounds(results, name, close if column == 1 else None))
        panels[row][0].set_ylabel(label)
    for axes, title in zip(panels[0], ("(a) all of it", "(b) where gaits change"), strict=True):
        axes.set_title(title)
    drawn = list(branches_of(results))
    others = any(branch.period & (branch.period - 1) for branch in drawn)
    attractor = any(f"{model}/attractor" in results[STAGE].groups for model in MODELS)
    legend_above(figure, entries({branch.model for branch in drawn}, kinds, others, attractor))
    return figure


def draw(axes: Axes, results: Results, name: str) -> set[str]:
    """One quantity of every branch, with its bifurcations and the attractor behind."""
    kinds: set[str] = set()
    for model in MODELS:
        cloud = results[STAGE].groups.get(f"{model}/attractor")
        if cloud is not None:
            values = np.broadcast_to(cloud["value"][:, None], cloud[name].shape)
            colour = BLACK if model == "rigid" else GREY
            axes.plot(values.ravel(), cloud[name].ravel(), ",", color=colour, alpha=0.5, zorder=2, rasterized=True)
    for branch in branches_of(results):
        kinds |= draw_branch(axes, branch, name)
    return kinds


def cascade_of(results: Results) -> tuple[float, float] | None:
    """The part of the axis with bifurcations, from before the first to where the attractor ends."""
    summary = results[STAGE].summary
    found = [one["value"] for one in summary["bifurcations"]]
    if not found:
        return None
    ends = [one["to"] for one in summary["attractors"]] or [summary["to"]]
    least, most = min(found), max(*ends, max(found))
    room = ROOM * (most - least)
    return (least - room, most + room) if room > 0.0 else None


def bounds(results: Results, name: str, close: tuple[float, float] | None) -> tuple[float, float]:
    """Room for what is stable and for the gaits of one step, in the part that is shown."""
    shown: list[NDArray[Any]] = []
    for branch in branches_of(results):
        group = branch.group
        inside = np.ones(group["value"].size, bool)
        if close is not None:
            inside = (group["value"] >= close[0]) & (group["value"] <= close[1])
        wanted = inside & group["stable"].astype(bool)
        if close is None and branch.period == 1:
            wanted = inside
        shown.append(group[name][wanted].ravel())
    for model in MODELS:
        cloud = results[STAGE].groups.get(f"{model}/attractor")
        if cloud is not None:
            shown.append(cloud[name].ravel())
    values = np.concatenate(shown)
    if values.size == 0:
        values = np.concatenate([branch.group[name].ravel() for branch in branches_of(results)])
    room = ROOM * max(float(np.ptp(values)), 1e-9)
    return float(values.min()) - room, float(values.max()) + room


def caption(results: Results) -> str:
    """How far gaits are stable, and where they change."""
    summary = results[STAGE].summary
    unit = f" {summary['unit']}" if summary["unit"] not in ("", "1") else ""
    said = ["Gaits over the parameter: solid where small disturbances die out, dashed where they grow."]
    said += [
        f"The {model} model's gait of one step first doubles its period at {first:.6g}{unit}."
        for model, first in summary["first_doubling"].items()
    ]
    said += [
        f"A cascade of the {cascade['model']} model from {cascade['flips'][0]:.6g}{unit} on accumulates at "
        f"{cascade['accumulates_at']:.6g}{unit}, the last ratio of its flips' distances being "
        f"{cascade['ratios'][-1]:.4g}."
        for cascade in summary["cascades"]
        if cascade["period"] == 1 and "accumulates_at" in cascade
    ]
    return " ".join(said)


SEEN = (
    "Step period and stance angle of gaits over the parameter: stable branches solid, unstable ones "
    "dashed, bifurcations marked; both models where both were followed."
)
FIGURE = paper_figure(13, "Families of gaits over a parameter", (NEED,), caption, plot, SEEN)
