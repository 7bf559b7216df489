"""Figures of ground forces, with the friction cone, and of the causes of the energy lost in each step."""

from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from walkerlab.labels import CONTACT_STAGE
from walkerlab.physics.energy_channels import KNEE_STRIKES, LOSSES, SAMPLED
from walkerlab.views.figures.canvas import add_legend, blank, entry, panels
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results
from walkerlab.views.figures.style import BLACK, CONTACT_LOOK, GREY, LEGS
from walkerlab.views.figures.walks import NO_ENERGIES, STEPS_TAKEN_CONTACT, TRAJECTORY, Array, DrawnWalk, line, walk_of

NORMAL_FORCE = "normal_force_N"
FRICTION = "friction_force_N"
FORCES = Need(CONTACT_STAGE, TRAJECTORY, (NORMAL_FORCE, FRICTION), "'forces' is not among the config's outputs")
TOTAL: Final = "total_energy_J"
LOSS_STYLES: Final = {loss.variable: (loss.cause, loss.colour) for loss in SAMPLED.values()}
DRIVE_LOSSES: Final = ("push_off_J", "hip_J")
KNEES: Final = (LOSSES[KNEE_STRIKES].cause, LOSSES[KNEE_STRIKES].colour)
ENERGY = Need(CONTACT_STAGE, TRAJECTORY, (*LOSS_STYLES, TOTAL), NO_ENERGIES)
SHOWN_STRIDES = 2
"""Number of strides in the figure of forces. With more of them, single impacts could not be told apart."""
SHOWN_STEPS = 40
"""Number of steps in the figure of energy losses."""
SHOWN_LOADS: Final = 0.99
"""The force axis covers this fraction of the loaded samples. It leaves out impacts of many times the weight."""
NEGLIGIBLE_LOSS: Final = 1e-3
"""Fraction of the energy lost below which a cause is not drawn."""


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
    normal = parts["normal"]
    friction = parts["friction"]
    cone = parts["cone"]
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
    for leg, look in enumerate(LEGS):
        load = loads[:, leg]
        pull = pulls[:, leg]
        line(normal, walk.time, load, look)
        line(friction, walk.time, pull, look)
        loaded = (load > 0.0) & (load < top)
        cone.plot(load[loaded], pull[loaded], linestyle="none", marker=".", markersize=1.6, color=look.colour, zorder=4)
    # Otherwise the axis would begin and end at zero if there is no friction.
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
    """Return the energy (J) lost in each step by cause (label, colour). What no other cause explains is lost in the
    knees."""
    # Steps are divided at the last sample before a touchdown, so that the whole impact belongs to the step that it
    # starts.
    rows = np.concatenate(([0], np.maximum(np.searchsorted(walk.time, walk.strikes) - 1, 0)))
    by_cause = {cause: np.diff(walk[name][rows]) for name, cause in LOSS_STYLES.items()}
    supplied = np.sum([walk[name] for name in DRIVE_LOSSES if name in walk.samples.variables], axis=0)
    total = np.diff((supplied - walk[TOTAL])[rows])
    by_cause[KNEES] = total - np.sum(list(by_cause.values()), axis=0)
    return {
        cause: lost for cause, lost in by_cause.items() if np.abs(lost).max() >= NEGLIGIBLE_LOSS * np.abs(total).max()
    }


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


FIGURES = (
    Illustration("ground-forces", (FORCES,), draw_forces),
    Illustration("energy-lost", (ENERGY, STEPS_TAKEN_CONTACT), draw_losses),
)
