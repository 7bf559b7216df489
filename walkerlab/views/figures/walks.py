"""Figures of the walks of both models: 5, 7 and 10 (over time), 9 (limit cycles), ground forces with the friction cone,
causes of the energy lost in each step, and two runs overlaid.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import is_
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from walkerlab.labels import CONTACT_STAGE, RIGID_STAGE
from walkerlab.physics.energy_channels import KNEE_STRIKES, LOSSES, SAMPLED
from walkerlab.pipeline.headlines import claims
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.views.figures.canvas import add_legend, blank, entry, figure_style, files_of, label_of, panels
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results, paper_figure
from walkerlab.views.figures.style import BLACK, CONTACT_LOOK, GREY, LEGS, PALE, RECORDED, RIGID_LOOK, Look

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
TOUCHES = "touch_time_s"

RIGID_STATES = Need(RIGID_STAGE, TRAJECTORY, STATE_VARIABLES, NO_STATES)
RIGID_ENERGIES = Need(RIGID_STAGE, TRAJECTORY, ENERGIES, NO_ENERGIES)
STEPS_TAKEN = {
    stage: Need(stage, STEPS, (TOUCHES, "touch_along_m"), "no step was completed")
    for stage in (RIGID_STAGE, CONTACT_STAGE)
}

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
        return replace(self, strikes=strikes, end=int(np.searchsorted(self.time, strikes[-1], side="right")))


def walks_with(results: Results, names: tuple[str, ...]) -> list[DrawnWalk]:
    """Return the walks whose trajectories have the given variables, the rigid model's walk first."""
    looks = {RIGID_STAGE: RIGID_LOOK, CONTACT_STAGE: CONTACT_LOOK, RECORDED_STAGE: RECORDED}
    available = [stage for stage in looks if not Need(stage, TRAJECTORY, names, "").missing_in(results, {})]
    return [walk_of(results[stage], looks[stage]) for stage in available]


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


NORMAL_FORCE = "normal_force_N"
FRICTION = "friction_force_N"
FORCES = Need(CONTACT_STAGE, TRAJECTORY, (NORMAL_FORCE, FRICTION), "'forces' is not among the config's outputs")
TOTAL: Final = "total_energy_J"
LOSS_STYLES: Final = {loss.variable: (loss.cause, loss.colour) for loss in SAMPLED.values()}
DRIVE_LOSSES: Final = ("push_off_J", "hip_J")
KNEES: Final = (LOSSES[KNEE_STRIKES].cause, LOSSES[KNEE_STRIKES].colour)
ENERGY = Need(CONTACT_STAGE, TRAJECTORY, (*LOSS_STYLES, TOTAL), NO_ENERGIES)
SHOWN_STRIDES = 2
"""Number of strides in the figure of forces. With more strides, single impacts could not be told apart."""
SHOWN_STEPS = 40
"""Number of steps in the figure of energy losses."""
SHOWN_LOADS: Final = 0.99
"""The force axis covers this fraction of the loaded samples. It leaves out impacts of many times the weight."""
NEGLIGIBLE_LOSS: Final = 1e-3
"""A cause is drawn only if its largest loss in a step is at least this fraction of the largest total loss."""


def draw_forces(results: Results) -> Drawn:
    """Plot normal force and friction over time (left) and against each other, with the friction cone (right)."""
    result = results[CONTACT_STAGE]
    whole = walk_of(result, CONTACT_LOOK)
    walk = whole.first_strides(SHOWN_STRIDES)
    every = whole[NORMAL_FORCE]
    loads = walk[NORMAL_FORCE]
    pulls = walk[FRICTION]
    # The axis of the normal force ends at this value (N).
    top = 1.1 * float(np.quantile(loads[loads > 0.0], SHOWN_LOADS)) if (loads > 0.0).any() else 1.0
    figure = blank(4.4)
    parts = figure.subplot_mosaic([["normal", "cone"], ["friction", "cone"]])
    normal, friction, cone = (parts[name] for name in ("normal", "friction", "cone"))
    key: list[Artist] = [entry(look.label, **look.line) for look in LEGS]
    steepest = 0.0
    # Without friction there is no cone.
    for name, style in (("static", "-"), ("dynamic", "--")) if result[TRAJECTORY][FRICTION].any() else ():
        coefficient = float(result.identity.config_slice["contact"][f"{name}_friction"])
        bound: dict[str, Any] = {"color": BLACK, "linewidth": 1.0, "linestyle": style}
        for sign in (-1.0, 1.0):
            cone.plot([0.0, top], [0.0, sign * coefficient * top], **bound)
        key.append(entry(f"{name} coefficient, {coefficient:g}", **bound))
        steepest = max(steepest, coefficient)
    cone.axhline(0.0, color=GREY, linewidth=0.6)
    for look, load, pull in zip(LEGS, loads.T, pulls.T, strict=True):
        line(normal, walk.time, load, look)
        line(friction, walk.time, pull, look)
        loaded = (load > 0.0) & (load < top)
        cone.plot(load[loaded], pull[loaded], linestyle="none", marker=".", markersize=1.6, color=look.colour, zorder=4)
    # Without friction, the axis would otherwise begin and end at zero.
    reach = 1.1 * max(float(np.abs(pulls[loads < top]).max()), 1e-9)
    wide = max(reach, 0.6 * steepest * top)
    of_normal = walk.label("normal force", NORMAL_FORCE)
    of_friction = walk.label("friction", FRICTION)
    end = (0.0, float(walk.time[-1]))
    normal.set(ylabel=of_normal, title="(a) normal force", xlim=end, ylim=(-0.03 * top, top))
    friction.set(ylabel=of_friction, title="(b) friction, downhill positive", xlim=end, ylim=(-reach, reach))
    friction.sharex(normal)
    friction.set_xlabel("time (s)")
    normal.tick_params(labelbottom=False)
    cone.set(xlabel=of_normal, ylabel=of_friction, title="(c) against the friction cone")
    cone.set(xlim=(0.0, top), ylim=(-wide, wide))
    add_legend(figure, key)
    # The ratio of two forces that are almost zero means nothing.
    borne = every > 0.1 * float(np.median(every.max(axis=1)))
    ratio = float((np.abs(whole[FRICTION][borne]) / every[borne]).max()) if borne.any() else 0.0
    return figure, (0 if walk is whole else SHOWN_STRIDES, ratio, every.max())


def losses(walk: DrawnWalk) -> dict[tuple[str, str], Array]:
    """Return the energy (J) lost in each step by cause (label, colour). Losses that no other cause explains are
    attributed to the knees."""
    # Steps are divided at the last sample before a touchdown, so that the whole impact belongs to the step that it
    # starts.
    rows = np.concatenate(([0], np.maximum(np.searchsorted(walk.time, walk.strikes) - 1, 0)))
    by_cause = {cause: np.diff(walk[name][rows]) for name, cause in LOSS_STYLES.items()}
    supplied = np.sum([walk[name] for name in DRIVE_LOSSES if name in walk.samples.variables], axis=0)
    total = np.diff((supplied - walk[TOTAL])[rows])
    by_cause[KNEES] = total - np.sum(list(by_cause.values()), axis=0)
    least = NEGLIGIBLE_LOSS * np.abs(total).max()
    return {cause: lost for cause, lost in by_cause.items() if np.abs(lost).max() >= least}


def draw_losses(results: Results) -> Drawn:
    """Plot the losses in each step as a stacked bar. The caption gives the mean loss (J) by cause, without the first
    step."""
    by_cause = losses(walk_of(results[CONTACT_STAGE], CONTACT_LOOK))
    figure, axes = panels(2.9)
    steps = np.arange(1, 1 + min(SHOWN_STEPS, next(iter(by_cause.values())).size))
    below = np.zeros(steps.size)
    for (_, colour), lost in by_cause.items():
        axes.bar(steps, lost[: steps.size], 0.7, below, color=colour)
        below += lost[: steps.size]
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axes.set(xlabel="step", ylabel="energy lost (J)")
    add_legend(figure, [Patch(facecolor=colour, label=label) for label, colour in by_cause])
    # The first step does not begin with an impact, so it counts only if there is no other step.
    later = {label: float(lost[min(1, lost.size - 1) :].mean()) for (label, _), lost in by_cause.items()}
    return figure, (later, sum(later.values()))


OVERLAY_ROWS: Final[tuple[tuple[str, Any, str], ...]] = (
    ("angle", 0, "angle of leg 1 (rad)"),
    ("angle", 1, "angle of leg 2 (rad)"),
    ("mechanical_J", slice(None), "energy (J)"),
)
RUN_LOOKS: Final[tuple[dict[str, Any], ...]] = (
    {**RIGID_LOOK.line, "linewidth": 1.3},
    {**CONTACT_LOOK.line, "linewidth": 1.2},
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
GROUND = (
    Illustration("ground-forces", (FORCES,), draw_forces),
    Illustration("energy-lost", (ENERGY, STEPS_TAKEN[CONTACT_STAGE]), draw_losses),
)
