"""Figures of both models' walks: 5, 7 and 10 in time, 8 their difference, 9 their limit cycles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from walkerlab.figures.canvas import blank, entry, legend_above
from walkerlab.figures.illustration import Need, Results, paper_figure
from walkerlab.figures.style import BLACK, CONTACT, GREY, RIGID, VERMILLION, Look
from walkerlab.figures.walks import (
    COMPARE_STAGE,
    CONTACT_ENERGIES,
    CONTACT_STATES,
    NO_STATES,
    PAPER_STRIDES,
    RIGID_ENERGIES,
    RIGID_STAGE,
    RIGID_STATES,
    STEPS_TAKEN_RIGID,
    Array,
    Walk,
    in_time,
    legend,
    line,
    model_lines,
    redoes_the_paper,
    sentence,
    shade_stance,
    shown,
    stance_entry,
    strike_entry,
    time_axes,
    touch_times,
    walk_of,
    walks_with,
)
from walkerlab.labels import with_unit
from walkerlab.paper.printed import ANGLE_ERROR, VELOCITY_ERROR, Printed

TUNE_STAGE = "tune"
ADJUSTED = Need(TUNE_STAGE, "adjusted", ("time", "velocity"), "no start of those searched walks")
FROM_RIGID = Need(TUNE_STAGE, "rigid_start", ("time", "velocity"), "the rigid model took no step")


def adjusted_walks(results: Results) -> list[Walk]:
    """The rigid model from its start, the contact model from the adjusted one, as `tune` stored them."""
    result = results[TUNE_STAGE]
    outcome = str(result.summary["procedure"]["adjusted"]["outcome"])
    both = (("rigid_start", RIGID, "walked"), ("adjusted", CONTACT, outcome))
    times = {group: touch_times(result[group]) for group, *_ in both}
    return [Walk(look, end, times[group].size, times[group], result[group]) for group, look, end in both]


def redoes_the_procedure(results: Results) -> bool:
    """Whether the walker is the paper's compass, whose legs are links there."""
    return "paper_start" in results[TUNE_STAGE].summary


def plot_adjusted(results: Results) -> Figure:
    """A row for each link: called as in the paper if the walker is its compass, else by what it does first."""
    walks, _ = shown(adjusted_walks(results))
    named = redoes_the_procedure(results)
    links = ("link 1", "link 2") if named else ("the leg that swings first", "the leg that stands first")
    titles = [f"({'ab'[leg]}) angular velocity of {link}" for leg, link in enumerate(links)]
    figure, _ = in_time(walks, 1.9, [("velocity", "velocity", leg, title) for leg, title in enumerate(titles)])
    legend(figure, walks)
    return figure


def tell_adjusted(results: Results) -> tuple[Any, ...]:
    """What the start was, and how the walk went."""
    extent, links = shown(adjusted_walks(results))[1], redoes_the_procedure(results)
    return results[TUNE_STAGE].summary["adjustment"], extent, links


FIGURE_5 = paper_figure(5, (ADJUSTED, FROM_RIGID), plot_adjusted, tell_adjusted)

STATES_IN_TIME = (
    ("angle", "angle", 0, "(a1) angle of leg 1"),
    ("angle", "angle", 1, "(a2) angle of leg 2"),
    ("velocity", "velocity", 0, "(b1) angular velocity of leg 1"),
    ("velocity", "velocity", 1, "(b2) angular velocity of leg 2"),
)


def plot_states(results: Results) -> Figure:
    """A row for each leg's angle and each leg's angular velocity."""
    walks, _ = shown(walks_with(results, RIGID_STATES, CONTACT_STATES))
    figure, axes = in_time(walks, 1.55, STATES_IN_TIME)
    for one, (_, _, leg, _) in zip(axes, STATES_IN_TIME, strict=True):
        shade_stance(one, walks[0], leg)
    legend(figure, walks, stance_entry(walks[0].look))
    return figure


def tell_walks(rigid: Need, contact: Need, strides: int, results: Results) -> tuple[Any, ...]:
    """How much is shown, and how the walks went."""
    walks = walks_with(results, rigid, contact)
    return shown(walks, strides)[1], sentence(walks)


FIGURE_7 = paper_figure(
    7, (RIGID_STATES,), plot_states, partial(tell_walks, RIGID_STATES, CONTACT_STATES, PAPER_STRIDES)
)

AT_SAME_TIME: Final = Look("difference at the same time", VERMILLION, (0.0, (3.2, 1.4)), 1.2, "", order=3)
IN_PHASE: Final = Look("at the same phase of a step", BLACK, "-", 1.2, "", order=4)
PAPER: Final = Look("largest error in the paper", GREY, ":", 1.6, "", order=2)
ROOM = 3.0
"""Factor between what is shown of errors and the axis's ends."""
ZERO_CROSSING = 1e-3
"""Part of the largest error below which nothing is shown: where a difference changes its sign it is nothing."""


@dataclass(frozen=True)
class Quantity:
    """What of the legs is compared: variables of the stored errors, and the paper's number."""

    letter: str
    name: str
    raw: str
    aligned: str
    printed: Printed


QUANTITIES = (
    Quantity("a", "angle", "raw_angle_error_rad", "aligned_angle_error_rad", ANGLE_ERROR),
    Quantity("b", "angular velocity", "raw_velocity_error_rad_s", "aligned_velocity_error_rad_s", VELOCITY_ERROR),
)
RAW, ALIGNED = "errors", "aligned"
RAW_ERRORS = Need(COMPARE_STAGE, RAW, ("time", *(quantity.raw for quantity in QUANTITIES)), NO_STATES)
ALIGNED_ERRORS = Need(
    COMPARE_STAGE,
    ALIGNED,
    ("phase", *(quantity.aligned for quantity in QUANTITIES)),
    "no step was completed by both models",
)


def plot_differences(results: Results) -> Figure:
    """A row for each leg's angle and angular velocity, on logarithmic scales, over the rigid walk's steps."""
    (rigid,), _ = shown([walk_of(results[RIGID_STAGE], RIGID)])
    figure, axes = time_axes(4, 1.55, [rigid])
    rows = [(quantity, leg) for quantity in QUANTITIES for leg in (0, 1)]
    for one, (quantity, leg) in zip(axes, rows, strict=True):
        draw_errors(one, results, rigid, quantity, leg)
    looks = [AT_SAME_TIME, IN_PHASE, *([PAPER] if redoes_the_paper(results) else [])]
    legend_above(figure, [*(entry(look.label, **look.line) for look in looks), strike_entry(rigid.look)])
    return figure


def draw_errors(axes: Axes, results: Results, rigid: Walk, quantity: Quantity, leg: int) -> None:
    """One quantity's errors of one leg, with the largest error that the paper reports."""
    raw, aligned = results[COMPARE_STAGE][RAW], results[COMPARE_STAGE][ALIGNED]
    early = raw["time"] <= rigid.time[-1]
    raw_error = np.abs(raw[quantity.raw][early, leg])
    steps = min(rigid.strikes.size, aligned[quantity.aligned].shape[0])
    aligned_error = np.abs(aligned[quantity.aligned][:steps, :, leg])
    line(axes, raw["time"][early], raw_error, AT_SAME_TIME)
    begins = np.concatenate(([0.0], rigid.strikes[:-1]))
    for begin, end, error in zip(begins, rigid.strikes, aligned_error, strict=False):
        line(axes, begin + (end - begin) * aligned["phase"], error, IN_PHASE)
    largest, paper = max(float(raw_error.max()), float(aligned_error.max())), quantity.printed.value
    bottom, top = ZERO_CROSSING * largest, ROOM * largest
    if redoes_the_paper(results):
        axes.axhline(paper, **PAPER.line)
        bottom, top = min(paper / ROOM, bottom), max(ROOM * paper, top)
    axes.set_yscale("log", subs=[])
    axes.set(ylim=(bottom, top), ylabel=with_unit("error", raw.variables[quantity.raw].units))
    axes.set_title(f"({quantity.letter}{leg + 1}) {quantity.name} of leg {leg + 1}")


def tell_differences(results: Results) -> tuple[Any, ...]:
    """The largest errors of all that was compared, in both ways, and the paper's."""
    raw, aligned = results[COMPARE_STAGE][RAW], results[COMPARE_STAGE][ALIGNED]
    largest = [
        (of.name, np.abs(raw[of.raw]).max(), np.abs(aligned[of.aligned]).max(), raw.variables[of.raw].units)
        for of in QUANTITIES
    ]
    return largest, ANGLE_ERROR.text if redoes_the_paper(results) else ""


FIGURE_8 = paper_figure(8, (RAW_ERRORS, ALIGNED_ERRORS, STEPS_TAKEN_RIGID), plot_differences, tell_differences)

CYCLES = 20
"""Strides that are shown: a transient is over by then; more lines would only lie on one another."""
LAST_STRIDE = 2
"""Steps of it."""
EARLIER_WIDTH = 0.5
ARROW_LENGTH = 0.06
"""Of an arrow on the cycle, in parts of a step's samples."""


def plot_cycles(results: Results) -> Figure:
    """A phase plane for each leg, both on the same scales."""
    walks, _ = shown(walks_with(results, RIGID_STATES, CONTACT_STATES), CYCLES)
    figure = blank(4.2)
    axes = list(figure.subplots(1, 2, sharex=True, sharey=True))
    for leg, one in enumerate(axes):
        for walk in walks:
            show_cycles(one, walk, leg)
            mark_strikes(one, walk, leg)
        show_direction(one, walks[0], leg)
        one.set(title=f"({'ab'[leg]}) leg {leg + 1}", xlabel=walks[0].label("angle", "angle"))
    axes[0].set_ylabel(walks[0].label("angular velocity", "velocity"))
    earlier = any(walk.strikes.size > LAST_STRIDE for walk in walks)
    lines = [entry("strides before the last", color=GREY, linewidth=EARLIER_WIDTH)] if earlier else []
    faces = {"heel strike of this leg": GREY, "heel strike of the other leg": "white"}
    marks = [
        entry(label, linestyle="none", marker="o", markersize=4.5, color=GREY, markerfacecolor=face)
        for label, face in faces.items()
    ]
    legend_above(figure, [*model_lines(walks), *lines, *marks])
    return figure


def show_cycles(axes: Axes, walk: Walk, leg: int) -> None:
    """The last stride as the model's look has it, those before as thin lines under it."""
    angle, velocity = walk["angle"][:, leg], walk["velocity"][:, leg]
    axes.plot(angle, velocity, color=walk.look.colour, linewidth=EARLIER_WIDTH, zorder=walk.look.order - 2)
    last = walk.time >= (walk.strikes[-1 - LAST_STRIDE] if walk.strikes.size > LAST_STRIDE else 0.0)
    line(axes, angle[last], velocity[last], walk.look)


def mark_strikes(axes: Axes, walk: Walk, leg: int) -> None:
    """Mark the state just before each heel strike of the last stride: filled if the leg's own, open if not."""
    before = np.maximum(np.searchsorted(walk.time, walk.strikes[-LAST_STRIDE:]) - 1, 0)
    own, look = walk["stance_leg"][before] != leg, walk.look
    for rows, face in ((before[own], look.colour), (before[~own], "white")):
        axes.plot(
            walk["angle"][rows, leg], walk["velocity"][rows, leg], linestyle="none", marker=look.marker, markersize=4.5,
            markerfacecolor=face, markeredgecolor=look.colour, zorder=look.order + 2,
        )  # fmt: skip


def show_direction(axes: Axes, walk: Walk, leg: int) -> None:
    """Arrowheads in the middle of the first swing and the first stance of a leg."""
    carries = walk["stance_leg"] == leg
    for phase in (carries, ~carries):
        rows = np.flatnonzero(phase)
        first = rows[: np.argmax(np.diff(rows, append=rows[-1] + 2) > 1) + 1] if rows.size else rows
        if first.size < 3:
            continue
        middle, ahead = first[first.size // 2], first[first.size // 2 + max(1, int(ARROW_LENGTH * first.size))]
        tail, head = (tuple(walk[name][row, leg] for name in ("angle", "velocity")) for row in (middle, ahead))
        arrow = {"arrowstyle": "-|>", "color": walk.look.colour, "mutation_scale": 13.0, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", xy=head, xytext=tail, arrowprops=arrow, zorder=7)


FIGURE_9 = paper_figure(9, (RIGID_STATES,), plot_cycles, partial(tell_walks, RIGID_STATES, CONTACT_STATES, CYCLES))

ENERGIES_IN_TIME = (
    ("kinetic_J", "energy", None, "(a) kinetic energy"),
    ("potential_J", "energy", None, "(b) potential energy, from the current stance foot"),
    ("mechanical_J", "energy", None, "(c) mechanical energy, the sum of both"),
)
SMALLEST_SPAN = 0.005
"""Of the axis of the mechanical energy, in parts of it: a constant must look constant."""
MARGIN = 0.08
FEW = 0.005
"""Part of the samples that lie within impacts."""


def plot_energies(results: Results) -> Figure:
    """A row for each energy."""
    walks, _ = shown(walks_with(results, RIGID_ENERGIES, CONTACT_ENERGIES))
    figure, axes = in_time(walks, 1.75, ENERGIES_IN_TIME)
    span_without_impacts(axes[-1], [walk["mechanical_J"] for walk in walks])
    legend(figure, walks)
    return figure


def span_without_impacts(axes: Axes, energies: list[Array]) -> None:
    """Span all but the few samples inside impacts, and at least a visible part of the energy itself."""
    bottom = min(float(np.quantile(energy, FEW)) for energy in energies)
    top = max(float(np.quantile(energy, 1.0 - FEW)) for energy in energies)
    lacking = max(0.0, SMALLEST_SPAN * max(abs(bottom), abs(top)) - (top - bottom))
    room = 0.5 * lacking + MARGIN * (top - bottom)
    axes.set_ylim(bottom - room, top + room)


def tell_energies(results: Results) -> tuple[Any, ...]:
    """How much is shown, the means of the mechanical energy, and how the walks went."""
    walks = walks_with(results, RIGID_ENERGIES, CONTACT_ENERGIES)
    cut, extent = shown(walks)
    means = [(walk.look.label, mean_energy(walk)) for walk in cut]
    return extent, means, redoes_the_paper(results), any(walk.look is CONTACT for walk in walks), sentence(walks)


def mean_energy(walk: Walk) -> float:
    """Time mean of the mechanical energy (J) over what is shown."""
    energy, time = walk["mechanical_J"], walk.time
    duration = float(time[-1] - time[0])
    mean = np.sum(0.5 * (energy[1:] + energy[:-1]) * np.diff(time))
    return float(mean) / duration if duration else float(energy[0])


FIGURE_10 = paper_figure(10, (RIGID_ENERGIES,), plot_energies, tell_energies)
FIGURES = (FIGURE_5, FIGURE_7, FIGURE_8, FIGURE_9, FIGURE_10)
