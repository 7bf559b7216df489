"""The walk in other engines: error against run time on the same law and on their own, and the period that comes out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from walkerlab.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW
from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import Illustration
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, CONTACT, GREEN, GREY, ORANGE, PURPLE, RIGID, VERMILLION

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

HEIGHT = 4.2  # in
STAGE, GROUP = "engines", "rows"
VARIABLES = ("scene", "engine", "experiment", "integrator", "start", "step_s", "error", "wall_s", "period_s", "outcome")
COLOURS = {OURS: BLACK, "mujoco": VERMILLION, "drake": BLUE, "exudyn": GREEN}
OTHERS = (ORANGE, PURPLE, GREY)
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
DASHES: tuple[LineStyleType, ...] = (
    "-",
    (0.0, (3.2, 1.4)),
    (0.0, (1.0, 1.2)),
    (0.0, (5.0, 1.2, 1.0, 1.2)),
    (0.0, (2.0, 2.0)),
)


@dataclass(frozen=True)
class EngineSeries:
    """The runs of one integrator, or contact, of one engine from the gait, from coarse to fine; gaps are NaN."""

    engine: str
    name: str
    place: int  # among those of its engine
    step_s: NDArray[np.float64]
    error: NDArray[np.float64]
    wall_s: NDArray[np.float64]
    period_s: NDArray[np.float64]
    walked: NDArray[np.bool_]

    @property
    def label(self) -> str:
        """In legends."""
        return f"{self.engine} {self.name}"

    @property
    def line(self) -> Line2D:
        """Its look, as a line for a legend."""
        colour = COLOURS.get(self.engine, OTHERS[len(self.engine) % len(OTHERS)])
        return Line2D(
            [],
            [],
            color=colour,
            linestyle=DASHES[self.place % len(DASHES)],
            linewidth=1.8 if self.engine == OURS else 1.1,
            marker=MARKERS[self.place % len(MARKERS)],
            markersize=4.0,
            markerfacecolor=colour if self.place == 0 else "none",
            label=self.label,
        )


def series_of(scene: str, experiment: str, results: Results) -> Iterator[EngineSeries]:
    """The series in the order in which they were measured."""
    rows = results[STAGE].groups[GROUP]
    texts = {name: [str(value) for value in rows[name]] for name in ("scene", "engine", "experiment", "integrator")}
    start = np.asarray(rows["start"])
    keys = list(zip(texts["scene"], texts["experiment"], texts["engine"], texts["integrator"], strict=True))
    here = [key for key in dict.fromkeys(keys) if key[:2] == (scene, experiment)]
    walked = np.array([str(outcome) == "walked" for outcome in rows["outcome"]])
    engines = [key[2] for key in here]
    for number, key in enumerate(here):
        mine = np.array([other == key for other in keys]) & (start == 1.0)
        step, error, wall, period = (
            np.asarray(rows[name], float)[mine] for name in ("step_s", "error", "wall_s", "period_s")
        )
        yield EngineSeries(key[2], key[3], engines[:number].count(key[2]), step, error, wall, period, walked[mine])


def plot_errors(scene: str, results: Results) -> Figure:
    """Same law on the left, own law on the right."""
    figure = blank(HEIGHT)
    left, right = figure.subplots(1, 2)
    same, own = list(series_of(scene, SAME_LAW, results)), list(series_of(scene, OWN_LAW, results))
    for one in same:
        draw(left, one, one.wall_s, one.error)
    for one in own:
        draw(right, one, one.wall_s, one.error)
    for axes in (left, right):
        few_ticks(axes)
        axes.set_yscale("log")
        axes.set_xlabel("run time (s)")
        axes.yaxis.set_major_locator(LogLocator(numticks=20))
        axes.yaxis.set_minor_locator(NullLocator())
    left.set_ylabel("error of the end state (SI)")
    right.set_ylabel("difference of the step period (s)")
    left.set_title("(a) ADAMS's law in each integrator")
    right.set_title("(b) each engine's own contact")
    legend_above(figure, [one.line for one in (*same, *own) if np.isfinite(one.error).any()])
    return figure


def few_ticks(axes: Axes) -> None:
    """A logarithmic axis of costs, labelled at every decade, or at 1, 2 and 5 where it spans less than two."""
    axes.set_xscale("log")
    least, most = axes.get_xlim()
    short = most < 100.0 * least
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,), numticks=20))
    axes.xaxis.set_minor_locator(NullLocator())
    if short:
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))


def draw(axes: Axes, one: EngineSeries, x: NDArray[np.float64], y: NDArray[np.float64]) -> None:
    """A series without its gaps."""
    there = np.isfinite(x) & np.isfinite(y) & (y > 0.0)
    line = one.line
    line.set_data(x[there], y[there])
    axes.add_line(line)
    axes.autoscale_view()


def plot_periods(scene: str, results: Results) -> Figure:
    """Period of the last step over step size, own contact, with ADAMS's law and the rigid gait as levels."""
    figure = blank(HEIGHT)
    axes = figure.subplots()
    every = [one for one in series_of(scene, OWN_LAW, results) if one.engine != OURS]
    for one in every:
        draw(axes, one, one.step_s, np.where(one.walked, one.period_s, np.nan))
    reference = results[STAGE].summary["reference"][scene]
    levels = [axes.axhline(reference["period_s"], color=CONTACT.colour, linewidth=1.6, label="ADAMS's law")]
    if "rigid_period_s" in reference:
        rigid = axes.axhline(reference["rigid_period_s"], color=RIGID.colour, linewidth=1.2, linestyle=":")
        rigid.set_label("rigid gait")
        levels.append(rigid)
    few_ticks(axes)
    axes.set_xlabel("step size (s)")
    axes.set_ylabel("period of the last step (s)")
    legend_above(figure, [*levels, *(one.line for one in every if one.walked.any())])
    return figure


def caption_errors(scene: str, results: Results) -> str:
    """The conclusion on the same law."""
    summary = results[STAGE].summary
    reference = summary["reference"][scene]
    return (
        f"{scene}: (a) the same law in every integrator, its end state after {reference['until_s']:.3g} s against "
        f"walkerlab's own at tight tolerance, which two methods agree on to {reference['agreement']:.1e}; (b) own "
        f"contact, the last of ten steps. Runs that ended otherwise are left out. "
        f"{summary['conclusions'][scene][SAME_LAW]}"
    )


def caption_periods(scene: str, results: Results) -> str:
    """The conclusion on own contacts, with what did not walk to the end."""
    failed = [
        f"{one.label} at {', '.join(f'{step:.3g}' for step in one.step_s[~one.walked])} s"
        for one in series_of(scene, OWN_LAW, results)
        if not one.walked.all()
    ]
    missed = f" Not walked to the end: {'; '.join(failed)}." if failed else ""
    return f"{scene}: {results[STAGE].summary['conclusions'][scene][OWN_LAW]}{missed}"


@dataclass(frozen=True)
class SceneNeed(Need):
    """Rows of one scene."""

    scene: str = ""

    def missing_in(self, results: Results, absent: Mapping[str, str]) -> str | None:
        """Why the need is not met, in words; None if it is."""
        missing = super().missing_in(results, absent)
        if missing is None and self.scene not in results[self.stage].summary["reference"]:
            return f"{self.stage}: {self.or_else}"
        return missing


def figures_for(scene: str) -> tuple[Illustration, Illustration]:
    """The figures of one scene."""
    need = SceneNeed(STAGE, GROUP, VARIABLES, f"it did not walk the scene {scene}", scene)
    return (
        Illustration(
            f"engines-errors-{scene}",
            f"Other engines, {scene}: error against run time",
            (need,),
            partial(caption_errors, scene),
            partial(plot_errors, scene),
        ),
        Illustration(
            f"engines-periods-{scene}",
            f"Other engines, {scene}: step period with their own contact",
            (need,),
            partial(caption_periods, scene),
            partial(plot_periods, scene),
        ),
    )


FIGURES = (*figures_for("compass"), *figures_for("kneed"))
