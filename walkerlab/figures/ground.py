"""What the ground does: its forces, held against the friction cone, and the energy that every step loses, by cause."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from walkerlab.figures.canvas import blank, entry, legend_above
from walkerlab.figures.illustration import Illustration, Need, Results
from walkerlab.figures.style import BLACK, BLUE, CONTACT, GREEN, GREY, LEGS, ORANGE, PURPLE
from walkerlab.figures.walks import (
    CONTACT_STAGE,
    NO_ENERGIES,
    STEPS_TAKEN_CONTACT,
    TRAJECTORY,
    Array,
    Walk,
    line,
    walk_of,
)

NORMAL, FRICTION = "normal_force_N", "friction_force_N"
FORCES = Need(CONTACT_STAGE, TRAJECTORY, (NORMAL, FRICTION), "'forces' is not among the config's outputs")
TOTAL: Final = "book_mechanical_J"
LOST: Final = {
    "dissipated_damping_J": ("damping of the ground", BLUE),
    "dissipated_friction_J": ("friction", ORANGE),
    "lost_at_edges_J": ("edges of pads", GREEN),
}
KNEES: Final = ("knees", PURPLE)
ENERGY = Need(CONTACT_STAGE, TRAJECTORY, (*LOST, TOTAL), NO_ENERGIES)
STRIDES, STEPS = 2, 40
"""That are shown: of forces, so that impacts are told apart, and of energies."""
OF_SAMPLES: Final = 0.99
"""Part of the loaded samples that is in sight: an impact's force is many times the weight."""
NOTHING: Final = 1e-3
"""Part of what is lost that is not drawn."""


def plot_forces(results: Results) -> Figure:
    """Both forces in time on the left, one against the other on the right."""
    walk = walk_of(results[CONTACT_STAGE], CONTACT).first(STRIDES)
    figure = blank(4.4)
    panels = figure.subplot_mosaic([["normal", "cone"], ["friction", "cone"]])
    normal, friction, cone = panels["normal"], panels["friction"], panels["cone"]
    top = in_sight(walk)
    steepest = draw_cone(cone, results, top)
    for leg, look in enumerate(LEGS):
        load, pull = walk[NORMAL][:, leg], walk[FRICTION][:, leg]
        line(normal, walk.time, load, look)
        line(friction, walk.time, pull, look)
        loaded = (load > 0.0) & (load < top)
        cone.plot(load[loaded], pull[loaded], linestyle="none", marker=".", markersize=1.6, color=look.colour, zorder=4)
    for axes, name, words, title in (
        (normal, NORMAL, "normal force", "(a) normal force"),
        (friction, FRICTION, "friction", "(b) friction, downhill positive"),
    ):
        axes.set_ylabel(walk.label(words, name))
        axes.set_title(title)
        axes.set_xlim(0.0, float(walk.time[-1]))
    normal.set_ylim(-0.03 * top, top)
    friction.sharex(normal)
    friction.set_xlabel("time (s)")
    normal.tick_params(labelbottom=False)
    reach = 1.1 * max(float(np.abs(walk[FRICTION][walk[NORMAL] < top]).max()), 1e-9)
    friction.set_ylim(-reach, reach)
    cone.set_xlim(0.0, top)
    cone.set_ylim(-max(reach, 0.6 * steepest * top), max(reach, 0.6 * steepest * top))
    cone.set_xlabel(walk.label("normal force", NORMAL))
    cone.set_ylabel(walk.label("friction", FRICTION))
    cone.set_title("(c) against the friction cone")
    legs: list[Artist] = [entry(look.label, **look.line) for look in LEGS]
    cones = [entry(label, color=BLACK, linewidth=1.0, linestyle=style) for label, style, _ in cone_of(results)]
    legend_above(figure, [*legs, *cones])
    return figure


def cone_of(results: Results) -> list[tuple[str, str, float]]:
    """The bounds of friction: label, style and coefficient; none where no foot feels any."""
    asked = results[CONTACT_STAGE].identity.config_slice["contact"]
    if not results[CONTACT_STAGE][TRAJECTORY][FRICTION].any():
        return []
    words = {"static": "-", "dynamic": "--"}
    return [
        (f"{name} coefficient, {asked[f'{name}_friction']:g}", style, float(asked[f"{name}_friction"]))
        for name, style in words.items()
    ]


def draw_cone(axes: Axes, results: Results, top: float) -> float:
    """The bounds of friction over the normal force; the largest coefficient."""
    for _, style, coefficient in cone_of(results):
        for sign in (-1.0, 1.0):
            axes.plot([0.0, top], [0.0, sign * coefficient * top], color=BLACK, linewidth=1.0, linestyle=style)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    return max((coefficient for *_, coefficient in cone_of(results)), default=0.0)


def in_sight(walk: Walk) -> float:
    """The normal force (N) up to which a figure shows it."""
    load = walk[NORMAL][walk[NORMAL] > 0.0]
    return 1.1 * float(np.quantile(load, OF_SAMPLES)) if load.size else 1.0


def say_forces(results: Results) -> str:
    """What is shown, how steep the force gets, and how large an impact's is."""
    walk = walk_of(results[CONTACT_STAGE], CONTACT)
    shown, load = walk.first(STRIDES), walk[NORMAL]
    borne = load > 0.1 * float(np.median(load.max(axis=1)))
    ratio = float((np.abs(walk[FRICTION][borne]) / load[borne]).max()) if borne.any() else 0.0
    extent = "" if shown is walk else f" over the first {STRIDES} strides"
    return (
        f"Forces of the contact model's ground on both feet{extent}. Where a foot bears a tenth of the weight or more, "
        f"friction is at most {ratio:.3g} of the normal force; impacts, which are cut off, reach {load.max():.4g} N."
    )


def losses(walk: Walk) -> dict[tuple[str, str], Array]:
    """Energy (J) that each step loses, by cause and its colour; what knees take is what no other cause explains."""
    # the last samples before touches: an impact falls between two samples, and is not to be divided among two steps
    rows = np.concatenate(([0], np.maximum(np.searchsorted(walk.time, walk.strikes) - 1, 0)))
    by_cause = {cause: np.diff(walk[name][rows]) for name, cause in LOST.items()}
    total = -np.diff(walk[TOTAL][rows])
    by_cause[KNEES] = total - np.sum(list(by_cause.values()), axis=0)
    return {cause: lost for cause, lost in by_cause.items() if np.abs(lost).max() >= NOTHING * np.abs(total).max()}


def plot_losses(results: Results) -> Figure:
    """A bar for each step, its causes on one another."""
    found = losses(walk_of(results[CONTACT_STAGE], CONTACT))
    figure = blank(2.9)
    axes = figure.subplots()
    steps = np.arange(1, 1 + min(STEPS, next(iter(found.values())).size))
    below = np.zeros(steps.size)
    for (_, colour), lost in found.items():
        axes.bar(steps, lost[: steps.size], 0.7, below, color=colour)
        below += lost[: steps.size]
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("step number (1)")
    axes.set_ylabel("energy lost (J)")
    legend_above(figure, [Patch(facecolor=colour, label=label) for label, colour in found])
    return figure


def say_losses(results: Results) -> str:
    """How much a step loses, and to what."""
    found = losses(walk_of(results[CONTACT_STAGE], CONTACT))
    later = {label: lost[min(1, lost.size - 1) :] for (label, _), lost in found.items()}
    total = sum(float(lost.mean()) for lost in later.values())
    parts = ", ".join(
        f"{100.0 * float(lost.mean()) / (total or 1.0):.3g} % to {label}" for label, lost in later.items()
    )
    return (
        "Energy that the contact model loses in each step; an impact counts to the step that it begins, so that the "
        f"first has none. The others lose {total:.4g} J in the mean: {parts}."
    )


FIGURES = (
    Illustration(
        "ground-forces",
        "Forces of the ground and the friction cone",
        (FORCES,),
        say_forces,
        plot_forces,
        seen="Two plots over time, one force above the other, and beside them friction against normal force in a cone.",
    ),
    Illustration(
        "energy-lost",
        "Energy lost step by step",
        (ENERGY, STEPS_TAKEN_CONTACT),
        say_losses,
        plot_losses,
        seen="A bar for each step, divided by what took the energy.",
    ),
)
