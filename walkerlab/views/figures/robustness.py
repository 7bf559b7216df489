"""Figures of robustness: 17 (over one parameter, from a sweep) and 18 (walks on rough ground)."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import cycle
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from walkerlab.labels import axis_label
from walkerlab.pipeline.store.content import Group
from walkerlab.views.figures import stick_diagram, style
from walkerlab.views.figures.canvas import add_legend, blank, entry, error_axis, label_of, panels
from walkerlab.views.figures.families import DASHES, MODEL_COLOURS
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results, paper_figure

Values = NDArray[np.float64]
ROBUSTNESS_STAGE: Final = "robustness"
PANELS: Final[tuple[tuple[str, str, Callable[[Values], Values]], ...]] = (
    ("sensitivity norm (s/m)", "gaits.{}.gait_sensitivity_norm", lambda norm: norm),
    ("1 − largest multiplier", "gaits.{}.spectral_radius", lambda radius: 1.0 - radius),
    # The largest step down is drawn below zero, and the largest step up (`UP`) above it.
    ("largest step (mm)", "largest_step.{}.down_m", lambda step: -1e3 * step),
    ("speed (m/s)", "gaits.{}.speed_m_s", lambda speed: speed),
)
"""Axis label, sweep variable (with a slot for the model's index), and conversion of its values for the plot."""
SPEED: Final = "gaits.0.speed_m_s"
ACTUATION_PANELS: Final = (
    ("cost of transport", "gaits.0.cost_of_transport", True),
    ("sensitivity norm (s/m)", "gaits.0.gait_sensitivity_norm", True),
    ("largest step down (m)", "largest_step.0.down_m", False),
)
"""Axis label, sweep variable, and whether the axis is logarithmic."""
ACTUATIONS: Final = {
    "slope_deg": ("slope", style.BLACK, "o"),
    "impulse_N_s": ("push-off", style.BLUE, "s"),
    "torque_N_m": ("hip torque", style.VERMILLION, "^"),
}
"""Label, colour and marker of each drive, by its parameter in the sweep."""
UP: Final = "largest_step.{}.up_m"
MAX_ROWS: Final = 4
"""Maximum number of rows that a table has at one point, for two models with two legs each."""
PANEL_HEIGHT: Final = 1.6
LINES: Final = {"rigid": {"linestyle": "-", "marker": "o"}, "contact": {"linestyle": "--", "marker": "s"}}
LOWER_PANEL_INCHES = 1.7
"""Mean height of the panels below the walker (in)."""
AXIS_LABEL_INCHES = 0.4
"""Width of the axis labels next to the walker (in)."""


def sweep_illustration(group: Group, parameters: Sequence[str]) -> Illustration | None:
    """Return the illustration of a robustness sweep if it varies one parameter or compares drives, otherwise None."""
    if can_be_drawn(group, parameters):
        return paper_figure(17, (), partial(plot_over_parameter, group, parameters[0]))
    driven = actuations(group, parameters)
    return None if driven is None else Illustration("push-off-or-hip", (), partial(plot_drives, group, driven))


def can_be_drawn(group: Group, parameters: Sequence[str]) -> bool:
    """Whether a robustness sweep varies one parameter and has the variables of figure 17."""
    return len(parameters) == 1 and all(name.format(0) in group.variables for _, name, _ in PANELS)


def plot_over_parameter(group: Group, parameter: str, _results: Results) -> Drawn:
    """Plot figure 17. The caption names the parameter and, for each model, the least sensitive gait with its norm
    (s/m)."""
    x = group[parameter].astype(float)
    axis_text = axis_label(parameter)
    unit = group.variables[parameter].units
    models = [str(group[f"gaits.{k}.model"][0]) for k in range(2) if f"gaits.{k}.model" in group.variables]
    figure, axes = panels(0.6 + PANEL_HEIGHT * len(PANELS), len(PANELS), sharex=True)
    for panel, (label, name, shown) in zip(axes, PANELS, strict=True):
        for model in models:
            look: dict[str, Any] = {"color": MODEL_COLOURS[model], "markersize": 2.6, "linewidth": 1.3, **LINES[model]}
            for place in (name, UP) if name.startswith("largest_step") else (name,):
                for values in rows_of(group, place, model):
                    panel.plot(x, shown(values) if place == name else 1e3 * values, **look)
        panel.set_ylabel(label)
    axes[2].axhline(0.0, color=style.GREY, linewidth=0.7)
    axes[-1].set_xlabel(label_of(axis_text, unit))
    add_legend(figure, [entry(f"{model} model", color=MODEL_COLOURS[model], **LINES[model]) for model in models])
    norms = {model: rows_of(group, PANELS[0][1], model)[0] for model in models}
    best = {model: (x[np.nanargmin(norm)], np.nanmin(norm)) for model, norm in norms.items() if np.isfinite(norm).any()}
    return figure, (axis_text, unit, best)


def rows_of(group: Group, name: str, model: str) -> list[Values]:
    """Return a model's values (points,) for each of its rows in a table. It has two rows if the legs differ."""
    rows = []
    for row in range(MAX_ROWS):
        if name.format(row) in group.variables:
            owned = group[f"{name.partition('.')[0]}.{row}.model"] == model
            rows += [np.where(owned, group[name.format(row)].astype(float), np.nan)] if owned.any() else []
    return rows


def actuations(group: Group, parameters: Sequence[str]) -> dict[str, NDArray[np.bool_]] | None:
    """Return, for each drive, the points at which no other one acts, or None if the sweep does not compare drives."""
    if not set(parameters) <= ACTUATIONS.keys() or len(parameters) < 2 or ACTUATION_PANELS[0][1] not in group.variables:
        return None
    if any(group.variables[name].dims != group.variables["outcome"].dims for name in parameters):
        return None
    driven = {name: group[name].astype(float) != 0.0 for name in parameters}
    return driven if bool(np.all(np.sum([*driven.values()], axis=0) == 1)) else None


def plot_drives(group: Group, driven: Mapping[str, NDArray[np.bool_]], _results: Results) -> Drawn:
    """Plot cost of transport, sensitivity and largest step down against speed, for each drive."""
    speed = group[SPEED].astype(float)
    figure, axes = panels(0.6 + PANEL_HEIGHT * len(ACTUATION_PANELS), len(ACTUATION_PANELS), sharex=True)
    looks = {name: {"color": colour, "marker": marker} for name, (_, colour, marker) in ACTUATIONS.items()}
    for panel, (label, name, logarithmic) in zip(axes, ACTUATION_PANELS, strict=True):
        for parameter, points in driven.items():
            order = np.argsort(speed[points])
            at = speed[points][order]
            values = group[name].astype(float)[points][order]
            panel.plot(at, values, **looks[parameter], markersize=3.0, linewidth=1.2)
        panel.set_ylabel(label)
        if logarithmic:
            error_axis(panel)
    axes[-1].set_xlabel("speed (m/s)")
    add_legend(figure, [entry(ACTUATIONS[name][0], **looks[name]) for name in driven])
    cost, norm = (group[name].astype(float) for _, name, _ in ACTUATION_PANELS[:2])
    least = {name: np.flatnonzero(points)[np.nanargmin(norm[points])] for name, points in driven.items()}
    return figure, ({ACTUATIONS[name][0]: (speed[at], norm[at], cost[at]) for name, at in least.items()},)


def plot_rough_ground(results: Results) -> Drawn:
    """Plot figure 18. The caption gives the models, the walk shown (roughness in m, steps) and the number of walks."""
    result = results[ROBUSTNESS_STAGE]
    sticks = stick_diagram.read_sticks(result, "rough_walk/")
    steps = result["rough_steps"]
    across = sticks.project(sticks.landings)[:, 0]
    seen = np.concatenate((sticks.hip[:, None], sticks.top[:, None], sticks.feet), axis=1)
    left, bottom, right, top = stick_diagram.frame_view(sticks.project(seen).reshape(-1, 2), sticks.leg_length)
    figure = blank(1.6 + 2.0 * LOWER_PANEL_INCHES)
    tall = (figure.get_figwidth() - AXIS_LABEL_INCHES) * (top - bottom) / (right - left)
    figure.set_figheight(figure.get_figheight() + tall)
    ratios = [tall, 0.7 * LOWER_PANEL_INCHES, 1.3 * LOWER_PANEL_INCHES]
    walk, heights, share = figure.subplots(3, 1, height_ratios=ratios)
    walk.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", ylabel="height (m)")
    heights.sharex(walk)
    strikes = np.searchsorted(sticks.time, np.append(0.0, sticks.strikes))
    strikes = strikes[strikes < sticks.time.size]
    between = np.linspace(0, sticks.time.size - 1, 5 * strikes.size).astype(np.int64)
    stick_diagram.draw_postures(walk, sticks, between, stick_diagram.FAINT_WIDTH)
    stick_diagram.draw_postures(walk, sticks, strikes, stick_diagram.BOLD_WIDTH)
    stick_diagram.draw_slope(walk, sticks)
    heights.bar(across, 1e3 * sticks.landings[:, 1], 0.4 * np.diff(across).mean(), color=style.GREY)
    heights.axhline(0.0, color=style.BLACK, linewidth=0.7)
    heights.set(xlabel="horizontal position (m)", ylabel="foothold (mm)")
    draw_shares(share, steps)
    roughest = float(steps["roughness_m"].max())
    models = [str(model) for model in steps["model"]]
    key = [entry(f"{model} model", color=MODEL_COLOURS[model]) for model in models]
    dashed = zip(1e3 * steps["roughness_m"], cycle(DASHES), strict=False)
    key += [entry(f"{roughness:g} mm", color=style.BLACK, linestyle=dash) for roughness, dash in dashed]
    add_legend(figure, key)
    return figure, (models, roughest, int(sticks.strikes.size), int(steps["steps"].shape[2]))


def draw_shares(axes: Axes, steps: Group) -> None:
    """Plot the fraction of walks still upright after each number of steps, for each model and roughness."""
    for model, last, of_model in zip(steps["model"], steps["cut_off_at"], steps["steps"], strict=True):
        for walks, dash in zip(of_model, cycle(DASHES), strict=False):
            # A walk that was stopped at the maximum number of steps has not failed, so it counts as still walking.
            ended = np.sort(walks[walks < last])
            going = 1.0 - np.arange(ended.size + 1) / walks.size
            at = np.concatenate(([1.0], ended, [min(walks.max(), last)]))
            axes.step(at, np.append(going, going[-1]), where="post", color=MODEL_COLOURS[str(model)], linestyle=dash)
    axes.set(xscale="log", xlabel="steps", ylabel="share still walking", ylim=(0.0, 1.02))


NO_ROUGH_WALK = "no walk on rough ground was requested"
ROUGH_NEEDS = (
    Need(ROBUSTNESS_STAGE, "rough_walk/trajectory", ("hip_along_m", "foot_along_m"), NO_ROUGH_WALK),
    Need(ROBUSTNESS_STAGE, "rough_walk/steps", ("touch_along_m",), "the walk on rough ground takes no step"),
    Need(ROBUSTNESS_STAGE, "rough_steps", ("steps",), "no walks on rough ground were requested"),
)
FIGURE_18 = paper_figure(18, ROUGH_NEEDS, plot_rough_ground)
FIGURES: Final[tuple[Any, ...]] = (FIGURE_18,)
