"""Figure 6: stick diagram of one gait cycle of the contact model, with the ground it walks on."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon

from walkerlab.figures.canvas import legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.stick_diagram import (
    Sticks,
    cycle_caption,
    draw_slope,
    entries,
    sole_radius,
    stick_diagram,
    stored_sticks,
)
from walkerlab.figures.style import LEGS
from walkerlab.figures.walks import CONTACT_STAGE, JOINTS, NO_STATES, STATES, STEPS_TAKEN_CONTACT, TRAJECTORY
from walkerlab.store.content import Group

TERRAIN = "terrain"
PAD_HEIGHT = 0.028
"""Drawn height of a pad, leg lengths: nothing is below a pad's top but what the drawing puts there."""
HATCHES = ("////", "||||")
PAD_NAMES = ("pad of leg 1", "pad of leg 2")


def plot(results: Results) -> Figure:
    """The walker on its pads, or on its plane."""
    sticks = sticks_of(results)
    figure, axes = stick_diagram(sticks)
    pads = results[CONTACT_STAGE].groups.get(TERRAIN)
    more: list[Artist] = []
    if pads is None:
        draw_slope(axes, sticks)
    else:
        draw_pads(axes, sticks, pads)
        more = [Patch(label=name, **pad_look(leg)) for leg, name in enumerate(PAD_NAMES)]
    legend_above(figure, [*entries(sticks), *more])
    return figure


def sticks_of(results: Results) -> Sticks:
    """The joints' places as the walk has stored them."""
    return stored_sticks(results[CONTACT_STAGE])


def draw_pads(axes: Axes, sticks: Sticks, pads: Group) -> None:
    """The pads of both lanes that are in sight."""
    bottom = -PAD_HEIGHT * sticks.leg_length
    left, right = axes.get_xlim()
    for pad_left, pad_right, leg in zip(pads["left_m"], pads["right_m"], pads["leg"], strict=True):
        corners = np.array([[pad_left, 0.0], [pad_right, 0.0], [pad_right, bottom], [pad_left, bottom]])
        outline = sticks.in_plane(corners)
        if outline[:, 0].max() > left and outline[:, 0].min() < right:
            axes.add_patch(Polygon(outline, closed=True, zorder=1.5, **pad_look(int(leg))))


def pad_look(leg: int) -> dict[str, Any]:
    """How the pads of a leg's lane are drawn."""
    colour = LEGS[leg].colour
    return {"facecolor": "white", "edgecolor": colour, "hatch": HATCHES[leg], "linewidth": 0.7}


def caption(results: Results) -> str:
    """The cycle's measures, and what the ground is."""
    result, sticks = results[CONTACT_STAGE], sticks_of(results)
    asked = result.identity.config_slice
    radius = sole_radius(asked["walker"])
    feet = f"round feet of {1e3 * radius:.3g} mm radius" if radius else "point feet"
    ground = f"each leg on its own lane of pads laid at {float(result.summary['pitch_m']):.4g} m"
    if TERRAIN not in result.groups:
        ground = PLANES[asked["contact"]["terrain"]]
    return (
        "One gait cycle of the contact model, to scale but for the feet's marks and the ground's depth: "
        f"{feet}, {ground}. {cycle_caption(sticks)}"
    )


PLANES = {
    "plane": "on a plane",
    "after-mid-swing": "on a plane that a swing foot can touch only once it has passed the stance foot",
}
CONTACT_JOINTS = Need(CONTACT_STAGE, TRAJECTORY, (*STATES, *JOINTS), NO_STATES)

SEEN = "Legs as lines from the hip to the feet, fanned out from one foothold to the next, and the ground under them."
FIGURE = paper_figure(
    6, "Stick diagram of the contact model", (CONTACT_JOINTS, STEPS_TAKEN_CONTACT), caption, plot, SEEN
)
