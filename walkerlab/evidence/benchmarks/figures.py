"""Figures of error against run time, for methods and for other engines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from walkerlab.evidence.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW
from walkerlab.views.figures.canvas import add_legend, cost_axis, entry, error_axis, panels
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results
from walkerlab.views.figures.style import BLACK, BLUE, CONTACT_LOOK, GREEN, GREY, ORANGE, PALE, PURPLE, VERMILLION, Look
from walkerlab.views.figures.walks import Array

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

DASHED = (0.0, (3.2, 1.4))
DOTTED = (0.0, (1.0, 1.2))


@dataclass(frozen=True)
class Series:
    """Runs of one method, or of one integrator or contact model of an engine, from coarse to fine."""

    look: Look
    runs: Mapping[str, Array]  # stored columns by name, NaN for missing values
    filled: bool  # whether markers are filled
    engine: str = ""  # empty for methods

    @property
    def line(self) -> dict[str, Any]:
        marked = {"marker": self.look.marker, "markersize": 4.0}
        return {**self.look.line, **marked, "markerfacecolor": self.look.colour if self.filled else "none"}

    @property
    def key(self) -> Line2D:
        return entry(self.look.label, **self.line)

    @property
    def completed(self) -> NDArray[np.bool_]:
        """Whether each run reached the end of its walk."""
        return np.asarray(self.runs["outcome"] == "walked")


LOOKS = {
    look.label: look
    for look in (
        Look("dop853", BLUE, "-", 1.8, "o", order=5),
        Look("radau5", VERMILLION, "-", 1.8, "s", order=5),
        Look("scipy-rk45", GREEN, DASHED, 1.0, "v"),
        Look("scipy-dop853", BLUE, DASHED, 1.0, "o"),
        Look("scipy-lsoda", ORANGE, DASHED, 1.0, "^"),
        Look("scipy-radau", VERMILLION, DASHED, 1.0, "s"),
        Look("scipy-bdf", PURPLE, DASHED, 1.0, "D"),
        Look("cvode-bdf", PURPLE, DOTTED, 1.0, "d"),
        Look("cvode-adams", GREEN, DOTTED, 1.0, "<"),
        Look("scipy-dop853-numpy", GREY, DOTTED, 1.2, "P"),
    )
}
DEFAULT_LOOK = Look("", BLACK, DOTTED, 1.0, "*")
METHOD_VARIABLES = ("method", "tolerance", "reached", "error", "wall_s", "rhs_evaluations", "outcome")
MIN_FLOOR = 1e-17  # smallest uncertainty drawn
FAILURE_LEVEL = 30.0  # failed runs are drawn at this multiple of the largest error


def method_series(scene: str, results: Results) -> Iterator[Series]:
    """Yield the series of each method in the order of measurement. Fully compiled methods have filled markers."""
    rows = results["accuracy"].groups[f"{scene}/rows"]
    methods = rows["method"].astype(str)
    for name in dict.fromkeys(methods.tolist()):
        look = LOOKS.get(name, replace(DEFAULT_LOOK, label=name))
        runs = {variable: rows[variable][methods == name] for variable in METHOD_VARIABLES}
        yield Series(look, runs, look.style == "-")


def draw_methods(scene: str, results: Results) -> Drawn:
    """Plot errors against run time (left) and right-hand sides evaluated (right), with crosses for failed runs."""
    all_series = list(method_series(scene, results))
    summary = results["accuracy"].summary
    reference = summary["reference"][scene]
    # The difference between the two references is their uncertainty, so errors below it mean nothing.
    floor = max(float(reference["agreement"]), MIN_FLOOR)
    errors = [float(np.max(each.runs["error"], where=each.runs["reached"] != 0, initial=floor)) for each in all_series]
    failed = FAILURE_LEVEL * max(errors)
    figure, (left, right) = panels(3.9, 1, 2, sharey=True)
    for axes, name, label in ((left, "wall_s", "run time (s)"), (right, "rhs_evaluations", "right-hand sides")):
        axes.set_xlabel(label)
        axes.axhspan(MIN_FLOOR, floor, color=PALE, zorder=0)
        for series in all_series:
            reached = series.runs["reached"] != 0
            cost = series.runs[name].astype(float)
            order = series.look.order
            axes.plot(cost[reached], np.maximum(series.runs["error"][reached], floor), **series.line, zorder=order)
            cross: dict[str, Any] = {"color": series.look.colour, "linestyle": "none", "marker": "x", "markersize": 5.0}
            axes.plot(cost[~reached], np.full(np.count_nonzero(~reached), failed), **cross, zorder=order)
        cost_axis(axes)
        error_axis(axes)
        axes.set_ylim(0.3 * floor, 4.0 * failed)
    left.set(ylabel="error of the end state (SI)", title="(a) against run time")
    right.set_title("(b) against right-hand sides")
    add_legend(figure, legend_entries(all_series, floor))
    failures = [
        (series.look.label, series.runs["tolerance"][row], series.runs["outcome"][row])
        for series in all_series
        for row in np.flatnonzero(series.runs["reached"] == 0)
    ]
    reference_is_measured = any(series.look.label == reference["method"] for series in all_series)
    return figure, (summary["conclusions"][scene], reference, reference_is_measured, failures)


def legend_entries(all_series: Sequence[Series], floor: float) -> list[Line2D]:
    """Build the legend entries of the methods, failed runs and the reference uncertainty."""
    legend = [series.key for series in all_series]
    if not all(series.runs["reached"].all() for series in all_series):
        legend.append(entry("end not reached", color=BLACK, linestyle="none", marker="x", markersize=5.0))
    return [*legend, entry(f"reference uncertainty {floor:.0e}", color=PALE, linewidth=6.0)]


ENGINES_STAGE = "engines"
ENGINE_RUNS = "rows"
SERIES_VARIABLES = ("step_s", "error", "wall_s", "period_s", "outcome")
ENGINE_VARIABLES = ("scene", "engine", "experiment", "integrator", "start", *SERIES_VARIABLES)
COLOURS = {OURS: BLACK, "mujoco": VERMILLION, "drake": BLUE, "exudyn": GREEN}
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
SERIES_DASHES: tuple[LineStyleType, ...] = ("-", DASHED, DOTTED, (0.0, (5.0, 1.2, 1.0, 1.2)), (0.0, (2.0, 2.0)))


def engine_series(scene: str, experiment: str, results: Results) -> Iterator[Series]:
    """Yield the series of runs that start on the gait. The first series of each engine has filled markers."""
    rows = results[ENGINES_STAGE].groups[ENGINE_RUNS]
    engines = rows["engine"].astype(str)
    names = rows["integrator"].astype(str)
    selected = (rows["scene"] == scene) & (rows["experiment"] == experiment)
    places: dict[str, int] = {}
    for engine, name in dict.fromkeys(zip(engines[selected].tolist(), names[selected].tolist(), strict=True)):
        rows_of_series = selected & (engines == engine) & (names == name) & (rows["start"] == 1.0)
        place = places[engine] = places.get(engine, -1) + 1
        style = SERIES_DASHES[place % len(SERIES_DASHES)]
        marker = MARKERS[place % len(MARKERS)]
        look = Look(f"{engine} {name}", COLOURS.get(engine, GREY), style, 1.8 if engine == OURS else 1.1, marker)
        runs = {variable: rows[variable][rows_of_series] for variable in SERIES_VARIABLES}
        yield Series(look, runs, place == 0, engine)


def draw_errors(scene: str, results: Results) -> Drawn:
    """Plot errors against run time, under our law (left) and on the native contact of each engine (right)."""
    # Both axes use the same line styles and markers for different series, so each needs a separate legend.
    figure, panes = panels(4.6, 1, 2)
    experiments = (
        (SAME_LAW, "upper", "(a) ADAMS's law in each integrator", "error of the end state (SI)"),
        (OWN_LAW, "lower", "(b) each engine's own contact", "difference of the step period (s)"),
    )
    for axes, (experiment, edge, title, label) in zip(panes, experiments, strict=True):
        all_series = list(engine_series(scene, experiment, results))
        for series in all_series:
            draw_engine(axes, series, "wall_s", series.runs["error"])
        cost_axis(axes)
        error_axis(axes)
        axes.set(xlabel="run time (s)", ylabel=label, title=title)
        if legend := [series.key for series in all_series if np.isfinite(series.runs["error"]).any()]:
            add_legend(figure, legend, title, edge)
    summary = results[ENGINES_STAGE].summary
    return figure, (summary["reference"][scene], summary["conclusions"][scene][SAME_LAW])


def draw_engine(axes: Axes, series: Series, cost: str, values: Array) -> None:
    valid = np.isfinite(series.runs[cost]) & np.isfinite(values) & (values > 0.0)
    axes.plot(series.runs[cost][valid], values[valid], **series.line)


def draw_periods(scene: str, results: Results) -> Drawn:
    """Plot the last step's period over the time step on native contact. ADAMS's law and the rigid gait are lines."""
    figure, axes = panels(4.2)
    all_series = list(engine_series(scene, OWN_LAW, results))
    summary = results[ENGINES_STAGE].summary
    engines = [series for series in all_series if series.engine != OURS]
    reference = summary["reference"][scene]
    for series in engines:
        draw_engine(axes, series, "step_s", np.where(series.completed, series.runs["period_s"], np.nan))
    levels = [axes.axhline(reference["period_s"], color=CONTACT_LOOK.colour, linewidth=1.6, label="ADAMS's law")]
    if "rigid_period_s" in reference:
        level = reference["rigid_period_s"]
        levels.append(axes.axhline(level, color=GREY, linewidth=1.2, linestyle=":", label="rigid gait"))
    cost_axis(axes)
    axes.set(xlabel="step size (s)", ylabel="period of the last step (s)")
    add_legend(figure, [*levels, *(series.key for series in engines if series.completed.any())])
    failed = [
        (series.look.label, series.runs["step_s"][~series.completed])
        for series in all_series
        if not series.completed.all()
    ]
    return figure, (summary["conclusions"][scene][OWN_LAW], failed)


SCENES = ("rigid", "contact", "contact-near-rigid")
METHOD_NEEDS = {
    scene: Need("accuracy", f"{scene}/rows", METHOD_VARIABLES, f"the scene {scene} was not measured")
    for scene in SCENES
}
ENGINE_NEEDS = {
    scene: Need(ENGINES_STAGE, ENGINE_RUNS, ENGINE_VARIABLES, f"the scene {scene} was not walked", scene)
    for scene in ("compass", "kneed")
}
FIGURES = tuple(
    Illustration(f"{about}-{scene}", (need,), partial(draw, scene), words=about, scene=scene)
    for about, needs, draw in (
        ("accuracy", METHOD_NEEDS, draw_methods),
        ("engines-errors", ENGINE_NEEDS, draw_errors),
        ("engines-periods", ENGINE_NEEDS, draw_periods),
    )
    for scene, need in needs.items()
)
