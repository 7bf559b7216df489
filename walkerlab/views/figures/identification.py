"""Figures of an identification, and of a measurement plan."""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from walkerlab.labels import axis_label, unit_by_name
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.store.content import Group
from walkerlab.views.figures.canvas import add_legend, entry, label_of, panels
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results
from walkerlab.views.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, VERMILLION

IDENTIFY_STAGE: Final = "identify"
TWO_SIGMA: Final = 2.0
STEP_PANEL_HEIGHT: Final = 1.7
MEASURED: Final = "measured_"
LEG_LOOKS: Final = (("swing leg", BLUE), ("stance leg", VERMILLION))
MAX_RESIDUALS: Final = 4000  # approximate number of residuals plotted for each leg
PHASE_INTERVALS: Final = 25  # intervals of the step's phase over which residuals are averaged
MIN_NAMED_FRACTION: Final = 0.1
"""The name of a combination lists parameters whose change is at least this fraction of the largest one."""


def quantities(steps: Group) -> list[str]:
    """Return the names of the measured quantities: period, length, angle."""
    return sorted((name.removeprefix(MEASURED) for name in steps.variables if name.startswith(MEASURED)), reverse=True)


def draw_steps(results: Results) -> Drawn:
    """Plot the measured and the predicted values of each step. The caption gives the number of steps and the fraction
    inside the bands."""
    steps = results[IDENTIFY_STAGE].groups["steps"]
    names = quantities(steps)
    number = 1 + steps["step"]
    figure, axes = panels(0.6 + STEP_PANEL_HEIGHT * len(names), len(names), sharex=True, squeeze=False)
    inside = []
    for panel, name in zip(axes[:, 0], names, strict=True):
        predicted = steps[f"predicted_{name}"]
        measured = steps[f"{MEASURED}{name}"]
        reach = TWO_SIGMA * steps[f"deviation_{name}"]
        panel.fill_between(number, predicted - reach, predicted + reach, color=BLUE, alpha=0.2, linewidth=0.0)
        panel.plot(number, predicted, color=BLUE, linewidth=1.0)
        panel.plot(number, measured, linestyle="none", marker="o", markersize=3.0, color=BLACK)
        panel.set_ylabel(label_of(axis_label(name), unit_by_name(name)))
        inside.append(np.abs(measured - predicted) <= reach)
    axes[-1, 0].set_xlabel("step")
    axes[-1, 0].xaxis.set_major_locator(MaxNLocator(integer=True))
    key = [entry("measured", color=BLACK, marker="o", linestyle="none"), entry("predicted, ± 2 σ", color=BLUE)]
    add_legend(figure, key)
    return figure, (int(number.size), float(np.mean(inside)))


def draw_residuals(results: Results) -> Drawn:
    """Plot the residuals of each step and, if angles were measured, those of the angles over the phase of the step."""
    groups = results[IDENTIFY_STAGE].groups
    steps = groups["steps"]
    samples = groups.get("samples")
    names = quantities(steps)
    number = 1 + steps["step"]
    rows = len(names) + (samples is not None)
    figure, axes = panels(0.6 + STEP_PANEL_HEIGHT * rows, rows, squeeze=False)
    for panel, name in zip(axes[:, 0], names, strict=False):
        scaled = (steps[f"{MEASURED}{name}"] - steps[f"predicted_{name}"]) / steps[f"deviation_{name}"]
        panel.axhspan(-TWO_SIGMA, TWO_SIGMA, color=PALE)
        panel.axhline(0.0, color=GREY, linewidth=0.7)
        panel.plot(number, scaled, linestyle="none", marker="o", markersize=3.0, color=BLACK)
        panel.set(xlabel="step", ylabel=f"{axis_label(name)} (σ)")
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    if samples is not None:
        draw_residuals_in_phase(axes[-1, 0], samples)
    return figure, (int(number.size), samples is not None)


def draw_residuals_in_phase(panel: Axes, samples: Group) -> None:
    """Plot the residuals of the angles over the phase of the step, with their mean in each interval."""
    phase = samples["phase"]
    residual = 1e3 * samples["residual_rad"]
    every = max(1, phase.size // MAX_RESIDUALS)
    bins = np.minimum((PHASE_INTERVALS * phase).astype(int), PHASE_INTERVALS - 1)
    filled = np.unique(bins)
    for leg, (name, colour) in enumerate(LEG_LOOKS):
        look: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 1.5, "alpha": 0.35}
        panel.plot(phase[::every], residual[::every, leg], color=colour, **look)
        mean = [residual[bins == place, leg].mean() for place in filled]
        panel.plot((filled + 0.5) / PHASE_INTERVALS, mean, color=colour, linewidth=2.0, label=f"{name}, mean")
    panel.axhline(0.0, color=GREY, linewidth=0.7)
    panel.set(xlabel="phase of the step", ylabel="angle (mrad)", xlim=(0.0, 1.0))
    panel.legend(loc="upper right", ncols=2)


def draw_trade_off(results: Results) -> Drawn:
    """Plot the 95 % region of the two worst-determined combinations, in the plane of the two parameters that show it
    best."""
    rows, freedom = (results[IDENTIFY_STAGE].summary[name] for name in ("estimates", "degrees_of_freedom"))
    semi_axis = semi_axis_of_region(freedom)
    moves = results[IDENTIFY_STAGE].groups["worst"]["moves"]
    values = np.array([row["value"] for row in rows])
    relative = moves / np.where(values == 0.0, 1.0, np.abs(values))
    pair = max(combinations(range(len(rows)), 2), key=lambda pair: abs(float(np.linalg.det(relative[:, pair]))))
    centre = values[list(pair)]
    reach = semi_axis * moves[:, pair]
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    outline = centre[:, None] + reach.T @ np.array([np.cos(angle), np.sin(angle)])
    figure, axes = panels(3.9)
    axes.fill(*outline, color=BLUE, alpha=0.15, linewidth=0.0)
    axes.plot(*outline, color=BLUE, linewidth=0.8)
    worst, next_worst = (describe_combination(rows, semi_axis * move) for move in moves)
    key = []
    for move, name, style in zip(reach, (worst, next_worst), ("-", "--"), strict=True):
        axes.plot(*np.array([centre - move, centre + move]).T, color=BLACK, linewidth=1.2, linestyle=style)
        key.append(entry(name, color=BLACK, linewidth=1.2, linestyle=style))
    axes.plot(*centre, marker="o", markersize=4.0, color=BLACK)
    labels = (label_of(axis_label(rows[place]["key"]), rows[place]["unit"]) for place in pair)
    axes.set(**dict(zip(("xlabel", "ylabel"), labels, strict=True)))
    add_legend(figure, key)
    return figure, (worst, next_worst)


def semi_axis_of_region(freedom: float) -> float:
    """Return the semi-axis (standard errors) of a 95 % region of two parameters.

    It is sqrt(2 F), where F is the 95 % quantile of the F distribution with 2 and `freedom` degrees of freedom.
    """
    return math.sqrt(freedom * math.expm1(-2.0 / freedom * math.log(0.05)))


def describe_combination(rows: Sequence[Mapping[str, Any]], move: Floats) -> str:
    """Describe how the leading parameters change together, as in 'slope + 25 %, foot radius − 19 %'."""
    sizes = [move / (abs(row["value"]) or 1.0) for row, move in zip(rows, move.tolist(), strict=True)]
    largest = max(sizes, key=abs)
    parts = []
    for row, size in zip(rows, sizes, strict=True):
        if abs(size) >= MIN_NAMED_FRACTION * abs(largest):
            amount, unit = (100.0 * abs(size), "%") if row["value"] else (abs(size), row["unit"])
            text = np.format_float_positional(amount, 2, fractional=False, trim="-")
            sign = "+" if size * largest > 0.0 else "−"
            parts.append(f"{axis_label(row['key'])} {sign} {text} {'' if unit == '1' else unit}".rstrip())
    return ", ".join(parts)


def draw_worth(results: Results) -> Drawn:
    """Plot the information lost without each measured quantity. The caption names the most informative one."""
    shares = results[IDENTIFY_STAGE].summary["contributions"]
    names = [axis_label(name) for name in shares]
    figure, axes = panels(0.9 + 0.35 * len(names))
    axes.barh(names, [100.0 * share for share in shares.values()], 0.6, color=ORANGE)
    axes.set(xlabel="information lost without it (%)", xlim=(0.0, 100.0))
    axes.invert_yaxis()
    most = max(shares, key=lambda name: shares[name])
    return figure, (axis_label(most), float(shares[most]))


PANEL_INCHES: Final = 2.1
MEASUREMENT_COLOURS: Final = (BLUE, ORANGE, GREEN, VERMILLION)


def draw_errors(results: Results) -> Drawn:
    """Plot the standard error of each parameter over the number of steps, with a curve for each measurement and
    start."""
    summary = results["plan"].summary
    group = results["plan"].groups["errors"]
    rows = summary["measurements"]
    names = list(dict.fromkeys(row["measurement"] for row in rows))
    first_start = rows[0]["start"]
    entries = rows[0]["errors"]
    figure, axes = panels(0.9 + PANEL_INCHES * len(entries), len(entries), sharex=True, squeeze=False)
    for index, (panel, parameter) in enumerate(zip(axes[:, 0], entries, strict=True)):
        for row, errors in zip(rows, group["standard_error"], strict=True):
            style = "-" if row["start"] == first_start else "--"
            colour = MEASUREMENT_COLOURS[names.index(row["measurement"])]
            panel.loglog(group["steps"], errors[:, index], style, color=colour, marker=".", markersize=3.0)
        if "wanted" in parameter:
            panel.axhline(parameter["wanted"], color="black", linewidth=0.7, linestyle=":")
        panel.set_ylabel(label_of(f"± {axis_label(parameter['key'])}", parameter["unit"]))
    axes[-1, 0].set_xlabel("measured steps")
    key = [entry(name, color=colour) for name, colour in zip(names, MEASUREMENT_COLOURS, strict=True)]
    starts = [
        entry(start, color="black", linestyle=style)
        for start, style in zip((first_start, rows[-1]["start"]), ("-", "--"), strict=True)
    ]
    add_legend(figure, [*key, *starts])
    return figure, (int(summary["max_steps"]), any("wanted" in parameter for parameter in entries))


MEASURED_STEPS = Need(IDENTIFY_STAGE, "steps", ("measured_step_period_s",), "it has no steps")
WORST = Need(IDENTIFY_STAGE, "worst", ("moves",), "fewer than two combinations of parameters are determined")
PLANNED = Need("plan", "errors", ("standard_error",), "no errors were computed")
FIGURES: Final = (
    Illustration("identified-steps", (MEASURED_STEPS,), draw_steps),
    Illustration("identified-residuals", (MEASURED_STEPS,), draw_residuals),
    Illustration("identified-trade-off", (WORST,), draw_trade_off),
    Illustration("identified-worth", (MEASURED_STEPS,), draw_worth),
    Illustration("planned-errors", (PLANNED,), draw_errors),
)
