"""Figures of a sweep: lines over one parameter, maps over two, and a scatter plot over each of three or more."""

from collections.abc import Sequence
from functools import partial
from itertools import cycle
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from walkerlab.labels import axis_label
from walkerlab.pipeline.store.content import Group
from walkerlab.views.figures.canvas import add_legend, entry, label_of, panels
from walkerlab.views.figures.illustration import Drawn, Illustration, Results
from walkerlab.views.figures.maps import WHITE, edges, is_logarithmic
from walkerlab.views.figures.style import BLUE, GREY, VERMILLION

SWEEP_PANEL_HEIGHT: Final = 1.9
MAP_HEIGHT: Final = 2.9
MAX_PANELS: Final = 4
MAX_LINES: Final = 5
"""Maximum number of lines, one for each value of a second parameter. For more values, a map is drawn."""
SWEEP_DASHES: Final = ("-", "--", "-.")
STABILITY_BOUND: Final = "largest multiplier 1"
MAX_SCATTERED: Final = 20_000
"""Maximum number of points in a panel. If there are more, evenly spaced ones are plotted."""
PREFERRED: Final[tuple[str, ...]] = (
    "period_s", "last_step_period_s", "spectral_radius", "step_length_m", "last_step_length_m", "steps",
    "slip_per_step_m", "max_penetration_m", "min_normal_force_N", "energy_drift_J", "end_time_s",
)  # fmt: skip
RADIUS: Final = "spectral_radius"
MISSING: Final[dict[str, Any]] = {"color": VERMILLION, "marker": "|", "linestyle": "none", "markersize": 5.0}
AXIS_LABELS: Final = {RADIUS: "largest multiplier"}


def choose(group: Group, parameters: Sequence[str]) -> list[str]:
    """Return the quantities to plot by default: the preferred ones that vary or, if none does, any others that vary."""
    varying = []
    for name in group.variables:
        if is_number(group, name) and name not in parameters:
            values = group[name].astype(float)
            if np.unique(values[np.isfinite(values)]).size > 1:
                varying.append(name)
    known = [name for name in PREFERRED if name in varying]
    return (known or [name for name in varying if "." not in name] or varying)[:MAX_PANELS]


def is_number(group: Group, name: str) -> bool:
    """Whether a variable has one number for each point of the sweep."""
    return name in group.variables and is_pointwise(group, name) and group[name].dtype.kind in "fib"


def is_pointwise(group: Group, name: str) -> bool:
    """Whether a variable has a value for each point of the sweep, as the outcome has."""
    return group.variables[name].dims == group.variables["outcome"].dims


def illustration(
    group: Group, stage: str, parameters: Sequence[str], names: Sequence[str], against: str = ""
) -> Illustration:
    """Return the illustration of a sweep's quantities `names` over its parameters, or over the quantity `against`."""
    drawing = partial(draw, group, parameters, names, against)
    return Illustration(f"sweep-{stage}", (), drawing, words="sweep", scene=f"{stage} over {', '.join(parameters)}")


def draw(group: Group, parameters: Sequence[str], names: Sequence[str], against: str, _results: Results) -> Drawn:
    """Plot a sweep. The caption gives quantities, parameters, outcomes, and the meaning of gaps and lines."""
    dimensions = group["outcome"].ndim
    # If one of two parameters has few values, the figure has a line for each of them instead of a map.
    a_map = dimensions == 2 and not against and min(group["outcome"].shape) > MAX_LINES
    if against:
        figure = plot_against(group, names, against)
    elif dimensions != 2:
        figure = plot_scatter(group, parameters, names)
    else:
        figure = (maps if a_map else lines)(group, parameters, names)
    outcomes = zip(*np.unique(group["outcome"].astype(str), return_counts=True), strict=True)
    marked_gaps = "" if against or dimensions > 2 else "marks"
    gaps = "" if np.all(group["status"] == "answered") else "map" if a_map else marked_gaps
    what, other = ([name_in_text(group, name) for name in each] for each in (names, [against] if against else []))
    return figure, (what, parameters, list(outcomes), gaps, a_map, RADIUS in names, *other)


def plot_against(group: Group, names: Sequence[str], against: str) -> Figure:
    """Plot each quantity, in a row of its own, over the quantity `against`. If a single parameter varies, join the
    points in order.
    """
    x, few = spread(group, against)
    figure, axes = panels(0.8 + SWEEP_PANEL_HEIGHT * len(names), len(names), sharex=True, squeeze=False)
    for panel, name in zip(axes[:, 0], names, strict=True):
        line = "-" if group["outcome"].ndim == 1 else "none"
        y = group[name].astype(float).ravel()
        panel.plot(x[few], y[few], color=BLUE, linestyle=line, linewidth=1.2, marker="o", markersize=2.6)
        if name == RADIUS:
            panel.axhline(1.0, color=GREY, linewidth=0.8)
            add_legend(figure, [entry(STABILITY_BOUND, color=GREY, linewidth=0.8)])
        panel.set_ylabel(label(group, name))
    axes[-1, 0].set_xlabel(label(group, against))
    return figure


def name_in_text(group: Group, name: str) -> str:
    return group.variables[name].long_name.replace("_", " ")


def label(group: Group, name: str) -> str:
    """Return the axis label of a variable, with its unit."""
    return label_of(AXIS_LABELS.get(name, axis_label(name.rpartition(".")[2])), group.variables[name].units)


def plot_scatter(group: Group, parameters: Sequence[str], names: Sequence[str]) -> Figure:
    """Plot each quantity (row) over each parameter (column), and join the points if one parameter varies
    monotonically."""
    shown = list(parameters)[:MAX_PANELS]
    rows, columns = len(names), len(shown)
    figure, axes = panels(0.5 + SWEEP_PANEL_HEIGHT * rows, rows, columns, sharex="col", sharey="row", squeeze=False)
    for column, parameter in enumerate(shown):
        x, few = spread(group, parameter)
        monotonic = bool(np.all(np.diff(x) > 0.0) or np.all(np.diff(x) < 0.0))
        for panel, name in zip(axes[:, column], names, strict=True):
            y = group[name].astype(float).ravel()
            if group["outcome"].ndim == 1 and column == 0 and monotonic:
                panel.plot(x, y, color=BLUE, linewidth=1.4, marker="o" if x.size <= 60 else "", markersize=2.6)
            else:
                dots: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 2.2}
                panel.plot(x[few], y[few], color=BLUE, **dots, rasterized=few.size > 2000)
            finish_panel(panel, group, parameter, name, x[np.isnan(y)])
        axes[-1][column].set_xlabel(label(group, parameter))
    for panel, name in zip(axes[:, 0], names, strict=True):
        panel.set_ylabel(label(group, name))
    if key := legend_entries(group, names):
        add_legend(figure, key)
    return figure


def spread(group: Group, parameter: str) -> tuple[NDArray[Any], NDArray[np.int_]]:
    """Return the value of a parameter at every point of the sweep, as a flat array, and the indices of the points to
    plot."""
    values = numbers(group, parameter)
    if not is_pointwise(group, parameter):
        along = [-1 if name == parameter else 1 for name in group.variables["outcome"].dims]
        values = np.broadcast_to(values.reshape(along), group["outcome"].shape)
    return values.ravel(), np.unique(np.linspace(0, values.size - 1, min(values.size, MAX_SCATTERED)).astype(int))


def finish_panel(axes: Axes, group: Group, parameter: str, name: str, missing: NDArray[Any]) -> None:
    """Draw the stability bound, mark the parameter values without an answer (`missing`), and set the scales."""
    if name == RADIUS:
        axes.axhline(1.0, color=GREY, linewidth=0.8)
    if missing.size:
        axes.plot(missing, np.full(missing.size, 0.02), **MISSING, transform=axes.get_xaxis_transform())
    set_scale(axes, group, parameter, "x")


def legend_entries(group: Group, names: Sequence[str]) -> list[Artist]:
    """Return the legend entries of the stability bound and of the marks for points without an answer."""
    gaps = any(np.isnan(group[name].astype(float)).any() for name in names)
    stability = [entry(STABILITY_BOUND, color=GREY, linewidth=0.8)] if RADIUS in names else []
    return [*stability, *([entry("no answer", **MISSING)] if gaps else [])]


def lines(group: Group, parameters: Sequence[str], names: Sequence[str]) -> Figure:
    """Plot each quantity over the parameter with more values. Each value of the other parameter gets a line."""
    across, few = sorted(parameters, key=lambda parameter: -group[parameter].size)
    x = numbers(group, across)
    values = group[few].tolist()
    colours = matplotlib.colormaps["viridis"](0.85 * np.linspace(0.0, 1.0, len(values)))
    looks = [{"color": colour, "linestyle": dash} for colour, dash in zip(colours, cycle(SWEEP_DASHES), strict=False)]
    figure, axes = panels(0.8 + SWEEP_PANEL_HEIGHT * len(names), len(names), sharex=True, squeeze=False)
    for panel, name in zip(axes[:, 0], names, strict=True):
        found = group[name].astype(float)
        rows = found if parameters[0] == few else found.T
        for row, look in zip(rows, looks, strict=True):
            panel.plot(x, row, **look, linewidth=1.3, marker="o", markersize=2.4)
        finish_panel(panel, group, across, name, x[np.isnan(rows).any(axis=0)])
        panel.set_ylabel(label(group, name))
    axes[-1, 0].set_xlabel(label(group, across))
    unit = group.variables[few].units
    key = []
    for value, look in zip(values, looks, strict=True):
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        key.append(entry(f"{axis_label(few)} {text}{f' {unit}' if unit not in ('', '1') else ''}", **look))
    add_legend(figure, [*key, *legend_entries(group, names)])
    return figure


def set_scale(axes: Axes, group: Group, parameter: str, which: str) -> None:
    """Make the axis `which` (x or y) logarithmic if the parameter's values are. If they are words, label the ticks with
    them."""
    values = group[parameter]
    if is_logarithmic(np.unique(numbers(group, parameter)), span=1.0):
        getattr(axes, f"set_{which}scale")("log")
    if values.dtype.kind == "O" and group.variables[parameter].dims == (parameter,):
        getattr(axes, f"set_{which}ticks")(np.arange(values.size), [str(value) for value in values])


def maps(group: Group, parameters: Sequence[str], names: Sequence[str]) -> Figure:
    """Plot a map for each quantity, two per row. The second parameter runs upward."""
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    figure, axes = panels(0.4 + MAP_HEIGHT * rows, rows, columns, squeeze=False)
    across, up = (numbers(group, parameter) for parameter in parameters)
    for panel, name in zip(axes.flat, names, strict=False):
        values = np.ma.masked_invalid(group[name].astype(float)).T
        panel.set_facecolor("#D9D9D9")
        mesh = panel.pcolormesh(edges(across), edges(up), values, cmap="viridis", rasterized=True)
        figure.colorbar(mesh, ax=panel, label=label(group, name))
        if name == RADIUS and values.count() and values.min() < 1.0 < values.max() and min(values.shape) > 1:
            panel.contour(across, up, values, levels=[1.0], colors=WHITE, linewidths=1.4)
            outlined = [withStroke(linewidth=2.6, foreground=GREY)]
            add_legend(figure, [entry(STABILITY_BOUND, color=WHITE, linewidth=1.4, path_effects=outlined)])
        for axis, parameter, scale in (("x", parameters[0], across), ("y", parameters[1], up)):
            getattr(panel, f"set_{axis}label")(label(group, parameter))
            set_scale(panel, group, parameter, axis)
            if scale.size > 1 and group[parameter].dtype.kind != "O":
                getattr(panel, f"set_{axis}ticks")(scale, minor=True)
                getattr(panel, f"set_{axis}lim")(scale.min(), scale.max())
    for panel in axes.flat[len(names) :]:
        panel.set_axis_off()
    return figure


def numbers(group: Group, parameter: str) -> NDArray[Any]:
    """Return a parameter's values, or their indices if they are words."""
    values = group[parameter]
    return np.arange(values.size, dtype=float) if values.dtype.kind == "O" else values.astype(float)
