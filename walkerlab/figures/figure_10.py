"""Figure 10: kinetic, potential and mechanical energy in time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.in_time import legend, line, time_axes
from walkerlab.figures.needs import Results
from walkerlab.figures.style import CONTACT
from walkerlab.figures.walks import CONTACT_ENERGIES, RIGID_ENERGIES, Array, Walk, sentence, shown, walks_with

ROWS = (
    ("kinetic_J", "(a) kinetic energy"),
    ("potential_J", "(b) potential energy, from the current stance foot"),
    ("mechanical_J", "(c) mechanical energy, the sum of both"),
)
SMALLEST_SPAN = 0.005
"""Of the axis of the mechanical energy, in parts of it: a constant must look constant."""
MARGIN = 0.08
FEW = 0.005
"""Part of the samples that lie within impacts."""


IMPACTS = (
    "From a touch to the end of its impact, a few milliseconds, the contact model has the energy of the old step over "
    "the new foothold: peaks that the samples catch in part. "
)


def plot(results: Results) -> Figure:
    """A row for each energy."""
    walks, _ = shown(walks_with(results, RIGID_ENERGIES, CONTACT_ENERGIES))
    figure, axes = time_axes(3, 1.75, walks)
    for one, (name, title) in zip(axes, ROWS, strict=True):
        for walk in walks:
            line(one, walk.time, walk[name], walk.look)
        one.set_ylabel("energy (J)")
        one.set_title(title)
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


def caption(results: Results) -> str:
    """What is shown, and the means of the mechanical energy."""
    walks = walks_with(results, RIGID_ENERGIES, CONTACT_ENERGIES)
    cut, extent = shown(walks)
    means = ", ".join(f"{walk.look.label} {mean_energy(walk):.5g} J" for walk in cut)
    return (
        f"Energies of the whole walker{extent}, the potential one from the current stance foot. "
        f"Time mean of the mechanical energy: {means}. "
        f"{IMPACTS if any(walk.look is CONTACT for walk in walks) else ''}{sentence(walks)}"
    )


def mean_energy(walk: Walk) -> float:
    """Time mean of the mechanical energy (J) over what is shown."""
    energy, time = walk["mechanical_J"], walk.time
    duration = float(time[-1] - time[0])
    if duration == 0.0:
        return float(energy[0])
    return float(np.sum(0.5 * (energy[1:] + energy[:-1]) * np.diff(time))) / duration


SEEN = (
    "Three plots over time: kinetic energy with a peak at each heel strike, potential energy with a dip "
    "there, and their sum."
)
FIGURE = paper_figure(10, "Kinetic, potential and mechanical energy", (RIGID_ENERGIES,), caption, plot, SEEN)
