"""Figure 2: stick diagram of one gait cycle of the rigid model."""

from __future__ import annotations

from dataclasses import replace

from matplotlib.figure import Figure

from walkerlab.figures.canvas import legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.stick_diagram import Sticks, cycle_caption, draw_slope, entries, stick_diagram, stored_sticks
from walkerlab.figures.walks import JOINTS, NO_STATES, RIGID_STAGE, STATES, STEPS_TAKEN_RIGID, TRAJECTORY


def plot(results: Results) -> Figure:
    """The walker on the bare slope: the rigid model's ground is a plane."""
    sticks = sticks_of(results)
    figure, axes = stick_diagram(sticks)
    draw_slope(axes, sticks)
    legend_above(figure, entries(sticks))
    return figure


def sticks_of(results: Results) -> Sticks:
    """The joints' places as the walk has stored them."""
    result = results[RIGID_STAGE]
    sticks = stored_sticks(result)
    # a compass has point feet in the rigid model, whatever its ball feet
    return replace(sticks, radius=0.0) if result.identity.config_slice["walker"]["type"] == "compass" else sticks


def caption(results: Results) -> str:
    """The cycle's measures."""
    return f"One gait cycle of the rigid model, to scale. {cycle_caption(sticks_of(results))}"


SEEN = "Legs as lines from the hip to the feet, fanned out from one foothold to the next, down the slope to the right."
RIGID_JOINTS = Need(RIGID_STAGE, TRAJECTORY, (*STATES, *JOINTS), NO_STATES)
FIGURE = paper_figure(2, "Stick diagram of the rigid model", (RIGID_JOINTS, STEPS_TAKEN_RIGID), caption, plot, SEEN)
