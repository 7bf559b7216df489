"""Figure 2: stick diagram of one gait cycle of the rigid model."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from walkerlab.figures.canvas import legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Results
from walkerlab.figures.stick_diagram import Sticks, cycle_caption, draw_slope, entries, stick_diagram
from walkerlab.figures.walks import RIGID_STAGE, RIGID_STATES, STEPS, STEPS_TAKEN_RIGID, TRAJECTORY


def plot(results: Results) -> Figure:
    """The walker on the bare slope: the rigid model's ground is a plane."""
    sticks = sticks_of(results)
    figure, axes = stick_diagram(sticks)
    draw_slope(axes, sticks)
    legend_above(figure, entries())
    return figure


def sticks_of(results: Results) -> Sticks:
    """The joints' places from the legs' angles and the footholds: (A.1) to (A.3) in the slope's frame."""
    result = results[RIGID_STAGE]
    trajectory, steps = result[TRAJECTORY], result[STEPS]
    length, slope = float(result.identity.config_slice["walker"]["leg_length_m"]), float(result.summary["slope_rad"])
    landings = np.concatenate(([0.0], np.cumsum(steps["length_m"])))
    angle = trajectory["angle"] + slope
    from_hip = length * np.stack((np.sin(angle), -np.cos(angle)), axis=-1)
    stance_foot = np.stack((landings[trajectory["step"]], np.zeros(angle.shape[0])), axis=-1)
    hip = stance_foot - from_hip[np.arange(angle.shape[0]), trajectory["stance_leg"]]
    feet = hip[:, None] + from_hip
    return Sticks(trajectory["time"], hip, feet, steps["heel_strike_time_s"], landings, slope)


def caption(results: Results) -> str:
    """The cycle's measures."""
    return f"One gait cycle of the rigid model, to scale. {cycle_caption(sticks_of(results))}"


SEEN = (
    "Legs as straight lines from the hip to the feet, fanned out from one foothold to the next, down the "
    "slope to the right."
)
FIGURE = paper_figure(2, "Stick diagram of the rigid model", (RIGID_STATES, STEPS_TAKEN_RIGID), caption, plot, SEEN)
