"""Figures of an identified walk: its steps, residuals, trade-off of parameters, and worth of the measurements."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.ticker import MaxNLocator

from walkerlab.labels import axis_label, unit_by_name
from walkerlab.pipeline.store.content import Group
from walkerlab.views.figures.canvas import add_legend, entry, label_of, panels
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results
from walkerlab.views.figures.style import BLACK, BLUE, GREY, ORANGE, PALE, VERMILLION

IDENTIFY_STAGE: Final = "identify"
NO_MEASURED_STEPS: Final = "it has no steps"
TWO_SIGMA: Final = 2.0
REGION_95: Final = 2.4477  # sqrt(-2 ln 0.05): semi-axis of the 95 % region of two parameters, in standard errors
STEP_PANEL_HEIGHT: Final = 1.7
MEASURED: Final = "measured_"
LEGS: Final = (("swing leg", BLUE), ("stance leg", VERMILLION))
MAX_RESIDUALS: Final = 4000  # residuals drawn of each leg


def quantities(steps: Group) -> list[str]:
    """Return the measured quantities: period, length, angle."""
    return sorted((name.removeprefix(MEASURED) for name in steps.variables if name.startswith(MEASURED)), reverse=True)


def named(quantity: str) -> str:
    return label_of(quantity.rpartition("_")[0].replace("_", " "), unit_by_name(quantity))


def draw_steps(results: Results) -> Drawn:
    """Plot measured steps over predicted ones; caption: number of steps and the share inside the bands."""
    steps = results[IDENTIFY_STAGE].groups["steps"]
    names, number = quantities(steps), 1 + steps["step"]
    figure, axes = panels(0.6 + STEP_PANEL_HEIGHT * len(names), len(names), sharex=True, squeeze=False)
    inside = []
    for panel, name in zip(axes[:, 0], names, strict=True):
        predicted, measured = steps[f"predicted_{name}"], steps[f"{MEASURED}{name}"]
        reach = TWO_SIGMA * steps[f"deviation_{name}"]
        panel.fill_between(number, predicted - reach, predicted + reach, color=BLUE, alpha=0.2, linewidth=0.0)
        panel.plot(number, predicted, color=BLUE, linewidth=1.0)
        panel.plot(number, measured, linestyle="none", marker="o", markersize=3.0, color=BLACK)
        panel.set_ylabel(named(name))
        inside.append(np.abs(measured - predicted) <= reach)
    axes[-1, 0].set_xlabel("step")
    axes[-1, 0].xaxis.set_major_locator(MaxNLocator(integer=True))
    key = [entry("measured", color=BLACK, marker="o", linestyle="none"), entry("predicted, ± 2 σ", color=BLUE)]
    add_legend(figure, key)
    return figure, (int(number.size), float(np.mean(inside)))


def draw_residuals(results: Results) -> Drawn:
    """Plot residuals per step, and of angles in phase; caption: number of steps, whether angles are among them."""
    groups = results[IDENTIFY_STAGE].groups
    steps, samples = groups["steps"], groups.get("samples")
    names, number = quantities(steps), 1 + steps["step"]
    rows = len(names) + (samples is not None)
    figure, axes = panels(0.6 + STEP_PANEL_HEIGHT * rows, rows, squeeze=False)
    for panel, name in zip(axes[:, 0], names, strict=False):
        scaled = (steps[f"{MEASURED}{name}"] - steps[f"predicted_{name}"]) / steps[f"deviation_{name}"]
        panel.axhspan(-TWO_SIGMA, TWO_SIGMA, color=PALE)
        panel.axhline(0.0, color=GREY, linewidth=0.7)
        panel.plot(number, scaled, linestyle="none", marker="o", markersize=3.0, color=BLACK)
        panel.set(xlabel="step", ylabel=f"{name.rpartition('_')[0].replace('_', ' ')} (σ)")
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    if samples is not None:
        panel, every = axes[-1, 0], max(1, samples["phase"].size // MAX_RESIDUALS)
        for leg, (_, colour) in enumerate(LEGS):
            residual = 1e3 * samples["residual_rad"][::every, leg]
            panel.plot(samples["phase"][::every], residual, linestyle="none", marker=".", markersize=1.5, color=colour)
        panel.axhline(0.0, color=GREY, linewidth=0.7)
        panel.set(xlabel="phase of the step", ylabel="angle (mrad)", xlim=(0.0, 1.0))
        add_legend(figure, [entry(name, color=colour, marker=".", linestyle="none") for name, colour in LEGS])
    return figure, (int(number.size), samples is not None)


def draw_trade_off(results: Results) -> Drawn:
    """Plot the 95 % region of the two parameters that trade off most; caption: their keys and correlation."""
    summary, covariance = results[IDENTIFY_STAGE].summary, results[IDENTIFY_STAGE].groups["covariance"]["covariance"]
    first, second = results[IDENTIFY_STAGE].groups["trade_off"]["pair"]
    rows = [summary["estimates"][place] for place in (first, second)]
    block = covariance[np.ix_((first, second), (first, second))]
    values, vectors = np.linalg.eigh(block)
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = REGION_95 * np.sqrt(np.maximum(values, 0.0))[:, None] * np.array([np.cos(angle), np.sin(angle)])
    outline = np.array([[row["value"]] for row in rows]) + vectors @ circle
    figure, axes = panels(3.6)
    axes.fill(*outline, color=BLUE, alpha=0.2, linewidth=0.0)
    axes.plot(*outline, color=BLUE)
    axes.plot(rows[0]["value"], rows[1]["value"], marker="o", color=BLACK)
    axes.set(**{f"{x}label": label_of(axis_label(row["key"]), row["unit"]) for x, row in zip("xy", rows, strict=True)})
    correlation = summary["correlations"]["matrix"][first][second]
    return figure, (rows[0]["key"], rows[1]["key"], float(correlation))


def draw_worth(results: Results) -> Drawn:
    """Plot the information that would be lost without each measured quantity; caption: the one worth most."""
    shares = results[IDENTIFY_STAGE].summary["contributions"]
    names = [name.rpartition("_")[0].replace("_", " ") for name in shares]
    figure, axes = panels(0.9 + 0.35 * len(names))
    axes.barh(names, [100.0 * share for share in shares.values()], 0.6, color=ORANGE)
    axes.set(xlabel="information lost without it (%)", xlim=(0.0, 100.0))
    axes.invert_yaxis()
    most = max(shares, key=lambda name: shares[name])
    return figure, (most.rpartition("_")[0].replace("_", " "), float(shares[most]))


STEPS = Need(IDENTIFY_STAGE, "steps", ("measured_step_period_s",), NO_MEASURED_STEPS)
FIGURES: Final = (
    Illustration("identified-steps", (STEPS,), draw_steps),
    Illustration("identified-residuals", (STEPS,), draw_residuals),
    Illustration(
        "identified-trade-off",
        (Need(IDENTIFY_STAGE, "trade_off", ("pair",), "fewer than two parameters are determined"),),
        draw_trade_off,
    ),
    Illustration("identified-worth", (STEPS,), draw_worth),
)  # fmt: skip
