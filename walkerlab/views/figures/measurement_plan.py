"""Figure of a measurement plan: expected errors over the number of steps."""

from __future__ import annotations

from typing import Final

from walkerlab.labels import axis_label
from walkerlab.views.figures.canvas import add_legend, entry, label_of, panels
from walkerlab.views.figures.illustration import Drawn, Illustration, Need, Results
from walkerlab.views.figures.style import BLUE, GREEN, ORANGE, VERMILLION

PANEL_INCHES: Final = 2.1
MEASUREMENT_COLOURS: Final = (BLUE, ORANGE, GREEN, VERMILLION)


def draw_errors(results: Results) -> Drawn:
    """Plot the standard error of each parameter over the number of steps, a curve for each measurement and start."""
    summary = results["plan"].summary
    group = results["plan"].groups["errors"]
    rows = summary["measurements"]
    names = list(dict.fromkeys(row["measurement"] for row in rows))
    first_start = rows[0]["start"]
    entries = rows[0]["errors"]
    figure, axes = panels(0.9 + PANEL_INCHES * len(entries), len(entries), sharex=True, squeeze=False)
    for place, (panel, parameter) in enumerate(zip(axes[:, 0], entries, strict=True)):
        for row, errors in zip(rows, group["standard_error"], strict=True):
            style = "-" if row["start"] == first_start else "--"
            colour = MEASUREMENT_COLOURS[names.index(row["measurement"])]
            panel.loglog(group["steps"], errors[:, place], style, color=colour, marker=".", markersize=3.0)
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


FIGURES: Final = (
    Illustration(
        "planned-errors", (Need("plan", "errors", ("standard_error",), "no errors were computed"),), draw_errors
    ),
)  # fmt: skip
