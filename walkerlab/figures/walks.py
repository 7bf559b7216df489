"""The walks of both models as figures show them: out of the stored results, and over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from walkerlab.figures.canvas import blank, entry, legend_above
from walkerlab.figures.illustration import Need, Results
from walkerlab.figures.style import CONTACT, PALE, RIGID, Look
from walkerlab.labels import with_unit
from walkerlab.store.content import Content, Group

Array = NDArray[np.float64]

RIGID_STAGE, CONTACT_STAGE, COMPARE_STAGE = "simulate", "contact-sim", "compare"
TRAJECTORY, STEPS = "trajectory", "steps"
STATES = ("time", "angle", "velocity", "stance_leg")
JOINTS = ("hip_along_m", "hip_height_m", "foot_along_m", "foot_height_m")
ENERGIES = ("time", "kinetic_J", "potential_J", "mechanical_J")

NO_STATES = "'states' is not among the config's outputs"
NO_ENERGIES = "'energies' is not among the config's outputs"
NO_STEP = "no step was completed"
TOUCHES = "touch_time_s"

RIGID_STATES = Need(RIGID_STAGE, TRAJECTORY, STATES, NO_STATES)
RIGID_ENERGIES = Need(RIGID_STAGE, TRAJECTORY, ENERGIES, NO_ENERGIES)
STEPS_TAKEN_RIGID = Need(RIGID_STAGE, STEPS, (TOUCHES, "touch_along_m"), NO_STEP)
CONTACT_STATES = Need(CONTACT_STAGE, TRAJECTORY, STATES, NO_STATES)
CONTACT_ENERGIES = Need(CONTACT_STAGE, TRAJECTORY, ENERGIES, NO_ENERGIES)
STEPS_TAKEN_CONTACT = Need(CONTACT_STAGE, STEPS, (TOUCHES, "touch_along_m"), NO_STEP)

PAPER_STRIDES = 5
"""Strides that the paper's figures in time show; a longer walk's figures show its first ones."""
STRIKE_WIDTH = 0.6


def redoes_the_paper(results: Results) -> bool:
    """Whether the scene is the paper's own; of any other, figures say nothing of the paper."""
    return COMPARE_STAGE in results and not results[COMPARE_STAGE].summary.get("departures")


@dataclass(frozen=True, eq=False)
class Walk:
    """A walk in time.

    look      of its model
    outcome   how it ended
    steps     how many steps it has in all
    strikes   (shown steps,) s, times of the heel strikes
    time      (samples,) s
    samples   what was stored over time
    end       number of the samples that are shown; None for all
    """

    look: Look
    outcome: str
    steps: int
    strikes: Array
    samples: Group
    end: int | None = None

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A variable of the trajectory, such as 'angle' (samples, 2)."""
        return self.samples[name][: self.end]

    @property
    def time(self) -> Array:
        """Of the samples (s)."""
        return self["time"]

    def label(self, words: str, name: str) -> str:
        """A variable on an axis."""
        return with_unit(words, self.samples.variables[name].units)

    def first(self, strides: int) -> Walk:
        """Its first strides; the walk itself if it has no more."""
        strikes = self.strikes[: 2 * strides]
        if strikes.size == self.strikes.size:
            return self
        end = int(np.searchsorted(self.time, strikes[-1], side="right"))
        return Walk(self.look, self.outcome, self.steps, strikes, self.samples, end)

    @property
    def described(self) -> str:
        """How it went, in words: 'the rigid model walked 10 steps'."""
        count = f"{self.steps} step" + ("" if self.steps == 1 else "s")
        if self.outcome == "walked":
            return f"the {self.look.label} walked {count}"
        return f"the {self.look.label} took {count} ({self.outcome})"


def walks_with(results: Results, rigid: Need, contact: Need) -> list[Walk]:
    """The walks of the models whose results have what is needed, the rigid model's first."""
    both = ((rigid, RIGID), (contact, CONTACT))
    return [walk_of(results[need.stage], look) for need, look in both if need.missing_in(results, {}) is None]


def walk_of(result: Content, look: Look) -> Walk:
    """The walk that a stage has stored."""
    times = touch_times(result.groups.get(STEPS, Group({})))
    return Walk(look, str(result.summary["outcome"]), times.size, times, result[TRAJECTORY])


def touch_times(steps: Group) -> Array:
    """Times of the heel strikes (s); none if no step was completed."""
    return steps[TOUCHES] if TOUCHES in steps.variables else np.zeros(0)


def sentence(walks: list[Walk]) -> str:
    """How the walks went, as a sentence."""
    text = ", ".join(walk.described for walk in walks)
    return text[:1].upper() + text[1:] + "."


def shown(walks: list[Walk], strides: int = PAPER_STRIDES) -> tuple[list[Walk], str]:
    """The walks' first strides, and a phrase on how much that is: '' if it is all, ' (the first 5 strides)' if not."""
    cut = [walk.first(strides) for walk in walks]
    whole = all(short is walk for short, walk in zip(cut, walks, strict=True))
    return cut, "" if whole else f" (the first {strides} strides)"


def time_axes(rows: int, row_height: float, walks: list[Walk]) -> tuple[Figure, list[Axes]]:
    """A figure of axes that share the time axis, with the walks' heel strikes across all of them."""
    figure = blank(0.85 + rows * row_height)
    axes = list(figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0])
    for one in axes:
        for walk in walks:
            look, across = walk.look, one.get_xaxis_transform()
            one.vlines(walk.strikes, 0.0, 1.0, look.colour, look.style, transform=across, lw=STRIKE_WIDTH, zorder=1.5)
    end = max(float(walk.time[-1]) for walk in walks)
    if end > 0.0:
        axes[-1].set_xlim(0.0, 1.01 * end)
    axes[-1].set_xlabel("time (s)")
    figure.align_ylabels(axes)
    return figure, axes


def in_time(
    walks: list[Walk], row_height: float, rows: Sequence[tuple[str, str, int | None, str]]
) -> tuple[Figure, list[Axes]]:
    """Variables of walks in time, below one another.

    rows  for each the variable, what its axis says, its leg (None: it has none), and the title
    """
    figure, axes = time_axes(len(rows), row_height, walks)
    for one, (name, words, leg, title) in zip(axes, rows, strict=True):
        for walk in walks:
            line(one, walk.time, walk[name] if leg is None else walk[name][:, leg], walk.look)
        one.set(ylabel=walks[0].label(words, name), title=title)
    return figure, axes


def line(axes: Axes, x: Array, y: Array, look: Look) -> None:
    """A series as its look has it."""
    axes.plot(x, y, **look.line, zorder=look.order)


def shade_stance(axes: Axes, walk: Walk, leg: int) -> None:
    """Shade the times in which a leg carries the walker."""
    carries = np.asarray(walk["stance_leg"] == leg, dtype=np.int64)
    edges = np.diff(carries, prepend=0, append=0)
    for begin, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        axes.axvspan(walk.time[begin], walk.time[end - 1], color=PALE, linewidth=0.0, zorder=0.5)


def strike_entry(look: Look) -> Artist:
    """Legend entry of a model's heel strikes: upright, as they are in the figure."""
    label = f"heel strike, {look.label.split()[0]}"
    return entry(label, color=look.colour, linestyle="none", marker="|", markersize=11.0, markeredgewidth=STRIKE_WIDTH)


def stance_entry(look: Look) -> Artist:
    """Legend entry of the shading by one model's stance phases."""
    return Patch(facecolor=PALE, edgecolor="none", label=f"stance of the leg, {look.label.split()[0]}")


def model_lines(walks: list[Walk]) -> list[Artist]:
    """Legend entries of the models."""
    return [entry(walk.look.label, **walk.look.line) for walk in walks]


def legend(figure: Figure, walks: list[Walk], *more: Artist) -> None:
    """The legend of a figure of walks, above all axes."""
    legend_above(figure, [*model_lines(walks), *(strike_entry(walk.look) for walk in walks), *more])
