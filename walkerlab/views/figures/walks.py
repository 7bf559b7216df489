"""Figures of the walks of both models: 5, 7 and 10 (over time), 9 (limit cycles), and two runs overlaid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import is_
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from walkerlab.labels import CONTACT_STAGE, RIGID_STAGE
from walkerlab.pipeline.headlines import claims
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.views.figures.canvas import add_legend, entry, figure_style, files_of, label_of, panels
from walkerlab.views.figures.illustration import Drawn, Need, Results, paper_figure
from walkerlab.views.figures.style import BLUE, CONTACT_LOOK, GREY, ORANGE, PALE, RECORDED, RIGID_LOOK, Look

Array = NDArray[np.float64]

COMPARE_STAGE = "compare"
TUNE_STAGE = "tune"
RECORDED_STAGE = "recorded-walk"
TRAJECTORY = "trajectory"
STEPS = "steps"
STATE_VARIABLES = ("time", "angle", "velocity", "stance_leg")
JOINTS = ("hip_along_m", "hip_height_m", "foot_along_m", "foot_height_m")
ENERGIES = ("time", "kinetic_J", "potential_J", "mechanical_J")

NO_STATES = "'states' is not among the config's outputs"
NO_ENERGIES = "'energies' is not among the config's outputs"
NO_STEP = "no step was completed"
TOUCHES = "touch_time_s"

RIGID_STATES = Need(RIGID_STAGE, TRAJECTORY, STATE_VARIABLES, NO_STATES)
RIGID_ENERGIES = Need(RIGID_STAGE, TRAJECTORY, ENERGIES, NO_ENERGIES)
STEPS_TAKEN_RIGID, STEPS_TAKEN_CONTACT = (
    Need(stage, STEPS, (TOUCHES, "touch_along_m"), NO_STEP) for stage in (RIGID_STAGE, CONTACT_STAGE)
)

PAPER_STRIDES = 5
"""Number of strides in the figures over time, as in the paper."""
STRIKE_WIDTH = 0.6


def claims_in(results: Results) -> Sequence[Mapping[str, Any]]:
    """Return the values that a study claims for this scene, or () if no study covers it."""
    return claims(results[COMPARE_STAGE].summary) if COMPARE_STAGE in results else ()


@dataclass(frozen=True, eq=False)
class DrawnWalk:
    """A walk to plot over time. `time` has the times (samples,) of its samples in s."""

    look: Look  # style of its model
    outcome: str  # how the walk ended
    steps: int  # number of steps of the whole walk
    strikes: Array  # (shown steps,) times of the heel strikes, s
    samples: Group  # variables stored over time
    end: int | None = None  # number of samples shown; None for all
    recorded: bool = False  # whether the walk was recorded outside walkerlab; it then has a name of its own

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.samples[name][: self.end]

    @property
    def time(self) -> Array:
        return self["time"]

    def label(self, words: str, name: str) -> str:
        return label_of(words, self.samples.variables[name].units)

    def first_strides(self, strides: int) -> "DrawnWalk":
        strikes = self.strikes[: 2 * strides]
        if strikes.size == self.strikes.size:
            return self
        end = int(np.searchsorted(self.time, strikes[-1], side="right"))
        return replace(self, strikes=strikes, end=end)


def walks_with(results: Results, names: tuple[str, ...]) -> list[DrawnWalk]:
    """Return the walks whose trajectories have the given variables, the rigid model's walk first."""
    every = ((RIGID_STAGE, RIGID_LOOK), (CONTACT_STAGE, CONTACT_LOOK), (RECORDED_STAGE, RECORDED))
    available = [
        (stage, look) for stage, look in every if not Need(stage, TRAJECTORY, names, "").missing_in(results, {})
    ]
    return [walk_of(results[stage], look) for stage, look in available]


def walk_of(result: Content, look: Look) -> DrawnWalk:
    """Return a stored walk in the style of its model. The label of a recorded walk is its name."""
    times = touch_times(result.groups.get(STEPS, Group({})))
    recorded = look is RECORDED
    look = replace(RECORDED, label=str(result.summary["name"])) if recorded else look
    return DrawnWalk(look, str(result.summary["outcome"]), times.size, times, result[TRAJECTORY], recorded=recorded)


def touch_times(steps: Group) -> Array:
    """Return the times of the heel strikes (s). The array is empty if no step was completed."""
    return steps[TOUCHES] if TOUCHES in steps.variables else np.zeros(0)


def first_strides(walks: list[DrawnWalk], strides: int = PAPER_STRIDES) -> tuple[list[DrawnWalk], str]:
    """Return the first strides of the walks and, if any walk is longer, ' (the first 5 strides)' for the caption."""
    cut = [walk.first_strides(strides) for walk in walks]
    return cut, "" if all(map(is_, cut, walks)) else f" (the first {strides} strides)"


def time_axes(rows: int, row_height: float, walks: list[DrawnWalk]) -> tuple[Figure, list[Axes]]:
    """Create panels that share the time axis, with lines at the heel strikes of all walks."""
    figure, column = panels(0.85 + rows * row_height, rows, sharex=True, squeeze=False)
    axes = list(column[:, 0])
    for panel in axes:
        for walk in walks:
            look = walk.look
            across = panel.get_xaxis_transform()
            panel.vlines(walk.strikes, 0.0, 1.0, look.colour, look.style, transform=across, lw=STRIKE_WIDTH, zorder=1.5)
    end = max(float(walk.time[-1]) for walk in walks)
    if end > 0.0:
        axes[-1].set_xlim(0.0, 1.01 * end)
    axes[-1].set_xlabel("time (s)")
    figure.align_ylabels(axes)
    return figure, axes


def plot_over_time(
    walks: list[DrawnWalk], row_height: float, rows: Sequence[tuple[str, str, int | None, str]]
) -> tuple[Figure, list[Axes]]:
    """Plot variables of walks over time, a row for each (variable, axis label, leg or None, title)."""
    figure, axes = time_axes(len(rows), row_height, walks)
    for panel, (name, words, leg, title) in zip(axes, rows, strict=True):
        for walk in walks:
            line(panel, walk.time, walk[name] if leg is None else walk[name][:, leg], walk.look)
        panel.set(ylabel=walks[0].label(words, name), title=title)
    return figure, axes


def line(axes: Axes, x: Array, y: Array, look: Look) -> None:
    axes.plot(x, y, **look.line, zorder=look.order)


def strike_entry(look: Look) -> Artist:
    """Return the legend entry of a model's heel strikes, a vertical line as in the figure."""
    label = f"heel strike, {look.label.split()[0]}"
    return entry(label, color=look.colour, linestyle="none", marker="|", markersize=11.0, markeredgewidth=STRIKE_WIDTH)


def legend(figure: Figure, walks: list[DrawnWalk], *more: Artist) -> None:
    looks = [walk.look for walk in walks]
    models = [entry(look.label, **look.line) for look in looks]
    add_legend(figure, [*models, *(strike_entry(look) for look in looks), *more])


ADJUSTED = Need(TUNE_STAGE, "adjusted", ("time", "velocity"), "no start in the search leads to walking")
FROM_RIGID = Need(TUNE_STAGE, "rigid_start", ("time", "velocity"), "the rigid model took no step")


def redoes_the_procedure(results: Results) -> bool:
    """Whether the walker is the paper's compass.

    If so, the figure reproduces one of the paper's and uses the paper's names for the legs.
    """
    return "paper_start" in results[TUNE_STAGE].summary


def draw_adjusted(results: Results) -> Drawn:
    """Plot each leg's velocity in two walks: of the rigid model, and of the contact model from the adjusted start."""
    result = results[TUNE_STAGE]
    named = redoes_the_procedure(results)
    outcome = str(result.summary["procedure"]["adjusted"]["outcome"])
    whole = []
    for group, look, end in (("rigid_start", RIGID_LOOK, "walked"), ("adjusted", CONTACT_LOOK, outcome)):
        times = touch_times(result[group])
        whole.append(DrawnWalk(look, end, times.size, times, result[group]))
    walks, extent = first_strides(whole)
    links = ("link 1", "link 2") if named else ("the first swing leg", "the first stance leg")
    titles = [f"({'ab'[leg]}) angular velocity of {link}" for leg, link in enumerate(links)]
    figure, _ = plot_over_time(walks, 1.9, [("velocity", "velocity", leg, title) for leg, title in enumerate(titles)])
    legend(figure, walks)
    return figure, (result.summary["adjustment"], extent, named)


STATES_IN_TIME = (
    ("angle", "angle", 0, "(a1) angle of leg 1"),
    ("angle", "angle", 1, "(a2) angle of leg 2"),
    ("velocity", "velocity", 0, "(b1) angular velocity of leg 1"),
    ("velocity", "velocity", 1, "(b2) angular velocity of leg 2"),
)


def draw_states(results: Results) -> Drawn:
    """Plot angle and angular velocity of each leg, each in its own panel, shaded while the leg is in stance."""
    walks, extent = first_strides(walks_with(results, STATE_VARIABLES))
    first = walks[0]
    figure, axes = plot_over_time(walks, 1.55, STATES_IN_TIME)
    for panel, (_, _, leg, _) in zip(axes, STATES_IN_TIME, strict=True):
        edges = np.diff((first["stance_leg"] == leg + 1).astype(int), prepend=0, append=0)
        for begin, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
            panel.axvspan(first.time[begin], first.time[end - 1], color=PALE, linewidth=0.0, zorder=0.5)
    stance = f"stance of the leg, {first.look.label.split()[0]}"
    legend(figure, walks, Patch(facecolor=PALE, edgecolor="none", label=stance))
    return figure, (extent, walks)


CYCLES = 20
"""Number of strides to show. The transient has ended by then, so later strides would only overlap."""
STEPS_PER_STRIDE = 2
EARLIER_WIDTH = 0.5
ARROW_LENGTH = 0.06
"""Length of an arrow on the cycle, as a fraction of the number of samples in a swing or stance."""


def draw_cycles(results: Results) -> Drawn:
    """Plot a phase plane for each leg on equal scales. The caption gives the strides shown and how the walks ended."""
    walks, extent = first_strides(walks_with(results, STATE_VARIABLES), CYCLES)
    figure, axes = panels(4.2, 1, 2, sharex=True, sharey=True)
    for leg, panel in enumerate(axes):
        for walk in walks:
            draw_cycles_of(panel, walk, leg)
        show_direction(panel, walks[0], leg)
        panel.set(title=f"({'ab'[leg]}) leg {leg + 1}", xlabel=walks[0].label("angle", "angle"))
    axes[0].set_ylabel(walks[0].label("angular velocity", "velocity"))
    key = [entry(walk.look.label, **walk.look.line) for walk in walks]
    if any(walk.strikes.size > STEPS_PER_STRIDE for walk in walks):
        key.append(entry("strides before the last", color=GREY, linewidth=EARLIER_WIDTH))
    for look in (walk.look for walk in walks):
        for whose, face in (("own", look.colour), ("other", "white")):
            mark: dict[str, Any] = {"marker": look.marker, "markersize": 4.5, "color": look.colour, "mfc": face}
            key.append(entry(f"{whose} heel strike, {look.label.split()[0]}", linestyle="none", **mark))
    add_legend(figure, key)
    return figure, (extent, walks)


def draw_cycles_of(axes: Axes, walk: DrawnWalk, leg: int) -> None:
    """Plot the last stride in the model's style, with earlier strides as thin lines behind it."""
    # Markers show the state just before a heel strike. They are filled if this leg strikes, and open if the other one
    # does.
    angle = walk["angle"][:, leg]
    velocity = walk["velocity"][:, leg]
    look = walk.look
    axes.plot(angle, velocity, color=look.colour, linewidth=EARLIER_WIDTH, zorder=look.order - 2)
    last = walk.time >= (walk.strikes[-1 - STEPS_PER_STRIDE] if walk.strikes.size > STEPS_PER_STRIDE else 0.0)
    line(axes, angle[last], velocity[last], look)
    before = np.maximum(np.searchsorted(walk.time, walk.strikes[-STEPS_PER_STRIDE:]) - 1, 0)
    strikes_itself = walk["stance_leg"][before] != leg + 1
    for rows, face in ((before[strikes_itself], look.colour), (before[~strikes_itself], "white")):
        axes.plot(
            angle[rows], velocity[rows], linestyle="none", marker=look.marker, markersize=4.5,
            markerfacecolor=face, markeredgecolor=look.colour, zorder=look.order + 2,
        )  # fmt: skip


def show_direction(axes: Axes, walk: DrawnWalk, leg: int) -> None:
    """Draw arrowheads in the middle of the leg's first swing and first stance."""
    carries = walk["stance_leg"] == leg + 1
    for phase in (carries, ~carries):
        rows = np.flatnonzero(phase)
        first = rows[: np.argmax(np.diff(rows, append=rows[-1] + 2) > 1) + 1] if rows.size else rows
        if first.size < 3:
            continue
        middle = first[first.size // 2]
        ahead = first[first.size // 2 + max(1, int(ARROW_LENGTH * first.size))]
        tail, head = (tuple(walk[name][row, leg] for name in ("angle", "velocity")) for row in (middle, ahead))
        arrow = {"arrowstyle": "-|>", "color": walk.look.colour, "mutation_scale": 13.0, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", xy=head, xytext=tail, arrowprops=arrow, zorder=7)


ENERGIES_IN_TIME = (
    ("kinetic_J", "energy", None, "(a) kinetic energy"),
    ("potential_J", "energy", None, "(b) potential energy, zero at the step's foothold"),
    ("mechanical_J", "energy", None, "(c) mechanical energy"),
)
SMALLEST_SPAN = 0.005
"""Minimum span of the axis of the mechanical energy, relative to the energy, so that a constant energy looks
constant."""
RANGE_MARGIN = 0.08
TRIMMED_SHARE = 0.005
"""The axis ignores this fraction of the samples at each end of the range, because they lie in impacts."""


def draw_energies(results: Results) -> Drawn:
    """Plot kinetic, potential and mechanical energy over time, each in its own panel."""
    walks, extent = first_strides(walks_with(results, ENERGIES))
    figure, axes = plot_over_time(walks, 1.75, ENERGIES_IN_TIME)
    ends = np.array([np.quantile(walk["mechanical_J"], (TRIMMED_SHARE, 1.0 - TRIMMED_SHARE)) for walk in walks])
    bottom = float(ends[:, 0].min())
    top = float(ends[:, 1].max())
    lacking = max(0.0, SMALLEST_SPAN * max(abs(bottom), abs(top)) - (top - bottom))
    room = 0.5 * lacking + RANGE_MARGIN * (top - bottom)
    axes[-1].set_ylim(bottom - room, top + room)
    legend(figure, walks)
    means = []
    for walk in walks:
        energy = walk["mechanical_J"]
        duration = walk.time[-1] - walk.time[0]
        means.append((walk.look.label, np.trapezoid(energy, walk.time) / duration if duration else energy[0]))
    impacts = any(walk.look is CONTACT_LOOK for walk in walks)
    config = results[RIGID_STAGE].identity.config_slice
    driven = any((config["push_off"]["impulse_N_s"], *config["walker"]["hip"].values()))
    return figure, (extent, means, bool(claims_in(results)), impacts, driven, walks)


OVERLAY_ROWS: Final[tuple[tuple[str, Any, str], ...]] = (
    ("angle", 0, "angle of leg 1 (rad)"),
    ("angle", 1, "angle of leg 2 (rad)"),
    ("mechanical_J", slice(None), "energy (J)"),
)
RUN_LOOKS: Final[tuple[dict[str, Any], ...]] = (
    {"color": BLUE, "linewidth": 1.3},
    {"color": ORANGE, "linewidth": 1.2, "linestyle": (0.0, (3.2, 1.4))},
)


def draw_runs(
    first: Mapping[str, Content], second: Mapping[str, Content], names: tuple[str, str]
) -> list[bytes] | None:
    """Draw the walks of two runs overlaid, as SVG and PNG, or return None if no stage has sampled walks in both
    runs."""
    both = [
        (stage, [run[stage].groups["trajectory"] for run in (first, second)])
        for stage in (RIGID_STAGE, CONTACT_STAGE)
        if all(stage in run and run[stage].groups.get("trajectory") for run in (first, second))
    ]
    if not both:
        return None
    with figure_style():
        return files_of(draw_overlay(both, names), "diff", f"{names[0]} and {names[1]}")


def draw_overlay(both: list[tuple[str, list[Group]]], names: tuple[str, str]) -> Figure:
    """Plot the trajectories of both runs in a column for each stage, with rows for the angles of the legs and the
    energy."""
    rows, columns = len(OVERLAY_ROWS), len(both)
    figure, axes = panels(0.5 + 1.9 * rows, rows, columns, sharex="col", sharey="row", squeeze=False)
    for row, (variable, leg, label) in zip(axes, OVERLAY_ROWS, strict=True):
        row[0].set_ylabel(label)
        for panel, (_, groups) in zip(row, both, strict=True):
            for group, look in zip(groups, RUN_LOOKS, strict=True):
                if variable in group.variables:
                    panel.plot(group["time"], group[variable][..., leg], **look)
    for top, bottom, (stage, _) in zip(axes[0], axes[-1], both, strict=True):
        top.set_title(stage)
        bottom.set_xlabel("time (s)")
    add_legend(figure, [entry(name, **look) for name, look in zip(names, RUN_LOOKS, strict=True)])
    return figure


FIGURES = (
    paper_figure(5, (ADJUSTED, FROM_RIGID), draw_adjusted),
    paper_figure(7, (RIGID_STATES,), draw_states),
    paper_figure(9, (RIGID_STATES,), draw_cycles),
    paper_figure(10, (RIGID_ENERGIES,), draw_energies),
)
