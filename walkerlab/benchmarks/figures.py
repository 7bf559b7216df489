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

from walkerlab.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW
from walkerlab.figures.canvas import add_legend, cost_axis, entry, error_axis, panels
from walkerlab.figures.illustration import Drawn, Illustration, Need, Results
from walkerlab.figures.style import BLACK, BLUE, CONTACT, GREEN, GREY, ORANGE, PALE, PURPLE, VERMILLION, Look
from walkerlab.figures.walks import Array

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

DASHED, DOTTED = (0.0, (3.2, 1.4)), (0.0, (1.0, 1.2))


@dataclass(frozen=True)
class Series:
    """Runs of a method, or of an integrator or contact model of an engine, from coarse to fine.

    runs    stored columns; gaps are NaN
    filled  whether the markers are filled
    engine  empty for methods
    """

    look: Look
    runs: Mapping[str, Array]
    filled: bool
    engine: str = ""

    @property
    def line(self) -> dict[str, Any]:
        marked = {"marker": self.look.marker, "markersize": 4.0}
        return {**self.look.line, **marked, "markerfacecolor": self.look.colour if self.filled else "none"}

    @property
    def key(self) -> Line2D:
        """Legend entry."""
        return entry(self.look.label, **self.line)

    @property
    def walked(self) -> NDArray[np.bool_]:
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
OTHERS = Look("", BLACK, DOTTED, 1.0, "*")
METHOD_VARIABLES = ("method", "tolerance", "reached", "error", "wall_s", "rhs_evaluations", "outcome")
SMALLEST = 1e-17  # below any floor
FAILED = 30.0  # where failures are drawn, in terms of the largest error


def series_of(scene: str, results: Results) -> Iterator[Series]:
    """Yield the methods in the order measured; fully compiled methods have filled markers."""
    rows = results["accuracy"].groups[f"{scene}/rows"]
    methods = rows["method"].astype(str)
    for name in dict.fromkeys(methods.tolist()):
        look = LOOKS.get(name, replace(OTHERS, label=name))
        yield Series(look, {one: rows[one][methods == name] for one in METHOD_VARIABLES}, look.style == "-")


def draw_methods(scene: str, results: Results) -> Drawn:
    """Plot error over run time (left) and over right-hand sides (right), with crosses for failed runs.

    The caption gets the conclusion, the reference, whether its method is measured too, and the failed runs.
    """
    every, summary = list(series_of(scene, results)), results["accuracy"].summary
    reference = summary["reference"][scene]
    # how far the reference is from a second one: errors below mean nothing
    floor = max(float(reference["agreement"]), SMALLEST)
    errors = [float(np.max(one.runs["error"], where=one.runs["reached"] != 0, initial=floor)) for one in every]
    failed = FAILED * max(errors)
    figure, (left, right) = panels(3.9, 1, 2, sharey=True)
    costs_of = ((left, "wall_s", "run time (s)"), (right, "rhs_evaluations", "right-hand sides"))
    for axes, name, label in costs_of:
        axes.set_xlabel(label)
        axes.axhspan(SMALLEST, floor, color=PALE, zorder=0)
        for one in every:
            there, cost, order = one.runs["reached"] != 0, one.runs[name].astype(float), one.look.order
            axes.plot(cost[there], np.maximum(one.runs["error"][there], floor), **one.line, zorder=order)
            cross: dict[str, Any] = {"color": one.look.colour, "linestyle": "none", "marker": "x", "markersize": 5.0}
            axes.plot(cost[~there], np.full(np.count_nonzero(~there), failed), **cross, zorder=order)
        cost_axis(axes)
        error_axis(axes)
        axes.set_ylim(0.3 * floor, 4.0 * failed)
    left.set(ylabel="error of the end state (SI)", title="(a) against run time")
    right.set_title("(b) against right-hand sides")
    add_legend(figure, entries(every, floor))
    failures = [
        (one.look.label, one.runs["tolerance"][row], one.runs["outcome"][row])
        for one in every
        for row in np.flatnonzero(one.runs["reached"] == 0)
    ]
    itself = any(one.look.label == reference["method"] for one in every)
    return figure, (summary["conclusions"][scene], reference, itself, failures)


def entries(every: Sequence[Series], floor: float) -> list[Line2D]:
    """Legend entries of the methods, of failures and of the reference uncertainty."""
    found = [one.key for one in every]
    if not all(one.runs["reached"].all() for one in every):
        found.append(entry("end not reached", color=BLACK, linestyle="none", marker="x", markersize=5.0))
    return [*found, entry(f"reference uncertainty {floor:.0e}", color=PALE, linewidth=6.0)]


ENGINES_STAGE, ENGINE_RUNS = "engines", "rows"
OF_A_SERIES = ("step_s", "error", "wall_s", "period_s", "outcome")
ENGINE_VARIABLES = ("scene", "engine", "experiment", "integrator", "start", *OF_A_SERIES)
COLOURS = {OURS: BLACK, "mujoco": VERMILLION, "drake": BLUE, "exudyn": GREEN}
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
DASHES: tuple[LineStyleType, ...] = ("-", DASHED, DOTTED, (0.0, (5.0, 1.2, 1.0, 1.2)), (0.0, (2.0, 2.0)))


def engines_of(scene: str, experiment: str, results: Results) -> Iterator[Series]:
    """Yield an experiment's series, started on the gait, in the order measured; the first of each engine is filled."""
    rows = results[ENGINES_STAGE].groups[ENGINE_RUNS]
    engines, names = rows["engine"].astype(str), rows["integrator"].astype(str)
    here = (rows["scene"] == scene) & (rows["experiment"] == experiment)
    places: dict[str, int] = {}
    for engine, name in dict.fromkeys(zip(engines[here].tolist(), names[here].tolist(), strict=True)):
        mine = here & (engines == engine) & (names == name) & (rows["start"] == 1.0)
        place = places[engine] = places.get(engine, -1) + 1
        style, marker = DASHES[place % len(DASHES)], MARKERS[place % len(MARKERS)]
        look = Look(f"{engine} {name}", COLOURS.get(engine, GREY), style, 1.8 if engine == OURS else 1.1, marker)
        yield Series(look, {variable: rows[variable][mine] for variable in OF_A_SERIES}, place == 0, engine)


def draw_errors(scene: str, results: Results) -> Drawn:
    """Plot the same law (left) and each engine's own contact (right), with a legend each, since looks are reused.

    The caption gets the reference and the conclusion on the same law.
    """
    figure, both = panels(4.6, 1, 2)
    experiments = (
        (SAME_LAW, "upper", "(a) ADAMS's law in each integrator", "error of the end state (SI)"),
        (OWN_LAW, "lower", "(b) each engine's own contact", "difference of the step period (s)"),
    )
    for axes, (experiment, edge, title, label) in zip(both, experiments, strict=True):
        every = list(engines_of(scene, experiment, results))
        for one in every:
            draw_engine(axes, one, "wall_s", one.runs["error"])
        cost_axis(axes)
        error_axis(axes)
        axes.set(xlabel="run time (s)", ylabel=label, title=title)
        found = [one.key for one in every if np.isfinite(one.runs["error"]).any()]
        if found:
            add_legend(figure, found, title, edge)
    summary = results[ENGINES_STAGE].summary
    return figure, (summary["reference"][scene], summary["conclusions"][scene][SAME_LAW])


def draw_engine(axes: Axes, one: Series, cost: str, values: Array) -> None:
    there = np.isfinite(one.runs[cost]) & np.isfinite(values) & (values > 0.0)
    axes.plot(one.runs[cost][there], values[there], **one.line)


def draw_periods(scene: str, results: Results) -> Drawn:
    """Plot the last step's period over step size on own contact, with ADAMS's law and the rigid gait as levels.

    The caption gets the conclusion and the step sizes of runs that failed.
    """
    figure, axes = panels(4.2)
    every, summary = list(engines_of(scene, OWN_LAW, results)), results[ENGINES_STAGE].summary
    engines, reference = [one for one in every if one.engine != OURS], summary["reference"][scene]
    for one in engines:
        draw_engine(axes, one, "step_s", np.where(one.walked, one.runs["period_s"], np.nan))
    levels = [axes.axhline(reference["period_s"], color=CONTACT.colour, linewidth=1.6, label="ADAMS's law")]
    if "rigid_period_s" in reference:
        level = reference["rigid_period_s"]
        levels.append(axes.axhline(level, color=GREY, linewidth=1.2, linestyle=":", label="rigid gait"))
    cost_axis(axes)
    axes.set(xlabel="step size (s)", ylabel="period of the last step (s)")
    add_legend(figure, [*levels, *(one.key for one in engines if one.walked.any())])
    failed = [(one.look.label, one.runs["step_s"][~one.walked]) for one in every if not one.walked.all()]
    return figure, (summary["conclusions"][scene][OWN_LAW], failed)


SCENES = ("rigid", "contact", "contact-near-rigid")
MEASURED = {
    scene: Need("accuracy", f"{scene}/rows", METHOD_VARIABLES, f"the scene {scene} was not measured")
    for scene in SCENES
}
WALKED = {
    scene: Need(ENGINES_STAGE, ENGINE_RUNS, ENGINE_VARIABLES, f"the scene {scene} was not walked", scene)
    for scene in ("compass", "kneed")
}
FIGURES = tuple(
    Illustration(f"{about}-{scene}", (need,), partial(draw, scene), words=about, scene=scene)
    for about, needs, draw in (
        ("accuracy", MEASURED, draw_methods),
        ("engines-errors", WALKED, draw_errors),
        ("engines-periods", WALKED, draw_periods),
    )
    for scene, need in needs.items()
)
