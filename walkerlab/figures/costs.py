"""What exactness costs: errors of methods and of other engines against run time, and figure 12, the rigid limit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from walkerlab.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW
from walkerlab.figures import style
from walkerlab.figures.canvas import blank, entry, legend_above
from walkerlab.figures.illustration import Illustration, Need, Results, paper_figure
from walkerlab.figures.walk_figures import TUNE_STAGE
from walkerlab.figures.walks import Array, redoes_the_paper
from walkerlab.paper.printed import ANGLE_ERROR
from walkerlab.store.content import Group

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

DASHED, DOTTED = (0.0, (3.2, 1.4)), (0.0, (1.0, 1.2))
METHODS_HEIGHT, ENGINES_HEIGHT = 3.9, 4.2  # in


def decades(axes: Axes) -> None:
    """A logarithmic axis of errors, with labels at fewer decades where letters would meet."""
    if np.isfinite(axes.dataLim.intervaly).all():
        axes.set_yscale("log")
        label_ticks(axes.yaxis, 20 if axes.figure.bbox.width > style.NARROW_BELOW * axes.figure.dpi else 8)


def label_ticks(axis: Axis, most: int) -> None:
    """Labels of a logarithmic axis: at every decade, at most so many, or at 1, 2 and 5 where it spans less than two."""
    least, last = axis.get_view_interval()
    short = last < 100.0 * least
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,), numticks=most))
    axis.set_minor_locator(NullLocator())
    if short:
        axis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))


LOOKS = {
    "dop853": style.Look("dop853", style.BLUE, "-", 1.8, "o", order=5),
    "radau5": style.Look("radau5", style.VERMILLION, "-", 1.8, "s", order=5),
    "scipy-rk45": style.Look("scipy-rk45", style.GREEN, DASHED, 1.0, "v"),
    "scipy-dop853": style.Look("scipy-dop853", style.BLUE, DASHED, 1.0, "o"),
    "scipy-lsoda": style.Look("scipy-lsoda", style.ORANGE, DASHED, 1.0, "^"),
    "scipy-radau": style.Look("scipy-radau", style.VERMILLION, DASHED, 1.0, "s"),
    "scipy-bdf": style.Look("scipy-bdf", style.PURPLE, DASHED, 1.0, "D"),
    "cvode-bdf": style.Look("cvode-bdf", style.PURPLE, DOTTED, 1.0, "d"),
    "cvode-adams": style.Look("cvode-adams", style.GREEN, DOTTED, 1.0, "<"),
    "scipy-dop853-numpy": style.Look("scipy-dop853-numpy", style.GREY, DOTTED, 1.2, "P"),
}
OTHERS = style.Look("", style.BLACK, DOTTED, 1.0, "*")
METHOD_VARIABLES = ("method", "tolerance", "reached", "error", "wall_s", "rhs_evaluations", "outcome")
SMALLEST = 1e-17  # below any floor
FAILED = 30.0  # where failures are drawn, in terms of the largest error


@dataclass(frozen=True)
class MethodSeries:
    """One method's runs on a scene, from loose to tight tolerance."""

    look: style.Look
    runs: Mapping[str, Array]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Which of the runs came to the end."""
        return np.asarray(self.runs["reached"] != 0)

    @property
    def line(self) -> dict[str, Any]:
        """What matplotlib is told of its line; filled marks are those of methods that are compiled as a whole."""
        filled = self.look.colour if self.look.style == "-" else "none"
        return {**self.look.line, "marker": self.look.marker, "markersize": 4.0, "markerfacecolor": filled}


def series_of(scene: str, results: Results) -> Iterator[MethodSeries]:
    """The methods in the order in which they were measured."""
    rows = results["accuracy"].groups[f"{scene}/rows"]
    methods = rows["method"].astype(str)
    for name in dict.fromkeys(methods.tolist()):
        look = LOOKS.get(name, style.Look(name, OTHERS.colour, OTHERS.style, OTHERS.width, OTHERS.marker))
        yield MethodSeries(look, {variable: rows[variable][methods == name] for variable in METHOD_VARIABLES})


def agreement(scene: str, results: Results) -> float:
    """How far the reference is from a second one: errors below mean nothing."""
    return float(results["accuracy"].summary["reference"][scene]["agreement"])


def plot_methods(scene: str, results: Results) -> Figure:
    """Run time on the left, right-hand sides on the right, one line for each method."""
    every = list(series_of(scene, results))
    floor = max(agreement(scene, results), SMALLEST)
    errors = [float(one.runs["error"][one.reached].max()) for one in every if one.reached.any()]
    failed = FAILED * max([floor, *errors])
    figure = blank(METHODS_HEIGHT)
    left, right = figure.subplots(1, 2, sharey=True)
    panels = ((left, "wall_s", "run time (s)"), (right, "rhs_evaluations", "right-hand sides (1)"))
    for axes, cost, label in panels:
        axes.set(xscale="log", xlabel=label)
        axes.axhspan(SMALLEST, floor, color=style.PALE, zorder=0)
        for one in every:
            draw_method(axes, one, one.runs[cost].astype(float), floor, failed)
        decades(axes)
        axes.set_ylim(0.3 * floor, 4.0 * failed)
    left.set(ylabel="error of the end state (SI)", title="(a) against run time")
    right.set_title("(b) against right-hand sides")
    legend_above(figure, entries(every, floor))
    return figure


def draw_method(axes: Axes, one: MethodSeries, cost: Array, floor: float, failed: float) -> None:
    """The runs that reached the end as a line, the others as crosses above everything."""
    there, order = one.reached, one.look.order
    axes.plot(cost[there], np.maximum(one.runs["error"][there], floor), **one.line, zorder=order)
    crosses = np.full(int((~there).sum()), failed)
    axes.plot(cost[~there], crosses, color=one.look.colour, linestyle="none", marker="x", markersize=5.0, zorder=order)


def entries(every: Sequence[MethodSeries], floor: float) -> list[Line2D]:
    """The legend: methods, failures, and what is below the reference's own uncertainty."""
    methods = [entry(one.look.label, **one.line) for one in every]
    cross = entry("end not reached", color=style.BLACK, linestyle="none", marker="x", markersize=5.0)
    known = entry(f"reference unsure, {floor:.0e}", color=style.PALE, linewidth=6.0)
    return [*methods, *([] if all(one.reached.all() for one in every) else [cross]), known]


def tell_methods(scene: str, results: Results) -> tuple[Any, ...]:
    """The conclusion, the reference, whether it is measured too, and what did not reach the end."""
    summary, every = results["accuracy"].summary, list(series_of(scene, results))
    reference = summary["reference"][scene]
    failures = [
        (one.look.label, tolerance, outcome)
        for one in every
        for tolerance, outcome, reached in zip(one.runs["tolerance"], one.runs["outcome"], one.reached, strict=True)
        if not reached
    ]
    itself = any(one.look.label == reference["method"] for one in every)
    return summary["conclusions"][scene], reference, itself, failures


def methods_on(scene: str) -> Illustration:
    """The figure of one scene."""
    need = Need("accuracy", f"{scene}/rows", METHOD_VARIABLES, f"it did not measure the scene {scene}")
    plot, told = partial(plot_methods, scene), partial(tell_methods, scene)
    return Illustration(f"accuracy-{scene}", (need,), plot, told, words="accuracy", scene=scene)


ACCURACY = tuple(methods_on(scene) for scene in ("rigid", "contact", "contact-near-rigid"))

ENGINES_STAGE, ENGINE_RUNS = "engines", "rows"
OF_A_SERIES = ("step_s", "error", "wall_s", "period_s", "outcome")
ENGINE_VARIABLES = ("scene", "engine", "experiment", "integrator", "start", *OF_A_SERIES)
COLOURS = {OURS: style.BLACK, "mujoco": style.VERMILLION, "drake": style.BLUE, "exudyn": style.GREEN}
OTHER_ENGINES = (style.ORANGE, style.PURPLE, style.GREY)
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
DASHES: tuple[LineStyleType, ...] = ("-", DASHED, DOTTED, (0.0, (5.0, 1.2, 1.0, 1.2)), (0.0, (2.0, 2.0)))


@dataclass(frozen=True)
class EngineSeries:
    """The runs of one integrator, or contact, of one engine from the gait, from coarse to fine; gaps are NaN."""

    engine: str
    name: str
    place: int  # among those of its engine
    runs: Mapping[str, Array]

    @property
    def label(self) -> str:
        """In legends."""
        return f"{self.engine} {self.name}"

    @property
    def walked(self) -> NDArray[np.bool_]:
        """Which of the runs walked to the end."""
        return np.asarray(self.runs["outcome"] == "walked")

    @property
    def line(self) -> Line2D:
        """Its look, as a line for a legend."""
        colour = COLOURS.get(self.engine, OTHER_ENGINES[len(self.engine) % len(OTHER_ENGINES)])
        return entry(
            self.label, color=colour, linestyle=DASHES[self.place % len(DASHES)],
            linewidth=1.8 if self.engine == OURS else 1.1, marker=MARKERS[self.place % len(MARKERS)], markersize=4.0,
            markerfacecolor=colour if self.place == 0 else "none",
        )  # fmt: skip


def engines_of(scene: str, experiment: str, results: Results) -> Iterator[EngineSeries]:
    """The series in the order in which they were measured."""
    rows = results[ENGINES_STAGE].groups[ENGINE_RUNS]
    engine, name = rows["engine"].astype(str), rows["integrator"].astype(str)
    here = (rows["scene"] == scene) & (rows["experiment"] == experiment)
    keys = list(dict.fromkeys(zip(engine[here].tolist(), name[here].tolist(), strict=True)))
    for number, key in enumerate(keys):
        mine = here & (engine == key[0]) & (name == key[1]) & (rows["start"] == 1.0)
        place = [before for before, _ in keys[:number]].count(key[0])
        yield EngineSeries(*key, place, {variable: rows[variable][mine] for variable in OF_A_SERIES})


def plot_errors(scene: str, results: Results) -> Figure:
    """Same law on the left, own law on the right."""
    figure = blank(ENGINES_HEIGHT)
    left, right = figure.subplots(1, 2)
    same, own = (list(engines_of(scene, experiment, results)) for experiment in (SAME_LAW, OWN_LAW))
    for axes, every in ((left, same), (right, own)):
        for one in every:
            draw_engine(axes, one, "wall_s", one.runs["error"])
        costs(axes)
        decades(axes)
        axes.set_xlabel("run time (s)")
    left.set(ylabel="error of the end state (SI)", title="(a) ADAMS's law in each integrator")
    right.set(ylabel="difference of the step period (s)", title="(b) each engine's own contact")
    legend_above(figure, [one.line for one in (*same, *own) if np.isfinite(one.runs["error"]).any()])
    return figure


def costs(axes: Axes) -> None:
    """A logarithmic axis of costs; without any, the panel says so."""
    if np.isfinite(axes.dataLim.intervalx).all():
        axes.set_xscale("log")
        label_ticks(axes.xaxis, 20)
    else:
        axes.text(0.5, 0.5, "no walk came to its end", transform=axes.transAxes, ha="center")


def draw_engine(axes: Axes, one: EngineSeries, cost: str, values: Array) -> None:
    """A series without its gaps."""
    there = np.isfinite(one.runs[cost]) & np.isfinite(values) & (values > 0.0)
    line = one.line
    line.set_data(one.runs[cost][there], values[there])
    axes.add_line(line)
    axes.autoscale_view()


def plot_periods(scene: str, results: Results) -> Figure:
    """Period of the last step over step size, own contact, with ADAMS's law and the rigid gait as levels."""
    figure = blank(ENGINES_HEIGHT)
    axes = figure.subplots()
    every = [one for one in engines_of(scene, OWN_LAW, results) if one.engine != OURS]
    for one in every:
        draw_engine(axes, one, "step_s", np.where(one.walked, one.runs["period_s"], np.nan))
    reference = results[ENGINES_STAGE].summary["reference"][scene]
    levels = [axes.axhline(reference["period_s"], color=style.CONTACT.colour, linewidth=1.6, label="ADAMS's law")]
    if "rigid_period_s" in reference:
        level = reference["rigid_period_s"]
        levels.append(axes.axhline(level, color=style.GREY, linewidth=1.2, linestyle=":", label="rigid gait"))
    costs(axes)
    axes.set(xlabel="step size (s)", ylabel="period of the last step (s)")
    legend_above(figure, [*levels, *(one.line for one in every if one.walked.any())])
    return figure


def tell_errors(scene: str, results: Results) -> tuple[Any, ...]:
    """The reference, and the conclusion on the same law."""
    summary = results[ENGINES_STAGE].summary
    return summary["reference"][scene], summary["conclusions"][scene][SAME_LAW]


def tell_periods(scene: str, results: Results) -> tuple[Any, ...]:
    """The conclusion on own contacts, and the steps of what did not walk to the end."""
    every = engines_of(scene, OWN_LAW, results)
    failed = [(one.label, one.runs["step_s"][~one.walked]) for one in every if not one.walked.all()]
    return results[ENGINES_STAGE].summary["conclusions"][scene][OWN_LAW], failed


def engines_on(scene: str) -> tuple[Illustration, Illustration]:
    """The figures of one scene."""
    need = Need(ENGINES_STAGE, ENGINE_RUNS, ENGINE_VARIABLES, f"it did not walk the scene {scene}", scene)

    def one(about: str, plot: Any, tell: Any) -> Illustration:
        made = partial(plot, scene), partial(tell, scene)
        return Illustration(f"engines-{about}-{scene}", (need,), *made, words=f"engines-{about}", scene=scene)

    return one("errors", plot_errors, tell_errors), one("periods", plot_periods, tell_periods)


ENGINES = (*engines_on("compass"), *engines_on("kneed"))

ALIGNED, VELOCITY, RAW = "angle_error_rad", "velocity_error_rad_s", "raw_angle_error_rad"
NUMERICAL, WALL = "numerical_time_s", "wall_s"
LIMITS: Final = (("limit/all", "(a) feet as they are"), ("limit/all-point-foot", "(b) point feet"))
ERRORS: Final = (
    (RAW, style.Look("angle at the same time (rad)", style.VERMILLION, ":", 1.2, "v")),
    (ALIGNED, style.Look("angle in phase (rad)", style.BLUE, "-", 1.6, "o")),
    (VELOCITY, style.Look("angular velocity in phase (rad/s)", style.ORANGE, "--", 1.4, "s")),
    (NUMERICAL, style.Look("numerical error, last touch (s)", style.GREY, "-.", 1.0, "x")),
)
LIMIT = (
    Need(
        TUNE_STAGE, LIMITS[0][0], (WALL, ALIGNED, VELOCITY, RAW, NUMERICAL), "no gait to lead towards the rigid limit"
    ),
)
CLAIM: Final = (0.0, (1.0, 2.0))
LEAST = 1e-14
"""Shown in place of a numerical error of nothing, which has no place on a logarithmic axis."""


def plot_limit(results: Results) -> Figure:
    """Errors over run time, one setting a point, from the config's contact to the most rigid one."""
    figure = blank(3.6)
    found = limits(results)
    both = figure.subplots(1, len(found), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (rows, title) in zip(both, found, strict=True):
        draw_limit(axes, rows)
        if redoes_the_paper(results):
            axes.axhline(ANGLE_ERROR.value, color=style.BLACK, linestyle=CLAIM, linewidth=1.0)
        axes.set(title=title, xlabel="run time of the walk (s)")
    both[0].set_ylabel("error")
    key: list[Artist] = [entry(look.label, **look.line, marker=look.marker, markersize=4) for _, look in ERRORS]
    if redoes_the_paper(results):
        key.append(entry("the paper's claim", color=style.BLACK, linestyle=CLAIM, linewidth=1.0))
    key.append(
        entry("the config's contact", color=style.BLACK, linestyle="", marker="o", markersize=9, fillstyle="none")
    )
    legend_above(figure, key)
    return figure


def limits(results: Results) -> list[tuple[Group, str]]:
    """The series there are, with their titles: feet that roll in both models too are not made points as well."""
    stored = results[TUNE_STAGE].groups
    there = [(group, title) for group, title in LIMITS if group in stored and ALIGNED in stored[group].variables]
    found = [(stored[group], title) for group, title in there]
    return found if len(found) > 1 else [(found[0][0], "")]


def draw_limit(axes: Axes, rows: Group) -> None:
    """One series."""
    for name, look in ERRORS:
        values = np.maximum(np.abs(rows[name]), LEAST)
        axes.plot(rows[WALL], values, **look.line, marker=look.marker, markersize=4)
        if name != NUMERICAL:
            axes.plot(rows[WALL][:1], values[:1], "o", markersize=9, color=style.BLACK, fillstyle="none")
    axes.set(xscale="log", yscale="log")


def tell_limit(results: Results) -> tuple[Any, ...]:
    """What the config's contact and the most rigid one amount to, with point feet besides, and the paper's claim."""
    errors = [rows[ALIGNED] for rows, _ in limits(results)]
    point_feet = errors[1][-1] if len(errors) > 1 else None
    return errors[0][0], errors[0][-1], point_feet, ANGLE_ERROR.text if redoes_the_paper(results) else ""


FIGURE_12 = paper_figure(12, LIMIT, plot_limit, tell_limit)
